"""
Movements that cannot be at the same time: the monitor's part that looks at a network.

What conflicts is worked out anew from the tracks themselves, in pairs of whole movements; nothing
is believed of what was granted to whom, or in which order.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.plan.line import Direction, Line, Track
from kankaku.railway.plan.world import World
from kankaku.railway.step.step_block import StepBlock

ENTERED_M = 0.55
"""A front this far beyond a place has not stopped at it, a stop error off. [m]"""
ROUNDING_S = 1e-3


class Taking(NamedTuple):
    """Trains that take a stretch in one way."""

    takes: BoolArray
    """Which trains. shape (n_trains,)"""
    start_m: float
    """In the coordinate of their routes. [m]"""
    end_m: float


class Clash(NamedTuple):
    """A stretch that two groups of trains may not be in at the same time."""

    kind: str
    one: Taking
    other: Taking
    apart_s: float
    """Least time from the last tail of one group to the next front of the other. [s]"""


class Movements:
    """Finds trains that meet where their ways cross, join, or are opposed."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._clashes = [*_opposing(world), *_crossing(world)] if world.line.network else []
        self._left_s: list[tuple[float, float]] = [(-np.inf, -np.inf)] * len(self._clashes)
        """When anybody of either group was in the stretch last."""
        self._ends_m = _buffer_stops_m(world)
        services = world.timetable.services
        self._turn_back_s = np.array([service.turn_back_s for service in services])
        self._arrived_s = np.full(world.size, np.nan)
        self._moved = np.zeros(world.size, dtype=np.bool_)

    def inside_m(self, block: StepBlock) -> Iterator[tuple[str, FloatArray]]:
        """
        Yield how far fronts are where they may not be together with others.

        Parameters
        ----------
        block
            The steps.

        Yields
        ------
        tuple[str, FloatArray]
            ``opposing`` or ``fouling`` or ``buffer``, and depths. [m], shape (n_steps, n_columns)
        """
        deep_m = {kind: np.zeros(block.present.shape) for kind in ("opposing", "fouling")}
        for clash in self._clashes:
            if not (clash.one.takes[block.rows].any() and clash.other.takes[block.rows].any()):
                continue
            one, other = (self._within(block, group) for group in (clash.one, clash.other))
            both = one[1].any(axis=1) & other[1].any(axis=1)
            if not both.any():
                continue
            # Whoever came last is told.
            later_is_one = one[2].max(axis=1) <= other[2].max(axis=1)
            for (columns, within, depth_m), is_later in (
                (one, later_is_one),
                (other, ~later_is_one),
            ):
                told = within & (both & is_later)[:, np.newaxis]
                deepest = deep_m[clash.kind]
                deepest[:, columns] = np.maximum(deepest[:, columns], np.where(told, depth_m, 0.0))
        yield from deep_m.items()
        past_m = block.front_m[1:] - self._ends_m[block.rows]
        yield "buffer", np.maximum(past_m, 0.0)

    def early(self, block: StepBlock) -> Iterator[tuple[int, str, float, float]]:
        """
        Yield who enters points that cannot have been thrown for it, or turns back too soon.

        Parameters
        ----------
        block
            The steps.

        Yields
        ------
        tuple[int, str, float, float]
            Row of the train, ``points`` or ``turn_back``, when, and how much too early. [s]
        """
        for number, clash in enumerate(self._clashes):
            if clash.apart_s > 0.0 and (clash.one.takes | clash.other.takes)[block.rows].any():
                yield from self._unthrown(block, number, clash)
        if self._turn_back_s.any():
            yield from self._too_soon(block)

    def _within(self, block: StepBlock, group: Taking) -> tuple[IntArray, BoolArray, FloatArray]:
        """Return the columns of a group, in which steps they are in the stretch, and how deep."""
        columns = np.flatnonzero(group.takes[block.rows])
        front_m = block.front_m[1:, columns]
        tail_m = front_m - self._world.length_m[block.rows[columns]]
        within = block.present[:, columns] & (tail_m < group.end_m)
        within &= front_m > group.start_m + ENTERED_M
        depth_m = np.where(within, front_m - group.start_m, -np.inf)
        if not columns.size:
            depth_m = np.full((block.present.shape[0], 1), -np.inf)
        return columns, within, depth_m

    def _unthrown(
        self, block: StepBlock, number: int, clash: Clash
    ) -> Iterator[tuple[int, str, float, float]]:
        time_s = block.time_s[1:]
        groups = [self._within(block, group) for group in (clash.one, clash.other)]
        there = [within.any(axis=1) for _, within, _ in groups]
        before = self._left_s[number]
        last_s = [
            np.maximum.accumulate(np.where(here, time_s, left_s))
            for here, left_s in zip(there, before, strict=True)
        ]
        taken = zip(groups, (clash.one, clash.other), reversed(last_s), strict=True)
        for (columns, within, _), group, other_s in taken:
            outside = block.front_m[:-1, columns] <= group.start_m + ENTERED_M
            for step, column in np.argwhere(within & outside).tolist():
                early_s = other_s[step] + clash.apart_s - time_s[step]
                if early_s > self._world.step_s + ROUNDING_S:
                    row = int(block.rows[columns[column]])
                    yield row, "points", float(time_s[step]), float(early_s)
        self._left_s[number] = float(last_s[0][-1]), float(last_s[1][-1])

    def _too_soon(self, block: StepBlock) -> Iterator[tuple[int, str, float, float]]:
        """Yield who sets off before there was time to turn back."""
        world, rows = self._world, block.rows
        last = world.call_count[rows] - 1
        halts = block.halting & (block.next_call[:-1] == last)
        for step, column in np.argwhere(halts).tolist():
            self._arrived_s[rows[column]] = block.time_s[step + 1]
        # Whoever calls only once has arrived when it enters.
        waits = block.present & (last == 0) & np.isnan(self._arrived_s[rows])
        for column in np.flatnonzero(waits.any(axis=0)).tolist():
            self._arrived_s[rows[column]] = block.time_s[int(np.argmax(waits[:, column]))]
        moves = (block.speed_mps[1:] > 0.0) & block.present
        for column in np.flatnonzero(moves.any(axis=0) & ~self._moved[rows]).tolist():
            row = int(rows[column])
            self._moved[row] = True
            stock = int(world.stock_from[row])
            if stock < 0 or self._turn_back_s[row] == 0.0:
                continue
            began_s = float(block.time_s[int(np.argmax(moves[:, column]))])
            early_s = self._arrived_s[stock] + self._turn_back_s[row] - began_s
            if not early_s <= ROUNDING_S:
                yield row, "turn_back", began_s, float(early_s)


