"""
Who passes what is not proven for it: points that lie otherwise, crossings that are still open.

This part of the monitor believes nothing that signalling says: it works out from recorded fronts,
the timetable and the line itself when points can lie for a train, and a crossing be closed.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.line import Crossing, Turnout
from kankaku.railway.plan.world import World
from kankaku.railway.step.step_block import StepBlock

ENTERED_M = 0.55
"""A front this far beyond a place has not stopped at it, a stop error off. [m]"""
ROUNDING_S = 1e-3


class Passings:
    """When fronts and tails pass some places for the first time; infinite until they do."""

    def __init__(self, world: World, fronts_m: FloatArray, tails_m: FloatArray) -> None:
        self._length_m = world.length_m
        self._fronts = fronts_m.size
        self._places_m = np.concatenate([fronts_m, tails_m])
        self._time_s = np.full((self._places_m.size, world.size), np.inf)
        self._on_line = np.zeros(world.size, dtype=np.bool_)

    @property
    def front_s(self) -> FloatArray:
        """Of fronts. [s], shape (n_fronts, n_trains)"""
        return self._time_s[: self._fronts]

    @property
    def tail_s(self) -> FloatArray:
        """Of tails, and of trains that have left the line. [s], shape (n_tails, n_trains)"""
        return self._time_s[self._fronts :]

    def add(self, block: StepBlock) -> list[tuple[int, int]]:
        """
        Take note of a block of steps.

        Parameters
        ----------
        block
            The steps.

        Returns
        -------
        list[tuple[int, int]]
            Index of the place and row of the train, for every front that has passed one now.
        """
        rows, end = block.rows, block.present.shape[0] - 1
        gone = np.argmax(block.present[::-1], axis=0)
        last = np.where(block.present.any(axis=0), end - gone, -1)
        there_m = np.repeat(self._places_m[:, np.newaxis], rows.size, axis=1)
        there_m[self._fronts :] += self._length_m[rows]
        furthest_m = block.front_m[last + 1, np.arange(rows.size)]
        reached = np.isinf(self._time_s[:, rows]) & (last >= 0) & (furthest_m >= there_m)
        found = np.argwhere(reached).tolist()
        for place, column in found:
            # A train is there at both ends of a step; where it enters it may be past a place.
            there = np.append(block.present[:, column], False)
            there[1:] |= block.present[:, column]
            after = block.front_m[:, column] >= there_m[place, column]
            moment = int(np.argmax(after & there))
            self._time_s[place, rows[column]] = block.time_s[moment]
        left_s = np.where(self._on_line, block.time_s[0], np.inf)
        left_s[rows[last >= 0]] = block.time_s[last[last >= 0] + 1]
        self._on_line[:] = False
        self._on_line[rows[last == end]] = True
        left_s[self._on_line] = np.inf
        np.minimum(self.tail_s, left_s, out=self.tail_s)
        return [(place, int(rows[column])) for place, column in found if place < self._fronts]


class Proofs:
    """Finds trains that enter points or crossings before these can be proven for them."""

    def __init__(self, world: World) -> None:
        line = world.line
        # Movements through the points of a network are looked at as such.
        self._turnouts = () if line.network else line.turnouts
        self._crossings = line.crossings
        self._before = [_other_ways(world, points) for points in self._turnouts]
        self._users = [_users(world, crossing) for crossing in self._crossings]
        starts_m = np.array([points.fouling_start_m for points in self._turnouts])
        ends_m = np.array([points.fouling_end_m for points in self._turnouts])
        self._points = Passings(world, starts_m + ENTERED_M, ends_m)
        starts_m = np.array([crossing.start_m for crossing in self._crossings])
        ends_m = np.array([crossing.end_m for crossing in self._crossings])
        strikes_m = np.array([crossing.strike_in_m for crossing in self._crossings])
        self._roads = Passings(world, np.concatenate([starts_m + ENTERED_M, strikes_m]), ends_m)

    def early(self, block: StepBlock) -> Iterator[tuple[int, str, float, float]]:
        """
        Yield who has entered something before it can be proven.

        Parameters
        ----------
        block
            The steps.

        Yields
        ------
        tuple[int, str, float, float]
            Row of the train, ``points`` or ``crossing``, when, and how much too early at least. [s]
        """
        proven = []
        if self._turnouts:
            for turnout, row in self._points.add(block):
                entered_s = self._points.front_s[turnout, row]
                proven.append((row, "points", entered_s, self._lies_s(turnout, row)))
        if self._crossings:
            for place, row in self._roads.add(block):
                # Behind the entries come the places where trains strike in.
                if place < len(self._crossings) and row in self._users[place]:
                    entered_s = self._roads.front_s[place, row]
                    proven.append((row, "crossing", entered_s, self._closed_s(place, row)))
        for row, kind, entered_s, proven_s in proven:
            if entered_s < proven_s - ROUNDING_S:
                known_s = proven_s if proven_s < np.inf else block.time_s[-1]
                yield row, kind, float(entered_s), float(known_s - entered_s)

    def unproven(self, block: StepBlock) -> Iterator[tuple[int, float, float]]:
        """
        Yield what is not proven for a train at the beginning of a block that was looked at.

        Parameters
        ----------
        block
            The steps, of which :meth:`early` has told already.

        Yields
        ------
        tuple[int, float, float]
            Row of the train, where the points or the crossing begin [m], and until when they may
            not be granted to it [s].
        """
        begin_s = block.time_s[0]
        here = frozenset(block.rows.tolist())
        for number, points in enumerate(self._turnouts):
            for row in here & self._before[number].keys():
                until_s = self._lies_s(number, row)
                if until_s > begin_s:
                    yield row, points.fouling_start_m, until_s
        for number, crossing in enumerate(self._crossings):
            for row in here.intersection(self._users[number]):
                strikes_s = self._roads.front_s[len(self._crossings) + number, row]
                until_s = max(self._closed_s(number, row), float(strikes_s))
                if until_s > begin_s:
                    yield row, crossing.start_m, until_s

    def _lies_s(self, turnout: int, row: int) -> float:
        """Return when points can lie for a train; infinite as long as another has to go first."""
        before = self._before[turnout].get(row)
        if before is None:
            return -np.inf
        points = self._turnouts[turnout]
        return float(self._points.tail_s[turnout, before]) + points.throw_s + points.proof_s

    def _closed_s(self, crossing: int, row: int) -> float:
        """Return when a crossing can be closed for a train; it stays so for who strikes in."""
        users = self._users[crossing]
        strikes_s = self._roads.front_s[len(self._crossings) + crossing, users]
        passes_s = self._roads.tail_s[crossing, users]
        began_s, ends_s = np.inf, -np.inf
        for user in np.argsort(strikes_s, kind="stable").tolist():
            if strikes_s[user] > ends_s:
                began_s = float(strikes_s[user])
            ends_s = max(ends_s, float(passes_s[user]))
            if users[user] == row:
                break
        return began_s + self._crossings[crossing].closing_s


def _other_ways(world: World, points: Turnout) -> dict[int, int]:
    """Return for each train that passes points the last one before it that goes another way."""
    end_m = {track.id: track.end_m for track in world.line.track_by_id.values()}
    ways = [
        (row, way)
        for row, service in enumerate(world.timetable.services)
        for way in pairwise(service.route)
        if end_m[way[0]] == points.position_m
    ]
    last: dict[int, int] = {}
    for (before, other), (row, way) in pairwise(ways):
        if way != other:
            last[row] = before
        elif before in last:
            last[row] = last[before]
    return last


def _users(world: World, crossing: Crossing) -> list[int]:
    """Return the trains that come to a crossing from before it."""
    tracks = set(world.line.tracks_between(crossing.start_m, crossing.end_m))
    return [
        row
        for row, service in enumerate(world.timetable.services)
        if tracks & set(service.route)
        and service.calls[0].stop_m <= crossing.start_m
        and not (world.leaves_at_stop[row] and service.calls[-1].stop_m <= crossing.start_m)
    ]
