"""What is said of trains that had not finished when a run ended."""

from dataclasses import replace

import numpy as np
import pytest

from kankaku.railway.loop.unfinished import Ending, unfinished
from kankaku.railway.plan.disruptions import Cause, Closure, Disruptions
from kankaku.railway.plan.line import Crossing, Gradient
from kankaku.railway.plan.rolling_stock import Traction
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.world import World
from kankaku.railway.step.obstructions import WaysideState
from kankaku.railway.step.records import Unfinished
from kankaku.railway.step.state import NOTHING, AtOnce, Authority, LineState
from kankaku.testing.example_lines import commuter_train, two_station_scenario, world_of
from tests.property.runs import run
from tests.states import behind

CLOSURE = Closure("zone", Cause.FAILURE, ("main",), 900.0, 950.0, 0.0, np.inf, np.inf)


def told(world: World, state: LineState) -> Unfinished:
    """Return what is said of the second train, permitted as far as its way is clear."""
    nothing = np.full(2, NOTHING, dtype=np.intp)
    permission = AtOnce(2).permission(state.clear_to_m)
    bounds = state.clear_to_m, np.full(2, 30.0), np.zeros(2)
    authority = Authority(*bounds, nothing, nothing, permission)
    done = np.array([True, False])
    ending = Ending(state, authority, done, Disruptions(closures=(CLOSURE,)))
    (item,) = unfinished(world, ending)
    assert item.row == 1
    assert item.front_m == state.front_m[1]
    return item


def on_a_ramp(force_n: float) -> World:
    scenario = two_station_scenario(2, gradients=(Gradient(300.0, 1100.0, 0.055),))
    train = replace(commuter_train(), traction=Traction(force_n, 11.0, 22.0))
    return world_of(replace(scenario, train_types={train.id: train}))


def test_a_train_that_cannot_start_on_a_ramp_has_stalled() -> None:
    # 400 t on 55 permil weigh 215.7 kN downhill, and roll at 4.4 kN.
    world = on_a_ramp(200_000.0)
    state = behind(world, 5000.0, 812.0)
    assert told(world, state)[1:3] == ("stalled", "")
    sentence = "T2 stalled at km 0.812: 55 permil against 200 kN starting force"
    assert told(world, state).sentence == sentence
    able = on_a_ramp(221_000.0)
    assert told(able, behind(able, 5000.0, 812.0)).cause == "standing"


def test_a_train_behind_another_one_waits_for_it() -> None:
    world = world_of(two_station_scenario(2))
    item = told(world, behind(world, 1000.0, 780.0))
    assert (item.cause, item.by) == ("train_ahead", "T1")
    assert item.sentence == "T2 stood at km 0.780, behind T1"


def test_a_train_far_behind_another_one_does_not_wait_for_it() -> None:
    world = world_of(two_station_scenario(2))
    assert told(world, behind(world, 1600.0, 780.0)).sentence == "T2 stood at km 0.780"


def test_a_train_that_could_not_leave_its_platform_stood_there() -> None:
    world = world_of(two_station_scenario(2))
    item = told(world, behind(world, 520.0, 300.0))
    assert item.sentence == "T2 stood at 'west', behind T1"


@pytest.mark.parametrize(("column", "name"), [(0, "road"), (1, "zone")])
def test_an_obstruction_that_holds_a_train_is_named(column: int, name: str) -> None:
    scenario = two_station_scenario(2)
    crossing = Crossing("road", 900.0, 908.0, 500.0, 20.0)
    world = world_of(replace(scenario, line=replace(scenario.line, crossings=(crossing,))))
    concerns = np.zeros((2, 2), dtype=np.bool_)
    concerns[1, column] = True
    start_m = np.full(2, 900.0)
    beside = WaysideState(
        start_m,
        start_m + 8.0,
        np.full(2, -np.inf),
        np.full(2, np.inf),
        concerns,
        np.array([world.far_m, 900.0]),
        np.array([-1, column]),
        np.zeros(2, dtype=np.bool_),
    )
    state = behind(world, 1500.0, 890.0)._replace(wayside=beside)
    state = state._replace(clear_to_m=np.array([world.far_m, 900.0]))
    item = told(world, state)
    assert (item.cause, item.by) == ("obstruction", name)
    assert item.sentence == f"T2 stood at km 0.890, held by {name}"


def test_a_train_under_way_was_still_running() -> None:
    world = world_of(two_station_scenario(2))
    item = told(world, behind(world, 1000.0, 700.0, 12.0))
    assert (item.cause, item.sentence) == ("running", "T2 was still running at km 0.700")


def ended_early(scenario: Scenario, *delays_s: float) -> list[tuple[str, str, str]]:
    delay_s = np.zeros((len(scenario.timetable.services), 2))
    delay_s[: len(delays_s), 0] = delays_s
    record, engine = run(replace(scenario, patience_s=60.0), delay_s=delay_s)
    assert record.violations == ()
    assert record.end_s == engine.time_s[-1]
    assert {item.row for item in record.unfinished} == set(np.flatnonzero(~record.completed))
    return [(item.cause, item.by, item.sentence) for item in record.unfinished]


def test_a_train_at_its_platform_is_still_there_and_who_should_enter_behind_it_never_did() -> None:
    assert ended_early(two_station_scenario(2), 5000.0) == [
        ("dwelling", "west", "T1 still stood at 'west': its stop was not over"),
        ("never_entered", "T1", "T2 never entered the line at 'west': T1 was there"),
    ]


def test_a_train_is_not_unfinished_that_has_left_the_line() -> None:
    assert ended_early(two_station_scenario(2)) == []


def test_the_run_ends_with_patience_after_the_last_booked_call() -> None:
    record, _ = run(
        replace(two_station_scenario(1), patience_s=300.0), delay_s=np.array([[5e3, 0.0]])
    )
    # It is booked to depart from east 150 s after it stands ready.
    assert record.end_s == pytest.approx(25_200.0 + 150.0 + 300.0, abs=1.0)
