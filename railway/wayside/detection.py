"""
Train detection by track circuits, and the blocks that they make up.

A train occupies every track circuit that it touches, and each of them until a release delay
after its tail has left. A block is occupied while any of its circuits is. Points are locked for
trains that go another way as long as a train is within their fouling section.
"""

import math
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import compiled, count_up_to, plain
from kankaku.railway.plan.line import Block, Line
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import NOTHING, LineState

ROUNDING_S = 1e-6
"""Times that differ by less are the same: sums of steps are not exact. [s]"""


class Tiling(NamedTuple):
    """The pieces of track along every route, one route after the other."""

    first: IntArray
    """Where each route begins in the other arrays, and their end. shape (n_routes + 1,)"""
    piece: IntArray
    """Number of the piece among all pieces of the line. shape (n_places,)"""
    start_m: FloatArray
    """[m], shape (n_places,)"""
    end_m: FloatArray
    """[m], shape (n_places,)"""


class Occupancy(NamedTuple):
    """What the track circuits show."""

    touched_s: FloatArray
    """When a train touched each circuit last; minus infinity if never. [s], (n_circuits,)"""
    occupied: BoolArray
    """A train touches the circuit, or its tail left it not long ago. shape (n_circuits,)"""
    foremost: IntArray
    """Row of the foremost train that touches the circuit; -1 where none. shape (n_circuits,)"""


class Sight(NamedTuple):
    """How far the way of every train is free, and until when that cannot change."""

    looked_s: float
    """When that was seen. [s]"""
    touched_s: FloatArray
    """When a train touched each circuit last, as far as is known. [s], shape (n_circuits,)"""
    touched_by: IntArray
    """Row of the rearmost train that did so; -1 if none ever did. shape (n_circuits,)"""
    danger_m: FloatArray
    """As from :meth:`Detection.danger_m`. [m], shape (n_trains,)"""
    danger_by: IntArray
    """What is there, as :attr:`kankaku.railway.step.state.Authority.eoa_by`. shape (n_trains,)"""
    until_s: float
    """Before, no train can have moved so far that anything changes, but for events. [s]"""


class Points(NamedTuple):
    """All turnouts."""

    fouling_m: FloatArray
    """Start and end of the fouling section of each. [m], shape (n_turnouts, 2)"""
    way: IntArray
    """
    Which of the parallel tracks each train takes there; -1 where it never passes.

    Shape (n_turnouts, n_trains).
    """


