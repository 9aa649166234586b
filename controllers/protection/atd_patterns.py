"""The two patterns of ATD: one braking curve each, as a staircase of fine steps."""

import math
from typing import NamedTuple

import numpy as np

from kankaku.controllers.protection.brake_pattern import brake_pattern_mps
from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import Plain, compiled, formula, naming
from kankaku.railway.motion.kinematics import next_speed_mps
from kankaku.railway.plan.brake_table import BrakeTable, braking_v2_at


class Patterns(NamedTuple):
    """The figures that the patterns follow from, in SI units; arrays of shape (n_trains,)."""

    braking: BrakeTable
    emergency_mps2: FloatArray
    origin_m: float
    """Where the first step begins. [m]"""
    step_m: float
    control_share: float
    """Deceleration of the control pattern over the service brake. [-]"""
    idle_time_s: float
    emergency_idle_time_s: float
    overlap_m: float


@naming
def patterns_of(fields: Plain) -> Patterns:
    """
    Return the figures with their names.

    Parameters
    ----------
    fields
        Of :class:`Patterns`, plain.

    Returns
    -------
    Patterns
        The same.
    """
    braking, emergency, origin_m, step_m, share, idle_s, emergency_idle_s, over_m = fields
    figures = origin_m, step_m, share, idle_s, emergency_idle_s, over_m
    return Patterns(BrakeTable(*braking), emergency, *figures)


@formula
def step_end_m(front_m: float, patterns: Patterns) -> float:
    """
    Return where the step of the patterns ends that holds a front.

    Parameters
    ----------
    front_m
        The front. [m]
    patterns
        The figures.

    Returns
    -------
    float
        [m]
    """
    steps = math.floor((front_m - patterns.origin_m) / patterns.step_m) + 1.0
    end_m: float = patterns.origin_m + steps * patterns.step_m
    return end_m


@formula
def control_mps(train: int, end_m: float, stop_m: float, patterns: Patterns) -> float:
    """
    Return the control pattern of a step: its curve at the step's end.

    Parameters
    ----------
    train
        Row of the train.
    end_m
        End of the step. [m]
    stop_m
        Where the curve ends. [m]
    patterns
        The figures.

    Returns
    -------
    float
        [m/s]
    """
    brake = patterns.control_share, patterns.idle_time_s
    return float(brake_pattern_mps(patterns.braking, train, end_m, stop_m, brake))


@formula
def emergency_mps(train: int, end_m: float, danger_m: float, patterns: Patterns) -> float:
    """
    Return the emergency pattern of a step: safe as far as the step's end.

    Parameters
    ----------
    train
        Row of the train.
    end_m
        End of the step. [m]
    danger_m
        Where the occupied circuit begins. [m]
    patterns
        The figures.

    Returns
    -------
    float
        [m/s]
    """
    if end_m >= danger_m:
        return 0.0
    braking = patterns.braking
    emergency_mps2 = patterns.emergency_mps2[train]
    whole = braking_v2_at(braking, train, danger_m) - braking_v2_at(braking, train, end_m)
    added = 2.0 * (emergency_mps2 - braking.service_mps2[train]) * (danger_m - end_m)
    lag_mps = emergency_mps2 * patterns.emergency_idle_time_s
    return float(next_speed_mps(0.0, whole + added, 0.0, lag_mps))


@compiled
def control_patterns_mps(
    train: int, front_m: FloatArray, stop_m: FloatArray, fields: Plain
) -> FloatArray:
    """
    Return the control patterns of a train at some places.

    Parameters
    ----------
    train
        Row of the train.
    front_m
        Places of its front. [m], shape (n_places,)
    stop_m
        Where the curves end. [m], shape (n_places,)
    fields
        Of :class:`Patterns`, plain.

    Returns
    -------
    FloatArray
        [m/s], shape (n_places,)
    """
    patterns, pattern_mps = patterns_of(fields), np.empty_like(front_m)
    for place in range(front_m.size):
        end_m = step_end_m(front_m[place], patterns)
        pattern_mps[place] = control_mps(train, end_m, stop_m[place], patterns)
    return pattern_mps
