"""
In which order trains pass tracks and points.

On a chain trains pass everything in the order in which the timetable names them. In a network they
pass every track and all points in the order of their booked times there, and whoever follows
another one onto a track leaves it after that one, because nobody overtakes on a track.
"""

import heapq
from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.passing import (
    NO_PREDECESSOR,
    Passage,
    Precursors,
    Predecessor,
    conflicting,
    passages,
)
from kankaku.railway.plan.timetable import Service


class Turn(NamedTuple):
    """A train's turn on a track or at points."""

    row: int
    number: int
    """The passage of its route that it enters there."""
    way: tuple[str, ...]
    """The track in its direction, or the tracks before and behind the points."""


class Turns(NamedTuple):
    """Whose turn it is, first one first."""

    on_track: dict[str, list[Turn]]
    """By physical track."""
    at_points: dict[int, list[Turn]]
    """By number of the turnout."""


def orders(line: Line, services: Sequence[Service]) -> tuple[Precursors, ...]:
    """
    Return who goes before whom by the timetable.

    Parameters
    ----------
    line
        The line.
    services
        Its trains.

    Returns
    -------
    tuple[Precursors, ...]
        By train.
    """
    if not line.network:
        return _chain_orders(services)
    return precursors(line, services, booked_turns(line, services))


def booked_turns(line: Line, services: Sequence[Service]) -> Turns:
    """
    Return whose turn it is where, by booked times.

    Parameters
    ----------
    line
        A network.
    services
        Its trains.

    Returns
    -------
    Turns
        Of every track and all points.
    """
    booked = _Booked(line, services)
    booked.run()
    return booked.turns


def precursors(line: Line, services: Sequence[Service], turns: Turns) -> tuple[Precursors, ...]:
    """
    Return who goes before whom.

    Parameters
    ----------
    line
        A network.
    services
        Its trains.
    turns
        Whose turn it is where.

    Returns
    -------
    tuple[Precursors, ...]
        By train.
    """
    waits: list[list[set[Predecessor]]] = [[set() for _ in service.route] for service in services]
    ahead = [[NO_PREDECESSOR] * len(service.route) for service in services]
    for order in turns.on_track.values():
        # Whoever ends there may be gone before those ahead of it have left.
        latest = defaultdict[tuple[str, ...], list[Predecessor]](list)
        for row, number, way in order:
            before = latest[way]
            ahead[row][number] = before[-1] if before else NO_PREDECESSOR
            for other, ones in latest.items():
                waits[row][number].update(ones if other != way else ())
            ends = number == len(services[row].route) - 1
            latest[way] = [*(before if ends else ()), Predecessor(row, number)]
    clash: dict[tuple[tuple[str, ...], tuple[str, ...]], bool] = {}
    for order in turns.at_points.values():
        last: dict[tuple[str, ...], Predecessor] = {}
        for row, number, way in order:
            for other, one in last.items():
                if (way, other) not in clash:
                    clash[way, other] = conflicting(line, (way[0], way[1]), (other[0], other[1]))
                if clash[way, other]:
                    waits[row][number].add(one)
            last[way] = Predecessor(row, number - 1)
    return tuple(
        Precursors(tuple(one), tuple(tuple(sorted(befores)) for befores in two))
        for one, two in zip(ahead, waits, strict=True)
    )


def _chain_orders(services: Sequence[Service]) -> tuple[Precursors, ...]:
    """Return who goes before whom in the order of the timetable."""
    last_on: dict[str, Predecessor] = {}
    found = []
    for row, service in enumerate(services):
        found.append(
            Precursors(
                tuple(last_on.get(track, NO_PREDECESSOR) for track in service.route),
                ((),) * len(service.route),
            )
        )
        last_on |= {track: Predecessor(row, number) for number, track in enumerate(service.route)}
    return tuple(found)


class _Booked:
    """Trains that pass everything as booked, but never another train on its track."""

    def __init__(self, line: Line, services: Sequence[Service]) -> None:
        self._line, self._services = line, services
        self._ways = {service.route: passages(line, service.route) for service in services}
        self.turns = Turns({}, {})
        """So far."""
        self._on_track = defaultdict[str, list[int]](list)
        """Those that are on it."""

    def run(self) -> None:
        """Let every train enter all its tracks, in order."""
        services, behind = self._services, defaultdict[int, list[tuple[float, int, int]]](list)
        times_s = [_entries_s(service, self._ways[service.route]) for service in services]
        due = [(times[0], row, 0) for row, times in enumerate(times_s)]
        heapq.heapify(due)
        while due:
            time_s, row, number = heapq.heappop(due)
            route = services[row].route
            if number > 0:
                queue = self._on_track[route[number - 1]]
                if queue[0] != row:
                    # Who is before it leaves first.
                    behind[queue[queue.index(row) - 1]].append((time_s, row, number))
                    continue
                queue.pop(0)
                for then_s, follower, entry in behind.pop(row, ()):
                    heapq.heappush(due, (max(then_s, time_s), follower, entry))
            if number < len(route):
                self._enter(row, number, time_s)
                then_s = max(times_s[row][number + 1], time_s)
                heapq.heappush(due, (then_s, row, number + 1))

    def _enter(self, row: int, number: int, time_s: float) -> None:
        """Note a train on a track: behind all, or where it begins."""
        route = self._services[row].route
        track, way = route[number], self._ways[route]
        queue, later = self._on_track[track], 0
        if number == 0:
            begins_m = self._services[row].calls[0].stop_m
            while later < len(queue) and self._place_m(queue[-1 - later], time_s) < begins_m:
                later += 1
        order = self.turns.on_track.setdefault(self._line.track_by_id[track].place, [])
        place = len(order)
        if later:
            behind = queue[-later]
            place = max(n for n, turn in enumerate(order) if turn.row == behind)
        queue.insert(len(queue) - later, row)
        order.insert(place, Turn(row, number, (track,)))
        if way[number].turnout >= 0:
            through = self.turns.at_points.setdefault(way[number].turnout, [])
            through.append(Turn(row, number, (route[number - 1], track)))

    def _place_m(self, row: int, time_s: float) -> float:
        """Return where a train is booked to be at a time. [m]"""
        return float(np.interp(time_s, *_booked(self._services[row])))


def _booked(service: Service) -> tuple[FloatArray, FloatArray]:
    """Return when [s] a train is booked to be where [m]: at its calls, and even in between."""
    calls = service.calls
    times_s = [time for call in calls for time in (call.arrival_s, call.departure_s)]
    # Two points at every stop, one just behind the other.
    places_m = [place for call in calls for place in (call.stop_m, call.stop_m + 1e-6)]
    return np.array(times_s), np.array(places_m)


def _entries_s(service: Service, way: Sequence[Passage]) -> list[float]:
    """Return when a train is booked to enter each of its tracks, and to be gone. [s]"""
    times_s, places_m = _booked(service)
    entries_m = np.array([passage.entry_m for passage in way[1:]])
    inner_s = np.interp(entries_m, places_m, times_s).tolist()
    return [service.calls[0].arrival_s, *inner_s, service.calls[-1].departure_s]
