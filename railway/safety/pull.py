"""How hard trains pull: the greatest acceleration on level straight track, one train at a time."""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import formula
from kankaku.railway.plan.rolling_stock import ForceTable
from kankaku.railway.plan.world import World
from kankaku.railway.safety.numbers import greater, knot_before, lesser

STANDING_MPS = 1e-9
"""Power over speed has no value at rest. [m/s]"""


class Pull(NamedTuple):
    """
    Traction and resistance of train types; arrays of shape (n_types,) but for the tables.

    Forces are taken from a table of one value where a formula follows from it, and by a formula of
    infinite speeds where there is a table.
    """

    speeds_mps: FloatArray
    """Of all tables, one after the other. shape (n_speeds,)"""
    forces_n: FloatArray
    """At these speeds. shape (n_speeds,)"""
    slopes: FloatArray
    """Behind each of them. [N s/m], shape (n_speeds,)"""
    ends: IntArray
    """First and last speed of each table. shape (n_types, 2)"""
    power_mps: FloatArray
    """Constant power from here on. [m/s]"""
    characteristic_mps: FloatArray
    """Power falls from here on. [m/s]"""
    resistance: FloatArray
    """``a``, ``b``, ``c`` of ``a + b v + c v^2``. [N, N s/m, N s2/m2], shape (n_types, 3)"""
    mass_kg: FloatArray


def pull_of(world: World) -> Pull:
    """
    Return how hard the train types of a world pull.

    Parameters
    ----------
    world
        Whose train types.

    Returns
    -------
    Pull
        Read from the rolling stock alone.
    """
    speeds, forces, slopes, bends = [], [], [], []
    for kind in world.train_types:
        made = kind.traction
        if isinstance(made, ForceTable):
            speed_mps, force_n = np.array(made.speeds_mps), np.array(made.forces_n)
            bends.append((np.inf, np.inf))
        else:
            speed_mps, force_n = np.zeros(1), np.array([made.starting_force_n])
            bends.append((made.power_speed_mps, made.characteristic_speed_mps))
        speeds.append(speed_mps)
        forces.append(force_n)
        slopes.append(np.append(np.diff(force_n) / np.diff(speed_mps), 0.0))
    ends = np.cumsum([0, *(table.size for table in speeds)])
    power_mps, characteristic_mps = np.array(bends, dtype=np.float64).T
    felt = [kind.resistance for kind in world.train_types]
    return Pull(
        np.concatenate(speeds).astype(np.float64),
        np.concatenate(forces).astype(np.float64),
        np.concatenate(slopes),
        np.column_stack((ends[:-1], ends[1:] - 1)).astype(np.intp),
        power_mps.copy(),
        characteristic_mps.copy(),
        np.array([(one.a_n, one.b_nspm, one.c_ns2pm2) for one in felt]),
        np.array([kind.inertial_mass_kg for kind in world.train_types]),
    )


@formula
def level_acceleration_mps2(pull: Pull, kind: int, speed_mps: float) -> float:
    """Return the greatest acceleration of a train type at a speed: net force by mass. [m/s2]"""
    first, last = pull.ends[kind, 0], pull.ends[kind, 1]
    at = knot_before(pull.speeds_mps, (first, last), speed_mps, first)
    force_n = pull.slopes[at] * (speed_mps - pull.speeds_mps[at]) + pull.forces_n[at]
    moving_mps = greater(speed_mps, STANDING_MPS)
    force_n *= lesser(1.0, pull.power_mps[kind] / moving_mps)
    force_n *= lesser(1.0, pull.characteristic_mps[kind] / moving_mps)
    a_n, b_nspm, c_ns2pm2 = pull.resistance[kind]
    resistance_n = a_n + (b_nspm + c_ns2pm2 * speed_mps) * speed_mps
    acceleration: float = (force_n - resistance_n) / pull.mass_kg[kind]
    return acceleration
