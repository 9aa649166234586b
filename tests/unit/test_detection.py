"""Track circuits on a line that one can picture: trains of 200 m, circuits of 100 m."""

from dataclasses import replace

import numpy as np
import pytest

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.line import Block, Line
from kankaku.railway.plan.world import World
from kankaku.railway.wayside.detection import Detection, Occupancy
from kankaku.testing.example_lines import (
    blocks_every,
    merge_scenario,
    two_station_scenario,
    world_of,
)

LENGTH_M = 200.0
FAR_M = 10_000.0


def divided(line: Line, circuit_m: float, release_delay_s: float = 0.0) -> Line:
    """Divide every block into circuits of equal length."""
    circuits = [
        Block(f"{block.id}/{circuit.id}", block.track, circuit.start_m, circuit.end_m)
        for block in line.blocks
        for circuit in blocks_every(line.track_by_id[block.track], circuit_m)
        if block.start_m <= circuit.start_m < block.end_m
    ]
    return replace(line, circuits=tuple(circuits), release_delay_s=release_delay_s)


def plain_world(release_delay_s: float = 0.0) -> World:
    """One track of 1800 m: blocks of 400 m, circuits of 100 m, two trains."""
    scenario = two_station_scenario(2, block_m=400.0)
    line = divided(scenario.line, 100.0, release_delay_s)
    return world_of(replace(scenario, line=line))


def merging_world() -> World:
    """Two tracks of 400 m merge into one; points foul from 340 m to 410 m."""
    scenario = merge_scenario(2, block_m=200.0)
    return world_of(replace(scenario, line=divided(scenario.line, 100.0)))


def look(
    detection: Detection,
    fronts_m: list[float],
    time_s: float = 0.0,
    before: Occupancy | None = None,
) -> Occupancy:
    """Show trains with their fronts at these places; a train at NaN is not on the line."""
    front_m = np.array(fronts_m)
    present = np.isfinite(front_m)
    return detection.look(
        time_s, front_m, front_m - LENGTH_M, present, before or detection.initial()
    )


def occupied(detection: Detection, seen: Occupancy) -> list[tuple[str, float]]:
    """Return track and start of every occupied circuit."""
    circuits = detection.line.track_circuits
    return [
        (circuits[number].track, circuits[number].start_m) for number in seen.occupied.nonzero()[0]
    ]


def starts_m(detection: Detection, seen: Occupancy) -> list[float]:
    return [start_m for _, start_m in occupied(detection, seen)]


def danger_m(
    detection: Detection, fronts_m: list[float], granted_to_m: tuple[float, float] = (FAR_M, FAR_M)
) -> FloatArray:
    front_m = np.array(fronts_m)
    return detection.danger_m(
        front_m,
        front_m - LENGTH_M,
        np.isfinite(front_m),
        np.array(granted_to_m),
        look(detection, fronts_m),
    )


def test_front_exactly_at_a_boundary_has_not_entered() -> None:
    detection = Detection(plain_world())
    assert starts_m(detection, look(detection, [500.0, np.nan])) == [300.0, 400.0]
    assert starts_m(detection, look(detection, [500.001, np.nan])) == [300.0, 400.0, 500.0]


def test_tail_exactly_at_a_boundary_has_left() -> None:
    detection = Detection(plain_world())
    assert starts_m(detection, look(detection, [599.999, np.nan])) == [300.0, 400.0, 500.0]
    assert starts_m(detection, look(detection, [600.0, np.nan])) == [400.0, 500.0]


def test_train_longer_than_several_circuits_occupies_them_all() -> None:
    scenario = two_station_scenario(1, block_m=400.0)
    detection = Detection(world_of(replace(scenario, line=divided(scenario.line, 50.0))))
    seen = look(detection, [910.0])
    assert starts_m(detection, seen) == [700.0, 750.0, 800.0, 850.0, 900.0]
    blocks = detection.block_of_circuit[seen.occupied]
    assert sorted(set(blocks.tolist())) == [1, 2]


def test_train_whose_tail_is_before_its_routes_start_occupies_the_first_circuits() -> None:
    detection = Detection(plain_world())
    assert starts_m(detection, look(detection, [130.0, np.nan])) == [0.0, 100.0]


