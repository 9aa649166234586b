"""The rules of approach-point control, on small lines with a platform section for one train."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from kankaku.controllers.operation import approach_point as rules
from kankaku.controllers.operation.approach_plan import ApproachPoint, Site, approach_point
from kankaku.controllers.operation.approach_point import ApproachPlans
from kankaku.controllers.operation.close_up import NO_CEILING_MPS, no_advice
from kankaku.controllers.registry import ControllerError, build
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.scenario import ControllerSpec, Option, Scenario
from kankaku.railway.plan.timetable import Timetable
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Controller, Drive, Operation
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import NO_REASON, Advice, Authority, LineState
from kankaku.testing.example_lines import commuter_train, two_station_scenario, world_of
from kankaku.testing.loop_station import loop_station_scenario
from tests.property.runs import Observed, run

STEP_S = 0.1
RADIO: Mapping[str, Option] = {
    "margin_m": 0.0,
    "position_error_percent": 0.1,
    "position_resolution_m": 2.0,
    "communication_delay_s": 0.5,
    "exclusive_platform": True,
}
LEADER, FOLLOWER = 0, 1
EAST = 1


def controller_of(world: World, operation: str, patience_s: float | None = None) -> Controller:
    options = {} if patience_s is None else {"patience_s": patience_s}
    return build(ControllerSpec("test", "moving_block", operation, RADIO, options), world)


class Asked(NamedTuple):
    """One question to the operation, and its answer."""

    state: LineState
    authority: Authority
    advice: Advice
    plans: ApproachPlans


class Watched:
    """An operation that keeps what it was asked and what it answered."""

    def __init__(self, operation: Operation[ApproachPlans]) -> None:
        self._operation = operation
        self.reasons = operation.reasons
        self.asked: list[Asked] = []

    def initial(self) -> ApproachPlans:
        return self._operation.initial()

    def advise(
        self, state: LineState, authority: Authority, memory: ApproachPlans
    ) -> tuple[Advice, ApproachPlans]:
        advice, plans = self._operation.advise(state, authority, memory)
        self.asked.append(Asked(state, authority, advice, plans))
        return advice, plans

    def first(self, row: int, reason: int) -> Asked | None:
        """The first time that a train was advised for a reason."""
        return next((asked for asked in self.asked if asked.advice.reason[row] == reason), None)

    def outside(self, row: int) -> set[tuple[int, float]]:
        """For which calls and where a train was to stop until its leader departs."""
        return {
            (int(asked.plans.call[row]), float(asked.plans.stop_m[row]))
            for asked in self.asked
            if np.isfinite(asked.plans.stop_from_s[row])
        }


class Watch(NamedTuple):
    """A run, what the operation said in it, and the drive."""

    record: RunRecord
    engine: Observed
    watched: Watched
    drive: Drive


def watch(scenario: Scenario, overstay_s: float, patience_s: float = 0.0) -> Watch:
    """The first train overstays at its second call."""
    world = world_of(scenario)
    plain = controller_of(world, "approach_point", patience_s)
    watched = Watched(plain.operation)
    controller = replace(plain, operation=watched)
    record, engine = run(scenario, controller=controller, delay_s=overstay(world, overstay_s))
    assert record.violations == ()
    assert record.completed.all()
    return Watch(record, engine, watched, plain.drive)


def overstay(world: World, seconds: float) -> FloatArray:
    delay_s = np.zeros(world.booked_arrival_s[:, :-1].shape)
    delay_s[LEADER, EAST] = seconds
    return delay_s


def close_up(scenario: Scenario, overstay_s: float) -> tuple[RunRecord, Observed]:
    world = world_of(scenario)
    controller = controller_of(world, "close_up")
    return run(scenario, controller=controller, delay_s=overstay(world, overstay_s))


def two_trains(trains: int = 2) -> Scenario:
    """Stations 2 km apart; the follower is on the way when the leader should leave."""
    return two_station_scenario(trains, 110.0, spacing_m=2000.0, run_s=110.0, step_s=STEP_S)


def booked_s(scenario: Scenario) -> float:
    """Booked departure of the leader from east."""
    return scenario.timetable.services[LEADER].calls[EAST].departure_s


@pytest.mark.parametrize("patience_s", [-25.0, 0.0, 15.0])
def test_the_timetable_run_goes_on_until_patience_after_the_booked_departure_is_over(
    patience_s: float,
) -> None:
    scenario = two_trains()
    seen = watch(scenario, 120.0, patience_s)
    until_s = booked_s(scenario) + patience_s
    before = [asked for asked in seen.watched.asked if asked.state.time_s < until_s - 1e-6]
    assert before[-1].state.running[FOLLOWER]
    for asked in before:
        assert asked.advice.ceiling_mps[FOLLOWER] == NO_CEILING_MPS
        assert asked.advice.reason[FOLLOWER] == NO_REASON
    after = seen.watched.asked[len(before)]
    assert after.state.time_s == pytest.approx(until_s, abs=STEP_S)
    assert after.advice.reason[FOLLOWER] == rules.OPTIMAL_STOP


def test_a_leader_that_departs_in_time_leaves_the_follower_alone() -> None:
    scenario = two_trains()
    seen = watch(scenario, 0.0)
    assert seen.record.departure_s[LEADER, EAST] == pytest.approx(booked_s(scenario), abs=STEP_S)
    assert seen.watched.first(FOLLOWER, rules.APPROACH) is None
    _, baseline = close_up(scenario, 0.0)
    assert np.array_equal(seen.engine.front_m, baseline.front_m)


def to_stand_m(speed_mps: FloatArray) -> FloatArray:
    """Braking distance on the level; the train's service brake is 1 m/s2."""
    return 0.5 * np.square(speed_mps)


