"""Speed against chainage: run curves (運転曲線), one panel per controller."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from kankaku.analysis.figures.style import colour, plain_frame, style
from kankaku.analysis.tables.columns import rows_of
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.analysis.tables.sweep import following_arrival
from kankaku.analysis.words import KMH_PER_MPS, label_of
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.line import Direction, Line
from kankaku.railway.plan.scenario import Sweep

PANEL_WIDTH_IN = 5.4
PANEL_HEIGHT_IN = 3.4
MOST_COLUMNS = 3
PLATFORM = "#EFE6CF"
_MAP = "viridis"
_BRIGHTEST = 0.88
"""The end of the colour map is too pale for a line. [-]"""


class SpeedCurve(NamedTuple):
    """Speed over chainage of one run, measured or computed."""

    label: str
    chainage_m: FloatArray
    """Chainage of the front along the way. [m], shape (n_points,)"""
    speed_mps: FloatArray
    """Speed there. [m/s], shape (n_points,)"""


class Panel(NamedTuple):
    """Curves on the same axes."""

    title: str
    curves: Sequence[SpeedCurve]
    platform_m: tuple[float, float] | None = None
    """Platform that is shaded, from end to end. [m]"""


def speed_distance_figure(
    panels: Sequence[Panel], *, title: str, legend: str | None = None
) -> Figure:
    """
    Draw run curves.

    Parameters
    ----------
    panels
        One per controller, baseline first. Curves of the same label have the same colour in
        all panels, from dark to light in the order in which they first appear.
    title
        Title of the figure.
    legend
        Title of the legend.

    Returns
    -------
    Figure
        Chainage across, speed upwards, on the same axes everywhere.

    Raises
    ------
    ValueError
        If there are no panels.
    """
    if not panels:
        msg = "no run curves to draw"
        raise ValueError(msg)
    columns = min(len(panels), MOST_COLUMNS)
    lines = -(-len(panels) // columns)
    shades = _shades(curve.label for panel in panels for curve in panel.curves)
    with style():
        size = (1.2 + PANEL_WIDTH_IN * columns, 1.1 + PANEL_HEIGHT_IN * lines)
        figure = Figure(figsize=size, layout="constrained")
        axes_grid = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
        for index, (panel, axes) in enumerate(zip(panels, axes_grid.flat, strict=False)):
            _draw_panel(axes, panel, shades)
            _frame(axes, panel, index)
            axes.tick_params(axis="x", labelbottom=index + columns >= len(panels))
        for axes in list(axes_grid.flat)[len(panels) :]:
            axes.set_axis_off()
        figure.supxlabel("chainage [km]", fontsize=8.0)
        figure.supylabel("speed [km/h]", fontsize=8.0)
        figure.suptitle(title, fontsize=12.0)
        figure.legend(
            handles=list(_legend(panels, shades)), title=legend, loc="outside right upper"
        )
    return figure


def _shades(labels: Iterable[str]) -> Mapping[str, str]:
    known = list(dict.fromkeys(labels))
    tones = mpl.colormaps[_MAP](np.linspace(0.0, _BRIGHTEST, len(known)))
    return {
        label: mpl.colors.to_hex(tuple(tone))
        for label, tone in zip(known, tones.tolist(), strict=True)
    }


def _draw_panel(axes: Axes, panel: Panel, shades: Mapping[str, str]) -> None:
    if panel.platform_m:
        start_m, end_m = panel.platform_m
        axes.axvspan(start_m / 1000.0, end_m / 1000.0, color=PLATFORM, linewidth=0.0, zorder=0.5)
    for curve in panel.curves:
        axes.plot(
            curve.chainage_m / 1000.0,
            KMH_PER_MPS * curve.speed_mps,
            color=shades[curve.label],
            linewidth=1.3,
        )


def _frame(axes: Axes, panel: Panel, index: int) -> None:
    axes.set_title(label_of(panel.title), loc="left", color=colour(index), fontweight="bold")
    axes.set_ylim(bottom=0.0)
    plain_frame(axes)


def _legend(panels: Sequence[Panel], shades: Mapping[str, str]) -> Iterator[Line2D | Patch]:
    for label, shade in shades.items():
        yield Line2D([], [], color=shade, linewidth=1.6, label=label)
    if any(panel.platform_m for panel in panels):
        yield Patch(facecolor=PLATFORM, label="platform")


def follower_panels(runs: Iterable[RunTables], sweep: Sweep, line: Line) -> list[Panel]:
    """
    Return how the next train ran to the swept station.

    Parameters
    ----------
    runs
        Runs with their trajectories, in the order in which they are to appear.
    sweep
        Which train overstays where.
    line
        The line.

    Returns
    -------
    list[Panel]
        One panel per controller, one curve per initial delay: from the next train's call
        before to its stop. A run in which it never arrived has no curve.
    """
    by_controller: dict[str, list[RunTables]] = {}
    for run in runs:
        by_controller.setdefault(run.controller, []).append(run)
    return [
        Panel(
            controller,
            [curve for curve in (_curve(run, sweep) for run in own) if curve],
            _platform_m(own[0].calls, sweep, line),
        )
        for controller, own in by_controller.items()
    ]


def _curve(run: RunTables, sweep: Sweep) -> SpeedCurve | None:
    behind = following_arrival(run.calls, sweep)
    if behind is None:
        return None
    calls = run.calls[run.calls["train"] == behind["follower"]]
    place = int(np.flatnonzero(calls["station"].to_numpy() == sweep.station)[0])
    start, end = rows_of(calls)[place - 1 : place + 1]
    samples = run.trajectory[run.trajectory["train"] == behind["follower"]]
    way = samples[samples["time_s"].between(start["departure_s"], end["arrival_s"])]
    # Samples do not fall on the moments at which a train starts and stops.
    return SpeedCurve(
        f"{run.initial_delay_s:g} s",
        np.array([start["stop_m"], *way["front_m"].tolist(), end["stop_m"]]),
        np.array([0.0, *way["speed_mps"].tolist(), 0.0]),
    )


def _platform_m(calls: pd.DataFrame, sweep: Sweep, line: Line) -> tuple[float, float]:
    own = calls[(calls["train"] == sweep.train) & (calls["station"] == sweep.station)]
    track = line.track_by_id[own["track"].item()]
    platform = line.platform_at[sweep.station, track.id]
    if track.direction is Direction.FALLING:
        return line.mirrored_m(platform.end_m), line.mirrored_m(platform.start_m)
    return platform.start_m, platform.end_m
