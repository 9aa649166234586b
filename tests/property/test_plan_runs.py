"""Runs of the control map on random lines: where they can stop, and which limits they keep."""

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from kankaku.controllers.control_map.planned_run import (
    Pace,
    PlannedTrains,
    RunPlace,
    RunTask,
    run,
    trains_of,
)
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.brake_table import braked_stop_m, braking_v2_each
from kankaku.railway.plan.line import Gradient, SpeedLimit
from kankaku.railway.plan.world import World
from kankaku.testing.example_lines import commuter_train, world_of
from tests.examples import examples
from tests.property.runs import GRAVITY, random_gradients, random_limits, solo_scenario

END_M = 4000.0
LENGTH_M = 200.0
TRAIN = commuter_train(LENGTH_M)
STOP_M = 3600.0
STEP_S = 0.5
MOMENTS = 121
MANY = examples(60)


def world_with(gradients: list[Gradient], limits: list[SpeedLimit]) -> World:
    scenario = solo_scenario(TRAIN, [300.0, STOP_M], END_M, gradients=gradients, limits=limits)
    return world_of(replace(scenario, step_s=0.1))


def trains_on(world: World) -> PlannedTrains:
    return trains_of(world, Pace(STEP_S, 0.5, 0.0, 25.0))


def mean_height_m(world: World, front_m: float) -> float:
    """Height averaged over the train, by its middle of 2000 pieces."""
    under_m = np.linspace(front_m - LENGTH_M, front_m, 4001)[1::2]
    return float(world.line.height_m(under_m).mean())


def stops_at_m(world: World, front_m: float, speed_mps: float) -> float:
    """Return where the service brake stops the train, by conservation of energy."""
    here_m, pull = mean_height_m(world, front_m), GRAVITY * TRAIN.gravity_ratio

    def left_m2ps2(place_m: float) -> float:
        lift_m = mean_height_m(world, place_m) - here_m
        taken = TRAIN.service_brake_mps2 * (place_m - front_m) + pull * lift_m
        return taken - 0.5 * speed_mps * speed_mps

    return float(brentq(left_m2ps2, front_m - 1.0, front_m + 2000.0, xtol=1e-6))


@MANY
@given(random_gradients(END_M), st.floats(300.0, 3000.0), st.floats(0.0, 25.0))
def test_a_train_stops_where_its_energy_is_spent(
    gradients: list[Gradient], front_m: float, speed_mps: float
) -> None:
    world = world_with(gradients, [])
    trains = trains_on(world)
    found_m = braked_stop_m(trains.braking, 0, front_m, speed_mps)
    assert abs(found_m - stops_at_m(world, front_m, speed_mps)) < 0.1


@st.composite
def rising_limits(draw: st.DrawFn) -> FloatArray:
    """Return limits that stand still and move on by turns, as the rear of a band ahead does."""
    steps = [
        np.full(draw(st.integers(1, 40)), draw(st.sampled_from([0.0, draw(st.floats(0.0, 12.0))])))
        for _ in range(8)
    ]
    moved_m = np.resize(np.concatenate(steps), MOMENTS).cumsum()
    eoa_m: FloatArray = draw(st.floats(700.0, 1500.0)) + moved_m
    return np.minimum(eoa_m, END_M)


@MANY
@given(random_gradients(END_M), random_limits(END_M), rising_limits(), st.floats(0.0, 12.0))
def test_a_run_can_stop_before_its_limit_at_every_moment(
    gradients: list[Gradient], limits: list[SpeedLimit], eoa_m: FloatArray, speed_mps: float
) -> None:
    world = world_with(gradients, limits)
    trains = trains_on(world)
    slow = min(speed_mps, *(limit.limit_mps for limit in limits), 12.0)
    front_m, planned_mps = np.empty(MOMENTS), np.empty(MOMENTS)
    end_v2 = braking_v2_each(trains.braking, np.zeros(MOMENTS, dtype=np.intp), eoa_m)
    place = RunPlace(400.0, slow, 1, np.inf)
    cap_mps = np.full(MOMENTS - 1, np.inf)
    run(trains, 0, place, RunTask(0.0, cap_mps, end_v2, front_m, planned_mps))
    for moment in range(0, MOMENTS, 6):
        stop_m = stops_at_m(world, front_m[moment], planned_mps[moment])
        assert stop_m <= eoa_m[moment] + 0.1
    assert np.all(planned_mps >= 0.0)
    assert np.all(np.diff(front_m) >= 0.0)
    assert np.all(front_m <= STOP_M + 0.5)
    assert np.all(planned_mps <= TRAIN.maximum_speed_mps + 1e-6)
    for limit in limits:
        inside = (front_m >= limit.start_m) & (front_m <= limit.end_m + LENGTH_M)
        assert np.all(planned_mps[inside] <= limit.limit_mps + 1e-6)


@MANY
@given(random_gradients(END_M, steepest=0.02), random_limits(END_M))
def test_a_free_run_is_the_run_that_the_drive_makes(
    gradients: list[Gradient], limits: list[SpeedLimit]
) -> None:
    """
    A step of 0.5 s loses less than a second on the way against one of 0.02 s.

    It gains at most itself where a limit ends, since it may begin up to a step before the end.
    """
    world = world_with(gradients, limits)
    coarse, fine = trains_on(world), trains_of(world, Pace(0.02, 0.5, 0.0, 25.0))
    arrivals_s = []
    for trains in (coarse, fine):
        moments = round(600.0 / trains.step_s) + 1
        nothing = np.full(moments, np.inf)
        task = RunTask(0.0, nothing[1:], nothing, np.empty(moments), np.empty(moments))
        _, arrival_s, hindered = run(trains, 0, RunPlace(300.0, 0.0, 1, np.inf), task)
        assert hindered == 0
        arrivals_s.append(arrival_s)
    passed = sum(limit.end_m + LENGTH_M > 300.0 for limit in limits)
    assert -STEP_S * (passed + 0.2) <= arrivals_s[0] - arrivals_s[1] <= 1.0