def last_moment_s(scenario: Scenario, stop_m: float) -> float:
    """Until when a follower that runs close up could still stop at a place."""
    _, engine = close_up(scenario, 120.0)
    front_m, speed_mps = engine.front_m[:, FOLLOWER], engine.speed_mps[:, FOLLOWER]
    could = front_m + to_stand_m(speed_mps) <= stop_m
    return float(engine.time_s[could].max())


def test_a_train_that_can_no_longer_stop_at_the_optimal_stop_is_not_braked_by_it() -> None:
    scenario = two_trains()
    probe = watch(scenario, 120.0).watched.first(FOLLOWER, rules.OPTIMAL_STOP)
    assert probe is not None
    stop_m = float(probe.plans.stop_m[FOLLOWER])
    late_s = last_moment_s(scenario, stop_m) - booked_s(scenario) + 1.0
    missed = watch(scenario, 120.0, late_s)
    assert missed.watched.first(FOLLOWER, rules.OPTIMAL_STOP) is None
    _, baseline = close_up(scenario, 120.0)
    steps = int(np.count_nonzero(baseline.time_s <= missed.record.departure_s[LEADER, EAST]))
    fronts_m = missed.engine.front_m[:steps, FOLLOWER]
    assert np.array_equal(fronts_m, baseline.front_m[:steps, FOLLOWER])
    assert fronts_m[-1] > stop_m + 10.0


def test_a_train_that_just_can_stops_at_the_optimal_stop() -> None:
    scenario = two_trains()
    probe = watch(scenario, 120.0).watched.first(FOLLOWER, rules.OPTIMAL_STOP)
    assert probe is not None
    stop_m = float(probe.plans.stop_m[FOLLOWER])
    just_s = last_moment_s(scenario, stop_m) - booked_s(scenario) - 0.5
    stands = watch(scenario, 120.0, just_s).record.standstills
    assert stands.row.tolist() == [FOLLOWER]
    assert stands.front_m[0] == pytest.approx(stop_m, abs=0.5)


def test_braking_to_the_optimal_stop_begins_as_late_as_it_can() -> None:
    """At full speed until the braking distance is all that is left, then at the full rate."""
    scenario = two_trains()
    seen = watch(scenario, 120.0, -25.0)
    stop_m = float(seen.record.standstills.front_m[0])
    stands_s = float(seen.record.standstills.start_s[0])
    time_s, speed_mps = seen.engine.time_s, seen.engine.speed_mps[:, FOLLOWER]
    front_m = seen.engine.front_m[:, FOLLOWER]
    slowing = (time_s > stands_s - 60.0) & (time_s <= stands_s)
    slowing &= stop_m - front_m < to_stand_m(speed_mps) - 0.1
    assert not slowing.any()
    _, baseline = close_up(scenario, 120.0)
    free = front_m + to_stand_m(speed_mps) < stop_m - 3.0
    assert np.array_equal(front_m[free], baseline.front_m[: free.size, FOLLOWER][free])


def test_plans_are_forgotten_on_arrival() -> None:
    scenario = two_trains()
    seen = watch(scenario, 60.0)
    arrived_s = float(seen.record.arrival_s[FOLLOWER, EAST])
    planned = [asked for asked in seen.watched.asked if asked.plans.curves[FOLLOWER] is not None]
    assert planned[-1].state.time_s == pytest.approx(arrived_s - STEP_S, abs=0.01)
    for asked in seen.watched.asked:
        if asked.state.time_s < arrived_s - 1e-6:
            continue
        plans = asked.plans
        assert plans.call[FOLLOWER] == -1
        assert plans.curves[FOLLOWER] is None
        assert plans.stop_m[FOLLOWER] == seen.record.world.far_m
        assert np.isinf([plans.stop_from_s[FOLLOWER], plans.run_from_s[FOLLOWER]]).all()
        assert asked.advice.ceiling_mps[FOLLOWER] == NO_CEILING_MPS


