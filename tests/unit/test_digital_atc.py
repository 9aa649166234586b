"""Digital ATC: the pattern against its closed form, and a train that follows it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kankaku.controllers.drive import TractionDrive
from kankaku.controllers.operation.close_up import no_advice
from kankaku.controllers.options import OptionError
from kankaku.controllers.protection.atd import Atd, AtdOptions
from kankaku.controllers.protection.digital_atc import DigitalAtc, DigitalAtcOptions
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.line import Gradient
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import NOTHING
from kankaku.testing.example_lines import two_station_scenario, world_of
from tests.states import behind

STEP_S = 0.1
SERVICE_MPS2 = 1.0
OVERLAP_M = 25.0
DANGER_M, LEADER_M = 1500.0, 1750.0
"""The leader's tail at 1550 m is in the block from 1500 m on."""
STOP_M = DANGER_M - OVERLAP_M


def world_with(**options: Any) -> World:  # noqa: ANN401
    scenario = two_station_scenario(2, spacing_m=2500.0, block_m=250.0, step_s=STEP_S, **options)
    return world_of(scenario)


def approach(world: World, start_mps: float, **options: Any) -> tuple[FloatArray, FloatArray]:  # noqa: ANN401
    """Return places and speeds of a run towards a leader that stands."""
    atc, drive = DigitalAtc(world, DigitalAtcOptions(**options)), TractionDrive(world)
    nothing, memory = no_advice(2), atc.initial()
    front_m, speed_mps, seen = 700.0, start_mps, []
    for _ in range(1200):
        state = behind(world, LEADER_M, front_m, speed_mps)._replace(stop_m=np.full(2, 2500.0))
        authority, memory = atc.authorise(state, memory)
        seen.append((front_m, speed_mps))
        next_mps = float(drive.command(state, authority, nothing).speed_mps[1])
        front_m += 0.5 * (speed_mps + next_mps) * STEP_S
        speed_mps = next_mps
    places_m, speeds_mps = np.array(seen).T
    return places_m, speeds_mps


@pytest.mark.parametrize("share", [0.6, 0.9, 1.0])
@pytest.mark.parametrize("idle_s", [0.0, 2.0])
def test_the_pattern_is_one_curve(share: float, idle_s: float) -> None:
    atc = DigitalAtc(
        world_with(),
        DigitalAtcOptions(pattern_brake_percent=100.0 * share, idle_time_s=idle_s),
    )
    front_m = np.arange(900.0, 1500.0, 3.0)
    pattern = atc.permitted_mps(1, front_m, np.full(front_m.size, STOP_M))
    brake, way_m = share * SERVICE_MPS2, np.maximum(STOP_M - front_m, 0.0)
    # From v the train runs on for the idle time and then brakes: v t + v^2 / 2b is the way.
    wanted = np.sqrt((brake * idle_s) ** 2 + 2.0 * brake * way_m) - brake * idle_s
    assert pattern == pytest.approx(np.minimum(wanted, 110.0 / 3.6), abs=1e-6)


def test_gravity_acts_on_the_whole_pattern_and_the_share_on_the_brake_alone() -> None:
    gradient = -0.02
    world = world_with(gradients=(Gradient(0.0, 3000.0, gradient),))
    atc = DigitalAtc(world, DigitalAtcOptions(pattern_brake_percent=80.0, idle_time_s=0.0))
    found = atc.permitted_mps(1, np.array([1300.0]), np.array([STOP_M]))[0]
    net_mps2 = 0.8 * SERVICE_MPS2 + 9.80665 * gradient * world.train_types[0].gravity_ratio
    assert found == pytest.approx(np.sqrt(2.0 * net_mps2 * (STOP_M - 1300.0)), rel=1e-4)


def test_the_safety_factor_of_a_train_counts_where_it_is_stricter_than_the_pattern() -> None:
    scenario = two_station_scenario(2, spacing_m=2500.0, block_m=250.0)
    types = {name: replace(kind, safety_factor=2.0) for name, kind in scenario.train_types.items()}
    atc = DigitalAtc(
        world_of(replace(scenario, train_types=types)),
        DigitalAtcOptions(pattern_brake_percent=80.0, idle_time_s=0.0),
    )
    found = atc.permitted_mps(1, np.array([1300.0]), np.array([STOP_M]))[0]
    assert found == pytest.approx(np.sqrt(2.0 * SERVICE_MPS2 * (STOP_M - 1300.0) / 2.0), rel=1e-4)


