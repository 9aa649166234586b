"""Who follows whom at merges, at diverging points, at a second origin and at the end."""

import numpy as np
import pytest

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.world import World
from kankaku.railway.wayside.leaders import Leaders
from kankaku.testing.example_lines import merge_scenario, two_station_scenario, world_of
from kankaku.testing.loop_station import loop_station_scenario
from tests.ends_of_ways import short_turn_scenario
from tests.property.runs import run

LENGTH_M = 200.0


def clearance_m(leaders: Leaders, fronts_m: list[float]) -> FloatArray:
    return leaders.tails_and_clearance_m(np.array(fronts_m), leaders.granted_to_m)[1]


def of_merge(trains: int = 3) -> tuple[World, Leaders]:
    world = world_of(merge_scenario(trains))
    return world, Leaders(world)


def test_a_train_from_the_other_track_waits_at_the_fouling_point() -> None:
    world, leaders = of_merge()
    assert leaders.leader.tolist() == [-1, 0, 0]
    assert leaders.follows.tolist() == [False, False, True]
    eoas_m = clearance_m(leaders, [300.0, 300.0, 300.0])
    assert eoas_m[0] == world.far_m
    assert eoas_m[1] == 340.0
    assert eoas_m[2] == 300.0 - LENGTH_M


def test_a_tail_past_the_fouling_section_hands_the_points_to_the_next_train() -> None:
    _, leaders = of_merge()
    assert leaders.next_clear_m.tolist() == [410.0] * 3
    leaders.clear(np.array([0]), 0.0)
    assert leaders.leader.tolist() == [-1, 0, 1]
    assert leaders.follows.tolist() == [False, True, False]
    eoas_m = clearance_m(leaders, [611.0, 300.0, 300.0])
    assert eoas_m[1:].tolist() == [411.0, 340.0]


def test_a_train_that_left_the_line_is_in_nobodys_way() -> None:
    world, leaders = of_merge(2)
    leaders.clear(np.array([0]), 0.0)
    leaders.leave(0, 0.0)
    assert leaders.leader.tolist() == [-1, -1]
    assert clearance_m(leaders, [2000.0, 300.0])[1] == world.far_m
    assert leaders.next_clear_m[0] == np.inf


def test_behind_a_train_that_ends_on_the_way_follows_the_one_before_it() -> None:
    leaders = Leaders(world_of(short_turn_scenario(3)))
    assert leaders.leader.tolist() == [-1, 0, 1]
    leaders.leave(1, 0.0)
    assert leaders.leader.tolist() == [-1, 0, 0]
    assert clearance_m(leaders, [2600.0, 4000.0, 300.0])[2] == 2600.0 - LENGTH_M


def test_a_leader_that_diverges_is_followed_until_its_tail_is_clear_of_the_points() -> None:
    world = world_of(loop_station_scenario(2))
    leaders = Leaders(world)
    fronts_m = [1200.0, 400.0]
    assert leaders.leader.tolist() == [-1, 0]
    assert clearance_m(leaders, fronts_m)[1] == 1000.0
    assert leaders.next_clear_m[0] == 1060.0
    leaders.clear(np.array([0]), 0.0)
    # Now the other platform track is free; at its end the order of the timetable decides.
    assert leaders.leader.tolist() == [-1, 0]
    assert leaders.follows.tolist() == [False, False]
    assert clearance_m(leaders, fronts_m)[1] == 1740.0


def test_a_train_that_starts_on_the_second_platform_track_keeps_its_turn() -> None:
    world = world_of(loop_station_scenario(3, one_starts_inside=True))
    assert world.timetable.trains == ("T1", "S1", "T2", "T3")
    leaders = Leaders(world)
    # T1 has priority at the far points although it is still far away; T2 comes behind S1.
    fronts_m = [400.0, 1600.0, 400.0, 400.0]
    assert leaders.leader.tolist() == [-1, 0, 0, 2]
    assert clearance_m(leaders, fronts_m)[:2].tolist() == [world.far_m, 1740.0]
    leaders.clear(np.array([0]), 0.0)
    # T1 is in the station: T2 runs towards the platform track where S1 still stands.
    assert leaders.leader.tolist()[2] == 1
    assert leaders.follows.tolist()[2]
    assert clearance_m(leaders, [1600.0, 1600.0, 400.0, 400.0])[2] == 1600.0 - LENGTH_M


def test_behind_its_own_leader_a_train_still_waits_for_points_that_another_goes_through_first() -> (
    None
):
    leaders = Leaders(world_of(loop_station_scenario(3)))
    leaders.clear(np.array([0]), 0.0)
    leaders.clear(np.array([1]), 0.0)
    # T1 leaves the loop, T2 goes next from the other track, T3 stands behind T1.
    fronts_m = [1990.0, 1600.0, 1600.0]
    assert leaders.leader.tolist()[2] == 0
    assert clearance_m(leaders, fronts_m)[2] == 1740.0


def test_on_a_single_track_everybody_follows_the_next() -> None:
    world = world_of(two_station_scenario(4))
    leaders = Leaders(world)
    assert leaders.leader.tolist() == [-1, 0, 1, 2]
    assert clearance_m(leaders, [900.0, 600.0, 300.0, 300.0])[1:].tolist() == [700.0, 400.0, 100.0]


@pytest.mark.parametrize("overstay_s", [0.0, 60.0])
def test_trains_pass_a_merge_in_timetable_order_even_if_the_first_is_late(
    overstay_s: float,
) -> None:
    scenario = merge_scenario(3, 60.0)
    delay_s = np.zeros((3, 2))
    delay_s[0, 0] = overstay_s
    record, engine = run(scenario, delay_s=delay_s)
    assert record.violations == ()
    times = [engine.passes_s(row, 600.0) for row in range(3)]
    assert times == sorted(times)
    # The second train stands short of the fouling point until the first has cleared.
    waits = engine.front_m[:, 0] - LENGTH_M < 410.0
    assert engine.front_m[waits, 1].max() < 340.0 - 25.0 + 0.1
