"""Points, level crossings, work zones and faults: who may go where, and from when on."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from kankaku.railway.plan.disruptions import (
    UNDISTURBED,
    Cause,
    Closure,
    Disruptions,
    Obstacle,
    PointsFailure,
)
from kankaku.railway.plan.line import Crossing, Line
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.world import World
from kankaku.railway.randomness import stream
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import Events
from kankaku.railway.wayside.signalling import RESERVE_M, RESERVE_S, Wayside
from kankaku.testing.example_lines import merge_scenario, two_station_scenario, world_of
from kankaku.testing.loop_station import loop_station_scenario
from tests.property.runs import READY_S, Observed, run
from tests.states import behind

LENGTH_M = 200.0
STEP_S = 0.5
THROW_S, PROOF_S = 5.0, 1.5
FAN_START_M, FAN_END_M = 940.0, 1060.0
STAND_M = 400.0
"""Where trains start. [m]"""


def with_throw(scenario: Scenario, throw_s: float = THROW_S, proof_s: float = PROOF_S) -> Scenario:
    line = scenario.line
    turnouts = tuple(replace(item, throw_s=throw_s, proof_s=proof_s) for item in line.turnouts)
    return replace(scenario, line=replace(line, turnouts=turnouts))


def with_crossing(scenario: Scenario, closing_s: float = 12.0) -> Scenario:
    crossing = Crossing("farm road", 800.0, 810.0, 500.0, closing_s)
    return replace(scenario, line=replace(scenario.line, crossings=(crossing,)))


class Stage:
    """Puts the trains of a world where a test wants them."""

    def __init__(self, world: World, disruptions: Disruptions = UNDISTURBED, seed: int = 1) -> None:
        self.world = world
        self.wayside = Wayside(world, disruptions, seed)
        self.everybody = np.ones(world.size, dtype=np.bool_)

    def at(
        self, time_s: float, fronts_m: Sequence[float], speed_mps: float = 0.0, **events: tuple[int]
    ) -> tuple[int, ...]:
        front_m = np.array(fronts_m)
        speeds_mps = np.full(front_m.size, speed_mps)
        tails_m = front_m - self.world.length_m
        return self.wayside.update(
            time_s, (front_m, tails_m, speeds_mps), self.everybody, Events(**events)
        )

    @property
    def obstructed_m(self) -> list[float]:
        return [float(place_m) for place_m in self.wayside.state.obstructed_m]


def loop_stage(trains: int = 3, disruptions: Disruptions = UNDISTURBED) -> Stage:
    return Stage(world_of(with_throw(loop_station_scenario(trains))), disruptions)


def test_points_are_granted_when_they_are_cleared_thrown_and_proven() -> None:
    stage = loop_stage()
    far_m = stage.world.far_m
    stage.at(0.0, [STAND_M] * 3)
    # T2 goes the other way, and T3 waits for T2's turn although it goes the way of T1.
    assert stage.obstructed_m == [far_m, FAN_START_M, FAN_START_M]
    stage.at(10.0, [FAN_END_M + LENGTH_M - 0.01, STAND_M, STAND_M])
    assert stage.obstructed_m[1] == FAN_START_M
    stage.at(20.0, [FAN_END_M + LENGTH_M, STAND_M, STAND_M])
    assert stage.obstructed_m[1] == FAN_START_M
    assert stage.wayside.state.until_s[0] == 20.0 + THROW_S + PROOF_S
    stage.at(26.0, [1600.0, STAND_M, STAND_M])
    assert stage.obstructed_m[1] == FAN_START_M
    signalled = stage.at(26.5, [1600.0, STAND_M, STAND_M])
    assert signalled == (1,)
    # From now on T1's tail keeps T2 from the far points, where T1 goes first.
    assert stage.obstructed_m == [far_m, 1740.0, FAN_START_M]
    (record,) = stage.wayside.obstructions()
    assert record.id == "fan"
    assert record.cause is Cause.POINTS
    assert (record.established_s, record.lifted_s) == (20.0, 26.5)


def test_points_that_move_in_no_time_are_granted_at_once() -> None:
    stage = Stage(world_of(loop_station_scenario(3)))
    stage.at(0.0, [STAND_M] * 3)
    assert stage.obstructed_m[1] == FAN_START_M
    stage.at(20.0, [FAN_END_M + LENGTH_M, STAND_M, STAND_M])
    assert stage.obstructed_m[1] == 1740.0
    assert stage.wayside.obstructions() == ()


def test_trains_that_go_the_same_way_follow_each_other_through_points() -> None:
    scenario = merge_scenario(3)
    services = tuple(
        replace(service, route=("north", "main"), calls=scenario.timetable.services[0].calls)
        for service in scenario.timetable.services
    )
    world = world_of(replace(scenario, timetable=replace(scenario.timetable, services=services)))
    stage = Stage(world)
    stage.at(0.0, [300.0] * 3)
    assert stage.obstructed_m == [world.far_m] * 3


@pytest.mark.parametrize(
    ("window", "proven_s"),
    [
        # Thrown again when the window ends, and proven as long after.
        ((15.0, 60.0), 60.0 + THROW_S + PROOF_S),
        # A window that begins during the throw catches it, too; one that is over does not.
        ((26.0, 60.0), 60.0 + THROW_S + PROOF_S),
        ((0.0, 20.0), 20.0 + THROW_S + PROOF_S),
    ],
)
def test_points_that_fail_stay_unproven_until_they_are_repaired(
    window: tuple[float, float], proven_s: float
) -> None:
    stage = loop_stage(2, Disruptions(points_failures=(PointsFailure("fan", *window),)))
    stage.at(0.0, [STAND_M] * 2)
    for time_s in np.arange(20.0, 100.0, STEP_S).tolist():
        stage.at(time_s, [1600.0, STAND_M])
        waits = stage.obstructed_m[1] == FAN_START_M
        assert waits == (time_s < proven_s)
        if 20.0 + THROW_S + PROOF_S <= time_s < window[1]:
            assert stage.wayside.state.until_s[0] == np.inf
    (record,) = stage.wayside.obstructions()
    assert (record.established_s, record.lifted_s) == (20.0, proven_s)


def test_random_failures_are_keyed_and_repaired_after_their_time() -> None:
    ratio, repair_s = 0.4, 100.0
    disruptions = Disruptions(points_failure_ratio=ratio, points_repair_s=repair_s)
    for seed in range(8):
        world = world_of(with_throw(loop_station_scenario(2)))
        stage = Stage(world, disruptions, seed)
        fails = stream(seed, "points", "fan", "T2").random() < ratio
        stage.at(0.0, [STAND_M] * 2)
        for time_s in np.arange(20.0, 200.0, STEP_S).tolist():
            stage.at(time_s, [1600.0, STAND_M])
        once_s = THROW_S + PROOF_S
        took_s = stage.wayside.obstructions()[0].lifted_s - 20.0
        assert took_s == (once_s + repair_s + once_s if fails else once_s)


def test_a_crossing_is_passed_by_those_it_is_closed_for() -> None:
    stage = Stage(world_of(with_crossing(two_station_scenario(3))))
    far_m = stage.world.far_m
    stage.at(0.0, [499.0, 300.0, 300.0])
    assert stage.obstructed_m == [800.0] * 3
    stage.at(10.0, [500.0, 300.0, 300.0])
    assert stage.wayside.state.until_s[0] == 22.0
    assert stage.obstructed_m == [800.0] * 3
    stage.at(21.5, [600.0, 300.0, 300.0])
    assert stage.obstructed_m[0] == 800.0
    stage.at(22.0, [610.0, 300.0, 300.0])
    assert stage.obstructed_m == [far_m, 800.0, 800.0]
    # It stays closed for a second train as long as the first has not cleared it.
    stage.at(30.0, [900.0, 500.0, 300.0])
    assert stage.obstructed_m == [far_m, far_m, 800.0]
    stage.at(40.0, [1010.0, 700.0, 300.0])
    assert stage.obstructed_m == [far_m, far_m, 800.0]
    stage.at(50.0, [1300.0, 1010.0, 300.0])
    stage.at(60.0, [1300.0, 1100.0, 500.0])
    assert stage.wayside.state.until_s[0] == 72.0
    assert stage.obstructed_m == [far_m, far_m, 800.0]
    assert stage.wayside.obstructions() == ()


def test_an_obstacle_stops_those_before_the_crossing_and_nobody_on_it() -> None:
    scenario = with_crossing(two_station_scenario(2))
    stage = Stage(world_of(scenario), Disruptions(obstacles=(Obstacle("farm road", 30.0, 50.0),)))
    far_m = stage.world.far_m
    stage.at(0.0, [600.0, 550.0])
    stage.at(12.0, [790.0, 560.0])
    assert stage.obstructed_m == [far_m, far_m]
    stage.at(30.0, [850.0, 640.0], speed_mps=10.0)
    assert stage.obstructed_m == [far_m, 800.0]
    # 160 m are less than 10 s of running, 50 m of braking and what trains may be held before.
    assert stage.wayside.state.surprised.tolist() == [False, True]
    for time_s, surprised in ((35.0, True), (44.5, True), (45.0, False)):
        stage.at(time_s, [900.0, 700.0])
        assert stage.wayside.state.surprised.tolist() == [False, surprised]
    stage.at(50.0, [900.0, 700.0])
    assert stage.obstructed_m == [far_m, far_m]
    (record,) = stage.wayside.obstructions()
    assert (record.cause, record.established_s, record.lifted_s) == (Cause.OBSTACLE, 30.0, 50.0)


def test_somebody_who_is_caught_by_the_gates_keeps_them_from_being_passed() -> None:
    ratio, stays_s = 0.5, 20.0
    disruptions = Disruptions(obstacle_ratio=ratio, obstacle_s=stays_s)
    for seed in range(8):
        stage = Stage(world_of(with_crossing(two_station_scenario(1))), disruptions, seed)
        caught = stream(seed, "crossing", "farm road", "T1").random() < ratio
        stage.at(0.0, [500.0])
        for time_s in np.arange(1.0, 40.0, STEP_S).tolist():
            stage.at(time_s, [600.0])
            free_s = 12.0 + (stays_s if caught else 0.0)
            assert (stage.obstructed_m[0] > 800.0) == (time_s >= free_s)
            assert not stage.wayside.state.surprised.any()


def zone(**changes: float | str | tuple[str, ...] | Cause) -> Closure:
    one = Closure("zone", Cause.WORK, ("main",), 1000.0, 1100.0, 100.0, 200.0, 200.0)
    return replace(one, **changes)  # type: ignore[arg-type]


def test_a_work_zone_is_announced_before_it_holds_anybody() -> None:
    stage = Stage(world_of(two_station_scenario(2)), Disruptions((zone(),)))
    stage.at(0.0, [1050.0, 300.0])
    seen = stage.wayside.state
    assert seen.from_s.tolist() == [100.0]
    assert seen.until_s.tolist() == [200.0]
    assert seen.concerns[:, 0].tolist() == [False, True]
    assert stage.obstructed_m == [stage.world.far_m] * 2
    assert stage.wayside.obstructions() == ()


def stops_at_m(front_m: float, speed_mps: float) -> float:
    """Closed form of the reserve: 10 s on, braking at 1 m/s2, and what may be held before."""
    return front_m + RESERVE_S * speed_mps + 0.5 * speed_mps**2 + RESERVE_M


@pytest.mark.parametrize(("short_m", "held"), [(0.5, True), (-0.5, False)])
def test_a_train_is_let_through_that_cannot_stop_short_with_a_reserve(
    short_m: float, held: bool
) -> None:
    stage = Stage(world_of(two_station_scenario(1)), Disruptions((zone(),)))
    front_m = 1000.0 - short_m - stops_at_m(0.0, 20.0)
    stage.at(99.5, [front_m], 20.0)
    stage.at(100.0, [front_m], 20.0)
    assert stage.wayside.state.from_s.tolist() == [-np.inf]
    assert stage.wayside.state.concerns[0, 0] == held
    assert stage.obstructed_m[0] == (1000.0 if held else stage.world.far_m)
    assert not stage.wayside.state.surprised.any()
    assert stage.wayside.unsettled


def test_a_work_zone_is_established_when_nobody_can_come_any_more() -> None:
    stage = Stage(world_of(two_station_scenario(2)), Disruptions((zone(),)))
    stage.at(100.0, [990.0, 300.0], 20.0)
    unsettled = [stage.wayside.unsettled]
    # The first train is on its way through, and the second goes by what it was told earlier.
    for time_s, fronts_m, covered_m in (
        (100.0, (990.0, 300.0), 975.0),
        (120.0, (1300.0, 600.0), 1150.0),
        (121.0, (1310.0, 620.0), 975.0),
    ):
        stage.at(time_s, fronts_m, 20.0)
        state = behind(stage.world, *fronts_m, time_s=time_s)
        stage.wayside.settle(state, np.array([2000.0, covered_m]))
        unsettled.append(stage.wayside.unsettled)
    assert unsettled == [True, True, True, False]
    (record,) = stage.wayside.obstructions()
    assert record.requested_s == 100.0
    assert record.established_s == 121.0
    assert np.isnan(record.lifted_s)


@pytest.mark.parametrize("released_s", [150.0, 200.0, 260.0])
def test_a_work_zone_ends_when_it_is_released_whatever_was_announced(released_s: float) -> None:
    stage = Stage(world_of(two_station_scenario(1)), Disruptions((zone(released_s=released_s),)))
    for time_s in np.arange(90.0, 280.0, STEP_S).tolist():
        stage.at(time_s, [300.0])
        if time_s < 100.0:
            continue
        assert (stage.obstructed_m[0] == 1000.0) == (time_s < released_s)
        announced = time_s < min(200.0, released_s)
        assert stage.wayside.state.until_s[0] == (200.0 if announced else np.inf)
    assert stage.wayside.obstructions()[0].lifted_s == released_s


def test_who_stands_behind_a_train_that_is_kept_out_is_kept_out_too() -> None:
    stage = Stage(world_of(two_station_scenario(2)), Disruptions((zone(),)))
    front_m, speeds_mps = np.array([990.0, 780.0]), np.array([0.0, 20.0])
    tails_m = front_m - LENGTH_M
    stage.wayside.update(100.0, (front_m, tails_m, speeds_mps), stage.everybody, Events())
    assert stage.wayside.state.concerns[:, 0].tolist() == [True, True]


def test_a_fault_is_in_force_at_once_for_all_that_have_not_come_to_it() -> None:
    fault = zone(cause=Cause.FAILURE, until_s=np.inf)
    stage = Stage(world_of(two_station_scenario(3)), Disruptions((fault,)))
    stage.at(99.5, [1010.0, 790.0, 300.0], 20.0)
    assert not stage.wayside.state.concerns.any()
    signalled = stage.at(100.0, [1020.0, 800.0, 300.0], 20.0)
    assert signalled == (1, 2)
    assert stage.obstructed_m == [stage.world.far_m, 1000.0, 1000.0]
    assert stage.wayside.state.surprised.tolist() == [False, True, False]
    assert stage.wayside.state.until_s.tolist() == [np.inf]
    assert not stage.wayside.unsettled
    # One that cannot help it runs into it, and stays until it is repaired.
    stage.at(115.0, [1400.0, 1005.0, 300.0])
    assert stage.obstructed_m[1] == 1000.0
    stage.at(200.0, [1500.0, 1005.0, 300.0])
    assert stage.obstructed_m == [stage.world.far_m] * 3


def test_other_tracks_are_not_concerned() -> None:
    place = {"tracks": ("south",), "start_m": 1200.0, "end_m": 1300.0}
    stage = Stage(world_of(loop_station_scenario(4)), Disruptions((zone(**place),)))  # type: ignore[arg-type]
    stage.at(100.0, [STAND_M] * 4)
    assert stage.wayside.state.concerns[:, -1].tolist() == [False, True, False, True]


def test_states_are_snapshots_and_nothing_changes_between_events() -> None:
    stage = loop_stage(2)
    stage.at(0.0, [STAND_M] * 2)
    first = stage.wayside.state
    kept = [np.copy(values) for values in first]
    assert stage.at(0.5, [500.0, STAND_M]) == ()
    assert stage.wayside.state is first
    stage.at(20.0, [1600.0, STAND_M])
    assert stage.wayside.state is not first
    assert all(map(np.array_equal, first, kept))


def throws(record: RunRecord, name: str) -> list[tuple[float, float]]:
    return [(o.established_s, o.lifted_s) for o in record.obstructions if o.id == name]


def test_a_train_passes_points_when_they_are_proven() -> None:
    """The second train waits at the merge until the first has cleared it, and the throw."""
    scenario = merge_scenario(2, 20.0, dwell_s=5.0)
    records: list[tuple[RunRecord, Observed]] = [
        run(item) for item in (scenario, with_throw(scenario, 20.0, 1.5))
    ]
    engine = records[1][1]
    cleared_s = engine.passes_s(0, 410.0 + LENGTH_M)
    (thrown,) = throws(records[1][0], "throat")
    assert thrown[0] == pytest.approx(cleared_s, abs=STEP_S)
    assert thrown[1] == thrown[0] + 21.5
    # It draws up to 25 m before the fouling point, and no further.
    for (_, seen), granted_s in zip(records, thrown, strict=True):
        assert granted_s < seen.passes_s(1, 315.1) < granted_s + 5.0
    assert all(record.violations == () for record, _ in records)


def test_a_closure_ends_a_run_no_later_than_its_end_allows() -> None:
    scenario = two_station_scenario(2, 120.0)
    closed = zone(start_m=700.0, end_m=900.0, from_s=READY_S, until_s=READY_S + 300.0)
    closed = replace(closed, released_s=READY_S + 300.0)
    record, engine = run(replace(scenario, disruptions=Disruptions((closed,))))
    assert record.violations == ()
    assert record.completed.all()
    # It stands 25 m short of the zone, and needs 20 s or more from there.
    arrived_s = float(record.arrival_s[0, 1])
    assert READY_S + 320.0 < arrived_s < READY_S + 400.0
    before = engine.time_s < READY_S + 300.0
    assert engine.front_m[before].max() == pytest.approx(675.0, abs=0.1)
    (logged,) = record.obstructions
    assert logged.established_s == pytest.approx(READY_S, abs=STEP_S)


def crossing_line(line: Line) -> Line:
    return replace(line, crossings=(Crossing("road", 800.0, 810.0, 700.0, 15.0),))


def test_a_late_strike_in_costs_time_and_nothing_else() -> None:
    scenario = two_station_scenario(1)
    plain, _ = run(scenario)
    record, engine = run(replace(scenario, line=crossing_line(scenario.line)))
    assert record.violations == ()
    assert record.arrival_s[0, 1] > plain.arrival_s[0, 1] + 5.0
    assert engine.passes_s(0, 800.0) >= engine.passes_s(0, 700.0) + 15.0
