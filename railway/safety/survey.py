"""What the monitor knows of trains and line beforehand, and what follows for many moments."""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import compiled
from kankaku.railway.plan.world import World
from kankaku.railway.safety.brakes import Fleet, data_of, fleet_of, overrun_m
from kankaku.railway.safety.ground import (
    Ground,
    ground_of,
    lie_of,
    mean_height_m,
    slope,
    under,
)
from kankaku.railway.safety.pull import Pull, pull_of

BRAKING_ROUNDS = 6


class Survey(NamedTuple):
    """What is known of trains and line beforehand."""

    fleet: Fleet
    ground: Ground
    pull: Pull
    stop_m: FloatArray
    """Shape (n_trains, n_calls_max + 1). [m]"""


def survey_of(world: World) -> Survey:
    """
    Return what is known of trains and line beforehand.

    Parameters
    ----------
    world
        Trains and line.

    Returns
    -------
    Survey
        Read from line, rolling stock and timetable alone.
    """
    stop_m = np.ascontiguousarray(world.stop_m, dtype=np.float64)
    return Survey(fleet_of(world), ground_of(world), pull_of(world), stop_m)


@compiled
def slopes_under(survey: Survey, rows: IntArray, front_m: FloatArray) -> FloatArray:
    """
    Return the gradients under trains.

    Parameters
    ----------
    survey
        Trains and line.
    rows
        The trains. shape (n_columns,)
    front_m
        Their fronts. [m], shape (n_columns, n_steps)

    Returns
    -------
    FloatArray
        Rising positive. [-], same shape
    """
    slopes, heights = np.empty(front_m.shape), survey.ground.heights
    for column in range(rows.size):
        lie = lie_of(survey.ground, rows[column], survey.fleet.length_m[rows[column]])
        near = lie.knots
        for step in range(front_m.shape[1]):
            at = under(heights, lie, front_m[column, step], near)
            near = at.knots
            slopes[column, step] = slope(heights, lie, at)
    return slopes


@compiled
def overruns_m(
    survey: Survey, rows: IntArray, front_m: FloatArray, speed_mps: FloatArray, aim_m: float
) -> FloatArray:
    """
    Return by how much trains run further than to a place by their service brakes.

    Parameters
    ----------
    survey
        Trains and line.
    rows
        The trains. shape (n_columns,)
    front_m
        Their fronts. [m], shape (n_columns,)
    speed_mps
        Their speeds. [m/s], shape (n_columns,)
    aim_m
        The place. [m]

    Returns
    -------
    FloatArray
        Negative for who stops before it. [m], shape (n_columns,)
    """
    over_m, heights = np.empty(rows.size), survey.ground.heights
    for column in range(rows.size):
        row = rows[column]
        lie = lie_of(survey.ground, row, survey.fleet.length_m[row])
        here = under(heights, lie, front_m[column], lie.knots)
        lift_m = -mean_height_m(heights, lie, here)
        lift_m += mean_height_m(heights, lie, under(heights, lie, aim_m, here.knots))
        room_m = aim_m - front_m[column]
        train = data_of(survey.fleet, row)
        over_m[column] = overrun_m(train, speed_mps[column], room_m, lift_m)
    return over_m


@compiled
def stands_m(
    survey: Survey, rows: IntArray, front_m: FloatArray, speed_mps: FloatArray
) -> FloatArray:
    """
    Return where fronts come to a stand by emergency brakes.

    Parameters
    ----------
    survey
        Trains and line.
    rows
        The trains. shape (n_columns,)
    front_m
        Their fronts. [m], shape (n_columns, n_steps)
    speed_mps
        Their speeds. [m/s], same shape

    Returns
    -------
    FloatArray
        How far ahead. [m], same shape
    """
    ahead_m, heights = np.empty(front_m.shape), survey.ground.heights
    for column in range(rows.size):
        train = data_of(survey.fleet, rows[column])
        lie = lie_of(survey.ground, rows[column], survey.fleet.length_m[rows[column]])
        near = lie.knots
        for step in range(front_m.shape[1]):
            here = under(heights, lie, front_m[column, step], near)
            near = here.knots
            here_m = mean_height_m(heights, lie, here)
            energy_m2ps2 = 0.5 * speed_mps[column, step] ** 2
            braking_m = energy_m2ps2 / train.emergency_mps2
            # Gradients are a tenth of the brake at most, so each round leaves a tenth of the error.
            for _ in range(BRAKING_ROUNDS):
                there = under(heights, lie, front_m[column, step] + braking_m, near)
                lift_m = mean_height_m(heights, lie, there) - here_m
                braking_m = energy_m2ps2 - train.brake_gravity_mps2 * lift_m
                braking_m /= train.emergency_mps2
            ahead_m[column, step] = braking_m
    return ahead_m
