"""The line ceiling as every protection enforces it."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import Plain, compiled, formula, naming, plain
from kankaku.railway.motion.kinematics import next_speed_mps, rising_speed_mps
from kankaku.railway.motion.traction_table import TractionTable, pulled_mps, traction_table
from kankaku.railway.plan.brake_table import (
    BrakeTable,
    braking_loss_mps,
    braking_v2_each,
    braking_v2_there,
    place_of,
)
from kankaku.railway.plan.limit_table import LimitTable, piece_at
from kankaku.railway.plan.profile import Profile
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import LineState, Whereabouts

LEAST_MPS = 1e-6
"""Nobody who is slower gets to the end of a limit within a step. [m/s]"""


class CeilingFigures(NamedTuple):
    """What compiled functions need of the line ceiling."""

    braking: BrakeTable
    limits: LimitTable
    traction: TractionTable
    reach_m: FloatArray
    """How far beyond a step at constant speed a front may be after it. [m], (n_trains,)"""


@naming
def figures_of(fields: Plain) -> CeilingFigures:
    """
    Return the line ceiling with its names.

    Parameters
    ----------
    fields
        Of :class:`CeilingFigures`, plain.

    Returns
    -------
    CeilingFigures
        The same.
    """
    braking, limits, traction, reach_m = fields
    return CeilingFigures(
        BrakeTable(*braking), LimitTable(*limits), TractionTable(*traction), reach_m
    )


def ceiling_figures(
    world: World, profile: Profile, step_s: float, train_types: Sequence[TrainType] = ()
) -> CeilingFigures:
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
    train_types
        What counts in place of the world's train types, if there is anything.

    Returns
    -------
    CeilingFigures
        For :func:`ceiling_ahead_mps`.
    """
    return CeilingFigures(
        profile.braking(world.type_index),
        profile.limit_table,
        traction_table(world, profile, step_s, train_types),
        # Nobody is further ahead after a step than with its greatest acceleration throughout.
        0.5 * step_s**2 * world.greatest_acceleration_mps2,
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
        return ceilings_ahead_mps(state.whereabouts, self._fields)

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
    row: int,
    ends_m: tuple[FloatArray, FloatArray],
    delay_s: float = 0.0,
) -> FloatArray:
    """
    Return the speed from which the service brake stops a train at an end of authority.

    Parameters
    ----------
    world
        The trains.
    row
        The train.
    ends_m
        Fronts and ends of authority. [m], shape (n_places,) each
    delay_s
        The front counts as this much time of running further on. [s]

    Returns
    -------
    FloatArray
        Speeds; 0 beyond the end. [m/s], shape (n_places,)
    """
    rows, within_m = np.full(ends_m[0].size, row), np.minimum(ends_m[1], world.far_m)
    here, there = (
        braking_v2_each(world.braking, rows, place_m) for place_m in (ends_m[0], within_m)
    )
    kind = world.train_types[world.type_index[row]]
    # From a constant speed the force rises evenly, which costs half of its build-up.
    late_s = delay_s + 0.5 * kind.brake_rise_s
    room = np.maximum(there - here, 0.0) / kind.safety_factor
    braked_mps = next_speed_mps(0.0, room, 0.0, np.array(late_s * kind.service_brake_mps2))
    kept_mps: FloatArray = np.maximum(braked_mps - kind.overspeed_mps, 0.0)
    return kept_mps


@formula
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
    place = place_of(line.braking, train, front_m)
    piece = piece_at(line.limits, place)
    v2 = line.limits.lowest_v2_m2ps2[piece + 1] - braking_v2_there(line.braking, place)
    return min(float(line.limits.limit_mps[piece]), math.sqrt(max(v2, 0.0)))


