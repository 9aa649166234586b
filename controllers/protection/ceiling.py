"""The line ceiling as every protection enforces it."""

import math
from typing import NamedTuple

import numpy as np

from railway.arrays import BoolArray, FloatArray
from railway.compiled import compiled, plain
from railway.kinematics import next_speed_mps
from railway.profile import Profile, at, at_each
from railway.state import LineState
from railway.world import World


class CeilingFigures(NamedTuple):
    """What compiled functions need of the line ceiling."""

    square: FloatArray
    """Squares of the ceilings. [m2/s2], shape (n_types * n_grid,)"""
    row_start: FloatArray
    """From :meth:`railway.profile.Profile.row_starts`. [-], shape (n_trains,)"""
    reach_m: FloatArray
    """How far beyond a step at constant speed a front may be after it. [m], (n_trains,)"""
    step_s: float


class LineCeiling:
    """The lowest line limit over the whole train, the braking curves to lower ones included."""

    def __init__(self, world: World, profile: Profile) -> None:
        # Nobody is further ahead after a step than with its greatest acceleration throughout.
        self.figures = CeilingFigures(
            2.0 * profile.ceiling_m2ps2.ravel(),
            world.row_start,
            0.5 * world.step_s**2 * world.greatest_acceleration_mps2,
            world.step_s,
        )
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
        line = self.figures
        return np.sqrt(at_each(line.square, front_m, np.full(1, line.row_start[row])))


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
def ceiling_ahead_mps(line: CeilingFigures, train: int, front_m: float, speed_mps: float) -> float:
    """
    Return the line ceiling that holds for a front at the end of a step.

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
    ahead_m = front_m + speed_mps * line.step_s + line.reach_m[train]
    return math.sqrt(at(line.square, ahead_m + line.row_start[train]))


@compiled
def _ahead_mps(
    front_m: FloatArray,
    speed_mps: FloatArray,
    present: BoolArray,
    fields: tuple[FloatArray, FloatArray, FloatArray, float],
) -> FloatArray:
    line = CeilingFigures(*fields)
    ceiling_mps = np.zeros_like(speed_mps)
    for train in range(front_m.size):
        if present[train]:
            ceiling_mps[train] = ceiling_ahead_mps(line, train, front_m[train], speed_mps[train])
    return ceiling_mps
