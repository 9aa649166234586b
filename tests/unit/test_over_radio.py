"""Limits over radio: how many telegrams may be lost, and what a limit still covers."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kankaku.controllers.centre.over_radio import HORIZON_S, OnAir, OverRadio
from kankaku.controllers.protection.ceiling import LineCeiling
from kankaku.controllers.protection.moving_block import MovingBlock, MovingBlockOptions
from kankaku.controllers.registry import ControllerError, build
from kankaku.railway.plan.radio_spec import LOSSLESS, Outage, RadioSpec
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.plan.world import World
from kankaku.railway.radio.data_link import Radio
from kankaku.railway.step.state import Authority, LineState, Reason
from kankaku.testing.example_lines import merge_scenario, two_station_scenario, world_of
from tests.property.runs import READY_S, controller_of, run
from tests.states import behind

EMERGENCY_MPS2 = 1.3


def alone() -> Scenario:
    """One train on level track; a step that shows when commands run out."""
    return replace(two_station_scenario(1), step_s=0.1)


def silent(telegrams: int) -> tuple[RadioSpec, float]:
    """Return a radio that loses so many telegrams in a row, and when the last one was sent."""
    from_s = READY_S + 45.0
    outage = Outage((), up=False, down=True, from_s=from_s, until_s=from_s + telegrams)
    return replace(LOSSLESS, outages=(outage,)), from_s - 0.5


def emergencies(record: Any) -> int:  # noqa: ANN401 - a run record
    """Return how many samples of the trajectory say that a train brakes in emergency."""
    reasons = record.trajectory.reason[record.trajectory.time_s > READY_S + 10.0]
    return int(np.count_nonzero(reasons == Reason.EMERGENCY))


def test_three_lost_telegrams_in_a_row_change_nothing() -> None:
    usual, _ = run(alone(), radio=LOSSLESS)
    record, engine = run(alone(), radio=silent(3)[0])
    assert np.array_equal(record.arrival_s, usual.arrival_s, equal_nan=True)
    assert emergencies(record) == 0
    assert record.violations == ()
    running = engine.speed_mps[np.searchsorted(engine.time_s, READY_S + 45.0), 0]
    assert running > 10.0


def test_the_fourth_stops_the_train() -> None:
    radio, sent_s = silent(4)
    record, engine = run(alone(), radio=radio)
    assert emergencies(record) > 5
    assert record.violations == ()
    assert record.completed.all()
    time_s, speed_mps = engine.time_s, engine.speed_mps[:, 0]
    assert not np.any(np.diff(speed_mps)[time_s[:-1] <= sent_s + HORIZON_S] < -0.11)
    begin = int(np.flatnonzero(time_s > sent_s + HORIZON_S + 1e-6)[0])
    # On level track the brake alone decides, until the train stands.
    steps = int(speed_mps[begin] / (EMERGENCY_MPS2 * 0.1))
    braked_mps = speed_mps[begin] - EMERGENCY_MPS2 * 0.1 * np.arange(steps + 1)
    assert speed_mps[begin : begin + steps + 1] == pytest.approx(braked_mps, abs=1e-6)
    assert speed_mps[begin + steps + 1] == 0.0
    # It has long heard again, and goes on as soon as it stands.
    assert speed_mps[begin + steps + 2] > 0.0


def test_without_commands_it_stays_until_it_hears_again() -> None:
    radio, sent_s = silent(60)
    record, engine = run(alone(), radio=radio)
    assert record.completed.all()
    standing = np.flatnonzero((engine.speed_mps[:, 0] == 0.0) & (engine.time_s > sent_s + 40.0))
    goes_on_s = engine.time_s[np.flatnonzero(np.diff(standing) > 1)[0] + standing[0]]
    heard_s = goes_on_s - (sent_s + 61.0)
    assert LOSSLESS.delay_least_s - 1e-6 <= heard_s <= LOSSLESS.delay_most_s + 0.1


def test_lost_reports_hold_the_follower_but_brake_nobody() -> None:
    scenario = two_station_scenario(2, 70.0)
    from_s = READY_S + 65.0
    outage = Outage(("T1",), up=True, down=False, from_s=from_s, until_s=from_s + 90.0)
    usual, _ = run(scenario, radio=LOSSLESS)
    record, engine = run(scenario, radio=replace(LOSSLESS, outages=(outage,)))
    assert emergencies(record) == 0
    assert record.violations == ()
    assert np.array_equal(record.arrival_s[0], usual.arrival_s[0], equal_nan=True)
    # Where T1 was when it spoke last is as far as T2 may go until it speaks again.
    known_m = engine.front_m[np.flatnonzero(engine.time_s <= from_s - 1.0)[-1], 0]
    reached_m = engine.front_m[engine.time_s < from_s + 90.0, 1].max()
    assert reached_m == pytest.approx(known_m - 200.0 - 25.0, abs=0.3)
    assert record.arrival_s[1, 1] > usual.arrival_s[1, 1] + 10.0


class Written:
    """A protection whose limits for one train are written down."""

    def __init__(self, protection: Any, row: int) -> None:  # noqa: ANN401
        self._protection, self._row = protection, row
        self.initial = protection.initial
        self.eoa_m: list[float] = []

    def authorise(self, state: LineState, memory: Any) -> tuple[Authority, Any]:  # noqa: ANN401
        authority, memory = self._protection.authorise(state, memory)
        if state.present[self._row]:
            self.eoa_m.append(float(authority.eoa_m[self._row]))
        return authority, memory


@pytest.mark.parametrize("protection", ["moving_block", "relative_braking"])
def test_points_tell_that_a_train_has_left_them_before_it_does(protection: str) -> None:
    """T3 waits for points to be granted behind T2, whose reports are lost as it leaves them."""
    scenario = merge_scenario(4, 60.0)
    from_s = READY_S + 146.0
    outage = Outage(("T2",), up=True, down=False, from_s=from_s, until_s=from_s + 20.0)
    spec = RadioSpec(delay_least_s=0.0, delay_most_s=0.0, outages=(outage,))
    delay_s = np.zeros((4, 2))
    delay_s[1, 0] = 39.0
    honest = controller_of(world_of(scenario), protection=protection, radio=spec)
    written = Written(honest.protection, row=2)
    controller = replace(honest, protection=written)
    record, _ = run(scenario, controller=controller, delay_s=delay_s, radio=spec)
    assert record.violations == ()
    assert record.completed.all()
    assert np.all(np.diff(written.eoa_m) >= 0.0)
    assert np.unique(written.eoa_m).size > 5


def test_without_losses_a_queue_is_only_as_late_as_its_knowledge() -> None:
    scenario = two_station_scenario(4, 70.0)
    delay_s = np.zeros((4, 2))
    delay_s[0, 1] = 60.0
    plain, _ = run(scenario, delay_s=delay_s)
    record, _ = run(scenario, delay_s=delay_s, radio=LOSSLESS)
    assert record.violations == ()
    behind_s = (record.arrival_s - plain.arrival_s)[:, 1]
    # Everybody waits for the knowledge of one train more.
    latest_s = np.arange(4) * (LOSSLESS.oldest_knowledge_s + 2.0 * scenario.step_s)
    assert np.all(behind_s >= -1e-9)
    assert np.all(behind_s <= latest_s)
    assert behind_s[3] > 0.0


@pytest.mark.parametrize("seed", range(4))
def test_with_many_losses_in_long_rows_everybody_arrives_in_safety(seed: int) -> None:
    scenario = replace(two_station_scenario(4, 70.0), seed=seed)
    delay_s = np.zeros((4, 2))
    delay_s[:2, 1] = 70.0, 40.0
    record, _ = run(scenario, delay_s=delay_s, radio=RadioSpec(loss_ratio=0.2, burst_factor=4.0))
    assert record.violations == ()
    assert record.completed.all()
    assert emergencies(record) > 0


def test_a_radio_that_does_not_keep_pace_with_the_steps_is_refused() -> None:
    world = world_of(two_station_scenario(1))
    for protection, by_radio in (("moving_block", True), ("control_map", False)):
        operation = "control_map" if protection == "control_map" else "close_up"
        spec = ControllerSpec("test", protection, operation, {}, {}, radio=by_radio)
        with pytest.raises(
            ControllerError, match=r"radio: half a cycle of 0\.6 s .* divide 0\.3 s"
        ):
            build(spec, world, RadioSpec(cycle_s=0.6))


class Scripted:
    """A centre that permits everybody a given place."""

    def __init__(self, world: World) -> None:
        self._inner = MovingBlock(world, MovingBlockOptions())
        self.ceiling = LineCeiling(world, world.profile)
        self.permitted_m = 0.0

    def authorise(self, state: LineState, memory: Any) -> tuple[Authority, Any]:  # noqa: ANN401
        authority, memory = self._inner.authorise(state, memory)
        return authority._replace(eoa_m=np.full(2, self.permitted_m)), memory

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - the rest is a moving block
        return getattr(self._inner, name)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("outage_s", [0.0, 8.0, 30.0])
def test_a_limit_is_covered_until_all_trains_have_acknowledged_a_newer_one(
    outage_s: float, seed: int
) -> None:
    """Limits fall by an obstruction; the *other* train's reports are lost for a while."""
    world = world_of(two_station_scenario(2))
    start_s, lowered_s = READY_S + 100.0, READY_S + 120.0
    outage = Outage(("T1",), up=True, down=False, from_s=lowered_s, until_s=lowered_s + outage_s)
    spec = RadioSpec(loss_ratio=0.3, burst_factor=2.0, outages=(outage,))
    centre: Any = Scripted(world)
    protection, radio = OverRadio(centre, world, spec), Radio(world, spec, seed)
    memory: OnAir = protection.initial()
    covered_m, eoa_m, known_s = [], [], []
    for step in range(1200):
        time_s = start_s + 0.1 * step
        centre.permitted_m = 1000.0 if time_s < lowered_s else 500.0
        state = behind(world, 900.0, 300.0, time_s=time_s)
        state = state._replace(radio=radio.update(time_s, state.present))
        authority, memory = protection.authorise(state, memory)
        assert authority.permission is not None
        assert state.radio is not None
        covered_m.append(authority.permission.covered_m)
        eoa_m.append(authority.eoa_m)
        known_s.append(float(state.radio.acknowledged_s.min()))
    heard = slice(20, None)
    covered, known = np.array(covered_m)[heard], np.array(known_s)[heard]
    # All that is gone by later was covered, unless it was sent later, too: limits never rise.
    assert np.all(covered >= np.array(eoa_m)[heard])
    assert np.all(covered[known < lowered_s] == 1000.0)
    times_s = start_s + 0.1 * np.arange(1200)[heard]
    # The centre does not remember for longer how far the oldest of all limits went.
    lately = (known > lowered_s) & (known > times_s - HORIZON_S)
    assert np.all(covered[lately] == 500.0)
    assert lately.any()
    assert times_s[lately].min() > lowered_s + outage_s


