"""
Normal runs and quiet dwells, from the public intervals of quiet hours.

A quiet interval is a normal run and a quiet dwell; only their sum is public. Both are parted by
what is known of each beforehand: a quiet dwell of half a minute, and normal runs that are longer
than the quickest ones of the driving style in one proportion, the same on the whole line.
"""

import csv
from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass, fields
from functools import cache, partial
from pathlib import Path

from kankaku.railway.plan.driving_style import DrivingStyle
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.met import mirrored
from kankaku.railway.plan.rolling_stock import TrainType
from tools.csv_files import write_rows
from tools.driven_speeds import driven_s, nearest_speed_kmh
from tools.public_runs.intervals import NORTHBOUND, QUIET, SOUTHBOUND, Interval

DWELL_S, DWELL_SPREAD_S = 30.0, 10.0
"""What a quiet dwell is taken to be, and how much stations differ. [s]"""
RATIO_SPREAD = 0.06
"""How much legs differ in the ratio of a normal run to the quickest one. [-]"""
UNIT_S = 5
SHORTEST_DWELL_S = 15
Driven = tuple[Line, TrainType, DrivingStyle]
"""What a run depends on."""


@dataclass(frozen=True, slots=True)
class QuietLeg:
    """A row of ``quiet_runs.csv``: how a public interval is parted, and what the model runs."""

    from_station: str
    to_station: str
    direction: str
    public_s: float
    standard_error_s: float
    dwell_s: int
    """At the end of the leg. [s]"""
    quickest_s: float
    """The quickest run of the driving style. [s]"""
    speed_kmh: int
    """The driven speed. [km/h]"""
    run_s: float
    """The run at that speed. [s]"""
    residual_s: float
    """Run and dwell of the model less the public interval. [s]"""


def quiet_legs(intervals: Sequence[Interval], driven: Driven) -> list[QuietLeg]:
    """
    Part the quiet intervals of southbound trains, and run the northbound ones to compare.

    With quickest runs ``f``, intervals ``q`` and variances ``s^2`` of what is assumed of both
    parts, the common ratio is the weighted mean of ``(q - 30) / f``; then each part takes of the
    rest by its variance. Northbound trains take the speeds and dwells found for southbound ones,
    so that their residuals show how well the assumptions carry over.

    Parameters
    ----------
    intervals
        Public intervals, with the quiet hours of both directions.
    driven
        Line, train and driving style.

    Returns
    -------
    list[QuietLeg]
        In running order, southbound first.
    """
    line, train_type, style = driven
    quiet = [row for row in intervals if row.period == QUIET]
    south = [row for row in quiet if row.direction == SOUTHBOUND]
    place_m = {station.id: station.chainage_m for station in line.stations}
    fastest_kmh = round(3.6 * style.train(train_type).maximum_speed_mps)

    @cache
    def run_s(start: str, end: str, speed_kmh: int) -> float:
        ends_m = place_m[start], place_m[end]
        return driven_s(line, train_type, style, ends_m, speed_kmh / 3.6)

    quickest_s = [run_s(row.from_station, row.to_station, fastest_kmh) for row in south]
    ratio = _common_ratio([row.mean_s for row in south], quickest_s)
    legs = []
    for row, least_s in zip(south, quickest_s, strict=True):
        ends = row.from_station, row.to_station
        dwell_s = _dwell_s(row.mean_s, least_s, ratio)
        wanted_s = row.mean_s - dwell_s
        speed_kmh = nearest_speed_kmh(partial(run_s, *ends), wanted_s, fastest_kmh)
        legs.append(_leg(row, dwell_s, least_s, speed_kmh, run_s(*ends, speed_kmh)))
    return legs + list(_northbound(quiet, legs, driven, fastest_kmh))


