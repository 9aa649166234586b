"""What full traction makes of a train's speed in a step, for the drive and whoever foresees it."""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import compiled
from kankaku.railway.plan.profile import Profile, at
from kankaku.railway.plan.world import World

CELLS_PER_MPS = 100.0


class Pull(NamedTuple):
    """Traction and drag, tabulated for one length of step."""

    gain: FloatArray
    """Speed gained in a step on the level, by speed. [m/s], flattened by train type"""
    speed_row: FloatArray
    """For each train the place of speed 0 in it. [-], shape (n_trains,)"""
    drag: FloatArray
    """Speed taken in a step by gradient and curves. [m/s], shape (n_types * n_grid,)"""
    step_s: float


def pull_of(world: World, profile: Profile, step_s: float) -> Pull:
    """
    Tabulate traction and drag.

    Parameters
    ----------
    world
        The trains.
    profile
        The line.
    step_s
        Length of the step. [s]

    Returns
    -------
    Pull
        The tables; ``CELLS_PER_MPS`` cells of the gain to 1 m/s.
    """
    fastest = max(kind.maximum_speed_mps for kind in world.train_types)
    cells = int(np.ceil(1.5 * fastest * CELLS_PER_MPS)) + 2
    start = np.arange(cells) / CELLS_PER_MPS
    gains = []
    for kind in world.train_types:
        # The midpoint rule: the acceleration half a step on is that of the whole step.
        half_way = start + 0.5 * step_s * kind.level_acceleration_mps2(start)
        gains.append(step_s * kind.level_acceleration_mps2(np.maximum(half_way, 0.0)))
    speed_row = world.type_index.astype(np.float64) * cells + 0.5
    drag = step_s * profile.drag_mps2.ravel()
    return Pull(np.concatenate(gains), speed_row, drag, step_s)


@compiled
def level_gain_mps(pull: Pull, train: int, speed_mps: float) -> float:
    """
    Return the speed gained in a step of full traction on the level.

    Parameters
    ----------
    pull
        From :func:`pull_of`.
    train
        Row of the train.
    speed_mps
        Speed at the start of the step. [m/s]

    Returns
    -------
    float
        The gain. [m/s]
    """
    return float(pull.gain[int(speed_mps * CELLS_PER_MPS + pull.speed_row[train])])


@compiled
def pulled_mps(pull: Pull, train: int, place: float, speed_mps: float) -> float:
    """
    Return the speed after a step of full traction.

    Parameters
    ----------
    pull
        From :func:`pull_of`.
    train
        Row of the train.
    place
        Chainage plus the train's :meth:`kankaku.railway.plan.profile.Profile.row_starts`. [m]
    speed_mps
        Speed at the start of the step. [m/s]

    Returns
    -------
    float
        Below 0 where the train would roll back. [m/s]
    """
    gain_mps = level_gain_mps(pull, train, speed_mps)
    # As with the brake, the gradient of mid-step is that of the whole step.
    middle = place + 0.5 * speed_mps * pull.step_s
    return speed_mps + gain_mps - at(pull.drag, middle)
