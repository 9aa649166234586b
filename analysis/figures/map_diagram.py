"""
The control map as it was run: trains with their bands and obstructions, position against time.

One panel for every layer: the main tracks, and each parallel track by which trains went
(Sugiyama 2018, figs. 2 and 3).
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from kankaku.analysis.figures.style import GRID, INK, clock_axis, station_axis, style
from kankaku.analysis.tables.columns import by_train, rows_of
from kankaku.analysis.tables.map_window import CAUSES, Window
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.analysis.words import label_of
from kankaku.railway.arrays import BoolArray, FloatArray
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.scenario import Scenario

DELAY_S = 3.0
"""A band begins where the tail was before the longest delay of a message. [s]"""
BEYOND_M = 150.0
"""How much of the main track is shown at both ends of a parallel track. [m]"""
TRAINS = ("#0072B2", "#009E73")
"""Colours of trains, by turns, so that bands that follow each other can be told apart."""
LOOKS: Mapping[str, tuple[str, str]] = {
    "points": ("#666666", "////"),
    "work": ("#D55E00", "xxxx"),
    "fault": ("#CC2222", "\\\\\\\\"),
    "obstacle": ("#AA4499", "++++"),
}
"""Colour and hatching of every cause."""


class MapLayer(NamedTuple):
    """A panel: the main tracks, or a parallel track between the main ones."""

    title: str
    tracks: tuple[str, ...]
    low_m: float
    high_m: float


class MapRun(NamedTuple):
    """A train's run, as far as it is drawn; arrays of shape (n_samples,)."""

    train: str
    shade: str
    time_s: FloatArray
    front_m: FloatArray
    rear_m: FloatArray
    """Rear of the band. [m]"""
    limit_m: FloatArray
    """Front of the band. [m]"""
    route: tuple[str, ...]


def control_map_figure(
    run: RunTables, scenario: Scenario, stations: pd.DataFrame, window: Window
) -> Figure:
    """
    Draw a part of the map as it was run.

    Parameters
    ----------
    run
        A run whose trains take their commands by radio.
    scenario
        What was run.
    stations
        The table ``stations``.
    window
        Which part.

    Returns
    -------
    Figure
        Clock time across, chainage upwards, a panel for each layer.
    """
    runs = list(_runs(run, scenario, window))
    layers = _layers(scenario.line, runs, window)
    heights = [max(layer.high_m - layer.low_m, 600.0) for layer in layers]
    places = _places(scenario.line, stations)
    with style():
        size = (11.0, 1.8 + 4.6 * sum(heights) / heights[0])
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(
            len(layers), 1, sharex=True, squeeze=False, height_ratios=heights
        ).ravel()
        shown = _obstructions(run.obstructions, window)
        for layer, axes in zip(layers, panels, strict=True):
            axes.set_ylim(layer.low_m, layer.high_m)
            clock_axis(axes, window.start_s, window.end_s)
            for item in shown:
                within = item["start_m"] < layer.high_m and item["end_m"] > layer.low_m
                if within and not set(item["tracks"].split()).isdisjoint(layer.tracks):
                    _draw_obstruction(axes, item, window)
            for train in runs:
                _draw_train(axes, train, layer, scenario.line)
            here = places[places["chainage_m"].between(layer.low_m, layer.high_m)]
            # The heights of panels differ, those of letters do not.
            gap_m = 0.065 * heights[0]
            station_axis(axes, here, labels=True, gap_m=gap_m)
            axes.set_title(layer.title, loc="left", color=INK, pad=14.0)
            axes.grid(axis="x", color=GRID, linewidth=0.6)
            axes.spines[["top", "right"]].set_visible(False)
        panels[-1].set_xlabel("time of day")
        figure.suptitle(
            f"The map as it was run: {label_of(run.controller)}\n{window.what}",
            fontsize=11.0,
        )
        legend = _legend(shown, window, several=len(layers) > 1)
        figure.legend(handles=legend, loc="outside lower center", ncols=min(len(legend), 4))
    return figure


