"""
Regular timetables: trains in both directions at one headway, and stock that turns back.

All trains of a direction run alike, one headway apart; a *working* says between which stations,
and the workings take turns. What is left to choose is how the directions lie to each other: so
that trains turn back in no less than the least time, and leave a terminal when no other one comes
in, with the fewest tracks and trains.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil
from typing import NamedTuple, TypeAlias

from kankaku.scenarios.drafts.circulation import linked
from kankaku.scenarios.drafts.sketch import DraftTrip, TripCall
from kankaku.scenarios.drafts.stays import CLEARING_S

FINEST_CHOICES = 90
"""Of each of two unknowns. [-]"""
RunTime: TypeAlias = Callable[[str, str], float]
"""Least run time from a station to another one. [s]"""


class Working(NamedTuple):
    """Trains to and fro between two stations, the lower chainage first."""

    first: str
    last: str


@dataclass(frozen=True, slots=True)
class Regular:
    """What is asked of a regular timetable."""

    headway_s: int
    from_s: int
    until_s: int
    workings: tuple[Working, ...]
    turn_back_s: int
    """Least time from an arrival to the departure of the same stock."""
    train_type: str
    dwell_s: Mapping[str, int]
    """By station."""
    supplement: float = 0.05
    """RegularTrips over least run time, less 1. [-]"""
    throat_s: float = 75.0
    """From a departure at a terminal until the next train can have arrived there."""
    most_tracks: int = 99
    """At a terminal. [-]"""
    reversing: bool = True
    """Trains run in both directions; else only to higher chainage."""
    names: tuple[str, str] = ("r", "f")
    """Names of rising and falling trains begin so."""


@dataclass(frozen=True, slots=True)
class DirectionTimes:
    """When trains of one direction are at stations, counted from the first one of the line."""

    stations: tuple[str, ...]
    """In running order."""
    arrival_s: Mapping[str, int]
    departure_s: Mapping[str, int]


class RegularTrips(NamedTuple):
    """A regular timetable."""

    trips: tuple[DraftTrip, ...]
    sets: int
    """Trains that it takes."""
    turns_s: Mapping[str, int]
    """Longest time from an arrival to the departure of the same stock, by station."""
    stretched_s: int
    """What falling trains run longer than they need to, on the whole line."""


class _Choice(NamedTuple):
    """How falling trains lie to rising ones; the least is the best."""

    lacking: int
    """Tracks at terminals beyond what there are."""
    late_s: float
    """What departures and arrivals at terminals are too near to each other."""
    tracks: int
    sets: int
    stretched_s: int
    longest_s: int
    phase_s: int


def profile(
    stations: Sequence[str], run_s: RunTime, asked: Regular, extra_s: int = 0
) -> DirectionTimes:
    """
    Return when trains of one direction are at stations.

    Parameters
    ----------
    stations
        In running order.
    run_s
        Least run times.
    asked
        Dwells and supplement.
    extra_s
        Spread over the legs by their length in time, beside the supplement. [s]

    Returns
    -------
    DirectionTimes
        From the departure at the first one. [s]
    """
    legs_s = [run_s(one, other) for one, other in pairwise(stations)]
    whole_s, so_far_s = sum(legs_s), 0.0
    arrival_s, departure_s = {stations[0]: -asked.dwell_s[stations[0]]}, {stations[0]: 0}
    time_s = 0
    for (_, name), leg_s in zip(pairwise(stations), legs_s, strict=True):
        before_s = round(extra_s * so_far_s / whole_s)
        so_far_s += leg_s
        given_s = round(extra_s * so_far_s / whole_s) - before_s
        time_s += ceil(leg_s * (1.0 + asked.supplement)) + given_s
        arrival_s[name] = time_s
        time_s += asked.dwell_s[name]
        departure_s[name] = time_s
    return DirectionTimes(tuple(stations), arrival_s, departure_s)


def regular_trips(stations: Sequence[str], run_s: RunTime, asked: Regular) -> RegularTrips:
    """
    Return a regular timetable of a line with a track for each direction.

    Parameters
    ----------
    stations
        By rising chainage.
    run_s
        Least run times.
    asked
        What is asked for.

    Returns
    -------
    RegularTrips
        Trains that begin from the first moment until the last one; stock goes on where it can.
    """
    up = profile(stations, run_s, asked)
    if not asked.reversing:
        return _booked(asked, up, None, 0, 0)
    order = stations[::-1]
    step_s = ceil(asked.headway_s / FINEST_CHOICES)
    downs = {
        extra_s: profile(order, run_s, asked, extra_s)
        for extra_s in range(0, asked.headway_s, step_s)
    }
    period_s = asked.headway_s * len(asked.workings)
    best = min(
        _rated(asked, up, down, extra_s, phase_s)
        for extra_s, down in downs.items()
        for phase_s in range(0, period_s, ceil(period_s / FINEST_CHOICES))
    )
    return _booked(asked, up, downs[best.stretched_s], best.phase_s, best.stretched_s)


def _rated(
    asked: Regular, up: DirectionTimes, down: DirectionTimes, extra_s: int, phase_s: int
) -> _Choice:
    headway_s, count = asked.headway_s, len(asked.workings)
    period_s, least_s = headway_s * count, asked.turn_back_s
    late_s, lacking, tracks, sets, longest_s = 0.0, 0, 0, 0, 0
    for working in asked.workings:
        far_s = phase_s + down.departure_s[working.last] - up.arrival_s[working.last]
        near_s = up.departure_s[working.first] - phase_s - down.arrival_s[working.first]
        turns_s = [(turn_s - least_s) % period_s + least_s for turn_s in (far_s, near_s)]
        for turn_s in turns_s:
            # After a departure the next train arrives so much later.
            late_s += max(asked.throat_s - (headway_s - turn_s % headway_s), 0.0)
            needed = ceil((turn_s + CLEARING_S) / period_s)
            lacking += max(needed - asked.most_tracks, 0)
            tracks += needed
        ran_s = up.arrival_s[working.last] - up.departure_s[working.first]
        ran_s += down.arrival_s[working.first] - down.departure_s[working.last]
        sets += round((ran_s + sum(turns_s)) / period_s)
        longest_s = max(longest_s, *turns_s)
    return _Choice(lacking, late_s, tracks, sets, extra_s, longest_s, phase_s)


def _booked(
    asked: Regular, up: DirectionTimes, down: DirectionTimes | None, phase_s: int, stretched_s: int
) -> RegularTrips:
    trips = list(_direction(asked, up, 0, asked.names[0]))
    rises = {trip.id: True for trip in trips}
    if down is not None:
        falling = list(_direction(asked, down, phase_s, asked.names[1]))
        rises |= {trip.id: False for trip in falling}
        trips += falling
    trips.sort(key=lambda trip: trip.calls[0].departure_s)
    return booked_of(linked(trips, asked.turn_back_s, rises), stretched_s)


def booked_of(trips: Sequence[DraftTrip], stretched_s: int = 0) -> RegularTrips:
    """
    Return trips with what they take.

    Parameters
    ----------
    trips
        Trips with links.
    stretched_s
        What falling trains run longer than they need to. [s]

    Returns
    -------
    RegularTrips
        The same.
    """
    by_id = {trip.id: trip for trip in trips}
    turns_s: dict[str, int] = {}
    for trip in trips:
        if trip.next_trip:
            last, follower = trip.calls[-1], by_id[trip.next_trip]
            turn_s = follower.calls[0].departure_s - last.arrival_s
            turns_s[last.station] = max(turns_s.get(last.station, 0), turn_s)
    sets = len(trips) - sum(bool(trip.next_trip) for trip in trips)
    return RegularTrips(tuple(trips), sets, turns_s, stretched_s)


def _direction(
    asked: Regular, runs: DirectionTimes, phase_s: int, name: str
) -> Iterable[DraftTrip]:
    """Return the trips of one direction, in order."""
    count, number = len(asked.workings), 0
    latest_s = max(runs.departure_s.values())
    base_s = asked.from_s + phase_s
    first = -ceil((phase_s + latest_s) / asked.headway_s)
    last = ceil((asked.until_s - asked.from_s) / asked.headway_s)
    for slot in range(first, last + 1):
        working = asked.workings[slot % count]
        at = sorted(runs.stations.index(station) for station in working)
        called = runs.stations[at[0] : at[1] + 1]
        begins_s = base_s + slot * asked.headway_s
        starts_s = begins_s + runs.departure_s[called[0]]
        if not asked.from_s <= starts_s <= asked.until_s:
            continue
        number += 1
        calls = [TripCall(called[0], starts_s - asked.dwell_s[called[0]], starts_s)]
        calls += [
            TripCall(
                station, begins_s + runs.arrival_s[station], begins_s + runs.departure_s[station]
            )
            for station in called[1:]
        ]
        yield DraftTrip(f"{name}{number:03d}", asked.train_type, tuple(calls))
