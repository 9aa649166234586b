"""The brake that builds up: against an integration of its own, from any acceleration."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from kankaku.controllers.manner import fading_mps
from kankaku.railway.motion.kinematics import next_speed_mps, rising_speed_mps

FINE_S = 1e-3
STANDING_MPS = 1e-9
"""Less than rounding lets a train gain or lose. [m/s]"""
STEPS_S = st.sampled_from([0.05, 0.1, 0.2, 0.5])
BRAKES_MPS2 = st.floats(0.4, 1.5)
JERKS_MPS3 = st.floats(0.2, 3.0)
SEVERAL = settings(max_examples=60, deadline=None)


def ramped_m(speed_mps: float, gain_mps2: float, brake_mps2: float, jerk_mps3: float) -> float:
    """Way to a stand, the acceleration falling evenly to the whole brake, in milliseconds."""
    way_m = 0.0
    while speed_mps > 0.0:
        gain_mps2 = max(gain_mps2 - jerk_mps3 * FINE_S, -brake_mps2)
        after = max(speed_mps + gain_mps2 * FINE_S, 0.0)
        way_m += 0.5 * (speed_mps + after) * FINE_S
        speed_mps = after
    return way_m


def stopped_at_m(  # noqa: PLR0917 - one argument per figure of the train
    speed_mps: float,
    gained_mps: float,
    brake_mps2: float,
    jerk_mps3: float,
    step_s: float,
    way_m: float,
    pull_mps2: float = 1.0,
) -> tuple[float, float]:
    """Where a train stands that speeds up until the formula stops it, and its hardest jerk."""
    loss, rise = brake_mps2 * step_s, jerk_mps3 * step_s**2
    front_m, hardest = 0.0, 0.0
    while speed_mps > STANDING_MPS or front_m == 0.0:
        room = 2.0 * brake_mps2 * (way_m - front_m)
        wish = float(rising_speed_mps(speed_mps, room, (loss, 0.0), rise))
        wish = min(wish, speed_mps + min(gained_mps + rise, pull_mps2 * step_s))
        least = max(speed_mps + max(gained_mps - rise, -loss), 0.0)
        after = max(wish, least)
        front_m += 0.5 * (speed_mps + after) * step_s
        if after > 0.0:
            hardest = max(hardest, abs(after - speed_mps - gained_mps) / step_s**2)
        gained_mps, speed_mps = after - speed_mps, after
        if after == 0.0:
            break
    return front_m, hardest


@SEVERAL
@given(st.floats(0.5, 35.0), BRAKES_MPS2, STEPS_S, st.floats(0.0, 700.0), st.floats(0.0, 2.0))
def test_a_brake_that_is_whole_at_once_has_the_formula_of_one(
    speed_mps: float, brake_mps2: float, step_s: float, way_m: float, lag_s: float
) -> None:
    room, loss, lag = 2.0 * brake_mps2 * way_m, brake_mps2 * step_s, brake_mps2 * lag_s
    whole = float(next_speed_mps(speed_mps, room, loss, lag))
    assert rising_speed_mps(speed_mps, room, (loss, lag), np.inf) == whole
    slow = rising_speed_mps(speed_mps, room, (loss, lag), 0.3 * step_s**2)
    assert slow <= whole


@SEVERAL
@given(st.floats(0.5, 35.0), BRAKES_MPS2, JERKS_MPS3, STEPS_S, st.floats(0.0, 2.0))
@example(14.5, 1.2, 0.3969, 0.1, 1.3)
@example(0.11, 0.51, 2.67, 0.5, 0.5)
def test_the_speed_solves_its_equation_to_the_end(
    speed_mps: float, brake_mps2: float, jerk_mps3: float, step_s: float, share: float
) -> None:
    """Eight of Newton's steps were too few where a brake rises slowly: trains ran 20 m too far."""
    loss, rise = brake_mps2 * step_s, jerk_mps3 * step_s**2
    room = share * speed_mps**2
    after = float(rising_speed_mps(speed_mps, room, (loss, 0.0), rise))
    more = loss + after - speed_mps
    needed = after**2 + loss * (speed_mps + after) + more**2 / rise * after
    needed += more**3 * max(0.75 * more - loss, 0.0) / (3.0 * rise**2)
    assert after >= 0.0
    if after > max(speed_mps - loss, 0.0) + 1e-9:
        assert needed == pytest.approx(room, rel=1e-5, abs=1e-5)
    else:
        assert needed >= room - 1e-9


