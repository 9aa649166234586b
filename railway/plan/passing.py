"""
What trains pass on their routes, which ways are in each other's way, and who waits for whom.

In which order they pass it is said in :mod:`kankaku.railway.plan.turns`.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from graphlib import CycleError, TopologicalSorter
from typing import NamedTuple, TypeAlias

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
    the train's own ones before it, or those of the train whose stock it takes over, after the
    clearings that it waits for, and after those of the train ahead, because nobody passes it. As
    long as none of them comes after itself, the first of those that have not happened yet can
    always happen, whatever is late: there is no deadlock. It is enough, not needed: trains that
    wait on a track are taken to stand far apart.

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
    after: dict[Event, list[Event]] = defaultdict(list)
    row_of = {service.train: row for row, service in enumerate(services)}
    for row, (service, order) in enumerate(zip(services, found, strict=True)):
        way = passages(line, service.route)
        last = len(way) - 1
        for number, passage in enumerate(way):
            enters, clears = (row, number, 0), (row, number, 1)
            after[enters] += [(b.row, b.passage, 1) for b in order.waits[number]]
            if number:
                after[enters].append((row, number - 1, 0))
            # Where the front is when the tail has left; whoever ends before that leaves the line.
            front_m = passage.clear_m + length_m[service.train_type]
            entered = [n for n in range(number, last + 1) if way[n].entry_m < front_m]
            after[clears].append((row, entered[-1], 0))
            end_m = way[number + 1].entry_m if number < last else passage.clear_m

            ahead = order.ahead[number]
            leaves, room_m = (row, number + 1, 0), 0.0
            if number == last:
                leaves, room_m = clears, end_m - service.calls[-1].stop_m
            after[leaves] += _gone(found, ahead, int(room_m / spacing_m))
            comes, room_m = enters, end_m - service.calls[0].stop_m
            if number:
                comes, room_m = (row, number - 1, 1), end_m - way[number - 1].clear_m - spacing_m
            after[comes] += _gone(found, ahead, int(room_m / spacing_m))
        if service.next_train:
            after[row_of[service.next_train], 0, 0].append((row, last, 1))
    return [(row, number) for row, number, _ in _cycle(after)]


def _gone(found: Sequence[Precursors], before: Predecessor, room: int) -> list[Event]:
    """Return the clearing of the first train ahead that there is no room for any more."""
    for _ in range(room):
        if before.row != NOBODY:
            before = found[before.row].ahead[before.passage]
    return [(before.row, before.passage, 1)] if before.row != NOBODY else []


def _cycle(after: Mapping[Event, Sequence[Event]]) -> list[Event]:
    """Return the nodes of a cycle in a graph; none if there is none."""
    try:
        TopologicalSorter(after).prepare()
    except CycleError as error:
        cycle: list[Event] = error.args[1]
        return cycle
    return []
