"""One train alone: as fast as physics allows, and late by nobody's fault but its own."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from kankaku.analysis.tables.delay import technical_run_times_s, unhindered_arrivals_s
from kankaku.railway.plan.line import Gradient, SpeedLimit
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.world import World
from kankaku.railway.step.records import RunRecord
from kankaku.testing.example_lines import blocks_every, commuter_train, world_of
from tests.examples import examples
from tests.property.alone import run_time_alone_s
from tests.property.runs import controller_of, random_gradients, run, solo_scenario

QUICK = examples(8)
START_M, END_M = 300.0, 2600.0
STEPS_S = st.sampled_from([0.05, 0.1, 0.2, 0.5])
TRAM = 30.0


@st.composite
def any_limits(draw: st.DrawFn) -> list[SpeedLimit]:
    """From a metre long and hardly faster than walking, anywhere and over each other."""
    found = []
    for _ in range(draw(st.integers(0, 6))):
        start_m = draw(st.floats(0.0, END_M - 10.0))
        length_m = draw(st.sampled_from([1.0, 2.0, 20.0, 100.0, 700.0]))
        slowest = 1.0 if length_m <= 20.0 else 4.0
        limit_mps = draw(st.floats(slowest, 8.0) | st.floats(8.0, 28.0))
        found.append(SpeedLimit(start_m, min(start_m + length_m, END_M), limit_mps))
    return found


@st.composite
def calls_m(draw: st.DrawFn) -> list[float]:
    """Two to five stops, 250 m apart or more."""
    stops_m = [START_M]
    for _ in range(draw(st.integers(1, 4))):
        stops_m.append(stops_m[-1] + draw(st.floats(250.0, 550.0)))
    return stops_m


def scenario_of(
    length_m: float,
    stops_m: list[float],
    gradients: list[Gradient],
    limits: list[SpeedLimit],
    step_s: float,
) -> Scenario:
    train = commuter_train(length_m)
    scenario = solo_scenario(
        train, stops_m, END_M + 100.0, gradients=gradients, limits=limits, step_s=step_s
    )
    track = scenario.line.sections[0].tracks[0]
    return replace(scenario, line=replace(scenario.line, blocks=blocks_every(track, 300.0)))


def lateness_by_others_s(world: World, record: RunRecord) -> np.ndarray:
    times_s = technical_run_times_s(world)
    alone_s = unhindered_arrivals_s(world, np.zeros(record.arrival_s.shape), times_s)
    found: np.ndarray = (record.arrival_s - alone_s)[0, 1:]
    return found


def is_alone(scenario: Scenario, protection: str) -> None:
    """Check a run against physics, and its own reference against it."""
    world = world_of(scenario)
    record, _ = run(scenario, controller=controller_of(world, protection=protection))
    assert record.violations == ()
    calls = np.arange(1, world.call_count[0])
    by_others_s = lateness_by_others_s(world, record)
    assert np.all(by_others_s <= scenario.step_s * calls + 1e-6)
    # An engine takes the last 0.1 m/s away when a stop begins.
    assert np.all(by_others_s >= -(scenario.step_s + 0.1) * calls - 1e-6)
    train, line = world.train_types[0], scenario.line
    for call in calls.tolist():
        ends_m = float(world.stop_m[0, call - 1]), float(world.stop_m[0, call])
        expected_s = run_time_alone_s(train, ends_m, line.gradients, line.limits)
        lasted_s = float(record.arrival_s[0, call] - record.departure_s[0, call - 1])
        assert lasted_s == pytest.approx(expected_s, rel=1e-3, abs=1.0)


SLOW_TRACK = [SpeedLimit(900.0, 1300.0, 5.0 / 3.6)]
"""Five km/h for four hundred metres."""
TRAM_STOPS = [SpeedLimit(at_m, at_m + 2.0, 10.0 / 3.6) for at_m in np.arange(400.0, 2200.0, 200.0)]
"""Ten km/h for two metres, nine times."""
WALKING = [SpeedLimit(700.0, 701.0, 1.0 / 3.6), SpeedLimit(START_M - 5.0, START_M + 5.0, 0.5)]


@QUICK
@given(
    st.sampled_from([TRAM, 80.0, 200.0]),
    calls_m(),
    random_gradients(END_M, 0.03),
    any_limits(),
    STEPS_S,
    st.sampled_from(["moving_block", "relative_braking", "atd", "digital_atc"]),
)
@example(200.0, [START_M, 2400.0], [], SLOW_TRACK, 0.5, "moving_block")
@example(200.0, [START_M, 2400.0], [], SLOW_TRACK, 0.1, "atd")
@example(TRAM, [START_M, 2400.0], [], TRAM_STOPS, 0.5, "moving_block")
@example(TRAM, [START_M, 2400.0], [], TRAM_STOPS, 0.1, "relative_braking")
@example(TRAM, [START_M, 1000.0], [], WALKING, 0.5, "moving_block")
def test_a_train_alone_is_on_time_by_physics_and_by_its_own_reference(
    length_m: float,
    stops_m: list[float],
    gradients: list[Gradient],
    limits: list[SpeedLimit],
    step_s: float,
    protection: str,
) -> None:
    is_alone(scenario_of(length_m, stops_m, gradients, limits, step_s), protection)
