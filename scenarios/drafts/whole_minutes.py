"""
Seconds for trips of which only whole minutes are known.

Every known time stays within its minute. Among all times that do, those are chosen at which runs
and dwells come closest to their usual figures, trains follow each other at some distance, and
trains that meet on a single line wait for each other.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, inf
from typing import NamedTuple

from kankaku.scenarios.drafts.draft import DraftError
from kankaku.scenarios.drafts.runs import Runs
from kankaku.scenarios.drafts.sketch import DraftTrip, TripCall
from kankaku.scenarios.loading.difference_programme import UNIT_S, DifferenceProgramme

DWELL_S, LEAST_DWELL_S = 30, 15
"""Booked dwell where the minutes leave it open, and the least one. [s]"""
RUN_ALLOWANCE = 1.03
"""Least booked run time over the fastest one. [-]"""
FOLLOWING_S, MEETING_S = 60, 30
"""From a departure to the next arrival, and from an arrival to the other train's departure. [s]"""
FIRM, FIRMER = 5.0, 50.0
"""What a unit of deviation from these, and from run times, costs against usual figures. [-]"""
UNITS = 60 // UNIT_S


class MinuteCall(NamedTuple):
    """A booked stop; whole minutes after midnight where they are known."""

    station: str
    arrival_min: int | None
    departure_min: int | None

    @property
    def first_min(self) -> int:
        """The earlier of the known minutes."""
        known = self.departure_min if self.arrival_min is None else self.arrival_min
        return known or 0

    @property
    def last_min(self) -> int:
        """The later of the known minutes."""
        known = self.arrival_min if self.departure_min is None else self.departure_min
        return known or 0


@dataclass(frozen=True, slots=True)
class MinuteTrip:
    """A train of which whole minutes are known."""

    id: str
    train_type: str
    calls: tuple[MinuteCall, ...]
    rises: bool
    next_trip: str = ""


class _Known(NamedTuple):
    """A call whose times are sought; its arrival is an unknown, its departure the next one."""

    trip: MinuteTrip
    call: MinuteCall
    arrival: int

    @property
    def departure(self) -> int:
        """Number of the unknown."""
        return self.arrival + 1


class Timed(NamedTuple):
    """Trips to the second."""

    trips: tuple[DraftTrip, ...]
    hurried: tuple[str, ...]
    """Legs that the minutes leave less time for than the train needs."""


def in_seconds(trips: Sequence[MinuteTrip], runs: Runs, *, single_track: bool) -> Timed:
    """
    Return trips to the second.

    Parameters
    ----------
    trips
        Trips in whole minutes.
    runs
        Least run times.
    single_track
        Whether trains of opposite directions that stand at a station at a time wait for each other.

    Returns
    -------
    Timed
        The same trips.

    Raises
    ------
    DraftError
        If a train calls more often within a minute than it can.
    """
    known: list[list[_Known]] = []
    for trip in trips:
        first = 2 * sum(map(len, known))
        known.append([_Known(trip, call, first + 2 * at) for at, call in enumerate(trip.calls)])
    programme = DifferenceProgramme(2 * sum(map(len, known)))
    _add_runs(programme, known, runs)
    _add_dwells(programme, known)
    _add_neighbours(programme, [one for calls in known for one in calls], single_track)
    bounds = [pair for calls in known for one in calls for pair in _bounds(one.call)]
    try:
        units = programme.solve(bounds, "no times obey the minutes")
    except ValueError as error:
        where, allowed = "whole minutes", "at most three calls of a train within a minute"
        raise DraftError(where, str(error), allowed) from error
    times_s = [UNIT_S * unit for unit in units]
    made, hurried = [], dict[str, None]()
    for trip, calls in zip(trips, known, strict=True):
        booked = tuple(
            TripCall(one.call.station, times_s[one.arrival], times_s[one.departure])
            for one in calls
        )
        made.append(DraftTrip(trip.id, trip.train_type, booked, trip.next_trip))
        for one, other in pairwise(booked):
            least_s = runs.between_s(one.station, other.station, trip.train_type)
            if other.arrival_s - one.departure_s < least_s:
                hurried[f"{one.station} to {other.station}"] = None
    return Timed(tuple(made), tuple(hurried))


def _bounds(call: MinuteCall) -> Iterator[tuple[float, float]]:
    for minute in (call.arrival_min, call.departure_min):
        yield (0.0, inf) if minute is None else (minute * UNITS, minute * UNITS + UNITS - 1)


def _add_runs(
    programme: DifferenceProgramme, known: Sequence[Sequence[_Known]], runs: Runs
) -> None:
    legs: dict[tuple[str, str, str], list[tuple[_Known, _Known]]] = {}
    for calls in known:
        for one, other in pairwise(calls):
            key = one.call.station, other.call.station, one.trip.train_type
            legs.setdefault(key, []).append((one, other))
    for leg, pairs in legs.items():
        least = ceil(RUN_ALLOWANCE * runs.between_s(*leg) / UNIT_S)
        # The truncation of the minutes cancels in the mean over many trains.
        spans_s = [
            60 * (other.call.last_min - one.call.last_min) - _open_dwell_s(other.call)
            if other.call.arrival_min is None
            else 60 * (other.call.arrival_min - one.call.last_min)
            for one, other in pairs
        ]
        usual = max(round(sum(spans_s) / len(spans_s) / UNIT_S), least)
        for one, other in pairs:
            programme.at_least(other.arrival, one.departure, 1)
            programme.prefer(other.arrival, one.departure, least, only_short=True, weight=FIRMER)
            programme.prefer(other.arrival, one.departure, usual)


def _open_dwell_s(call: MinuteCall) -> int:
    return DWELL_S if call.arrival_min is None else 0


def _add_dwells(programme: DifferenceProgramme, known: Sequence[Sequence[_Known]]) -> None:
    for calls in known:
        for number, one in enumerate(calls):
            programme.at_least(one.departure, one.arrival, LEAST_DWELL_S // UNIT_S)
            if number in {0, len(calls) - 1}:
                # Where it begins or ends, nobody says how long it stands.
                programme.at_least(one.departure, one.arrival, DWELL_S // UNIT_S)
                programme.at_least(one.arrival, one.departure, -DWELL_S // UNIT_S)
            programme.prefer(one.departure, one.arrival, DWELL_S // UNIT_S)


def _add_neighbours(
    programme: DifferenceProgramme,
    known: Sequence[_Known],
    single_track: bool,
) -> None:
    by_station: dict[str, list[_Known]] = {}
    for one in known:
        by_station.setdefault(one.call.station, []).append(one)
    for here in by_station.values():
        here.sort(key=lambda one: (one.call.last_min, one.call.first_min, one.trip.id))
        for rises in (True, False):
            same_way = [one for one in here if one.trip.rises is rises]
            for one, other in pairwise(same_way):
                units = FOLLOWING_S // UNIT_S
                programme.prefer(other.arrival, one.departure, units, only_short=True, weight=FIRM)
        if single_track:
            _add_meetings(programme, here)


def _add_meetings(programme: DifferenceProgramme, here: Sequence[_Known]) -> None:
    """Let trains that stand at a station at a time depart after the other one has come."""
    for one in (one for one in here if one.trip.rises):
        for other in (other for other in here if not other.trip.rises):
            apart = (
                one.call.first_min > other.call.last_min or other.call.first_min > one.call.last_min
            )
            if not apart:
                units = MEETING_S // UNIT_S
                for later, earlier in ((one, other), (other, one)):
                    programme.prefer(
                        later.departure, earlier.arrival, units, only_short=True, weight=FIRM
                    )
