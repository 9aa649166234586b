"""Stops and crawling between stations, found in steps laid out by hand and in runs."""

from dataclasses import replace

import numpy as np
import pytest

from kankaku.railway.arrays import FloatArray
from kankaku.railway.meters.standstill import StandstillWatch
from kankaku.railway.plan.world import World
from kankaku.railway.step.step_block import StepBlock
from kankaku.testing.example_lines import two_station_scenario, world_of
from tests.property.runs import run

STEP_S = 0.5


def block(
    start_s: float, front_m: FloatArray, speed_mps: FloatArray, *, moving: bool = True
) -> StepBlock:
    """One train, on its way to its second call."""
    steps = front_m.size - 1
    flags = np.ones((steps, 1), dtype=np.bool_)
    return StepBlock(
        rows=np.array([0]),
        time_s=start_s + STEP_S * np.arange(steps + 1, dtype=np.float64),
        front_m=front_m[:, np.newaxis],
        speed_mps=speed_mps[:, np.newaxis],
        eoa_m=np.full((steps + 1, 1), 3000.0),
        delay_s=np.zeros((steps + 1, 1)),
        next_call=np.ones((steps + 1, 1), dtype=np.intp),
        surprised=np.zeros((steps + 1, 1), dtype=np.bool_),
        present=flags,
        moving=flags & moving,
        halting=~flags,
    )


def crawling(at_m: float, speed_mps: float, lasts_s: float) -> tuple[FloatArray, FloatArray]:
    steps = round(lasts_s / STEP_S)
    front_m = at_m + speed_mps * STEP_S * np.arange(steps + 1, dtype=np.float64)
    return front_m, np.full(steps + 1, speed_mps)


@pytest.fixture
def world() -> World:
    """Stops at 300 m and 1300 m, platforms from 90 m to 310 m and from 1090 m to 1310 m."""
    return world_of(two_station_scenario(1))


def test_a_train_that_stands_thirty_seconds_between_stations_is_found(world: World) -> None:
    watch = StandstillWatch(world)
    speed_mps = np.concatenate([np.full(10, 5.0), np.zeros(60), np.full(11, 5.0)])
    front_m = 700.0 + STEP_S * np.concatenate([[0.0], np.cumsum(speed_mps[:-1])])
    # Two blocks share a step in the middle of the standstill.
    watch.add(block(0.0, front_m[:31], speed_mps[:31]))
    watch.add(block(15.0, front_m[30:], speed_mps[30:]))
    stands = watch.standstills()
    assert stands.start_s.tolist() == [5.0]
    assert stands.duration_s.tolist() == [30.0]
    assert stands.front_m.tolist() == [725.0]
    assert (stands.row.tolist(), stands.next_call.tolist()) == ([0], [1])


def test_a_standstill_that_is_not_over_counts_until_the_end(world: World) -> None:
    watch = StandstillWatch(world)
    watch.add(block(100.0, *crawling(700.0, 0.0, 20.0)))
    assert watch.standstills().duration_s.tolist() == [20.0]


@pytest.mark.parametrize("at_m", [300.0, 1300.0, 1299.5])
def test_at_a_booked_stop_a_train_does_not_stand_between_stations(
    world: World, at_m: float
) -> None:
    watch = StandstillWatch(world)
    watch.add(block(0.0, *crawling(at_m, 0.0, 30.0)))
    assert watch.standstills().row.size == 0


def test_a_train_held_by_its_stop_neither_stands_nor_crawls(world: World) -> None:
    watch = StandstillWatch(world)
    watch.add(block(0.0, *crawling(700.0, 0.0, 30.0), moving=False))
    assert watch.standstills().row.size == 0
    assert watch.crawl_s.tolist() == [0.0]


def test_short_of_the_stop_position_a_train_stands_even_at_the_platform(world: World) -> None:
    watch = StandstillWatch(world)
    watch.add(block(0.0, *crawling(1200.0, 0.0, 30.0)))
    assert watch.standstills().duration_s.tolist() == [30.0]
    assert watch.crawl_s.tolist() == [0.0]


@pytest.mark.parametrize(
    ("at_m", "speed_mps", "expected_s"),
    [
        (700.0, 2.7, 20.0),
        (700.0, 2.9, 0.0),
        (700.0, 0.0, 20.0),
        (1100.0, 2.0, 0.0),
        (100.0, 2.0, 0.0),
        # The tail is off the platform at 310 m after 10 s, rounded up to a step.
        (490.1, 2.0, 10.0),
        # The front is in the next platform at 1090 m after 10 s.
        (1070.1, 2.0, 10.0),
        # Held before the next platform.
        (1089.0, 0.0, 20.0),
    ],
)
def test_crawling_counts_below_ten_kmh_with_no_part_in_a_platform_of_its_own(
    world: World, at_m: float, speed_mps: float, expected_s: float
) -> None:
    watch = StandstillWatch(world)
    watch.add(block(0.0, *crawling(at_m, speed_mps, 20.0)))
    assert watch.crawl_s.tolist() == [pytest.approx(expected_s)]


def test_who_leaves_a_platform_that_ends_at_the_stop_does_not_crawl() -> None:
    scenario = two_station_scenario(1, step_s=STEP_S)
    short = tuple(replace(place, end_m=place.stop_m) for place in scenario.line.platforms)
    record, _ = run(replace(scenario, line=replace(scenario.line, platforms=short)))
    assert record.crawl_s.tolist() == [0.0]


def test_in_the_platform_of_another_track_or_station_a_train_crawls(world: World) -> None:
    # On the way to its second call, the train is in neither of its platforms.
    line = world.line
    other = replace(line.platforms[0], start_m=600.0, end_m=900.0, station="elsewhere")
    watch = StandstillWatch(replace(world, line=replace(line, platforms=(*line.platforms, other))))
    watch.add(block(0.0, *crawling(850.0, 2.0, 20.0)))
    assert watch.crawl_s.tolist() == [20.0]


def followers_stand_s(overstay_s: float) -> float:
    delay_s = np.zeros((2, 2))
    delay_s[0, 1] = overstay_s
    record, engine = run(two_station_scenario(2, 75.0), delay_s=delay_s)
    stands = record.standstills
    assert set(stands.row.tolist()) <= {1}
    # Its margin of 25 m behind the tail that stands at 1300 m.
    assert np.all(np.abs(stands.front_m - 1075.0) < 0.5)
    standing = (engine.speed_mps[:, 1] <= 0.05) & (np.abs(engine.front_m[:, 1] - 1075.0) < 0.5)
    assert stands.duration_s.sum() == pytest.approx(STEP_S * np.count_nonzero(standing))
    return float(stands.duration_s.sum())


def test_a_train_behind_an_overstaying_leader_stands_as_much_longer_as_the_leader() -> None:
    base_s = followers_stand_s(60.0)
    assert base_s > 5.0
    assert followers_stand_s(90.0) - base_s == pytest.approx(30.0)
