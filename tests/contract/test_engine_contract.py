"""Whatever moves the trains keeps the same contract: the toy engine, SUMO, and both of its ways."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pytest

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.dwell import DwellDelays, Overstay
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.world import World
from kankaku.railway.step.engine_contract import Engine, Observation
from kankaku.sumo_net.build import build, build_witness
from kankaku.sumo_net.engine import SumoEngine
from kankaku.sumo_net.witness_engine import WitnessEngine
from kankaku.testing.example_lines import merge_scenario, two_station_scenario, world_of
from kankaku.testing.toy_engine import ToyEngine
from tests.ends_of_ways import joint_scenario, short_turn_scenario

READY_S = 25_200.0
CRUISE_MPS = 20.0


Opener: TypeAlias = Callable[[Scenario], AbstractContextManager[Engine]]
Policy: TypeAlias = Callable[[Observation], FloatArray]


@pytest.fixture
def open_sumo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Opener:
    monkeypatch.setenv("KANKAKU_CACHE", str(tmp_path / "cache"))

    def opener(scenario: Scenario) -> AbstractContextManager[Engine]:
        world = world_of(scenario)
        delay_s = scenario.dwell_delays.draw(scenario.timetable, scenario.seed)
        return SumoEngine(build(scenario, world, delay_s, tmp_path / "run"), world)

    return opener


@pytest.fixture
def open_witness(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Opener:
    monkeypatch.setenv("KANKAKU_CACHE", str(tmp_path / "cache"))

    def opener(scenario: Scenario) -> AbstractContextManager[Engine]:
        world = world_of(scenario)
        delay_s = scenario.dwell_delays.draw(scenario.timetable, scenario.seed)
        return WitnessEngine(build_witness(scenario, world, delay_s, tmp_path / "run"), world)

    return opener


def open_toy(scenario: Scenario) -> AbstractContextManager[Engine]:
    delay_s = scenario.dwell_delays.draw(scenario.timetable, scenario.seed)
    return ToyEngine(world_of(scenario), delay_s, scenario.step_s)


@pytest.fixture(params=["toy", "sumo", "witness"])
def open_engine(request: pytest.FixtureRequest) -> Opener:
    if request.param == "toy":
        return open_toy
    opener: Opener = request.getfixturevalue(f"open_{request.param}")
    return opener


class Driver:
    """Accelerates at 0.9 m/s2, runs at 20 m/s, brakes at 1 m/s2 to the next stop; sees no train."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._call = np.zeros(world.size, dtype=np.intp)

    def __call__(self, seen: Observation) -> FloatArray:
        self._call[list(seen.released)] += 1
        step_s = self._world.step_s
        stop_m = self._world.stop_m[np.arange(self._call.size), self._call]
        ahead_m = np.maximum(stop_m - seen.front_m, 0.0)
        half = 0.5 * step_s
        root = np.sqrt(np.maximum(half * half + 2.0 * ahead_m - step_s * seen.speed_mps, 0.0))
        fastest = np.minimum(seen.speed_mps + 0.9 * step_s, CRUISE_MPS)
        return np.clip(root - half, 0.0, fastest)


def run(
    engine: AbstractContextManager[Engine], policy: Policy, until_s: float
) -> list[Observation]:
    seen = []
    with engine as running:
        while True:
            now = running.observe()
            seen.append(now)
            if now.time_s >= until_s:
                return seen
            running.apply(policy(now))
            running.advance()


def driven(opener: Opener, scenario: Scenario, until_s: float) -> list[Observation]:
    return run(opener(scenario), Driver(world_of(scenario)), until_s)


def times(seen: list[Observation], event: str, train: int) -> list[float]:
    return [now.time_s for now in seen if train in getattr(now, event)]