class Detection:
    """The track circuits and blocks of a line with its trains."""

    def __init__(self, world: World) -> None:
        line = world.line
        routes = list(dict.fromkeys(service.route for service in world.timetable.services))
        self.line = line
        self.release_delay_s = line.release_delay_s
        self.circuits = _tiling(line, line.track_circuits, routes)
        self.blocks = _tiling(line, line.blocks, routes)
        self.route = np.array(
            [routes.index(service.route) for service in world.timetable.services], dtype=np.intp
        )
        self._points = _points(world)
        self._plain = plain(self.circuits), plain(self._points)
        self._step_s = world.step_s
        self._most_mps2 = float(world.greatest_acceleration_mps2.max())
        self._size = len(line.track_circuits)

    @cached_property
    def block_of_circuit(self) -> IntArray:
        """Number of the block that each circuit is part of. shape (n_circuits,)"""
        return np.array(
            [
                next(
                    number
                    for number, block in enumerate(self.line.blocks)
                    if block.track == circuit.track
                    and block.start_m <= circuit.start_m < block.end_m
                )
                for circuit in self.line.track_circuits
            ],
            dtype=np.intp,
        )

    def initial(self) -> Occupancy:
        """
        Return what an empty line shows.

        Returns
        -------
        Occupancy
            No circuit has ever been occupied.
        """
        return Occupancy(
            np.full(self._size, -np.inf),
            np.zeros(self._size, dtype=np.bool_),
            np.full(self._size, -1, dtype=np.intp),
        )

    def look(
        self,
        time_s: float,
        front_m: FloatArray,
        tail_m: FloatArray,
        present: BoolArray,
        before: Occupancy,
    ) -> Occupancy:
        """
        Return what the circuits show.

        Parameters
        ----------
        time_s
            Now. [s]
        front_m, tail_m
            Ends of the trains. [m], shape (n_trains,)
        present
            Trains on the line. shape (n_trains,)
        before
            What they showed a step ago.

        Returns
        -------
        Occupancy
            New arrays.
        """
        touched_s = before.touched_s.copy()
        foremost = np.full(self._size, -1, dtype=np.intp)
        _touch(time_s, front_m, tail_m, present, self.route, self.circuits, touched_s, foremost)
        held = time_s - touched_s <= self.release_delay_s + ROUNDING_S
        return Occupancy(touched_s, held, foremost)

    def danger_m(
        self,
        front_m: FloatArray,
        tail_m: FloatArray,
        present: BoolArray,
        granted_to_m: FloatArray,
        seen: Occupancy,
    ) -> FloatArray:
        """
        Return how far the circuits ahead of each train are free.

        Points that are not granted, or locked for another way, count as occupied from the
        start of the circuit in which their fouling section begins.

        Parameters
        ----------
        front_m, tail_m
            Ends of the trains. [m], shape (n_trains,)
        present
            Trains on the line. shape (n_trains,)
        granted_to_m
            Fouling points that are not granted, or far ahead. [m], shape (n_trains,)
        seen
            What the circuits show.

        Returns
        -------
        FloatArray
            Start of the first circuit that is not free: behind the front where that is the
            train's own one, infinite where all are free. [m], shape (n_trains,)
        """
        danger_m = _danger_m(
            front_m, present, granted_to_m, self.route, self.circuits, seen.occupied, seen.foremost
        )
        if self._points.way.size:
            _lower_to_locked_points(
                danger_m, front_m, tail_m, present, self.route, self.circuits, self._points
            )
        return danger_m

    def blind(self) -> Sight:
        """
        Return what is known before anything has been looked at.

        Returns
        -------
        Sight
            Out of date from the beginning.
        """
        nobody, nothing = np.full(self._size, -1), np.full(self.route.size, NOTHING)
        free_m = np.full(self.route.size, np.inf)
        return Sight(np.nan, self.initial().touched_s, nobody, free_m, nothing, -np.inf)

    def look_ahead(self, state: LineState, before: Sight) -> Sight:
        """
        Return how far the way of every train is free.

        That changes when a tail leaves a circuit, when the delay of a release is over, when a train
        comes to points or leaves them, or with an event. A tail needs some time to its next
        boundary even at the greatest acceleration, and until then nothing is worked out. It does
        not change when a front enters a free circuit: nobody sees that who sees the tail behind it.

        Parameters
        ----------
        state
            The line.
        before
            What was seen a step ago.

        Returns
        -------
        Sight
            As :meth:`look` and :meth:`danger_m` say in every step; the same object while nothing
            can have changed.
        """
        if state.time_s < before.until_s and not state.events:
            return before
        found = _look_ahead(
            state.time_s,
            state.front_m,
            state.tail_m,
            state.speed_mps,
            state.present,
            state.running,
            state.granted_to_m,
            state.granted_by,
            self.route,
            self._plain[0],
            self._plain[1],
            (before.looked_s, before.touched_s, before.touched_by),
            (self.release_delay_s + ROUNDING_S, self._step_s, self._most_mps2),
        )
        return Sight(state.time_s, *found)

    def boundary_m(self, row: int, tiling: Tiling, place_m: FloatArray) -> FloatArray:
        """
        Return where the pieces begin that hold some places on a train's route.

        Parameters
        ----------
        row
            The train.
        tiling
            Circuits or blocks.
        place_m
            Places. [m], shape (n_places,)

        Returns
        -------
        FloatArray
            Starts; the route's own start for places before it. [m], shape (n_places,)
        """
        starts_m = tiling.start_m[self.along(row, tiling)]
        return starts_m[np.maximum(np.searchsorted(starts_m, place_m, side="right") - 1, 0)]

    def along(self, row: int, tiling: Tiling) -> slice:
        """
        Return which part of a tiling is a train's route.

        Parameters
        ----------
        row
            The train.
        tiling
            Circuits or blocks.

        Returns
        -------
        slice
            Into the arrays of the tiling.
        """
        route = self.route[row]
        return slice(int(tiling.first[route]), int(tiling.first[route + 1]))


def _tiling(line: Line, pieces: Sequence[Block], routes: Sequence[tuple[str, ...]]) -> Tiling:
    on_track: dict[str, list[int]] = {track: [] for track in line.track_by_id}
    for number, piece in enumerate(pieces):
        on_track[piece.track].append(number)
    numbers = [[number for track in route for number in on_track[track]] for route in routes]
    ends = np.cumsum([0, *map(len, numbers)])
    flat = [number for route in numbers for number in route]
    return Tiling(
        ends.astype(np.intp),
        np.array(flat, dtype=np.intp),
        np.array([pieces[number].start_m for number in flat]),
        np.array([pieces[number].end_m for number in flat]),
    )


