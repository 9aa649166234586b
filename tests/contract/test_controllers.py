"""Every operation over every protection keeps the same contract."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.controllers.registry import (
    OPERATIONS,
    PROTECTIONS,
    SUPERVISIONS,
    ControllerError,
    build,
)
from kankaku.railway.plan.scenario import UNSUPERVISED, ControllerSpec, Option, Scenario
from kankaku.railway.plan.timetable import Timetable
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Controller
from kankaku.testing.contract import (
    ABOUT_RUNS,
    CHECKS,
    check_candidate,
    comparisons,
    failures,
    findings_of,
    is_safe,
    runs_through,
)
from kankaku.testing.example_lines import two_station_scenario, world_of
from kankaku.testing.loop_station import loop_station_scenario
from kankaku.testing.trials import LINES, overstays, trial_of, trial_on, trials_of
from tests.ends_of_ways import short_turn_scenario
from tests.examples import all_if_deep, examples
from tests.property.runs import run
from tests.supervising import HoldEverybody

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
    "lineside signals": ("multi_step_atc", {"sighting_time_s": 6.0, "overlap_beyond_m": 60.0}),
}
"""Protections with options that change what they do."""
BY_RADIO = {"over radio"}
# Who knows the future is another operation that is told more: one protection will do.
PAIRS = [
    (protection, operation)
    for protection, operation in product(VARIANTS, OPERATIONS)
    if protection == "moving_block" or not OPERATIONS[operation].knows_future
]
LAYERS_ONCE = [pair for pair in PAIRS if pair[0] == "moving_block" or pair[1] == "close_up"]
"""Each layer once, over the plainest protection or under the plainest operation."""
EVERYWHERE = all_if_deep(PAIRS, LAYERS_ONCE)
every_pair = pytest.mark.parametrize(("protection", "operation"), PAIRS)
every_layer = pytest.mark.parametrize(("protection", "operation"), EVERYWHERE)
QUICK = examples(5)


def controller_of(world: World, protection: str, operation: str) -> Controller:
    name, options = VARIANTS[protection]
    by_radio = protection in BY_RADIO
    return build(ControllerSpec("test", name, operation, options, {}, radio=by_radio), world)


@every_pair
def test_every_pair_keeps_the_contract_at_a_loop_station_and_every_layer_everywhere(
    protection: str, operation: str
) -> None:
    def candidate(world: World) -> Controller:
        return controller_of(world, protection, operation)

    if (protection, operation) not in EVERYWHERE:
        trial = trial_on("loop station", candidate)
        assert {check: look(trial) for check, look in CHECKS.items()} == dict.fromkeys(CHECKS, "")
        return
    trials = trials_of(candidate)
    findings = findings_of(trials, candidate)
    assert not failures(findings)
    assert [found.check for found in findings] == [*CHECKS, *ABOUT_RUNS]
    if operation == "close_up":
        # What a protection says beforehand is what it permits, to many trains behind another one.
        for trial in trials.values():
            compared = comparisons(trial)
            assert not any(compared)
            assert len(compared) > 100


@pytest.mark.parametrize(
    ("protection", "operation", "reserve"),
    [
        ("moving_block", "two_stage", False),
        ("digital_atc", "close_up", True),
    ],
)
def test_around_an_operation_the_energy_layer_keeps_the_contract(
    protection: str, operation: str, reserve: bool
) -> None:
    spec = ControllerSpec(
        "test", protection, operation, {}, {}, eco_margin_s=0.5, eco_reserve=reserve
    )
    assert not failures(check_candidate(lambda world: build(spec, world)))


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
    trial = trial_of(
        scenario,
        lambda world: controller_of(world, protection, operation),
        overstays(scenario, 70.0, 40.0),
    )
    assert not trial.asked.problems
    assert not runs_through(trial)
    assert not is_safe(trial)


@pytest.mark.parametrize("protection", VARIANTS)
def test_trains_may_be_held_under_any_protection(protection: str) -> None:
    scenario = LINES["one track"]()
    world = world_of(scenario)
    controller = replace(
        controller_of(world, protection, "close_up"),
        supervision=HoldEverybody(world, open_s=15.0, closed_s=10.0),
    )
    record, _ = run(scenario, controller=controller, delay_s=overstays(scenario, 70.0, 40.0))
    assert record.violations == ()
    assert record.completed.all()
    assert record.held is not None
    # Two trains overstay by more than they would be held.
    assert np.count_nonzero(record.held.open_s) == 6
    assert np.count_nonzero(record.held.closed_s) == 6


@pytest.mark.parametrize("supervision", [name for name in SUPERVISIONS if name != UNSUPERVISED])
@pytest.mark.parametrize("make", LINES.values(), ids=LINES)
def test_supervisions_keep_the_contract(supervision: str, make: Any) -> None:  # noqa: ANN401
    scenario = make()
    spec = ControllerSpec("test", "moving_block", "close_up", {}, {}, supervision=supervision)
    trial = trial_of(scenario, lambda world: build(spec, world), overstays(scenario, 70.0, 40.0))
    assert not trial.asked.problems
    assert not runs_through(trial)
    assert not is_safe(trial)


@every_layer
def test_all_trains_arrive_whatever_the_delays(protection: str, operation: str) -> None:
    @QUICK
    @given(st.sampled_from(list(LINES)), st.lists(st.floats(0.0, 120.0), min_size=15, max_size=15))
    def runs_through(name: str, drawn_s: list[float]) -> None:
        scenario = LINES[name]()
        world = world_of(scenario)
        delay_s = np.resize(np.array(drawn_s), overstays(scenario).shape)
        controller = controller_of(world, protection, operation)
        record, _ = run(scenario, controller=controller, delay_s=delay_s)
        assert record.violations == ()
        assert record.completed.all()
        called = np.isfinite(world.booked_arrival_s[:, :-1])
        assert np.all(np.isfinite(record.arrival_s[called]))

    runs_through()


@every_layer
@pytest.mark.parametrize("make", LINES.values(), ids=LINES)
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


@every_layer
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
    # The likeliest name stands in front of all of them.
    assert allowed in caught.value.allowed.rpartition(" among ")[2].split(", ")
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
