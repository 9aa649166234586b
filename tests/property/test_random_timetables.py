"""Whatever the timetable and the delays, trains keep apart, in order, and arrive."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.controllers.registry import OPERATIONS
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.step.records import RunRecord
from kankaku.testing.example_lines import merge_scenario
from kankaku.testing.loop_station import loop_station_scenario
from tests.examples import examples
from tests.property.runs import Observed, run

QUICK = examples(10)
LENGTH_M = 200.0
LOOP_FLEETS = [(2, False), (2, True), (3, False), (5, False), (5, True)]
"""Trains from the west, and whether another one starts at the loop station."""
delays = st.lists(st.floats(0.0, 150.0), min_size=15, max_size=15)


def delays_for(scenario: Scenario, drawn_s: list[float]) -> np.ndarray:
    trains = len(scenario.timetable.services)
    calls = max(len(service.calls) for service in scenario.timetable.services)
    return np.resize(np.array(drawn_s), (trains, calls))


def assert_never_on_the_same_place(scenario: Scenario, engine: Observed) -> None:
    """Compare every two trains in every step, by the tracks under front and tail."""
    line = scenario.line
    front_m = engine.front_m
    routes = [
        {line.section_of_track[track]: track for track in service.route}
        for service in scenario.timetable.services
    ]
    present = presence(engine, len(routes))
    for one in range(len(routes)):
        for other in range(one):
            overlap = present[:, one] & present[:, other]
            overlap &= np.abs(front_m[:, one] - front_m[:, other]) < LENGTH_M
            for index, section in enumerate(line.sections):
                if routes[one].get(index, "a") != routes[other].get(index, "b"):
                    continue
                low_m = np.maximum(front_m[:, one], front_m[:, other]) - LENGTH_M
                high_m = np.minimum(front_m[:, one], front_m[:, other])
                shared = (high_m > section.start_m) & (low_m < section.end_m)
                assert not np.any(overlap & shared)


def presence(engine: Observed, trains: int) -> np.ndarray:
    present = np.zeros((len(engine.seen), trains), dtype=np.bool_)
    for step, seen in enumerate(engine.seen):
        present[step:, list(seen.entered)] = True
        present[step:, list(seen.left)] = False
    return present


def assert_in_order_through_the_points(
    scenario: Scenario, engine: Observed, position_m: float
) -> None:
    """Nobody is in a fouling section before the train ahead of it has cleared it."""
    turnout = next(t for t in scenario.line.turnouts if t.position_m == position_m)
    users = range(len(scenario.timetable.services))
    for ahead, behind in pairwise(users):
        if (
            scenario.timetable.services[ahead].route[0]
            == scenario.timetable.services[behind].route[0]
        ):
            continue
        inside = engine.front_m[:, behind] > turnout.fouling_start_m
        not_clear = engine.front_m[:, ahead] - LENGTH_M < turnout.fouling_end_m
        not_gone = presence(engine, len(users))[:, ahead] | (engine.front_m[:, ahead] < 1000.0)
        assert not np.any(inside & not_clear & not_gone)


def assert_nothing_went_wrong(record: RunRecord) -> None:
    assert [violation.message for violation in record.violations] == []
    assert record.completed.all()


@pytest.mark.parametrize("operation", OPERATIONS)
@QUICK
@given(st.integers(2, 5), st.floats(35.0, 120.0), delays)
def test_at_a_merge_no_delay_makes_trains_meet(
    operation: str, trains: int, headway_s: float, drawn_s: list[float]
) -> None:
    scenario = merge_scenario(trains, headway_s)
    record, engine = run(scenario, operation, delay_s=delays_for(scenario, drawn_s))
    assert_nothing_went_wrong(record)
    assert_never_on_the_same_place(scenario, engine)
    assert_in_order_through_the_points(scenario, engine, 400.0)


@pytest.mark.parametrize("operation", OPERATIONS)
@QUICK
@given(st.sampled_from(LOOP_FLEETS), st.floats(60.0, 150.0), delays)
def test_at_a_loop_station_no_delay_makes_trains_meet(
    operation: str, fleet: tuple[int, bool], headway_s: float, drawn_s: list[float]
) -> None:
    trains, inside = fleet
    scenario = loop_station_scenario(trains, headway_s, one_starts_inside=inside)
    drawn = delays_for(scenario, drawn_s)
    record, engine = run(scenario, operation, delay_s=drawn)
    assert_nothing_went_wrong(record)
    assert_never_on_the_same_place(scenario, engine)
    order = [engine.passes_s(row, 2000.0) for row in range(record.world.size)]
    assert order == sorted(order)
