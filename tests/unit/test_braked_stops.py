"""Where a brake brings trains to a stand, exactly and nearly so."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.railway.plan.brake_table import BrakeTable, braked_stop_m, nearly_braked_stop_m
from kankaku.testing.example_lines import two_station_scenario, world_of
from tests.examples import examples

LEVEL = world_of(two_station_scenario(1)).braking
SERVICE_MPS2 = float(LEVEL.service_mps2[0])


def hilly(levels: list[float]) -> BrakeTable:
    """Return the table of a line whose brakes hold better or worse from metre to metre."""
    steps = 2.0 * SERVICE_MPS2 * np.resize(levels, LEVEL.braking_v2_m2ps2.size)
    return LEVEL._replace(braking_v2_m2ps2=np.concatenate([[0.0], np.cumsum(steps)[:-1]]))


@pytest.mark.parametrize("speed_mps", [0.0, 0.3, 5.0, 20.0])
def test_on_the_level_it_is_the_textbooks_distance(speed_mps: float) -> None:
    expected_m = 700.25 + speed_mps**2 / (2.0 * SERVICE_MPS2)
    assert braked_stop_m(LEVEL, 0, 700.25, speed_mps) == pytest.approx(expected_m, abs=1e-6)
    assert nearly_braked_stop_m(LEVEL, 0, 700.25, speed_mps) == pytest.approx(expected_m, abs=1e-6)


@examples(200)
@given(
    st.lists(st.floats(0.9, 1.1), min_size=3, max_size=40),
    st.floats(50.0, 1500.0),
    st.floats(0.0, 25.0),
)
def test_both_ways_find_the_place_where_nothing_is_left(
    levels: list[float], front_m: float, speed_mps: float
) -> None:
    braking = hilly(levels)
    exact_m = braked_stop_m(braking, 0, front_m, speed_mps)
    assert nearly_braked_stop_m(braking, 0, front_m, speed_mps) == pytest.approx(exact_m, abs=0.01)
    grid_m = np.arange(braking.braking_v2_m2ps2.size) - braking.row_start[0]
    start, end = np.interp([front_m, exact_m], grid_m, braking.braking_v2_m2ps2)
    assert end - start == pytest.approx(speed_mps**2, abs=1e-3)
