"""
What trains pass on their routes, which ways are in each other's way, and who waits for whom.

In which order they pass it is said in :mod:`kankaku.railway.plan.turns`.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter
from typing import NamedTuple, TypeAlias

import numpy as np

from kankaku.railway.plan.line import Direction, Line, Track
from kankaku.railway.plan.timetable import Service

NOBODY = -1
ROOM_M = 300.0
"""Trains that wait on a track stand this far apart, and two blocks more, at most. [m]"""


class Passage(NamedTuple):
    """A track as the trains of a route pass it."""

    track: str
    entry_m: float
    """Where fronts wait for it: fouling start of the points at its start, or its start. [m]"""
    clear_m: float
    """Where tails have left it: fouling end of the points at its end, or its end. [m]"""
    turnout: int
    """Number of the points at its start; -1 for none, and for the first track of a route."""


class Predecessor(NamedTuple):
    """A train that has to go before another one."""

    row: int
    """The train; -1 for none."""
    passage: int
    """Which of its own passages it has to have left."""


NO_PREDECESSOR = Predecessor(NOBODY, 0)


class Precursors(NamedTuple):
    """Who goes before a train, by passage of its route."""

    ahead: tuple[Predecessor, ...]
    """The train before on the same track in the same direction."""
    waits: tuple[tuple[Predecessor, ...], ...]
    """Trains whose tails must have left their passage before this one may be entered."""


def passages(line: Line, route: Sequence[str]) -> tuple[Passage, ...]:
    """
    Return the tracks of a route as its trains pass them.

    Parameters
    ----------
    line
        The line.
    route
        Its tracks, in order.

    Returns
    -------
    tuple[Passage, ...]
        One by track.
    """
    found, entry_m, turnout = [], line.track_by_id[route[0]].start_m, -1
    for name in route:
        track, behind = line.track_by_id[name], line.turnout_behind(name)
        fouling_m = (track.end_m, track.end_m)
        if behind >= 0:
            fouling_m = line.fouling_m(behind, track.direction)
        found.append(Passage(name, entry_m, fouling_m[1], turnout))
        entry_m, turnout = fouling_m[0], behind
    return tuple(found)


def conflicting(line: Line, one: tuple[str, str], other: tuple[str, str]) -> bool:
    """
    Return whether two movements through the same points cannot be at the same time.

    Parameters
    ----------
    line
        The network.
    one, other
        Tracks before and behind the points, each in its running direction.

    Returns
    -------
    bool
        They share a physical track on either side, or cross. Trains that go the same way follow
        each other; that is no conflict.
    """
    if one == other:
        return False
    (west, east), (others_west, others_east) = _sides(line, one), _sides(line, other)
    if west.place == others_west.place or east.place == others_east.place:
        return True
    before, behind = west.across - others_west.across, east.across - others_east.across
    return before * behind <= 0.0


def _sides(line: Line, move: tuple[str, str]) -> list[Track]:
    """Return the tracks of a movement on the side of lower and of higher chainage."""
    tracks = [line.track_by_id[track] for track in move]
    return tracks if tracks[0].direction is Direction.RISING else tracks[::-1]


Event: TypeAlias = tuple[int, int, int]
"""A train, its passage, and whether it enters it (0) or has cleared it (1)."""


def waiting_cycle(
    line: Line,
    services: Sequence[Service],
    found: Sequence[Precursors],
    length_m: Mapping[str, float],
) -> list[tuple[int, int]]:
    """
    Return trains that would wait for each other for ever, if there are any.

    Every entry of a track, and every clearing of one, is an event that comes after others: after
    the train's own ones before it, after the clearings that it waits for, and after those of the
    train ahead, because nobody passes it. Where stock goes on as another train, the clearing of
    the one and the entry of the other are one event. As long as none of them comes after itself,
    the first of those that have not happened yet can always happen, whatever is late: there is no
    deadlock. It is enough, not needed: trains that wait on a track are taken to stand far apart.

    Parameters
    ----------
    line
        The network.
    services
        The trains.
    found
        Who goes before whom, from :func:`kankaku.railway.plan.turns.orders`.
    length_m
        Length by train type. [m]

    Returns
    -------
    list[tuple[int, int]]
        Train and passage of each event of a cycle; empty where there is none.

    References
    ----------
    .. [1] A. Mascis and D. Pacciarelli, "Job-shop scheduling with blocking and no-wait
       constraints", European Journal of Operational Research 143 (2002): the alternative graph; a
       selection without a cycle is a feasible schedule.
    """
    spacing_m = max(length_m.values()) + ROOM_M
    spacing_m += 2.0 * max((block.end_m - block.start_m for block in line.blocks), default=0.0)
    after = _Waiting(line, services, found, spacing_m).after(length_m)
    return [(row, number) for row, number, _ in _cycle(after)]


class _Waiting:
    """Which events come after which."""

    def __init__(
        self,
        line: Line,
        services: Sequence[Service],
        found: Sequence[Precursors],
        spacing_m: float,
    ) -> None:
        self._services, self._found, self._spacing_m = services, found, spacing_m
        self._ways = [passages(line, service.route) for service in services]
        row_of = {service.train: row for row, service in enumerate(services)}
        self._stock_of = {
            row_of[service.next_train]: row
            for row, service in enumerate(services)
            if service.next_train
        }

    def after(self, length_m: Mapping[str, float]) -> dict[Event, list[Event]]:
        """Return the events that each event comes after."""
        after: dict[Event, list[Event]] = defaultdict(list)
        for row, service in enumerate(self._services):
            stop_m = service.calls[-1].stop_m
            for number, passage in enumerate(self._ways[row]):
                for event, earlier in self._of_passage(row, number):
                    after[event].append(earlier)
                # Where the front is when the tail has left; who ends before that leaves the line.
                front_m = passage.clear_m + length_m[service.train_type]
                way = self._ways[row]
                entered = [n for n in range(number, len(way)) if way[n].entry_m < front_m]
                after[row, number, 1].append(self._enters(row, entered[-1]))
                if front_m > stop_m and number + 1 < len(way):
                    after[row, number, 1].append((row, len(way) - 1, 1))
        return {event: [one for one in ones if one != event] for event, ones in after.items()}

    def _enters(self, row: int, number: int) -> Event:
        """Return the entry of a passage; stock that is taken over enters as the one before ends."""
        if number == 0 and row in self._stock_of:
            stock = self._stock_of[row]
            return stock, len(self._ways[stock]) - 1, 1
        return row, number, 0

    def _of_passage(self, row: int, number: int) -> Iterator[tuple[Event, Event]]:
        """Yield events of a train on one track, and what each of them comes after."""
        service, way, order = self._services[row], self._ways[row], self._found[row]
        enters, clears, last = self._enters(row, number), (row, number, 1), len(way) - 1
        end_m = way[number + 1].entry_m if number < last else way[number].clear_m
        for before in order.waits[number]:
            yield enters, (before.row, before.passage, 1)
        if number:
            yield enters, self._enters(row, number - 1)
            # The tail has left the track before when the front is so far.
            comes, front_m = (row, number - 1, 1), way[number - 1].clear_m + self._spacing_m
        else:
            comes, front_m = enters, service.calls[0].stop_m
            ahead, stock = order.ahead[0], self._stock_of.get(row, row)
            if ahead.row not in {NOBODY, stock}:
                # Whoever goes by before must have come; stock that is there cannot let it by.
                yield (
                    enters,
                    (ahead.row, ahead.passage, 1) if stock != row else self._enters(*ahead),
                )
        leaves, stop_m = (row, number + 1, 0), end_m
        if number == last:
            leaves, stop_m = clears, service.calls[-1].stop_m
        for event, place_m in ((comes, front_m), (leaves, stop_m)):
            for earlier in self._gone(order.ahead[number], place_m, end_m):
                yield event, earlier

    def _gone(self, before: Predecessor, front_m: float, end_m: float) -> Iterator[Event]:
        """Yield what trains ahead have to do before there is room up to a place."""
        room = max(int((end_m - front_m) / self._spacing_m), 0)
        for stands in range(room + 1):
            if before.row == NOBODY:
                return
            if before.passage == 0:
                # Until it is there, its place is kept.
                yield self._enters(before.row, 0)
            service = self._services[before.row]
            furthest_m = end_m
            if before.passage == len(service.route) - 1:
                # Stock that goes on as another train keeps its place.
                furthest_m = -np.inf if service.next_train else service.calls[-1].stop_m
            if stands == room or furthest_m < front_m + (stands + 1) * self._spacing_m:
                yield before.row, before.passage, 1
            before = self._found[before.row].ahead[before.passage]


def _cycle(after: Mapping[Event, Sequence[Event]]) -> list[Event]:
    """Return the nodes of a cycle in a graph; none if there is none."""
    try:
        TopologicalSorter(after).prepare()
    except CycleError as error:
        cycle: list[Event] = error.args[1]
        return cycle
    return []
