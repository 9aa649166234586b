"""Turns that go to who comes first: nobody waits for a late train, and nobody for ever."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kankaku.controllers.registry import ControllerError
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.step.records import RunRecord
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.mistakes import ScenarioError
from tests.networks import run_network

SCENARIOS = Path(__file__).parents[2] / "scenarios"
LATE_S = 400.0


def by_turn(name: str) -> Scenario:
    """Return a shipped network with a long step, which takes a fifth of the time."""
    return replace(load(SCENARIOS / name), step_s=0.5)


def first_come(name: str) -> Scenario:
    scenario = by_turn(name)
    return replace(scenario, line=replace(scenario.line, first_come=True))


def arrivals_s(record: RunRecord, station: str) -> dict[str, float]:
    """Return when each train arrives at a station. [s]"""
    return {
        service.train: float(record.arrival_s[row, number])
        for row, service in enumerate(record.world.timetable.services)
        for number, call in enumerate(service.calls)
        if call.station == station
    }


def mean_delay_s(record: RunRecord) -> float:
    booked_s = record.world.booked_arrival_s[:, :-1]
    return float(np.nanmean(np.maximum(record.arrival_s - booked_s, 0.0)))


def test_the_other_branch_does_not_wait_for_a_late_train() -> None:
    late = {"n03": {"n": LATE_S}}
    by_timetable = run_network(by_turn("branch"), delays_s=late)[0]
    by_coming = run_network(first_come("branch"), delays_s=late)[0]
    for record in (by_timetable, by_coming):
        assert record.completed.all()
        assert record.violations == ()
    waited_s, went_s = (arrivals_s(record, "j") for record in (by_timetable, by_coming))
    assert waited_s["n03"] < waited_s["s04"]
    assert went_s["s04"] < went_s["n03"]
    # As booked, as if n03 were not there.
    assert went_s["s04"] <= waited_s["s04"] - 200.0
    assert mean_delay_s(by_coming) < 0.6 * mean_delay_s(by_timetable)


def test_in_time_it_is_the_order_of_the_timetable() -> None:
    for name in ("overtaking", "single_track"):
        by_timetable = run_network(by_turn(name))[0]
        by_coming = run_network(first_come(name))[0]
        assert np.array_equal(by_timetable.arrival_s, by_coming.arrival_s, equal_nan=True)


@pytest.mark.parametrize("name", ["single_track", "overtaking", "terminal"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_nobody_waits_for_ever_whoever_is_late(name: str, seed: int) -> None:
    scenario, rng = first_come(name), np.random.default_rng(seed)
    late = {
        service.train: {service.origin: float(rng.choice([60.0, 240.0, 600.0]))}
        for service in scenario.timetable.services
        if rng.random() < 0.3
    }
    record, _ = run_network(replace(scenario, step_s=0.5), delays_s=late)
    assert late
    assert record.completed.all()
    assert record.violations == ()


def test_a_centre_that_plans_by_the_timetable_refuses_it() -> None:
    with pytest.raises(ControllerError, match="order of the timetable"):
        run_network(first_come("branch"), "control_map", protection="control_map")


def test_a_chain_has_no_turns_to_give(tmp_path: Path) -> None:
    folder = tmp_path / "chain"
    folder.mkdir()
    for file in (SCENARIOS / "sakai_case1").iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    main = folder / "scenario.toml"
    text = main.read_text("utf-8").replace("../", f"{SCENARIOS}/")
    main.write_text(f'{text}\n[interlocking]\norder = "first_come"\n', "utf-8")
    with pytest.raises(ScenarioError, match=r"interlocking\.order"):
        load(folder)
