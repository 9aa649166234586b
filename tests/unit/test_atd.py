"""ATD: patterns against closed forms, one smooth brake application, and the emergency pattern."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from kankaku.controllers.drive import TractionDrive
from kankaku.controllers.operation.close_up import no_advice
from kankaku.controllers.options import OptionError
from kankaku.controllers.protection.atd import Atd, AtdOptions
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.world import World
from kankaku.testing.example_lines import two_station_scenario, world_of
from tests.states import behind

STEP_S = 0.1
SERVICE_MPS2, EMERGENCY_MPS2 = 1.0, 1.3
OVERLAP_M, STEP_M = 25.0, 20.0
DANGER_M, LEADER_M = 1500.0, 1750.0
"""The leader's tail at 1550 m is in the block from 1500 m on."""
STOP_M = DANGER_M - OVERLAP_M


def world_with(step_s: float = STEP_S) -> World:
    scenario = two_station_scenario(2, spacing_m=2500.0, block_m=250.0, step_s=step_s)
    return world_of(scenario)


@dataclass
class Approach:
    """How the follower came to its stop; arrays over steps."""

    front_m: FloatArray
    speed_mps: FloatArray
    tripped: list[bool]

    @property
    def deceleration_mps2(self) -> FloatArray:
        return -np.diff(self.speed_mps) / STEP_S

    @property
    def jerk_mps3(self) -> float:
        """Root mean square of the change of acceleration over half a second."""
        change = self.deceleration_mps2[5:] - self.deceleration_mps2[:-5]
        return float(np.sqrt(np.mean(np.square(change / (5.0 * STEP_S)))))


def approach(start_mps: float, fails_at_m: float = np.inf, **options: Any) -> Approach:  # noqa: ANN401
    """Run towards a leader that stands; the service brake may fail from some place on."""
    world = world_with()
    atd, drive = Atd(world, AtdOptions(**options)), TractionDrive(world)
    nothing = no_advice(2)
    memory, front_m, speed_mps = atd.initial(), 700.0, start_mps
    seen = Approach(np.zeros(0), np.zeros(0), [])
    for _ in range(900):
        state = behind(world, LEADER_M, front_m, speed_mps)._replace(stop_m=np.full(2, 2500.0))
        authority, memory = atd.authorise(state, memory)
        seen.front_m = np.append(seen.front_m, front_m)
        seen.speed_mps = np.append(seen.speed_mps, speed_mps)
        seen.tripped.append(bool(memory.tripped[1]))
        next_mps = float(drive.command(state, authority, nothing).speed_mps[1])
        if front_m >= fails_at_m and not memory.tripped[1]:
            next_mps = max(next_mps, speed_mps)
        front_m += 0.5 * (speed_mps + next_mps) * STEP_S
        speed_mps = next_mps
    return seen


@pytest.mark.parametrize("share", [0.6, 0.9])
@pytest.mark.parametrize("idle_s", [0.0, 2.0])
def test_the_control_pattern_is_a_staircase_below_its_curve(share: float, idle_s: float) -> None:
    world = world_with()
    atd = Atd(world, AtdOptions(control_brake_percent=100.0 * share, idle_time_s=idle_s))
    front_m = np.arange(900.0, 1500.0, 3.0)
    pattern = atd.permitted_mps(1, front_m, np.full(front_m.size, STOP_M))
    step_end_m = (np.floor(front_m / STEP_M) + 1.0) * STEP_M
    way_m = np.maximum(STOP_M - step_end_m, 0.0)
    brake = share * SERVICE_MPS2
    wanted = np.sqrt((brake * idle_s) ** 2 + 2.0 * brake * way_m) - brake * idle_s
    assert pattern == pytest.approx(np.minimum(wanted, 110.0 / 3.6), abs=1e-6)


def test_the_limit_is_the_occupied_circuit_less_the_overlap() -> None:
    world = world_with()
    atd = Atd(world, AtdOptions())
    authority, _ = atd.authorise(behind(world, LEADER_M, 700.0, 10.0), atd.initial())
    assert authority.eoa_m[1] == pytest.approx(STOP_M)
    assert atd.eoa_behind_m(1, 1, 0, np.array([LEADER_M]), np.zeros(1)) == pytest.approx(STOP_M)


@pytest.mark.parametrize("start_kmh", [30.0, 60.0, 90.0, 110.0])
def test_a_train_brakes_once_and_stops_short_of_the_overlap(start_kmh: float) -> None:
    seen = approach(start_kmh / 3.6)
    assert seen.speed_mps[-1] == 0.0
    assert STOP_M - 1.5 * STEP_M < seen.front_m[-1] <= STOP_M + 0.05
    assert not any(seen.tripped)
    braking = np.flatnonzero(seen.deceleration_mps2 > 0.05)
    released = np.diff(braking) > 1
    assert np.count_nonzero(released) <= 1, "it brakes in one go, but perhaps for the last metres"
    assert seen.deceleration_mps2.max() <= SERVICE_MPS2 + 1e-6


def test_the_fuzzy_controller_is_smoother_than_obeying_every_step_at_once() -> None:
    smooth = approach(25.0)
    # All rules at their strongest: full brake above the pattern, none below.
    abrupt = approach(
        25.0,
        lack_kmhps=(-0.01, 0.01),
        need_kmhps=(0.0, 3.0),
        change_kmhps2=(-99.0,) * 2 + (99.0,) * 2,
    )
    assert smooth.jerk_mps3 < 0.5 * abrupt.jerk_mps3


@pytest.mark.parametrize("start_mps", [3.0, 8.0, 15.0, 25.0, 30.0])
@pytest.mark.parametrize("fails_at_m", [700.0, 1200.0, 1400.0, 1450.0])
def test_where_the_service_brake_fails_the_emergency_pattern_stops_the_train(
    start_mps: float, fails_at_m: float
) -> None:
    seen = approach(start_mps, fails_at_m, emergency_idle_time_s=1.0)
    first = seen.tripped.index(True)
    speed_mps = seen.speed_mps[first]
    # With the idle time it would still stop before the occupied circuit, and not far before.
    needs_m = speed_mps * 1.0 + speed_mps**2 / (2.0 * EMERGENCY_MPS2)
    within_a_step_m = speed_mps * STEP_S
    assert seen.front_m[first] + needs_m <= DANGER_M + within_a_step_m
    assert seen.front_m[first] + needs_m >= DANGER_M - STEP_M - 2.0 * within_a_step_m
    stands = int(np.flatnonzero(seen.speed_mps[first:] <= 0.0)[0]) + first
    assert all(seen.tripped[first:stands])
    braking = seen.deceleration_mps2[first : stands - 1]
    assert braking == pytest.approx(EMERGENCY_MPS2, abs=0.01)
    assert seen.front_m[stands] < DANGER_M
    assert not seen.tripped[stands]


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"step_m": 30.0}, "step_m"),
        ({"step_m": 0.0}, "step_m"),
        ({"control_brake_percent": 110.0}, "control_brake_percent"),
        ({"need_kmhps": (1.0, 1.0, 3.0)}, "need_kmhps"),
        ({"lack_kmhps": (1.0,)}, "lack_kmhps"),
        ({"change_kmhps2": (1.0, 2.0)}, "change_kmhps2 has 2 rules"),
        ({"idle_time_s": -1.0}, "idle_time_s"),
    ],
)
def test_options_that_make_no_sense_are_refused(options: dict[str, Any], key: str) -> None:
    with pytest.raises(OptionError, match=key):
        AtdOptions(**options)
