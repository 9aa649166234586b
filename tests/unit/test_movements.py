"""Protection broken on purpose in networks: the monitor, which asks nobody, tells what happens."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kankaku.railway.arrays import FloatArray
from kankaku.railway.loop import tracker
from kankaku.railway.plan.world import World
from kankaku.railway.step.records import RunRecord, Violation
from kankaku.railway.wayside.leaders import Leaders
from kankaku.testing.toy_engine import ToyEngine
from tests.networks import LOOP, TERMINAL, Delays, Files, network, row_of, run_network

EngineOf = Callable[[World, FloatArray, float], ToyEngine]
SLOW_POINTS = TERMINAL["nodes.csv"].replace("1.55,1.65,4,1", "1.55,1.65,29,1")


class Heedless(Leaders):
    """Lets nobody wait for trains on other ways."""

    def _blocker(self, row: int, number: int, time_s: float) -> int | None:
        del row, number, time_s
        return None


class Hasty(Leaders):
    """Takes points as thrown in no time."""

    def __init__(self, world: World) -> None:
        super().__init__(world)
        self._throw_s = [0.0] * len(self._throw_s)


class Runaway(ToyEngine):
    """Its first train brakes no more below 5 m/s once it has run."""

    _has_run = False

    def apply(self, speed_mps: FloatArray) -> None:
        self._has_run |= bool(speed_mps[0] > 10.0)
        told = speed_mps.copy()
        if self._has_run:
            told[0] = max(told[0], 5.0)
        super().apply(told)


def hurried(world: World, delay_s: FloatArray, step_s: float) -> ToyEngine:
    """Return an engine that knows nothing of the time it takes to turn back."""
    return ToyEngine(
        replace(world, minimum_dwell_s=np.minimum(world.minimum_dwell_s, 20.0)), delay_s, step_s
    )


def told(record: RunRecord, kind: str) -> list[Violation]:
    return [violation for violation in record.violations if violation.kind == kind]


def broken(
    monkeypatch: pytest.MonkeyPatch,
    folder: Path,
    files: Files,
    delays_s: Delays,
    leaders: type[Leaders] = Leaders,
    engine_of: EngineOf = ToyEngine,
) -> RunRecord:
    """Run a network as it should be, in which nothing is wrong, and broken."""
    scenario = network(folder, files)
    assert run_network(scenario, delays_s=delays_s)[0].violations == ()
    monkeypatch.setattr(tracker, "Leaders", leaders)
    scenario = replace(scenario, patience_s=120.0)
    return run_network(scenario, delays_s=delays_s, engine_of=engine_of)[0]


def test_trains_of_both_directions_on_single_track(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """f1 stays at b, and r1 comes along the track on which it stands."""
    record = broken(monkeypatch, tmp_path, LOOP, {"f1": {"b": 300.0}}, Heedless)
    first, *_ = told(record, "opposing")
    assert first.row == row_of(record, "r1")
    assert "with a train of another way" in first.message
    # It left m after 190 s and stands at b after 263 s; the track begins at km 1.15.
    assert 25_390.0 < first.time_s < 25_463.0


def test_trains_that_cross_at_points(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """r2 goes to the far track of a terminal as f1 leaves the near one: they share no track."""
    record = broken(monkeypatch, tmp_path, TERMINAL, {"r2": {"a": 60.0}}, Heedless)
    kinds = {violation.kind for violation in record.violations}
    assert "fouling" in kinds
    assert "opposing" not in kinds
    for violation in told(record, "fouling"):
        assert violation.row in {row_of(record, "r2"), row_of(record, "f1")}


def test_points_that_cannot_lie_right_yet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = {**TERMINAL, "nodes.csv": SLOW_POINTS}
    record = broken(monkeypatch, tmp_path, files, {}, Hasty)
    assert told(record, "fouling") == []
    early = told(record, "points")
    assert row_of(record, "r2") in {violation.row for violation in early}
    # It stands 25 m before them, and 30 s are needed.
    assert all(0.0 < violation.excess < 30.0 for violation in early)


def test_a_train_that_turns_back_too_soon(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    late = {"r1": {"a": 180.0}}
    record = broken(monkeypatch, tmp_path, TERMINAL, late, engine_of=hurried)
    early, *_ = told(record, "turn_back")
    assert early.row == row_of(record, "f1")
    row = row_of(record, "r1")
    turned_s = early.time_s - float(record.arrival_s[row, 1])
    assert early.excess == pytest.approx(60.0 - turned_s)
    # 20 s as the train that came, 20 s as the one that goes.
    assert turned_s == pytest.approx(40.0, abs=1.0)


def test_a_train_that_does_not_stop_before_the_buffer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = broken(monkeypatch, tmp_path, LOOP, {}, engine_of=Runaway)
    first, *_ = told(record, "buffer")
    assert first.row == 0
    assert "into the buffer stop" in first.message
    # It ran on to the end, up to 120 s after the last booked time.
    assert first.excess > 100.0
