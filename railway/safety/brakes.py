"""
How hard trains brake: what gradients add to a rate, and what a climb alone takes.

A brake's rate is one on the level, to which gravity adds, or a *net* one that is reached on any
gradient. Whoever has a net brake may still lose more speed than that: on a climb that its traction
does not hold against.
"""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import GRAVITY_MPS2, BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import formula
from kankaku.railway.plan.world import World
from kankaku.railway.safety.numbers import greater, share
from kankaku.railway.safety.pull import Pull, level_acceleration_mps2


class Fleet(NamedTuple):
    """What the monitor knows of all trains; arrays of shape (n_trains,)."""

    kind: IntArray
    """Train type."""
    length_m: FloatArray
    maximum_mps: FloatArray
    service_mps2: FloatArray
    emergency_mps2: FloatArray
    build_up_s: FloatArray
    """Until the brake is whole."""
    brake_gravity_mps2: FloatArray
    """What a gradient of 1 adds to the brake; 0 for net brakes."""
    weight_mps2: FloatArray
    """What a gradient of 1 takes from the acceleration."""
    curves_mps2: FloatArray
    """What the sharpest curve takes."""
    net: BoolArray
    """Brakes reach their rate on any gradient."""


class TrainData(NamedTuple):
    """What the monitor knows of one train; fields of :class:`Fleet`."""

    kind: int
    maximum_mps: float
    service_mps2: float
    emergency_mps2: float
    build_up_s: float
    brake_gravity_mps2: float
    weight_mps2: float
    curves_mps2: float
    net: bool


def fleet_of(world: World) -> Fleet:
    """
    Return what the monitor knows of all trains.

    Parameters
    ----------
    world
        Line and trains.

    Returns
    -------
    Fleet
        Read from the rolling stock and the curves of the line.
    """
    sharpest_m = min((curve.radius_m for curve in world.line.curves), default=np.inf)
    weight_mps2 = GRAVITY_MPS2 * world.of_type("gravity_ratio")
    return Fleet(
        world.type_index.astype(np.intp),
        world.length_m.astype(np.float64),
        world.of_type("maximum_speed_mps"),
        world.of_type("service_brake_mps2"),
        world.of_type("emergency_brake_mps2"),
        world.of_type("brake_build_up_s"),
        GRAVITY_MPS2 * world.of_type("brake_gravity_ratio"),
        weight_mps2,
        weight_mps2 * world.of_type("curve_resistance_m") / sharpest_m,
        world.of_type("net_brake") > 0.0,
    )


@formula
def data_of(fleet: Fleet, row: int) -> TrainData:
    """Return what the monitor knows of a train."""
    return TrainData(
        fleet.kind[row],
        fleet.maximum_mps[row],
        fleet.service_mps2[row],
        fleet.emergency_mps2[row],
        fleet.build_up_s[row],
        fleet.brake_gravity_mps2[row],
        fleet.weight_mps2[row],
        fleet.curves_mps2[row],
        fleet.net[row],
    )


@formula
def overrun_m(train: TrainData, speed_mps: float, room_m: float, lift_m: float) -> float:
    """
    Return how much further than a room a train runs by its service brake: by energy. [m]

    ``(v^2 / 2 - (b s + g h)) / b``, with the room ``s`` and the mean height ``h`` that the whole
    train has gained at the end of it.
    """
    available_m2ps2 = train.service_mps2 * room_m + train.brake_gravity_mps2 * lift_m
    return (0.5 * speed_mps**2 - available_m2ps2) / train.service_mps2


@formula
def rising_m(train: TrainData, slope: float, speed_mps: float, gained_mps2: float) -> float:
    """
    Return how much further a train runs because its service brake builds up. [m]

    Traction is gone at once; what of a brake is not there yet comes evenly, in its share of
    the build-up. Zero for who stands before the brake is whole.
    """
    if train.build_up_s <= 0.0:
        return 0.0
    rate_mps2 = train.service_mps2
    whole_mps2 = rate_mps2 + train.brake_gravity_mps2 * slope
    rise_s = train.build_up_s * share((whole_mps2 + gained_mps2) / rate_mps2)
    rising_mps3 = rate_mps2 / train.build_up_s
    first_mps2 = whole_mps2 - rising_mps3 * rise_s
    then_mps = speed_mps - first_mps2 * rise_s - 0.5 * rising_mps3 * rise_s**2
    risen_m = (speed_mps - 0.5 * first_mps2 * rise_s - rising_mps3 * rise_s**2 / 6.0) * rise_s
    further_m2ps2 = whole_mps2 * risen_m + 0.5 * (then_mps**2 - speed_mps**2)
    return further_m2ps2 / rate_mps2 if then_mps > 0.0 else 0.0


@formula
def strongest_mps2(
    pull: Pull, train: TrainData, rate_mps2: float, slope: float, speed_mps: float
) -> float:
    """
    Return how much speed a train may lose that brakes at a rate at most. [m/s2]

    Who has a net brake may lose as much as a climb takes with all traction.
    """
    most_mps2 = rate_mps2 + train.brake_gravity_mps2 * slope
    if train.net:
        climbing_mps2 = train.weight_mps2 * slope + train.curves_mps2
        climbing_mps2 -= level_acceleration_mps2(pull, train.kind, speed_mps)
        most_mps2 = greater(most_mps2, climbing_mps2)
    return most_mps2
