"""Braking formulas against their definitions, and against brute force."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kankaku.railway.arrays import FloatArray
from kankaku.railway.motion.kinematics import (
    braking_distance_m,
    next_speed_mps,
    two_stage_brake_mps2,
    two_stage_speed_mps,
)

speeds = st.floats(0.0, 40.0)
brakes = st.floats(0.4, 2.0)
accelerations = st.floats(0.3, 1.5)
steps = st.sampled_from([0.02, 0.1, 0.25, 0.5, 1.0])
gaps = st.floats(0.5, 2000.0)
ROUNDING_MPS = 1e-9


def next_speed(
    speed_mps: float, square_m2ps2: float, loss_mps: float, lag_mps: float = 0.0
) -> float:
    arrays = (np.array([value]) for value in (speed_mps, square_m2ps2, loss_mps, lag_mps))
    return float(next_speed_mps(*arrays)[0])


def two_stage_speed(gap_m: float, leader_mps: float, a: float, b: float) -> float:
    return float(two_stage_speed_mps(np.array([gap_m]), np.array([leader_mps]), a, b)[0])


@given(speeds, brakes)
def test_braking_distance_is_mean_speed_times_braking_time(speed: float, brake: float) -> None:
    distance = float(braking_distance_m(np.array([speed]), brake)[0])
    assert distance == pytest.approx(0.5 * speed * (speed / brake))


@given(speeds, st.floats(0.0, 2000.0), brakes, steps, st.floats(0.0, 3.0))
def test_next_speed_is_the_greatest_that_keeps_the_curve(
    speed: float, square: float, brake: float, step: float, delay: float
) -> None:
    loss = brake * step
    after = next_speed(speed, square, loss, brake * delay)
    assert after >= 0.0
    if after > 0.0:
        # In metres: what it runs in the step, in the delay, and while braking.
        used_m = 0.5 * (speed + after) * step + after * delay + 0.5 * after**2 / brake
        assert used_m == pytest.approx(0.5 * square / brake, rel=1e-9, abs=1e-9)
    else:
        assert loss * speed >= square - 1e-9


def stop_by_steps(speed: float, gap: float, brake: float, step: float) -> tuple[FloatArray, float]:
    """Return the places, the target at 0, and the time until the train stands."""
    place, places = -gap, [-gap]
    while speed > ROUNDING_MPS:
        after = next_speed(speed, 2.0 * brake * max(-place, 0.0), brake * step)
        # No drive accelerates by more than 1 m/s2.
        after = min(after, speed + step)
        place += 0.5 * (speed + after) * step
        places.append(place)
        speed = after
    return np.array(places), step * (len(places) - 1)


@settings(max_examples=60)
@given(st.floats(0.5, 35.0), st.floats(0.0, 300.0), brakes, steps)
def test_a_train_that_can_stop_stops_within_the_stated_distance_of_its_target(
    speed: float, spare: float, brake: float, step: float
) -> None:
    gap = 0.5 * speed**2 / brake + spare
    places, _ = stop_by_steps(speed, gap, brake, step)
    assert -1e-6 <= places[-1] <= brake * step**2 / 8.0 + 1e-6
    assert np.all(np.diff(places) >= 0.0)


@given(st.floats(1.0, 35.0), brakes, steps)
def test_braking_on_the_curve_takes_speed_over_brake_rounded_up_to_a_step(
    speed: float, brake: float, step: float
) -> None:
    _, lasted = stop_by_steps(speed, 0.5 * speed**2 / brake, brake, step)
    assert speed / brake - 1e-6 <= lasted <= speed / brake + step * (1.0 + 1e-6)


@pytest.mark.parametrize("speed", [7.3, 19.1, 29.9])
def test_halving_the_step_quarters_the_greatest_overrun(speed: float) -> None:
    brake = 1.1
    for halvings in range(6):
        step = 1.0 / 2**halvings
        places, _ = stop_by_steps(speed, 0.5 * speed**2 / brake, brake, step)
        assert 0.0 <= places[-1] + 1e-9 <= brake / 8.0 * 0.25**halvings + 2e-9


@given(gaps, accelerations, brakes)
def test_behind_a_standing_leader_two_stage_speed_is_equation_16(
    gap: float, a: float, b: float
) -> None:
    expected = np.sqrt(2.0 * a * b * gap / (a + b))
    assert two_stage_speed(gap, 0.0, a, b) == pytest.approx(expected, rel=1e-9)
    assert two_stage_brake_mps2(a, b) == pytest.approx(1.0 / (1.0 / a + 1.0 / b))


@given(gaps, accelerations, brakes)
def test_holding_the_two_stage_speed_touches_the_departing_leader_once(
    gap: float, a: float, b: float
) -> None:
    """Equations (13) to (15): tangency of braking point and rear, at t = v / a."""
    held = two_stage_speed(gap, 0.0, a, b)
    touch = held / a
    time = np.linspace(0.0, 3.0 * touch, 3001)
    rear = gap + 0.5 * a * time**2
    braking_point = held * time + held**2 / (2.0 * b)
    room = rear - braking_point
    scale = 1e-9 * (1.0 + gap)
    assert room.min() >= -scale
    assert room[1000] == pytest.approx(0.0, abs=scale)
    assert abs(int(room.argmin()) - 1000) <= 1


def brute_force_held_speed(gap: float, leader: float, a: float, b: float) -> float:
    """Bisect the speed whose braking point never passes the rear of the leader."""
    time = np.linspace(0.0, 200.0, 40_001)
    rear = gap + leader * time + 0.5 * a * time**2
    low, high = 0.0, 200.0
    while high - low > 1e-4:
        middle = 0.5 * (low + high)
        safe = np.all(rear - middle * time >= middle**2 / (2.0 * b))
        low, high = (middle, high) if safe else (low, middle)
    return low


@settings(max_examples=40, deadline=None)
@given(st.floats(0.5, 1500.0), st.floats(0.0, 30.0), accelerations, brakes)
def test_behind_a_moving_leader_two_stage_speed_is_the_greatest_safe_one(
    gap: float, leader: float, a: float, b: float
) -> None:
    expected = brute_force_held_speed(gap, leader, a, b)
    assert two_stage_speed(gap, leader, a, b) == pytest.approx(expected, abs=2e-3)


@given(gaps, st.floats(0.0, 30.0), st.floats(0.0, 10.0), accelerations, brakes)
def test_two_stage_never_asks_for_less_speed_when_the_leader_runs_faster(
    gap: float, leader: float, more: float, a: float, b: float
) -> None:
    slower = two_stage_speed(gap, leader, a, b)
    assert two_stage_speed(gap, leader + more, a, b) >= slower - 1e-9
    assert slower <= np.sqrt(2.0 * b * gap) * (1.0 + 1e-12)


def test_two_stage_speed_is_zero_where_there_is_no_gap() -> None:
    assert two_stage_speed(-3.0, 0.0, 0.9, 1.0) == 0.0
    assert two_stage_speed(-3.0, 10.0, 0.9, 1.0) == 0.0
