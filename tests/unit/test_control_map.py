"""The control map: what its bands keep, how it smooths, and what a lost telegram does."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kankaku.controllers.control_map.map_protection import ControlMap, ControlMapOptions, Memory
from kankaku.controllers.registry import build
from kankaku.railway.arrays import FloatArray
from kankaku.railway.failures.unit_failures import UnitFailure
from kankaku.railway.plan.disruptions import Cause, Closure, Disruptions
from kankaku.railway.plan.radio_spec import LOSSLESS, Outage, RadioSpec
from kankaku.railway.plan.scenario import ControllerSpec, Option, Scenario
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import Authority, LineState, Reason
from kankaku.testing.example_lines import two_station_scenario, world_of
from kankaku.testing.loop_station import loop_station_scenario
from tests.property.runs import READY_S, Observed, run


def on_map(
    scenario: Scenario,
    *,
    radio: RadioSpec = LOSSLESS,
    options: dict[str, Option] | None = None,
    overstay_s: Sequence[float] = (),
    delay_s: FloatArray | None = None,
    unit_failures: Sequence[UnitFailure] | None = None,
) -> tuple[RunRecord, Observed, "Listener"]:
    """Run under the control map; where no delays are named, some overstay at their second call."""
    world = world_of(scenario)
    spec = ControllerSpec("test", "control_map", "control_map", options or {}, {})
    honest = build(spec, world, radio)
    listener = Listener(honest.protection)
    if delay_s is None:
        delay_s = np.zeros((world.size, world.stop_m.shape[1] - 1))
        delay_s[: len(overstay_s), 1] = overstay_s
    controller = replace(honest, protection=listener)
    record, engine = run(
        scenario, controller=controller, delay_s=delay_s, radio=radio, unit_failures=unit_failures
    )
    return record, engine, listener


class Listener:
    """A protection that keeps what it was asked and what it said."""

    def __init__(self, protection: Any) -> None:  # noqa: ANN401 - the control map
        self.protection: ControlMap = protection
        self.said: list[tuple[LineState, Authority, Memory]] = []

    def initial(self) -> Memory:
        return self.protection.initial()

    def authorise(self, state: LineState, memory: Memory) -> tuple[Authority, Memory]:
        authority, after = self.protection.authorise(state, memory)
        self.said.append((state, authority, after))
        return authority, after


def emergencies(record: RunRecord) -> int:
    """Return how many samples of moving trains say that they brake in emergency."""
    moving = record.trajectory.speed_mps > 0.0
    return int(np.count_nonzero(moving & (record.trajectory.reason == Reason.EMERGENCY)))


def silence(telegrams: int, from_s: float) -> RadioSpec:
    outage = Outage((), up=False, down=True, from_s=from_s, until_s=from_s + telegrams)
    return replace(LOSSLESS, outages=(outage,))


def speeds_at(engine: Observed, front_m: FloatArray, row: int) -> FloatArray:
    return np.interp(front_m, engine.front_m[:, row], engine.speed_mps[:, row])


def test_alone_on_the_line_it_runs_as_fast_as_anybody() -> None:
    scenario = replace(two_station_scenario(1), step_s=0.1)
    usual, _ = run(scenario)
    record, _, _ = on_map(scenario, options={"early_s": 1000.0})
    taken = record.arrival_s[0, 1] - record.departure_s[0, 0]
    fastest = usual.arrival_s[0, 1] - usual.departure_s[0, 0]
    assert fastest - 1e-6 <= taken <= fastest + 1.0
    assert record.violations == ()


def test_an_early_train_arrives_as_early_as_it_is_to_and_saves_energy() -> None:
    scenario = replace(two_station_scenario(1), step_s=0.1)
    hasty, _, _ = on_map(scenario, options={"early_s": 1000.0})
    booked_s = world_of(scenario).booked_arrival_s[0, 1]
    slack_s = booked_s - hasty.arrival_s[0, 1]
    assert slack_s > 5.0
    punctual, _, _ = on_map(scenario, options={"early_s": 0.0})
    assert abs(punctual.arrival_s[0, 1] - booked_s) < 2.0
    assert punctual.energy.consumed_j[0] < hasty.energy.consumed_j[0]


def test_three_lost_telegrams_in_a_row_stop_nobody_and_the_fourth_does() -> None:
    scenario = replace(two_station_scenario(1), step_s=0.1)
    usual, _, _ = on_map(scenario)
    tolerated, _, _ = on_map(scenario, radio=silence(3, READY_S + 45.0))
    assert emergencies(tolerated) == 0
    late_s = tolerated.arrival_s[0, 1] - usual.arrival_s[0, 1]
    assert 0.0 <= late_s < 2.0
    stopped, engine, _ = on_map(scenario, radio=silence(4, READY_S + 45.0))
    assert emergencies(stopped) > 5
    running = (engine.time_s > READY_S + 45.0) & (engine.front_m[:, 0] < 1000.0)
    assert engine.speed_mps[running, 0].min() == 0.0
    for record in (tolerated, stopped):
        assert record.violations == ()
        assert record.completed.all()


def test_behind_a_leader_that_overstays_the_train_slows_down_early() -> None:
    scenario = replace(two_station_scenario(2, 90.0), step_s=0.1)
    closing_up, fast = run(scenario, delay_s=np.array([[0.0, 70.0], [0.0, 0.0]]))
    record, smooth, _ = on_map(scenario, overstay_s=(70.0,))
    assert record.violations == ()
    assert closing_up.standstills.duration_s.sum() > record.standstills.duration_s.sum() + 10.0
    places_m = np.arange(700.0, 1051.0, 50.0)
    assert np.all(speeds_at(smooth, places_m, 1) < speeds_at(fast, places_m, 1))
    assert record.arrival_s[1, 1] - closing_up.arrival_s[1, 1] < 10.0


def test_no_map_is_ever_refused_and_bands_stay_apart() -> None:
    record, _, listener = on_map(
        loop_station_scenario(5, 75.0, one_starts_inside=True), overstay_s=(60.0, 0.0, 45.0)
    )
    assert record.violations == ()
    assert record.completed.all()
    assert listener.said[-1][2].refused_s == -np.inf
    assert any(np.any(memory.plan.planned) for _, _, memory in listener.said)


def work(from_s: float, until_s: float, start_m: float = 700.0) -> Disruptions:
    place_m = start_m, start_m + 100.0
    return Disruptions(
        (Closure("zone", Cause.WORK, ("main",), *place_m, from_s, until_s, until_s),)
    )


@pytest.mark.parametrize(("from_s", "passes"), [(56.0, True), (40.0, False)])
def test_who_cannot_stop_when_a_work_zone_is_to_begin_is_let_through(
    from_s: float, passes: bool
) -> None:
    scenario = two_station_scenario(1)
    until_s = READY_S + 200.0
    disruptions = work(READY_S + from_s, until_s)
    scenario = replace(scenario, step_s=0.1, disruptions=disruptions)
    record, engine, _ = on_map(scenario, options={"early_s": 1000.0})
    assert record.violations == ()
    assert record.completed.all()
    inside = (engine.front_m[:, 0] > 700.0) & (engine.front_m[:, 0] < 1000.0)
    entered_s, left_s = engine.time_s[inside][[0, -1]]
    (zone,) = record.obstructions
    if passes:
        assert READY_S + from_s < left_s <= zone.established_s < left_s + 3.0
    else:
        assert entered_s > until_s
        assert zone.established_s < READY_S + from_s + 5.0


def test_it_slows_down_ahead_of_a_closure_with_a_known_end() -> None:
    """Who knows when the way is free again need not stand before it."""
    scenario = two_station_scenario(1)
    disruptions = work(READY_S + 30.0, READY_S + 95.0)
    scenario = replace(scenario, step_s=0.1, disruptions=disruptions)
    stops, _ = run(scenario)
    record, _, _ = on_map(scenario, options={"early_s": 1000.0})
    assert record.violations == ()
    assert stops.violations == ()
    assert stops.standstills.duration_s.sum() > 1.0
    assert record.standstills.duration_s.sum() == 0.0
    assert record.arrival_s[0, 1] <= stops.arrival_s[0, 1] + 1.0


def test_commands_come_by_radio_only() -> None:
    scenario = two_station_scenario(1)
    world = world_of(scenario)
    protection = ControlMap(world, ControlMapOptions(), LOSSLESS)
    with pytest.raises(ValueError, match="without"):
        run(scenario, controller=replace(_bare(world, protection), by_radio=False))


def _bare(world: Any, protection: ControlMap) -> Any:  # noqa: ANN401 - a controller
    spec = ControllerSpec("test", "control_map", "control_map", {}, {})
    return replace(build(spec, world, LOSSLESS), protection=protection)
