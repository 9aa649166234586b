"""The files of the commands ``radio`` and ``availability``: units, fractions, and mistakes told."""

from pathlib import Path

import pytest

from kankaku.railway.plan.line import Line
from kankaku.railway.radio.cells import Link, RadioPlan
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.dependability_files import load_configurations, load_fault_tree
from kankaku.scenarios.reading.mistakes import ScenarioError
from kankaku.scenarios.reading.radio_network import load_radio_plan
from tests.unit.radio_folder import write_radio_scenario
from tests.unit.scenario_folder import replace

RADIO, DEVICES, TREE = "radio_network.toml", "availability.toml", "fault_tree.toml"
CELL_M = 1900.0
SHORT = "cycle_s = 0.9\nupdates_per_cycle = 20"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_radio_scenario(tmp_path / "small")


@pytest.fixture
def line(folder: Path) -> Line:
    return load(folder).line


def mistakes(error: ScenarioError) -> str:
    return "\n".join(map(str, error.mistakes))


def refused_plan(folder: Path, line: Line) -> str:
    with pytest.raises(ScenarioError) as raised:
        load_radio_plan(folder, line)
    return mistakes(raised.value)


def refused_devices(folder: Path) -> str:
    with pytest.raises(ScenarioError) as raised:
        load_configurations(folder)
    return mistakes(raised.value)


def refused_tree(folder: Path) -> str:
    with pytest.raises(ScenarioError) as raised:
        load_fault_tree(folder)
    return mistakes(raised.value)


def test_a_radio_network_in_si_units(folder: Path, line: Line) -> None:
    plan: RadioPlan = load_radio_plan(folder, line)
    central, base = plan.systems
    assert (central.wired_bps, central.radio_bps, base.radio_bps) == (10e6, 64e3, 2400.0)
    assert plan.cells.edges_m.tolist() == [-300.0, -300.0 + CELL_M, 3500.0]
    assert plan.published[0].utilisation == {Link.ANTENNA_TRAIN: 0.8}
    assert plan.published[0].round_trip_max_s is None


def test_the_files_of_the_commands_do_not_change_the_scenario(folder: Path) -> None:
    before = load(folder).digest
    for name in (RADIO, DEVICES, TREE):
        (folder / name).write_text("nonsense", encoding="utf-8")
    assert load(folder).digest == before


def test_devices_in_si_units_and_fractions(folder: Path) -> None:
    (plain,), source, _ = load_configurations(folder)
    base = plain.groups[1]
    assert (base.count, base.effect) == (3.0, 1.0 / 3.0)
    assert base.failure_rate_per_s == pytest.approx(2e-4 / 3600.0)
    assert base.repair_s == 14400.0
    assert (source, plain.published) == ("A table, 2020", {"failures_per_year": 6.13})


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("overlap_m = 300.0", "overlap_m = 1901.0", "overlap_m: 1901 is longer than a cell"),
        ("overlap_m", "overlap_km", "did you mean"),
        ("cells = 2", "cells = 0", "cells: 0 is not allowed; allowed: a whole number from 1"),
        ("radio_kbps = 64", "radio_kbps = 8", "leaves a slot for a device"),
        ("radio_kbps = 64", 'radio_kbps = "64"', "systems.central.radio_kbps: '64'"),
        ("answer_slots = 6", "answer_slots = 23", "answer_slots: 23 is too late; allowed: 1 to 22"),
        ("trackside_devices = 30", "trackside_devices = 31", "more than trackside_devices_max"),
        ("wired_packet_bytes = 7740", "wired_packet_bytes = 539", "leave no room for a command"),
        ('system = "central"', 'system = "centre"', "loads.0.system: no system 'centre'"),
        ("cycle_s = 1.0\nupdates_per_cycle = 2", SHORT, "allowed: 0.05 s or longer"),
        ("central = true", "central = 1", "systems.central.central: 1 is not allowed"),
        ("cycle_s = 1.0\nupdates_per_cycle = 2", "updates_per_cycle = 2", "cycle_s: is missing"),
        ("round_trip_mean_s = 0.9", "round_trip_mean_s = nan", "round_trip_mean_s: nan"),
        ("cells = 2", "cells = 2 2", "line 2"),
    ],
)
def test_a_wrong_radio_network_is_refused(
    folder: Path, line: Line, old: str, new: str, told: str
) -> None:
    replace(folder, RADIO, old, new)
    answer = refused_plan(folder, line)
    assert RADIO in answer
    assert told in answer


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('"1/3"', '"1/0"', "systems.plain.devices.base_unit.effect: '1/0' is not allowed"),
        ('"1/3"', "1.5", "a number from 0 up to 1, or a fraction"),
        ("count = 3", "count = 0", 'above 0 up to 10000, or a fraction as "2/3"'),
        ("[devices.base_unit]", "[devices.base_units]", "no device 'base_unit'"),
        ("repair_h = 4.0", "repair_h = 0.0", "devices.base_unit.repair_h"),
        ("repair_h = 4.0", "repair_min = 4.0", "unknown key 'repair_min'"),
        ("failures_per_hour = 1e-4", "failures_per_hour = -1e-4", "devices.controller"),
        ("schema_version = 1", "schema_version = 2", "schema_version: 2 is not allowed"),
    ],
)
def test_wrong_devices_are_refused(folder: Path, old: str, new: str, told: str) -> None:
    replace(folder, DEVICES, old, new)
    assert told in refused_devices(folder)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('["missed", "blind"]', '["missed", "blinds"]', "no event or gate 'blinds'"),
        ('["missed", "blind"]', '["missed"]', "events.blind: leads to no top event"),
        ('["missed", "blind"]', '["missed", "blind", "collision"]', "follows from itself"),
        ("any_of", "some_of", "unknown key 'some_of'"),
        ("any_of =", 'all_of = ["wrong"]\nany_of =', "gates.unnoticed: has both"),
        ('any_of = ["missed", "blind"]', "", "has neither any_of nor all_of"),
        ('tops = ["collision"]', 'tops = ["wrong"]', "tops: no gate 'wrong'"),
        ('tops = ["collision"]', "tops = []", "tops"),
        ("probability = 1e-3", "probability = 1.1", "events.missed.probability: 1.1"),
        ("blind =", "unnoticed =", "gates.unnoticed: there is an event of that name"),
        ("period_h = 1.0", "", "period_h: is missing"),
    ],
)
def test_a_wrong_fault_tree_is_refused(folder: Path, old: str, new: str, told: str) -> None:
    replace(folder, TREE, old, new)
    answer = refused_tree(folder)
    assert TREE in answer
    assert told in answer


def test_a_missing_file_is_told_and_a_missing_fault_tree_is_none(folder: Path, line: Line) -> None:
    for name in (RADIO, DEVICES, TREE):
        (folder / name).unlink()
    assert "radio_network.toml: the file is missing" in refused_plan(folder, line)
    assert "availability.toml: the file is missing" in refused_devices(folder)
    assert load_fault_tree(folder) is None
