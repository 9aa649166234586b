"""The line ceiling as every protection enforces it."""

import math
from typing import NamedTuple, TypeAlias

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import compiled, plain
from kankaku.railway.motion.kinematics import next_speed_mps
from kankaku.railway.motion.traction_table import Pull, pull_of, pulled_mps
from kankaku.railway.plan.profile import Profile, at, at_each, braking_loss_mps
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import LineState

LEAST_MPS = 1e-6
"""Nobody who is slower gets to the end of a limit within a step. [m/s]"""

CeilingFields: TypeAlias = tuple[
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    IntArray,
    FloatArray,
    tuple[FloatArray, FloatArray, FloatArray, float],
]
"""The fields of :class:`CeilingFigures`."""


class CeilingFigures(NamedTuple):
    """What compiled functions need of the line ceiling."""

    square: FloatArray
    """Twice the brake potential. [m2/s2], shape (n_types * n_grid,)"""
    row_start: FloatArray
    """From :meth:`kankaku.railway.plan.profile.Profile.row_starts`. [-], shape (n_trains,)"""
    start: FloatArray
    """Where pieces of constant limit begin, one train type after the other. [m], (n_pieces,)"""
    limit_mps: FloatArray
    """Their limits. [m/s], shape (n_pieces,)"""
    lowest_square: FloatArray
    """Twice the lowest energy from each piece on. [m2/s2], shape (n_pieces,)"""
    first: IntArray
    """The piece at each point of the grid. shape (n_types * n_grid,)"""
    reach_m: FloatArray
    """How far beyond a step at constant speed a front may be after it. [m], (n_trains,)"""
    pull: tuple[FloatArray, FloatArray, FloatArray, float]
    """The fields of :class:`kankaku.railway.motion.traction_table.Pull`."""


def ceiling_figures(world: World, profile: Profile, step_s: float) -> CeilingFigures:
    """
    Lay out the line ceiling for compiled functions.

    Parameters
    ----------
    world
        The trains.
    profile
        The line.
    step_s
        Length of a step. [s]

    Returns
    -------
    CeilingFigures
        For :func:`ceiling_ahead_mps`.
    """
    columns, starts, firsts, pieces = profile.grid_m.size, [], [], 0
    for row, limits in enumerate(profile.limits):
        starts.append(limits.start_m - profile.origin_m + float(row * columns))
        first = np.searchsorted(limits.start_m[:-1], profile.grid_m, side="right") - 1
        firsts.append(first + pieces)
        pieces += limits.start_m.size
    return CeilingFigures(
        2.0 * profile.potential_m2ps2.ravel(),
        world.row_start,
        np.concatenate(starts),
        np.concatenate([limits.limit_mps for limits in profile.limits]),
        2.0 * np.concatenate([limits.lowest_m2ps2 for limits in profile.limits]),
        np.concatenate(firsts),
        # Nobody is further ahead after a step than with its greatest acceleration throughout.
        0.5 * step_s**2 * world.greatest_acceleration_mps2,
        plain(pull_of(world, profile, step_s)),
    )


class LineCeiling:
    """The lowest line limit over the whole train, the braking curves to lower ones included."""

    def __init__(self, world: World, profile: Profile) -> None:
        self._world = world
        self._profile = profile
        self.figures = ceiling_figures(world, profile, world.step_s)
        """For :func:`ceiling_ahead_mps`."""
        self._fields = plain(self.figures)

    def ahead_mps(self, state: LineState) -> FloatArray:
        """
        Return what every train may run at the end of the step.

        Parameters
        ----------
        state
            The line.

        Returns
        -------
        FloatArray
            Ceilings; 0 for a train that is not on the line. [m/s], shape (n_trains,)
        """
        return _ahead_mps(state.front_m, state.speed_mps, state.present, self._fields)

    def at_mps(self, row: int, front_m: FloatArray) -> FloatArray:
        """
        Return the ceiling of a train at some places.

        Parameters
        ----------
        row
            The train.
        front_m
            Its front. [m], shape (n_places,)

        Returns
        -------
        FloatArray
            Ceilings. [m/s], shape (n_places,)
        """
        kind = int(self._world.type_index[row])
        return np.sqrt(2.0 * self._profile.ceiling_at_m2ps2(kind, front_m))


def braked_to_mps(
    world: World,
    square: FloatArray,
    row: int,
    ends_m: tuple[FloatArray, FloatArray],
    delay_s: float = 0.0,
) -> FloatArray:
    """
    Return the speed from which the service brake stops a train at a limit.

    Parameters
    ----------
    world
        The trains.
    square
        Twice the brake potential. [m2/s2], shape (n_types * n_grid,)
    row
        The train.
    ends_m
        Fronts and limits. [m], shape (n_places,) each
    delay_s
        The front counts as this much time of running further on. [s]

    Returns
    -------
    FloatArray
        Speeds; 0 beyond the limit. [m/s], shape (n_places,)
    """
    start = np.full(1, world.row_start[row])
    within_m = np.minimum(ends_m[1], world.far_m)
    here, there = (at_each(square, place_m, start) for place_m in (ends_m[0], within_m))
    taken = delay_s * np.array(world.train_types[world.type_index[row]].service_brake_mps2)
    return next_speed_mps(0.0, np.maximum(there - here, 0.0), 0.0, taken)


