"""
Train detection by track circuits, and the blocks that they make up.

A train occupies every track circuit that it touches, and each of them until a release delay
after its tail has left. A block is occupied while any of its circuits is. Points are locked for
trains that go another way as long as a train is within their fouling section.
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, compiled, formula, plain
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import NOTHING, LineState, Whereabouts
from kankaku.railway.wayside.looking import (
    ROUNDING_S,
    CircuitsShown,
    DetectedTrains,
    Points,
    dangers_m,
    look_ahead,
    lower_to_locked_points,
    touch,
)
from kankaku.railway.wayside.tiling import Tiling, tiling_of


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


class Detection:
    """The track circuits and blocks of a line with its trains."""

    def __init__(self, world: World) -> None:
        line = world.line
        routes = list(dict.fromkeys(service.route for service in world.timetable.services))
        self.line = line
        self.release_delay_s = line.release_delay_s
        self.circuits = tiling_of(line, line.track_circuits, routes)
        self.blocks = tiling_of(line, line.blocks, routes)
        self.route = np.array(
            [routes.index(service.route) for service in world.timetable.services], dtype=np.intp
        )
        self._points = _points(world)
        self._plain = plain(self.circuits), plain(self._points)
        self._step_s = world.step_s
        self._most_mps2 = float(world.greatest_acceleration_mps2.max())
        self._size = len(line.track_circuits)
        figures = self.release_delay_s + ROUNDING_S, self._step_s, self._most_mps2
        self.fields: Plain = (self.route, self._plain, figures)
        """What :func:`look` wants."""
        self._granted_m = np.full(self.route.size, np.inf)
        self._nothing = np.full(self.route.size, NOTHING)

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
            DetectedTrains on the line. shape (n_trains,)
        before
            What they showed a step ago.

        Returns
        -------
        Occupancy
            New arrays.
        """
        touched_s = before.touched_s.copy()
        foremost = np.full(self._size, -1, dtype=np.intp)
        trains = self._trains(front_m, tail_m, present)
        touch(time_s, trains, self.circuits, touched_s, foremost)
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
            DetectedTrains on the line. shape (n_trains,)
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
        trains = self._trains(front_m, tail_m, present)._replace(granted_to_m=granted_to_m)
        danger_m = dangers_m(trains, self.circuits, CircuitsShown(seen.occupied, seen.foremost))
        if self._points.way.size:
            lower_to_locked_points(danger_m, trains, self.circuits, self._points)
        return danger_m

    def _trains(
        self, front_m: FloatArray, tail_m: FloatArray, present: BoolArray
    ) -> DetectedTrains:
        """Return trains to which everything is granted."""
        granted = self._granted_m, self._nothing
        rows = np.flatnonzero(present)
        return DetectedTrains(front_m, tail_m, present, *granted, self.route, rows)

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
        known = plain_sight(before)
        seen = tuple(part.copy() for part in known)
        granted = state.granted_to_m, state.granted_by
        _look_again(state.time_s, state.whereabouts, granted, self.fields, (known, seen))
        return sight_of(seen)

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


def plain_sight(sight: Sight) -> Plain:
    """
    Return a sight as compiled steps remember it.

    Parameters
    ----------
    sight
        What was seen.

    Returns
    -------
    Plain
        Arrays: both times, and the rest of :class:`Sight`.
    """
    times_s = np.array([sight.looked_s, sight.until_s])
    return times_s, sight.touched_s, sight.touched_by, sight.danger_m, sight.danger_by


def sight_of(remembered: Plain) -> Sight:
    """
    Return what a compiled step remembers as a sight.

    Parameters
    ----------
    remembered
        Of :func:`plain_sight`, or of :func:`look`.

    Returns
    -------
    Sight
        What was seen.
    """
    times_s, touched_s, touched_by, danger_m, danger_by = remembered
    looked_s, until_s = times_s.tolist()
    return Sight(looked_s, touched_s, touched_by, danger_m, danger_by, until_s)


@formula
def look(
    now_s: float,
    whereabouts: Plain,
    granted: tuple[FloatArray, IntArray],
    fields: Plain,
    sights: tuple[Plain, Plain],
) -> None:
    """
    Write how far the way of every train is free, looking again only where that may have changed.

    Parameters
    ----------
    now_s
        The time. [s]
    whereabouts
        See :class:`~kankaku.railway.step.state.Whereabouts`.
    granted
        How far the way of each train is granted [m], and what is there. shape (n_trains,) each
    fields
        :attr:`Detection.fields`.
    sights
        As :func:`plain_sight` returns them: what was seen a step ago, and what is written to.
    """
    if now_s >= sights[0][0][1]:
        _look_again(now_s, whereabouts, granted, fields, sights)
        return
    for part in (0, 1):
        sights[1][0][part] = sights[0][0][part]
    for circuit in range(sights[0][1].size):
        sights[1][1][circuit] = sights[0][1][circuit]
        sights[1][2][circuit] = sights[0][2][circuit]
    for train in range(sights[0][3].size):
        sights[1][3][train] = sights[0][3][train]
        sights[1][4][train] = sights[0][4][train]


@compiled
def _look_again(
    now_s: float,
    whereabouts: Plain,
    granted: tuple[FloatArray, IntArray],
    fields: Plain,
    sights: tuple[Plain, Plain],
) -> None:
    (route, line, figures), trains = fields, Whereabouts(*whereabouts)
    ends = trains.front_m, trains.tail_m, trains.present
    train_fields = (*ends, granted[0], granted[1], route, trains.rows)
    moving = trains.speed_mps, trains.running
    (before_s, touched_s, touched_by, _, _), after = sights
    known = before_s[0], touched_s, touched_by
    seen = look_ahead(now_s, train_fields, moving, line, known, figures)
    after[0][0], after[0][1] = now_s, seen[4]
    after[1][:], after[2][:], after[3][:], after[4][:] = seen[0], seen[1], seen[2], seen[3]


def _points(world: World) -> Points:
    if world.line.network:
        # Nobody is granted points there that another movement has locked.
        return Points(np.zeros((0, 2)), np.zeros((0, world.size), dtype=np.intp))
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
