r"""
Seconds for a timetable of which only whole departure minutes are public.

Every departure must lie within its public minute, every run must be possible for the train,
and one platform track must not hold two trains. Among all timetables that obey, the one is
chosen whose dwells and run times stay closest to their usual figures.

``python -m kankaku.scenarios.loading.reconstruct --force scenarios/rush_hour`` writes ``calls.csv``
anew.
"""

import argparse
import csv
import io
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil
from pathlib import Path

import numpy as np

from kankaku.railway.motion.run_curve import driven_run_s
from kankaku.railway.plan.driving_style import DrivingStyle
from kankaku.scenarios.loading.difference_programme import UNIT_S, DifferenceProgramme
from kankaku.scenarios.loading.public_timetable import PUBLIC_FILE, Source, read_source
from kankaku.scenarios.reading.excel_sheets import ENDING
from kankaku.scenarios.reading.units import clock_of

CALLS_FILE = "calls.csv"
EXIT_BAD_INPUT = 2
RUN_ALLOWANCE = 1.03
"""Least booked run time over the fastest, if that is how trains are driven. [-]"""
PLATFORM_INTERVAL_S = 60
"""Least booked time from a departure to the next arrival at the same platform track. [s]"""
MERGE_INTERVAL_S = 60
"""Least booked time between departures from different tracks of a station. [s]"""
EASY_INTERVAL_S = 90
"""Departure-to-arrival interval below which a penalty counts. [s]"""
Leg = tuple[str, str, str]
"""Train type, station of departure and station of arrival."""


@dataclass(frozen=True, slots=True)
class _Stop:
    """A call whose times are sought; arrival and departure are indices of unknowns."""

    train: str
    station: str
    track: str
    minute: int
    arrival: int
    departure: int
    origin: bool


def run_times(source: Source, driving: DrivingStyle) -> dict[Leg, float]:
    """
    Return the run times of trains that nobody hinders.

    Parameters
    ----------
    source
        Line, trains and public minutes.
    driving
        How they are driven.

    Returns
    -------
    dict[Leg, float]
        From when a train may depart, by train type, station of departure and station of arrival.
        [s]
    """
    stop_m = {platform.station: platform.stop_m for platform in source.line.platforms}
    return {
        (kind, start, end): driven_run_s(
            source.line, source.train_types[kind], driving, (stop_m[start], stop_m[end])
        )
        for kind, start, end in sorted(_legs(source))
    }


def _legs(source: Source) -> set[Leg]:
    return {
        (source.type_of_train[train], start, end)
        for train, minutes in source.departures.items()
        for start, end in pairwise(minutes)
    }


def least_run_times(source: Source) -> dict[Leg, int]:
    """
    Return the least booked run times.

    Parameters
    ----------
    source
        Line, trains, driving style and public minutes.

    Returns
    -------
    dict[Leg, int]
        Those of late trains in the style; a little above the fastest ones for the fastest style.
        [units]
    """
    allowance = 1.0 if source.driving.lowers else RUN_ALLOWANCE
    quickest = run_times(source, source.driving.at_limits)
    return {leg: ceil(allowance * run_s / UNIT_S) for leg, run_s in quickest.items()}


def usual_run_times(source: Source, least: Mapping[Leg, int]) -> dict[Leg, int]:
    """
    Return the usual run times: those of the driving style, or those that public minutes suggest.

    The truncation of the minutes cancels in the mean over many trains: what remains of the
    mean interval between two departures after the mean booked dwell is the usual run time.

    Parameters
    ----------
    source
        Line, trains, driving style and public minutes.
    least
        Least run time by train type and stations. [units]

    Returns
    -------
    dict[Leg, int]
        Usual run time, not below the least. [units]
    """
    if source.driving.lowers:
        usual_s = run_times(source, source.driving)
        return {leg: max(round(usual_s[leg] / UNIT_S), least[leg]) for leg in least}
    spans: dict[Leg, list[int]] = {}
    dwells_s: dict[Leg, list[float]] = {}
    for train, minutes in source.departures.items():
        for start, end in pairwise(minutes):
            leg = (source.type_of_train[train], start, end)
            spans.setdefault(leg, []).append(minutes[end] - minutes[start])
            dwells_s.setdefault(leg, []).append(source.dwell_of(train, end).booked_dwell_s)
    usual = {}
    for leg, found in spans.items():
        run_s = 60.0 * sum(found) / len(found) - sum(dwells_s[leg]) / len(found)
        usual[leg] = max(round(run_s / UNIT_S), least[leg])
    return usual


def reconstruct(source: Source) -> str:
    """
    Return a timetable to the second.

    Parameters
    ----------
    source
        Line, trains, driving style, dwell times and public minutes.

    Returns
    -------
    str
        Content of ``calls.csv``.

    Raises
    ------
    ValueError
        If no timetable obeys the public minutes.
    """
    trains = _stops(source)
    stops = [stop for train in trains for stop in train]
    programme = DifferenceProgramme(unknowns=2 * len(stops))
    _add_runs(programme, source, trains)
    _add_dwells(programme, source, stops)
    _add_intervals(programme, stops)
    per_minute = 60 // UNIT_S
    bounds: list[tuple[float, float]] = [(0.0, np.inf)] * programme.unknowns
    for stop in stops:
        first = stop.minute * per_minute
        bounds[stop.departure] = (first, first + per_minute - 1)
    times = programme.solve(bounds, f"{PUBLIC_FILE}: no timetable obeys the public minutes")
    text = io.StringIO(newline="")
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["train", "station", "track", "arrival", "departure"])
    for stop in stops:
        arrival, departure = (
            clock_of(UNIT_S * times[index]) for index in (stop.arrival, stop.departure)
        )
        rows.writerow([stop.train, stop.station, stop.track, arrival, departure])
    return text.getvalue()


