"""What becomes of the orders of supervision: in stops, departures, indicators and reasons."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kankaku.analysis.tables.run_tables import run_tables
from kankaku.analysis.tables.summary import summary_frame
from kankaku.controllers.registry import ControllerError, build
from kankaku.railway.loop.agreements import AgreementError
from kankaku.railway.plan.driving_style import DrivingStyle
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.plan.world import World
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import Authority, LineState, Orders, Reason, no_orders
from kankaku.testing.example_lines import two_station_scenario, world_of
from tests.property.runs import READY_S, run
from tests.supervising import HoldEverybody, dwell_delays_s, supervised

WEST, EAST = 0, 1


def held_run(
    open_s: float = 0.0,
    closed_s: float = 0.0,
    delay_s: float = 0.0,
    scenario: Scenario | None = None,
) -> tuple[RunRecord, HoldEverybody]:
    """Run one train that overstays at the first station, and is held at both."""
    scenario = scenario or two_station_scenario(1)
    world = world_of(scenario)
    supervision = HoldEverybody(world, open_s, closed_s)
    delays_s = dwell_delays_s(world, 0, WEST, delay_s)
    record, _ = run(scenario, controller=supervised(world, supervision), delay_s=delays_s)
    assert record.completed.all()
    assert not record.violations
    return record, supervision


def test_a_train_held_with_open_doors_leaves_so_much_later() -> None:
    record, _ = held_run(open_s=25.0)
    assert record.departure_s[0, WEST] == READY_S + 30.0 + 25.0
    assert record.held is not None
    assert record.held.open_s[0].tolist() == pytest.approx([25.0, 25.0])
    assert not record.held.closed_s.any()
    assert Reason.HELD not in record.trajectory.reason


@pytest.mark.parametrize(("delay_s", "held_s"), [(20.0, 10.0), (40.0, 0.0)])
def test_only_what_a_hold_adds_to_an_overstay_is_held(delay_s: float, held_s: float) -> None:
    record, _ = held_run(open_s=25.0, delay_s=delay_s)
    # The minimum dwell of 25 s leaves 5 s of the booked 30 s.
    assert record.departure_s[0, WEST] == READY_S + 30.0 + max(25.0, delay_s - 5.0)
    assert record.held is not None
    assert record.held.open_s[0, WEST] == pytest.approx(held_s)


@pytest.mark.parametrize("reaction_s", [0.0, 2.0])
def test_a_train_held_with_closed_doors_has_not_departed(reaction_s: float) -> None:
    scenario = two_station_scenario(1)
    scenario = replace(scenario, driving=DrivingStyle(name="slow", departure_reaction_s=reaction_s))
    record, supervision = held_run(closed_s=20.0, scenario=scenario)
    assert record.departure_s[0, WEST] == pytest.approx(READY_S + 30.0 + 20.0)
    released = [seen.time_s for seen in supervision.asked if seen.events.released]
    assert released[0] == READY_S + 30.0
    assert record.held is not None
    assert record.held.closed_s[0].tolist() == pytest.approx([20.0, 20.0])
    seen = record.trajectory
    waits = (seen.time_s >= READY_S + 30.0) & (seen.time_s < READY_S + 50.0)
    assert set(seen.reason[waits]) == {Reason.HELD}
    assert set(seen.front_m[waits]) == {300.0}
    assert not record.standstills.row.size
    assert not record.crawl_s.any()


def test_open_and_closed_holds_are_told_apart_in_the_tables() -> None:
    tables = run_tables(held_run(open_s=12.0, closed_s=8.0)[0])
    assert tables.calls["held_open_s"].tolist() == [12.0, 12.0]
    assert tables.calls["held_closed_s"].tolist() == [8.0, 8.0]
    assert set(tables.trajectory["reason"]) >= {"dwelling", "held"}
    (summary,) = summary_frame([tables]).to_dict("records")
    assert summary["held_open_time_s"] == 24.0
    assert summary["held_closed_time_s"] == 16.0
    assert summary["interstation_stop_time_s"] == 0.0


def test_without_supervision_nobody_is_held() -> None:
    scenario = two_station_scenario(1)
    record, _ = run(scenario)
    assert record.held is None
    assert run_tables(record).calls["held_open_s"].tolist() == [0.0, 0.0]
    spec = ControllerSpec("x", "moving_block", "close_up", {}, {}, supervision="none")
    assert build(spec, world_of(scenario)).supervision is None


class Lifting(HoldEverybody):
    """Lifts all holds at a time that it names."""

    lifts_s = READY_S + 40.0

    def supervise(
        self, state: LineState, authority: Authority, memory: None
    ) -> tuple[Orders, None]:
        orders, memory = super().supervise(state, authority, memory)
        if state.time_s >= self.lifts_s:
            return no_orders(self.world.size), memory
        return orders._replace(again_s=self.lifts_s), memory


@pytest.mark.parametrize(("open_s", "closed_s"), [(100.0, 0.0), (0.0, 100.0)])
def test_a_hold_that_is_lifted_has_lasted_until_then(open_s: float, closed_s: float) -> None:
    scenario = two_station_scenario(1)
    world = world_of(scenario)
    supervision = Lifting(world, open_s, closed_s)
    record, _ = run(scenario, controller=supervised(world, supervision))
    assert record.held is not None
    held_s = record.held.open_s if open_s else record.held.closed_s
    assert held_s[0].tolist() == pytest.approx([10.0, 0.0])
    # An extended stop ends in the next step; who stands with closed doors goes at once.
    late_s = 0.5 if open_s else 0.0
    assert record.departure_s[0, WEST] == READY_S + 40.0 + late_s


def test_supervision_is_asked_at_events_and_at_the_times_it_names_only() -> None:
    _, held = held_run(open_s=10.0)
    assert all(seen.events for seen in held.asked[1:])
    scenario = two_station_scenario(1)
    world = world_of(scenario)
    lifting = Lifting(world, 100.0)
    run(scenario, controller=supervised(world, lifting))
    assert [seen.time_s for seen in lifting.asked[1:] if not seen.events] == [READY_S + 40.0]


def test_operation_sees_the_orders_and_protection_does_not() -> None:
    scenario = two_station_scenario(1)
    world = world_of(scenario)
    bare = supervised(world, HoldEverybody(world, 10.0))
    seen: dict[str, set[bool]] = {"authorise": set(), "advise": set()}

    class Watched:
        def __init__(self, layer: Any, ask: str) -> None:  # noqa: ANN401
            self._layer, self._ask = layer, ask

        def __getattr__(self, name: str) -> Any:  # noqa: ANN401
            found = getattr(self._layer, name)
            if name != self._ask:
                return found

            def asked(state: LineState, *others: Any) -> Any:  # noqa: ANN401
                seen[name].add(state.orders is None)
                return found(state, *others)

            return asked

    layers: dict[str, Any] = {
        "protection": Watched(bare.protection, "authorise"),
        "operation": Watched(bare.operation, "advise"),
    }
    run(scenario, controller=replace(bare, **layers))
    assert seen == {"authorise": {True}, "advise": {False}}


class Hasty(HoldEverybody):
    """Wants to be asked again at once."""

    def supervise(
        self, state: LineState, authority: Authority, memory: None
    ) -> tuple[Orders, None]:
        orders, memory = super().supervise(state, authority, memory)
        return orders._replace(again_s=state.time_s), memory


class Vague(HoldEverybody):
    """Names its next time in whole seconds of another type."""

    def supervise(
        self, state: LineState, authority: Authority, memory: None
    ) -> tuple[Orders, None]:
        orders, memory = super().supervise(state, authority, memory)
        return orders._replace(again_s=int(state.time_s) + 1), memory


class Short(HoldEverybody):
    """Decides for one train of two."""

    def supervise(
        self, state: LineState, authority: Authority, memory: None
    ) -> tuple[Orders, None]:
        return no_orders(1), super().supervise(state, authority, memory)[1]


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        (Hasty, "wants to be asked again in the past"),
        (Vague, "again_s as 25199; agreed: a float"),
        (Short, "hold_open_until_s as float64 of shape"),
    ],
)
def test_orders_that_are_not_what_is_agreed_are_refused(
    kind: type[HoldEverybody], told: str
) -> None:
    scenario = two_station_scenario(2)
    world = world_of(scenario)
    with pytest.raises(AgreementError, match=told):
        run(scenario, controller=supervised(world, kind(world)))


def test_a_run_time_target_is_what_eco_driving_aims_at() -> None:
    scenario = two_station_scenario(1, run_s=90.0)
    world = world_of(scenario)
    target_s = READY_S + 30.0 + 110.0

    class Targets(HoldEverybody):
        def supervise(
            self, state: LineState, authority: Authority, memory: None
        ) -> tuple[Orders, None]:
            orders, memory = super().supervise(state, authority, memory)
            return orders._replace(arrive_by_s=np.full(self.world.size, target_s)), memory

    def arrival_s(world: World, supervision: HoldEverybody | None) -> float:
        eco = build(ControllerSpec("eco", "moving_block", "eco", {}, {}), world)
        record, _ = run(scenario, controller=replace(eco, supervision=supervision))
        return float(record.arrival_s[0, EAST])

    assert arrival_s(world, None) == pytest.approx(READY_S + 120.0, abs=1.5)
    assert arrival_s(world, Targets(world)) == pytest.approx(target_s, abs=1.5)


def test_a_peer_takes_no_supervision() -> None:
    spec = ControllerSpec(
        "x", "", "", {}, {}, "sumo_native_moving", supervision="headway_regulation"
    )
    with pytest.raises(ControllerError, match="drives its trains itself") as caught:
        build(spec, world_of(two_station_scenario(1)))
    assert caught.value.where == "controllers.x.supervision"
