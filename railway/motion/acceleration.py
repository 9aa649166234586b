"""What a train gains from cell to cell with full traction, by its energy."""

from functools import lru_cache

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import compiled, formula
from kankaku.railway.plan.rolling_stock import TrainType

SPEED_SPACING_MPS = 0.01


SLOW_MPS = 3.0
"""A train that speeds up from less than this does so within metres. [m/s]"""


@lru_cache(maxsize=64)
def accelerations(train_type: TrainType) -> tuple[FloatArray, FloatArray]:
    """
    Tabulate the acceleration with full traction and without any, on the level.

    Parameters
    ----------
    train_type
        The train.

    Returns
    -------
    tuple[FloatArray, FloatArray]
        At multiples of ``SPEED_SPACING_MPS``. [m/s2], shape (n_speeds,)
    """
    speeds = np.arange(0.0, 1.5 * train_type.maximum_speed_mps + 1.0, SPEED_SPACING_MPS)
    coast = -train_type.resistance.force_n(speeds) / train_type.inertial_mass_kg
    return train_type.level_acceleration_mps2(speeds), coast


@formula
def energy_gain(
    table: FloatArray, energy: float, step_m: float, drags: tuple[float, float]
) -> float:
    """
    Return the energy gained over a step by Heun's rule.

    Parameters
    ----------
    table
        Acceleration on the level, from :func:`accelerations`. [m/s2], shape (n_speeds,)
    energy
        Half the square of the speed before. [m2/s2]
    step_m
        Length of the step. [m]
    drags
        Deceleration by gradients and curves at its ends. [m/s2]

    Returns
    -------
    float
        The gain. [m2/s2]
    """
    slope = look_up(table, energy) - drags[0]
    ahead = max(energy + step_m * slope, 0.0)
    return 0.5 * step_m * (slope + look_up(table, ahead) - drags[1])


@formula
def look_up(table: FloatArray, energy: float) -> float:
    """
    Interpolate an acceleration.

    Parameters
    ----------
    table
        From :func:`accelerations`. [m/s2], shape (n_speeds,)
    energy
        Half the square of the speed. [m2/s2]

    Returns
    -------
    float
        The acceleration. [m/s2]
    """
    place = np.sqrt(2.0 * energy) / SPEED_SPACING_MPS
    index = min(int(place), table.size - 2)
    value: float = table[index] + (place - index) * (table[index + 1] - table[index])
    return value


@compiled
def accelerate_back(
    chainage_m: FloatArray, end_energy: float, drag: FloatArray, pull: FloatArray
) -> tuple[FloatArray, float]:
    """
    Return what a train must have all along in order to reach an energy with full traction.

    Parameters
    ----------
    chainage_m
        Ends of the cells. [m], shape (n_points,)
    end_energy
        Energy per unit of mass at the end. [m2/s2]
    drag
        Deceleration by gradient and curves at every end. [m/s2], shape (n_points,)
    pull
        Acceleration by traction and resistance, see :func:`accelerations`. [m/s2]

    Returns
    -------
    tuple[FloatArray, float]
        Energy needed at every end, and from where on it is more than nothing. [m2/s2], [m]
    """
    floor = np.zeros(chainage_m.size)
    floor[-1] = end_energy
    for cell in range(chainage_m.size - 2, -1, -1):
        ahead = floor[cell + 1]
        step_m = chainage_m[cell + 1] - chainage_m[cell]
        slope_ahead = look_up(pull, ahead) - drag[cell + 1]
        guess = max(ahead - step_m * slope_ahead, 0.0)
        slope = 0.5 * (slope_ahead + look_up(pull, guess) - drag[cell])
        floor[cell] = ahead - step_m * slope
        if floor[cell] <= 0.0:
            floor[cell] = 0.0
            return floor, chainage_m[cell + 1] - ahead / slope
    return floor, chainage_m[0]