def _stops(source: Source) -> list[list[_Stop]]:
    tracks: dict[str, list[str]] = {}
    for platform in source.line.platforms:
        tracks.setdefault(platform.station, []).append(platform.track)
    count = 0
    trains = []
    for train, minutes in source.departures.items():
        stops: list[_Stop] = []
        for station, minute in minutes.items():
            # A train that starts here stands at the second track, out of the others' way.
            track = tracks[station][-1 if not stops else 0]
            stops.append(
                _Stop(train, station, track, minute, 2 * count, 2 * count + 1, origin=not stops)
            )
            count += 1
        trains.append(stops)
    return trains


def _add_runs(programme: DifferenceProgramme, source: Source, trains: list[list[_Stop]]) -> None:
    least = least_run_times(source)
    usual = usual_run_times(source, least)
    for stops in trains:
        for before, after in pairwise(stops):
            leg = (source.type_of_train[before.train], before.station, after.station)
            programme.at_least(after.arrival, before.departure, least[leg])
            programme.prefer(after.arrival, before.departure, usual[leg])


def _add_dwells(programme: DifferenceProgramme, source: Source, stops: list[_Stop]) -> None:
    for stop in stops:
        dwell = source.dwell_of(stop.train, stop.station)
        booked = round(dwell.booked_dwell_s / UNIT_S)
        least = booked if stop.origin else ceil(dwell.minimum_dwell_s / UNIT_S)
        programme.at_least(stop.departure, stop.arrival, least)
        if stop.origin:
            programme.at_least(stop.arrival, stop.departure, -booked)
        programme.prefer(stop.departure, stop.arrival, booked)


def _add_intervals(programme: DifferenceProgramme, stops: list[_Stop]) -> None:
    for leader, follower in _neighbours(stops):
        if leader.track == follower.track:
            least = ceil(PLATFORM_INTERVAL_S / UNIT_S)
            programme.at_least(follower.arrival, leader.departure, least)
            easy = EASY_INTERVAL_S // UNIT_S
            programme.prefer(follower.arrival, leader.departure, easy, only_short=True)
        least = ceil(MERGE_INTERVAL_S / UNIT_S)
        programme.at_least(follower.departure, leader.departure, least)


def _neighbours(stops: list[_Stop]) -> Iterator[tuple[_Stop, _Stop]]:
    """Yield each stop with the next one of the station, and with the next one of its track."""
    by_place: dict[tuple[str, str], list[_Stop]] = {}
    for stop in stops:
        by_place.setdefault((stop.station, ""), []).append(stop)
        by_place.setdefault((stop.station, stop.track), []).append(stop)
    for neighbours in by_place.values():
        yield from pairwise(neighbours)


def write_calls(folder: Path, *, force: bool = False) -> Path:
    """
    Write ``calls.csv`` of a scenario folder.

    Parameters
    ----------
    folder
        The folder.
    force
        Replace a file that is there.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    FileExistsError
        If the file is there and is not to be replaced.
    ScenarioError
        If the files cannot be used.
    ValueError
        If no timetable obeys the public minutes.
    """
    target = folder / CALLS_FILE
    if os.path.lexists(target) and not force:
        msg = f"{target}: is there already; allowed: --force, which writes it anew"
        raise FileExistsError(msg)
    workbook = target.with_suffix(ENDING)
    if os.path.lexists(workbook):
        msg = f"{workbook}: stands in place of {CALLS_FILE}; allowed: no such file"
        raise FileExistsError(msg)
    text = reconstruct(read_source(folder))
    beside = folder / f".{CALLS_FILE}.{os.getpid()}"
    try:
        beside.write_text(text, encoding="utf-8", newline="")
        beside.replace(target)
    finally:
        beside.unlink(missing_ok=True)
    return target


def main(arguments: Sequence[str] | None = None) -> int:
    """
    Write ``calls.csv`` as the command line says.

    Parameters
    ----------
    arguments
        Those of the command line; of this process if None.

    Returns
    -------
    int
        Exit status.
    """
    parser = argparse.ArgumentParser(
        prog="python -m kankaku.scenarios.loading.reconstruct",
        description=f"Write {CALLS_FILE} of a scenario folder: a timetable to the second that "
        f"obeys the whole departure minutes of {PUBLIC_FILE}.",
    )
    parser.add_argument("folder", type=Path, help="scenario folder")
    parser.add_argument(
        "--force", action="store_true", help=f"write {CALLS_FILE} anew where it is there already"
    )
    options = parser.parse_args(arguments)
    try:
        written = write_calls(options.folder, force=options.force)
    except OSError as error:
        told = f"{error.filename}: {error.strerror}" if error.strerror else str(error)
        sys.stderr.write(f"{told}\n")
        return EXIT_BAD_INPUT
    except ValueError as error:
        sys.stderr.write(f"{options.folder} cannot be used\n{error}\n")
        return EXIT_BAD_INPUT
    sys.stdout.write(f"Written: {written}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
