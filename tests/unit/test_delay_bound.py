"""The bound of delay: closed forms of two trains, and queues worked by hand."""

from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from kankaku.analysis.tables.run_tables import run_tables
from kankaku.analysis.tables.summary import summary_frame
from kankaku.railway.capacity.delay_bound import (
    earliest_arrivals_s,
    platform_order,
    run_times_as_driven_s,
)
from kankaku.railway.capacity.least_interval import LeastIntervals, Pair, remaining_times
from kankaku.railway.motion.way import way_on
from kankaku.railway.plan.rolling_stock import RunningResistance, Traction, TrainType
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight
from kankaku.testing.example_lines import (
    commuter_train,
    make_scenario,
    two_station_scenario,
    world_of,
)
from tests.property.runs import controller_of, run
from tests.records import READY_S, make_record, punctual, run_times_s, three_station_world

MARGIN_M = 25.0
LENGTH_M = 200.0


def even_train(acceleration_mps2: float, brake_mps2: float) -> TrainType:
    """A train that nothing resists and whose traction is the same at every speed."""
    bare = commuter_train(LENGTH_M, brake_mps2)
    force_n = acceleration_mps2 * bare.inertial_mass_kg
    traction = Traction(force_n, 90.0, 95.0)
    free = RunningResistance(0.0, 0.0, 0.0)
    return replace(bare, traction=traction, resistance=free)


def moving_block(world: World) -> Foresight:
    return cast("Foresight", controller_of(world).protection)


def world_with(train: TrainType, spacing_m: float = 2000.0) -> World:
    plain = two_station_scenario(2, spacing_m=spacing_m, run_s=150.0)
    return world_of(make_scenario(plain.line, plain.timetable.services, train))


@pytest.mark.parametrize(("acceleration_mps2", "brake_mps2"), [(0.9, 1.0), (0.5, 0.8)])
def test_the_least_interval_behind_an_even_train_is_the_closed_form(
    acceleration_mps2: float, brake_mps2: float
) -> None:
    a, b = acceleration_mps2, brake_mps2
    world = world_with(even_train(a, b))
    found_s = LeastIntervals(world, moving_block(world)).of(Pair(0, 1, 1, 1))
    # When the leader has run for t, the way still ends e = L + m - a t^2 / 2 before the stop. To
    # speed up from v0 to v1 within it and brake takes (v1 - v0) / a + v1 / b, and is least for
    # v0 = b v1 / (a + b): sqrt(2 e (a + 2 b) / (b (a + b))).
    time_s = np.linspace(0.0, np.sqrt(2.0 * (LENGTH_M + MARGIN_M) / a), 10_000)
    left_m = np.maximum(LENGTH_M + MARGIN_M - 0.5 * a * time_s**2, 0.0)
    least_s = time_s + np.sqrt(2.0 * left_m * (a + 2.0 * b) / (b * (a + b)))
    assert found_s == pytest.approx(least_s.max(), abs=0.15)


def test_to_hold_a_speed_behind_the_leader_takes_longer_than_the_bound() -> None:
    world = world_with(even_train(0.9, 1.0))
    found_s = LeastIntervals(world, moving_block(world)).of(Pair(0, 1, 1, 1))
    # Sato et al. 2025, eqs. (14) and (15), least over the speed that is held.
    held_s = 2.0 * np.sqrt((LENGTH_M + MARGIN_M) * (0.5 / 0.9 + 1.0))
    assert 0.9 * held_s < found_s < held_s


def test_remaining_times_are_those_of_braking_and_of_speeding_up() -> None:
    world = world_with(even_train(1.0, 1.0))
    ends_m = 300.0, 2300.0
    times = remaining_times(way_on(world.profile, 0, world.train_types[0], ends_m))
    near = int(np.searchsorted(times.chainage_m, 2100.0))
    left_m = 2300.0 - times.chainage_m[near]
    # On the brake curve v / b; from a stand up to sqrt(d a b / (a + b) * 2) and down again.
    assert times.at_cap_s[near] == pytest.approx(np.sqrt(2.0 * left_m), abs=0.05)
    assert times.time_s[near, 0] == pytest.approx(2.0 * np.sqrt(left_m), abs=0.15)


def test_trains_that_meet_head_on_or_stop_elsewhere_have_no_interval() -> None:
    world = world_with(commuter_train())
    intervals = LeastIntervals(world, moving_block(world))
    assert intervals.of(Pair(0, 0, 1, 1)) == 0.0
    moved = replace(world, stop_m=world.stop_m + np.array([[0.0], [5.0]]))
    assert LeastIntervals(moved, moving_block(world)).of(Pair(0, 1, 1, 1)) == 0.0