def _places(line: Line, stations: pd.DataFrame) -> pd.DataFrame:
    """Return stations and level crossings with their chainage in their names."""
    crossings = pd.DataFrame(
        {
            "name": [crossing.id for crossing in line.crossings],
            "chainage_m": [crossing.start_m for crossing in line.crossings],
        }
    )
    places = pd.concat(
        [stations[["name", "chainage_m"]], crossings] if len(crossings) else [stations]
    )
    named = places.assign(
        name=places["name"] + [f"\n{0.001 * place_m:.2f} km" for place_m in places["chainage_m"]]
    )
    return named.sort_values("chainage_m")


def _runs(run: RunTables, scenario: Scenario, window: Window) -> Iterator[MapRun]:
    """Yield the trains that are seen, their bands cut off where the map ends."""
    samples = dict(by_train(run.trajectory))
    drawn = 0
    # In the order in which they leave the line, so that neighbours differ in colour.
    for service in scenario.timetable.services:
        own = samples.get(service.train)
        if own is None:
            continue
        time_s, front_m = own["time_s"].to_numpy(), own["front_m"].to_numpy()
        length_m = scenario.train_types[service.train_type].length_m
        rear_m = np.interp(time_s - DELAY_S, time_s, front_m) - length_m
        limit_m = np.minimum(own["limit_m"].to_numpy(), scenario.line.end_m)
        seen = (time_s >= window.start_s - 1.0) & (time_s <= window.end_s + 1.0)
        if np.any(seen & (front_m >= window.low_m) & (rear_m <= window.high_m)):
            columns = (time_s[seen], front_m[seen], rear_m[seen], limit_m[seen])
            yield MapRun(service.train, TRAINS[drawn % len(TRAINS)], *columns, service.route)
            drawn += 1


def _layers(line: Line, runs: Sequence[MapRun], window: Window) -> list[MapLayer]:
    """Return the main tracks, and each parallel track that a train was on."""
    main = tuple(section.tracks[0].id for section in line.sections)
    layers = [MapLayer("main tracks", main, window.low_m, window.high_m)]
    for number, section in enumerate(line.sections):
        low_m, high_m = section.start_m - BEYOND_M, section.end_m + BEYOND_M
        if section.end_m <= window.low_m or section.start_m >= window.high_m:
            continue
        for track in section.tracks[1:]:
            used = any(
                track.id in train.route
                and np.any((train.limit_m > section.start_m) & (train.rear_m < section.end_m))
                for train in runs
            )
            if used:
                tracks = (*main[:number], track.id, *main[number + 1 :])
                layers.append(MapLayer(f"track {track.id}", tracks, low_m, high_m))
    return layers


def _stretches_m(
    route: Sequence[str], layer: MapLayer, line: Line
) -> Iterator[tuple[float, float]]:
    """Yield from where to where a route keeps to a layer."""
    first = line.section_of_track[route[0]]
    start_m = None
    for section, track in zip(line.sections[first:], route, strict=False):
        if track in layer.tracks:
            start_m = section.start_m if start_m is None else start_m
            end_m = section.end_m
        elif start_m is not None:
            yield start_m, end_m
            start_m = None
    if start_m is not None:
        yield start_m, end_m


def _draw_train(axes: Axes, train: MapRun, layer: MapLayer, line: Line) -> None:
    elsewhere: BoolArray = np.ones(train.time_s.size, dtype=np.bool_)
    for start_m, end_m in _stretches_m(train.route, layer, line):
        here = (train.front_m >= start_m) & (train.front_m <= end_m)
        elsewhere &= ~here
        rear_m, limit_m = (np.clip(edge, start_m, end_m) for edge in (train.rear_m, train.limit_m))
        axes.fill_between(
            train.time_s,
            rear_m,
            limit_m,
            where=(limit_m > rear_m).tolist(),
            color=train.shade,
            alpha=0.22,
            linewidth=0.0,
            zorder=1.6,
        )
        axes.plot(
            train.time_s,
            np.where(here, train.front_m, np.nan),
            color=train.shade,
            linewidth=1.5,
            zorder=2.6,
        )
    axes.plot(
        train.time_s,
        np.where(elsewhere, train.front_m, np.nan),
        color=train.shade,
        linewidth=0.8,
        linestyle=(0, (1, 2)),
        zorder=2.4,
    )
    _name_train(axes, train, (layer.low_m, layer.high_m))


