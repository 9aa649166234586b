"""What full traction makes of a train's speed in a step, for the drive and whoever foresees it."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import formula, interpolated
from kankaku.railway.plan.profile import Profile
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.world import World

CELLS_PER_MPS = 100.0
"""How finely speeds are tabulated; a table says of itself how finely it is. [s/m]"""


class TractionTable(NamedTuple):
    """
    Traction and drag, tabulated for one length of step.

    The functions of this module read it, and nobody else.
    """

    gain_mps: FloatArray
    """Speed gained in a step on the level, by speed, one train type after the other. [m/s]"""
    coast_mps: FloatArray
    """The same without traction: less than nothing. [m/s]"""
    first_cell: FloatArray
    """For each train the cell of speed 0 in it, and half a cell. [-], shape (n_trains,)"""
    cells_per_mps: float
    """Cells of the gain to 1 m/s. [s/m]"""
    drag_mps: FloatArray
    """Speed taken in a step by gradient and curves. [m/s], shape (n_types * n_grid,)"""
    row_start: FloatArray
    """Place of chainage 0 in it for each train. [-], shape (n_trains,)"""
    step_s: float


def traction_table(
    world: World, profile: Profile, step_s: float, train_types: Sequence[TrainType] = ()
) -> TractionTable:
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
    train_types
        What counts in place of the world's train types, if there is anything.

    Returns
    -------
    TractionTable
        The table.
    """
    cells_per_mps = CELLS_PER_MPS
    fastest = max(kind.maximum_speed_mps for kind in world.train_types)
    cells = int(np.ceil(1.5 * fastest * cells_per_mps)) + 2
    start = np.arange(cells) / cells_per_mps
    gains, coasts = [], []
    for kind in train_types or world.train_types:
        # The midpoint rule: the acceleration half a step on is that of the whole step.
        half_way = start + 0.5 * step_s * kind.level_acceleration_mps2(start)
        gains.append(step_s * kind.level_acceleration_mps2(np.maximum(half_way, 0.0)))
        coasts.append(-step_s * kind.resistance.force_n(start) / kind.inertial_mass_kg)
    return TractionTable(
        np.concatenate(gains),
        np.concatenate(coasts),
        world.type_index.astype(np.float64) * cells + 0.5,
        cells_per_mps,
        step_s * profile.drags_mps2,
        profile.row_starts(world.type_index),
        step_s,
    )


@formula
def level_gain_mps(table: TractionTable, train: int, speed_mps: float) -> float:
    """
    Return the speed gained in a step of full traction on the level.

    Parameters
    ----------
    table
        From :func:`traction_table`.
    train
        Row of the train.
    speed_mps
        Speed at the start of the step. [m/s]

    Returns
    -------
    float
        The gain. [m/s]
    """
    return float(table.gain_mps[int(speed_mps * table.cells_per_mps + table.first_cell[train])])


@formula
def pulled_mps(table: TractionTable, train: int, front_m: float, speed_mps: float) -> float:
    """
    Return the speed after a step of full traction.

    Parameters
    ----------
    table
        From :func:`traction_table`.
    train
        Row of the train.
    front_m
        Front at the start of the step. [m]
    speed_mps
        Speed there. [m/s]

    Returns
    -------
    float
        Below 0 where the train would roll back. [m/s]
    """
    gain_mps = level_gain_mps(table, train, speed_mps)
    # As with the brake, the gradient of mid-step is that of the whole step.
    middle = front_m + table.row_start[train] + 0.5 * speed_mps * table.step_s
    return float(speed_mps + gain_mps - interpolated(table.drag_mps, middle))


@formula
def coasted_mps(table: TractionTable, train: int, speed_mps: float, pulled: float) -> float:
    """
    Return the speed after a step without traction.

    Parameters
    ----------
    table
        From :func:`traction_table`.
    train
        Row of the train.
    speed_mps
        Speed at the start of the step. [m/s]
    pulled
        From :func:`pulled_mps` there. [m/s]

    Returns
    -------
    float
        Below 0 where the train would roll back. [m/s]
    """
    cell = int(speed_mps * table.cells_per_mps + table.first_cell[train])
    return float(pulled - table.gain_mps[cell] + table.coast_mps[cell])