@SEVERAL
@given(
    st.floats(3.0, 35.0),
    st.floats(-0.3, 1.0),
    BRAKES_MPS2,
    JERKS_MPS3,
    st.sampled_from([0.05, 0.1]),
)
def test_the_room_that_it_needs_is_what_an_integration_needs(
    speed_mps: float, gain_mps2: float, brake_mps2: float, jerk_mps3: float, step_s: float
) -> None:
    """Of the speed that it permits after a step, brake and build-up take all the room."""
    gain_mps2 = max(gain_mps2, -0.9 * brake_mps2)
    loss, rise = brake_mps2 * step_s, jerk_mps3 * step_s**2
    after = speed_mps + gain_mps2 * step_s
    builds_s = (brake_mps2 + gain_mps2) / jerk_mps3
    # Otherwise it stands before the brake is whole.
    if after + 0.5 * (gain_mps2 - brake_mps2) * builds_s <= 0.5:
        return
    rest_m = ramped_m(after, gain_mps2, brake_mps2, jerk_mps3)
    way_m = 0.5 * (speed_mps + after) * step_s + rest_m
    permitted = float(rising_speed_mps(speed_mps, 2.0 * brake_mps2 * way_m, (loss, 0.0), rise))
    # What does not grow with the speed is left out where it would only lengthen the run.
    spared_m = brake_mps2 * builds_s**2 / 20.0
    assert permitted <= after + 1e-3
    shorter_m = 2.0 * brake_mps2 * (way_m + spared_m)
    assert rising_speed_mps(speed_mps, shorter_m, (loss, 0.0), rise) >= after - 1e-3


@SEVERAL
@given(
    st.floats(0.5, 35.0),
    st.floats(-0.5, 1.0),
    BRAKES_MPS2,
    JERKS_MPS3,
    STEPS_S,
    st.floats(1.05, 2.0),
)
def test_a_train_that_speeds_up_until_it_has_to_brake_stops_at_the_place(
    speed_mps: float,
    gain_mps2: float,
    brake_mps2: float,
    jerk_mps3: float,
    step_s: float,
    share: float,
) -> None:
    gain_mps2 = max(gain_mps2, -brake_mps2)
    # Room enough at the start, the step that is not decided any more included.
    way_m = share * (ramped_m(speed_mps, gain_mps2, brake_mps2, jerk_mps3) + speed_mps * step_s)
    way_m += 2.0
    front_m, hardest = stopped_at_m(
        speed_mps, gain_mps2 * step_s, brake_mps2, jerk_mps3, step_s, way_m
    )
    rounding_m = brake_mps2 * step_s**2 / 8.0
    assert front_m <= way_m + rounding_m + 0.05
    assert front_m >= way_m - 0.3
    assert hardest <= jerk_mps3 * (1.0 + 1e-6)


def faded_mps(gain: float, jerk: float, rise: float, downhill: float) -> float:
    """What a gain adds up to, written down step by step."""
    total = 0.0
    while gain > 0.0:
        total += gain
        gain = max(gain - jerk, min(gain, downhill) - rise)
    return total


@SEVERAL
@given(
    st.floats(0.0, 5.0),
    st.floats(0.002, 0.6) | st.just(math.inf),
    st.floats(0.002, 0.6),
    st.floats(-0.2, 0.2),
)
@example(0.3, 0.0732, 0.0243, 0.052)
def test_a_gain_fades_within_what_is_left(
    left: float, jerk: float, rise: float, downhill: float
) -> None:
    rise = min(jerk, rise)
    gain = float(fading_mps(left, jerk, rise, downhill))
    total = faded_mps(gain, jerk, rise, downhill)
    assert total <= left + 1e-9
    # Nothing is given away but the step in which the brake begins to rise.
    spare = max(downhill, 0.0) + 1e-6
    assert faded_mps(gain + spare, jerk, rise, downhill) >= left - 1e-9
