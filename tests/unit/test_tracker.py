"""Calls, departures and events as the tracker reports them."""

import numpy as np
import pytest

from kankaku.railway.loop.tracker import Tracker
from kankaku.railway.plan.world import World
from kankaku.railway.step.engine_contract import Observation
from kankaku.testing.example_lines import merge_scenario, two_station_scenario, world_of
from tests.ends_of_ways import short_turn_scenario
from tests.property.runs import run

READY_S = 25_200.0


def observation(
    world: World,
    time_s: float,
    fronts_m: list[float],
    speeds_mps: list[float],
    **events: tuple[int, ...],
) -> Observation:
    none: tuple[int, ...] = ()
    kinds = ("entered", "stopped", "released", "left", "collided")
    happened = {kind: events.get(kind, none) for kind in kinds}
    assert len(fronts_m) == world.size
    return Observation(time_s, np.array(fronts_m), np.array(speeds_mps), **happened)


def test_a_call_is_over_when_the_stop_is_released_and_departed_at_the_first_movement() -> None:
    world = world_of(two_station_scenario(1))
    tracker = Tracker(world)
    entered = observation(world, READY_S, [300.0], [0.0], entered=(0,), stopped=(0,))
    state = tracker.update(entered)
    assert (state.next_call[0], state.running[0], state.present[0]) == (0, False, True)
    state = tracker.update(observation(world, READY_S + 30.0, [300.0], [0.0], released=(0,)))
    assert (state.next_call[0], state.running[0]) == (1, True)
    assert state.stop_m[0] == 1300.0
    assert state.events.released == (0,)
    assert state.events.departed == ()
    # It stands for another step, then moves: it left when that step began.
    tracker.update(observation(world, READY_S + 30.5, [300.0], [0.0]))
    state = tracker.update(observation(world, READY_S + 31.0, [300.1], [0.45]))
    assert state.events.departed == (0,)
    assert tracker.departure_s[0, 0] == READY_S + 30.5
    assert tracker.update(observation(world, READY_S + 31.5, [300.4], [0.9])).events.departed == ()


def test_a_train_that_ends_at_a_stop_departs_and_leaves_at_once() -> None:
    world = world_of(short_turn_scenario(2))
    tracker = Tracker(world)
    here_m, still_mps = [300.0, 1500.0], [0.0, 0.0]
    at_s = [READY_S, READY_S + 30.0, READY_S + 95.0, READY_S + 130.0]
    tracker.update(observation(world, at_s[0], here_m, still_mps, entered=(1,), stopped=(1,)))
    tracker.update(observation(world, at_s[1], here_m, still_mps, released=(1,)))
    tracker.update(observation(world, at_s[2], here_m, still_mps, stopped=(1,)))
    ended = observation(world, at_s[3], here_m, still_mps, released=(1,), left=(1,))
    state = tracker.update(ended)
    assert not state.present[1]
    assert not state.running[1]
    assert (state.events.departed, state.events.left) == ((1,), (1,))
    assert tracker.departure_s[1, 1] == READY_S + 130.0
    assert tracker.completed.tolist() == [False, True]


def test_a_stop_is_recorded_with_its_time_and_place() -> None:
    world = world_of(two_station_scenario(1))
    tracker = Tracker(world)
    tracker.update(observation(world, READY_S, [300.0], [0.0], entered=(0,), stopped=(0,)))
    tracker.update(observation(world, READY_S + 30.0, [300.0], [0.0], released=(0,)))
    tracker.update(observation(world, READY_S + 95.0, [1299.8], [0.0], stopped=(0,)))
    assert tracker.arrival_s[0].tolist() == [READY_S, READY_S + 95.0]
    assert tracker.stop_error_m[0, 1] == pytest.approx(-0.2)
    assert not tracker.finished
    tracker.update(observation(world, READY_S + 200.0, [1800.0], [0.0], left=(0,)))
    assert tracker.finished


def test_earlier_states_do_not_change_when_the_line_moves_on() -> None:
    world = world_of(two_station_scenario(1))
    tracker = Tracker(world)
    before = tracker.update(observation(world, READY_S, [300.0], [0.0], entered=(0,), stopped=(0,)))
    kept = [array.copy() for array in before if isinstance(array, np.ndarray)]
    tracker.update(observation(world, READY_S + 30.0, [300.0], [0.0], released=(0,)))
    tracker.update(observation(world, READY_S + 31.0, [300.4], [0.9]))
    now = [array for array in before if isinstance(array, np.ndarray)]
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(kept, now, strict=True))


def test_departures_and_arrivals_of_a_punctual_train_follow_from_the_timetable() -> None:
    record, engine = run(two_station_scenario(1))
    assert record.arrival_s[0, 0] == READY_S
    assert record.departure_s[0, 0] == READY_S + 30.0
    # It could be there early, and leaves as booked.
    assert record.arrival_s[0, 1] < READY_S + 120.0
    assert record.departure_s[0, 1] == READY_S + 150.0
    assert engine.front_m[:, 0].max() == 1800.0


def test_clearing_the_points_is_an_event_of_the_train_that_cleared_them() -> None:
    scenario = merge_scenario(2)
    world = world_of(scenario)
    _, engine = run(scenario)
    tracker = Tracker(world)
    cleared_m: dict[int, float] = {}
    for seen in engine.seen:
        for row in tracker.update(seen).events.cleared:
            cleared_m.setdefault(row, float(seen.front_m[row]))
    assert sorted(cleared_m) == [0, 1]
    # Within one step of 15 m at the most.
    assert all(410.0 <= front_m - 200.0 <= 425.0 for front_m in cleared_m.values())