def _points(world: World) -> Points:
    line, services = world.line, world.timetable.services
    ways = np.full((len(line.turnouts), world.size), -1, dtype=np.intp)
    for number, turnout in enumerate(line.turnouts):
        meeting = [s for s in line.sections if turnout.position_m in {s.start_m, s.end_m}]
        parallel = max(meeting, key=lambda section: len(section.tracks))
        for track, place in enumerate(parallel.tracks):
            ways[number, [place.id in service.route for service in services]] = track
        # Who leaves the line before points never takes them.
        ways[number, world.leaves_at_stop & (world.last_stop_m < turnout.position_m)] = -1
    fouling_m = [(turnout.fouling_start_m, turnout.fouling_end_m) for turnout in line.turnouts]
    return Points(np.array(fouling_m).reshape(-1, 2), ways)


@compiled
def place_of(tiling: Tiling, route: int, chainage_m: float) -> int:
    """
    Return the place in a tiling that holds a chainage.

    Parameters
    ----------
    tiling
        Circuits or blocks.
    route
        Which route.
    chainage_m
        Where; a boundary belongs to the piece ahead. [m]

    Returns
    -------
    int
        The place; the first of the route for a chainage before it.
    """
    first, last = tiling.first[route], tiling.first[route + 1]
    place: int = first + max(count_up_to(tiling.start_m[first:last], chainage_m) - 1, 0)
    return place


@compiled
def place_of_front(tiling: Tiling, route: int, front_m: float) -> int:
    """
    Return the place in a tiling that a front stands in.

    Parameters
    ----------
    tiling
        Circuits or blocks.
    route
        Which route.
    front_m
        Front; one exactly at a boundary has not passed it. [m]

    Returns
    -------
    int
        The place.
    """
    place = place_of(tiling, route, front_m)
    if place > tiling.first[route] and tiling.start_m[place] == front_m:
        place -= 1
    return place


@compiled
def _touch(  # noqa: PLR0913, PLR0917 - compiled functions take plain arrays
    time_s: float,
    front_m: FloatArray,
    tail_m: FloatArray,
    present: BoolArray,
    route: IntArray,
    circuits: Tiling,
    touched_s: FloatArray,
    foremost: IntArray,
) -> None:
    for train in range(front_m.size):
        if not present[train]:
            continue
        place = place_of_front(circuits, route[train], front_m[train])
        while place >= circuits.first[route[train]] and circuits.end_m[place] > tail_m[train]:
            circuit = circuits.piece[place]
            touched_s[circuit] = time_s
            if foremost[circuit] < 0 or front_m[foremost[circuit]] < front_m[train]:
                foremost[circuit] = train
            place -= 1


@compiled
def _danger_m(  # noqa: PLR0917 - compiled functions take plain arrays
    front_m: FloatArray,
    present: BoolArray,
    granted_to_m: FloatArray,
    route: IntArray,
    circuits: Tiling,
    occupied: BoolArray,
    foremost: IntArray,
) -> FloatArray:
    danger_m = np.full(front_m.size, np.inf)
    for train in range(front_m.size):
        if not present[train]:
            continue
        place = place_of_front(circuits, route[train], front_m[train])
        last = circuits.first[route[train] + 1]
        if foremost[circuits.piece[place]] == train:
            place += 1
            while place < last and not occupied[circuits.piece[place]]:
                place += 1
        if place < last:
            danger_m[train] = circuits.start_m[place]
        if granted_to_m[train] < circuits.end_m[last - 1]:
            ungranted = place_of(circuits, route[train], granted_to_m[train])
            danger_m[train] = min(danger_m[train], circuits.start_m[ungranted])
    return danger_m


@compiled
def _lower_to_locked_points(  # noqa: PLR0917 - compiled functions take plain arrays
    danger_m: FloatArray,
    front_m: FloatArray,
    tail_m: FloatArray,
    present: BoolArray,
    route: IntArray,
    circuits: Tiling,
    points: Points,
) -> None:
    for turnout in range(points.way.shape[0]):
        start_m, end_m = points.fouling_m[turnout]
        locked = -1
        for train in range(front_m.size):
            way = points.way[turnout, train]
            within = front_m[train] > start_m and tail_m[train] < end_m
            if present[train] and way >= 0 and within:
                # Trains on two ways at once should not be; then nobody else may come.
                locked = way if locked in {-1, way} else -2
        if locked == -1:
            continue
        for train in range(front_m.size):
            way = points.way[turnout, train]
            if present[train] and way >= 0 and way != locked and front_m[train] <= start_m:
                place = place_of(circuits, route[train], start_m)
                danger_m[train] = min(danger_m[train], circuits.start_m[place])


