"""Moving block with buffers and with platform sections for one train, against the formulas."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kankaku.controllers.drive import TractionDrive
from kankaku.controllers.options import OptionError
from kankaku.controllers.protection.moving_block import MovingBlock, MovingBlockOptions
from kankaku.controllers.registry import PROTECTIONS, ControllerError, build
from kankaku.railway.plan.line import SpeedLimit
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import NO_REASON, NOTHING, Advice, LineState
from kankaku.testing.example_lines import two_station_scenario, world_of
from tests.property.dense_run import Radio
from tests.property.runs import random_limits
from tests.states import behind

LENGTH_M, BRAKE_MPS2, STEP_S = 200.0, 1.0, 0.5
START_M, END_M = 1090.0, 1310.0
"""The platform section of ``east``, where trains stop at 1300 m."""
PAPER = MovingBlockOptions(
    margin_m=0.0,
    position_error_percent=0.1,
    position_resolution_m=2.0,
    communication_delay_s=0.5,
)
BALISES_M = (450.0, 1010.0, 1240.0)
NO_ADVICE = Advice(np.full(2, 100.0), np.full(2, NO_REASON, dtype=np.intp), np.full(2, NOTHING))
QUICK = settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.too_slow])


def world_with(
    *balises_m: float, limits: tuple[SpeedLimit, ...] = (), step_s: float = STEP_S
) -> World:
    scenario = two_station_scenario(2, limits=limits, step_s=step_s)
    return world_of(replace(scenario, line=replace(scenario.line, balises_m=balises_m)))


def radio_of(*balises_m: float) -> Radio:
    return Radio(0.001, 0.5, 2.0, (0.0, *balises_m))


def eoa_m(options: MovingBlockOptions, world: World, state: LineState) -> float:
    """End of authority of the follower."""
    protection = MovingBlock(world, options)
    return float(protection.authorise(state, protection.initial())[0].eoa_m[1])


@QUICK
@given(st.floats(0.0, 100.0), st.floats(501.0, 1800.0), st.floats(300.0, 2000.0), st.booleans())
def test_without_buffers_the_limit_is_what_is_clear_less_the_margin(
    margin_m: float, leader_m: float, clear_to_m: float, follows: bool
) -> None:
    world = world_with()
    state = behind(world, leader_m, 300.0, clear_to_m=clear_to_m, follows=follows)
    clear_m = min(leader_m - LENGTH_M, clear_to_m) if follows else clear_to_m
    options = MovingBlockOptions(margin_m=margin_m)
    assert eoa_m(options, world, state) == pytest.approx(clear_m - margin_m)


def test_by_default_there_is_a_margin_and_nothing_else() -> None:
    world = world_with(*BALISES_M)
    protection = MovingBlock(world, MovingBlockOptions())
    authority, _ = protection.authorise(behind(world, 1300.0, 600.0), protection.initial())
    assert authority.eoa_m[1] == pytest.approx(1100.0 - 25.0)
    assert authority.eoa_m[0] == pytest.approx(world.far_m - 25.0)
    assert authority.delay_s.tolist() == [0.0, 0.0]
    assert protection.delay_s == 0.0
    assert protection.profile is world.profile


@pytest.mark.parametrize("balises_m", [(), BALISES_M])
@pytest.mark.parametrize("leader_m", [660.0, 1100.0, 1215.0, 1260.0, 1655.5])
@pytest.mark.parametrize("margin_m", [0.0, 10.0])
@pytest.mark.parametrize("follower_m", [300.0, 455.0])
def test_with_buffers_a_standing_front_reaches_just_to_the_rear_buffer(
    balises_m: tuple[float, ...], leader_m: float, margin_m: float, follower_m: float
) -> None:
    world, radio = world_with(*balises_m), radio_of(*balises_m)
    place_m = leader_m - LENGTH_M - radio.rear_buffer_m(leader_m) - margin_m
    options = replace(PAPER, margin_m=margin_m)
    found_m = eoa_m(options, world, behind(world, leader_m, follower_m))
    # A balise further on corrects nothing yet.
    passed = radio_of(*(balise_m for balise_m in balises_m if balise_m <= follower_m))
    assert found_m == pytest.approx(passed.first_front_m(place_m, 0.0), abs=1e-9)
    assert found_m + passed.front_buffer_m(found_m, 0.0) == pytest.approx(place_m)


def test_points_that_are_not_granted_have_no_buffer_of_their_own() -> None:
    world = world_with()
    state = behind(world, 1200.0, 300.0, clear_to_m=700.0)
    # Equation (3) with the balise at 0 and the speed 0.
    assert eoa_m(PAPER, world, state) == pytest.approx((700.0 - 2.0) / 1.001)


def test_the_drive_counts_the_delay_of_the_radio() -> None:
    world = world_with()
    protection, drive = MovingBlock(world, PAPER), TractionDrive(world)
    state = behind(world, 900.0, 500.0, 15.0)
    authority, _ = protection.authorise(state, protection.initial())
    assert authority.delay_s.tolist() == [0.5, 0.5]
    after_mps = float(drive.command(state, authority, NO_ADVICE).bounds_mps[3, 1])
    # What it runs in the step, in the delay, and while braking ends at the limit.
    used_m = 0.5 * (15.0 + after_mps) * STEP_S + after_mps * 0.5 + 0.5 * after_mps**2 / BRAKE_MPS2
    assert 500.0 + used_m == pytest.approx(float(authority.eoa_m[1]))


@pytest.mark.parametrize("step_s", [0.02, 0.1, 0.5])
def test_a_train_braking_behind_a_standing_leader_just_reaches_its_rear_buffer(
    step_s: float,
) -> None:
    """The ceiling of the paper: d = v^2 / (2 b) from the own front buffer to that rear buffer."""
    world, radio = world_with(step_s=step_s), radio_of()
    protection, drive = MovingBlock(world, PAPER), TractionDrive(world)
    rear_m = 1000.0 - LENGTH_M - radio.rear_buffer_m(1000.0)
    front_m, speed_mps, braked = 300.0, 0.0, 0
    for _ in range(round(120.0 / step_s)):
        state = behind(world, 1000.0, front_m, speed_mps)
        authority, _ = protection.authorise(state, protection.initial())
        after_mps = float(drive.command(state, authority, NO_ADVICE).speed_mps[1])
        front_m += 0.5 * (speed_mps + after_mps) * step_s
        braking = after_mps < speed_mps
        speed_mps = after_mps
        braking_m = 0.5 * speed_mps**2 / BRAKE_MPS2
        left_m = rear_m - (front_m + radio.front_buffer_m(front_m, speed_mps) + braking_m)
        assert left_m >= -(BRAKE_MPS2 * step_s**2 / 8.0 + 1e-6)
        if braking and speed_mps > 0.0:
            braked += 1
            # Only the drift up to the stop is still to come.
            assert left_m <= 0.001 * (braking_m + 0.5 * speed_mps) + 1e-6
    assert braked * step_s > 10.0
    assert front_m + radio.front_buffer_m(front_m, 0.0) == pytest.approx(rear_m, abs=0.05)


def test_while_the_leader_is_in_the_platform_section_the_limit_is_at_its_start() -> None:
    world = world_with()
    options = MovingBlockOptions(margin_m=5.0, exclusive_platform=True)
    fronts_m = np.arange(800.0, 1800.0, 2.5)
    for leader_m in fronts_m.tolist():
        tail_m = leader_m - LENGTH_M
        expected_m = START_M if START_M < tail_m < END_M else tail_m
        found_m = eoa_m(options, world, behind(world, leader_m, 500.0))
        assert found_m == pytest.approx(expected_m - 5.0)


def test_the_limit_jumps_when_the_rear_buffer_has_left_the_platform_section() -> None:
    world, radio = world_with(), radio_of()
    options = replace(PAPER, exclusive_platform=True)
    held_m = radio.first_front_m(START_M, 0.0)
    gone_m = radio.first_clear_m(END_M, LENGTH_M)
    # The balise is 1.5 km behind the leader.
    assert gone_m == pytest.approx(END_M + LENGTH_M + 2.0 + 1.5, abs=0.02)
    before = eoa_m(options, world, behind(world, gone_m - 0.01, 800.0))
    after = eoa_m(options, world, behind(world, gone_m + 0.01, 800.0))
    assert before == pytest.approx(held_m)
    assert after == pytest.approx(radio.first_front_m(END_M, 0.0), abs=0.02)


@pytest.mark.parametrize("options", [MovingBlockOptions(exclusive_platform=True), PAPER])
def test_a_train_inside_the_platform_section_is_not_sent_back(options: MovingBlockOptions) -> None:
    world = world_with()
    exclusive, shared = (replace(options, exclusive_platform=flag) for flag in (True, False))
    inside = behind(world, 1430.0, START_M + 10.0)
    assert eoa_m(exclusive, world, inside) == eoa_m(shared, world, inside)
    assert eoa_m(exclusive, world, inside) > START_M + 10.0
    # A train that came to its stand some millimetres too far on is still outside.
    for outside_m in (START_M - 1.0, START_M + 0.005):
        outside = behind(world, 1430.0, outside_m)
        assert eoa_m(exclusive, world, outside) <= START_M < eoa_m(shared, world, outside)


def test_only_the_platform_section_of_the_next_call_is_kept_for_one_train() -> None:
    world = world_with()
    state = behind(world, 1300.0, 250.0)
    state = state._replace(next_call=np.array([1, 0]), stop_m=np.array([1300.0, 300.0]))
    options = MovingBlockOptions(margin_m=0.0, exclusive_platform=True)
    assert eoa_m(options, world, state) == pytest.approx(1100.0)


def test_the_memory_of_platform_sections_follows_the_calls() -> None:
    world = world_with()
    protection = MovingBlock(world, MovingBlockOptions(margin_m=0.0, exclusive_platform=True))
    first = behind(world, 1300.0, 250.0)._replace(next_call=np.array([1, 0]))
    then = behind(world, 1300.0, 350.0)
    eoas_m = []
    memory = protection.initial()
    for state in (first, then, then, first):
        authority, memory = protection.authorise(state, memory)
        eoas_m.append(float(authority.eoa_m[1]))
    assert eoas_m == pytest.approx([1100.0, START_M, START_M, 1100.0])


@pytest.mark.parametrize("exclusive", [False, True])
@pytest.mark.parametrize("options", [MovingBlockOptions(), PAPER])
@pytest.mark.parametrize("balises_m", [(), BALISES_M])
def test_what_is_foretold_is_what_is_authorised(
    options: MovingBlockOptions, exclusive: bool, balises_m: tuple[float, ...]
) -> None:
    world = world_with(*balises_m)
    protection = MovingBlock(world, replace(options, exclusive_platform=exclusive))
    fronts_m = np.arange(550.0, 1900.0, 3.7)
    foretold_m = protection.eoa_behind_m(1, 1, 0, fronts_m, np.zeros_like(fronts_m))
    memory = protection.initial()
    for leader_m, expected_m in zip(fronts_m.tolist(), foretold_m.tolist(), strict=True):
        # As if it had passed every balise that it will pass.
        passed_m = max([300.0, *(balise_m for balise_m in balises_m if balise_m < expected_m)])
        follower_m = passed_m if passed_m < START_M else 300.0
        authority, memory = protection.authorise(behind(world, leader_m, follower_m), memory)
        if passed_m == follower_m:
            assert authority.eoa_m[1] == pytest.approx(expected_m, abs=1e-9)
        else:
            assert expected_m - 0.001 * END_M < authority.eoa_m[1] <= expected_m


@QUICK
@given(random_limits(1800.0), st.lists(st.floats(1.0, 1800.0), max_size=4))
def test_buffers_never_raise_the_line_ceiling(
    limits: list[SpeedLimit], balises_m: list[float]
) -> None:
    world = world_with(*balises_m, limits=tuple(limits))
    plain, buffered = MovingBlock(world, MovingBlockOptions()), MovingBlock(world, PAPER)
    assert np.all(buffered.profile.ceiling_mps <= plain.profile.ceiling_mps + 1e-9)
    for follower_m in np.arange(300.0, 1700.0, 23.0).tolist():
        state = behind(world, 1750.0, follower_m, 10.0)
        # What lies beyond the reach of a step binds nobody.
        within_mps = state.speed_mps + world.step_s * world.greatest_acceleration_mps2
        ceilings = [
            protection.authorise(state, protection.initial())[0].ceiling_mps
            for protection in (buffered, plain)
        ]
        assert np.all(np.minimum(ceilings[0], within_mps) <= ceilings[1] + 1e-9)


def test_a_limit_holds_from_the_front_buffer_to_the_rear_buffer() -> None:
    limit = SpeedLimit(700.0, 900.0, 15.0)
    protection = MovingBlock(world_with(450.0, limits=(limit,)), PAPER)
    radio = radio_of(450.0)
    limits = protection.profile.limits[0]
    (slow,) = np.flatnonzero(limits.limit_mps == 15.0)
    assert limits.start_m[slow] == pytest.approx(radio.first_front_m(700.0, 15.0), abs=1e-6)
    cleared_m = radio.first_clear_m(900.0, LENGTH_M)
    # A millimetre more, as places are rounded.
    assert limits.start_m[slow + 1] == pytest.approx(cleared_m + 1e-3, abs=1e-6)


@pytest.mark.parametrize(
    ("key", "values"),
    [
        ("margin_m", (-0.1, 1000.1, np.nan)),
        ("position_error_percent", (-0.01, 10.1, np.nan)),
        ("position_resolution_m", (-1.0, 100.5, np.inf)),
        ("communication_delay_s", (-0.5, 10.5, np.nan)),
    ],
)
def test_a_value_out_of_range_is_refused_by_its_key(key: str, values: tuple[float, ...]) -> None:
    world, options = world_with(), PROTECTIONS["moving_block"].options
    for value in values:
        with pytest.raises(OptionError, match=key):
            options(**{key: value})
        spec = ControllerSpec("x", "moving_block", "close_up", {key: value}, {})
        with pytest.raises(ControllerError, match=key):
            build(spec, world)