@formula
def _braked_mps(
    line: CeilingFigures, train: int, piece: int, front_m: float, speed_mps: float, rise_mps: float
) -> float:
    """Return the speed after a step from which the service brake keeps all limits ahead."""
    limits, braking, step_s = line.limits, line.braking, line.traction.step_s
    place = place_of(braking, train, front_m)
    here = braking_v2_there(braking, place)
    loss = braking_loss_mps(braking, train, front_m, speed_mps, step_s)
    reach = place + speed_mps * step_s + line.reach_m[train]
    lowest_mps, after = np.inf, piece + 1
    while limits.start[after] < reach:
        begins, limit = limits.start[after], limits.limit_mps[after]
        way = begins - place
        if limit < limits.limit_mps[after - 1] and way <= 0.5 * (speed_mps + limit) * step_s:
            # It begins within the step: at the end the train is that slow.
            lowest_mps = min(lowest_mps, limit)
        elif limit < limits.limit_mps[after - 1]:
            v2 = limit * limit + braking_v2_there(braking, begins) - here
            braked = max(rising_speed_mps(speed_mps, v2, (loss, 0.0), rise_mps), limit)
            lowest_mps = min(lowest_mps, max(braked, limit), 2.0 * way / step_s - speed_mps)
        after += 1
    v2 = limits.lowest_v2_m2ps2[after] - here
    braked = float(next_speed_mps(speed_mps, v2, loss, 0.0))
    if rise_mps < np.inf:
        pulled = pulled_mps(line.traction, train, front_m, speed_mps)
        rising = rising_speed_mps(speed_mps, v2, (loss, 0.0), rise_mps, pulled)
        # Who is no faster than the limit, or cannot get faster than this, need not brake for it.
        if rising < pulled:
            braked = min(braked, max(float(rising), float(limits.lowest_mps[after])))
    return min(float(lowest_mps), braked)


@formula
def _let_go_mps(
    limits: LimitTable, piece: int, place: float, speed_mps: float, gain_mps2: float, step_s: float
) -> float:
    """Return the speed after a step of speeding up at a rate and holding each limit to its end."""
    speed, here, left_s, last = speed_mps, place, step_s, piece
    while True:
        limit, ends = limits.limit_mps[last], limits.start[last + 1]
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
    speed = min(speed + gain_mps2 * max(left_s, 0.0), limits.limit_mps[last])
    # A step of constant acceleration may end short of where this motion is.
    for passed in range(last - 1, piece - 1, -1):
        if place + 0.5 * (speed_mps + speed) * step_s < limits.start[passed + 1]:
            speed = min(speed, limits.limit_mps[passed])
    return float(speed)


@formula
def ceiling_ahead_mps(
    line: CeilingFigures, train: int, front_m: float, speed_mps: float, rise_mps: float = np.inf
) -> float:
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
    rise_mps
        Greatest growth of what the brake takes from step to step; infinite for a brake that is
        whole at once. [m/s]

    Returns
    -------
    float
        The ceiling. [m/s]
    """
    limits, step_s = line.limits, line.traction.step_s
    place = place_of(line.braking, train, front_m)
    piece = piece_at(limits, place)
    braked_mps = _braked_mps(line, train, piece, front_m, speed_mps, rise_mps)
    pulled = pulled_mps(line.traction, train, front_m, speed_mps)
    if pulled <= limits.limit_mps[piece]:
        return min(braked_mps, float(limits.limit_mps[piece]))
    gain_mps2 = max((pulled - speed_mps) / step_s, 0.0)
    return min(braked_mps, _let_go_mps(limits, piece, place, speed_mps, gain_mps2, step_s))


@compiled
def ceilings_ahead_mps(whereabouts: Plain, fields: Plain) -> FloatArray:
    """
    Return what every train may run at the end of the step.

    Parameters
    ----------
    whereabouts
        See :class:`~kankaku.railway.step.state.Whereabouts`.
    fields
        :attr:`LineCeiling.figures`, plain.

    Returns
    -------
    FloatArray
        Ceilings; 0 for a train that is not on the line. [m/s], shape (n_trains,)
    """
    trains, line = Whereabouts(*whereabouts), figures_of(fields)
    ceiling_mps = np.zeros_like(trains.speed_mps)
    for train in trains.rows:
        front_m, speed_mps = trains.front_m[train], trains.speed_mps[train]
        ceiling_mps[train] = ceiling_ahead_mps(line, train, front_m, speed_mps)
    return ceiling_mps
