"""Transport capacity: trains per hour against scheduled speed, and where the controllers stand."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from kankaku.analysis.figures.style import BOOKED, INK, PALETTE, colour, plain_frame, spread, style
from kankaku.analysis.tables.capacity_tables import LEVELS, CapacityAssessment
from kankaku.analysis.words import KMH_PER_MPS, label_of

TARGETS = (
    ("A", 30.0, (120.0, 150.0)),
    ("B", 40.0, (90.0, 120.0)),
    ("C", 50.0, (60.0, 60.0)),
)
"""Level, scheduled speed and headways aimed at (Takaoka et al. 1991, table 1). [-], [km/h], [s]"""
SPEEDS_KMH = (20.0, 64.0)
TRAINS_PER_HOUR = (10.0, 66.0)
HEADWAYS_S = (60, 70, 80, 90, 100, 120, 150, 180, 240, 300)
NAMED_AT_KMH = 60.0
MARKERS = ("o", "D", "s")
"""Of controllers beyond the palette."""
TARGET = "#C9B36B"
PAPER = {"facecolor": "white", "edgecolor": "none", "pad": 1.2, "alpha": 0.85}
"""Behind labels that lines would cross."""
_CAP = 0.3
"""So that a target of one headway can be seen, too. [1/h]"""
_LABEL_GAP = 2.6
"""Smallest distance between two labels, in trains per hour. [1/h]"""


def capacity_figure(assessments: Sequence[CapacityAssessment], *, title: str) -> Figure:
    """
    Draw where some controllers stand between the curves of constant transport capacity.

    Parameters
    ----------
    assessments
        One per controller.
    title
        Title of the figure.

    Returns
    -------
    Figure
        Scheduled speed across, trains per hour upwards, headways at the right edge.

    References
    ----------
    .. [1] Takaoka et al. 1991, fig. 1.
    """
    with style():
        figure = Figure(figsize=(7.6, 5.4), layout="constrained")
        axes = figure.subplots()
        axes.set_xlim(*SPEEDS_KMH)
        axes.set_ylim(*_range(assessments))
        plain_frame(axes)
        _draw_levels(axes)
        _draw_targets(axes)
        _draw_controllers(axes, assessments)
        _headway_axis(axes)
        axes.set_xlabel("scheduled speed, dwells included [km/h]")
        axes.set_ylabel("trains per hour")
        axes.set_title(title, loc="left", fontsize=11.0)
    return figure


def _range(assessments: Sequence[CapacityAssessment]) -> tuple[float, float]:
    trains = [3600.0 / found.headway_s for found in assessments]
    return min(TRAINS_PER_HOUR[0], *trains) - 1.0, max(TRAINS_PER_HOUR[1], *trains) + 1.0


def _draw_levels(axes: Axes) -> None:
    speeds_kmh = np.linspace(*SPEEDS_KMH, 200)
    for name, capacity in LEVELS.items():
        axes.plot(speeds_kmh, capacity / speeds_kmh, color=BOOKED, linewidth=1.0, zorder=1.5)
        axes.text(
            NAMED_AT_KMH,
            capacity / NAMED_AT_KMH,
            f"{name}  {capacity:,.0f}",
            ha="center",
            va="center",
            fontsize=7.5,
            color=INK,
            bbox=PAPER,
        )
    axes.text(
        0.012,
        0.02,
        "grey: the same transport capacity, scheduled speed times trains per hour",
        transform=axes.transAxes,
        fontsize=7.5,
    )


def _draw_targets(axes: Axes) -> None:
    for name, speed_kmh, headways_s in TARGETS:
        trains = [3600.0 / headway_s for headway_s in headways_s]
        axes.plot(
            [speed_kmh, speed_kmh],
            [min(trains) - _CAP, max(trains) + _CAP],
            color=TARGET,
            linewidth=9.0,
            solid_capstyle="butt",
            alpha=0.75,
            zorder=1.8,
        )
        seconds = " to ".join(f"{value:.0f}" for value in dict.fromkeys(headways_s))
        axes.annotate(
            f"target {name}\n{seconds} s",
            (speed_kmh, max(trains)),
            xytext=(-9.0, 0.0),
            textcoords="offset points",
            ha="right",
            va="center",
            fontsize=7.5,
            color="#7A6A2B",
            bbox=PAPER,
        )


def _draw_controllers(axes: Axes, assessments: Sequence[CapacityAssessment]) -> None:
    places: dict[tuple[float, float], list[CapacityAssessment]] = {}
    for found in assessments:
        place = round(found.headway_s, 1), round(found.scheduled_speed_mps, 2)
        places.setdefault(place, []).append(found)
    groups = list(places.values())
    points = sorted(
        (3600.0 / group[0].headway_s, KMH_PER_MPS * group[0].scheduled_speed_mps, number)
        for number, group in enumerate(groups)
    )
    texts = spread(np.array([trains for trains, _, _ in points]), _LABEL_GAP)
    right_kmh = max(speed_kmh for _, speed_kmh, _ in points) + 1.6
    for (trains, speed_kmh, number), text in zip(points, texts.tolist(), strict=True):
        first, *others = groups[number]
        index = assessments.index(first)
        shade, marker = colour(index), MARKERS[index // len(PALETTE) % len(MARKERS)]
        axes.plot(speed_kmh, trains, marker, color=shade, markersize=6.5, zorder=4.0)
        axes.plot(
            [speed_kmh, right_kmh - 0.6, right_kmh],
            [trains, text, text],
            color=shade,
            linewidth=0.7,
            zorder=3.0,
        )
        more = f" and {len(others)} more" if others else ""
        axes.text(
            right_kmh + 0.3,
            text,
            f"{label_of(first.controller)}{more}: {first.headway_s:.0f} s",
            va="center",
            color=shade,
            fontweight="bold",
            zorder=4.0,
            bbox=PAPER,
        )


def _headway_axis(axes: Axes) -> None:
    right = axes.twinx()
    right.set_ylim(*axes.get_ylim())
    low, high = axes.get_ylim()
    shown = [value for value in HEADWAYS_S if low <= 3600.0 / value <= high]
    right.yaxis.set_major_locator(FixedLocator([3600.0 / value for value in shown]))
    right.yaxis.set_minor_locator(NullLocator())
    right.yaxis.set_major_formatter(FuncFormatter(lambda trains, _: f"{3600.0 / trains:.0f}"))
    right.set_ylabel("headway [s]")
    right.spines[["top", "left"]].set_visible(False)
