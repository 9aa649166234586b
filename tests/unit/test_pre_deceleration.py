"""Pre-deceleration against a step-by-step run of what it plans."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from kankaku.controllers.operation.pre_deceleration import Approach, Slowing, slow_down
from kankaku.railway.motion.run_up import RunUp, RunUpTable, covers_s, shortest_s
from kankaku.railway.plan.rolling_stock import RunningResistance, Traction
from kankaku.testing.example_lines import commuter_train

A, B = 0.9, 1.0
FIRST_STAGE = A * B / (A + B)
PLAIN = commuter_train()
TRAIN = replace(
    PLAIN,
    rotating_mass_ratio=0.0,
    traction=Traction(A * PLAIN.mass_kg, 100.0, 200.0),
    resistance=RunningResistance(0.0, 0.0, 0.0),
    maximum_speed_mps=25.0,
)
SLOWEST_MPS = 15.0 / 3.6


def approach_of(distance_m: float, speed_mps: float, fastest_mps: float) -> Approach:
    return Approach(
        distance_m=distance_m,
        speed_mps=speed_mps,
        fastest_mps=fastest_mps,
        slowest_mps=SLOWEST_MPS,
        first_stage_mps2=FIRST_STAGE,
        service_brake_mps2=B,
        run_up=RunUp.of(TRAIN),
    )


def drive_until_the_first_stage(
    approach: Approach, slowing: Slowing | None, step_s: float = 0.01
) -> tuple[float, float]:
    """Return when the train meets the first-stage curve, and how fast it is then."""
    place_m, speed, time_s = 0.0, approach.speed_mps, 0.0
    while (approach.distance_m - place_m) * 2.0 * FIRST_STAGE > speed**2:
        ceiling = approach.fastest_mps
        if slowing is not None and time_s < slowing.lasts_s:
            ceiling = min(ceiling, slowing.ceiling_mps)
        after = float(np.clip(ceiling, speed - B * step_s, speed + A * step_s))
        place_m += 0.5 * (speed + after) * step_s
        speed, time_s = after, time_s + step_s
    return time_s, speed


def test_the_run_up_of_a_constant_acceleration_is_a_parabola() -> None:
    time_s, distance_m = RunUp.of(TRAIN).between(5.0, 20.0)
    assert time_s == pytest.approx(15.0 / A, rel=1e-6)
    assert distance_m == pytest.approx((20.0**2 - 5.0**2) / (2.0 * A), rel=1e-4)


@settings(max_examples=60, deadline=None)
@given(st.floats(200.0, 2500.0), st.floats(0.0, 25.0), st.floats(10.0, 25.0), st.floats(5.0, 200.0))
def test_a_slowed_train_meets_the_first_stage_when_its_leader_may_depart(
    distance_m: float, speed_mps: float, fastest_mps: float, wait_s: float
) -> None:
    speed_mps = min(speed_mps, fastest_mps)
    # Not yet in the first stage.
    assume(distance_m > speed_mps**2 / (2.0 * FIRST_STAGE) + 20.0)
    approach = approach_of(distance_m, speed_mps, fastest_mps)
    slowing = slow_down(approach, wait_s)
    free_s, _ = drive_until_the_first_stage(approach, None)
    if slowing is None:
        assert free_s >= wait_s - 0.5
        return
    assert SLOWEST_MPS - 1e-9 <= slowing.ceiling_mps <= fastest_mps + 1e-9
    assert 0.0 <= slowing.lasts_s <= wait_s
    met_s, met_mps = drive_until_the_first_stage(approach, slowing)
    # Never later than it must be, and never before the free run.
    assert met_s <= max(wait_s, free_s) + 1.0
    assert met_s >= free_s - 0.1
    assert met_mps <= fastest_mps + 1e-9


@pytest.mark.parametrize("wait_s", [70.0, 80.0, 100.0])
def test_with_room_enough_it_meets_the_first_stage_at_full_speed(wait_s: float) -> None:
    """2000 m away at 20 m/s the curve begins after 1578 m: 79 s, or longer if slower."""
    approach = approach_of(2000.0, 20.0, 20.0)
    free_s = (2000.0 - 20.0**2 / (2.0 * FIRST_STAGE)) / 20.0
    slowing = slow_down(approach, wait_s)
    if wait_s <= free_s:
        assert slowing is None
        return
    assert slowing is not None
    met_s, met_mps = drive_until_the_first_stage(approach, slowing)
    assert met_s == pytest.approx(wait_s, abs=0.2)
    assert met_mps == pytest.approx(20.0, abs=0.05)


def test_the_shortest_run_to_a_stop_is_the_trapezoid_of_speed() -> None:
    up = RunUpTable.of([RunUp.of(TRAIN)])
    # 1000 m from rest, no faster than 20 m/s: 422 m are lost to acceleration and braking.
    expected_s = 20.0 / A + 20.0 / B + (1000.0 - 200.0 / A - 200.0 / B) / 20.0
    assert shortest_s(up, 0, (1000.0, 0.0, 20.0), B) == pytest.approx(expected_s, rel=1e-3)
    # 100 m: the peak is sqrt(2 * 100 * ab/(a+b)), never cruising.
    peak = np.sqrt(2.0 * 100.0 * FIRST_STAGE)
    assert shortest_s(up, 0, (100.0, 0.0, 20.0), B) == pytest.approx(peak / A + peak / B, rel=1e-3)


def test_the_shortest_way_over_a_distance_is_acceleration_and_then_the_top_speed() -> None:
    up = RunUpTable.of([RunUp.of(TRAIN)])
    # 100 m from rest at a constant acceleration, and 1000 m no faster than 20 m/s.
    assert covers_s(up, 0, (100.0, 0.0, 40.0)) == pytest.approx(np.sqrt(200.0 / A), rel=1e-3)
    expected_s = 20.0 / A + (1000.0 - 200.0 / A) / 20.0
    assert covers_s(up, 0, (1000.0, 0.0, 20.0)) == pytest.approx(expected_s, rel=1e-3)
    assert covers_s(up, 0, (200.0, 20.0, 20.0)) == pytest.approx(10.0, rel=1e-6)
    assert covers_s(up, 0, (0.0, 5.0, 20.0)) == pytest.approx(0.0, abs=1e-6)
