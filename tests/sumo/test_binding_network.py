"""The rules of networks are kept, and just kept, on a network where they bind."""

from pathlib import Path

import numpy as np
import pytest

from kankaku.railway.step.records import RunRecord
from kankaku.studies import study

SCENARIO = Path(__file__).parents[2] / "scenarios" / "binding_network"
TURN_BACK_S, THROW_S = 120.0, 25.0
SAMPLE_S = 1.0
"""Places are recorded once a second. [s]"""


def run(name: str) -> RunRecord:
    chosen = study.choose(SCENARIO, names=(name,))
    record = study.run_once(chosen.scenario, chosen.specs[0], chosen.seeds[0], chosen.step_s)
    assert record.violations == ()
    assert record.completed.all()
    return record


def row_of(record: RunRecord, train: str) -> int:
    return record.world.timetable.trains.index(train)


def passes_s(record: RunRecord, train: str, place_m: float) -> float:
    """Return when the front of a train is at a place of its own route. [s]"""
    samples, row = record.trajectory, row_of(record, train)
    own = samples.row == row
    front_m = np.maximum.accumulate(samples.front_m[own])
    return float(np.interp(place_m, front_m, samples.time_s[own]))


@pytest.mark.parametrize("name", ["moving", "atc", "atd", "by_radio", "control_map"])
def test_nobody_is_accused(name: str) -> None:
    run(name)


def test_the_rules_bind() -> None:
    record = run("moving")
    line, length_m = record.world.line, record.world.length_m[0]
    # w4 sets off as soon as its stock may.
    arrived_s = record.arrival_s[row_of(record, "e4"), 1]
    taken_s = record.departure_s[row_of(record, "w4"), 0] - arrived_s
    assert taken_s == pytest.approx(TURN_BACK_S, abs=record.world.step_s + 1e-6)
    # e2 is granted the scissors when w1, whose way crosses its own, has left them, and they lie.
    turnout = next(n for n, points in enumerate(line.turnouts) if points.id == "west-points")
    falling_m = line.mirrored_m(line.turnouts[turnout].fouling_start_m)
    cleared_s = passes_s(record, "w1", falling_m + length_m)
    starts_s = record.departure_s[row_of(record, "e2"), 0]
    # It departs up to the end of its authority before that, and goes on then.
    entered_s = passes_s(record, "e2", line.turnouts[turnout].fouling_start_m)
    assert starts_s <= cleared_s + THROW_S + SAMPLE_S
    assert entered_s - cleared_s + SAMPLE_S >= THROW_S
    assert entered_s - cleared_s < THROW_S + 20.0
    # e3 waits before the only track in the east until w2 has left it.
    east = next(points for points in line.turnouts if points.id == "east-points")
    left_s = passes_s(record, "w2", line.mirrored_m(east.fouling_start_m) + length_m)
    came_s = passes_s(record, "e3", east.fouling_start_m)
    assert came_s - left_s + SAMPLE_S >= THROW_S
    assert came_s - left_s < THROW_S + 20.0