def test_the_stop_point_is_the_occupied_circuit_less_the_overlap() -> None:
    world = world_with()
    atc = DigitalAtc(world, DigitalAtcOptions())
    authority, _ = atc.authorise(behind(world, LEADER_M, 700.0, 10.0), atc.initial())
    assert authority.eoa_m[1] == pytest.approx(STOP_M)
    assert authority.eoa_by.tolist() == [NOTHING, 0]
    assert atc.eoa_behind_m(1, 1, 0, np.array([LEADER_M]), np.zeros(1)) == pytest.approx(STOP_M)


def test_a_pattern_binds_only_where_it_is_lower_than_the_line() -> None:
    world = world_with()
    atc = DigitalAtc(world, DigitalAtcOptions())
    far, near = (
        atc.authorise(behind(world, LEADER_M, front_m, 20.0), atc.initial())[0]
        for front_m in (300.0, 1300.0)
    )
    assert far.ceiling_by[1] == NOTHING
    assert near.ceiling_by[1] == 0
    assert near.ceiling_mps[1] < far.ceiling_mps[1]


@pytest.mark.parametrize("share", [0.7, 0.9])
@pytest.mark.parametrize("start_mps", [8.0, 15.0, 25.0, 30.0])
def test_a_train_follows_the_pattern_and_stops_at_the_overlap(
    start_mps: float, share: float
) -> None:
    world = world_with()
    front_m, speed_mps = approach(world, start_mps, pattern_brake_percent=100.0 * share)
    slows = -np.diff(speed_mps) / STEP_S
    assert slows.max() <= share * SERVICE_MPS2 + 1e-6
    braking = np.flatnonzero(slows > 1e-9)
    assert (np.diff(braking) == 1).all(), "it brakes in one go"
    atc = DigitalAtc(world, DigitalAtcOptions(pattern_brake_percent=100.0 * share))
    pattern = atc.permitted_mps(1, front_m, np.full(front_m.size, STOP_M))
    assert (speed_mps <= pattern + 1e-6).all()
    assert speed_mps[braking[10:]] == pytest.approx(pattern[braking[10:]], abs=1e-3)
    assert STOP_M - 0.1 < front_m[-1] <= STOP_M


def test_a_train_above_the_pattern_has_the_service_brake_at_once() -> None:
    front_m, speed_mps = approach(world_with(), 30.0)
    atc, drive = DigitalAtc(world_with(), DigitalAtcOptions()), TractionDrive(world_with())
    state = behind(world_with(), LEADER_M, 1000.0, 30.0)._replace(stop_m=np.full(2, 2500.0))
    authority, _ = atc.authorise(state, atc.initial())
    next_mps = float(drive.command(state, authority, no_advice(2)).speed_mps[1])
    assert next_mps == pytest.approx(30.0 - SERVICE_MPS2 * STEP_S, abs=1e-6)
    assert np.interp(1000.0, front_m, speed_mps) < 30.0


def test_it_permits_more_than_a_staircase_of_the_same_brake() -> None:
    world = world_with()
    front_m = np.arange(900.0, 1470.0, 7.0)
    eoa_m = np.full(front_m.size, STOP_M)
    digital = DigitalAtc(world, DigitalAtcOptions()).permitted_mps(1, front_m, eoa_m)
    stairs = Atd(world, AtdOptions(idle_time_s=2.0)).permitted_mps(1, front_m, eoa_m)
    assert (digital >= stairs).all()
    # No more than a step of 20 m further on.
    ahead = DigitalAtc(world, DigitalAtcOptions()).permitted_mps(1, front_m + 20.0, eoa_m)
    assert (ahead <= stairs + 1e-9).all()


@pytest.mark.parametrize(
    "options",
    [{"pattern_brake_percent": 5.0}, {"idle_time_s": -1.0}, {"overlap_m": 2000.0}],
)
def test_options_out_of_range_are_refused(options: dict[str, float]) -> None:
    with pytest.raises(OptionError, match=next(iter(options))):
        DigitalAtcOptions(**options)
