"""
The invented timetable of the Yizhuang line: public run times, every 120 s.

Public are the whole minutes of departure of 165 trains of a weekday, all stations but the last.
The mean interval between two departures is a run and a dwell; the dwell is assumed, and the run is
what is left. All trains have the same times but for the interval between them, which is invented.
"""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil
from pathlib import Path

from kankaku.railway.motion.run_curve import fastest_run
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.scenarios.loading.load_line import read_line, to_line
from kankaku.scenarios.loading.load_stock import read_stock, to_train_types
from kankaku.scenarios.reading.files import Reader
from kankaku.scenarios.reading.mistakes import ScenarioError
from kankaku.scenarios.reading.units import clock_of
from tools.yizhuang.line import STATIONS, TRACK, Rows

PUBLIC_FILE = "public_timetable.csv"
TRAIN_TYPE = "beijing-b6"
TRAINS = 40
INTERVAL_S = 120
"""The closest interval that the line was designed to allow for. [s]"""
FIRST_S = 7 * 3600
"""When the first train leaves. [s after midnight]"""
UNIT_S = 5
RUN_ALLOWANCE = 1.03
"""Least booked run time over the fastest. [-]"""
READY_S = 45
"""How long a train stands ready at its origin. [s]"""
MARGIN_S = 5
"""What a booked dwell has above the minimum. [s]"""
USUAL_DWELL_S, INTERCHANGE_DWELL_S = 30, 40
INTERCHANGES = ("rongchang-dongjie", "ciqu", "yizhuang-railway-station")
DELAY_SCALES = {
    "songjiazhuang": 0.5,
    "xiaocun": 0.8,
    "xiaohongmen": 0.8,
    "wanyuanjie": 1.1,
    "rongjing-dongjie": 1.2,
    "rongchang-dongjie": 1.3,
    "tongjinanlu": 1.1,
    "ciqunan": 0.8,
    "ciqu": 1.3,
    "yizhuang-railway-station": 0.8,
}
"""Factors on the dwell delays; 1 elsewhere. [-]"""

Leg = tuple[str, str]
"""Stations of departure and of arrival."""


@dataclass(frozen=True, slots=True)
class LegTimes:
    """A leg in figures."""

    interval_s: float | None
    """Mean public time from departure to departure; nothing for the last leg. [s]"""
    fastest_s: float
    run_s: int
    """Booked run. [s]"""


def booked_dwell_s(station: str) -> int:
    """
    Return the booked dwell.

    Parameters
    ----------
    station
        Identifier.

    Returns
    -------
    int
        From arrival to departure. [s]
    """
    if station == STATIONS[0][0]:
        return READY_S
    return INTERCHANGE_DWELL_S if station in INTERCHANGES else USUAL_DWELL_S


def public_intervals(path: Path) -> dict[Leg, float]:
    """
    Return the mean time from departure to departure.

    The truncation of the minutes cancels in the mean over many trains.

    Parameters
    ----------
    path
        Minutes of departure by train and station.

    Returns
    -------
    dict[Leg, float]
        By stations. [s]
    """
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    minutes = {name: [_minute(row[name]) for row in rows] for name in rows[0] if name != "train"}
    return {
        (start, end): 60.0 * (sum(minutes[end]) - sum(minutes[start])) / len(rows)
        for start, end in pairwise(minutes)
    }


def _minute(clock: str) -> int:
    hours, minutes = clock.split(":")
    return 60 * int(hours) + int(minutes)


def read_line_and_train(folder: Path) -> tuple[Line, TrainType]:
    """
    Return line and train.

    Parameters
    ----------
    folder
        Folder with the tables of the line and the train.

    Returns
    -------
    tuple[Line, TrainType]
        Both in SI units.

    Raises
    ------
    ScenarioError
        If the files have mistakes.
    """
    reader = Reader()
    tables, stock = read_line(reader, folder), read_stock(reader, folder)
    if reader.mistakes or stock is None:
        raise ScenarioError(tuple(reader.mistakes))
    return to_line(tables, folder.name), to_train_types(stock)[TRAIN_TYPE]


def fastest_runs(folder: Path) -> dict[Leg, float]:
    """
    Return the fastest run of each leg.

    Parameters
    ----------
    folder
        Folder with the tables of the line and the train.

    Returns
    -------
    dict[Leg, float]
        By stations. [s]
    """
    line, train_type = read_line_and_train(folder)
    return {
        (start.id, end.id): fastest_run(
            line, train_type, start.chainage_m, end.chainage_m
        ).run_time_s
        for start, end in pairwise(line.stations)
    }


def leg_times(folder: Path) -> dict[Leg, LegTimes]:
    """
    Return the run times.

    Parameters
    ----------
    folder
        Folder with the tables of the line, the train and the public minutes.

    Returns
    -------
    dict[Leg, LegTimes]
        By stations, in running order. The last leg, whose departures nobody publishes, has the
        mean ratio of the others to the fastest run.
    """
    intervals_s, fastest_s = public_intervals(folder / PUBLIC_FILE), fastest_runs(folder)
    usual_s = {leg: span_s - booked_dwell_s(leg[1]) for leg, span_s in intervals_s.items()}
    ratio = sum(usual_s.values()) / sum(fastest_s[leg] for leg in usual_s)
    found = {}
    for leg, least_s in fastest_s.items():
        run_s = usual_s.get(leg, ratio * least_s)
        units = max(round(run_s / UNIT_S), ceil(RUN_ALLOWANCE * least_s / UNIT_S))
        found[leg] = LegTimes(intervals_s.get(leg), least_s, UNIT_S * units)
    return found


def timetable_tables(times: Mapping[Leg, LegTimes]) -> dict[str, Rows]:
    """
    Return the tables of the timetable.

    Parameters
    ----------
    times
        Run times by leg, in running order.

    Returns
    -------
    dict[str, Rows]
        Rows by file, header first.
    """
    dwells: Rows = [["station", "minimum_dwell_s", "booked_dwell_s", "delay_scale"]]
    for name, *_ in STATIONS:
        booked_s = booked_dwell_s(name)
        dwells.append([name, booked_s - MARGIN_S, booked_s, DELAY_SCALES.get(name, 1.0)])
    services: Rows = [["train", "train_type"]]
    calls: Rows = [["train", "station", "track", "arrival", "departure"]]
    for number in range(TRAINS):
        train = f"Y{number + 1:02d}"
        services.append([train, TRAIN_TYPE])
        for station, arrival_s, departure_s in _calls(times, FIRST_S + INTERVAL_S * number):
            calls.append([train, station, TRACK, clock_of(arrival_s), clock_of(departure_s)])
    return {"dwell_stations.csv": dwells, "services.csv": services, "calls.csv": calls}


def _calls(times: Mapping[Leg, LegTimes], leaves_s: int) -> Sequence[tuple[str, int, int]]:
    """Return station, arrival and departure of each call of a train. [s]"""
    found = [(STATIONS[0][0], leaves_s - READY_S, leaves_s)]
    for (_, station), leg in times.items():
        arrival_s = found[-1][2] + leg.run_s
        found.append((station, arrival_s, arrival_s + booked_dwell_s(station)))
    return found
