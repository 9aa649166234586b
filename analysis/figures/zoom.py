"""A close look at the worst moment of the baseline, all controllers overlaid."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kankaku.analysis.figures.style import (
    GRID,
    INK,
    clock_axis,
    colour,
    dashes,
    draw_booked,
    station_axis,
    style,
)
from kankaku.analysis.tables.columns import columns_by_train, rows_of
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.analysis.tables.worst import Worst, worst_moment
from kankaku.analysis.words import KMH_PER_MPS, clock, label_of

BEFORE_S = 180.0
AFTER_S = 240.0
STATIONS_BEHIND = 2
STATIONS_AHEAD = 1


def zoom_figure(runs: Sequence[RunTables], stations: pd.DataFrame) -> Figure:
    """
    Draw the worst moment of the first run, and what the other runs made of it.

    Parameters
    ----------
    runs
        One run per controller, baseline first.
    stations
        The table ``stations``.

    Returns
    -------
    Figure
        Left: time-distance; right: speed of the train concerned over the same chainage.

    Raises
    ------
    ValueError
        If no train of the first run arrived anywhere.
    """
    worst = worst_moment(runs[0])
    if worst is None:
        msg = f"no train of {runs[0].controller} ran from one station to another"
        raise ValueError(msg)
    low_m, high_m = _stretch_m(runs[0].calls, worst)
    names = dict(zip(stations["station"], stations["name"], strict=True))
    with style():
        figure = Figure(figsize=(12.0, 6.6), layout="constrained")
        diagram, speeds = figure.subplots(1, 2, sharey=True, width_ratios=[2.6, 1.0])
        draw_booked(diagram, runs[0].calls, label="booked")
        for index, run in enumerate(runs):
            # Thinner on thicker, so that lines that coincide can all be seen.
            width = 1.2 + 2.6 * (len(runs) - 1 - index) / max(len(runs) - 1, 1)
            _draw_run(diagram, run, index, worst, width)
            _draw_speed(speeds, run, index, worst, width)
        _mark_stop(diagram, runs[0].interstation_stops, worst)
        _name_trains(diagram, runs[0].calls, worst)
        diagram.set_ylim(low_m, high_m)
        clock_axis(diagram, worst.start_s - BEFORE_S, worst.end_s + AFTER_S)
        _frame(diagram, speeds, _stop_places(runs[0].calls, stations))
        towards = names.get(worst.station, worst.station)
        moment = clock(worst.start_s, seconds=True)
        figure.suptitle(
            f"The worst moment under {label_of(runs[0].controller)}: train {worst.train}, "
            f"running to {towards}, {worst.what} ({moment})",
            fontsize=12.0,
        )
        figure.legend(
            *diagram.get_legend_handles_labels(),
            loc="outside lower center",
            ncols=min(len(runs) + 1, 7),
        )
    return figure


def _stretch_m(calls: pd.DataFrame, worst: Worst) -> tuple[float, float]:
    own = calls[calls["train"] == worst.train]
    places_m = own["stop_m"].to_numpy()
    here = int(np.argmax(own["station"].to_numpy() == worst.station))
    low = places_m[max(here - STATIONS_BEHIND, 0)]
    high = places_m[min(here + STATIONS_AHEAD, places_m.size - 1)]
    low, high = min(low, high), max(low, high)
    edge = 0.04 * (high - low)
    return float(low - edge), float(high + edge)


def _stop_places(calls: pd.DataFrame, stations: pd.DataFrame) -> pd.DataFrame:
    # Close up, a name belongs where the fronts stand, not at the official chainage.
    stop_m = calls.groupby("station")["stop_m"].median()
    served = stations[stations["station"].isin(stop_m.index)]
    return served.assign(chainage_m=served["station"].map(stop_m))


def _draw_run(axes: Axes, run: RunTables, index: int, worst: Worst, width: float) -> None:
    for train, (time_s, front_m) in columns_by_train(run.trajectory, "time_s", "front_m"):
        concerned = train == worst.train
        axes.plot(
            time_s,
            front_m,
            color=colour(index),
            linestyle=dashes(index),
            linewidth=width if concerned else 0.4 * width,
            zorder=2.5 if concerned else 2.0,
            label=label_of(run.controller) if concerned else "_",
        )


def _mark_stop(axes: Axes, stops: pd.DataFrame, worst: Worst) -> None:
    own = stops[(stops["train"] == worst.train) & (stops["start_s"] == worst.start_s)]
    for stop in rows_of(own):
        end_s = stop["start_s"] + stop["duration_s"]
        axes.plot(
            [stop["start_s"], end_s],
            [stop["front_m"], stop["front_m"]],
            color=colour(0),
            linewidth=10.0,
            alpha=0.25,
            solid_capstyle="butt",
            zorder=1.8,
        )
        axes.annotate(
            f"stands {stop['duration_s']:.0f} s",
            (0.5 * (stop["start_s"] + end_s), stop["front_m"]),
            xytext=(0.0, -17.0),
            textcoords="offset points",
            ha="center",
            fontsize=8.0,
            color=colour(0),
            fontweight="bold",
        )


def _name_trains(axes: Axes, calls: pd.DataFrame, worst: Worst) -> None:
    at_station = calls[(calls["station"] == worst.station) & calls["arrival_s"].notna()]
    for call in rows_of(at_station):
        axes.annotate(
            call["train"],
            (call["arrival_s"], call["stop_m"]),
            xytext=(-2.0, 5.0),
            textcoords="offset points",
            ha="right",
            fontsize=7.5,
            fontweight="bold" if call["train"] == worst.train else "normal",
            annotation_clip=True,
        )


def _draw_speed(axes: Axes, run: RunTables, index: int, worst: Worst, width: float) -> None:
    own = run.trajectory[run.trajectory["train"] == worst.train]
    axes.plot(
        KMH_PER_MPS * own["speed_mps"],
        own["front_m"],
        color=colour(index),
        linestyle=dashes(index),
        linewidth=0.8 * width,
    )


def _frame(diagram: Axes, speeds: Axes, places: pd.DataFrame) -> None:
    low_m, high_m = diagram.get_ylim()
    shown = places[places["chainage_m"].between(low_m, high_m)]
    station_axis(diagram, shown, labels=True, gap_m=0.03 * (high_m - low_m))
    station_axis(speeds, shown, labels=False, gap_m=0.0)
    diagram.set_title("time and place; the train concerned is bold", loc="left", color=INK)
    speeds.set_title("its speed", loc="left", color=INK)
    speeds.set_xlabel("km/h")
    speeds.set_xlim(left=0.0)
    for axes in (diagram, speeds):
        axes.grid(axis="x", color=GRID, linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
