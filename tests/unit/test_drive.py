"""The drive: how hard it brakes for whom, and what it says bound the speed."""

import numpy as np
import pytest

from kankaku.controllers.drive import TractionDrive
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Bound
from kankaku.railway.step.obstructions import unobstructed
from kankaku.railway.step.state import (
    NOTHING,
    Advice,
    AtOnce,
    Authority,
    Events,
    LineState,
    RadioPermission,
)
from kankaku.testing.example_lines import two_station_scenario, world_of

STEP_S = 0.5
SERVICE, EMERGENCY = 1.0, 1.3
FRONT_M = 600.0


@pytest.fixture
def world() -> World:
    return world_of(two_station_scenario(1))


def drive_once(
    world: World,
    *,
    speed_mps: float,
    eoa_m: float = 3000.0,
    ceiling_mps: float = 30.0,
    advised_mps: float = 30.0,
    stop_m: float = 1300.0,
    front_m: float = FRONT_M,
    emergency: bool | None = None,
) -> tuple[float, int]:
    """Return acceleration and bound; by radio if it says whether there is an emergency."""
    one = np.ones(1, dtype=np.bool_)
    state = LineState(
        time_s=25_300.0,
        front_m=np.array([front_m]),
        tail_m=np.array([front_m - 200.0]),
        speed_mps=np.array([speed_mps]),
        present=one,
        running=one,
        leader=np.array([-1]),
        follows=~one,
        clear_to_m=np.array([eoa_m]),
        granted_to_m=np.array([eoa_m]),
        granted_by=np.array([NOTHING]),
        next_call=np.array([1]),
        stop_m=np.array([stop_m]),
        arrival_s=np.array([25_200.0]),
        events=Events(),
        wayside=unobstructed(1, world.far_m),
        calls_version=0,
        wayside_version=0,
    )
    nothing, train = np.array([NOTHING]), np.array([0])
    permission = AtOnce(1).permission(np.array([eoa_m]))
    bounds = np.array([eoa_m]), np.array([ceiling_mps]), np.zeros(1)
    authority = Authority(*bounds, train, nothing, permission)
    if emergency is not None:
        permission = RadioPermission(np.array([emergency]), np.full(1, np.inf), np.array([eoa_m]))
        authority = authority._replace(permission=permission)
    advice = Advice(np.array([advised_mps]), np.array([0]), nothing)
    drive = TractionDrive(world)
    command = drive.command(state, authority, advice)
    asked = (float(command.speed_mps[0]) - speed_mps) / STEP_S
    return asked, int(command.bound[0])


def test_with_a_free_way_a_train_uses_its_traction(world: World) -> None:
    asked, bound = drive_once(world, speed_mps=5.0)
    # 400 kN less about 8.5 kN of resistance over 432 t.
    resistance_n = 9.80665 * (
        (1.65 + 0.0247 * 18.0) * 160 + (0.78 + 0.0028 * 18.0) * 240 + 0.0982 * 18.0**2
    )
    assert asked == pytest.approx((400e3 - resistance_n) / 432e3, abs=1e-3)
    assert bound == Bound.TRACTION


@pytest.mark.parametrize("advised_mps", [0.0, 10.0, 19.0])
def test_advice_gets_the_service_brake_at_most(world: World, advised_mps: float) -> None:
    asked, bound = drive_once(world, speed_mps=20.0, advised_mps=advised_mps)
    assert asked == pytest.approx(-SERVICE)
    assert bound == Bound.ADVICE


def test_a_ceiling_that_drops_gets_the_service_brake_at_most(world: World) -> None:
    asked, bound = drive_once(world, speed_mps=20.0, ceiling_mps=5.0)
    assert asked == pytest.approx(-SERVICE)
    assert bound == Bound.CEILING


def test_a_stop_too_near_gets_the_service_brake_at_most(world: World) -> None:
    asked, bound = drive_once(world, speed_mps=20.0, stop_m=FRONT_M + 50.0)
    assert asked == pytest.approx(-SERVICE)
    assert bound == Bound.STOP


def test_an_authority_that_can_be_kept_gets_the_service_brake(world: World) -> None:
    asked, bound = drive_once(world, speed_mps=20.0, eoa_m=FRONT_M + 200.0)
    assert asked == pytest.approx(-SERVICE, abs=1e-6)
    assert bound == Bound.LIMIT


@pytest.mark.parametrize("away_m", [-50.0, 0.0, 100.0])
def test_an_authority_that_shrinks_too_far_gets_the_emergency_brake(
    world: World, away_m: float
) -> None:
    asked, bound = drive_once(world, speed_mps=20.0, eoa_m=FRONT_M + away_m)
    assert asked == pytest.approx(-EMERGENCY)
    assert bound == Bound.LIMIT


def test_the_brake_is_no_harder_than_the_authority_needs(world: World) -> None:
    # After one harder step the service brake is enough again.
    for away_m in (190.5, 193.0, 198.0):
        asked, _ = drive_once(world, speed_mps=20.0, eoa_m=FRONT_M + away_m)
        after = 20.0 + asked * STEP_S
        covered_m = 0.5 * (20.0 + after) * STEP_S
        if asked > -EMERGENCY + 1e-9:
            assert covered_m + 0.5 * after**2 / SERVICE == pytest.approx(away_m)
        assert -EMERGENCY - 1e-9 <= asked < -SERVICE


def test_a_standing_train_with_no_authority_stays(world: World) -> None:
    for eoa_m in (FRONT_M, FRONT_M - 30.0):
        asked, bound = drive_once(world, speed_mps=0.0, eoa_m=eoa_m)
        assert asked == 0.0
        assert bound == Bound.LIMIT


def test_a_train_never_runs_backwards(world: World) -> None:
    asked, _ = drive_once(world, speed_mps=0.2, eoa_m=FRONT_M - 100.0)
    assert asked == pytest.approx(-0.4)


@pytest.mark.parametrize("speed_mps", [20.0, 5.0, 0.4, 0.0])
@pytest.mark.parametrize("other", ["nothing", "ceiling", "advice", "stop", "limit"])
def test_an_emergency_is_the_emergency_brake_to_a_stand_whatever_else_bounds(
    world: World, speed_mps: float, other: str
) -> None:
    bounds = {
        "nothing": {},
        "ceiling": {"ceiling_mps": 0.0},
        "advice": {"advised_mps": 0.0},
        "stop": {"stop_m": FRONT_M},
        "limit": {"eoa_m": FRONT_M - 50.0},
    }[other]
    asked, bound = drive_once(world, speed_mps=speed_mps, emergency=True, **bounds)
    assert asked == pytest.approx(-min(EMERGENCY, speed_mps / STEP_S))
    assert bound == Bound.EMERGENCY


@pytest.mark.parametrize("eoa_m", [3000.0, FRONT_M + 200.0, FRONT_M])
def test_a_link_without_an_emergency_changes_nothing(world: World, eoa_m: float) -> None:
    told = drive_once(world, speed_mps=20.0, eoa_m=eoa_m, emergency=False)
    assert told == drive_once(world, speed_mps=20.0, eoa_m=eoa_m)
