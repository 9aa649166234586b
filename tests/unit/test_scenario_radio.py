"""The radio of a scenario: what a file may say of it, and what is said when it says too much."""

from pathlib import Path

import pytest

from kankaku.railway.plan.radio_spec import LOSSLESS, RadioSpec
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.mistakes import ScenarioError
from tests.unit.scenario_folder import replace, write_scenario

HEAD = "[controllers.plain]\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_scenario(tmp_path / "small")


def test_without_a_table_the_radio_is_that_of_the_source(folder: Path) -> None:
    scenario = load(folder)
    assert scenario.radio == LOSSLESS == RadioSpec(1.0, 0.3, 0.6, 0.0, 1.0)
    assert [spec.radio for spec in scenario.controllers] == [False]


def test_percent_become_shares(folder: Path) -> None:
    keys = "cycle_s = 2.0\ndelay_most_s = 1.5\nloss_percent = 20.0\nburst_factor = 3.0\n"
    replace(folder, "scenario.toml", HEAD, f"[radio]\n{keys}\n{HEAD}radio = true\n")
    scenario = load(folder)
    assert scenario.radio == RadioSpec(2.0, 0.3, 1.5, 0.2, 3.0)
    assert [spec.radio for spec in scenario.controllers] == [True]


@pytest.mark.parametrize(
    ("keys", "where", "allowed"),
    [
        ("cycle_s = 0.05", "radio.cycle_s", "a number from 0.1 up to 2"),
        ("delay_most_s = 2.5", "radio.delay_most_s", "a number from 0 up to 2"),
        ("loss_percent = 100.0", "radio.loss_percent", "a number from 0 below 100"),
        ("burst_factor = 0.5", "radio.burst_factor", "a number from 1 up to 100"),
        ("delay_least_s = 0.7", "radio.delay_most_s", "from 0.7"),
        ("cycle_s = 1.5", "radio.cycle_s", "a multiple of 1 s"),
        ("delays_s = 0.5", "radio.delays_s", "delay"),
    ],
)
def test_what_is_wrong_is_named_with_what_is_allowed(
    folder: Path, keys: str, where: str, allowed: str
) -> None:
    replace(folder, "scenario.toml", HEAD, f"[radio]\n{keys}\n\n{HEAD}")
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    (mistake,) = caught.value.mistakes
    assert (mistake.file, mistake.where) == ("scenario.toml", where)
    assert allowed in mistake.allowed


def test_the_step_divides_half_a_cycle_if_anybody_goes_by_radio(folder: Path) -> None:
    replace(folder, "scenario.toml", "step_s = 0.5", "step_s = 0.3")
    load(folder)
    replace(folder, "scenario.toml", HEAD, f"{HEAD}radio = true\n")
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    assert [mistake.where for mistake in caught.value.mistakes] == ["radio.cycle_s"]


def test_a_peer_has_no_radio(folder: Path) -> None:
    peer = '[controllers.theirs]\npeer = "sumo_native_moving"\nradio = true\n\n'
    replace(folder, "scenario.toml", HEAD, peer + HEAD)
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    assert [mistake.where for mistake in caught.value.mistakes] == ["controllers.theirs.radio"]
