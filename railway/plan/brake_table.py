"""
The brake potential of all trains in one table, and whatever is read from it.

What the service brake and the gradient take from the square of a speed between two places is the
difference of twice the potential. Where the values of a train lie in the table is known here only.
"""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import compiled, formula, interpolated

SPACING_M = 1.0
"""One metre, so that a chainage is an index. [m]"""
ROUNDS = 4
"""Newton steps to a stopping place; the brake potential is nearly straight. [-]"""


class BrakeTable(NamedTuple):
    """
    Twice the brake potential along the line, as every train meets it.

    A difference of two of its values is a difference of squares of speeds. The functions of this
    module read it, and nobody else.
    """

    braking_v2_m2ps2: FloatArray
    """One train type after the other. [m2/s2], shape (n_types * n_grid,)"""
    row_start: FloatArray
    """Place of chainage 0 in it for each train. [-], shape (n_trains,)"""
    service_mps2: FloatArray
    """Service brake of each train on the level. [m/s2], shape (n_trains,)"""


@formula
def place_of(braking: BrakeTable, train: int, chainage_m: float) -> float:
    """
    Return the place of a chainage in the tables of all trains.

    Parameters
    ----------
    braking
        From :meth:`kankaku.railway.plan.profile.Profile.braking`.
    train
        Row of the train.
    chainage_m
        Where, within the tables. [m]

    Returns
    -------
    float
        A metre further on is a place further on. [m]
    """
    return float(chainage_m + braking.row_start[train])


@formula
def braking_v2_there(braking: BrakeTable, place: float) -> float:
    """
    Return twice the brake potential at a place of the tables.

    Parameters
    ----------
    braking
        From :meth:`kankaku.railway.plan.profile.Profile.braking`.
    place
        From :func:`place_of`. [m]

    Returns
    -------
    float
        Square of a speed. [m2/s2]
    """
    return float(interpolated(braking.braking_v2_m2ps2, place))


@formula
def braking_v2_at(braking: BrakeTable, train: int, chainage_m: float) -> float:
    """
    Return twice the brake potential of a train at a place.

    Parameters
    ----------
    braking
        From :meth:`kankaku.railway.plan.profile.Profile.braking`.
    train
        Row of the train.
    chainage_m
        Where, within the tables. [m]

    Returns
    -------
    float
        Square of a speed. [m2/s2]
    """
    place = chainage_m + braking.row_start[train]
    return float(interpolated(braking.braking_v2_m2ps2, place))


@formula
def braking_loss_mps(
    braking: BrakeTable, train: int, front_m: float, speed_mps: float, step_s: float
) -> float:
    """
    Return the speed that the service brake takes in a step under gravity.

    Parameters
    ----------
    braking
        From :meth:`kankaku.railway.plan.profile.Profile.braking`.
    train
        Row of the train.
    front_m
        Front at the start of the step. [m]
    speed_mps
        Speed there. [m/s]
    step_s
        Length of the step. [s]

    Returns
    -------
    float
        Speed lost. [m/s]
    """
    # Half the rise of the squares over a metre is the brake rate; that of mid-step keeps
    # the train on its curve where the gradient changes.
    table = braking.braking_v2_m2ps2
    middle = front_m + braking.row_start[train] + 0.5 * speed_mps * step_s
    ahead = interpolated(table, middle + 0.5 * SPACING_M)
    rise = ahead - interpolated(table, middle - 0.5 * SPACING_M)
    return float(0.5 * step_s / SPACING_M * rise)


@compiled
def braking_v2_each(braking: BrakeTable, trains: IntArray, chainage_m: FloatArray) -> FloatArray:
    """
    Return twice the brake potential at many places.

    Parameters
    ----------
    braking
        From :meth:`kankaku.railway.plan.profile.Profile.braking`.
    trains
        Rows of the trains. shape (n,)
    chainage_m
        Where each of them is, within the tables. [m], shape (n,)

    Returns
    -------
    FloatArray
        Squares of speeds. [m2/s2], shape (n,)
    """
    values = np.empty_like(chainage_m)
    for index in range(chainage_m.size):
        values[index] = braking_v2_at(braking, trains[index], chainage_m[index])
    return values


@formula
def braked_stop_m(braking: BrakeTable, train: int, front_m: float, speed_mps: float) -> float:
    """
    Return where the service brake brings a train to a stand.

    Parameters
    ----------
    braking
        From :meth:`kankaku.railway.plan.profile.Profile.braking`.
    train
        Row of the train.
    front_m
        Front. [m]
    speed_mps
        Speed. [m/s]

    Returns
    -------
    float
        The front at a stand. [m]
    """
    table, row_start = braking.braking_v2_m2ps2, braking.row_start[train]
    wanted = interpolated(table, front_m + row_start) + speed_mps * speed_mps
    place = front_m + row_start + 0.5 * speed_mps * speed_mps / braking.service_mps2[train]
    if speed_mps == 0.0:
        return float(place - row_start)
    for _ in range(ROUNDS):
        cell = int(place)
        slope = table[cell + 1] - table[cell]
        place += (wanted - interpolated(table, place)) / slope
    return float(place - row_start)


@formula
def nearly_braked_stop_m(
    braking: BrakeTable, train: int, front_m: float, speed_mps: float
) -> float:
    """
    Return :func:`braked_stop_m` but for rounding, at half the cost: for bands, which have room.

    Parameters
    ----------
    braking, train, front_m, speed_mps
        As there.

    Returns
    -------
    float
        The front at a stand. [m]
    """
    table, row_start = braking.braking_v2_m2ps2, braking.row_start[train]
    start = front_m + row_start
    if speed_mps == 0.0:
        return float(start - row_start)
    square = speed_mps * speed_mps
    wanted = interpolated(table, start) + square
    place = start + 0.5 * square / braking.service_mps2[train]
    for _ in range(ROUNDS):
        cell = int(place)
        place = cell + (wanted - table[cell]) / (table[cell + 1] - table[cell])
        # In its own cell the potential is straight.
        if int(place) == cell:
            break
    return float(place - row_start)
