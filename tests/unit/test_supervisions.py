"""What the supervisions decide, against what a reader works out by hand."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kankaku.controllers.registry import ControllerError, build
from kankaku.controllers.supervision.outlook import Outlook
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.scenario import ControllerSpec, Option, Scenario
from kankaku.railway.plan.timetable import Call, Service
from kankaku.railway.plan.world import World
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import LineState, Orders
from kankaku.testing.example_lines import (
    make_scenario,
    straight_line,
    two_station_scenario,
    world_of,
)
from tests.property.runs import READY_S, run
from tests.supervising import dwell_delays_s

WEST, EAST = 0, 1
EASTERN = 2


def spec_of(supervision: str, options: dict[str, Option]) -> ControllerSpec:
    return ControllerSpec(
        "x",
        "moving_block",
        "close_up",
        {},
        {},
        supervision=supervision,
        supervision_options=options,
    )


def ran(
    scenario: Scenario,
    supervision: str,
    delays_s: Callable[[World], FloatArray],
    **options: Option,
) -> tuple[RunRecord, list[tuple[LineState, Orders]]]:
    """Run close-up running under a supervision; return its orders, too, and what it saw."""
    world = world_of(scenario)
    controller = build(spec_of(supervision, options), world)
    made: Any = controller.supervision
    orders: list[tuple[LineState, Orders]] = []

    class Noted:
        initial = made.initial

        def supervise(self, *question: Any) -> Any:  # noqa: ANN401
            answer = made.supervise(*question)
            orders.append((question[0], answer[0]))
            return answer

    noted: Any = Noted()
    record, _ = run(
        scenario, controller=replace(controller, supervision=noted), delay_s=delays_s(world)
    )
    assert record.completed.all()
    assert not record.violations
    return record, orders


def nobody_overstays(world: World) -> FloatArray:
    return dwell_delays_s(world, 0, EAST, 0.0)


def leader_overstays(world: World) -> FloatArray:
    return dwell_delays_s(world, 0, EAST, 160.0)


def long_stop() -> Scenario:
    """T1 is booked to stand in the east until 07:04:00; T2 enters as soon as the west is free."""
    scenario = two_station_scenario(2, headway_s=40.0, run_s=90.0, dwell_s=30.0)
    first, second = scenario.timetable.services
    calls = first.calls[0], replace(first.calls[1], departure_s=READY_S + 240.0)
    services = replace(first, calls=calls), second
    return replace(scenario, timetable=replace(scenario.timetable, services=services))


def test_a_train_waits_for_the_booked_departure_of_a_train_ahead() -> None:
    scenario = long_stop()
    record, _ = ran(scenario, "hold_for_clear_way", nobody_overstays, overstay_s=3600.0)
    world = world_of(scenario)
    outlook = Outlook(world)
    # v/2a + L/v + v/b is least at the root of L over 1/2a + 1/b.
    rate = 0.5 / min(k.starting_acceleration_mps2 for k in world.train_types) + 1.0
    assert outlook.interval_s[0] == pytest.approx(2.0 * np.sqrt(200.0 * rate))
    leaves_s = READY_S + 240.0 + outlook.interval_s[0] - outlook.run_s[1, EAST]
    assert record.departure_s[1, WEST] == pytest.approx(leaves_s, abs=0.5)
    assert record.held is not None
    assert record.held.open_s[1, WEST] == pytest.approx(leaves_s - record.arrival_s[1, WEST] - 25.0)
    assert not record.standstills.row.size
    bare, _ = run(scenario)
    assert bare.standstills.duration_s.sum() > 60.0
    # What it waited it would have lost on its way; a close follower is a little faster or slower.
    assert record.arrival_s[1, EAST] == pytest.approx(bare.arrival_s[1, EAST], abs=4.0)


def test_a_train_waits_until_a_leader_that_overstays_has_left() -> None:
    # T2 is ready at 07:02:30, 30 s after T1 should have left the east, which it does 155 s late.
    scenario = two_station_scenario(2, headway_s=150.0, run_s=60.0)
    bare, _ = run(scenario, delay_s=leader_overstays(world_of(scenario)))
    assert bare.standstills.row.size
    for closed in (False, True):
        record, _ = ran(
            scenario, "hold_for_clear_way", leader_overstays, overstay_s=20.0, doors_closed=closed
        )
        gone_s = record.departure_s[0, EAST]
        assert record.departure_s[1, WEST] == pytest.approx(gone_s, abs=1.5)
        assert not record.standstills.row.size
        assert record.held is not None
        told_s = record.held.closed_s if closed else record.held.open_s
        other_s = record.held.open_s if closed else record.held.closed_s
        assert told_s[1, WEST] == pytest.approx(gone_s - (READY_S + 180.0), abs=1.5)
        assert not other_s.any()


def test_nobody_waits_longer_than_the_longest_hold() -> None:
    scenario = two_station_scenario(2, headway_s=150.0, run_s=60.0)
    record, _ = ran(
        scenario, "hold_for_clear_way", leader_overstays, overstay_s=20.0, longest_hold_s=12.0
    )
    assert record.departure_s[1, WEST] == READY_S + 180.0 + 12.0


def test_run_time_targets_tell_when_the_platform_is_free() -> None:
    record, orders = ran(
        long_stop(),
        "hold_for_clear_way",
        nobody_overstays,
        longest_hold_s=0.0,
        run_time_targets=True,
    )
    assert record.held is not None
    assert not record.held.open_s.any()
    interval_s = Outlook(world_of(long_stop())).interval_s[0]
    targets_s = {one.arrive_by_s[1] for _, one in orders if np.isfinite(one.arrive_by_s[1])}
    assert targets_s == {READY_S + 240.0 + interval_s}
    assert all(np.isnan(one.arrive_by_s[0]) for _, one in orders)


def four_stations(trains: int = 3, headway_s: float = 150.0) -> Scenario:
    """Return a line of four stations, 90 s and a stop of 30 s apart."""
    stops_m = {"west": 300.0, "middle": 1300.0, "east": 2300.0, "end": 3300.0}
    services = []
    for number in range(trains):
        ready_s = READY_S + number * headway_s
        calls = tuple(
            Call(name, "main", at_m, ready_s + 120.0 * at, ready_s + 120.0 * at + 30.0, 25.0)
            for at, (name, at_m) in enumerate(stops_m.items())
        )
        services.append(Service(f"T{number + 1}", "west", "commuter", ("main",), calls))
    return make_scenario(straight_line(stops_m, 3800.0), services)


def last_overstays(world: World) -> FloatArray:
    return dwell_delays_s(world, 2, WEST, 135.0)


def test_a_train_is_held_midway_between_its_neighbours() -> None:
    """T3 overstays in the west; T2 arrives in the east meanwhile, and is ready there at 07:07."""
    record, orders = ran(
        four_stations(),
        "headway_regulation",
        last_overstays,
        longest_hold_s=300.0,
        headway_ratio=10.0,
    )
    ahead_s = record.departure_s[0, EASTERN]
    assert ahead_s == READY_S + 270.0
    # A departure is seen half a second after it. T3 may leave the west at any moment, and is
    # booked to be in the east 210 s later.
    wanted_s = {
        one.hold_open_until_s[1]: 0.5 * (ahead_s + 0.5 + seen.time_s + 210.0)
        for seen, one in orders
        if record.arrival_s[1, EASTERN] <= seen.time_s < record.departure_s[1, EASTERN]
    }
    assert len(wanted_s) > 1
    assert list(wanted_s) == pytest.approx(list(wanted_s.values()))
    assert record.departure_s[1, EASTERN] == pytest.approx(max(wanted_s), abs=0.5)
    assert record.departure_s[2, WEST] > record.departure_s[1, EASTERN]
    assert record.held is not None
    assert record.held.open_s[1, EASTERN] == pytest.approx(max(wanted_s) - READY_S - 420.0)


def test_a_hold_goes_no_further_than_the_booked_headway() -> None:
    record, _ = ran(four_stations(), "headway_regulation", last_overstays, headway_ratio=1.02)
    # A departure is seen half a second after it, and booked headways are 150 s.
    latest_s = record.departure_s[0, EASTERN] + 0.5 + 1.02 * 150.0
    assert record.departure_s[1, EASTERN] == pytest.approx(latest_s, abs=0.5)


@pytest.mark.parametrize(
    ("options", "held_s"),
    [({"longest_hold_s": 5.0, "headway_ratio": 10.0}, 5.0), ({"gain": 0.0}, 0.0)],
)
def test_regulation_keeps_within_its_options(options: dict[str, Option], held_s: float) -> None:
    record, _ = ran(four_stations(), "headway_regulation", last_overstays, **options)
    assert record.held is not None
    assert record.held.open_s.max() == pytest.approx(held_s)


def test_headways_as_booked_are_left_alone() -> None:
    record, _ = ran(four_stations(), "headway_regulation", nobody_overstays)
    assert record.held is not None
    assert not record.held.open_s.any()


@pytest.mark.parametrize(
    ("supervision", "options", "where"),
    [
        ("hold_for_clear_way", {"overstay_s": -1.0}, "supervision_options"),
        ("hold_for_clear_way", {"doors_closed": 1.0}, "supervision_options.doors_closed"),
        ("headway_regulation", {"gain": 1.5}, "supervision_options"),
        ("headway_regulation", {"longest_hold": 1.0}, "supervision_options.longest_hold"),
        ("none", {"gain": 1.0}, "supervision_options.gain"),
        ("headway_regulatoin", {}, "supervision"),
    ],
)
def test_a_supervision_that_makes_no_sense_is_refused(
    supervision: str, options: dict[str, Option], where: str
) -> None:
    with pytest.raises(ControllerError) as caught:
        build(spec_of(supervision, options), world_of(two_station_scenario(1)))
    assert caught.value.where == f"controllers.x.{where}"
