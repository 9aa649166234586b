"""Multi-step ATC: the code table against hand calculation, and what a train does with a code."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kankaku.controllers.options import OptionError
from kankaku.controllers.protection.multi_step_atc import MultiStepAtc, MultiStepAtcOptions, Shown
from kankaku.controllers.registry import ControllerError, build
from kankaku.railway.plan.line import Gradient, SpeedLimit
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.railway.plan.world import World
from kankaku.testing.example_lines import blocks_every, two_station_scenario, world_of
from kankaku.testing.loop_station import loop_station_scenario
from tests.states import behind

STEP_S = 0.5
BRAKE_MPS2 = 1.0
CODES_KMH = (90.0, 75.0, 65.0, 45.0, 25.0, 0.0)
LEVEL_END_M = 1800.0


def world_with(block_m: float = 200.0, **options: Any) -> World:  # noqa: ANN401
    return world_of(two_station_scenario(2, block_m=block_m, step_s=STEP_S, **options))


def atc_on(world: World, **options: Any) -> MultiStepAtc:  # noqa: ANN401
    return MultiStepAtc(world, MultiStepAtcOptions(**options))


def highest_kmh(block_m: float, next_kmh: float, idle_s: float, overlap_m: float) -> float:
    """The highest code from which a level block brakes a train in time."""
    way_m = block_m - (overlap_m if next_kmh == 0.0 else 0.0)
    # The boundary is seen a step late; an idle time ends within another one.
    late_s = STEP_S * (2.0 if idle_s else 1.0)
    for code_kmh in CODES_KMH:
        code, below = code_kmh / 3.6, next_kmh / 3.6
        braking_m = (code**2 - below**2) / (2.0 * BRAKE_MPS2)
        if code <= below or code * (idle_s + late_s) + braking_m <= way_m:
            return code_kmh
    raise AssertionError


@pytest.mark.parametrize("block_m", [120.0, 180.0, 200.0, 300.0, 450.0])
@pytest.mark.parametrize("idle_s", [0.0, 2.0])
def test_the_code_table_of_a_level_line_is_that_of_the_hand_calculation(
    block_m: float, idle_s: float
) -> None:
    table = atc_on(world_with(block_m), idle_time_s=idle_s).code_mps[0]
    wanted_kmh = [0.0]
    while len(wanted_kmh) < table.shape[1]:
        wanted_kmh.append(highest_kmh(block_m, wanted_kmh[-1], idle_s, 25.0))
    # The first block: its successors are all of the same length.
    assert table[0] * 3.6 == pytest.approx(wanted_kmh[: table.shape[1]])


@settings(max_examples=50, deadline=None)
@given(
    st.floats(150.0, 500.0),
    st.floats(0.0, 4.0),
    st.floats(-0.03, 0.03),
    st.lists(st.floats(5.0, 110.0), min_size=1, max_size=6, unique=True),
)
def test_more_free_blocks_never_show_less_and_only_codes_are_shown(
    block_m: float, idle_s: float, gradient: float, codes_kmh: list[float]
) -> None:
    codes = (*sorted(codes_kmh, reverse=True), 0.0)
    world = world_with(block_m, gradients=(Gradient(0.0, LEVEL_END_M, gradient),))
    try:
        table = atc_on(world, codes_kmh=codes, idle_time_s=idle_s).code_mps
    except OptionError:
        return
    assert np.all(np.diff(table, axis=2) >= 0.0)
    assert np.all(table[:, :, 0] == 0.0)
    assert set(np.round(table.ravel() * 3.6, 6)) <= set(np.round(codes, 6))


def test_downhill_shows_less_and_uphill_more() -> None:
    tables = [
        atc_on(world_with(210.0, gradients=(Gradient(0.0, LEVEL_END_M, gradient),))).code_mps[
            0, 0, 1
        ]
        for gradient in (-0.06, 0.0, 0.06)
    ]
    assert tables[0] < tables[1] < tables[2]


def test_where_the_line_is_slow_the_next_block_may_be_short() -> None:
    """A code counts as what the line allows at most."""
    slow = (SpeedLimit(0.0, LEVEL_END_M, 25.0 / 3.6),)
    table = atc_on(world_with(100.0, limits=slow)).code_mps[0]
    assert table[0, 1] * 3.6 == pytest.approx(90.0)


def test_a_layout_that_a_train_would_overrun_is_refused_with_the_block() -> None:
    world = world_with(40.0)
    spec = ControllerSpec("atc", "multi_step_atc", "close_up", {}, {})
    with pytest.raises(ControllerError, match=r"block 'main-2' of blocks\.csv") as caught:
        build(spec, world)
    assert caught.value.where == "controllers.atc.protection"
    assert "overrun its 40 m" in caught.value.problem


def test_a_line_without_blocks_is_refused() -> None:
    world = world_of(two_station_scenario(2))
    for protection in ("multi_step_atc", "atd", "digital_atc"):
        spec = ControllerSpec("x", protection, "close_up", {}, {})
        with pytest.raises(ControllerError, match="the line has no blocks"):
            build(spec, world)


@pytest.mark.parametrize(
    "codes_kmh",
    [(0.0,), (25.0, 45.0, 0.0), (45.0, 45.0, 0.0), (45.0, 25.0), (500.0, 0.0)],
)
def test_codes_that_do_not_fall_to_0_are_refused(codes_kmh: tuple[float, ...]) -> None:
    with pytest.raises(OptionError, match="codes_kmh"):
        MultiStepAtcOptions(codes_kmh=codes_kmh)


class Train:
    """The second of two trains on blocks of 200 m, taken by the hand step by step."""

    def __init__(self, leader_m: float, **options: Any) -> None:  # noqa: ANN401
        self.world = world_with(200.0)
        self.atc = atc_on(self.world, **options)
        self.memory: Shown = self.atc.initial()
        self.time_s = 25_300.0
        self.leader_m = leader_m

    def at(self, front_m: float, speed_kmh: float) -> tuple[float, float]:
        """Return limit [m] and ceiling [km/h]."""
        state = behind(self.world, self.leader_m, front_m, speed_kmh / 3.6, time_s=self.time_s)
        authority, self.memory = self.atc.authorise(state, self.memory)
        self.time_s += STEP_S
        return float(authority.eoa_m[1]), float(authority.ceiling_mps[1]) * 3.6


def test_a_step_down_takes_the_idle_time_and_is_released_below_the_code() -> None:
    # The leader's tail is in the block from 1200 m on: 65 two blocks before it, then 0.
    train = Train(1450.0, idle_time_s=2.0, release_below_kmh=3.0)
    code = [train.atc.code_mps[0, 0, free] * 3.6 for free in range(4)]
    assert code == pytest.approx([0.0, 45.0, 65.0, 75.0])
    # 790 m lies in the block from 600 m: two free blocks ahead.
    assert train.at(790.0, 65.0)[1] == pytest.approx(65.0)
    ceilings = [train.at(801.0 + 9.0 * step, 65.0)[1] for step in range(6)]
    assert ceilings[:4] == pytest.approx([65.0] * 4)
    assert ceilings[4:] == pytest.approx([42.0] * 2)
    assert train.at(860.0, 44.0)[1] == pytest.approx(42.0)
    # Released: 3 km/h below the code, the train may run at the code again.
    assert train.at(865.0, 42.0)[1] == pytest.approx(45.0)
    assert train.at(870.0, 44.9)[1] == pytest.approx(45.0)


def test_a_higher_code_holds_at_once() -> None:
    train = Train(1450.0)
    assert train.at(890.0, 40.0)[1] == pytest.approx(45.0)
    train.leader_m = 1650.0
    # The tail has left the block; here without a release delay.
    assert train.at(900.0, 40.0)[1] == pytest.approx(65.0)


def test_a_train_below_the_code_needs_no_brake() -> None:
    train = Train(1450.0, idle_time_s=0.0)
    assert train.at(790.0, 30.0)[1] == pytest.approx(90.0)
    # Without an idle time 200 m are enough for 65 km/h: 163 m of braking, 9 m in a step, 25 m.
    assert [train.at(801.0, 30.0)[1] for _ in range(3)] == pytest.approx([65.0] * 3)


def test_the_limit_is_the_occupied_block_less_the_overlap() -> None:
    assert Train(1450.0, overlap_m=25.0).at(790.0, 0.0)[0] == pytest.approx(1175.0)
    # A train that stands closer stays where it is.
    assert Train(1450.0, overlap_m=25.0).at(1190.0, 0.0) == pytest.approx((1190.0, 0.0))


def test_a_circuit_behind_the_tail_is_released_after_the_delay() -> None:
    scenario = two_station_scenario(2, block_m=200.0, step_s=STEP_S)
    line = replace(scenario.line, release_delay_s=1.0)
    train = Train(1450.0)
    train.world = world_of(replace(scenario, line=line))
    train.atc = atc_on(train.world)
    eoas_m = [train.at(790.0, 0.0)[0]]
    train.leader_m = 1650.0
    eoas_m += [train.at(790.0, 0.0)[0] for _ in range(3)]
    assert eoas_m == pytest.approx([1175.0, 1175.0, 1175.0, 1375.0])


def test_points_that_another_train_goes_through_are_at_danger_for_everybody_else() -> None:
    scenario = loop_station_scenario(2, block_m=200.0)
    world = world_of(scenario)
    atc = atc_on(world)
    # The leader's tail is on ``north``, within the fouling section from 940 m to 1060 m.
    inside = behind(world, 1250.0, 500.0)
    behind_it = behind(world, 1270.0, 500.0)
    eoas_m = [
        float(atc.authorise(state, atc.initial())[0].eoa_m[1]) for state in (inside, behind_it)
    ]
    assert eoas_m[0] == pytest.approx(800.0 - 25.0)
    assert eoas_m[1] > 1000.0


def test_blocks_of_a_track_are_as_the_example_says() -> None:
    track = world_with(200.0).line.sections[0].tracks[0]
    assert [block.start_m for block in blocks_every(track, 200.0)][:3] == [0.0, 200.0, 400.0]
