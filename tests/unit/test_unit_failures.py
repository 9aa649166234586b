"""Faults of a control map: who finds them, when, what is done, and that nobody is in danger."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kankaku.controllers.control_map.located import RATIO
from kankaku.controllers.control_map.map_protection import ControlMap, ControlMapOptions, Memory
from kankaku.controllers.control_map.measuring import Notice
from kankaku.controllers.control_map.wrong_maps import WrongMaps
from kankaku.controllers.registry import build
from kankaku.railway.failures.random_failures import DURATION_S, SIZE, WHEEL_S, draw_failure
from kankaku.railway.failures.unit_failures import (
    CENTRE,
    KIND_OF,
    VARIANTS,
    FailureMode,
    UnitFailure,
    Units,
    Variant,
)
from kankaku.railway.plan.disruptions import Cause, Closure, Disruptions
from kankaku.railway.plan.radio_spec import LOSSLESS
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import Authority, LineState, Reason
from kankaku.testing.example_lines import two_station_scenario, world_of
from kankaku.testing.loop_station import loop_station_scenario
from tests.property.runs import READY_S, Observed, run

SPEC = ControllerSpec("test", "control_map", "control_map", {"early_s": 1000.0}, {})
BALISES_M = (500.0, 900.0, 1280.0)


class Listener:
    """A control map that keeps what it was asked and what it said."""

    def __init__(self, protection: Any) -> None:  # noqa: ANN401 - a control map
        self._protection: ControlMap = protection
        self.said: list[tuple[LineState, Authority, Memory]] = []

    def initial(self) -> Memory:
        return self._protection.initial()

    def authorise(self, state: LineState, memory: Memory) -> tuple[Authority, Memory]:
        authority, after = self._protection.authorise(state, memory)
        self.said.append((state, authority, after))
        return authority, after

    def alarms(self, notice: Notice) -> list[tuple[float, int]]:
        """Times since the first train was ready, and rows."""
        found = self.said[-1][2].aboard.alarms
        return [(alarm.time_s - READY_S, alarm.row) for alarm in found if alarm.notice is notice]


def two_trains(headway_s: float = 90.0, balises_m: Sequence[float] = BALISES_M) -> Scenario:
    scenario = two_station_scenario(2, headway_s)
    line = replace(scenario.line, balises_m=tuple(balises_m))
    return replace(scenario, line=line, step_s=0.1)


def failing(
    scenario: Scenario, *unit_failures: UnitFailure, overstay_s: float = 0.0
) -> tuple[RunRecord, Observed, Listener]:
    world = world_of(scenario)
    honest = build(SPEC, world, LOSSLESS)
    protection = honest.protection
    for failure in unit_failures:
        if failure.kind is FailureMode.MAP:
            options: Any = SPEC.protection_options
            protection = WrongMaps(world, ControlMapOptions(**options), LOSSLESS, failure)
    listener = Listener(protection)
    delay_s = np.zeros((world.size, world.stop_m.shape[1] - 1))
    delay_s[0, 1] = overstay_s
    controller = replace(honest, protection=listener)
    record, engine = run(
        scenario,
        controller=controller,
        delay_s=delay_s,
        radio=LOSSLESS,
        unit_failures=unit_failures,
    )
    return record, engine, listener


def failure(
    variant: Variant, unit: str, from_s: float, duration_s: float, size: float = 0.0
) -> UnitFailure:
    """A failure that begins so long after the first train was ready."""
    return UnitFailure(variant, unit, READY_S + from_s, READY_S + from_s + duration_s, size)


def braked(record: RunRecord) -> set[int]:
    """Rows of trains that braked in emergency while they ran."""
    samples = record.trajectory
    hard = (samples.reason == Reason.EMERGENCY) & (samples.speed_mps > 0.0)
    return set(samples.row[hard].tolist())


def assert_safe(record: RunRecord) -> None:
    assert record.violations == ()
    assert record.completed.all()


def test_wheels_that_turn_wrongly_count_what_they_turn_too_much() -> None:
    world = world_of(two_trains())
    slip = failure(Variant.SLIP, "T1", 10.0, 4.0, 3.0)
    units = Units(world, (slip,))
    front_m, speed_mps = world.stop_m[:, 0].copy(), np.full(2, 10.0)
    for step in range(300):
        seen = units.update(READY_S + 0.1 * step, front_m + step, speed_mps)
        if step == 60:
            assert seen.odometer_m == pytest.approx(front_m + 60.0)
        if step == 120:
            # It grows for two seconds: 3 m/s x 2 s / 2.
            assert seen.odometer_m[0] == pytest.approx(front_m[0] + 120.0 + 3.0, abs=0.2)
            assert seen.wheels_mps.tolist() == pytest.approx([13.0, 10.0], abs=1e-6)
        if step == 190:
            assert seen.odometer_m[0] == pytest.approx(front_m[0] + 190.0 + 9.0, abs=0.2)
    # The balise at 500 m: from there on the place is right again.
    at_m = seen.balise_m + seen.odometer_m - seen.counted_m
    assert seen.balise_m.tolist() == [500.0, 500.0]
    assert at_m == pytest.approx(front_m + 299.0)


def test_without_a_fault_measuring_changes_nothing() -> None:
    balises_m = tuple(np.arange(0.0, 3000.0, 300.0).tolist())
    looped = loop_station_scenario(4, 70.0, one_starts_inside=True)
    looped = replace(looped, line=replace(looped.line, balises_m=balises_m))
    for scenario in (two_trains(60.0), looped):
        world = world_of(scenario)
        delay_s = np.zeros((world.size, world.stop_m.shape[1] - 1))
        exact, _ = run(scenario, controller=build(SPEC, world), delay_s=delay_s, radio=LOSSLESS)
        measured, _, listener = failing(scenario)
        assert measured.arrival_s == pytest.approx(exact.arrival_s, abs=0.5, nan_ok=True)
        assert_safe(measured)
        assert listener.alarms(Notice.WHEELS) == []


@pytest.mark.parametrize("variant", [Variant.SLIDE, Variant.SLIP])
def test_fast_slip_and_slide_is_felt_and_the_next_balise_corrects_it(variant: Variant) -> None:
    scenario = two_trains()
    # The first train leaves after 30 s, and passes 900 m after some 70 s.
    wrong = failure(variant, "T1", 55.0, 6.0, 6.0)
    record, engine, listener = failing(scenario, wrong)
    assert_safe(record)
    ((found_s, row),) = listener.alarms(Notice.WHEELS)
    speed_mps = np.interp(wrong.from_s, engine.time_s, engine.speed_mps[:, 0])
    # 6 m/s in 3 s: until it is more than two per cent of the speed.
    assert row == 0
    assert found_s - 55.0 == pytest.approx(RATIO * speed_mps / 2.0, abs=0.25)
    corrected_s, _ = listener.alarms(Notice.BALISE)[0]
    passed_s = min(engine.passes_s(0, place_m) for place_m in BALISES_M if place_m > 800.0)
    assert corrected_s == pytest.approx(passed_s - READY_S, abs=0.25)
    widest_m = max(float(memory.aboard.widened_m[0]) for _, _, memory in listener.said)
    # 6 m/s x 4.5 s and two per cent of the way, less half the margin; some of it when it is over.
    assert 5.0 < widest_m < 27.0


def test_slow_growth_is_found_by_the_balise_and_covered_by_the_margin() -> None:
    worn = failure(Variant.WHEEL, "T1", 0.0, 300.0, -0.9 * RATIO)
    record, _, listener = failing(two_trains(), worn)
    assert_safe(record)
    assert listener.alarms(Notice.WHEELS) == []
    assert len(listener.alarms(Notice.BALISE)) >= 2
    assert all(not memory.aboard.widened_m.any() for _, _, memory in listener.said)


def test_the_bound_of_the_position_is_never_passed() -> None:
    for variant, size in ((Variant.SLIDE, 8.0), (Variant.SLIP, 8.0), (Variant.WHEEL, 0.05)):
        _, _, listener = failing(two_trains(), failure(variant, "T1", 50.0, 10.0, size))
        for state, _, memory in listener.said:
            aboard = memory.aboard
            error_m = aboard.shift_m - aboard.widened_m
            assert np.all(
                np.abs(error_m[state.present]) <= aboard.uncertain_m[state.present] + 1e-6
            )


def test_far_from_a_balise_the_band_is_widened_for_what_the_margin_does_not_cover() -> None:
    scenario = two_station_scenario(1, spacing_m=2500.0, run_s=180.0)
    record, _, listener = failing(replace(scenario, step_s=0.1))
    assert_safe(record)
    for state, _, memory in listener.said:
        run_m = max(float(state.front_m[0]) - 300.0, 0.0)
        expected_m = max(RATIO * run_m - 12.5, 0.0)
        assert memory.aboard.widened_m[0] == pytest.approx(expected_m, abs=0.1)


@pytest.mark.parametrize(
    ("variant", "id_"), [(Variant.STATE, "fan"), (Variant.EQUIPMENT, "throat")]
)
def test_equipment_that_cannot_tell_its_state_is_an_obstruction_at_once(
    variant: Variant, id_: str
) -> None:
    scenario = loop_station_scenario(3, 90.0)
    wrong = failure(variant, id_, 100.0, 60.0)
    record, engine, _ = failing(scenario, wrong)
    assert_safe(record)
    (set_by,) = [item for item in record.obstructions if item.cause is Cause.FAILURE]
    assert set_by.established_s == wrong.from_s
    assert set_by.lifted_s == wrong.until_s
    turnout = next(item for item in scenario.line.turnouts if item.id == id_)
    for row in range(3):
        entered_s = engine.passes_s(row, turnout.fouling_start_m + 1.0)
        assert not wrong.from_s + 6.0 < entered_s < wrong.until_s


@pytest.mark.parametrize("ahead_s", [20.0, 3.0, -3.0, -20.0])
def test_a_clock_that_jumps_stops_the_train(ahead_s: float) -> None:
    wrong = failure(Variant.JUMP, "T1", 55.0, 30.0, ahead_s)
    record, _, listener = failing(two_trains(), wrong)
    assert_safe(record)
    assert braked(record) == {0}
    found_s, row = listener.alarms(Notice.TRAIN_STAMP)[0]
    assert row == 0
    # The next telegram is at most a cycle and the delay away.
    assert 55.0 <= found_s <= 55.0 + 1.0 + LOSSLESS.delay_most_s + 0.1
    assert listener.alarms(Notice.REPORT_STAMP)[0][1] == 0


@pytest.mark.parametrize("ahead_s", [0.4, -0.1])
def test_a_clock_within_tolerance_harms_nobody(ahead_s: float) -> None:
    record, _, listener = failing(two_trains(), failure(Variant.JUMP, "T1", 0.0, 200.0, ahead_s))
    assert_safe(record)
    assert braked(record) == set()
    assert listener.alarms(Notice.TRAIN_STAMP) == []


def test_a_train_that_is_not_heard_keeps_its_band_and_stops_when_its_commands_run_out() -> None:
    record, _, listener = failing(two_trains(), failure(Variant.UP, "T1", 55.0, 40.0))
    assert_safe(record)
    found_s, row = listener.alarms(Notice.NO_REPORT)[0]
    assert row == 0
    assert 55.0 + 2.0 <= found_s <= 55.0 + 4.0
    for state, _, memory in listener.said:
        if 60.0 < state.time_s - READY_S < 95.0:
            assert memory.plan.rear_m[0].max() <= memory.reports.front_m[0] - 200.0 + 1e-6


def test_a_train_that_hears_nothing_brakes_when_its_commands_run_out() -> None:
    record, _, listener = failing(two_trains(), failure(Variant.DOWN, "T1", 55.2, 40.0))
    assert_safe(record)
    (found_s, row), *_ = [item for item in listener.alarms(Notice.NO_COMMANDS) if item[0] > 55.0]
    # The last telegram was sent after 54.5 s.
    assert row == 0
    assert found_s == pytest.approx(59.5, abs=0.15)
    assert braked(record) == {0}


@pytest.mark.parametrize(("lasts_s", "stops"), [(2.9, False), (20.0, True)])
def test_a_silent_centre_is_missed_after_three_telegrams(lasts_s: float, stops: bool) -> None:
    record, _, _ = failing(two_trains(60.0), failure(Variant.CENTRE_SILENT, CENTRE, 55.6, lasts_s))
    assert_safe(record)
    assert bool(braked(record)) is stops


@pytest.mark.parametrize(("ahead_s", "found"), [(0.4, False), (-0.4, False), (3.0, True)])
def test_the_centre_compares_its_clock_with_satellite_time(ahead_s: float, found: bool) -> None:
    wrong = failure(Variant.CENTRE_JUMP, CENTRE, 55.0, 20.0, ahead_s)
    record, _, listener = failing(two_trains(60.0), wrong)
    assert_safe(record)
    told = [(round(time_s, 3), row) for time_s, row in listener.alarms(Notice.CENTRE_CLOCK)]
    assert told == ([(55.0, -1)] if found else [])
    assert bool(braked(record)) is found


@pytest.mark.parametrize("variant", VARIANTS[FailureMode.MAP])
def test_a_wrong_map_is_refused_before_it_is_sent(variant: Variant) -> None:
    """The leader overstays, so that the follower would run into it."""
    unit = "T2" if variant is Variant.RUN else "T1"
    wrong = failure(variant, unit, 100.0, 60.0, 250.0)
    scenario = two_trains(75.0)
    if variant is Variant.IGNORED:
        place_m = 800.0, 820.0
        times_s = READY_S + 90.0, np.inf, READY_S + 200.0
        closed = Closure("broken rail", Cause.FAILURE, ("main",), *place_m, *times_s)
        scenario = replace(scenario, disruptions=Disruptions((closed,)))
        wrong = failure(variant, "T2", 85.0, 100.0)
    record, _, listener = failing(scenario, wrong, overstay_s=90.0)
    assert_safe(record)
    found = listener.alarms(Notice.EXCLUSION)
    assert found
    assert all(row == -1 and wrong.from_s - READY_S <= time_s for time_s, row in found)


def test_unit_failures_are_drawn_within_their_ranges_and_every_kind_comes() -> None:
    world = world_of(loop_station_scenario(3))
    drawn = [draw_failure(world, 1, number) for number in range(2000)]
    assert draw_failure(world, 1, 17) == drawn[17]
    for kind in FailureMode:
        share = sum(item.kind is kind for item in drawn) / len(drawn)
        # Four standard errors of one in seven.
        assert abs(share - 1.0 / 7.0) < 4.0 * np.sqrt(6.0 / 49.0 / len(drawn))
    for item in drawn:
        shortest_s, longest_s = WHEEL_S if item.variant is Variant.WHEEL else DURATION_S[item.kind]
        assert shortest_s - 1e-6 <= item.duration_s <= longest_s + 1e-6
        least, most = SIZE.get(item.variant, (0.0, 0.0))
        assert least - 1e-9 <= abs(item.size) <= most + 1e-9
    assert {item.variant for item in drawn} == set(KIND_OF)


def test_a_line_without_points_has_no_faults_of_points() -> None:
    world = world_of(two_trains())
    drawn = {draw_failure(world, 1, number).variant for number in range(500)}
    assert drawn == set(KIND_OF) - {Variant.STATE, Variant.EQUIPMENT}
