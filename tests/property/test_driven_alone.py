"""One train alone in any driving style: late by nobody's fault but its own, and gentle."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from kankaku.railway.motion.run_curve import StallError
from kankaku.railway.plan.driving_style import FASTEST, DrivingStyle
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.world import World
from kankaku.railway.step.records import RunRecord
from kankaku.testing.example_lines import blocks_every, commuter_train, world_of
from tests.examples import examples
from tests.property.alone import run_time_alone_s
from tests.property.manners import answering, any_driven_speeds, any_style
from tests.property.runs import Observed, controller_of, random_gradients, run, solo_scenario
from tests.property.test_alone import END_M, STEPS_S, any_limits, calls_m, lateness_by_others_s

QUICK = examples(12)
STEEPEST = 0.018
HALTING_MPS = 0.1
STOP_TOLERANCE_M = 0.3
COASTING_S = 1.0
"""Whether a train speeds up once more before a stop may depend on a step. [s]"""
PROTECTIONS = st.sampled_from(
    ["moving_block", "relative_braking", "atd", "digital_atc", "multi_step_atc"]
)
GRADUAL = replace(commuter_train(), jerk_mps3=0.7, brake_build_up_s=1.0)
NORMAL = DrivingStyle(
    name="normal",
    traction_share=0.9,
    station_brake_mps2=2.5 / 3.6,
    below_limit_mps=3.0 / 3.6,
    coasting_band_mps=8.0 / 3.6,
    departure_reaction_s=2.0,
    late_after_s=15.5,
)


def level(style: DrivingStyle, train: TrainType, stops_m: list[float], step_s: float) -> Scenario:
    """Return a scenario without limits or gradients."""
    scenario = solo_scenario(train, stops_m, END_M + 100.0, step_s=step_s)
    blocks = blocks_every(scenario.line.sections[0].tracks[0], 300.0)
    return replace(scenario, line=replace(scenario.line, blocks=blocks), driving=style)


@st.composite
def alone_on_any_line(draw: st.DrawFn, trains: st.SearchStrategy[TrainType]) -> Scenario:
    scenario = level(draw(any_style()), draw(trains), draw(calls_m()), draw(STEPS_S))
    line = replace(
        scenario.line,
        gradients=tuple(draw(random_gradients(END_M, STEEPEST))),
        limits=tuple(draw(any_limits())),
        driven_speeds=draw(any_driven_speeds(END_M)),
    )
    return replace(scenario, line=line)


def driven_alone(scenario: Scenario, protection: str) -> tuple[World, RunRecord, Observed]:
    world = world_of(scenario)
    record, engine = run(scenario, controller=controller_of(world, protection=protection))
    assert record.violations == ()
    assert np.nanmax(np.abs(record.stop_error_m)) <= STOP_TOLERANCE_M
    return world, record, engine


def late_by_others_s(world: World, record: RunRecord) -> np.ndarray:
    try:
        return lateness_by_others_s(world, record)
    except StallError:
        # Half of the traction may be too little for a climb.
        assume(False)
        raise


def halting_s(world: World) -> float:
    """How much sooner a call can be: an engine takes the last bit of speed away."""
    brake_mps2 = min(kind.service_brake_mps2 for kind in world.driven_types)
    return HALTING_MPS / (brake_mps2 - 9.1 * STEEPEST)


@QUICK
@given(alone_on_any_line(st.just(commuter_train())), PROTECTIONS)
def test_in_any_style_a_train_alone_is_late_by_nobody_else(
    scenario: Scenario, protection: str
) -> None:
    world, record, _ = driven_alone(scenario, protection)
    by_others_s = late_by_others_s(world, record)
    calls = np.arange(1, world.call_count[0])
    coasts = scenario.driving.coasting_band_mps > 0.0
    late_s = scenario.step_s + (COASTING_S if coasts else 0.0)
    assert np.all(by_others_s <= late_s * calls + 1e-6)
    early_s = scenario.step_s + halting_s(world) + (COASTING_S if coasts else 0.0)
    assert np.all(by_others_s >= -early_s * calls - 1e-6)
    style, line = scenario.driving, scenario.line
    if coasts:
        return
    train = style.train(world.train_types[0])
    for call in calls.tolist():
        departure_s = float(record.departure_s[0, call - 1])
        late_s = departure_s - world.booked_departure_s[0, call - 1]
        driven = (style.at_limits if late_s > style.late_after_s else style).line(line)
        ends_m = float(world.stop_m[0, call - 1]), float(world.stop_m[0, call])
        expected_s = run_time_alone_s(train, ends_m, line.gradients, driven.limits)
        lasted_s = record.arrival_s[0, call] - departure_s - world.reaction_s
        assert lasted_s == pytest.approx(expected_s, rel=1e-3, abs=1.0 + halting_s(world))


@QUICK
@given(alone_on_any_line(answering(commuter_train())), PROTECTIONS)
@example(level(FASTEST, GRADUAL, [300.0, 900.0, 1500.0], 0.1), "moving_block")
@example(level(NORMAL, GRADUAL, [300.0, 900.0, 1500.0, 2100.0], 0.5), "atd")
def test_a_train_that_answers_gradually_keeps_its_limits_its_stops_and_its_jerk(
    scenario: Scenario, protection: str
) -> None:
    world, record, engine = driven_alone(scenario, protection)
    (train,) = world.train_types
    assert record.completed.all()
    # Gravity changes as the train comes onto another gradient, which nobody feels as a jerk.
    gravity_mps3 = 9.1 * 2.0 * STEEPEST / train.length_m * engine.speed_mps.max()
    assert jerks_mps3(engine).max() <= train.jerk_mps3 + gravity_mps3 + 1e-6
    # The reference changes at once from traction to brake: at a peak of the speed the train is
    # behind it by half of the time that its change takes.
    change_s = train.starting_acceleration_mps2 / train.jerk_mps3 + train.brake_rise_s
    peaks = 1 + 2 * len(scenario.line.limits)
    calls = np.arange(1, world.call_count[0])
    by_others_s = late_by_others_s(world, record)
    assert np.all(by_others_s <= (scenario.step_s + 0.5 * peaks * change_s) * calls + COASTING_S)
    early_s = scenario.step_s + halting_s(world) + COASTING_S
    assert np.all(by_others_s >= -early_s * calls)


def jerks_mps3(engine: Observed) -> np.ndarray:
    """Of every change of acceleration while the train moves, but for its halts."""
    speed_mps, step_s = engine.speed_mps[:, 0], engine.time_s[1] - engine.time_s[0]
    # Standing trains have no jerk, and the brake holds them.
    moving = speed_mps[2:] > 0.0
    jerks = np.abs(np.diff(speed_mps, 2)) / step_s**2
    found: np.ndarray = np.append(jerks[moving], 0.0)
    return found