def test_first_observation_shows_an_empty_line_before_the_first_booking(
    open_engine: Opener,
) -> None:
    scenario = two_station_scenario(2)
    with open_engine(scenario) as engine:
        seen = engine.observe()
    assert READY_S - 3.0 <= seen.time_s <= READY_S
    assert (seen.entered, seen.stopped, seen.released, seen.left) == ((), (), (), ())
    assert seen.front_m.tolist() == [300.0, 300.0]
    assert seen.speed_mps.tolist() == [0.0, 0.0]


@pytest.mark.parametrize("step_s", [0.1, 0.3, 0.5, 1.0])
def test_time_advances_by_whole_steps(open_engine: Opener, step_s: float) -> None:
    seen = driven(open_engine, two_station_scenario(1, step_s=step_s), READY_S + 40.0)
    assert np.diff([now.time_s for now in seen]) == pytest.approx(step_s, abs=1e-9)


def test_train_enters_at_its_booked_time_and_its_stop_begins_at_once(open_engine: Opener) -> None:
    seen = driven(open_engine, two_station_scenario(2, headway_s=120.0), READY_S + 200.0)
    for train, ready_s in enumerate((READY_S, READY_S + 120.0)):
        assert times(seen, "entered", train) == [ready_s]
        assert times(seen, "stopped", train)[0] == ready_s


def test_train_stands_while_its_stop_lasts_whatever_is_commanded(open_engine: Opener) -> None:
    seen = run(
        open_engine(two_station_scenario(1)), lambda _: np.full(1, CRUISE_MPS), READY_S + 30.0
    )
    assert times(seen, "released", 0) == [READY_S + 30.0]
    assert {float(now.front_m[0]) for now in seen} == {300.0}
    assert {float(now.speed_mps[0]) for now in seen} == {0.0}


Words: TypeAlias = Mapping[float, float]
"""Until when stops are held, by when that is said; both since the first train was ready. [s]"""


def held(
    opener: Opener, scenario: Scenario, words: Words, until_s: float, row: int = 0
) -> list[float]:
    """Return when a train is released whose stops are held."""
    world, left = world_of(scenario), sorted(words.items(), reverse=True)
    driver, released = Driver(world), []
    with opener(scenario) as engine:
        while (now := engine.observe()).time_s < until_s:
            released += [now.time_s - READY_S] if row in now.released else []
            if left and now.time_s - READY_S > left[-1][0] - 1e-6:
                until = np.full(world.size, -np.inf)
                until[row] = READY_S + left.pop()[1]
                engine.hold(until)
            engine.apply(driver(now))
            engine.advance()
    return released


@pytest.mark.parametrize(
    ("words", "released_s"),
    [
        ({10.0: 50.0}, 50.0),  # beyond the booked departure at 30 s
        ({0.0: 50.0}, 50.0),  # in the observation in which the stop begins
        ({29.0: 29.5}, 30.0),  # for less than it lasts anyway
        ({-1.0: 50.0}, 30.0),  # before there is a stop
        ({10.0: 60.0, 20.0: 40.2}, 40.5),  # a shorter hold instead of a longer one
        ({10.0: 60.0, 20.0: 25.0}, 30.0),  # none instead of one
        ({10.0: 60.0, 45.0: -np.inf}, 45.5),  # lifted when the stop would long be over
        ({10.0: np.inf, 45.0: 48.0}, 48.0),
        ({29.5: 47.3}, 47.5),  # at the last moment
    ],
)
def test_a_stop_that_is_held_lasts_so_long(
    open_engine: Opener, words: Words, released_s: float
) -> None:
    found = held(open_engine, two_station_scenario(1), words, READY_S + 70.0)
    assert found == pytest.approx([released_s])


@pytest.mark.parametrize("step_s", [0.1, 0.5])
def test_a_stop_on_the_way_is_held_beyond_its_delay(open_engine: Opener, step_s: float) -> None:
    delays = DwellDelays(overstays=(Overstay("T2", "east", 41.2),))
    scenario = two_station_scenario(2, headway_s=120.0, run_s=60.0, delays=delays, step_s=step_s)
    # It arrives about 71 s after its departure, and overstays until about 287 s.
    words = {150.0 + 75.0: 330.0, 240.0: 320.0, 290.0: 310.3}
    _, found = held(open_engine, scenario, words, READY_S + 340.0, row=1)
    assert 310.3 - 1e-6 <= found < 310.3 + step_s