def _name_train(axes: Axes, train: MapRun, edges_m: tuple[float, float]) -> None:
    """Write the name of a train where it leaves the panel."""
    low_m, high_m = edges_m
    end_s = axes.get_xlim()[1]
    inside = np.flatnonzero(
        (train.front_m >= low_m) & (train.front_m <= high_m) & (train.time_s <= end_s)
    )
    if not inside.size:
        return
    last = inside[-1]
    above = last + 1 < train.time_s.size and train.front_m[last + 1] > high_m
    axes.annotate(
        train.train,
        (train.time_s[last], high_m if above else train.front_m[last]),
        xytext=(0.0, 2.0) if above else (3.0, 0.0),
        textcoords="offset points",
        ha="center" if above else "left",
        va="bottom" if above else "center",
        color=train.shade,
        fontsize=7.5,
        fontweight="bold",
        annotation_clip=False,
    )


def _obstructions(table: pd.DataFrame, window: Window) -> list[dict[str, Any]]:
    over = table["lifted_s"].fillna(np.inf) < window.start_s
    beside = (table["end_m"] <= window.low_m) | (table["start_m"] >= window.high_m)
    return rows_of(table[~over & (table["requested_s"] <= window.end_s) & ~beside])


def _draw_obstruction(axes: Axes, item: dict[str, Any], window: Window) -> None:
    """Draw a rectangle, hatched from when it is established."""
    shade, hatch = LOOKS[item["cause"]]
    start_m, begin_s, established_s, lifted_s = (
        item[name] for name in ("start_m", "requested_s", "established_s", "lifted_s")
    )
    height_m = item["end_m"] - start_m
    end_s = lifted_s if np.isfinite(lifted_s) else window.end_s
    known_s = established_s if np.isfinite(established_s) else end_s
    if known_s > begin_s:
        _draw_box(axes, ((begin_s, start_m), known_s - begin_s, height_m), shade, None)
    if end_s > known_s:
        _draw_box(axes, ((known_s, start_m), end_s - known_s, height_m), shade, hatch)


def _draw_box(
    axes: Axes, area: tuple[tuple[float, float], float, float], shade: str, hatch: str | None
) -> None:
    box = Rectangle(
        *area,
        facecolor=(1.0, 1.0, 1.0, 0.6) if hatch else "none",
        edgecolor=shade,
        hatch=hatch,
        linestyle="solid" if hatch else "--",
        linewidth=0.8,
        zorder=2.0,
    )
    axes.add_patch(box)


def _legend(shown: Sequence[dict[str, Any]], window: Window, *, several: bool) -> list[Artist]:
    """Return the entries of what is drawn; with several layers trains go from one to another."""
    shade, dots = TRAINS[0], (0.0, (1.0, 2.0))
    causes = dict.fromkeys(item["cause"] for item in shown)
    requested = any(
        not item["established_s"] <= max(item["requested_s"], window.start_s) for item in shown
    )
    return [
        Line2D([], [], color=shade, linewidth=1.5, label="front of a train"),
        *(
            [Line2D([], [], color=shade, linewidth=0.8, linestyle=dots, label="on another track")]
            if several
            else []
        ),
        Patch(
            facecolor=shade,
            alpha=0.22,
            label=f"its band: tail {DELAY_S:g} s ago to end of authority",
        ),
        *(
            Patch(
                facecolor="white",
                edgecolor=LOOKS[cause][0],
                hatch=LOOKS[cause][1],
                label=CAUSES[cause],
            )
            for cause in causes
        ),
        *(
            [Patch(facecolor="none", edgecolor=INK, linestyle="--", label="requested only")]
            if requested
            else []
        ),
    ]
