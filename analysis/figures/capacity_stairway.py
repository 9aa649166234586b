"""Blocking-time stairways: what trains keep for themselves, moved together until they touch."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, MultipleLocator

from kankaku.analysis.figures.style import INK, colour, station_axis, style
from kankaku.analysis.tables.capacity_tables import CapacityAssessment, distinct
from kankaku.analysis.words import label_of

PANEL_WIDTH_IN = 5.6
PANEL_HEIGHT_IN = 3.9
MOST_PANELS = 4
TRAINS = 3
_SHADES = (0.5, 0.28)
"""Neighbouring stairways differ. [-]"""
_FEW = 100
"""So many stretches on a panel are drawn one by one. [-]"""


def stairway_figure(
    assessments: Sequence[CapacityAssessment], stations: pd.DataFrame, *, title: str
) -> Figure:
    """
    Draw three trains around the critical station, moved together until their stairways touch.

    Parameters
    ----------
    assessments
        One per controller; controllers with the same headways share a panel.
    stations
        The table ``stations``.
    title
        Title of the figure.

    Returns
    -------
    Figure
        Time across, chainage upwards; a panel for each of the first four protections.
    """
    groups = distinct(assessments)[:MOST_PANELS]
    columns = min(len(groups), 2)
    lines = -(-len(groups) // columns)
    places = [_place(group[0]) for group in groups]
    low_m, high_m = min(low for low, _ in places), max(high for _, high in places)
    with style():
        size = (1.3 + PANEL_WIDTH_IN * columns, 1.2 + PANEL_HEIGHT_IN * lines)
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
        for index, (group, axes) in enumerate(zip(groups, panels.flat, strict=False)):
            shade = colour(assessments.index(group[0]))
            _draw_panel(axes, group[0], (low_m, high_m), shade)
            _frame(axes, group, (low_m, high_m), shade, stations)
            station_axis(
                axes,
                _near(stations, low_m, high_m),
                labels=index % columns == 0,
                gap_m=0.04 * (high_m - low_m),
            )
            lowest = index + columns >= len(groups)
            axes.tick_params(axis="x", labelbottom=lowest)
            if lowest:
                axes.set_xlabel("time [min]")
        for axes in list(panels.flat)[len(groups) :]:
            axes.set_axis_off()
        panels.flat[0].set_xlim(*_span_s([group[0] for group in groups], low_m, high_m))
        figure.suptitle(title, fontsize=12.0)
        figure.legend(handles=_legend(), loc="outside lower center", ncols=3)
    return figure


def _touching(found: CapacityAssessment) -> int:
    """Return the call on the way to which stairways touch first."""
    return 1 + int(found.by_theory_s.argmax())


def _place(found: CapacityAssessment) -> tuple[float, float]:
    """Return the stretch from the call before the critical one to the call behind it. [m]"""
    calls = found.service.calls
    call = _touching(found)
    before, behind = calls[call - 1], calls[min(call + 1, len(calls) - 1)]
    edge_m = 0.08 * (behind.stop_m - before.stop_m)
    return before.stop_m - edge_m, behind.stop_m + edge_m


def _near(stations: pd.DataFrame, low_m: float, high_m: float) -> pd.DataFrame:
    return stations[stations["chainage_m"].between(low_m, high_m)]


def _origin_s(found: CapacityAssessment) -> float:
    """Return when the first train departs towards the critical station. [s]"""
    return float(found.journey.departure_s[_touching(found) - 1])


def _span_s(
    shown: Sequence[CapacityAssessment], low_m: float, high_m: float
) -> tuple[float, float]:
    """Return the time that the first and the last train take through the place. [s]"""
    begins_s, ends_s = [], []
    for found in shown:
        edges_m = found.stretches.edges_m
        inside = (edges_m[1:] > low_m) & (edges_m[:-1] < high_m) & np.isfinite(found.begin_s)
        origin_s = _origin_s(found)
        begins_s.append(float(found.begin_s[inside].min()) - origin_s)
        last_s = float(found.end_s[inside].max()) + (TRAINS - 1) * found.by_theory_s.max()
        ends_s.append(last_s - origin_s)
    return min(begins_s) - 15.0, max(ends_s) + 15.0


def _draw_panel(
    axes: Axes, found: CapacityAssessment, place_m: tuple[float, float], shade: str
) -> None:
    edges_m = found.stretches.edges_m
    first = max(int(np.searchsorted(edges_m, place_m[0])) - 1, 0)
    last = int(np.searchsorted(edges_m, place_m[1]))
    kept = slice(first, min(last, found.begin_s.size))
    starts_m, ends_m = edges_m[:-1][kept], edges_m[1:][kept]
    begin_s, end_s = found.begin_s[kept], found.end_s[kept]
    few = starts_m.size <= _FEW and not found.stretches.names[0].startswith("km ")
    for train in range(TRAINS):
        behind_s = train * found.by_theory_s.max() - _origin_s(found)
        axes.barh(
            starts_m,
            end_s - begin_s,
            height=ends_m - starts_m,
            left=begin_s + behind_s,
            align="edge",
            color=shade,
            alpha=_SHADES[train % 2],
            edgecolor="white" if few else "none",
            linewidth=0.5 if few else 0.0,
            zorder=1.5,
        )
        axes.plot(
            found.journey.time_s + behind_s,
            found.journey.chainage_m,
            color=INK,
            linewidth=1.0,
            zorder=2.5,
        )
    _mark_touch(axes, found)


def _mark_touch(axes: Axes, found: CapacityAssessment) -> None:
    """Mark where the second stairway touches the first one, and the third one the second."""
    decides = int(np.nanargmax(found.end_s - found.begin_s))
    start_m, end_m = found.stretches.edges_m[decides : decides + 2]
    for train in range(1, TRAINS):
        touch_s = found.begin_s[decides] + train * found.by_theory_s.max() - _origin_s(found)
        axes.plot(
            [touch_s, touch_s],
            [start_m, end_m],
            color="#111111",
            linewidth=2.6,
            solid_capstyle="butt",
            zorder=3.0,
        )


def _frame(
    axes: Axes,
    group: Sequence[CapacityAssessment],
    place_m: tuple[float, float],
    shade: str,
    stations: pd.DataFrame,
) -> None:
    names = dict(zip(stations["station"], stations["name"], strict=True))
    found = group[0]
    more = f" and {len(group) - 1} more" if len(group) > 1 else ""
    name = f"{label_of(found.controller)}{more}"
    station = found.service.calls[_touching(found)].station
    axes.set_title(name, loc="left", color=shade, fontweight="bold")
    told = f"{found.by_theory_s.max():.1f} s by blocking times, at {names.get(station, station)}"
    axes.set_title(told, loc="right", fontsize=8.0)
    axes.set_ylim(*place_m)
    axes.xaxis.set_major_locator(MultipleLocator(60.0))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda time_s, _: f"{time_s / 60.0:.0f}"))
    axes.grid(axis="x", color="#F1F1F1", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)


def _legend() -> list[Patch | Line2D]:
    return [
        Line2D([], [], color=INK, linewidth=1.2, label="front of a train"),
        Patch(facecolor="#8FB8D6", label="time for which it keeps a block, or 50 m of line"),
        Line2D([], [], color="#111111", linewidth=2.6, label="where the next train touches"),
    ]