def test_knowledge_is_as_old_as_cycles_and_delays_make_it() -> None:
    world = world_of(two_station_scenario(2))
    inner = MovingBlock(world, MovingBlockOptions())
    # A report of 0 s that takes 0.6 s goes into the telegram of 1.5 s, which may be heard at
    # 2.1 s, and the next one a second later.
    assert OverRadio(inner, world, LOSSLESS).release_delay_s == pytest.approx(3.1)
    quick = replace(LOSSLESS, delay_most_s=0.4)
    assert OverRadio(inner, world, quick).release_delay_s == pytest.approx(0.5 + 1.0 + 0.4)


def test_what_goes_through_the_track_cannot_go_by_radio() -> None:
    world = world_of(two_station_scenario(2, block_m=250.0))
    for name in ("multi_step_atc", "atd", "digital_atc"):
        with pytest.raises(ControllerError) as caught:
            build(ControllerSpec("x", name, "close_up", {}, {}, radio=True), world)
        assert caught.value.where == "controllers.x.radio"
        assert "moving_block" in caught.value.allowed
    for name in ("moving_block", "relative_braking"):
        assert build(ControllerSpec("x", name, "close_up", {}, {}, radio=True), world).by_radio
        assert not build(ControllerSpec("x", name, "close_up", {}, {}), world).by_radio
