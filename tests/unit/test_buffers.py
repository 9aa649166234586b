"""Safety buffers against eqs. (1) to (3) of Sakai 2020, and against brute force."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.buffers import Buffers
from kankaku.railway.plan.profile import NO_BUFFERS
from kankaku.testing.example_lines import straight_line
from tests.property.dense_run import Radio

RATIO, DELAY_S, RESOLUTION_M = 0.001, 0.5, 2.0
"""Of the paper: 0.1 %, 0.5 s and 2 m."""
LENGTH_M = 200.0
PAPER = Buffers(RATIO, DELAY_S, RESOLUTION_M)
GRID_M = np.arange(0.0, 4000.0, 0.1)
QUICK = settings(max_examples=30, deadline=None)

some_buffers = st.builds(
    lambda ratio, delay, resolution, places: Buffers(
        ratio, delay, resolution, (0.0, *sorted(places))
    ),
    st.floats(0.0, 0.02),
    st.floats(0.0, 2.0),
    st.floats(0.0, 10.0),
    st.sets(st.floats(1.0, 3500.0), max_size=6),
)
speeds = st.floats(0.0, 35.0)


def front_buffer_m(buffers: Buffers, front_m: float, speed_mps: float) -> float:
    return float(buffers.front_buffer_m(np.array(front_m), np.array(speed_mps)))


def rear_buffer_m(buffers: Buffers, front_m: float) -> float:
    return float(buffers.rear_buffer_m(np.array(front_m)))


def front_limit_m(buffers: Buffers, place_m: float, speed_mps: float = 0.0) -> float:
    return float(buffers.front_limit_m(np.array(place_m), speed_mps))


def buffered_m(buffers: Buffers, front_m: FloatArray) -> FloatArray:
    """How far the buffer of standing fronts reaches on either side."""
    radio = Radio(buffers.error_ratio, 0.0, 0.0, buffers.balises_m)
    reach_m: FloatArray = radio.drifts_m(front_m) + buffers.resolution_m
    return reach_m


def test_a_train_a_kilometre_past_the_balise_has_the_buffers_of_the_paper() -> None:
    # 0.1 % of 1000 m, 0.5 s at 20 m/s, and 2 m.
    assert front_buffer_m(PAPER, 1000.0, 20.0) == pytest.approx(1.0 + 10.0 + 2.0)
    assert rear_buffer_m(PAPER, 1000.0) == pytest.approx(1.0 + 2.0)


def test_the_limit_of_a_kilometre_and_thirteen_metres_is_seen_by_a_front_at_a_kilometre() -> None:
    assert front_limit_m(PAPER, 1013.0, 20.0) == pytest.approx(1000.0)


@pytest.mark.parametrize("place_m", [40.0, 733.3, 2400.0])
@pytest.mark.parametrize("speed_mps", [0.0, 11.1, 25.0])
def test_with_one_balise_a_limit_starts_where_equation_3_says(
    place_m: float, speed_mps: float
) -> None:
    moved = replace(PAPER, balises_m=(15.0,))
    expected_m = (place_m - (speed_mps * 0.5 + 2.0) + 0.001 * 15.0) / 1.001
    assert front_limit_m(moved, place_m, speed_mps) == pytest.approx(expected_m)


def test_a_balise_takes_the_drift_off_both_buffers() -> None:
    buffers = replace(PAPER, balises_m=(0.0, 800.0))
    assert rear_buffer_m(buffers, 799.0) == pytest.approx(2.799)
    assert rear_buffer_m(buffers, 800.0) == pytest.approx(2.0)
    assert front_buffer_m(buffers, 900.0, 10.0) == pytest.approx(0.1 + 5.0 + 2.0)


def test_a_balise_counts_only_if_it_is_passed_before_the_buffer_reaches_the_place() -> None:
    # Just before the balise the buffer of a standing train reaches to 1000 + 1 + 2 m.
    buffers = replace(PAPER, balises_m=(0.0, 1000.0))
    assert front_limit_m(buffers, 1002.9) == pytest.approx((1002.9 - 2.0) / 1.001)
    assert front_limit_m(buffers, 1002.9) < 1000.0
    assert front_limit_m(buffers, 1003.1) == pytest.approx((1003.1 - 2.0 + 1.0) / 1.001)
    assert front_limit_m(buffers, 1003.1) > 1000.0


def test_a_tail_may_leave_a_place_by_passing_a_balise() -> None:
    # Just before the balise the rear buffer of a 200 m train ends at 1000 - 200 - 1 - 2 m.
    buffers = replace(PAPER, balises_m=(0.0, 1000.0))
    assert buffers.rear_limit_m(796.9, LENGTH_M) == pytest.approx((796.9 + 202.0) / 0.999)
    assert buffers.rear_limit_m(797.5, LENGTH_M) == pytest.approx(1000.0)
    assert buffers.rear_limit_m(798.1, LENGTH_M) == pytest.approx((798.1 + 202.0 - 1.0) / 0.999)


def test_before_the_first_balise_nothing_has_drifted() -> None:
    buffers = replace(PAPER, balises_m=(500.0,))
    assert rear_buffer_m(buffers, 100.0) == pytest.approx(2.0)


@QUICK
@given(some_buffers, st.floats(0.0, 4000.0), speeds)
def test_a_place_reached_by_the_buffer_of_a_front_belongs_to_that_front(
    buffers: Buffers, front_m: float, speed_mps: float
) -> None:
    """Equation (3) undoes equation (1), unless an earlier front has reached there already."""
    place_m = front_m + front_buffer_m(buffers, front_m, speed_mps)
    back_m = front_limit_m(buffers, place_m, speed_mps)
    assert back_m <= front_m + 1e-6
    if len(buffers.balises_m) == 1:
        assert back_m == pytest.approx(front_m, abs=1e-6)


@QUICK
@given(some_buffers, st.floats(100.0, 3900.0), speeds)
def test_the_front_of_a_place_is_the_first_whose_buffer_reaches_it(
    buffers: Buffers, place_m: float, speed_mps: float
) -> None:
    first_m = front_limit_m(buffers, place_m, speed_mps)
    delay_m = speed_mps * buffers.delay_s
    reaches_m = GRID_M + buffered_m(buffers, GRID_M) + delay_m
    assert not np.any(reaches_m[first_m - 1e-6 > GRID_M] >= place_m)
    # A hair before it, because at a balise the buffer shrinks.
    near_m = np.array([first_m - 1e-6])
    assert near_m + buffered_m(buffers, near_m) + delay_m == pytest.approx(place_m, abs=1e-5)


@QUICK
@given(some_buffers, st.floats(0.0, 3500.0), st.floats(60.0, 250.0))
def test_the_tail_of_a_train_has_left_a_place_for_good_from_the_front_given(
    buffers: Buffers, place_m: float, length_m: float
) -> None:
    clear_m = buffers.rear_limit_m(place_m, length_m)
    rears_m = GRID_M - length_m - buffered_m(buffers, GRID_M)
    assert np.all(rears_m[clear_m + 1e-6 < GRID_M] >= place_m)
    assert np.all(rears_m[clear_m - 1e-6 > GRID_M] < place_m)


def test_without_drift_a_limit_ends_a_train_and_its_resolution_behind_its_end() -> None:
    buffers = Buffers(0.0, 0.5, 2.0)
    assert buffers.rear_limit_m(1200.0, LENGTH_M) == pytest.approx(1402.0)


def test_a_train_without_buffers_is_as_long_as_it_is() -> None:
    assert NO_BUFFERS.none
    assert front_buffer_m(NO_BUFFERS, 900.0, 20.0) == 0.0
    assert front_limit_m(NO_BUFFERS, 900.0, 20.0) == 900.0
    assert NO_BUFFERS.rear_limit_m(900.0, LENGTH_M) == 900.0 + LENGTH_M
    for one in (Buffers(error_ratio=0.001), Buffers(delay_s=0.5), Buffers(resolution_m=2.0)):
        assert not one.none


def test_the_start_of_the_line_counts_as_a_balise_and_those_before_it_do_not() -> None:
    line = replace(straight_line({"west": 300.0}, 2000.0), balises_m=(900.0, -50.0, 400.0))
    assert Buffers.on(line, RATIO, DELAY_S, RESOLUTION_M).balises_m == (0.0, 400.0, 900.0)


def test_buffers_of_many_trains_are_those_of_each() -> None:
    buffers = replace(PAPER, balises_m=(0.0, 700.0, 1500.0))
    fronts_m = np.array([[10.0, 700.0], [1499.9, 3000.0]])
    speeds_mps = np.array([[0.0, 10.0], [20.0, 30.0]])
    found_m = buffers.front_buffer_m(fronts_m, speeds_mps)
    expected_m = [[0.01, 5.0], [0.7999 + 10.0, 1.5 + 15.0]]
    assert found_m == pytest.approx(np.array(expected_m) + 2.0)
    assert buffers.last_balise_m(fronts_m).tolist() == [[0.0, 700.0], [700.0, 1500.0]]
