"""The approach point against closed forms, brute force and dense integration."""

import numpy as np
import pytest

from kankaku.controllers.operation.approach_plan import (
    approach_point,
    pattern_front_m,
    pattern_m2ps2,
)
from kankaku.railway.arrays import FloatArray
from kankaku.railway.motion.run_curve import fastest_run
from kankaku.railway.plan.line import Gradient, Line
from kankaku.testing.example_lines import commuter_train
from tests.property.dense_run import dense_run
from tests.unit.approach_sites import (
    END_M,
    GATE_M,
    GRAVITY,
    HILLY,
    OPENS_S,
    STOP_M,
    TOP_MPS,
    Level,
    line_of,
    plain_train,
    point_of,
    site_of,
)


@pytest.mark.parametrize(("speeding_mps2", "braking_mps2"), [(0.9, 1.0), (0.7, 1.2), (1.1, 0.8)])
@pytest.mark.parametrize("delay_s", [0.0, 0.5, 1.5])
@pytest.mark.parametrize("gate_m", [1790.0, 1850.0])
@pytest.mark.parametrize("slope", [0.0, 0.02, -0.02])
def test_approach_point_minimises_the_time_from_the_brake_pattern_to_the_stop(
    speeding_mps2: float, braking_mps2: float, delay_s: float, gate_m: float, slope: float
) -> None:
    """A uniform gradient only adds to the brake what it takes from the acceleration."""
    gravity_mps2 = GRAVITY * slope
    level = Level(speeding_mps2 - gravity_mps2, braking_mps2 + gravity_mps2, delay_s, gate_m)
    line = line_of([Gradient(0.0, END_M, slope)])
    train = plain_train(speeding_mps2, braking_mps2)
    point = point_of(site_of(train, line, delay_s=delay_s, gate_m=gate_m))
    best_mps = level.best_speed_mps()
    assert point.speed_mps == pytest.approx(best_mps, abs=0.05)
    assert point.front_m == pytest.approx(level.on_pattern_m(point.speed_mps), abs=0.01)
    assert point.passed_s == pytest.approx(OPENS_S, abs=1e-6)
    assert point.interval_s == pytest.approx(OPENS_S + level.run_in_s(best_mps), abs=0.01)
    behind_m = 0.5 * point.speed_mps**2 / level.speeding_mps2
    assert point.front_m - point.optimal_stop_m == pytest.approx(behind_m, abs=0.05)


def test_without_radio_delay_the_best_speed_has_a_closed_form() -> None:
    """dT/dv = 0 where the peak is (a + b) / b times the speed."""
    a, b = 0.9, 1.0
    expected_mps = b * np.sqrt(2.0 * b * (STOP_M - GATE_M) / ((a + b) * (a + 2.0 * b)))
    assert point_of(site_of(plain_train(a, b))).speed_mps == pytest.approx(expected_mps, abs=0.02)


@pytest.mark.parametrize("delay_s", [0.0, 0.5])
def test_brake_pattern_is_the_curve_of_constant_braking_short_of_the_gate(delay_s: float) -> None:
    site = site_of(plain_train(), delay_s=delay_s)
    level = Level(0.9, 1.0, delay_s)
    for speed_mps in (0.0, 3.0, 8.5, 20.0):
        expected_m = float(level.on_pattern_m(speed_mps))
        assert pattern_front_m(site, GATE_M, speed_mps) == pytest.approx(expected_m, abs=1e-6)
    half_squares = pattern_m2ps2(site, GATE_M)
    grid_m = site.profile.grid_m
    near = (grid_m > level.on_pattern_m(TOP_MPS)) & (grid_m < GATE_M - 1.0)
    speeds_mps = np.sqrt(2.0 * half_squares[near])
    assert level.on_pattern_m(speeds_mps) == pytest.approx(grid_m[near], abs=0.02)
    assert np.all(half_squares[grid_m >= GATE_M] == 0.0)


@pytest.mark.parametrize("line", [line_of(), HILLY], ids=["level", "hilly"])
def test_both_a_too_fast_and_a_too_slow_train_arrive_later(line: Line) -> None:
    """The shape of the paper's fig. 3: down to the approach point and up again."""
    train = commuter_train()
    site = site_of(train, line, delay_s=0.5)
    point = point_of(site)
    speeds_mps = np.arange(1.0, 13.0, 0.5)
    intervals_s = []
    for speed_mps in speeds_mps.tolist():
        front_m = pattern_front_m(site, GATE_M, speed_mps)
        run = fastest_run(line, train, front_m, STOP_M, start_mps=speed_mps)
        intervals_s.append(OPENS_S + run.run_time_s)
    best = int(np.argmin(intervals_s))
    assert np.all(np.diff(intervals_s[: best + 1]) < 0.0)
    assert np.all(np.diff(intervals_s[best:]) > 0.0)
    assert intervals_s[0] > intervals_s[best] + 1.0
    assert intervals_s[-1] > intervals_s[best] + 0.3
    assert abs(point.speed_mps - speeds_mps[best]) <= 0.5
    assert point.interval_s <= intervals_s[best] + 1e-3


