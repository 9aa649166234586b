"""
A timetable that one track between loops allows.

Trains that would be on one stretch of track in opposite directions, or at one platform at a time,
wait for each other where they call: of the two the one that waits less. Waits are caught up where
later stops are booked for longer than they need.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from math import ceil
from typing import NamedTuple

from kankaku.scenarios.drafts.meetings import Loops
from kankaku.scenarios.drafts.sketch import Sketch, Stop, TripCall
from kankaku.scenarios.drafts.stays import LEAST_DWELL_S

CLEARED_S = 30
"""From a train's arrival at a loop to the departure of the other one. [s]"""
FOLLOWED_S = 60
"""Between two trains of one direction. [s]"""
MOST_ROUNDS = 60
"""Waits for each trip, on the average, until the timetable is given up. [-]"""


class _Use(NamedTuple):
    """A train on a stretch between two places with loops, or at the platform of one."""

    enters_s: float
    leaves_s: float
    trip: str
    rises: bool
    waits_at: int
    """Number of its call before which nothing can hold it."""


class _Clash(NamedTuple):
    """Two trains of which one has to wait."""

    at_s: float
    trip: str
    waits_at: int
    wait_s: int


def with_sidings(sketch: Sketch, loops: Loops) -> Sketch:
    """
    Let trains call at the loops between stations at which they meet.

    Parameters
    ----------
    sketch
        Stations and trips.
    loops
        Where the line has loops.

    Returns
    -------
    Sketch
        With the loops between stations as further stops.
    """
    if not loops.sidings:
        return sketch
    names = [stop.name for stop in sketch.stops]
    stops = list(sketch.stops)
    calls = {trip.id: list(trip.calls) for trip in sketch.trips}
    at_km = sketch.at_km
    for name, siding in loops.sidings.items():
        between = f"Loop between {names[siding.before]} and {names[siding.before + 1]}"
        stops.append(Stop(name, between, siding.km))
        at_km[name] = siding.km
        for trip in siding.trips:
            calls[trip] = _with_call(calls[trip], at_km, name)
    stops.sort(key=lambda stop: stop.chainage_km)
    trips = tuple(replace(trip, calls=tuple(calls[trip.id])) for trip in sketch.trips)
    return replace(sketch, stops=tuple(stops), trips=trips)


def _with_call(calls: list[TripCall], at_km: Mapping[str, float], name: str) -> list[TripCall]:
    """Return calls with one more, when the train is booked to come by."""
    km = at_km[name]
    for number, (one, other) in enumerate(pairwise(calls), 1):
        ends_km = at_km[one.station], at_km[other.station]
        if min(ends_km) < km < max(ends_km):
            share = (km - ends_km[0]) / (ends_km[1] - ends_km[0])
            time_s = round(one.departure_s + share * (other.arrival_s - one.departure_s))
            return [*calls[:number], TripCall(name, time_s, time_s), *calls[number:]]
    return calls


def without_clashes(sketch: Sketch, own: Sequence[str]) -> Sketch:
    """
    Let trains wait for each other until the track is free.

    Parameters
    ----------
    sketch
        Stations and trips of a single line.
    own
        Stations with tracks of their own, by rising chainage; every trip begins and ends at one.

    Returns
    -------
    Sketch
        With later times, if need be; if no end of waiting is found, as far as it was got.
    """
    plan = _Plan(sketch, own)
    for _ in range(MOST_ROUNDS * len(sketch.trips)):
        clash = min(plan.clashes(), default=None)
        if clash is None:
            break
        plan.delay(clash.trip, clash.waits_at, clash.wait_s)
    trips = (replace(trip, calls=tuple(plan.calls[trip.id])) for trip in sketch.trips)
    return replace(sketch, trips=tuple(trips))


def later_than(asked: Sketch, planned: Sketch) -> dict[str, int]:
    """
    Return how much later trips are than they were asked to be.

    Parameters
    ----------
    asked, planned
        The same trips with the same calls.

    Returns
    -------
    dict[str, int]
        Greatest difference by trip, where there is any. [s]
    """
    late_s = {
        one.id: max(
            max(new.arrival_s - old.arrival_s, new.departure_s - old.departure_s)
            for number, (old, new) in enumerate(zip(one.calls, other.calls, strict=True))
            # Stock that comes later stands ready later; that is no delay yet.
            if number or new.departure_s > old.departure_s
        )
        for one, other in zip(asked.trips, planned.trips, strict=True)
    }
    return {trip: value for trip, value in late_s.items() if value > 0}


