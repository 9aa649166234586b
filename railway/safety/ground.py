"""
What is under each train: heights and limits, looked up by chainage.

Protection looks at a line along the routes of its trains. The monitor does not believe what it
makes of that: it works out where a train lies on the line, and reads the line itself.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import formula
from kankaku.railway.plan.line import Direction, Gradient, Line, SpeedLimit
from kankaku.railway.plan.timetable import Service
from kankaku.railway.plan.world import World
from kankaku.railway.safety.heights import Heights, area_m2, height_m, heights_of
from kankaku.railway.safety.numbers import knot_before, lesser


class Ground(NamedTuple):
    """
    The line under the trains, in every way that trains lie on it.

    A lie is a direction with the gradients of some tracks and the limits of some trains. Knots
    and limits of all lies stand one after the other.
    """

    heights: Heights
    limits: FloatArray
    """Start and end [m], and limit [m/s]; of each lie by their starts. shape (n_limits, 3)"""
    knot_ends: IntArray
    """First and last knot of each lie. shape (n_lies, 2)"""
    limit_ends: IntArray
    """First limit of each lie, and the one behind its last. shape (n_lies, 2)"""
    falling: BoolArray
    """Trains run towards lower chainage. shape (n_lies,)"""
    lie_of: IntArray
    """Lie of each train. shape (n_trains,)"""
    turned_m: float
    """Less a chainage, the coordinate of a train that falls. [m]"""


class Lie(NamedTuple):
    """How one train lies on the line; of :class:`Ground`."""

    length_m: float
    turned_m: float
    falling: bool
    knots: tuple[int, int]
    """First and last one."""
    limits: tuple[int, int]
    """First one, and the one behind the last."""


class Under(NamedTuple):
    """Where a train is on the line, by chainage, and the knots before its ends."""

    upper_m: float
    lower_m: float
    knots: tuple[int, int]


def ground_of(world: World) -> Ground:
    """
    Return the line under the trains.

    Parameters
    ----------
    world
        Line and trains.

    Returns
    -------
    Ground
        Read from the line alone.
    """
    known: dict[tuple[object, ...], int] = {}
    lie_of, polygons, limits = [], [], []
    ways: list[bool] = []
    for service in world.timetable.services:
        way = falling, gradients, kept = _lies_on(world.line, service)
        if way not in known:
            known[way] = len(ways)
            ways.append(falling)
            polygons.append(heights_of(replace(world.line, gradients=gradients)))
            limits.append(sorted((one.start_m, one.end_m, one.limit_mps) for one in kept))
        lie_of.append(known[way])
    knots = np.cumsum([0, *(polygon.knots_m.size for polygon in polygons)])
    limited = np.cumsum([0, *map(len, limits)])
    return Ground(
        Heights(*map(np.concatenate, zip(*polygons, strict=True))),
        np.array([one for lie in limits for one in lie], dtype=np.float64).reshape(-1, 3),
        np.column_stack((knots[:-1], knots[1:] - 1)).astype(np.intp),
        np.column_stack((limited[:-1], limited[1:])).astype(np.intp),
        np.array(ways, dtype=np.bool_),
        np.array(lie_of, dtype=np.intp),
        world.line.start_m + world.line.end_m,
    )


@formula
def lie_of(ground: Ground, row: int, length_m: float) -> Lie:
    """Return how a train lies on the line."""
    lie = ground.lie_of[row]
    return Lie(
        length_m,
        ground.turned_m,
        ground.falling[lie],
        (ground.knot_ends[lie, 0], ground.knot_ends[lie, 1]),
        (ground.limit_ends[lie, 0], ground.limit_ends[lie, 1]),
    )


@formula
def under(heights: Heights, lie: Lie, front_m: float, near: tuple[int, int]) -> Under:
    """Return where a train is whose front is at a place; ``near`` is a guess of the knots."""
    upper_m = lie.turned_m - front_m + lie.length_m if lie.falling else front_m
    lower_m = upper_m - lie.length_m
    upper = knot_before(heights.knots_m, lie.knots, upper_m, near[0])
    lower = knot_before(heights.knots_m, lie.knots, lower_m, near[1])
    return Under(upper_m, lower_m, (upper, lower))


@formula
def mean_height_m(heights: Heights, lie: Lie, at: Under) -> float:
    """Return the height of the track averaged over a train. [m]"""
    upper_m2 = area_m2(heights, at.knots[0], at.upper_m)
    return (upper_m2 - area_m2(heights, at.knots[1], at.lower_m)) / lie.length_m


@formula
def slope(heights: Heights, lie: Lie, at: Under) -> float:
    """Return the mean gradient under a train: front over tail, by its length. [-]"""
    rise_m = height_m(heights, at.knots[0], at.upper_m)
    rise_m -= height_m(heights, at.knots[1], at.lower_m)
    return (-rise_m if lie.falling else rise_m) / lie.length_m


@formula
def lowest_limit_mps(limits: FloatArray, lie: Lie, front_m: float, maximum_mps: float) -> float:
    """Return the lowest limit that a train is on with any of its length. [m/s]"""
    upper_m = lie.turned_m - front_m + lie.length_m if lie.falling else front_m
    lower_m, lowest_mps = upper_m - lie.length_m, maximum_mps
    for one in range(lie.limits[0], lie.limits[1]):
        if limits[one, 0] >= upper_m:
            break
        if upper_m > limits[one, 0] and lower_m < limits[one, 1]:
            lowest_mps = lesser(lowest_mps, limits[one, 2])
    return lowest_mps


def _lies_on(
    line: Line, service: Service
) -> tuple[bool, tuple[Gradient, ...], tuple[SpeedLimit, ...]]:
    """Return whether a train falls, the gradients of its tracks, and the limits it has to keep."""
    limits = tuple(one for one in line.limits if one.train_type in {"", service.train_type})
    if not line.network:
        return False, line.gradients, limits
    tracks = [line.track_by_id[track] for track in service.route]
    names = {"", *(track.place for track in tracks)}
    gradients = sorted(
        (one for one in line.gradients if one.track in names), key=lambda one: one.start_m
    )
    limits = tuple(one for one in limits if one.track in names)
    return tracks[0].direction is Direction.FALLING, tuple(gradients), limits