@compiled
def _touched_by(
    front_m: FloatArray,
    tail_m: FloatArray,
    present: BoolArray,
    route: IntArray,
    circuits: Tiling,
    before: IntArray,
) -> IntArray:
    """Return the rearmost train that touches each circuit; the last one where none does now."""
    touched_by = before.copy()
    rearmost_m = np.full(before.size, np.inf)
    for train in range(front_m.size):
        if not present[train]:
            continue
        place = place_of_front(circuits, route[train], front_m[train])
        while place >= circuits.first[route[train]] and circuits.end_m[place] > tail_m[train]:
            circuit = circuits.piece[place]
            if front_m[train] < rearmost_m[circuit]:
                rearmost_m[circuit], touched_by[circuit] = front_m[train], train
            place -= 1
    return touched_by


@compiled
def _danger_by(  # noqa: PLR0917 - compiled functions take plain arrays
    danger: tuple[FloatArray, FloatArray],
    granted: tuple[FloatArray, IntArray],
    route: IntArray,
    circuits: Tiling,
    occupied: BoolArray,
    touched: tuple[IntArray, IntArray],
    points: Points,
) -> IntArray:
    """Return what is in the circuit before which the way of each train ends; a train first."""
    danger_m, front_m = danger
    danger_by = np.full(front_m.size, NOTHING)
    granted_to_m, granted_by = granted
    foremost, rearmost = touched
    for train in range(front_m.size):
        if danger_m[train] == np.inf:
            continue
        place = place_of(circuits, route[train], danger_m[train])
        circuit = circuits.piece[place]
        own = place <= place_of_front(circuits, route[train], front_m[train])
        ahead = foremost[circuit] if own else rearmost[circuit]
        if occupied[circuit] and ahead != train:
            danger_by[train] = ahead
        elif granted_to_m[train] < circuits.end_m[place]:
            danger_by[train] = granted_by[train]
        else:
            for turnout in range(points.way.shape[0]):
                start_m = points.fouling_m[turnout, 0]
                if points.way[turnout, train] >= 0 and (
                    circuits.start_m[place] <= start_m < circuits.end_m[place]
                ):
                    danger_by[train] = NOTHING - 1 - turnout
    return danger_by


@compiled
def _look_ahead(  # noqa: PLR0913, PLR0917 - compiled functions take plain arrays
    time_s: float,
    front_m: FloatArray,
    tail_m: FloatArray,
    speed_mps: FloatArray,
    present: BoolArray,
    running: BoolArray,
    granted_to_m: FloatArray,
    granted_by: IntArray,
    route: IntArray,
    circuit_fields: tuple[IntArray, IntArray, FloatArray, FloatArray],
    point_fields: tuple[FloatArray, IntArray],
    before: tuple[float, FloatArray, IntArray],
    figures: tuple[float, float, float],
) -> tuple[FloatArray, IntArray, FloatArray, IntArray, float]:
    circuits, points = Tiling(*circuit_fields), Points(*point_fields)
    looked_s, before_s, before_by = before
    release_s, step_s, most_mps2 = figures
    # What was touched then was touched until now, or until a step ago at least.
    touched_s = np.where(before_s == looked_s, time_s - step_s, before_s)
    foremost = np.full(touched_s.size, -1, dtype=np.intp)
    _touch(time_s, front_m, tail_m, present, route, circuits, touched_s, foremost)
    occupied = time_s - touched_s <= release_s
    danger_m = _danger_m(front_m, present, granted_to_m, route, circuits, occupied, foremost)
    _lower_to_locked_points(danger_m, front_m, tail_m, present, route, circuits, points)
    touched_by = _touched_by(front_m, tail_m, present, route, circuits, before_by)
    danger_by = _danger_by(
        (danger_m, front_m),
        (granted_to_m, granted_by),
        route,
        circuits,
        occupied,
        (foremost, touched_by),
        points,
    )
    until_s = np.inf
    for circuit in range(touched_s.size):
        if occupied[circuit] and touched_s[circuit] < time_s:
            until_s = min(until_s, touched_s[circuit] + release_s)
    for train in range(front_m.size):
        if not (present[train] and running[train]):
            continue
        place = place_of(circuits, route[train], tail_m[train])
        to_go_m = max(circuits.end_m[place] - tail_m[train], 0.0)
        if circuits.start_m[place] > tail_m[train]:
            to_go_m = circuits.start_m[place] - tail_m[train]
        for turnout in range(points.way.shape[0]):
            start_m, end_m = points.fouling_m[turnout]
            if front_m[train] <= start_m:
                to_go_m = min(to_go_m, start_m - front_m[train])
            if tail_m[train] <= end_m:
                to_go_m = min(to_go_m, end_m - tail_m[train])
        speed = speed_mps[train]
        run_s = math.sqrt(speed * speed + 2.0 * most_mps2 * to_go_m) - speed
        until_s = min(until_s, time_s + run_s / most_mps2)
    return touched_s, touched_by, danger_m, danger_by, until_s - ROUNDING_S