@pytest.mark.parametrize("line", [line_of(), HILLY], ids=["level", "hilly"])
def test_with_resistance_gradients_and_limits_the_point_is_that_of_a_dense_integration(
    line: Line,
) -> None:
    train = commuter_train()
    point = point_of(site_of(train, line))
    speeds_mps = np.arange(3.0, 13.0, 0.5)
    fronts_m = [pattern_front_m(site_of(train, line), GATE_M, speed) for speed in speeds_mps]
    runs_s = [
        dense_run(line, train, (front_m, STOP_M), (speed_mps, 0.0)).run_time_s
        for front_m, speed_mps in zip(fronts_m, speeds_mps.tolist(), strict=True)
    ]
    assert point.interval_s == pytest.approx(OPENS_S + min(runs_s), abs=0.03)
    assert point.speed_mps == pytest.approx(speeds_mps[np.argmin(runs_s)], abs=0.5)
    start = dense_run(
        line, train, (point.optimal_stop_m, point.front_m), (0.0, 2.0 * point.speed_mps)
    )
    assert start.speed_mps[-1] == pytest.approx(point.speed_mps, abs=0.02)


def moving_off(tail_m: float, from_s: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Tails of a leader that speeds up at 0.9 m/s2, every 10 cm, and when it is there."""
    moved_m = np.arange(0.0, 1000.0, 0.1)
    return tail_m + moved_m, from_s + np.sqrt(2.0 * moved_m / 0.9)


def test_behind_an_authority_that_moves_with_the_leader_there_is_nothing_to_plan() -> None:
    eoa_m, since_s = moving_off(1790.0)
    site = site_of(plain_train())._replace(eoa_m=eoa_m, since_departure_s=since_s)
    assert approach_point(site) is None


def test_a_gate_beyond_the_stop_is_none() -> None:
    assert approach_point(site_of(plain_train(), gate_m=STOP_M + 5.0)) is None


def test_of_two_gates_the_one_that_lets_the_train_arrive_sooner_counts() -> None:
    """Whoever runs up to the later gate may brake for it past the earlier one."""
    second_m, second_s = 1900.0, OPENS_S + 2.0
    site = site_of(plain_train())._replace(
        eoa_m=np.array([GATE_M, second_m, END_M]),
        since_departure_s=np.array([0.0, OPENS_S, second_s]),
    )
    point = point_of(site)
    beyond = Level(0.9, 1.0, 0.0, second_m)
    assert point.gate_m == second_m
    expected_s = second_s + beyond.run_in_s(beyond.best_speed_mps())
    assert point.interval_s == pytest.approx(expected_s, abs=0.01)


@pytest.mark.parametrize("tail_mps", [5.0, 8.0])
def test_the_run_in_never_needs_an_authority_before_it_is_there(tail_mps: float) -> None:
    """Beyond the gate authority follows a slow tail: each place needs its own brake curve's end."""
    moved_m = np.arange(0.0, 400.0, 0.5)
    site = site_of(plain_train())._replace(
        eoa_m=np.append(GATE_M, GATE_M + 10.0 + moved_m),
        since_departure_s=np.append(0.0, OPENS_S + moved_m / tail_mps),
    )
    point = point_of(site)
    level = Level(0.9, 1.0)
    passed_s, intervals_s = [], []
    for speed_mps in np.arange(1.0, 13.0, 0.01).tolist():
        run_s = float(level.run_in_s(speed_mps))
        # Speed up for as long as leaves time to brake: v + a t = b (T - t).
        time_s = np.linspace(0.0, (run_s - speed_mps) / 1.9, 500)
        then_mps = speed_mps + 0.9 * time_s
        front_m = level.on_pattern_m(speed_mps) + 0.5 * (speed_mps + then_mps) * time_s
        ends_m = front_m + 0.5 * np.square(then_mps)
        there_s = OPENS_S + np.maximum(ends_m - GATE_M - 10.0, 0.0) / tail_mps
        passed_s.append(float(np.max(there_s - time_s)))
        intervals_s.append(passed_s[-1] + run_s)
    best = int(np.argmin(intervals_s))
    assert passed_s[best] > OPENS_S + 1.0
    assert point.interval_s == pytest.approx(intervals_s[best], abs=0.15)
    assert point.interval_s > OPENS_S + level.run_in_s(level.best_speed_mps()) + 1.0
