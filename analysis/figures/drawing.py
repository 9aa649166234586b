"""Figures of saved results by name, for chosen controllers, trains, stations and times."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from kankaku.analysis.asked_results import NotInResultsError, known_name, train_of
from kankaku.analysis.figures.delay_figure import delay_figure
from kankaku.analysis.figures.pareto_figure import pareto_figure
from kankaku.analysis.figures.speed_figure import speed_figure
from kankaku.analysis.figures.style import PALETTE
from kankaku.analysis.figures.time_distance import time_distance_figure
from kankaku.analysis.figures.zoom import zoom_figure
from kankaku.analysis.results import Results
from kankaku.analysis.tables.across_tables import across_frame
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.analysis.tables.window import within
from kankaku.analysis.words import clock

SHORTEST_S = 10.0
"""A window shorter than this shows nothing. [s]"""


class Choice(NamedTuple):
    """What of some results a figure shows; everything where nothing is chosen."""

    controllers: Sequence[str] = ()
    trains: Sequence[str] = ()
    stations: Sequence[str] = ()
    """Of the stretch from the first to the last of them along the line."""
    window_s: tuple[float, float] | None = None
    seed: int | None = None


EVERYTHING = Choice()


class Drawn(NamedTuple):
    """What a figure is made of."""

    results: Results
    runs: Sequence[RunTables]
    """One per controller: of chosen trains and times alone."""
    stations: pd.DataFrame
    stretch_m: tuple[float, float] | None
    window_s: tuple[float, float] | None
    title: str


def _time_distance(drawn: Drawn) -> Figure:
    return time_distance_figure(
        drawn.runs,
        drawn.stations,
        title=drawn.title,
        window_s=drawn.window_s,
        stretch_m=drawn.stretch_m,
    )


def _zoom(drawn: Drawn) -> Figure:
    return zoom_figure(drawn.runs, drawn.stations)


def _pareto(drawn: Drawn) -> Figure:
    names = [run.controller for run in drawn.runs]
    if len(names) < 2:
        where = "pareto"
        raise NotInResultsError(where, "compares controllers", "two controllers or more")
    scenario = str(drawn.results.provenance.get("scenario", drawn.results.folder.name))
    return pareto_figure(across_frame({scenario: drawn.results.summary}, names, ()))


def _speed(drawn: Drawn) -> Figure:
    return speed_figure(drawn.runs, drawn.stations, drawn.stretch_m, title=drawn.title)


def _delays(drawn: Drawn) -> Figure:
    return delay_figure(drawn.runs, drawn.stations, title=drawn.title)


FIGURES: Mapping[str, Callable[[Drawn], Figure]] = {
    "time_distance": _time_distance,
    "zoom": _zoom,
    "pareto": _pareto,
    "speed": _speed,
    "delays": _delays,
}
"""Every figure that can be asked for."""


def draw(results: Results, figure: str, choice: Choice = EVERYTHING, *, title: str = "") -> Figure:
    """
    Draw a figure of saved results.

    Parameters
    ----------
    results
        What was read, with trajectories.
    figure
        One of ``FIGURES``.
    choice
        What of the results it shows.
    title
        Its title; the scenario and what is chosen if empty.

    Returns
    -------
    Figure
        To be shown, or written by :func:`kankaku.analysis.figures.style.write_figure` as PNG, SVG
        or PDF.

    Raises
    ------
    NotInResultsError
        If there is no such figure, controller, train or station, or nothing in that time.
    """
    known_name("figure", figure, list(FIGURES))
    drawn = _chosen(results, choice)
    try:
        return FIGURES[figure](drawn._replace(title=title or drawn.title))
    except ValueError as error:
        if isinstance(error, NotInResultsError):
            raise
        where = f"figure {figure}"
        raise NotInResultsError(where, str(error), "another choice") from error


def _chosen(results: Results, choice: Choice) -> Drawn:
    runs = _runs(results, choice)
    trains = [train_of(runs, train) for train in choice.trains]
    if trains:
        runs = [_of_trains(run, trains) for run in runs]
    if choice.window_s is not None:
        start_s, end_s = choice.window_s
        if not end_s - start_s >= SHORTEST_S:
            where = "window"
            told = f"from {clock(start_s, seconds=True)} to {clock(end_s, seconds=True)}"
            raise NotInResultsError(where, told, f"{SHORTEST_S:g} s or more")
        runs = [within(run, choice.window_s) for run in runs]
    if not any(len(run.trajectory) for run in runs):
        where = str(results.folder)
        raise NotInResultsError(where, "no train ran then", "trains and times of the results")
    stations, stretch_m = _stretch(results, choice.stations)
    title = str(results.provenance.get("scenario", "")) or results.folder.name
    if trains:
        title += f", train{'s' if len(trains) > 1 else ''} {', '.join(trains)}"
    if choice.window_s is not None:
        title += f", {clock(choice.window_s[0])} to {clock(choice.window_s[1])}"
    return Drawn(results, runs, stations, stretch_m, choice.window_s, title)


def _runs(results: Results, choice: Choice) -> list[RunTables]:
    known = list(results.controllers)
    names = [known_name("controller", name, known) for name in choice.controllers] or known
    if len(names) > len(PALETTE):
        where = "controllers"
        told = f"{len(names)} are more than there are colours that can be told apart"
        raise NotInResultsError(where, told, f"{len(PALETTE)} at most; choose some")
    if choice.seed is not None:
        seeds = list(dict.fromkeys(run.seed for run in results.runs))
        known_name("seed", choice.seed, seeds)
    return [results.run(name, choice.seed) for name in dict.fromkeys(names)]


def _of_trains(run: RunTables, trains: Sequence[str]) -> RunTables:
    frames: dict[str, Any] = {
        name: frame[frame["train"].isin(trains)] if "train" in frame else frame
        for name, frame in run.frames.items()
    }
    return replace(run, **frames)


def _stretch(
    results: Results, names: Sequence[str]
) -> tuple[pd.DataFrame, tuple[float, float] | None]:
    """Return the stations that are shown, and from where to where."""
    stations = results.stations
    if not names:
        return stations, None
    by_name = dict(zip(stations["name"].str.casefold(), stations["station"], strict=True))
    known = stations["station"].tolist()
    chosen = [known_name("station", by_name.get(name.casefold(), name), known) for name in names]
    places_m = stations.loc[stations["station"].isin(chosen), "chainage_m"].to_numpy()
    low_m, high_m = float(np.min(places_m)), float(np.max(places_m))
    if low_m == high_m:
        low_m, high_m = low_m - 500.0, high_m + 500.0
    return stations, (low_m, high_m)
