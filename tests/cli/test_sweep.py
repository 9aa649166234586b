"""A sweep on the command line: a run per controller and delay, and one table of them all."""

import json
from pathlib import Path

import pandas as pd
import pytest

from kankaku.analysis.results import read_results
from kankaku.commands.screen import EXIT_BAD_INPUT
from tests.cli.command import PATIENCE_S, PROJECT, Screen, contents, is_note_of_time, kankaku, start
from tests.unit.sweep_folder import write_sweep

DELAYS_S = (0.0, 30.0, 60.0)
CONTROLLERS = ("close_up", "two_stage")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("sweep")
    write_sweep(place / "sweep")
    return place


@pytest.fixture(scope="module")
def screen(place: Path) -> Screen:
    return kankaku(place / "sweep", "--out", place / "out", "--jobs", "1")


@pytest.fixture(scope="module")
def results(place: Path, screen: Screen) -> Path:
    assert screen.status == 0, screen.complaints
    return place / "out" / "sweep"


def test_the_screen_shows_ours_beside_the_published_values(screen: Screen, results: Path) -> None:
    lines = screen.answers.splitlines()
    header = next(line for line in lines if "indicator" in line)
    assert header.index("close up") < header.index("two stage") < header.index("published")
    shortest = next(line for line in lines if "shortest interval [s]" in line)
    assert "51.1" in shortest
    assert lines[-2:] == ["Published: A table, 2020", f"Results: {results}"]
    assert "close_up (seed 7, initial delay 30.0 s): finished, 2 of 6, " in screen.complaints


def test_every_delay_has_a_folder_in_order(results: Path) -> None:
    for controller in CONTROLLERS:
        runs = sorted(item.name for item in (results / controller).iterdir())
        assert runs == ["delay_000.0s", "delay_030.0s", "delay_060.0s"]
    names = {item.name for item in results.iterdir() if item.is_file()}
    assert names >= {"intervals.csv", "sweep.csv", "intervals.png", "speed_distance.svg"}


def test_every_column_of_a_sweep_is_explained(results: Path) -> None:
    explained = pd.read_csv(results / "columns.csv", keep_default_na=False)
    for table in ("intervals", "sweep", "summary"):
        rows = explained[explained["table"] == table]
        assert rows["column"].tolist() == list(pd.read_csv(results / f"{table}.csv", nrows=0))
        assert rows["meaning"].str.len().all()


def test_a_delay_within_the_margin_shortens_the_interval_by_itself(results: Path) -> None:
    read = read_results(results)
    assert read.intervals is not None
    by_run = read.intervals.set_index(["controller", "initial_delay_s"])["interval_s"]
    assert list(by_run.index) == [(name, delay) for name in CONTROLLERS for delay in DELAYS_S]
    for name in CONTROLLERS:
        # 60 s bring the next train so close that it is held up.
        assert by_run[name, 0.0] - by_run[name, 30.0] == pytest.approx(30.0)
        assert by_run[name, 30.0] - by_run[name, 60.0] < 30.0
        calls = read.run(name, initial_delay_s=60.0).calls
        assert calls["dwell_delay_s"].tolist() == [0.0, 60.0, 0.0, 0.0]


def test_the_provenance_lists_the_delays(results: Path) -> None:
    told = json.loads((results / "provenance.json").read_text("utf-8"))
    assert told["sweep"] == {"train": "L1", "station": "second", "delays_s": list(DELAYS_S)}
    assert [item["initial_delay_s"] for item in told["runs"]] == [*DELAYS_S, *DELAYS_S]


def test_more_processes_give_the_same_bytes(place: Path, results: Path) -> None:
    process = start(PROJECT / "run.py", place / "sweep", "--out", place / "together", "--jobs", "2")
    _, complaints = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, complaints
    alone, together = contents(results), contents(place / "together" / "sweep")
    assert alone.keys() == together.keys()
    differing = {name for name in alone if alone[name] != together[name]}
    assert all(map(is_note_of_time, differing))


def test_several_seeds_of_a_sweep_are_refused(place: Path) -> None:
    screen = kankaku(place / "sweep", "--out", place / "never", "--seeds", "2")
    assert screen.status == EXIT_BAD_INPUT
    assert "--seeds: 2 seeds of a scenario with a sweep; allowed: 1" in screen.complaints
    assert not (place / "never").exists()


def test_a_wrong_key_of_a_sweep_is_named(tmp_path: Path) -> None:
    folder = write_sweep(tmp_path / "sweep")
    text = (folder / "scenario.toml").read_text("utf-8").replace("step_s = 30.0", "steps_s = 30.0")
    (folder / "scenario.toml").write_text(text, "utf-8")
    screen = kankaku(folder, "--out", tmp_path / "out")
    assert screen.status == EXIT_BAD_INPUT
    assert "scenario.toml: sweep.steps_s: unknown key" in screen.complaints
