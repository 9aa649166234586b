"""What was imported runs: every train arrives when it is booked, under all four controllers."""

from pathlib import Path

import numpy as np
import pytest

from kankaku.controllers.registry import build
from kankaku.railway.arrays import FloatArray
from kankaku.railway.loop.simulate import simulate
from kankaku.railway.meters.all_meters import all_meters
from kankaku.railway.plan.radio_spec import LOSSLESS
from kankaku.railway.plan.run import Run
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.scenarios.drafts.draft import write_files
from kankaku.scenarios.drafts.equipment import longest_block_m
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.importing.formats import Wish, imported
from kankaku.scenarios.importing.wished_stock import library_stock
from kankaku.scenarios.loading.load import load
from kankaku.testing.example_lines import world_of
from kankaku.testing.toy_engine import ToyEngine
from tests.networks import overstays_s
from tests.unit.mutated_sources import write_json
from tests.unit.railjson_sources import INFRA, STOCK
from tests.unit.test_railsim_import import NETWORK, VEHICLES, folder_of
from tests.unit.test_ttobench_import import BEIJING, TRACK


def made(name: str, folder: Path) -> Scenario:
    """Import a small source of a format."""
    if name == "ttobench":
        source, wish = write_json(folder / "small.json", TRACK), Wish(stock=BEIJING, trains=3)
    elif name == "railjson":
        source = write_json(folder / "infra.json", INFRA)
        stock = write_json(folder / "unit.json", STOCK)
        wish = Wish(stock=stock, trains=3, headway_s=240.0)
    else:
        source, wish = folder_of(folder / "case"), Wish()
    write_files(imported(name, source, wish).files(), folder / "made")
    return load(folder / "made")


def last_s(scenario: Scenario, spec: ControllerSpec) -> tuple[FloatArray, FloatArray]:
    """Run under a controller; return last arrivals as they were and as booked. [s]"""
    world = world_of(scenario)
    delay_s = overstays_s(world, {})
    plan = (world, delay_s, scenario.seed, scenario.patience_s)
    engine = ToyEngine(world, delay_s, scenario.step_s)
    run = Run(*plan, scenario.disruptions, LOSSLESS)
    record = simulate(run, engine, build(spec, world, LOSSLESS), all_meters(world))
    assert record.violations == ()
    assert record.completed.all(), spec.name
    services = scenario.timetable.services
    came = [record.arrival_s[row, len(it.calls) - 1] for row, it in enumerate(services)]
    return np.array(came), np.array([it.calls[-1].arrival_s for it in services])


@pytest.mark.parametrize("name", ["ttobench", "railjson", "railsim"])
def test_every_train_arrives_as_booked(name: str, tmp_path: Path) -> None:
    scenario = made(name, tmp_path)
    assert len(scenario.controllers) == 4
    for spec in scenario.controllers:
        came_s, booked_s = last_s(scenario, spec)
        if spec.protection == "moving_block":
            # Those of railsim are booked as early as they can come, in whole seconds.
            assert (came_s <= booked_s + 1.0).all(), (spec.name, came_s - booked_s)
            assert (came_s >= booked_s - 60.0).all()


def test_a_fast_train_alone_is_not_slowed_by_its_blocks(tmp_path: Path) -> None:
    """With blocks of 250 m no train that brakes at 0.56 m/s2 would be let run at 160 km/h."""
    quick = VEHICLES.replace('"25.0"', '"44.4"').replace(">0.6<", ">0.56<")
    net = NETWORK.replace('freespeed="30.0"', 'freespeed="50.0"').replace("2000.0", "15000.0")
    source = folder_of(tmp_path / "case", net=net, vehicles=quick)
    write_files(imported("railsim", source, Wish(route="aside")).files(), tmp_path / "made")
    scenario = load(tmp_path / "made")
    came_s = {spec.name: last_s(scenario, spec)[0] for spec in scenario.controllers}
    assert came_s["atc"][0] <= came_s["close_up"][0] + 30.0
    assert longest_block_m(library_stock("metro", SourceNotes(""))) == 250.0
