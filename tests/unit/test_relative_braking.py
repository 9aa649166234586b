"""Relative braking: closed forms, whom it refuses, and its stated limit."""

import numpy as np
import pytest

from kankaku.controllers.protection.relative_braking import RelativeBraking, RelativeBrakingOptions
from kankaku.railway.arrays import GRAVITY_MPS2
from kankaku.railway.plan.line import Gradient
from kankaku.testing.example_lines import two_station_scenario, world_of
from tests.states import behind

LEADER_M, LENGTH_M, MARGIN_M = 1000.0, 200.0, 25.0
ASSUMED_KMHPS = 5.4
"""1.5 m/s2; the trains of the examples have 1.3."""


def eoa_m(leader_mps: float, brake_kmhps: float = ASSUMED_KMHPS, gradient: float = 0.0) -> float:
    hills = (Gradient(0.0, 1800.0, gradient),) if gradient else ()
    world = world_of(two_station_scenario(2, gradients=hills))
    protection = RelativeBraking(world, RelativeBrakingOptions(MARGIN_M, brake_kmhps))
    state = behind(world, LEADER_M, 400.0, leader_mps=leader_mps)
    limit = float(protection.authorise(state, ())[0].eoa_m[1])
    foretold = protection.eoa_behind_m(1, 1, 0, np.array([LEADER_M]), np.array([leader_mps]))
    assert foretold[0] == pytest.approx(limit)
    return limit


@pytest.mark.parametrize("leader_mps", [0.0, 1.0, 10.0, 25.0])
def test_on_the_level_the_leaders_braking_distance_is_added(leader_mps: float) -> None:
    wanted_m = LEADER_M - LENGTH_M - MARGIN_M + leader_mps**2 / (2.0 * 1.5)
    assert eoa_m(leader_mps) == pytest.approx(wanted_m, abs=0.011)
    assert eoa_m(leader_mps) <= wanted_m


@pytest.mark.parametrize("gradient", [-0.02, 0.02])
def test_on_a_gradient_gravity_counts(gradient: float) -> None:
    brake_mps2 = 1.5 + GRAVITY_MPS2 * gradient / 1.08
    wanted_m = LEADER_M - LENGTH_M - MARGIN_M + 20.0**2 / (2.0 * brake_mps2)
    assert eoa_m(20.0, gradient=gradient) == pytest.approx(wanted_m, abs=0.05)


def test_a_leader_that_could_stop_shorter_is_refused() -> None:
    """Its emergency brake of 1.3 m/s2 is stronger than 4.5 km/h/s."""
    assert eoa_m(20.0, brake_kmhps=4.5) == pytest.approx(LEADER_M - LENGTH_M - MARGIN_M)
