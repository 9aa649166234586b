"""
Booked dwells by time of day, from public intervals.

The quiet interval of a leg is a normal run and a quiet dwell (:mod:`tools.public_runs.quiet`). What
the peak adds to it is taken as dwell of the station at its end. The rule stands in ``SOURCES.md``
of the scenario.
"""

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from statistics import fmean, variance

from kankaku.scenarios.reading.units import clock_of
from tools.csv_files import write_rows
from tools.public_runs.intervals import HALF_HOURS_MIN, PEAK, QUIET, SOUTHBOUND, Interval
from tools.public_runs.quiet import QuietLeg

UNIT_S = 5
RESERVE_S = 5
"""Booked dwell less the minimum. [s]"""
HEADING = (
    "station",
    "from_time",
    "until_time",
    "minimum_dwell_s",
    "booked_dwell_s",
    "delay_scale",
)


@dataclass(frozen=True, slots=True)
class Excess:
    """What the peak adds to the interval that ends with a station's dwell."""

    station: str
    raw_s: float
    standard_error_s: float
    smoothed_s: float


def peak_excesses(intervals: Sequence[Interval]) -> list[Excess]:
    """
    Return what the peak adds at each station, drawn to the mean as far as it is noise.

    With a mean square standard error ``e^2`` and a variance ``V`` between the stations, a share
    ``1 - e^2 / V`` of each station's distance from the mean is kept. The sum stays.

    Parameters
    ----------
    intervals
        Public intervals, with quiet hours and peak of southbound trains.

    Returns
    -------
    list[Excess]
        In running order.
    """
    quiet, peak = _southbound(intervals, QUIET), _southbound(intervals, PEAK)
    raw_s = {station: peak[station].mean_s - quiet[station].mean_s for station in peak}
    squares = {
        station: peak[station].standard_error_s ** 2 + quiet[station].standard_error_s ** 2
        for station in peak
    }
    mean_s = fmean(raw_s.values())
    kept = max(1.0 - fmean(squares.values()) / variance(raw_s.values()), 0.0)
    return [
        Excess(station, own_s, squares[station] ** 0.5, mean_s + kept * (own_s - mean_s))
        for station, own_s in raw_s.items()
    ]


@dataclass(frozen=True, slots=True)
class Share:
    """What a half hour adds to all intervals of the line, over what the peak adds. [-]"""

    start_min: int
    raw: float
    standard_error: float
    smoothed: float


def shares_of_peak(intervals: Sequence[Interval]) -> list[Share]:
    """
    Return what each half hour adds along the whole line, over what the peak adds.

    Parameters
    ----------
    intervals
        Public intervals, with quiet hours, peak and half hours of southbound trains.

    Returns
    -------
    list[Share]
        By half hour. Intervals that follow each other share a truncation, so the error of their
        sum is that of two truncated minutes. From the second half hour on, at whose start the
        morning rises at once, a share is smoothed with its neighbours by weights 1, 2, 1.
    """
    quiet, peak = _southbound(intervals, QUIET), _southbound(intervals, PEAK)
    whole_s = sum(peak[station].mean_s - quiet[station].mean_s for station in peak)
    raw, errors = [], []
    for start in HALF_HOURS_MIN:
        now = _southbound(intervals, clock_of(60 * start)[:5])
        raw.append(sum(now[name].mean_s - quiet[name].mean_s for name in peak) / whole_s)
        least = min(row.trains for row in now.values())
        errors.append((2.0 * 60.0**2 / 12.0 / least) ** 0.5 / whole_s)
    first, *morning = raw
    padded = [morning[0], *morning, morning[-1]]
    around = zip(padded[:-2], morning, padded[2:], strict=True)
    smoothed = [first, *((before + 2.0 * own + after) / 4.0 for before, own, after in around)]
    return [Share(*row) for row in zip(HALF_HOURS_MIN, raw, errors, smoothed, strict=True)]


def _southbound(intervals: Sequence[Interval], period: str) -> dict[str, Interval]:
    """Return the intervals of a period by the station at their end."""
    return {
        row.to_station: row
        for row in intervals
        if (row.direction, row.period) == (SOUTHBOUND, period)
    }


def dwell_rows(
    intervals: Sequence[Interval],
    quiet: Sequence[QuietLeg],
    today: Sequence[Mapping[str, str]],
) -> Iterator[tuple[str, ...]]:
    """
    Yield the rows of ``dwell_stations.csv``.

    Parameters
    ----------
    intervals
        Public intervals.
    quiet
        Quiet dwells.
    today
        A row for each station: its factor on the delays is kept, and the whole row of a station
        at which no interval ends.

    Yields
    ------
    tuple[str, ...]
        Rows: times of day with a dwell of their own, then the quiet dwell, which holds otherwise.
    """
    found = {excess.station: excess for excess in peak_excesses(intervals)}
    shares = shares_of_peak(intervals)
    quiet_s = {leg.to_station: leg.dwell_s for leg in quiet if leg.direction == SOUTHBOUND}
    factors = {row["station"]: row["delay_scale"] for row in today}
    kept = {row["station"]: row for row in today}
    for station, factor in factors.items():
        if station not in found:
            row = kept[station]
            yield station, "", "", row["minimum_dwell_s"], row["booked_dwell_s"], factor
            continue
        smoothed_s, least_s = found[station].smoothed_s, quiet_s[station]
        booked_s = {
            share.start_min: _booked_s(least_s, smoothed_s * share.smoothed) for share in shares
        }
        for dwell_s, starts in groupby(booked_s, key=booked_s.__getitem__):
            along = list(starts)
            if dwell_s != least_s:
                ends_min = along[0], along[-1] + HALF_HOURS_MIN.step
                times = tuple(clock_of(60 * minute) for minute in ends_min)
                yield station, *times, str(dwell_s - RESERVE_S), str(dwell_s), factor
        yield station, "", "", str(least_s - RESERVE_S), str(least_s), factor


def _booked_s(quiet_s: int, excess_s: float) -> int:
    return UNIT_S * round((quiet_s + max(excess_s, 0.0)) / UNIT_S)


def write_dwells(
    intervals: Sequence[Interval], quiet: Sequence[QuietLeg], today: Path, target: Path
) -> None:
    """
    Write ``dwell_stations.csv``.

    Parameters
    ----------
    intervals
        Public intervals.
    quiet
        Quiet dwells.
    today
        The table whose factors on the delays are kept.
    target
        The file.
    """
    with today.open(encoding="utf-8", newline="") as file:
        rows = {row["station"]: row for row in csv.DictReader(file)}
    write_rows(target, [HEADING, *dwell_rows(intervals, quiet, list(rows.values()))])