def _common_ratio(means_s: Sequence[float], quickest_s: Sequence[float]) -> float:
    weights = [1.0 / (DWELL_SPREAD_S**2 + (RATIO_SPREAD * run_s) ** 2) for run_s in quickest_s]
    legs = list(zip(weights, means_s, quickest_s, strict=True))
    runs = sum(weight * run_s * (mean_s - DWELL_S) for weight, mean_s, run_s in legs)
    return runs / sum(weight * run_s**2 for weight, _, run_s in legs)


def _dwell_s(mean_s: float, quickest_s: float, ratio: float) -> int:
    """Return the dwell's part of an interval, in units of the timetable."""
    dwell, run = DWELL_SPREAD_S**-2, (RATIO_SPREAD * quickest_s) ** -2
    found_s = (dwell * DWELL_S + run * (mean_s - ratio * quickest_s)) / (dwell + run)
    most_s = mean_s - quickest_s
    return max(UNIT_S * round(min(found_s, most_s) / UNIT_S), SHORTEST_DWELL_S)


def _leg(row: Interval, dwell_s: int, quickest_s: float, speed_kmh: int, run_s: float) -> QuietLeg:
    residual_s = run_s + dwell_s - row.mean_s
    return QuietLeg(
        row.from_station,
        row.to_station,
        row.direction,
        row.mean_s,
        row.standard_error_s,
        dwell_s,
        round(quickest_s, 1),
        speed_kmh,
        round(run_s, 1),
        round(residual_s, 1),
    )


def _northbound(
    quiet: Iterable[Interval], south: Sequence[QuietLeg], driven: Driven, fastest_kmh: int
) -> Iterable[QuietLeg]:
    line, train_type, style = driven
    other = mirrored(line)
    place_m = {station.id: line.mirrored_m(station.chainage_m) for station in line.stations}
    speed_of = {(leg.to_station, leg.from_station): leg.speed_kmh for leg in south}
    dwell_of = {leg.to_station: leg.dwell_s for leg in south}
    for row in quiet:
        ends = row.from_station, row.to_station
        if row.direction != NORTHBOUND or row.to_station not in dwell_of:
            continue
        ends_m = place_m[ends[0]], place_m[ends[1]]
        least_s, run_s = (
            driven_s(other, train_type, style, ends_m, speed_kmh / 3.6)
            for speed_kmh in (fastest_kmh, speed_of[ends])
        )
        yield _leg(row, dwell_of[row.to_station], least_s, speed_of[ends], run_s)


def write_quiet(legs: Sequence[QuietLeg], target: Path) -> None:
    """
    Write ``quiet_runs.csv``.

    Parameters
    ----------
    legs
        The legs.
    target
        The file.
    """
    heading = [field.name for field in fields(QuietLeg)]
    write_rows(target, [heading, *(astuple(leg) for leg in legs)])


def write_speeds(legs: Sequence[QuietLeg], line: Line, target: Path) -> None:
    """
    Write ``driven_speeds.csv``: a speed for each leg, as far as its trains go.

    Parameters
    ----------
    legs
        The legs.
    line
        The line.
    target
        The file.
    """
    place_m = {station.id: station.chainage_m for station in line.stations}
    rows: list[Sequence[object]] = [["start_km", "end_km", "speed_kmh"]]
    for leg in legs:
        if leg.direction == SOUTHBOUND:
            ends_m = place_m[leg.from_station], place_m[leg.to_station]
            rows.append([*(at_m / 1000.0 for at_m in ends_m), leg.speed_kmh])
    write_rows(target, rows)


def read_quiet(path: Path) -> list[QuietLeg]:
    """
    Read ``quiet_runs.csv``.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    list[QuietLeg]
        The legs.
    """
    with path.open(encoding="utf-8", newline="") as file:
        return [
            QuietLeg(
                row["from_station"],
                row["to_station"],
                row["direction"],
                float(row["public_s"]),
                float(row["standard_error_s"]),
                int(row["dwell_s"]),
                float(row["quickest_s"]),
                int(row["speed_kmh"]),
                float(row["run_s"]),
                float(row["residual_s"]),
            )
            for row in csv.DictReader(file)
        ]