def test_train_without_a_command_stays_after_its_stop(open_engine: Opener) -> None:
    seen = run(open_engine(two_station_scenario(1)), lambda _: np.zeros(1), READY_S + 60.0)
    assert seen[-1].front_m[0] == 300.0


@pytest.mark.parametrize("step_s", [0.1, 0.5])
def test_each_step_is_one_of_constant_acceleration(open_engine: Opener, step_s: float) -> None:
    commands = np.random.default_rng(5).uniform(0.0, 25.0, 10_000)
    scenario = two_station_scenario(1, step_s=step_s)
    number = iter(commands)
    seen = run(open_engine(scenario), lambda _: np.array([next(number)]), READY_S + 60.0)
    moving = [now for now in seen if now.time_s >= READY_S + 30.0]
    speed = np.array([now.speed_mps[0] for now in moving])
    front = np.array([now.front_m[0] for now in moving])
    expected = 300.0 + np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * step_s)])
    assert front == pytest.approx(expected, abs=1e-6)
    first = len(seen) - len(moving)
    assert speed[1:] == pytest.approx(commands[first : first + speed.size - 1], abs=1e-9)


def test_early_train_departs_at_its_booked_time(open_engine: Opener) -> None:
    seen = driven(open_engine, two_station_scenario(1, run_s=90.0, dwell_s=30.0), READY_S + 160.0)
    assert times(seen, "stopped", 0)[1] < READY_S + 110.0
    assert times(seen, "released", 0) == [READY_S + 30.0, READY_S + 150.0]


@pytest.mark.parametrize("step_s", [0.1, 0.5])
def test_late_train_stops_for_its_minimum_dwell_and_its_delay(
    open_engine: Opener, step_s: float
) -> None:
    delays = DwellDelays(overstays=(Overstay("T1", "west", 7.3), Overstay("T1", "east", 41.2)))
    scenario = two_station_scenario(1, run_s=60.0, delays=delays, step_s=step_s)
    seen = driven(open_engine, scenario, READY_S + 250.0)
    for arrived_s, released_s, delay_s in zip(
        times(seen, "stopped", 0), times(seen, "released", 0), (7.3, 41.2), strict=True
    ):
        assert 0.0 <= released_s - (arrived_s + 25.0 + delay_s) + 1e-6 < step_s + 1e-6


def test_stop_begins_the_moment_the_train_stands_at_its_stop_position(open_engine: Opener) -> None:
    seen = driven(open_engine, two_station_scenario(1), READY_S + 140.0)
    arrived_s = times(seen, "stopped", 0)[1]
    before, at = (next(n for n in seen if n.time_s == arrived_s - back) for back in (0.5, 0.0))
    assert before.speed_mps[0] > 0.0
    assert at.speed_mps[0] == 0.0
    assert at.front_m[0] == pytest.approx(1300.0, abs=0.5)


@pytest.mark.parametrize("off_m", [-0.49, 0.0, 0.49])
def test_stop_begins_within_half_a_metre(open_engine: Opener, off_m: float) -> None:
    def jump(seen: Observation) -> FloatArray:
        # Two steps of half a second: up to the speed that covers the distance, and down.
        return np.array([2.0 * (1000.0 + off_m) if seen.time_s == READY_S + 30.0 else 0.0])

    seen = run(open_engine(two_station_scenario(1)), jump, READY_S + 40.0)
    assert times(seen, "stopped", 0) == [READY_S, READY_S + 31.0]
    assert seen[-1].front_m[0] == pytest.approx(1300.0 + off_m, abs=1e-6)