class _Plan:
    """Trips whose times are being changed."""

    def __init__(self, sketch: Sketch, own: Sequence[str]) -> None:
        self._sketch, self._at_km = sketch, sketch.at_km
        self._places_km = [self._at_km[name] for name in own]
        self._rises = {trip.id: sketch.rises(trip) for trip in sketch.trips}
        self._next = {trip.id: trip.next_trip for trip in sketch.trips if trip.next_trip}
        self._ends_km = {
            trip.id: (self._at_km[trip.calls[0].station], self._at_km[trip.calls[-1].station])
            for trip in sketch.trips
        }
        self._dwells_s = {
            trip.id: [
                min(call.departure_s - call.arrival_s, 2 * LEAST_DWELL_S) for call in trip.calls
            ]
            for trip in sketch.trips
        }
        self.calls = {trip.id: list(trip.calls) for trip in sketch.trips}
        self._uses = defaultdict[tuple[str, float, bool], dict[str, _Use]](dict)
        for trip in self.calls:
            self._note_uses(trip)

    def delay(self, trip: str, number: int, wait_s: int) -> None:
        """Let a trip depart later from one of its calls, and go on as soon as it may."""
        calls = self.calls[trip]
        call = calls[number]
        calls[number] = call._replace(departure_s=call.departure_s + wait_s)
        late_s = wait_s
        for after in range(number + 1, len(calls)):
            call = calls[after]
            arrival_s = call.arrival_s + late_s
            least_s = arrival_s + self._dwells_s[trip][after]
            departure_s = max(call.departure_s, least_s)
            calls[after] = TripCall(call.station, arrival_s, departure_s)
            late_s = departure_s - call.departure_s
        self._note_uses(trip)
        self._hand_over(trip)

    def _hand_over(self, trip: str) -> None:
        """Let the stock's next trip begin when this one has ended."""
        follower = self._next.get(trip)
        if not follower:
            return
        last, first = self.calls[trip][-1], self.calls[follower][0]
        self.calls[follower][0] = first._replace(arrival_s=last.departure_s)
        ready_s = max(last.arrival_s + round(self._sketch.minimum_turn_back_s), last.departure_s)
        if first.departure_s < ready_s:
            self.delay(follower, 0, ready_s - first.departure_s)

    def clashes(self) -> Iterator[_Clash]:
        """Yield trains that have to wait, the first of each stretch and each platform."""
        for (kind, *_), uses in self._uses.items():
            yield from _first_clash(sorted(uses.values()), alone=kind == "platform")

    def _note_uses(self, trip: str) -> None:
        """Note when a trip uses what."""
        rises, (low_km, high_km) = self._rises[trip], sorted(self._ends_km[trip])
        for one_km, other_km in pairwise(self._places_km):
            if low_km <= one_km and other_km <= high_km:
                ends_km = (one_km, other_km) if rises else (other_km, one_km)
                enters_s, waits_at = self._leaves(trip, ends_km[0])
                use = _Use(enters_s, self._comes_s(trip, ends_km[1]), trip, rises, waits_at)
                self._uses["stretch", one_km, True][trip] = use
        for km in self._places_km:
            if low_km < km < high_km:
                # Who is to come later is held where it calls before.
                calls = self.calls[trip]
                before = [n for n, call in enumerate(calls) if self._is_before(call, km, rises)]
                leaves_s, _ = self._leaves(trip, km)
                use = _Use(self._comes_s(trip, km), leaves_s, trip, rises, before[-1])
                self._uses["platform", km, rises][trip] = use

    def _is_before(self, call: TripCall, km: float, rises: bool) -> bool:
        return self._at_km[call.station] < km if rises else self._at_km[call.station] > km

    def _leaves(self, trip: str, km: float) -> tuple[float, int]:
        """Return when a trip leaves a place, and the call there or before."""
        calls = self.calls[trip]
        for number, (one, other) in enumerate(pairwise(calls)):
            if self._at_km[one.station] == km:
                return float(one.departure_s), number
            if self._inside(km, one, other):
                return self._passes_s(km, one, other), number
        return float(calls[-1].departure_s), len(calls) - 1

    def _comes_s(self, trip: str, km: float) -> float:
        """Return when a trip comes to a place. [s]"""
        calls = self.calls[trip]
        for one, other in pairwise(calls):
            if self._at_km[other.station] == km:
                return float(other.arrival_s)
            if self._inside(km, one, other):
                return self._passes_s(km, one, other)
        return float(calls[0].arrival_s)

    def _inside(self, km: float, one: TripCall, other: TripCall) -> bool:
        ends_km = self._at_km[one.station], self._at_km[other.station]
        return min(ends_km) < km < max(ends_km)

    def _passes_s(self, km: float, one: TripCall, other: TripCall) -> float:
        one_km, other_km = self._at_km[one.station], self._at_km[other.station]
        share = (km - one_km) / (other_km - one_km)
        return one.departure_s + share * (other.arrival_s - one.departure_s)


def _first_clash(uses: Sequence[_Use], *, alone: bool) -> Iterator[_Clash]:
    """Yield the first clash among trains in the order in which they enter."""
    for number, one in enumerate(uses):
        for other in uses[number + 1 :]:
            if other.enters_s >= one.leaves_s + FOLLOWED_S:
                break
            clash = (
                _follows(one, other, alone=alone)
                if one.rises is other.rises
                else _meets(one, other)
            )
            if clash:
                yield clash
                return


def _follows(one: _Use, other: _Use, *, alone: bool) -> _Clash | None:
    """Return how long the second of two trains of one direction has to wait, if it has to."""
    if alone:
        return _waiting(other, one.leaves_s + CLEARED_S - other.enters_s)
    apart_s = max(one.enters_s - other.enters_s, one.leaves_s - other.leaves_s)
    return _waiting(other, apart_s + FOLLOWED_S)


def _meets(one: _Use, other: _Use) -> _Clash | None:
    """Return who of two trains of opposite directions waits: who waits less."""
    late_s = one.leaves_s + CLEARED_S - other.enters_s
    other_way_s = other.leaves_s + CLEARED_S - one.enters_s
    return _waiting(one, other_way_s) if other_way_s < late_s else _waiting(other, late_s)


def _waiting(use: _Use, wait_s: float) -> _Clash | None:
    return _Clash(use.enters_s, use.trip, use.waits_at, ceil(wait_s)) if wait_s > 0.0 else None
