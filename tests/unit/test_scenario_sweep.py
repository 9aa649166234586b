"""The tables of a sweep in a scenario file: what they become, and what they may not say."""

from pathlib import Path

import numpy as np
import pytest

from kankaku.railway.plan.scenario import Published, Sweep
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.mistakes import ScenarioError
from tests.unit.scenario_folder import replace, write_scenario
from tests.unit.sweep_folder import SWEEP, write_sweep


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_sweep(tmp_path / "sweep")


def test_a_range_becomes_its_delays(folder: Path) -> None:
    scenario = load(folder)
    assert scenario.sweep == Sweep("L1", "second", (0.0, 30.0, 60.0))
    values = {"shortest_interval_s": 51.1, "headway_margin_s": 40.0}
    assert scenario.published == Published("A table, 2020", values)


def test_tenths_of_a_second_stay_exact(folder: Path) -> None:
    replace(folder, "scenario.toml", "last_s = 60.0", "last_s = 0.7")
    replace(folder, "scenario.toml", "step_s = 30.0", "step_s = 0.1")
    sweep = load(folder).sweep
    assert sweep is not None
    assert sweep.delays_s == (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)


def test_a_sweep_of_one_delay_and_nothing_published_is_allowed(folder: Path) -> None:
    replace(folder, "scenario.toml", "last_s = 60.0", "last_s = 0")
    text = (folder / "scenario.toml").read_text("utf-8")
    start, end = text.index("[published]"), text.index("[controllers.close_up]")
    (folder / "scenario.toml").write_text(text[:start] + text[end:], "utf-8")
    scenario = load(folder)
    assert scenario.sweep == Sweep("L1", "second", (0.0,))
    assert scenario.published is None


def test_a_run_of_the_sweep_differs_by_its_delay_alone(folder: Path) -> None:
    scenario = load(folder)
    run = scenario.with_initial_delay(30.0)
    added = run.dwell_delays.draw(run.timetable, 7) - scenario.dwell_delays.draw(run.timetable, 7)
    assert np.array_equal(added, [[0.0, 30.0], [0.0, 0.0]])
    assert scenario.with_initial_delay(None) == scenario


def test_a_scenario_without_a_sweep_has_none(tmp_path: Path) -> None:
    scenario = load(write_scenario(tmp_path / "small"))
    assert (scenario.sweep, scenario.published) == (None, None)
    assert scenario.with_initial_delay(5.0) == scenario


CASES = {
    "train": ('train = "L1"', 'train = "L9"', "sweep.train", "L1, F2"),
    "station": ('station = "second"', 'station = "secnd"', "sweep.station", "'second'"),
    "no follower": ('train = "L1"', 'train = "F2"', "sweep.station", "another train follows"),
    "followers start there": (
        'station = "second"',
        'station = "first"',
        "sweep.station",
        "another train follows",
    ),
    "backwards": ("first_s = 0.0", "first_s = 90.0", "sweep.last_s", "from 90"),
    "no step": ("step_s = 30.0", "step_s = 0", "sweep.step_s", "above 0"),
    "step back": ("step_s = 30.0", "step_s = -1.0", "sweep.step_s", "above 0"),
    "uneven": ("step_s = 30.0", "step_s = 25.0", "sweep.step_s", "divides"),
    "too fine": ("step_s = 30.0", "step_s = 0.25", "sweep.step_s", "tenths"),
    "between tenths": ("first_s = 0.0", "first_s = 0.05", "sweep.first_s", "tenths"),
    "early": ("first_s = 0.0", "first_s = -1.0", "sweep.first_s", "from 0"),
    "late": ("last_s = 60.0", "last_s = 1000.0", "sweep.last_s", "below 1000"),
    "missing": ("last_s = 60.0", "", "sweep.last_s", "a number"),
    "unknown key": ("step_s = 30.0", "step_s = 30.0\nend_s = 1.0", "sweep.end_s", "last_s"),
    "unknown indicator": (
        "headway_margin_s = 40.0",
        "headway_s = 40.0",
        "published.headway_s",
        "headway_margin_s",
    ),
    "no source": ('source = "A table, 2020"', "", "published.source", "text"),
    "negative": (
        "headway_margin_s = 40.0",
        "headway_margin_s = -4.0",
        "published.headway_margin_s",
        "a number from 0 up to 7200",
    ),
}


@pytest.mark.parametrize(("old", "new", "where", "says"), CASES.values(), ids=CASES)
def test_what_a_sweep_may_not_say(folder: Path, old: str, new: str, where: str, says: str) -> None:
    replace(folder, "scenario.toml", old, new)
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    (mistake,) = caught.value.mistakes
    assert (mistake.file, mistake.where) == ("scenario.toml", where)
    assert says in mistake.allowed


def test_a_thousand_delays_are_the_most(folder: Path) -> None:
    replace(folder, "scenario.toml", "step_s = 30.0", "step_s = 0.1")
    replace(folder, "scenario.toml", "last_s = 60.0", "last_s = 99.9")
    sweep = load(folder).sweep
    assert sweep is not None
    assert len(sweep.delays_s) == 1000
    replace(folder, "scenario.toml", "last_s = 99.9", "last_s = 100.0")
    with pytest.raises(ScenarioError, match=r"sweep\.step_s: makes 1001 delays; .*1000"):
        load(folder)


def test_published_results_without_a_sweep_are_refused(folder: Path) -> None:
    sweep = SWEEP[: SWEEP.index("[published]")]
    replace(folder, "scenario.toml", sweep, "\n")
    with pytest.raises(ScenarioError, match=r"scenario\.toml: published: .*allowed: beside"):
        load(folder)
