"""
Seconds for the day's trains of the whole line.

As :mod:`kankaku.scenarios.loading.reconstruct` does it for one direction: every departure in its
public minute, every run possible, one train at a time at a platform track and in the points, and
among all such timetables the one whose runs and dwells are closest to their usual figures. All
constraints are differences of two times in whole units, so the solution is a whole number of
units. Public minutes may give way, at a high price, where trains would be too close otherwise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import ceil
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import coo_array

from tools.whole_line.layout import Layout, Passage
from tools.whole_line.runs import UNIT_S, Usual
from tools.whole_line.trips import Trip, by_id

MINUTE = 60 // UNIT_S
TURN_BACK = 120 // UNIT_S
READY = 60 // UNIT_S
FOLLOWING = 75 // UNIT_S
"""Least from a departure to the next arrival at the same platform track. [units]"""
DEPARTURES = 90 // UNIT_S
"""Least between departures in one direction. [units]"""
POINTS = 80 // UNIT_S
"""Least between conflicting movements over points. [units]"""
WINDOW = 360 // UNIT_S
"""Movements further apart are not compared. [units]"""
STEPS = (0, 4)
"""A deviation counts once more beyond each of these. [units]"""
PUBLIC_PRICE = 50.0
"""Price of a unit outside the public minute; a unit off the usual figures costs 1."""


class Moment(NamedTuple):
    """A time: an unknown and what is added to it."""

    unknown: int
    offset: float = 0.0


@dataclass
class Programme:
    """A linear programme over differences of times, in whole units."""

    unknowns: int
    rows: list[tuple[int, int, int, int]] = field(default_factory=list)
    """Later, earlier (or -1: nothing), slack (or -1), greatest difference."""
    weights: list[float] = field(default_factory=list)

    def at_least(self, later: Moment, earlier: Moment, units: float) -> None:
        """Demand a least difference."""
        least = ceil(units + earlier.offset - later.offset - 1e-9)
        self.rows.append((earlier.unknown, later.unknown, -1, -least))

    def exactly(self, later: Moment, earlier: Moment, units: int) -> None:
        """Demand a difference."""
        self.at_least(later, earlier, units)
        self.at_least(earlier, later, -units)

    def prefer(self, later: Moment, earlier: Moment, units: int) -> None:
        """Let deviations from a difference cost."""
        for step in STEPS:
            self._slack(earlier.unknown, later.unknown, step - units, 1.0)
            self._slack(later.unknown, earlier.unknown, step + units, 1.0)

    def within_minute(self, moment: Moment, minute: int) -> None:
        """Let times outside a minute cost much."""
        self._slack(moment.unknown, -1, MINUTE * minute + MINUTE - 1, PUBLIC_PRICE)
        self._slack(-1, moment.unknown, -MINUTE * minute, PUBLIC_PRICE)

    def _slack(self, later: int, earlier: int, most: int, weight: float) -> None:
        self.rows.append((later, earlier, self.unknowns + len(self.weights), most))
        self.weights.append(weight)

    def solve(self) -> list[int]:
        """Return the times."""
        later, earlier, slack, most = (np.array(part) for part in zip(*self.rows, strict=True))
        row = np.arange(len(self.rows))
        parts = [(later, 1.0), (earlier, -1.0), (slack, -1.0)]
        entries = np.concatenate([np.full(np.sum(at >= 0), sign) for at, sign in parts])
        places = (
            np.concatenate([row[at >= 0] for at, _ in parts]),
            np.concatenate([at[at >= 0] for at, _ in parts]),
        )
        width = self.unknowns + len(self.weights)
        # The stubs of linprog do not know that it takes sparse matrices.
        matrix: Any = coo_array((entries, places), shape=(row.size, width)).tocsr()
        # Uneven little costs leave one best solution, whatever the solver's path.
        tie_break = 1e-4 * ((np.arange(1, self.unknowns + 1) * 0.618033988749895) % 1.0 - 0.5)
        costs = np.concatenate([tie_break, self.weights])
        result = linprog(costs, A_ub=matrix, b_ub=most, bounds=(0.0, None), method="highs-ds")
        if result.x is None:
            msg = f"no timetable is possible: {result.message}"
            raise ValueError(msg)
        times = result.x[: self.unknowns]
        if np.max(np.abs(times - np.round(times))) > 1e-6:
            msg = "the solver returned a solution between whole units"
            raise ValueError(msg)
        return [int(time) for time in np.round(times)]


@dataclass(frozen=True)
class Day:
    """The trains with the places of their unknowns: an arrival and a departure per call."""

    trips: Sequence[Trip]
    layout: Layout
    usual: Usual

    def estimate(self, trip: Trip, index: int) -> float:
        """Return about when a train leaves a station, or ends there. [units]"""
        return MINUTE * (trip.minutes[index] + 0.5)

    def estimate_arrival(self, trip: Trip, index: int) -> float:
        """Return about when a train comes to a station. [units]"""
        ends = index + 1 == len(trip.stations)
        dwell = 0 if ends else self.usual.dwell[trip.stations[index]]
        leg = (trip.stations[index - 1], trip.stations[index])
        # Some wait long for their public departure: they came when the run was over.
        run_over = self.estimate(trip, index - 1) + self.usual.run[leg]
        return min(self.estimate(trip, index) - dwell, run_over)

    def first_unknowns(self) -> dict[str, int]:
        """Return the first unknown of every train."""
        found, count = {}, 0
        for trip in self.trips:
            found[trip.train] = count
            count += 2 * len(trip.stations)
        return found


def solve_times(day: Day) -> dict[str, list[tuple[int, int]]]:
    """
    Return the seconds of all calls.

    Parameters
    ----------
    day
        The trains.

    Returns
    -------
    dict[str, list[tuple[int, int]]]
        Arrivals and departures by train. [s]
    """
    first = day.first_unknowns()
    programme = Programme(sum(2 * len(trip.stations) for trip in day.trips))
    for trip in day.trips:
        _add_trip(programme, day, first, trip)
    _add_couplings(programme, day, first)
    _add_stays(programme, day, first)
    _add_points(programme, day, first)
    _add_passing(programme, day, first)
    times = programme.solve()
    found = {}
    for trip in day.trips:
        base = first[trip.train]
        mine = [UNIT_S * time for time in times[base : base + 2 * len(trip.stations)]]
        found[trip.train] = list(zip(mine[::2], mine[1::2], strict=True))
    return found


def _add_trip(programme: Programme, day: Day, first: Mapping[str, int], trip: Trip) -> None:
    usual, base, last = day.usual, first[trip.train], len(trip.stations) - 1
    for index, (station, minute) in enumerate(zip(trip.stations, trip.minutes, strict=True)):
        arrival, departure = Moment(base + 2 * index), Moment(base + 2 * index + 1)
        programme.within_minute(arrival if index == last else departure, minute)
        if index == last:
            programme.exactly(departure, arrival, usual.dwell[station])
        elif index > 0:
            programme.at_least(departure, arrival, usual.least_dwell[station])
            programme.prefer(departure, arrival, usual.dwell[station])
        elif not trip.before:
            programme.exactly(departure, arrival, READY)
        if index > 0:
            leg = (trip.stations[index - 1], station)
            before = Moment(base + 2 * index - 1)
            programme.at_least(arrival, before, usual.least_run[leg])
            programme.prefer(arrival, before, usual.run[leg])


def _add_couplings(programme: Programme, day: Day, first: Mapping[str, int]) -> None:
    trips = by_id(day.trips)
    for trip in day.trips:
        if trip.before:
            end = first[trip.before] + 2 * len(trips[trip.before].stations)
            arrival, departure = Moment(first[trip.train]), Moment(first[trip.train] + 1)
            programme.exactly(arrival, Moment(end - 1), 0)
            programme.at_least(departure, Moment(end - 2), TURN_BACK)


def _add_stays(programme: Programme, day: Day, first: Mapping[str, int]) -> None:
    """Keep trains apart at platform tracks, and departures in one direction."""
    tracks: dict[tuple[str, str], list[tuple[float, Moment, Moment]]] = {}
    departures: dict[tuple[str, str], list[tuple[float, Moment]]] = {}
    for trip in day.trips:
        last = len(trip.stations) - 1
        for index, (station, track) in enumerate(zip(trip.stations, trip.tracks, strict=True)):
            at = first[trip.train] + 2 * index
            estimate = day.estimate(trip, index)
            # Stock that turns back holds the track from one train's arrival to the next's end.
            held = tracks.setdefault((station, track), [])
            held.append((estimate, Moment(at), Moment(at + 1)))
            if index < last:
                departures.setdefault((station, trip.direction), []).append(
                    (estimate, Moment(at + 1))
                )
    follows = {first[trip.train] for trip in day.trips if trip.before}
    for held in tracks.values():
        for (_, _, gone), (_, comes, _) in pairwise(sorted(held)):
            if comes.unknown not in follows:
                programme.at_least(comes, gone, FOLLOWING)
    for leaving in departures.values():
        for (_, leader), (_, follower) in pairwise(sorted(leaving)):
            programme.at_least(follower, leader, DEPARTURES)


def _add_points(programme: Programme, day: Day, first: Mapping[str, int]) -> None:
    """Keep conflicting movements over points apart."""
    over: dict[str, list[tuple[float, Moment, Passage]]] = {}
    for trip in day.trips:
        for index, way in enumerate(pairwise(trip.tracks)):
            at = first[trip.train] + 2 * index + 1
            for passage in day.layout.passages(*way, trip.direction):
                movement = _movement(day, trip, index, at, passage)
                over.setdefault(passage.node.id, []).append(movement)
    for movements in over.values():
        movements.sort(key=lambda movement: movement[:2])
        for index, (time, moment, passage) in enumerate(movements):
            for later_time, later, other in movements[index + 1 :]:
                if later_time > time + WINDOW:
                    break
                if passage.conflicts(other):
                    programme.at_least(later, moment, POINTS)


def _movement(
    day: Day, trip: Trip, index: int, at: int, passage: Passage
) -> tuple[float, Moment, Passage]:
    """Return about when a train comes to a node after a call, and by which unknown."""
    leg = (trip.stations[index], trip.stations[index + 1])
    share, run = day.layout.share(leg, passage.node.km, trip.direction), day.usual.run[leg]
    if share < 0.5:
        moment, estimate = Moment(at, share * run), day.estimate(trip, index)
    else:
        moment = Moment(at + 1, (share - 1.0) * run)
        estimate = day.estimate_arrival(trip, index + 1)
    return estimate + moment.offset, moment, passage


def _add_passing(programme: Programme, day: Day, first: Mapping[str, int]) -> None:
    """Keep trains that pass a station apart from those that call there."""
    names = list(day.layout.station_km)
    order = {name: number for number, name in enumerate(names)}
    events: dict[tuple[str, str], list[tuple[float, Moment, Moment, bool]]] = {}
    for trip in day.trips:
        for index, station in enumerate(trip.stations):
            at, estimate = first[trip.train] + 2 * index, day.estimate(trip, index)
            events.setdefault((station, trip.direction), []).append(
                (estimate, Moment(at), Moment(at + 1), True)
            )
            if index + 1 == len(trip.stations):
                continue
            leg = (station, trip.stations[index + 1])
            low, high = sorted(order[name] for name in leg)
            for passed in names[low + 1 : high]:
                run = day.usual.run[leg]
                share = day.layout.share(leg, day.layout.station_km[passed], trip.direction)
                early = Moment(at + 1, share * run)
                late = Moment(at + 2, (share - 1.0) * run)
                events.setdefault((passed, trip.direction), []).append(
                    (estimate + share * run, early, late, False)
                )
    for found in events.values():
        for (_, _, leader, calls), (_, follower, _, also_calls) in pairwise(sorted(found)):
            if not (calls and also_calls):
                programme.at_least(follower, leader, FOLLOWING)
