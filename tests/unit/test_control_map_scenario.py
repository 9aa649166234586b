"""The scenario of the control map on the toy engine: what is in the way, and who meets it."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from kankaku.controllers.registry import build
from kankaku.railway.arrays import FloatArray
from kankaku.railway.loop.simulate import simulate
from kankaku.railway.meters.all_meters import all_meters
from kankaku.railway.plan.disruptions import Cause
from kankaku.railway.plan.run import Run
from kankaku.railway.plan.world import build_world
from kankaku.railway.step.obstructions import Obstruction
from kankaku.railway.step.records import RunRecord
from kankaku.scenarios.loading.load import load
from kankaku.testing.toy_engine import ToyEngine

SCENARIO = load(Path(__file__).parents[2] / "scenarios" / "control_map")
CONTROLLERS = tuple(spec.name for spec in SCENARIO.controllers)
TURNOUT = SCENARIO.line.turnouts[0]
MOVES_S = TURNOUT.throw_s + TURNOUT.proof_s
(FAILURE,) = SCENARIO.disruptions.points_failures
(ZONE,) = SCENARIO.disruptions.closures
T2, T5 = 1, 4


@cache
def run(name: str) -> RunRecord:
    step_s = SCENARIO.step_s
    world = build_world(SCENARIO.line, SCENARIO.train_types, SCENARIO.timetable, step_s)
    spec = next(spec for spec in SCENARIO.controllers if spec.name == name)
    no_delay_s = SCENARIO.dwell_delays.draw(SCENARIO.timetable, SCENARIO.seed)
    run = Run(
        world,
        no_delay_s,
        SCENARIO.seed,
        SCENARIO.patience_s,
        SCENARIO.disruptions,
        SCENARIO.radio,
    )
    engine, controller = ToyEngine(world, no_delay_s, step_s), build(spec, world, SCENARIO.radio)
    return simulate(run, engine, controller, all_meters(world))


def throws(record: RunRecord) -> list[Obstruction]:
    return [item for item in record.obstructions if item.id == TURNOUT.id]


def failed(record: RunRecord) -> Obstruction:
    (found,) = (item for item in throws(record) if item.lifted_s - item.requested_s > 60.0)
    return found


def fronts_m(record: RunRecord, row: int, start_s: float, end_s: float) -> FloatArray:
    samples = record.trajectory
    chosen = (samples.row == row) & (samples.time_s >= start_s) & (samples.time_s < end_s)
    fronts: FloatArray = samples.front_m[chosen]
    return fronts


@pytest.mark.parametrize("name", CONTROLLERS)
def test_all_trains_reach_the_end_without_a_violation(name: str) -> None:
    record = run(name)
    assert record.completed.all()
    assert record.violations == ()


@pytest.mark.parametrize("name", CONTROLLERS)
def test_points_throw_for_every_train_and_fail_for_one(name: str) -> None:
    found = throws(run(name))
    assert len(found) == len(SCENARIO.timetable.services) - 1
    took_s = sorted(item.lifted_s - item.requested_s for item in found)
    assert took_s[:-1] == pytest.approx([MOVES_S] * (len(found) - 1), abs=2 * SCENARIO.step_s)
    # They are thrown again when they are repaired.
    assert failed(run(name)).lifted_s == pytest.approx(
        FAILURE.until_s + MOVES_S, abs=2 * SCENARIO.step_s
    )


@pytest.mark.parametrize("name", CONTROLLERS)
def test_the_train_that_meets_the_failed_points_stays_short_of_the_locked_section(
    name: str,
) -> None:
    record = run(name)
    failure = failed(record)
    assert failure.cause is Cause.POINTS
    own_m = fronts_m(record, T5, failure.requested_s, failure.lifted_s)
    assert own_m.max() < TURNOUT.fouling_start_m
    assert own_m.max() > TURNOUT.fouling_start_m - 250.0
    booked_s = record.world.booked_arrival_s[T5, 1]
    assert 60.0 < record.arrival_s[T5, 1] - booked_s < 120.0


def test_close_up_it_stands_a_margin_before_them_until_they_are_proven() -> None:
    record = run("close_up")
    stands = record.standstills
    ((start_s, duration_s, front_m),) = (
        (stands.start_s[at], stands.duration_s[at], stands.front_m[at])
        for at in np.flatnonzero(stands.row == T5)
    )
    assert front_m == pytest.approx(TURNOUT.fouling_start_m - 25.0, abs=1.0)
    assert start_s + duration_s == pytest.approx(failed(record).lifted_s, abs=1.0)


def test_under_the_control_map_it_comes_so_slowly_that_it_need_not_stand() -> None:
    record = run("control_map")
    assert T5 not in record.standstills.row
    # And it is no later for it.
    late_s = record.arrival_s[T5, 1] - run("close_up").arrival_s[T5, 1]
    assert late_s < 5.0


@pytest.mark.parametrize("name", CONTROLLERS)
def test_the_other_trains_keep_running_and_the_line_recovers(name: str) -> None:
    record = run(name)
    late_s = record.arrival_s - record.world.booked_arrival_s[:, :-1]
    failure = failed(record)
    for ahead in (2, 3):
        assert record.departure_s[ahead, 1] < failure.lifted_s
        assert failure.requested_s < record.arrival_s[ahead, 2]
    assert late_s[3].max() <= 0.0
    assert late_s[T5, 2] < late_s[T5, 1]
    assert late_s[T5 + 1].max() < 30.0
    assert late_s[T5 + 2 :].max() <= 0.0


@pytest.mark.parametrize("name", CONTROLLERS)
def test_nobody_is_in_the_work_zone_and_one_train_waits_until_it_is_given_back(name: str) -> None:
    record = run(name)
    (zone,) = (item for item in record.obstructions if item.cause is Cause.WORK)
    assert zone.requested_s == pytest.approx(ZONE.from_s, abs=SCENARIO.step_s)
    assert zone.lifted_s == pytest.approx(ZONE.released_s, abs=SCENARIO.step_s)
    assert ZONE.released_s - ZONE.until_s == 30.0
    samples = record.trajectory
    during = (samples.time_s >= zone.established_s) & (samples.time_s < zone.lifted_s)
    tail_m = samples.front_m - record.world.length_m[samples.row]
    inside = (samples.front_m > ZONE.start_m + 0.5) & (tail_m < ZONE.end_m)
    assert not np.any(during & inside)
    own_m = fronts_m(record, T2, zone.lifted_s - 20.0, zone.lifted_s)
    assert own_m == pytest.approx(ZONE.start_m - 25.0, abs=2.0)
