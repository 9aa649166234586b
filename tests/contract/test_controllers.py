"""Every operation over every protection keeps the same contract."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kankaku.controllers.registry import OPERATIONS, PROTECTIONS, ControllerError, build
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.scenario import ControllerSpec, Option, Scenario
from kankaku.railway.plan.timetable import Timetable
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Controller, Operation, Protection, Separation
from kankaku.railway.step.state import NO_REASON, Advice, Authority, LineState
from kankaku.testing.example_lines import merge_scenario, two_station_scenario, world_of
from kankaku.testing.loop_station import loop_station_scenario
from tests.ends_of_ways import short_turn_scenario
from tests.property.runs import run

CBTC = {
    "margin_m": 0.0,
    "position_error_percent": 0.1,
    "position_resolution_m": 2.0,
    "communication_delay_s": 0.5,
    "exclusive_platform": True,
}
VARIANTS: Mapping[str, tuple[str, Mapping[str, Option]]] = {
    **{name: (name, {}) for name in PROTECTIONS},
    "cbtc": ("moving_block", CBTC),
    "over radio": ("moving_block", {}),
}
"""Protections with options that change what they do."""
BY_RADIO = {"over radio"}
PAIRS = list(product(VARIANTS, OPERATIONS))
every_pair = pytest.mark.parametrize(("protection", "operation"), PAIRS)
QUICK = settings(max_examples=5, deadline=None, suppress_health_check=[HealthCheck.too_slow])

WORLDS = {
    "one track": lambda: two_station_scenario(4, 70.0, block_m=250.0),
    "merge": lambda: merge_scenario(4, 60.0, block_m=200.0),
    "loop station": lambda: loop_station_scenario(4, 70.0, one_starts_inside=True, block_m=250.0),
}


def controller_of(world: World, protection: str, operation: str) -> Controller:
    name, options = VARIANTS[protection]
    by_radio = protection in BY_RADIO
    return build(ControllerSpec("test", name, operation, options, {}, radio=by_radio), world)


def overstays(scenario: Scenario, *seconds: float) -> FloatArray:
    """Let the first trains overstay at their second call."""
    services = scenario.timetable.services
    delay_s = np.zeros((len(services), max(len(service.calls) for service in services)))
    delay_s[: len(seconds), 1] = seconds
    return delay_s


def same(one: Any, other: Any) -> bool:  # noqa: ANN401 - whatever a memory is made of
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other, equal_nan=True)
    return bool(one == other)


class Twice:
    """Asks a protection and an operation everything twice, and keeps what they said."""

    def __init__(self, controller: Controller) -> None:
        self._protection: Protection[Any] = controller.protection
        self._operation: Operation[Any] = controller.operation
        self.reasons = self._operation.reasons
        self.said: list[tuple[LineState, Authority, Advice]] = []

    def initial(self) -> tuple[Any, Any]:
        return self._protection.initial(), self._operation.initial()

    def authorise(self, state: LineState, memory: Any) -> tuple[Authority, Any]:  # noqa: ANN401
        first = self._protection.authorise(state, memory[0])
        assert same(first, self._protection.authorise(state, memory[0]))
        return first[0], (first[1], memory[1])

    def advise(
        self,
        state: LineState,
        authority: Authority,
        memory: Any,  # noqa: ANN401
    ) -> tuple[Advice, Any]:
        first = self._operation.advise(state, authority, memory[1])
        assert same(first, self._operation.advise(state, authority, memory[1]))
        self.said.append((state, authority, first[0]))
        return first[0], (memory[0], first[1])


@every_pair
@pytest.mark.parametrize("make", WORLDS.values(), ids=WORLDS)
def test_same_state_same_answer_and_answers_are_sound(
    protection: str,
    operation: str,
    make: Any,  # noqa: ANN401
) -> None:
    scenario = make()
    world = world_of(scenario)
    honest = controller_of(world, protection, operation)
    twice = Twice(honest)
    controller = replace(honest, protection=twice, operation=twice)
    record, _ = run(scenario, controller=controller, delay_s=overstays(scenario, 70.0, 40.0))
    assert record.violations == ()
    declared = set(range(len(honest.operation.reasons))) | {NO_REASON}
    # Codes of places beside the track, nothing, rows of trains.
    known = set(range(-1 - len(scenario.line.turnouts), world.size))
    for state, authority, advice in twice.said:
        assert np.all(np.isfinite(advice.ceiling_mps))
        assert np.all(advice.ceiling_mps >= 0.0)
        assert set(advice.reason.tolist()) <= declared
        assert advice.cause is None or set(advice.cause.tolist()) <= known
        assert set(authority.eoa_by.tolist()) <= known
        assert set(authority.ceiling_by.tolist()) <= known
        assert np.all(np.isfinite(authority.eoa_m))
        assert np.all(authority.ceiling_mps[state.present] >= 0.0)
        assert_never_beyond_the_train_ahead(scenario, state, authority, honest.separation)


@pytest.mark.parametrize("protection", VARIANTS)
@pytest.mark.parametrize("make", WORLDS.values(), ids=WORLDS)
def test_what_a_protection_says_beforehand_is_what_it_permits(
    protection: str,
    make: Any,  # noqa: ANN401
) -> None:
    scenario = make()
    world = world_of(scenario)
    honest = controller_of(world, protection, "close_up")
    foresight: Any = honest.protection
    twice = Twice(honest)
    controller = replace(honest, protection=twice, operation=twice)
    run(scenario, controller=controller, delay_s=overstays(scenario, 70.0, 40.0))
    compared = 0
    # By the time that detection takes, an authority may count on an older place of the leader.
    old = round(foresight.release_delay_s / world.step_s) + 1
    for step, (state, authority, _) in enumerate(twice.said):
        assert np.all(authority.delay_s == foresight.delay_s)
        platform_m = world.platform_m[0, np.arange(world.size), state.next_call]
        outside = state.running & state.follows & (state.front_m < platform_m)
        before = twice.said[max(step - old, 0)][0]
        for row in np.flatnonzero(outside).tolist():
            leader, call = int(state.leader[row]), int(state.next_call[row])
            latest, oldest = (
                foresight.eoa_behind_m(
                    row, call, leader, seen.front_m[[leader]], seen.speed_mps[[leader]]
                )[0]
                for seen in (state, before)
            )
            # Who stands further on already stays there.
            assert authority.eoa_m[row] <= max(latest, state.front_m[row]) + 1e-9
            granted = min(state.granted_to_m[row], before.granted_to_m[row]) >= world.far_m
            if granted and before.leader[row] == leader and state.present[leader]:
                # Nothing but this leader is in the way, nor was then.
                permitted_m = max(authority.eoa_m[row], state.front_m[row])
                # A centre that plans a train's run permits no more than it has planned.
                planned = authority.link and np.isfinite(authority.link.commanded_mps[row])
                assert planned or min(oldest, latest) - 1e-6 <= permitted_m
                compared += 1
    assert compared > 100


def assert_never_beyond_the_train_ahead(
    scenario: Scenario, state: LineState, authority: Authority, separation: Separation
) -> None:
    """Any train further on, on a track of the route, bounds the authority by its rear."""
    line, services = scenario.line, scenario.timetable.services
    emergency_mps2 = scenario.train_types["commuter"].emergency_brake_mps2
    braking_m = 0.5 * np.square(state.speed_mps) / emergency_mps2
    rear_m = state.tail_m + (braking_m if separation is Separation.BRAKING else 0.0)
    present = np.flatnonzero(state.present).tolist()
    for row, other in product(present, present):
        if state.front_m[other] <= state.front_m[row]:
            continue
        for track in set(services[row].route) & set(services[other].route):
            place = line.track_by_id[track]
            if place.start_m < state.front_m[other] and state.tail_m[other] < place.end_m:
                # Who stands further on already stays there.
                most_m = max(rear_m[other], place.start_m, state.front_m[row])
                assert authority.eoa_m[row] <= most_m + 1e-9


def short_turn_in_a_loop() -> Scenario:
    """Return a loop station where every second train ends on the track of its own."""
    scenario = loop_station_scenario(4, 70.0, block_m=250.0)
    services = [
        replace(s, route=s.route[:2], calls=s.calls[:2], leaves_at_last_call=True)
        if s.route[1] == "south"
        else s
        for s in scenario.timetable.services
    ]
    return replace(scenario, timetable=Timetable(tuple(services)))


@pytest.mark.parametrize(
    "make", [lambda: short_turn_scenario(4, 70.0, block_m=250.0), short_turn_in_a_loop]
)
@pytest.mark.parametrize(
    ("protection", "operation"),
    [*product(VARIANTS, ["close_up"]), *product(["moving_block"], OPERATIONS)],
)
def test_nobody_is_in_the_way_of_a_train_that_ends_on_the_way_or_it_in_theirs(
    protection: str,
    operation: str,
    make: Any,  # noqa: ANN401
) -> None:
    scenario = make()
    world = world_of(scenario)
    honest = controller_of(world, protection, operation)
    twice = Twice(honest)
    controller = replace(honest, protection=twice, operation=twice)
    record, _ = run(scenario, controller=controller, delay_s=overstays(scenario, 70.0, 40.0))
    assert record.violations == ()
    assert record.completed.all()
    for state, authority, _ in twice.said:
        assert_never_beyond_the_train_ahead(scenario, state, authority, honest.separation)


@every_pair
def test_all_trains_arrive_whatever_the_delays(protection: str, operation: str) -> None:
    @QUICK
    @given(st.sampled_from(list(WORLDS)), st.lists(st.floats(0.0, 120.0), min_size=15, max_size=15))
    def runs_through(name: str, drawn_s: list[float]) -> None:
        scenario = WORLDS[name]()
        world = world_of(scenario)
        delay_s = np.resize(np.array(drawn_s), overstays(scenario).shape)
        controller = controller_of(world, protection, operation)
        record, _ = run(scenario, controller=controller, delay_s=delay_s)
        assert record.violations == ()
        assert record.completed.all()
        called = np.isfinite(world.booked_arrival_s[:, :-1])
        assert np.all(np.isfinite(record.arrival_s[called]))

    runs_through()


@every_pair
@pytest.mark.parametrize("make", WORLDS.values(), ids=WORLDS)
def test_the_future_is_not_read(protection: str, operation: str, make: Any) -> None:  # noqa: ANN401
    scenario = make()
    world = world_of(scenario)
    fronts_m = []
    for overstay_s in (20.0, 150.0):
        controller = controller_of(world, protection, operation)
        record, engine = run(
            scenario, controller=controller, delay_s=overstays(scenario, overstay_s)
        )
        fronts_m.append(engine.front_m)
        # Both are the same until the shorter overstay is over.
        until_s = float(record.arrival_s[0, 1]) + world.minimum_dwell_s[0, 1] + 20.0
        if overstay_s == 20.0:
            steps = int(np.count_nonzero(engine.time_s <= until_s))
    assert steps > 100
    assert np.array_equal(fronts_m[0][:steps], fronts_m[1][:steps])
    assert not np.array_equal(fronts_m[0][: steps + 200], fronts_m[1][: steps + 200])


@every_pair
def test_no_operation_arrives_before_the_fastest_run(protection: str, operation: str) -> None:
    """Operation can only lower: nobody beats a train alone on the line."""
    scenario = two_station_scenario(3, 70.0, block_m=250.0)
    world = world_of(scenario)
    alone, _ = run(two_station_scenario(1))
    fastest_s = alone.arrival_s[0, 1] - alone.departure_s[0, 0]
    controller = controller_of(world, protection, operation)
    record, _ = run(scenario, controller=controller, delay_s=overstays(scenario, 50.0))
    assert np.all(record.arrival_s[:, 1] - record.departure_s[:, 0] >= fastest_s - 1e-6)


@pytest.mark.parametrize(
    ("spec", "where", "allowed"),
    [
        (("telepathy", "close_up", {}, {}), "controllers.x.protection", "moving_block"),
        (("moving_block", "telepathy", {}, {}), "controllers.x.operation", "close_up"),
        (
            ("moving_block", "close_up", {"margn_m": 1.0}, {}),
            "controllers.x.protection_options.margn_m",
            "margin_m",
        ),
        (
            ("moving_block", "close_up", {}, {"margin_m": 1.0}),
            "controllers.x.operation_options.margin_m",
            "none",
        ),
    ],
)
def test_what_is_unknown_is_refused_with_what_is_allowed(
    spec: tuple[str, str, dict[str, float], dict[str, float]], where: str, allowed: str
) -> None:
    world = world_of(two_station_scenario(1))
    with pytest.raises(ControllerError) as caught:
        build(ControllerSpec("x", *spec), world)
    assert caught.value.where == where
    assert allowed in caught.value.allowed.split(", ")
    assert str(caught.value).startswith(f"{where}: ")


@pytest.mark.parametrize(
    ("protection_options", "operation_options", "key"),
    [
        ({"margin_m": -1.0}, {}, "margin_m"),
        ({}, {"slowest_kmh": 0.0}, "slowest_kmh"),
        ({}, {"least_gain_s": -1.0}, "least_gain_s"),
    ],
)
def test_a_value_that_makes_no_sense_is_refused(
    protection_options: dict[str, float], operation_options: dict[str, float], key: str
) -> None:
    spec = ControllerSpec("x", "moving_block", "two_stage", protection_options, operation_options)
    with pytest.raises(ControllerError, match=key):
        build(spec, world_of(two_station_scenario(1)))