@pytest.mark.parametrize(("delay_s", "late_s"), [(0.0, 0.0), (0.3, 0.3), (1.0, 1.0), (0.25, 0.2)])
def test_circuit_is_released_a_while_after_the_tail_has_left(delay_s: float, late_s: float) -> None:
    detection = Detection(plain_world(delay_s))
    begin_ms = 25_198_000
    seen = look(detection, [350.0, np.nan], begin_ms / 1000.0)
    until_ms = begin_ms
    for time_ms in range(begin_ms + 100, begin_ms + 2000, 100):
        seen = look(detection, [800.0, np.nan], time_ms / 1000.0, seen)
        if 300.0 in starts_m(detection, seen):
            until_ms = time_ms
    assert until_ms - begin_ms == round(1000.0 * late_s)
    assert starts_m(detection, seen) == [600.0, 700.0]


def test_release_times_are_not_rounded_to_one_step_more_or_less() -> None:
    detection = Detection(plain_world(0.3))
    for time_ms in range(25_200_000, 25_260_000, 100):
        left = look(detection, [350.0, np.nan], time_ms / 1000.0)
        held = look(detection, [800.0, np.nan], (time_ms + 300) / 1000.0, left)
        freed = look(detection, [800.0, np.nan], (time_ms + 400) / 1000.0, held)
        assert 300.0 in starts_m(detection, held)
        assert 300.0 not in starts_m(detection, freed)


def test_train_that_left_the_line_holds_nothing() -> None:
    detection = Detection(plain_world())
    there = look(detection, [1800.0, np.nan], 0.0)
    gone = look(detection, [np.nan, np.nan], 0.5, there)
    assert starts_m(detection, there) == [1600.0, 1700.0]
    assert starts_m(detection, gone) == []


def test_parallel_tracks_before_a_merge_have_circuits_of_their_own() -> None:
    detection = Detection(merging_world())
    seen = look(detection, [450.0, 300.0])
    assert occupied(detection, seen) == [
        ("north", 200.0),
        ("north", 300.0),
        ("south", 100.0),
        ("south", 200.0),
        ("main", 400.0),
    ]
    assert danger_m(detection, [450.0, 300.0])[1] == 300.0  # points are locked for the other way


def test_circuit_behind_a_merge_is_shared() -> None:
    detection = Detection(merging_world())
    assert danger_m(detection, [650.0, 300.0]).tolist() == [np.inf, 400.0]


def test_danger_begins_where_the_first_occupied_circuit_begins() -> None:
    detection = Detection(plain_world())
    assert danger_m(detection, [950.0, 350.0]).tolist() == [np.inf, 700.0]


def test_danger_is_behind_the_front_where_the_own_circuit_is_not_free() -> None:
    detection = Detection(plain_world())
    assert danger_m(detection, [780.0, 540.0]).tolist() == [np.inf, 500.0]
    assert danger_m(detection, [780.0, 500.0]).tolist() == [np.inf, 500.0]


def test_points_that_are_not_granted_are_closed_from_their_circuit_on() -> None:
    detection = Detection(merging_world())
    assert danger_m(detection, [250.0, 250.0], (FAR_M, 340.0)).tolist() == [np.inf, 300.0]


def test_points_stay_locked_when_a_train_of_no_way_stands_beyond_them() -> None:
    """The last train begins its route behind the points, and its tail is within them."""
    scenario = merge_scenario(2, block_m=200.0)
    first, second = scenario.timetable.services
    beyond = replace(second, train="T3", route=("main",), calls=second.calls[1:])
    timetable = replace(scenario.timetable, services=(first, second, beyond))
    detection = Detection(world_of(replace(scenario, timetable=timetable)))
    front_m = np.array([390.0, 300.0, 605.0])
    granted_to_m, present = np.full(3, FAR_M), np.ones(3, dtype=np.bool_)
    seen = detection.look(0.0, front_m, front_m - LENGTH_M, present, detection.initial())
    stop_m = detection.danger_m(front_m, front_m - LENGTH_M, present, granted_to_m, seen)[1]
    assert stop_m == 200.0