@compiled
def _piece_at(line: CeilingFigures, place: float) -> int:
    piece = line.first[int(place)]
    while line.start[piece + 1] <= place:
        piece += 1
    return int(piece)


@compiled
def ceiling_here_mps(line: CeilingFigures, train: int, front_m: float) -> float:
    """
    Return the line ceiling at a front.

    Parameters
    ----------
    line
        :attr:`LineCeiling.figures`.
    train
        Row of the train.
    front_m
        Front. [m]

    Returns
    -------
    float
        The ceiling. [m/s]
    """
    place = front_m + line.row_start[train]
    piece = _piece_at(line, place)
    square = line.lowest_square[piece + 1] - at(line.square, place)
    return min(float(line.limit_mps[piece]), math.sqrt(max(square, 0.0)))


@compiled
def _braked_mps(
    line: CeilingFigures, train: int, piece: int, place: float, speed_mps: float, step_s: float
) -> float:
    """Return the speed after a step from which the service brake keeps all limits ahead."""
    here = at(line.square, place)
    loss = braking_loss_mps(line.square, place, speed_mps, step_s)
    reach = place + speed_mps * step_s + line.reach_m[train]
    lowest_mps, after = np.inf, piece + 1
    while line.start[after] < reach:
        begins, limit = line.start[after], line.limit_mps[after]
        way = begins - place
        if limit < line.limit_mps[after - 1] and way <= 0.5 * (speed_mps + limit) * step_s:
            # It begins within the step: at the end the train is that slow.
            lowest_mps = min(lowest_mps, limit)
        elif limit < line.limit_mps[after - 1]:
            square = limit * limit + at(line.square, begins) - here
            braked = max(next_speed_mps(speed_mps, square, loss, 0.0), limit)
            lowest_mps = min(lowest_mps, max(braked, limit), 2.0 * way / step_s - speed_mps)
        after += 1
    square = line.lowest_square[after] - here
    return min(float(lowest_mps), float(next_speed_mps(speed_mps, square, loss, 0.0)))


@compiled
def _let_go_mps(
    line: CeilingFigures,
    piece: int,
    place: float,
    speed_mps: float,
    gain_mps2: float,
    step_s: float,
) -> float:
    """Return the speed after a step of speeding up at a rate and holding each limit to its end."""
    speed, here, left_s, last = speed_mps, place, step_s, piece
    while True:
        limit, ends = line.limit_mps[last], line.start[last + 1]
        speed = min(speed, limit)
        if here + limit * left_s < ends:
            break
        rise_s = min((limit - speed) / gain_mps2 if gain_mps2 > 0.0 else left_s, left_s)
        rise_m = (speed + 0.5 * gain_mps2 * rise_s) * rise_s
        if here + rise_m >= ends:
            ahead = math.sqrt(speed * speed + 2.0 * gain_mps2 * (ends - here))
            left_s -= 2.0 * (ends - here) / (speed + ahead)
            speed = ahead
        else:
            speed += gain_mps2 * rise_s
            left_s -= rise_s + (ends - here - rise_m) / max(speed, LEAST_MPS)
        if left_s <= 0.0:
            break
        here, last = ends, last + 1
    speed = min(speed + gain_mps2 * max(left_s, 0.0), line.limit_mps[last])
    # A step of constant acceleration may end short of where this motion is.
    for passed in range(last - 1, piece - 1, -1):
        if place + 0.5 * (speed_mps + speed) * step_s < line.start[passed + 1]:
            speed = min(speed, line.limit_mps[passed])
    return float(speed)


@compiled
def ceiling_ahead_mps(line: CeilingFigures, train: int, front_m: float, speed_mps: float) -> float:
    """
    Return how fast a train may be at the end of a step.

    Where a lower limit begins the train is braked down to it in time. Where a limit ends within
    the step, the train may gain what it gains in the rest of the step.

    Parameters
    ----------
    line
        :attr:`LineCeiling.figures`.
    train
        Row of the train.
    front_m
        Front at the start of the step. [m]
    speed_mps
        Speed there. [m/s]

    Returns
    -------
    float
        The ceiling. [m/s]
    """
    pull = Pull(*line.pull)
    place = front_m + line.row_start[train]
    piece = _piece_at(line, place)
    braked_mps = _braked_mps(line, train, piece, place, speed_mps, pull.step_s)
    pulled = pulled_mps(pull, train, place, speed_mps)
    if pulled <= line.limit_mps[piece]:
        return min(braked_mps, float(line.limit_mps[piece]))
    gain_mps2 = max((pulled - speed_mps) / pull.step_s, 0.0)
    return min(braked_mps, _let_go_mps(line, piece, place, speed_mps, gain_mps2, pull.step_s))


@compiled
def _ahead_mps(
    front_m: FloatArray,
    speed_mps: FloatArray,
    present: BoolArray,
    fields: CeilingFields,
) -> FloatArray:
    line = CeilingFigures(*fields)
    ceiling_mps = np.zeros_like(speed_mps)
    for train in range(front_m.size):
        if present[train]:
            ceiling_mps[train] = ceiling_ahead_mps(line, train, front_m[train], speed_mps[train])
    return ceiling_mps
