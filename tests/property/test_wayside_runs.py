"""Whatever happens beside the track, no train is ever in what is not proven for it."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.controllers.registry import PROTECTIONS
from kankaku.railway.plan.disruptions import Cause, Closure, Disruptions, Obstacle, PointsFailure
from kankaku.railway.plan.line import Crossing, Line, Turnout
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.step.records import RunRecord
from kankaku.testing.example_lines import world_of
from kankaku.testing.loop_station import loop_station_scenario
from tests.examples import examples
from tests.property.runs import READY_S, Observed, controller_of, run

LASTS_S = 700.0
EXAMPLES = examples(15)
ROUNDING_S = 1e-6


@st.composite
def windows_s(draw: st.DrawFn) -> tuple[float, float]:
    from_s = READY_S + draw(st.floats(0.0, LASTS_S))
    return from_s, from_s + draw(st.floats(5.0, 200.0))


@st.composite
def crossing_lines(draw: st.DrawFn, line: Line) -> Line:
    """A crossing on the track before the points, or beyond them."""
    # Step by step braking may stop a train anywhere in the block before the crossing's own.
    start_m, latest_m = draw(st.sampled_from([(700.0, 250.0), (1200.0, 750.0), (2500.0, 2050.0)]))
    strike_in_m = latest_m - draw(st.floats(0.0, 300.0))
    crossing = Crossing("road", start_m, start_m + 8.0, strike_in_m, draw(st.floats(0.0, 30.0)))
    throw_s, proof_s = draw(st.floats(0.0, 15.0)), draw(st.floats(0.0, 3.0))
    turnouts = tuple(replace(item, throw_s=throw_s, proof_s=proof_s) for item in line.turnouts)
    return replace(line, turnouts=turnouts, crossings=(crossing,))


@st.composite
def closures(draw: st.DrawFn, line: Line, name: str) -> Closure:
    start_m = draw(st.floats(420.0, 2700.0))
    end_m = start_m + draw(st.floats(5.0, 200.0))
    from_s, until_s = draw(windows_s())
    work = draw(st.booleans())
    tracks = line.tracks_between(start_m, end_m)
    return Closure(
        name,
        Cause.WORK if work else Cause.FAILURE,
        (draw(st.sampled_from(tracks)),) if draw(st.booleans()) else tracks,
        start_m,
        end_m,
        from_s,
        until_s if work else np.inf,
        until_s + (draw(st.floats(-4.0, 60.0)) if work else 0.0),
    )


@st.composite
def disturbed(draw: st.DrawFn) -> Scenario:
    scenario = loop_station_scenario(
        4, draw(st.floats(60.0, 110.0)), one_starts_inside=draw(st.booleans()), block_m=250.0
    )
    line = draw(crossing_lines(scenario.line))
    failures = draw(
        st.lists(st.tuples(st.sampled_from(["fan", "throat"]), windows_s()), max_size=2)
    )
    return replace(
        scenario,
        line=line,
        seed=draw(st.integers(0, 1000)),
        disruptions=Disruptions(
            closures=tuple(draw(closures(line, f"c{n}")) for n in range(draw(st.integers(0, 2)))),
            points_failures=tuple(PointsFailure(name, *window) for name, window in failures),
            obstacles=tuple(
                Obstacle("road", *window) for window in draw(st.lists(windows_s(), max_size=2))
            ),
            points_failure_ratio=draw(st.sampled_from([0.0, 0.3])),
            points_repair_s=60.0,
            obstacle_ratio=draw(st.sampled_from([0.0, 0.3])),
            obstacle_s=30.0,
        ),
    )


def ways_through(scenario: Scenario, turnout: Turnout) -> list[tuple[int, tuple[str, str]]]:
    """Trains in the order of the timetable, with their tracks before and behind the points."""
    tracks = scenario.line.track_by_id
    return [
        (row, (before, after))
        for row, service in enumerate(scenario.timetable.services)
        for before, after in pairwise(service.route)
        if tracks[before].end_m == turnout.position_m
    ]


def assert_points_lay_for_everybody(scenario: Scenario, record: RunRecord, engine: Observed) -> int:
    """Follow fronts and tails as the engine showed them; return how many throws were waited for."""
    waited = 0
    length_m = scenario.train_types["commuter"].length_m
    for turnout in scenario.line.turnouts:
        moves_s = turnout.throw_s + turnout.proof_s
        unproven = [item for item in record.obstructions if item.id == turnout.id]
        for (before, its_way), (row, way) in pairwise(ways_through(scenario, turnout)):
            entered = engine.front_m[:, row] > turnout.fouling_start_m + 0.1
            entered_s = engine.time_s[np.argmax(entered)]
            if way != its_way:
                cleared = engine.front_m[:, before] - length_m >= turnout.fouling_end_m
                cleared_s = engine.time_s[np.argmax(cleared)]
                assert entered_s >= cleared_s + moves_s - ROUNDING_S
                waited += 1
            for item in unproven:
                inside = item.established_s + ROUNDING_S < entered_s < item.lifted_s
                assert not inside
    return waited


@pytest.mark.parametrize("protection", PROTECTIONS)
def test_no_train_is_ever_in_what_is_not_proven_for_it(protection: str) -> None:
    @EXAMPLES
    @given(disturbed(), st.lists(st.floats(0.0, 90.0), min_size=15, max_size=15))
    def keeps_out(scenario: Scenario, drawn_s: list[float]) -> None:
        world = world_of(scenario)
        delay_s = np.resize(np.array(drawn_s), (world.size, world.stop_m.shape[1] - 1))
        controller = controller_of(world, protection=protection)
        record, engine = run(scenario, controller=controller, delay_s=delay_s)
        assert record.violations == ()
        assert record.completed.all()
        assert assert_points_lay_for_everybody(scenario, record, engine) >= 4

    keeps_out()


def test_who_is_braking_for_a_sudden_obstacle_needs_no_idle_time_at_the_next_block() -> None:
    scenario = loop_station_scenario(4, 60.0, block_m=250.0)
    line = replace(scenario.line, crossings=(Crossing("road", 700.0, 708.0, 250.0, 0.0),))
    obstacle = Obstacle("road", 25_362.0, 25_367.0)
    scenario = replace(scenario, line=line, disruptions=Disruptions(obstacles=(obstacle,)))
    world = world_of(scenario)
    controller = controller_of(world, protection="multi_step_atc")
    nobody_late_s = np.zeros((world.size, world.stop_m.shape[1] - 1))
    record, engine = run(scenario, controller=controller, delay_s=nobody_late_s)
    enters = (engine.front_m[:-1] < 500.0) & (engine.front_m[1:] >= 500.0)
    brakes = engine.speed_mps[1:] < engine.speed_mps[:-1]
    found = (engine.time_s >= 25_362.0) & (engine.time_s < 25_367.0)
    assert (enters & brakes)[found[:-1]].any()
    assert record.violations == ()