@pytest.mark.parametrize("protection", ["moving_block", "relative_braking", "digital_atc"])
def test_no_train_comes_in_behind_another_before_the_bound(protection: str) -> None:
    scenario = two_station_scenario(
        3, 60.0, spacing_m=2000.0, run_s=110.0, block_m=200.0, step_s=0.5
    )
    world = world_of(scenario)
    drawn_s = np.zeros((3, 2))
    drawn_s[0, 1] = 60.0
    for operation in ("close_up", "two_stage"):
        controller = controller_of(world, operation, protection)
        record, _ = run(scenario, controller=controller, delay_s=drawn_s)
        known = replace(record, foresight=cast("Foresight", controller.protection))
        calls = run_tables(known).calls
        left_s = (calls["arrival_s"] - calls["arrival_bound_s"])[calls["sequence"] > 0]
        assert left_s.min() >= 0.0
        if (protection, operation) == ("moving_block", "close_up"):
            # The bound leaves little: a second and two steps for each train in the queue.
            assert left_s.max() < 2.0 * (1.0 + 2.0 * 0.5)


def order_of(world: World, arrival_s: Sequence[Sequence[float]]) -> list[tuple[int, ...]]:
    order = platform_order(world, READY_S + np.array(arrival_s))
    return list(zip(*(field.tolist() for field in order), strict=True))


def test_trains_at_a_platform_come_in_the_order_of_the_run() -> None:
    world = three_station_world(trains=2)
    found = order_of(world, [[0.0, 120.0, np.nan], [110.0, 275.0, 405.0]])
    assert found[:4] == [(0, 0, -1, -1), (1, 0, 0, 0), (0, 1, -1, -1), (1, 1, 0, 1)]
    # Who never came is last.
    assert found[4:] == [(1, 2, -1, -1), (0, 2, 1, 2)]


def test_the_latest_of_what_it_waits_for_lets_a_train_arrive() -> None:
    world = three_station_world(trains=2)
    arrival_s, _ = punctual(world)
    drawn_s = np.zeros((2, 3))
    drawn_s[0, 1] = 80.0
    order = platform_order(world, arrival_s)
    interval_s = np.where(order.call > 0, 35.0, 0.0)
    found_s = earliest_arrivals_s(
        world, drawn_s, run_times_s(world, 90.0, 110.0), order, interval_s
    )
    # T1 leaves west at 30, is at mid from 120 until 120 + 20 + 80 = 220, and at east at 330. T2
    # leaves west at 150; alone it would be at mid at 240, behind T1 it is there at 255, leaves
    # as booked at 280, and is at east at 390, long after T1 has left there at 350.
    assert (found_s - READY_S).tolist() == [[0.0, 120.0, 330.0], [120.0, 255.0, 390.0]]


def test_a_leg_counts_as_driven_and_no_slower_than_the_fastest_train_did_it() -> None:
    world = three_station_world(trains=2)
    style = replace(world.driving, coasting_band_mps=2.0, late_after_s=30.0)
    world = replace(world, driving=style)
    arrival_s, departure_s = punctual(world)
    departure_s[0, 1] += 60.0
    arrival_s[0, 2] = departure_s[0, 1] + 108.0
    arrival_s[1, 1] = departure_s[1, 0] + 89.0
    drawn_s = np.zeros((2, 3))
    drawn_s[0, 1] = 70.0
    both_s = np.array([run_times_s(world, 90.0, 120.0), run_times_s(world, 85.0, 110.0)])
    found_s = run_times_as_driven_s(world, (arrival_s, departure_s), drawn_s, both_s)
    # T1 hurries to east, which takes 110 s in theory and took 108 s; T2 came to mid in 89 s.
    assert found_s[:, 1:].tolist() == [[89.0, 108.0], [89.0, 120.0]]


def test_the_summary_tells_the_bound_and_what_is_left_above_it() -> None:
    world = three_station_world(trains=2)
    arrival_s = READY_S + np.array([[0.0, 120.0, 300.0], [120.0, 275.0, 405.0]])
    departure_s = READY_S + np.array([[30.0, 190.0, 330.0], [150.0, 295.0, 430.0]])
    drawn_s = np.array([[0.0, 50.0, 0.0], [0.0, 0.0, 0.0]])
    record = make_record(world, arrival_s, departure_s, dwell_delay_s=drawn_s)
    tables = run_tables(record, run_times_s(world, 90.0, 110.0))
    # No protection is known, so T2 need only come to mid after T1 has left it at 190: it could
    # be there at 240 and at east at 390. It is late by 25 and 5 s instead of -10 and -10 s.
    assert (tables.calls["arrival_bound_s"] - READY_S).tolist()[3:] == [120.0, 240.0, 390.0]
    row = summary_frame([tables]).iloc[0]
    assert row["mean_delay_bound_s"] == (-10.0 + 20.0 - 10.0 - 10.0) / 4.0
    assert row["delay_above_bound_s"] == (35.0 + 15.0) / 4.0


def test_of_calls_that_were_never_made_no_more_is_left_than_until_the_end() -> None:
    world = three_station_world(trains=1)
    arrival_s, departure_s = punctual(world)
    arrival_s[0, 2] = departure_s[0, 2] = np.nan
    drawn_s = np.array([[0.0, 900.0, 0.0]])
    record = make_record(world, arrival_s, departure_s, dwell_delay_s=drawn_s)
    ended = replace(record, end_s=READY_S + 480.0)
    row = summary_frame([run_tables(ended, run_times_s(world, 100.0, 120.0))]).iloc[0]
    assert row["delay_above_bound_s"] == 0.0
