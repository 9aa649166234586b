"""Codes that blocks never show: how fast trains run then, and what is told about it."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import cast

import numpy as np
import pytest

from kankaku.controllers import registry
from kankaku.railway.capacity.permitted import permitted_profile
from kankaku.railway.motion.journey import Journey, booked_journey, technical_journey
from kankaku.railway.plan.line import Block, Line
from kankaku.railway.plan.scenario import ControllerSpec, Option
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight
from tests.unit.test_headway import (
    ACCELERATION_MPS2,
    BRAKE_MPS2,
    STOPS_M,
    protection,
    steady_line,
    world_on,
)

FAST_MPS, SLOW_MPS, IDLE_S = 30.0, 12.5, 2.0
CODES_KMH = (3.6 * FAST_MPS, 3.6 * SLOW_MPS, 0.0)
EXACT_S = 0.05
SHORT_M = 250.0
"""Too short to brake from 30 to 12.5 m/s in, and long enough from there to a stop."""
RUN_M = STOPS_M["mid"] - STOPS_M["west"]


def line_with(edges_m: Sequence[float]) -> Line:
    blocks = [
        Block(f"b{number}", "main", start_m, end_m)
        for number, (start_m, end_m) in enumerate(pairwise(edges_m))
    ]
    return replace(steady_line(FAST_MPS), blocks=tuple(blocks))


def atc_spec(counted_blocks: float = 2.0) -> ControllerSpec:
    options: dict[str, Option] = {
        "codes_kmh": CODES_KMH,
        "idle_time_s": IDLE_S,
        "counted_blocks": counted_blocks,
    }
    return ControllerSpec("atc", "multi_step_atc", "close_up", options, {})


def atc_on(world: World) -> Foresight:
    return cast("Foresight", registry.build(atc_spec(), world).protection)


def journey_on(world: World) -> Journey:
    return technical_journey(world, permitted_profile(world, atc_on(world), 0), 0)


EVEN = np.arange(0.0, 9001.0, SHORT_M).tolist()


def test_where_no_block_shows_the_top_code_trains_run_at_the_next_one() -> None:
    journey = journey_on(world_on(line_with(EVEN)))
    run_s = journey.arrival_s[1] - journey.departure_s[0]
    gained_s = 0.5 * SLOW_MPS * (1.0 / ACCELERATION_MPS2 + 1.0 / BRAKE_MPS2)
    assert run_s == pytest.approx(RUN_M / SLOW_MPS + gained_s, abs=EXACT_S)


def test_a_lower_code_is_met_after_the_idle_time_in_its_block_and_not_before() -> None:
    # Up to 2600 m blocks are long, behind it they are short: that before shows the lower code.
    edges_m = [0.0, 650.0, 1300.0, 1950.0, 2600.0, *np.arange(2850.0, 9101.0, SHORT_M)]
    edges_m[-1] = 9000.0
    journey = journey_on(world_on(line_with(edges_m)))
    reached_mps = np.sqrt(2.0 * ACCELERATION_MPS2 * (1950.0 - STOPS_M["west"]))
    assert reached_mps > FAST_MPS
    braked_m = 0.5 * (FAST_MPS**2 - SLOW_MPS**2) / BRAKE_MPS2
    places_m = np.array([1950.0, 1950.0 + IDLE_S * FAST_MPS, 2010.0 + braked_m, 2590.0])
    found_mps = np.interp(places_m, journey.chainage_m, journey.speed_mps)
    assert found_mps == pytest.approx([FAST_MPS, FAST_MPS, SLOW_MPS, SLOW_MPS], abs=0.1)
    halfway_m = 2010.0 + 0.5 * braked_m
    halfway_mps = np.sqrt(0.5 * (FAST_MPS**2 + SLOW_MPS**2))
    found = np.interp(halfway_m, journey.chainage_m, journey.speed_mps)
    assert found == pytest.approx(halfway_mps, abs=0.1)


def test_a_booked_train_is_no_faster_than_codes_permit() -> None:
    world = world_on(line_with(EVEN))
    foresight = atc_on(world)
    journey = booked_journey(world, permitted_profile(world, foresight, 0), 0)
    # 200 s are booked for what takes 255 s at 45 km/h.
    assert journey.arrival_s[1] - journey.departure_s[0] > RUN_M / SLOW_MPS
    assert journey.speed_mps[journey.chainage_m < STOPS_M["east"]].max() <= SLOW_MPS + 0.01


@pytest.mark.parametrize("name", ["moving_block", "atd", "digital_atc", "relative_braking"])
def test_protections_that_permit_the_line_speed_leave_the_profile_as_it_is(name: str) -> None:
    world = world_on(line_with(EVEN))
    foresight = protection(world, name)
    assert permitted_profile(world, foresight, 0) is foresight.profile


def test_blocks_that_never_show_the_top_code_are_told_with_room_and_need() -> None:
    world = world_on(line_with(EVEN))
    told = registry.warnings([atc_spec(), replace(atc_spec(), name="twin")], world)
    # 60 m in the idle time, two steps of 3 m, and 371.9 m of braking.
    # Behind the last block trains leave the line, so that the last two show the top code.
    sentence = (
        "atc, twin: blocks b0, b1, b2 and 31 more never show more than 45 km/h: from 108 km/h a "
        "train needs 437.9 m to brake to 45 km/h in block b1, which has 250.0 m"
    )
    assert told == (sentence,)


def test_a_single_block_is_told_with_the_one_that_is_too_short_behind_it() -> None:
    # b3 is too short to brake in from 108 km/h; b2, which shows 45 km/h for that, is not.
    edges_m = [0.0, 600.0, 1200.0, 1800.0, 1950.0, *np.arange(2550.0, 8400.0, 600.0), 9000.0]
    (sentence,) = registry.warnings([atc_spec(counted_blocks=1.0)], world_on(line_with(edges_m)))
    assert sentence == (
        "atc: block b2 never shows more than 45 km/h: from 108 km/h a train needs 541.0 m to stop "
        "in block b3, which has 150.0 m"
    )


def test_layouts_whose_blocks_are_long_enough_and_other_protections_are_not_doubted() -> None:
    world = world_on(line_with(np.arange(0.0, 9001.0, 600.0).tolist()))
    plain = ControllerSpec("plain", "moving_block", "close_up", {}, {})
    peer = ControllerSpec("peer", "", "", {}, {}, peer="sumo_native_fixed")
    assert registry.warnings([atc_spec(), plain, peer], world) == ()
