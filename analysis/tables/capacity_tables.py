"""Capacity of a line: headways by station, blocking times, compression, and the tables of them."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pandas as pd

from kankaku.analysis.tables.columns import rows_frame
from kankaku.analysis.words import KMH_PER_MPS
from kankaku.railway.arrays import FloatArray
from kankaku.railway.capacity.blocking_time import Headway
from kankaku.railway.motion.journey import Journey
from kankaku.railway.plan.pattern import PeakPattern, total_dwell_s
from kankaku.railway.plan.timetable import Service, Timetable
from kankaku.railway.step.records import Column

HEADWAYS = (
    Column("controller", "str", "", "name of the controller"),
    Column("protection", "str", "", "its protection"),
    Column("train", "str", "", "train whose pattern both trains have"),
    Column("station", "str", "", "station that both trains call at"),
    Column("dwell_s", "float64", "s", "its booked dwell there"),
    Column("headway_s", "float64", "s", "technical headway into it; as simulated where it was"),
    Column("blocking_time_headway_s", "float64", "s", "the same by blocking times"),
    Column("simulated_headway_s", "float64", "s", "the same, two trains simulated; empty if not"),
    Column("booked_interval_s", "float64", "s", "least booked one at that platform; empty if none"),
    Column("headway_margin_s", "float64", "s", "booked interval less headway"),
    Column("critical_ahead_m", "float64", "m", "so far before its stop the follower is then"),
    Column("critical_speed_kmh", "float64", "km/h", "its speed at the moment that decides"),
    Column("critical_block", "str", "", "block that the leader gives up just then"),
)
CAPACITY = (
    Column("controller", "str", "", "name of the controller"),
    Column("headway_s", "float64", "s", "headway of the line: the greatest into any station"),
    Column("blocking_time_headway_s", "float64", "s", "the greatest by blocking times alone"),
    Column("critical_station", "str", "", "station that it is the headway of"),
    Column("critical_dwell_s", "float64", "s", "booked dwell there"),
    Column("train", "str", "", "train whose pattern both trains of a headway have"),
    Column("pattern_trains", "int64", "", "trains of the busiest 60 minutes with that pattern"),
    Column(
        "pattern_dwell_s", "float64", "s", "booked dwells of the train, all calls but the first"
    ),
    Column("trains_per_hour", "float64", "1/h", "3600 s over the headway of the line"),
    Column("scheduled_speed_kmh", "float64", "km/h", "distance over time, all dwells included"),
    Column("transport_capacity", "float64", "km/h 1/h", "scheduled speed times trains per hour"),
    Column("level", "str", "", "highest of the levels A to D that is reached; empty below A"),
    Column("booked_s", "float64", "s", "from first to last arrival at the last station, booked"),
    Column("compressed_s", "float64", "s", "the same with the booked trains moved together"),
    Column("occupation_percent", "float64", "%", "compressed over booked"),
    Column(
        "busiest_begin_s", "float64", "s", "when the busiest 60 minutes begin, by last arrivals"
    ),
    Column("busiest_trains", "int64", "", "trains that reach their last station in them"),
    Column("busiest_occupation_percent", "float64", "%", "occupation by these trains alone"),
)
BLOCKING_TIMES = (
    Column("controller", "str", "", "name of the controller"),
    Column("train", "str", "", "train, alone on the line, as fast as it can with booked dwells"),
    Column("block", "str", "", "block, track circuit, or stretch of line"),
    Column("start_m", "float64", "m", "where it begins"),
    Column("end_m", "float64", "m", "where it ends"),
    Column("begin_s", "float64", "s", "from when on the train needs it, seconds after midnight"),
    Column("end_s", "float64", "s", "when the train has given it up"),
)
CAPACITY_TABLES: Mapping[str, tuple[Column, ...]] = {
    "headways": HEADWAYS,
    "capacity": CAPACITY,
    "blocking_times": BLOCKING_TIMES,
}
LEVELS: Mapping[str, float] = {"A": 750.0, "B": 1500.0, "C": 2250.0, "D": 3000.0}
"""Least transport capacity by level (Takaoka et al. 1991, fig. 1). [km/h 1/h]"""


class Stretches(NamedTuple):
    """The blocks, circuits or other stretches along the way of a train."""

    names: tuple[str, ...]
    edges_m: FloatArray
    """Where they begin, and the end of the last. [m], shape (n_stretches + 1,)"""


class Occupation(NamedTuple):
    """A compressed timetable."""

    booked_s: float
    compressed_s: float
    busiest_percent: float
    """Occupation rate over the busiest hour; not a number for a train alone in it. [%]"""

    @property
    def percent(self) -> float:
        """Occupation rate over the whole timetable. [%]"""
        return percent_of(self.compressed_s, self.booked_s)


def percent_of(compressed_s: float, booked_s: float) -> float:
    """
    Return an occupation rate.

    Parameters
    ----------
    compressed_s
        Time that trains take when they are moved together. [s]
    booked_s
        As booked. [s]

    Returns
    -------
    float
        Their ratio; not a number for trains that are booked at one moment. [%]
    """
    return 100.0 * compressed_s / booked_s if booked_s > 0.0 else np.nan


@dataclass(frozen=True, slots=True, eq=False)
class CapacityAssessment:
    """What is found out about one controller."""

    controller: str
    protection: str
    service: Service
    """The train whose pattern both have."""
    pattern: PeakPattern
    """Where and when that pattern is the most frequent one."""
    journey: Journey
    headways: tuple[Headway, ...]
    """Into every call but the first."""
    stretches: Stretches
    begin_s: FloatArray
    """Blocking times of the stretches. [s], shape (n_stretches,)"""
    end_s: FloatArray
    occupation: Occupation | None
    """None for a timetable of one train."""
    simulated_s: FloatArray
    """Headways as simulated; not a number where not. [s], shape (n_calls - 1,)"""

    @property
    def by_theory_s(self) -> FloatArray:
        """Headways by blocking times. [s], shape (n_calls - 1,)"""
        return np.array([headway.headway_s for headway in self.headways])

    @property
    def headways_s(self) -> FloatArray:
        """Headways, as simulated where they were. [s], shape (n_calls - 1,)"""
        return np.where(np.isnan(self.simulated_s), self.by_theory_s, self.simulated_s)

    @property
    def critical(self) -> int:
        """The call with the greatest headway."""
        return 1 + int(self.headways_s.argmax())

    @property
    def headway_s(self) -> float:
        """Headway of the line. [s]"""
        return float(self.headways_s.max())

    @property
    def scheduled_speed_mps(self) -> float:
        """From first departure to last arrival, dwells included. [m/s]"""
        first, last = self.service.calls[0], self.service.calls[-1]
        taken_s = self.journey.arrival_s[-1] - self.journey.departure_s[0]
        return float((last.stop_m - first.stop_m) / taken_s)


def level_of(transport_capacity: float) -> str:
    """
    Return the level that a transport capacity reaches.

    Parameters
    ----------
    transport_capacity
        Scheduled speed times trains per hour. [km/h 1/h]

    Returns
    -------
    str
        A letter; empty below level A.

    References
    ----------
    .. [1] Takaoka et al. 1991, section 2, eq. (1) and fig. 1.
    """
    reached = [name for name, least in LEVELS.items() if transport_capacity >= least]
    return reached[-1] if reached else ""


def headways_frame(assessments: Iterable[CapacityAssessment], timetable: Timetable) -> pd.DataFrame:
    """
    Return the headways by station.

    Parameters
    ----------
    assessments
        One per controller.
    timetable
        Whose booked intervals to compare with.

    Returns
    -------
    pd.DataFrame
        Columns ``HEADWAYS``.
    """
    booked_s = _least_intervals_s(timetable)
    rows = []
    for found in assessments:
        for call, headway in enumerate(found.headways, start=1):
            booked = found.service.calls[call]
            interval_s = booked_s.get((booked.station, booked.track), np.nan)
            rows.append(
                {
                    "controller": found.controller,
                    "protection": found.protection,
                    "train": found.service.train,
                    "station": booked.station,
                    "dwell_s": booked.departure_s - booked.arrival_s,
                    "headway_s": found.headways_s[call - 1],
                    "blocking_time_headway_s": headway.headway_s,
                    "simulated_headway_s": found.simulated_s[call - 1],
                    "booked_interval_s": interval_s,
                    "headway_margin_s": interval_s - found.headways_s[call - 1],
                    "critical_ahead_m": booked.stop_m - headway.front_m,
                    "critical_speed_kmh": KMH_PER_MPS * headway.speed_mps,
                    "critical_block": _block_given_up(found, headway),
                }
            )
    return rows_frame(rows, HEADWAYS)


def _block_given_up(found: CapacityAssessment, headway: Headway) -> str:
    """Return the block whose end of blocking is the moment that decides."""
    given_up_s = headway.time_s + headway.headway_s
    return found.stretches.names[int(np.nanargmin(np.abs(found.end_s - given_up_s)))]


def _least_intervals_s(timetable: Timetable) -> dict[tuple[str, str], float]:
    departures_s: dict[tuple[str, str], list[float]] = {}
    for service in timetable.services:
        for call in service.calls:
            departures_s.setdefault((call.station, call.track), []).append(call.departure_s)
    return {
        platform: min(after - before for before, after in pairwise(sorted(times_s)))
        for platform, times_s in departures_s.items()
        if len(times_s) > 1
    }


def capacity_frame(assessments: Iterable[CapacityAssessment]) -> pd.DataFrame:
    """
    Return the capacity of the line by controller.

    Parameters
    ----------
    assessments
        One per controller.

    Returns
    -------
    pd.DataFrame
        Columns ``CAPACITY``.
    """
    rows = []
    for found in assessments:
        trains_per_hour = 3600.0 / found.headway_s
        speed_kmh = KMH_PER_MPS * found.scheduled_speed_mps
        occupation, hour = found.occupation, found.pattern.hour
        critical = found.service.calls[found.critical]
        rows.append(
            {
                "controller": found.controller,
                "headway_s": found.headway_s,
                "blocking_time_headway_s": found.by_theory_s.max(),
                "critical_station": critical.station,
                "critical_dwell_s": critical.departure_s - critical.arrival_s,
                "train": found.service.train,
                "pattern_trains": len(found.pattern.rows),
                "pattern_dwell_s": total_dwell_s(found.service),
                "trains_per_hour": trains_per_hour,
                "scheduled_speed_kmh": speed_kmh,
                "transport_capacity": speed_kmh * trains_per_hour,
                "level": level_of(speed_kmh * trains_per_hour),
                "booked_s": occupation.booked_s if occupation else np.nan,
                "compressed_s": occupation.compressed_s if occupation else np.nan,
                "occupation_percent": occupation.percent if occupation else np.nan,
                "busiest_begin_s": hour.begin_s,
                "busiest_trains": len(hour.rows),
                "busiest_occupation_percent": occupation.busiest_percent if occupation else np.nan,
            }
        )
    return rows_frame(rows, CAPACITY)


def blocking_times_frame(assessments: Iterable[CapacityAssessment]) -> pd.DataFrame:
    """
    Return the blocking times.

    Parameters
    ----------
    assessments
        One per controller.

    Returns
    -------
    pd.DataFrame
        Columns ``BLOCKING_TIMES``; only stretches that the train needs.
    """
    rows = []
    for found in assessments:
        edges_m = found.stretches.edges_m.tolist()
        times_s = zip(found.begin_s.tolist(), found.end_s.tolist(), strict=True)
        for name, ends_m, (begin_s, end_s) in zip(
            found.stretches.names, pairwise(edges_m), times_s, strict=True
        ):
            if not np.isnan(begin_s):
                rows.append(
                    {
                        "controller": found.controller,
                        "train": found.service.train,
                        "block": name,
                        "start_m": ends_m[0],
                        "end_m": ends_m[1],
                        "begin_s": begin_s,
                        "end_s": end_s,
                    }
                )
    return rows_frame(rows, BLOCKING_TIMES)


def distinct(assessments: Sequence[CapacityAssessment]) -> list[list[CapacityAssessment]]:
    """
    Group controllers that have the same blocking times: other operations over one protection.

    Parameters
    ----------
    assessments
        One per controller.

    Returns
    -------
    list[list[CapacityAssessment]]
        Groups in the order of their first controllers.
    """
    groups: dict[tuple[float, ...], list[CapacityAssessment]] = {}
    for found in assessments:
        groups.setdefault(tuple(found.by_theory_s.round(3).tolist()), []).append(found)
    return list(groups.values())