def test_the_run_in_begins_when_the_leader_departs_and_ends_at_the_approach_point() -> None:
    seen = watch(two_trains(), 60.0)
    first = seen.watched.first(FOLLOWER, rules.APPROACH)
    assert first is not None
    departed_s = float(seen.record.departure_s[LEADER, EAST])
    assert first.state.time_s > departed_s
    curves = {id(asked.plans.curves[FOLLOWER]) for asked in seen.watched.asked}
    assert len(curves) == 2
    for asked in seen.watched.asked:
        curve = asked.plans.curves[FOLLOWER]
        if curve is None:
            assert asked.advice.reason[FOLLOWER] != rules.APPROACH
        elif asked.state.front_m[FOLLOWER] >= curve[0, -1]:
            assert asked.advice.ceiling_mps[FOLLOWER] == NO_CEILING_MPS
    before = [a for a in seen.watched.asked if a.state.time_s <= departed_s + 1e-6]
    assert all(asked.plans.curves[FOLLOWER] is None for asked in before)


def test_there_is_no_plan_behind_a_leader_on_another_platform_track() -> None:
    """T2 runs close behind T1 up to the points before mid, and there to the other side."""
    scenario = replace(loop_station_scenario(2, 20.0), step_s=STEP_S)
    first, second = scenario.timetable.services
    at_once = replace(second.calls[0], departure_s=second.calls[0].arrival_s, minimum_dwell_s=1.0)
    second = replace(second, calls=(at_once, *second.calls[1:]))
    seen = watch(replace(scenario, timetable=Timetable((first, second))), 60.0)
    on_the_way = [
        asked
        for asked in seen.watched.asked
        if asked.state.running[FOLLOWER] and asked.state.next_call[FOLLOWER] == 1
    ]
    behind = [asked for asked in on_the_way if asked.state.follows[FOLLOWER]]
    assert len(behind) > 100
    assert all(asked.state.leader[FOLLOWER] == LEADER for asked in on_the_way)
    for asked in on_the_way:
        assert asked.plans.call[FOLLOWER] == -1
        assert asked.advice.ceiling_mps[FOLLOWER] == NO_CEILING_MPS


def test_behind_the_same_leader_to_the_next_platform_on_one_track_there_is_one() -> None:
    scenario = replace(loop_station_scenario(2, 100.0), step_s=STEP_S)
    world = world_of(scenario)
    delay_s = np.zeros(world.booked_arrival_s[:, :-1].shape)
    delay_s[LEADER, 2] = 150.0
    plain = controller_of(world, "approach_point", 0.0)
    watched = Watched(plain.operation)
    run(scenario, controller=replace(plain, operation=watched), delay_s=delay_s)
    stops_m = {stop_m for call, stop_m in watched.outside(FOLLOWER) if call == 2}
    assert len(stops_m) == 1
    # Outside the platform at 2190 m, but past the points.
    assert 1860.0 < stops_m.pop() < 2190.0


def mixed_trains() -> Scenario:
    """Six trains, each behind one of another type or of its own."""
    scenario = two_trains(6)
    short = replace(commuter_train(length_m=160.0), id="short")
    kinds = ("commuter", "commuter", "short", "short", "commuter", "commuter")
    services = tuple(
        replace(service, train_type=kind)
        for service, kind in zip(scenario.timetable.services, kinds, strict=True)
    )
    return replace(
        scenario,
        train_types={**scenario.train_types, "short": short},
        timetable=replace(scenario.timetable, services=services),
    )


def test_trains_of_the_same_types_share_one_approach_point(monkeypatch: pytest.MonkeyPatch) -> None:
    sites: list[Site] = []

    def counted(site: Site) -> ApproachPoint | None:
        sites.append(site)
        return approach_point(site)

    monkeypatch.setattr(rules, "approach_point", counted)
    scenario = mixed_trains()
    seen = watch(scenario, 90.0)
    # At west no train runs in; at east behind five leaders: of four pairs of types.
    kinds = [service.train_type for service in scenario.timetable.services]
    pairs = set(zip(kinds[1:], kinds, strict=False))
    assert len(pairs) == 4
    assert len(sites) == 4
    stops_m: dict[tuple[str, str], set[float]] = {}
    for row in range(1, 6):
        pair = kinds[row], kinds[row - 1]
        stops_m.setdefault(pair, set()).update(stop_m for _, stop_m in seen.watched.outside(row))
    assert [len(places_m) for places_m in stops_m.values()] == [1, 1, 1, 1]


def test_advice_only_lowers() -> None:
    seen = watch(mixed_trains(), 90.0)
    nothing = no_advice(6)
    lowered = 0
    for asked in seen.watched.asked:
        state, authority, advice, _ = asked
        assert np.all((advice.ceiling_mps >= 0.0) & (advice.ceiling_mps <= NO_CEILING_MPS))
        assert np.array_equal(advice.reason == NO_REASON, advice.ceiling_mps > 999.0)
        with_it = seen.drive.command(state, authority, advice).speed_mps
        without = seen.drive.command(state, authority, nothing).speed_mps
        assert np.all(with_it <= without)
        lowered += int(np.count_nonzero(with_it < without))
    assert lowered > 100


@pytest.mark.parametrize("patience_s", [-4000.0, 4000.0, float("nan")])
def test_a_patience_out_of_range_is_refused(patience_s: float) -> None:
    with pytest.raises(ControllerError, match="patience_s") as caught:
        controller_of(world_of(two_trains()), "approach_point", patience_s)
    assert caught.value.allowed == "-3600 to 3600"
