"""
Mean intervals between public departures, by leg, direction and time of day.

Public departures are whole minutes, truncated. The truncation cancels in the mean of differences
over many trains whose seconds differ. It does not where a timetable repeats itself every hour, as
at midday: there only the sum over many legs is good.
"""

import csv
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, fields
from itertools import pairwise
from math import sqrt
from pathlib import Path

from tools.csv_files import write_rows

PUBLIC_COLUMNS = 5
"""Columns of a public timetable before its stations. [-]"""
NORTHBOUND, SOUTHBOUND = "northbound", "southbound"
QUIET = "quiet"
PEAK = "peak"
HALF_HOURS_MIN = range(360, 570, 30)
"""Starts of the half hours of the southbound morning. [min after midnight]"""

Leg = tuple[str, str]
"""Stations of departure and of the next departure."""


@dataclass(frozen=True, slots=True)
class PublicTrain:
    """A train of a public timetable."""

    train: str
    direction: str
    departures: Mapping[str, int]
    """Departure minute by station, in running order. [min after midnight]"""


@dataclass(frozen=True, slots=True)
class Period:
    """Trains of one direction at some time of day."""

    name: str
    direction: str
    holds: Callable[[PublicTrain, int], bool]
    """Whether an interval counts, by its train and the minute in which it begins."""


@dataclass(frozen=True, slots=True)
class Interval:
    """A row of ``public_intervals.csv``."""

    from_station: str
    to_station: str
    direction: str
    period: str
    trains: int
    mean_s: float
    standard_error_s: float


def read_trains(path: Path) -> list[PublicTrain]:
    """
    Read a public timetable of both directions.

    Parameters
    ----------
    path
        A table with a row for each train: train, type, direction, destination, onward line, then
        a column for each station, southbound order. The minute at the destination is an arrival.

    Returns
    -------
    list[PublicTrain]
        The trains, in the order of the file.
    """
    with path.open(encoding="utf-8", newline="") as file:
        heading, *rows = csv.reader(file)
    stations = heading[PUBLIC_COLUMNS:]
    trains = []
    for train, _, direction, destination, _, *cells in rows:
        calls = [call for call in zip(stations, cells, strict=True) if call[1]]
        departures = {
            station: 60 * int(clock[:2]) + int(clock[3:])
            for station, clock in (calls if direction == SOUTHBOUND else reversed(calls))
            if station != destination
        }
        trains.append(PublicTrain(train, direction, departures))
    return trains


def day_periods(peak_station: str) -> list[Period]:
    """
    Return the periods of a weekday.

    Parameters
    ----------
    peak_station
        Southbound trains that leave it between 7:00 and 8:59 are those of the peak.

    Returns
    -------
    list[Period]
        Quiet hours (before 6:00, after 21:00, and both), midday and peak of both directions, and
        the half hours of the southbound morning, named by their start. An interval belongs to the
        time at which it begins.
    """
    times: dict[str, Callable[[PublicTrain, int], bool]] = {
        "early": lambda _, minute: minute < 360,
        "late": lambda _, minute: minute >= 1260,
        QUIET: lambda _, minute: minute < 360 or minute >= 1260,
        "midday": lambda _, minute: 570 <= minute < 930,
    }
    both = [
        Period(name, way, holds)
        for way in (SOUTHBOUND, NORTHBOUND)
        for name, holds in times.items()
    ]

    def in_peak(train: PublicTrain, _: int) -> bool:
        return 420 <= train.departures.get(peak_station, 0) < 540

    peaks = [
        Period(PEAK, SOUTHBOUND, in_peak),
        Period(PEAK, NORTHBOUND, lambda _, minute: 1050 <= minute < 1170),
    ]
    return both + peaks + [_half_hour(start) for start in HALF_HOURS_MIN]


def _half_hour(start_min: int) -> Period:
    name = f"{start_min // 60:02d}:{start_min % 60:02d}"
    return Period(name, SOUTHBOUND, lambda _, minute: start_min <= minute < start_min + 30)


def mean_intervals(
    trains: Sequence[PublicTrain], stations: Sequence[str], periods: Sequence[Period]
) -> list[Interval]:
    """
    Return the mean intervals of legs between neighbouring stations.

    A rapid train has such an interval only where it calls at every station, as local trains do.

    Parameters
    ----------
    trains
        The trains.
    stations
        Stations in southbound order; legs of others are left out.
    periods
        Times of day.

    Returns
    -------
    list[Interval]
        By period and leg, in running order; without legs on which nobody runs.
    """
    found = []
    for period in periods:
        along = list(stations if period.direction == SOUTHBOUND else reversed(stations))
        spans: dict[Leg, list[int]] = {leg: [] for leg in pairwise(along)}
        for train in trains:
            if train.direction != period.direction:
                continue
            for leg, (first, second) in _legs(train):
                if leg in spans and period.holds(train, first):
                    spans[leg].append(second - first)
        for leg, minutes in spans.items():
            if minutes:
                mean_s, error_s = mean_and_error_s(minutes)
                found.append(
                    Interval(*leg, period.direction, period.name, len(minutes), mean_s, error_s)
                )
    return found


def _legs(train: PublicTrain) -> Iterator[tuple[Leg, tuple[int, int]]]:
    for (start, first), (end, second) in pairwise(train.departures.items()):
        yield (start, end), (first, second)


def mean_and_error_s(minutes: Sequence[int]) -> tuple[float, float]:
    """
    Return the mean of truncated intervals and its standard error.

    Parameters
    ----------
    minutes
        Differences of truncated departures. [min]

    Returns
    -------
    tuple[float, float]
        Mean; standard error from the scatter, at least 60 s / (n + 2), the standard deviation
        of a share of which n trains show nothing else. [s]
    """
    count = len(minutes)
    mean = sum(minutes) / count
    scatter = sum((minute - mean) ** 2 for minute in minutes)
    error = sqrt(scatter / (count - 1) / count) if count > 1 else 0.0
    return 60.0 * mean, 60.0 * max(error, 1.0 / (count + 2))


def write_intervals(intervals: Sequence[Interval], path: Path) -> None:
    """
    Write a table of intervals, to tenths of a second.

    Parameters
    ----------
    intervals
        Its rows.
    path
        The file.
    """
    rows: list[Sequence[object]] = [[field.name for field in fields(Interval)]]
    for row in intervals:
        *texts, mean_s, error_s = astuple(row)
        rows.append([*texts, f"{mean_s:.1f}", f"{error_s:.1f}"])
    write_rows(path, rows)


def read_intervals(path: Path) -> list[Interval]:
    """
    Read a table of intervals.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    list[Interval]
        Its rows.
    """
    with path.open(encoding="utf-8", newline="") as file:
        _, *rows = csv.reader(file)
    return [
        Interval(start, end, direction, period, int(trains), float(mean_s), float(error_s))
        for start, end, direction, period, trains, mean_s, error_s in rows
    ]
