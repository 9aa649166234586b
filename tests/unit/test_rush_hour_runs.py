"""The rush hour as a whole, on the toy engine: what must hold whatever the delays."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kankaku.controllers.registry import build
from kankaku.railway.loop.simulate import simulate
from kankaku.railway.meters.all_meters import all_meters
from kankaku.railway.plan.dwell import DwellDelays, Overstay
from kankaku.railway.plan.run import Run
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.world import build_world
from kankaku.railway.step.records import RunRecord
from kankaku.scenarios.loading.load import load
from kankaku.testing.toy_engine import ToyEngine

FOLDER = Path(__file__).parents[2] / "scenarios" / "rush_hour"
STEP_S = 0.5


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return load(FOLDER)


def run(scenario: Scenario, name: str, delays: DwellDelays) -> RunRecord:
    world = build_world(scenario.line, scenario.train_types, scenario.timetable, STEP_S)
    drawn_s = delays.draw(scenario.timetable, scenario.seed)
    spec = next(spec for spec in scenario.controllers if spec.name == name)
    engine = ToyEngine(world, drawn_s, STEP_S)
    controller = build(spec, world)
    return simulate(Run(world, drawn_s, 1, 3600.0), engine, controller, all_meters(world))


@pytest.mark.parametrize("name", ["close_up", "two_stage", "two_stage_plain"])
def test_without_overstays_every_train_departs_as_booked_and_none_stands(
    scenario: Scenario, name: str
) -> None:
    record = run(scenario, name, DwellDelays())
    assert record.completed.all()
    assert record.violations == ()
    assert record.standstills.row.size == 0
    booked_s = record.world.booked_departure_s[:, :-1]
    late_s = (record.departure_s - booked_s)[np.isfinite(record.departure_s)]
    assert late_s.min() >= 0.0
    assert late_s.max() <= 2.0 * STEP_S


def test_behind_one_long_overstay_close_up_stands_and_two_stage_does_not(
    scenario: Scenario,
) -> None:
    train = scenario.timetable.trains[19]
    delays = replace(DwellDelays(), overstays=(Overstay(train, "kawaguchi", 150.0),))
    stands_s = {
        name: run(scenario, name, delays).standstills.duration_s.sum()
        for name in ("close_up", "two_stage_plain", "two_stage")
    }
    assert stands_s["close_up"] > 20.0
    assert stands_s["two_stage"] <= stands_s["two_stage_plain"] < stands_s["close_up"]