@pytest.mark.parametrize("off_m", [-0.6, -5.0, -100.0])
def test_no_stop_begins_where_the_train_stands_short(open_engine: Opener, off_m: float) -> None:
    def jump(seen: Observation) -> FloatArray:
        return np.array([2.0 * (1000.0 + off_m) if seen.time_s == READY_S + 30.0 else 0.0])

    seen = run(open_engine(two_station_scenario(1)), jump, READY_S + 60.0)
    assert times(seen, "stopped", 0) == [READY_S]
    assert seen[-1].front_m[0] == pytest.approx(1300.0 + off_m, abs=1e-6)


def test_every_event_is_reported_once(open_engine: Opener) -> None:
    seen = driven(open_engine, two_station_scenario(3, headway_s=120.0), READY_S + 500.0)
    for train in range(3):
        counts = [
            len(times(seen, name, train)) for name in ("entered", "stopped", "released", "left")
        ]
        assert counts == [1, 2, 2, 1]
    assert all(now.collided == () for now in seen)


def test_train_leaves_when_its_front_passes_the_end(open_engine: Opener) -> None:
    seen = driven(open_engine, two_station_scenario(1), READY_S + 220.0)
    (left_s,) = times(seen, "left", 0)
    before = next(now for now in seen if now.time_s == left_s - 0.5)
    assert before.front_m[0] < 1800.0 <= before.front_m[0] + 0.5 * CRUISE_MPS
    assert (seen[-1].front_m[0], seen[-1].speed_mps[0]) == (1800.0, 0.0)


def test_a_train_whose_service_ends_on_the_way_leaves_when_its_last_stop_is_over(
    open_engine: Opener,
) -> None:
    seen = driven(open_engine, short_turn_scenario(3), READY_S + 560.0)
    assert times(seen, "left", 1) == times(seen, "released", 1)[1:] == [READY_S + 90.0 + 150.0]
    assert seen[-1].front_m[1] == 4000.0
    assert times(seen, "left", 0)[0] > times(seen, "released", 0)[2]
    assert [len(times(seen, "left", train)) for train in range(3)] == [1, 1, 1]


@pytest.mark.parametrize("step_s", [0.1, 0.5])
@pytest.mark.parametrize("beyond_m", [0.0, 0.3, 0.99, 1.0, 2.0, 5.0])
def test_a_train_may_stop_where_its_track_ends(
    open_engine: Opener, beyond_m: float, step_s: float
) -> None:
    seen = driven(open_engine, joint_scenario(beyond_m, step_s=step_s), READY_S + 290.0)
    arrived_s = times(seen, "stopped", 0)
    # 1 km from a stand to a stand: 22.2 s up to 20 m/s, 20 s down, and 577.8 m at 20 m/s.
    assert np.array(arrived_s[1:]) - [READY_S + 30.0, READY_S + 150.0] == pytest.approx(
        22.2 + 28.9 + 20.0, abs=2.0 * step_s + 0.1
    )
    (left_s,) = times(seen, "left", 0)
    if beyond_m < 1.0:
        assert left_s == READY_S + 270.0
    else:
        # What is left of the line, at 0.9 m/s2.
        run_s = np.sqrt(2.0 * beyond_m / 0.9)
        assert left_s == pytest.approx(READY_S + 270.0 + run_s, abs=1.0)


@pytest.mark.parametrize("beyond_m", [0.0, 0.4])
def test_a_train_that_does_not_call_at_the_buffer_stop_leaves_there(
    open_engine: Opener, beyond_m: float
) -> None:
    seen = driven(open_engine, joint_scenario(beyond_m, through=True), READY_S + 230.0)
    (left_s,) = times(seen, "left", 0)
    before = next(now for now in seen if now.time_s == left_s - 0.5)
    assert before.front_m[0] < 2200.0 + beyond_m <= before.front_m[0] + 0.5 * CRUISE_MPS


