"""Lineside signals: who acts on them before they are passed, and the overlap beyond them."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kankaku.controllers.options import OptionError
from kankaku.controllers.protection.multi_step_atc import MultiStepAtc, MultiStepAtcOptions, Shown
from kankaku.controllers.registry import build
from kankaku.railway.capacity.blocking_time import (
    blocking_times_s,
    needed_eoa_m,
    technical_headways,
)
from kankaku.railway.motion.journey import technical_journey
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import NOTHING
from kankaku.testing.example_lines import two_station_scenario, world_of
from tests.property.runs import run
from tests.states import behind

STEP_S = 0.5
SIGHTING_S = 6.0
LEADER_M = 1450.0
"""Its tail is in the block from 1200 m on: one before that shows 0, the one at 800 m a code."""


def world_with(overlap_beyond_m: float = 0.0, spacing_m: float = 1000.0) -> World:
    scenario = two_station_scenario(2, spacing_m=spacing_m, block_m=200.0, step_s=STEP_S)
    blocks = scenario.line.blocks
    joints_m = [min(block.start_m + overlap_beyond_m, block.end_m) for block in blocks]
    circuits = [
        piece
        for block, joint_m in zip(blocks, joints_m, strict=True)
        for piece in (
            replace(block, id=f"{block.id}-overlap", end_m=joint_m),
            replace(block, id=f"{block.id}-rest", start_m=joint_m),
        )
        if piece.end_m > piece.start_m
    ]
    return world_of(replace(scenario, line=replace(scenario.line, circuits=tuple(circuits))))


class Train:
    """The second of two trains, taken by the hand step by step."""

    def __init__(self, **options: Any) -> None:  # noqa: ANN401
        self.world = world_with()
        self.atc = MultiStepAtc(self.world, MultiStepAtcOptions(**options))
        self.memory: Shown = self.atc.initial()
        self.time_s = 25_300.0
        self.by = NOTHING

    def at(self, front_m: float, speed_mps: float, leader_m: float = LEADER_M) -> float:
        """Return the ceiling. [m/s]"""
        state = behind(self.world, leader_m, front_m, speed_mps, time_s=self.time_s)
        authority, self.memory = self.atc.authorise(state, self.memory)
        self.time_s += STEP_S
        self.by = int(authority.ceiling_by[1])
        return float(authority.ceiling_mps[1])


def test_a_driver_brakes_evenly_for_a_signal_from_its_sighting_on() -> None:
    train = Train(sighting_time_s=SIGHTING_S, idle_time_s=0.0)
    speed_mps, code_mps = 20.0, 65.0 / 3.6
    assert train.atc.code_mps[0, 0, :3] * 3.6 == pytest.approx([0.0, 65.0, 90.0])
    # The signal at 800 m shows 65 km/h. Six seconds before it is 120 m before it.
    assert train.at(679.0, speed_mps) > speed_mps
    assert train.by == NOTHING
    # At the code where its block ends, at 1000 m.
    brake_mps2 = (speed_mps**2 - code_mps**2) / (2.0 * (1000.0 - 681.0))
    assert train.at(681.0, speed_mps) == pytest.approx(speed_mps - brake_mps2 * STEP_S)
    assert train.by == 0
    # Slower than the code he has nothing to do before the signal.
    assert train.at(750.0, code_mps - 1.0) > speed_mps


def test_a_cab_signal_says_nothing_before_its_block() -> None:
    train = Train(idle_time_s=0.0)
    assert train.at(799.0, 20.0) > 20.0
    assert train.by == NOTHING


def test_he_acts_after_the_idle_time_and_does_not_react_again_at_the_signal() -> None:
    train = Train(sighting_time_s=SIGHTING_S, idle_time_s=2.0)
    ceilings = [train.at(720.0 + 8.5 * step, 17.0) for step in range(6)]
    assert [ceiling > 17.0 for ceiling in ceilings] == [True] * 4 + [False] * 2
    # In its block the code itself counts, at once.
    assert train.at(801.0, 16.0) == pytest.approx(train.atc.code_mps[0, 0, 1] - 3.0 / 3.6)


def test_a_signal_that_clears_in_time_lets_him_go_on_at_once() -> None:
    train = Train(sighting_time_s=SIGHTING_S, idle_time_s=0.0)
    assert train.at(700.0, 20.0) < 20.0
    assert train.at(710.0, 20.0, leader_m=2300.0) > 20.0


def test_a_block_is_occupied_until_the_overlap_beyond_it_is_free() -> None:
    world = world_with(60.0)
    atc = MultiStepAtc(world, MultiStepAtcOptions(overlap_beyond_m=60.0, overlap_m=0.0))
    # The tail is 250 m behind the front; the signal stands at 1000 m.
    tails_m = np.array([990.0, 1001.0, 1059.0, 1060.0, 1199.0])
    length_m = world.length_m[0]
    eoas_m = atc.eoa_behind_m(1, 1, 0, tails_m + length_m, np.zeros(tails_m.size))
    assert eoas_m == pytest.approx([800.0, 800.0, 800.0, 1000.0, 1000.0])
    for tail_m, eoa_m in zip(tails_m.tolist(), eoas_m.tolist(), strict=True):
        authority, _ = atc.authorise(behind(world, tail_m + length_m, 300.0, 10.0), atc.initial())
        assert authority.eoa_m[1] == pytest.approx(eoa_m)


def test_capacity_counts_the_sighting_before_and_the_overlap_behind_a_block() -> None:
    # Blocks of 200 m at 15 m/s, far from the stops: cab signals keep one from its code to its end.
    found_s = {}
    for sighting_s, beyond_m in ((0.0, 0.0), (SIGHTING_S, 0.0), (0.0, 60.0), (SIGHTING_S, 60.0)):
        world = world_with(beyond_m, spacing_m=2500.0)
        atc = MultiStepAtc(
            world,
            MultiStepAtcOptions(
                codes_kmh=(54.0, 0.0),
                idle_time_s=0.0,
                sighting_time_s=sighting_s,
                overlap_beyond_m=beyond_m,
            ),
        )
        profile = replace(
            world.profile, permitted_m2ps2=np.minimum(world.profile.ceiling_m2ps2, 112.5)
        )
        journey = technical_journey(world, profile, 0)
        edges_m = np.array([1400.0, 1600.0])
        begin_s, end_s = blocking_times_s(world, atc, journey, edges_m)
        found_s[sighting_s, beyond_m] = float(end_s[0] - begin_s[0])
        headway_s = technical_headways(world, atc, journey)[0].headway_s
        assert headway_s >= found_s[sighting_s, beyond_m] - 0.06
        needed_m = needed_eoa_m(world, atc, journey, np.array([journey.time_s[0]]))
        assert needed_m[0] == -np.inf, "who stands looks at nothing"
    plain_s = found_s[0.0, 0.0]
    assert found_s[SIGHTING_S, 0.0] - plain_s == pytest.approx(SIGHTING_S, abs=0.06)
    assert found_s[0.0, 60.0] - plain_s == pytest.approx(60.0 / 15.0, abs=0.06)
    both_s = SIGHTING_S + 60.0 / 15.0
    assert found_s[SIGHTING_S, 60.0] - plain_s == pytest.approx(both_s, abs=0.06)


@pytest.mark.parametrize("sighting_s", [0.0, 5.0, 10.0])
def test_trains_behind_lineside_signals_arrive_without_a_violation(sighting_s: float) -> None:
    scenario = two_station_scenario(3, 90.0, block_m=250.0, step_s=0.1)
    delay_s = np.zeros((3, 2))
    delay_s[:2, 1] = 60.0, 30.0
    spec = ControllerSpec("x", "multi_step_atc", "close_up", {"sighting_time_s": sighting_s}, {})
    record, _ = run(scenario, controller=build(spec, world_of(scenario)), delay_s=delay_s)
    assert record.completed.all()
    assert record.violations == ()


@pytest.mark.parametrize("options", [{"sighting_time_s": -1.0}, {"overlap_beyond_m": 1001.0}])
def test_options_out_of_range_are_refused(options: dict[str, Any]) -> None:
    with pytest.raises(OptionError, match=next(iter(options))):
        MultiStepAtcOptions(**options)
