"""Runs and dwells of the whole line: the fastest ones, and the usual ones of the public minutes."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil
from pathlib import Path

from kankaku.railway.motion.run_curve import fastest_run
from kankaku.railway.plan.line import Gradient, Line, Section, SpeedLimit, Track, TrackCurve
from kankaku.railway.plan.rolling_stock import TrainType
from tools.whole_line.layout import Layout
from tools.whole_line.trips import Trip

UNIT_S = 5
"""Working timetables of Japanese metropolitan lines are written in steps of 5 s. [s]"""
RUN_ALLOWANCE = 1.05
"""Least booked run time over the fastest. [-]"""

Leg = tuple[str, str]
"""Stations of departure and of arrival."""


@dataclass(frozen=True)
class Usual:
    """Figures of runs and dwells."""

    least_run: Mapping[Leg, int]
    run: Mapping[Leg, int]
    least_dwell: Mapping[str, int]
    dwell: Mapping[str, int]


def fastest_runs(folder: Path, layout: Layout, train_type: TrainType) -> dict[Leg, float]:
    """
    Return the fastest run between all stations, three legs long at the most, both ways.

    Parameters
    ----------
    folder
        Folder of the scenario, with limits, gradients and curves.
    layout
        The tracks.
    train_type
        The train.

    Returns
    -------
    dict[Leg, float]
        Run time by station of departure and of arrival, as asked for by :func:`run_times`. [s]
    """
    names = list(layout.station_km)
    lines = {rising: _one_way(folder, layout, rising=rising) for rising in (True, False)}
    found = {}
    for rising, line in lines.items():
        along = names if rising else names[::-1]
        for index, start in enumerate(along):
            for end in along[index + 1 : index + 5]:
                at_m = [_front_m(layout, station, rising=rising) for station in (start, end)]
                found[start, end] = fastest_run(line, train_type, *at_m).run_time_s
    return found


def _front_m(layout: Layout, station: str, *, rising: bool) -> float:
    km = layout.station_km[station]
    return 1000.0 * km if rising else 1000.0 * (layout.nodes[-1].km - km + 0.195)


def _one_way(folder: Path, layout: Layout, *, rising: bool) -> Line:
    """Return one direction as a chain of one track; chainage runs with the trains."""
    low_km, high_km = layout.nodes[0].km, layout.nodes[-1].km

    def stretches(file: str) -> list[tuple[float, float, float]]:
        with (folder / file).open(encoding="utf-8", newline="") as rows:
            values = [(float(a), float(b), float(c)) for a, b, c in list(csv.reader(rows))[1:]]
        if rising:
            return [(1000.0 * a, 1000.0 * b, c) for a, b, c in values]
        return [(1000.0 * (high_km - b), 1000.0 * (high_km - a), c) for a, b, c in values[::-1]]

    ends_m = (1000.0 * low_km, 1000.0 * high_km) if rising else (0.0, 1000.0 * (high_km - low_km))
    sign = 1.0 if rising else -1.0
    return Line(
        name="one way",
        stations=(),
        sections=(Section(*ends_m, (Track("main", *ends_m),)),),
        platforms=(),
        turnouts=(),
        limits=tuple(SpeedLimit(a, b, c / 3.6) for a, b, c in stretches("limits.csv")),
        gradients=tuple(
            Gradient(a, b, sign * c / 1000.0) for a, b, c in stretches("gradients.csv")
        ),
        curves=tuple(TrackCurve(a, b, c) for a, b, c in stretches("curves.csv")),
        balises_m=(),
        blocks=(),
    )


def usual_figures(
    trips: Sequence[Trip], fastest_s: Mapping[Leg, float], dwells_s: Mapping[str, tuple[int, int]]
) -> Usual:
    """
    Return the usual runs: what the mean public interval leaves beside the booked dwell.

    Parameters
    ----------
    trips
        The trains.
    fastest_s
        Fastest runs. [s]
    dwells_s
        Minimum and booked dwell by station. [s]

    Returns
    -------
    Usual
        Runs and dwells.
    """
    spans: dict[Leg, list[int]] = {}
    for trip in trips:
        for (start, from_min), (end, to_min) in pairwise(
            zip(trip.stations, trip.minutes, strict=True)
        ):
            if end != trip.stations[-1]:
                spans.setdefault((start, end), []).append(to_min - from_min)
            else:
                spans.setdefault((start, end), [])
    least = {leg: ceil(RUN_ALLOWANCE * fastest_s[leg] / UNIT_S) for leg in spans}
    run = dict(least)
    for leg, found in spans.items():
        if found:
            mean_s = 60.0 * sum(found) / len(found) - dwells_s[leg[1]][1]
            run[leg] = max(round(mean_s / UNIT_S), least[leg])
    minimum = {station: ceil(pair[0] / UNIT_S) for station, pair in dwells_s.items()}
    booked = {station: round(pair[1] / UNIT_S) for station, pair in dwells_s.items()}
    return Usual(least, run, minimum, booked)
