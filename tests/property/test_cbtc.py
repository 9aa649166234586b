"""Trains under communication-based control: buffers, and platform sections for one train."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from kankaku.controllers.registry import build
from kankaku.railway.arrays import BoolArray
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.testing.example_lines import two_station_scenario, world_of
from tests.examples import examples
from tests.property.dense_run import Radio
from tests.property.runs import Observed, run

QUICK = examples(20)
TRAINS = 4
LENGTH_M, BRAKE_MPS2 = 200.0, 1.0
SOME_CENTIMETRES_M = 0.05
OPTIONS = {
    "position_error_percent": 0.1,
    "position_resolution_m": 2.0,
    "communication_delay_s": 0.5,
    "margin_m": 0.0,
    "exclusive_platform": True,
}


@st.composite
def scenarios(draw: st.DrawFn) -> Scenario:
    """Two stations, close trains that overstay, and balises anywhere."""
    spacing_m = draw(st.floats(600.0, 2000.0))
    scenario = two_station_scenario(
        TRAINS,
        draw(st.floats(55.0, 100.0)),
        spacing_m=spacing_m,
        step_s=draw(st.sampled_from([0.1, 0.2, 0.25, 0.5])),
    )
    balises_m = sorted(draw(st.sets(st.floats(1.0, spacing_m + 700.0), max_size=4)))
    return replace(scenario, line=replace(scenario.line, balises_m=tuple(balises_m)))


overstays = st.lists(st.floats(0.0, 60.0), min_size=2 * TRAINS, max_size=2 * TRAINS)


def moving_behind(engine: Observed, leader: int, follower: int) -> BoolArray:
    """Steps in which both are on the line and the follower has left its origin."""
    present = np.zeros((len(engine.seen), TRAINS), dtype=np.bool_)
    for step, seen in enumerate(engine.seen):
        present[step:, list(seen.entered)] = True
        present[step:, list(seen.left)] = False
    left = engine.front_m[:, follower] > engine.front_m[0, follower]
    found: BoolArray = present[:, leader] & present[:, follower] & left
    return found


def radio_on(scenario: Scenario) -> Radio:
    return Radio(0.001, 0.5, 2.0, (0.0, *scenario.line.balises_m))


def assert_buffers_never_meet(scenario: Scenario, engine: Observed) -> None:
    """Equations (1) and (2), with the braking distance on the level."""
    radio = radio_on(scenario)
    for leader, follower in pairwise(range(TRAINS)):
        steps = moving_behind(engine, leader, follower)
        ahead_m, front_m = engine.front_m[steps, leader], engine.front_m[steps, follower]
        speed_mps = engine.speed_mps[steps, follower]
        rear_m = ahead_m - LENGTH_M - radio.drifts_m(ahead_m) - radio.resolution_m
        braking_m = 0.5 * speed_mps**2 / BRAKE_MPS2
        stands_m = front_m + speed_mps * radio.delay_s + braking_m
        standing_m = stands_m + radio.drifts_m(stands_m) + radio.resolution_m
        assert np.all(standing_m <= rear_m + SOME_CENTIMETRES_M)
        # A balise on the way to a stand takes nothing off before it is passed.
        reach_m = stands_m + radio.drifts_m(front_m) + radio.resolution_m
        assert np.all(reach_m <= rear_m + SOME_CENTIMETRES_M)


def assert_one_train_in_the_platform_section(scenario: Scenario, engine: Observed) -> None:
    radio, section = radio_on(scenario), scenario.line.platforms[1]
    # At the origin trains appear on the line wherever there is room.
    assert section.station == "east"
    for leader, follower in pairwise(range(TRAINS)):
        behind = moving_behind(engine, leader, follower)
        ahead_m = engine.front_m[:, leader]
        rear_m = ahead_m - LENGTH_M - radio.drifts_m(ahead_m) - radio.resolution_m
        inside = engine.front_m[:, follower] > section.start_m
        assert not np.any(behind & inside & (rear_m < section.end_m))


@QUICK
@given(scenarios(), overstays)
def test_buffers_never_meet_and_platform_sections_hold_one_train(
    scenario: Scenario, drawn_s: list[float]
) -> None:
    spec = ControllerSpec("cbtc", "moving_block", "close_up", OPTIONS, {})
    controller = build(spec, world_of(scenario))
    delay_s = np.array(drawn_s).reshape(TRAINS, 2)
    record, engine = run(scenario, controller=controller, delay_s=delay_s)
    assert [violation.message for violation in record.violations] == []
    assert record.completed.all()
    assert np.isfinite(record.arrival_s).all()
    assert_buffers_never_meet(scenario, engine)
    assert_one_train_in_the_platform_section(scenario, engine)


def test_a_leader_that_overstays_stops_its_follower_a_buffer_short_of_the_platform() -> None:
    scenario = two_station_scenario(2, 60.0, spacing_m=1500.0, step_s=0.1)
    spec = ControllerSpec("cbtc", "moving_block", "close_up", OPTIONS, {})
    delay_s = np.array([[0.0, 120.0], [0.0, 0.0]])
    record, engine = run(scenario, controller=build(spec, world_of(scenario)), delay_s=delay_s)
    assert record.violations == ()
    start_m = scenario.line.platforms[1].start_m
    stood = (engine.speed_mps[:, 1] < 1e-6) & (engine.front_m[:, 1] > 1000.0)
    # Equation (3) with the speed 0 and the balise at 0.
    stood_m = float(engine.front_m[stood, 1][0])
    assert abs(stood_m - (start_m - 2.0) / 1.001) < SOME_CENTIMETRES_M
