"""The time-distance diagram (ダイヤ) of every controller, one panel each."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from kankaku.analysis.figures.style import (
    BOOKED,
    STOP,
    clock_axis,
    colour,
    draw_booked,
    station_axis,
    style,
)
from kankaku.analysis.figures.train_numbers import name_lines
from kankaku.analysis.tables.columns import columns_by_train
from kankaku.analysis.tables.interstation import stop_totals
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.analysis.words import label_of

PANEL_WIDTH_IN = 7.0
PANEL_HEIGHT_IN = 4.3
_EDGE_S = 120.0
_NUMBER_PT = 4.0
"""Of train numbers: forty of them have to stand in a panel. [pt]"""
_LABEL = 0.032
"""Height of a station's name in a panel of that height. [-]"""


def time_distance_figure(
    runs: Sequence[RunTables],
    stations: pd.DataFrame,
    *,
    title: str,
    window_s: tuple[float, float] | None = None,
    stretch_m: tuple[float, float] | None = None,
) -> Figure:
    """
    Draw the time-distance diagrams of some runs.

    Forty trains of several controllers on top of each other cannot be read, so every
    controller has its own panel on the same axes.

    Parameters
    ----------
    runs
        One run per controller, baseline first.
    stations
        The table ``stations``.
    title
        Title of the figure.
    window_s
        From when to when; everything if None. [s]
    stretch_m
        From where to where; every station that is served if None. [m]

    Returns
    -------
    Figure
        Clock time across, chainage upwards, booked lines grey, stops between stations marked, each
        line with its train number.
    """
    columns = 1 if len(runs) == 1 else 2
    lines = -(-len(runs) // columns)
    served = stations[stations["station"].isin(runs[0].calls["station"])]
    if stretch_m is not None:
        served = stations[stations["chainage_m"].between(*stretch_m)]
    # With more stations than names fit beside a panel it is higher.
    tall = max(_LABEL * len(served), 1.0)
    size = (1.3 + PANEL_WIDTH_IN * columns, 1.2 + PANEL_HEIGHT_IN * lines * tall)
    with style():
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
        times_s = np.concatenate(
            [run.calls[["arrival_s", "departure_s"]].to_numpy().ravel() for run in runs]
        )
        start_s, end_s = np.nanmin(times_s) - _EDGE_S, np.nanmax(times_s) + _EDGE_S
        if window_s is not None:
            start_s, end_s = window_s
        for index, (run, axes) in enumerate(zip(runs, panels.flat, strict=False)):
            trains = _draw_panel(axes, run, index)
            _frame_panel(axes, served, run.calls, labels=index % columns == 0, gap=_LABEL / tall)
            if stretch_m is not None:
                edge_m = 0.05 * (stretch_m[1] - stretch_m[0])
                axes.set_ylim(stretch_m[0] - edge_m, stretch_m[1] + edge_m)
            clock_axis(axes, start_s, end_s)
            name_lines(axes, trains, size=_NUMBER_PT)
            axes.tick_params(axis="x", labelbottom=index + columns >= len(runs))
        figure.suptitle(title, fontsize=13.0)
        spare = list(panels.flat)[len(runs) :]
        for axes in spare:
            axes.set_axis_off()
            axes.legend(handles=_legend(), loc="center", fontsize=10.0, labelspacing=1.0)
        if not spare:
            figure.legend(handles=_legend(), loc="outside lower center", ncols=4)
    return figure


def _frame_panel(
    axes: Axes, served: pd.DataFrame, calls: pd.DataFrame, *, labels: bool, gap: float
) -> None:
    chainage_m = served["chainage_m"].to_numpy()
    length_m = max(float(np.ptp(chainage_m)), 1.0)
    low_m = chainage_m[0]
    if (calls.groupby("train", sort=False)["stop_m"].diff() < 0.0).any():
        # Trains towards lower chainage stop at the other ends of platforms.
        low_m = min(low_m, float(calls["stop_m"].min()))
    axes.set_ylim(low_m - 0.02 * length_m, chainage_m[-1] + 0.03 * length_m)
    station_axis(axes, served, labels=labels, gap_m=gap * length_m)
    axes.grid(axis="x", color="#F1F1F1", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)


def _draw_panel(axes: Axes, run: RunTables, index: int) -> dict[str, Line2D]:
    draw_booked(axes, run.calls, label="booked")
    _shade_lateness(axes, run.calls, colour(index))
    lines = {}
    for train, (time_s, front_m) in columns_by_train(run.trajectory, "time_s", "front_m"):
        (lines[train],) = axes.plot(time_s, front_m, color=colour(index), linewidth=0.7)
    stops = run.interstation_stops
    axes.scatter(
        stops["start_s"] + stops["duration_s"] / 2,
        stops["front_m"],
        # Area in points: a longer stop is a larger mark, a short one can still be seen.
        s=np.clip(5.0 + 0.5 * stops["duration_s"], None, 60.0),
        color=STOP,
        linewidths=0.0,
        alpha=0.85,
        zorder=3.0,
    )
    totals = stop_totals(stops)
    plural = "" if totals.stops == 1 else "s"
    told = f"{totals.stops} stop{plural} between stations, {totals.time_s:,.0f} s"
    axes.set_title(label_of(run.controller), loc="left", color=colour(index), fontweight="bold")
    axes.set_title(told if totals.stops else "no stop between stations", loc="right", fontsize=8.0)
    return lines


def _shade_lateness(axes: Axes, calls: pd.DataFrame, shade: str) -> None:
    times = "booked_arrival_s", "booked_departure_s", "arrival_s", "departure_s"
    for _, (stop_m, *own) in columns_by_train(calls, "stop_m", *times):
        booked_s, actual_s = np.column_stack(own[:2]).ravel(), np.column_stack(own[2:]).ravel()
        axes.fill_betweenx(
            np.repeat(stop_m, 2),
            booked_s,
            actual_s,
            # A comparison with nan is false: calls never reached are not shaded.
            where=(actual_s > booked_s).tolist(),
            color=shade,
            alpha=0.22,
            linewidth=0.0,
            zorder=1.2,
        )


def _legend() -> list[Artist]:
    return [
        Line2D([], [], color=BOOKED, linewidth=1.0, label="booked"),
        Line2D([], [], color=colour(0), linewidth=1.4, label="run (colour of the controller)"),
        Patch(facecolor=colour(0), alpha=0.22, label="lateness"),
        Line2D(
            [],
            [],
            color=STOP,
            marker="o",
            linestyle="none",
            markersize=4.5,
            label="stop between stations (larger is longer)",
        ),
    ]