def _opposing(world: World) -> Iterator[Clash]:
    """Yield the physical tracks that trains use in more than one way."""
    ways: dict[str, list[Track]] = {}
    for track in world.line.network:
        ways.setdefault(track.place, []).append(track)
    users: dict[str, list[int]] = {}
    for row, service in enumerate(world.timetable.services):
        for name in service.route:
            users.setdefault(name, []).append(row)
    for tracks in ways.values():
        for pair in combinations(tracks, 2):
            one, other = (
                Taking(_among(users.get(track.id, []), world), track.start_m, track.end_m)
                for track in pair
            )
            yield Clash("opposing", one, other, 0.0)


def _among(rows: Sequence[int], world: World) -> BoolArray:
    """Return of every train whether it is one of some rows."""
    found = np.zeros(world.size, dtype=np.bool_)
    found[list(rows)] = True
    return found


def _crossing(world: World) -> Iterator[Clash]:
    """Yield the movements through each points zone that meet there."""
    line = world.line
    moves: dict[str, dict[tuple[str, str], list[int]]] = {}
    for row, service in enumerate(world.timetable.services):
        for before, after in pairwise(service.route):
            node = line.track_by_id[before].to_node
            moves.setdefault(node, {}).setdefault((before, after), []).append(row)
    for turnout in line.turnouts:
        mirrored = line.mirrored_m(turnout.fouling_end_m), line.mirrored_m(turnout.fouling_start_m)
        for (one, rows), (other, others) in combinations(moves.get(turnout.node, {}).items(), 2):
            if not _meet(line, one, other):
                continue
            taken = []
            for move, users in ((one, rows), (other, others)):
                falling = line.track_by_id[move[0]].direction is Direction.FALLING
                ends_m = mirrored if falling else (turnout.fouling_start_m, turnout.fouling_end_m)
                taken.append(Taking(_among(users, world), *ends_m))
            yield Clash("fouling", taken[0], taken[1], turnout.throw_s + turnout.proof_s)


def _meet(line: Line, one: tuple[str, str], other: tuple[str, str]) -> bool:
    """Return whether two movements touch: as lines from side to side of the points."""
    ends = []
    for move in (one, other):
        tracks = [line.track_by_id[track] for track in move]
        if tracks[0].direction is Direction.FALLING:
            tracks.reverse()
        ends.append([(track.place, track.across) for track in tracks])
    (left, right), (others_left, others_right) = ends
    shared = left[0] == others_left[0] or right[0] == others_right[0]
    above = left[1] > others_left[1], right[1] > others_right[1]
    return shared or above[0] != above[1]


def _buffer_stops_m(world: World) -> FloatArray:
    """Return where the track of each train's route ends that nothing leads on from. [m]"""
    line, ends_m = world.line, np.full(world.size, np.inf)
    goes_on = {(track.from_node, track.direction) for track in line.network}
    for row, service in enumerate(world.timetable.services):
        last = line.track_by_id[service.route[-1]]
        if line.network and (last.to_node, last.direction) not in goes_on:
            ends_m[row] = last.end_m
    return ends_m
