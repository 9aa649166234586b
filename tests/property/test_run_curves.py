"""Run curves on random lines: the optimum, the time asked for, the limits and the physics."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, reject
from hypothesis import strategies as st

from kankaku.railway.arrays import FloatArray
from kankaku.railway.motion.run_curve import RunCurve, RunTimeError, fastest_run
from kankaku.railway.motion.timed_run import timed_run
from kankaku.railway.plan.buffers import Buffers
from kankaku.railway.plan.line import Line, TrackCurve
from kankaku.testing.example_lines import commuter_train, straight_line
from tests.examples import examples
from tests.property.dense_run import (
    GRAVITY,
    NO_RADIO,
    DenseRun,
    Radio,
    curvatures,
    dense_run,
    inertial_kg,
    pull_n,
    restrictions,
    rolling_n,
    slopes,
)
from tests.property.runs import random_gradients, random_limits

END_M = 4000.0
TRAIN = commuter_train()
GENTLE = 0.012
"""Full traction speeds the train up on this climb at any speed. [-]"""
STEEP = 0.035
QUICK = examples(25)


@dataclass(frozen=True)
class Task:
    """A run to be made."""

    line: Line
    ends_m: tuple[float, float]
    speeds_mps: tuple[float, float]
    radio: Radio

    @property
    def buffers(self) -> Buffers:
        radio = self.radio
        return Buffers(radio.error_ratio, radio.delay_s, radio.resolution_m, radio.balises_m)

    def optimum(self, *, widened_m: float = 0.0, traction: bool = True) -> DenseRun:
        return dense_run(
            self.line,
            TRAIN,
            self.ends_m,
            self.speeds_mps,
            self.radio,
            widened_m=widened_m,
            traction=traction,
        )

    def fastest(self) -> RunCurve:
        start_mps, stop_mps = self.speeds_mps
        return fastest_run(
            self.line,
            TRAIN,
            *self.ends_m,
            start_mps=start_mps,
            stop_mps=stop_mps,
            buffers=self.buffers,
        )

    def timed(self, run_time_s: float) -> RunCurve:
        start_mps, stop_mps = self.speeds_mps
        return timed_run(
            self.line,
            TRAIN,
            *self.ends_m,
            run_time_s,
            start_mps=start_mps,
            stop_mps=stop_mps,
            buffers=self.buffers,
        )


@st.composite
def tasks(draw: st.DrawFn, steepest: float = STEEP, *, from_rest: bool = False) -> Task:
    """Limits, gradients, a curve, perhaps buffers; speeds that the brake can keep."""
    gradients = draw(random_gradients(END_M, steepest))
    limits = draw(random_limits(END_M))
    curve_m = draw(st.floats(0.0, 3000.0))
    curve = TrackCurve(curve_m, curve_m + 400.0, draw(st.floats(250.0, 1000.0)))
    plain = straight_line({"west": 300.0}, END_M, gradients, limits)
    start_m = draw(st.floats(0.0, 1500.0))
    stop_m = start_m + draw(st.floats(300.0, 2400.0))
    balises_m = sorted(draw(st.sets(st.floats(1.0, END_M), max_size=4)))
    radio = Radio(0.001, 0.5, 2.0, (0.0, *balises_m)) if draw(st.booleans()) else NO_RADIO
    stop_mps = 0.0 if from_rest else draw(st.just(0.0) | st.floats(0.0, 20.0))
    resting = Task(replace(plain, curves=(curve,)), (start_m, stop_m), (0.0, stop_mps), radio)
    if from_rest:
        return resting
    greatest_mps = resting.optimum(widened_m=1.0).greatest_start_mps
    share = draw(st.just(0.0) | st.floats(0.0, 0.99))
    return replace(resting, speeds_mps=(share * greatest_mps, stop_mps))


@QUICK
@given(tasks())
def test_fastest_run_is_the_dense_optimum_of_limits_tabulated_to_the_metre(task: Task) -> None:
    run = task.fastest()
    assert run.run_time_s >= task.optimum().run_time_s * (1.0 - 1e-4)
    assert run.run_time_s <= task.optimum(widened_m=1.0).run_time_s * (1.0 + 2e-4)


@QUICK
@given(tasks(), st.lists(st.floats(1.0, 1.3), min_size=1, max_size=3))
def test_a_timed_run_meets_its_time_nowhere_faster_than_a_faster_one(
    task: Task, shares: list[float]
) -> None:
    runs = [task.fastest()]
    for share in sorted(shares):
        try:
            runs.append(task.timed(share * runs[0].run_time_s))
        except RunTimeError:
            break
        assert runs[-1].run_time_s == pytest.approx(share * runs[0].run_time_s, abs=0.01)
    for faster, slower in pairwise(runs):
        assert np.array_equal(faster.chainage_m, slower.chainage_m)
        assert np.all(slower.speed_mps <= faster.speed_mps + 1e-6)
        scale_j = runs[0].traction_work_j[-1]
        assert slower.traction_work_j[-1] <= faster.traction_work_j[-1] + 1e-4 * scale_j


@QUICK
@given(tasks(0.0), st.floats(1.0, 1.3))
def test_on_a_level_line_only_what_takes_longer_than_coasting_from_the_start_is_refused(
    task: Task, share: float
) -> None:
    fastest_s = task.fastest().run_time_s
    run_time_s = share * fastest_s
    coasting_s = task.optimum(traction=False).run_time_s
    if run_time_s < 0.999 * coasting_s:
        assert task.timed(run_time_s).run_time_s == pytest.approx(run_time_s, abs=0.01)
    # Where it nearly stands on the way, the last bit of coasting is not asked for.
    if coasting_s < 1.5 * fastest_s:
        with pytest.raises(RunTimeError, match=r"at most$") as refused:
            task.timed(1.001 * coasting_s + 0.1)
        assert float(str(refused.value).split()[-3]) == pytest.approx(coasting_s, rel=0.01)


@QUICK
@given(tasks(GENTLE, from_rest=True), st.floats(1.0, 1.1))
def test_from_rest_on_gentle_gradients_every_time_up_to_a_tenth_more_is_met(
    task: Task, share: float
) -> None:
    fastest_s = task.fastest().run_time_s
    assert task.timed(share * fastest_s).run_time_s == pytest.approx(share * fastest_s, abs=0.01)
    with pytest.raises(RunTimeError, match=f"the fastest takes {fastest_s:.2f}"):
        task.timed(0.99 * fastest_s)


def some_run(task: Task, share: float) -> RunCurve:
    fastest = task.fastest()
    try:
        return task.timed(share * fastest.run_time_s)
    except RunTimeError:
        reject()


@QUICK
@given(tasks(), st.floats(1.0, 1.3))
def test_a_run_keeps_its_ends_its_clock_and_every_limit_with_the_whole_train(
    task: Task, share: float
) -> None:
    run = some_run(task, share)
    assert (run.chainage_m[0], run.chainage_m[-1]) == task.ends_m
    assert np.all(np.diff(run.chainage_m) > 0.0)
    assert run.speed_mps[0] == pytest.approx(task.speeds_mps[0])
    assert run.speed_mps[-1] <= task.speeds_mps[1] + 1e-6
    assert np.all(run.speed_mps <= TRAIN.maximum_speed_mps + 1e-6)
    for enters_m, leaves_m, limit_mps in restrictions(task.line, TRAIN.length_m, task.radio):
        on_it = (run.chainage_m >= enters_m) & (run.chainage_m <= leaves_m)
        assert np.all(run.speed_mps[on_it] <= limit_mps + 1e-6)
    assert run.time_s[0] == 0.0
    steps_s = 2.0 * np.diff(run.chainage_m) / (run.speed_mps[1:] + run.speed_mps[:-1])
    assert np.all(steps_s > 0.0)
    assert np.diff(run.time_s) == pytest.approx(steps_s)


def middles(values: FloatArray) -> FloatArray:
    found: FloatArray = 0.5 * (values[1:] + values[:-1])
    return found


@QUICK
@given(tasks(), st.floats(1.0, 1.3))
def test_traction_work_is_what_resistance_gradients_braking_and_speed_take(
    task: Task, share: float
) -> None:
    run = some_run(task, share)
    cells_m, middle_m = np.diff(run.chainage_m), middles(run.chainage_m)
    speed_mps = np.sqrt(middles(run.speed_mps**2))
    mass_kg = inertial_kg(TRAIN)
    rolling = np.array([rolling_n(TRAIN, float(speed)) for speed in speed_mps])
    slope_n = GRAVITY * TRAIN.mass_kg * slopes(task.line, middle_m, TRAIN.length_m)
    curve_n = GRAVITY * TRAIN.mass_kg * curvatures(task.line, middle_m, TRAIN.length_m)
    gained_j = 0.5 * mass_kg * np.diff(run.speed_mps**2)
    asked_j = gained_j + (rolling + slope_n + curve_n) * cells_m
    traction_j = np.diff(run.traction_work_j)
    braking_j = np.maximum(-asked_j, 0.0)
    assert run.traction_work_j[0] == 0.0
    assert np.all(traction_j >= 0.0)

    # In whole, with the lift from the heights of the line.
    heights_m = task.line.height_m(np.linspace(-TRAIN.length_m, 0.0, 4001)[:, None] + task.ends_m)
    lift_j = GRAVITY * TRAIN.mass_kg * float(np.diff(heights_m.mean(axis=0))[0])
    kinetic_j = 0.5 * mass_kg * (run.speed_mps[-1] ** 2 - run.speed_mps[0] ** 2)
    taken_j = float(np.sum((rolling + curve_n) * cells_m)) + lift_j + float(np.sum(braking_j))
    scale_j = float(np.sum(traction_j + braking_j)) + mass_kg
    assert run.traction_work_j[-1] - taken_j == pytest.approx(kinetic_j, abs=0.005 * scale_j)

    # And cell by cell: no more than traction gives, no harder than the service brake.
    slowest = np.minimum(run.speed_mps[1:], run.speed_mps[:-1])
    strongest = np.array([pull_n(TRAIN, float(speed)) for speed in slowest])
    assert np.all(traction_j <= strongest * cells_m * 1.01 + 10.0)
    hardest_n = mass_kg * TRAIN.service_brake_mps2 + slope_n
    # A gradient that starts within a cell counts from the metre before or behind.
    kink_n = 2.0 * STEEP * GRAVITY * TRAIN.mass_kg / TRAIN.length_m
    assert np.all(gained_j >= -(hardest_n + kink_n) * cells_m - 1.0)