def test_trains_of_two_platform_tracks_merge(open_engine: Opener) -> None:
    seen = driven(open_engine, merge_scenario(2, headway_s=90.0), READY_S + 320.0)
    first, second = (times(seen, "stopped", train) for train in (0, 1))
    assert second == [at_s + 90.0 for at_s in first]
    assert len(times(seen, "left", 1)) == 1


def test_both_platform_tracks_may_be_occupied(open_engine: Opener) -> None:
    seen = driven(open_engine, merge_scenario(2, headway_s=10.0), READY_S + 20.0)
    assert times(seen, "entered", 1) == [READY_S + 10.0]


@pytest.mark.parametrize("block_m", [None, 150.0, 900.0])
def test_train_waits_outside_until_its_platform_is_free(
    open_engine: Opener, block_m: float | None
) -> None:
    scenario = two_station_scenario(2, headway_s=40.0, block_m=block_m)
    seen = driven(open_engine, scenario, READY_S + 70.0)
    (entered_s,) = times(seen, "entered", 1)
    assert entered_s > READY_S + 40.0
    free_s = next(now.time_s for now in seen if now.front_m[0] - 200.0 >= 300.0)
    assert entered_s == pytest.approx(free_s, abs=0.5)


def test_earlier_observations_do_not_change(open_engine: Opener) -> None:
    with open_engine(two_station_scenario(1)) as engine:
        first = engine.observe()
        kept = first.front_m.copy(), first.speed_mps.copy()
        for _ in range(80):
            engine.apply(np.full(1, CRUISE_MPS))
            engine.advance()
            last = engine.observe()
    assert last.front_m[0] > 300.0
    assert (first.front_m.tolist(), first.speed_mps.tolist()) == tuple(k.tolist() for k in kept)


@pytest.mark.parametrize("block_m", [None, 200.0])
def test_sumo_and_the_toy_agree(open_sumo: Opener, block_m: float | None) -> None:
    delays = DwellDelays(overstays=(Overstay("T2", "east", 33.0),))
    scenario = merge_scenario(4, headway_s=120.0, block_m=block_m, delays=delays)
    until_s = READY_S + 700.0
    for ours, theirs in zip(
        driven(open_toy, scenario, until_s), driven(open_sumo, scenario, until_s), strict=True
    ):
        assert ours.front_m == pytest.approx(theirs.front_m, abs=1e-6)
        assert ours.speed_mps == pytest.approx(theirs.speed_mps, abs=1e-9)
        assert (ours.time_s, *ours[3:]) == (theirs.time_s, *theirs[3:])


@pytest.mark.parametrize("block_m", [None, 200.0])
def test_sumo_and_the_toy_agree_on_trains_that_end_on_the_way(
    open_sumo: Opener, block_m: float | None
) -> None:
    delays = DwellDelays(overstays=(Overstay("T2", "mid", 33.0),))
    scenario = short_turn_scenario(4, block_m=block_m, delays=delays)
    until_s = READY_S + 700.0
    for ours, theirs in zip(
        driven(open_toy, scenario, until_s), driven(open_sumo, scenario, until_s), strict=True
    ):
        assert ours.front_m == pytest.approx(theirs.front_m, abs=1e-6)
        assert (ours.time_s, *ours[3:]) == (theirs.time_s, *theirs[3:])


@pytest.mark.parametrize("opener", ["open_sumo", "open_witness"])
def test_sumo_reports_a_collision_once(request: pytest.FixtureRequest, opener: str) -> None:
    open_sumo: Opener = request.getfixturevalue(opener)
    delays = DwellDelays(overstays=(Overstay("T1", "east", 300.0),))
    scenario = two_station_scenario(2, headway_s=90.0, delays=delays)
    seen = driven(open_sumo, scenario, READY_S + 250.0)
    collided = [now for now in seen if now.collided]
    assert [now.collided for now in collided] == [(0, 1)]
    assert collided[0].front_m[1] > collided[0].front_m[0] - 200.0
