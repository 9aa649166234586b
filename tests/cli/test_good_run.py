"""A good run: what is on the screen and what lies in the results folder."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from kankaku.analysis.page.html import PAGE, page_of
from kankaku.analysis.page.page_reading import read_source
from kankaku.analysis.results import read_results
from kankaku.scenarios.loading.load import load
from tests.cli.command import (
    PROJECT,
    Screen,
    contents,
    is_note_of_time,
    kankaku,
    peer,
    two_controllers,
)
from tests.unit.scenario_folder import write_scenario

TABLES = {
    "calls.csv",
    "energy.csv",
    "interstation_stops.csv",
    "obstructions.csv",
    "remaining_stops.csv",
    "run.json",
    "trajectory.parquet",
    "unfinished.csv",
    "violations.csv",
}
SUMMARY_COLUMNS = {
    "controller",
    "seed",
    "trains",
    "trains_completed",
    "interstation_stop_time_s",
    "interstation_stops",
    "interstation_crawl_time_s",
    "mean_arrival_delay_s",
    "final_arrival_delay_s",
    "secondary_delay_s",
    "energy_gross_kwh",
    "energy_net_kwh",
    "violations",
    "collisions",
}
TRAJECTORY_COLUMNS = {"time_s", "train", "front_m", "speed_mps", "track", "reason"}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("good")


@pytest.fixture(scope="module")
def screen(place: Path) -> Screen:
    folder = two_controllers(place / "small")
    return kankaku(folder, "--out", place / "out", "--jobs", "1")


@pytest.fixture(scope="module")
def results(place: Path, screen: Screen) -> Path:
    assert screen.status == 0, screen.complaints
    return place / "out" / "small"


def test_the_screen_compares_the_controllers_and_names_the_folder(
    screen: Screen, results: Path
) -> None:
    assert screen.status == 0
    header = next(line for line in screen.answers.splitlines() if "indicator" in line)
    assert header.index("plain") < header.index("second")
    assert "stop time between stations" in screen.answers
    assert "energy, net [kWh]" in screen.answers
    assert f"Results: {results}" in screen.answers


def test_a_log_file_gets_a_line_for_each_run_and_no_bar(screen: Screen) -> None:
    lines = [line.rpartition(",")[0] for line in screen.complaints.splitlines()]
    # A busy machine takes longer than the ten seconds after which a line tells of a run's share.
    assert [line for line in lines if not line.endswith(" %")] == [
        "plain (seed 7): finished, 1 of 2",
        "second (seed 7): finished, 2 of 2",
    ]
    assert ": finished" not in screen.answers


def test_the_folder_is_complete_and_holds_nothing_hidden(results: Path) -> None:
    names = {file.name for file in results.iterdir() if file.is_file()}
    assert names >= {"summary.csv", "columns.csv", "stations.csv", "provenance.json", "report.md"}
    assert {"time_distance.png", "time_distance.svg"} <= names
    assert {folder.name for folder in results.iterdir() if folder.is_dir()} == {"plain", "second"}
    for controller in ("plain", "second"):
        assert {file.name for file in (results / controller).iterdir()} == TABLES
    assert [folder.name for folder in results.parent.iterdir()] == ["small"]


def test_the_tables_have_the_promised_columns(results: Path) -> None:
    summary = pd.read_csv(results / "summary.csv")
    assert set(summary.columns) >= SUMMARY_COLUMNS
    assert summary["controller"].tolist() == ["plain", "second"]
    assert summary["seed"].tolist() == [7, 7]
    assert summary["trains_completed"].tolist() == [3, 3]
    assert not summary[["violations", "collisions"]].to_numpy().any()
    for controller in ("plain", "second"):
        trajectory = pd.read_parquet(results / controller / "trajectory.parquet")
        assert set(trajectory.columns) >= TRAJECTORY_COLUMNS
        assert set(trajectory["train"]) == {"A1", "B2", "C3"}


def test_every_column_is_explained_with_a_unit_that_its_name_ends_with(results: Path) -> None:
    explained = pd.read_csv(results / "columns.csv", keep_default_na=False)
    ends = {"_s": "s", "_m": "m", "_mps": "m/s", "_kmh": "km/h", "_kwh": "kWh"}
    for file in [results / "summary.csv", *(results / "plain").glob("*.csv")]:
        rows = explained[explained["table"] == file.stem].set_index("column")
        assert list(rows.index) == list(pd.read_csv(file, nrows=0).columns)
        assert rows["meaning"].str.len().all()
        for name, unit in rows["unit"].items():
            told = [ends[end] for end in ends if str(name).endswith(end)]
            assert told in ([], [unit]), (file.name, name, unit)


def test_the_provenance_says_how_to_repeat_the_run(results: Path, place: Path) -> None:
    told = json.loads((results / "provenance.json").read_text("utf-8"))
    assert told["scenario"] == "small"
    assert told["scenario_sha256"] == load(place / "small").digest
    assert (told["seeds"], told["step_s"], told["interrupted"]) == ([7], 0.5, False)
    assert list(told["controllers"]) == ["plain", "second"]
    assert told["controllers"]["plain"]["options"]["protection"]["margin_m"] == 10.0
    assert told["versions"].keys() >= {"kankaku", "python", "eclipse-sumo", "libsumo", "numpy"}
    assert all(told["versions"].values())
    assert told["wall_s"] > 0.0
    assert [run["controller"] for run in told["runs"]] == ["plain", "second"]
    assert all(run["wall_s"] > 0.0 for run in told["runs"])


def test_the_report_names_title_safety_and_figures_that_exist(results: Path) -> None:
    report = (results / "report.md").read_text("utf-8")
    assert report.startswith("# Small\n")
    assert "no safety invariant was violated" in report
    linked = [part.split(")")[0] for part in report.split("](")[1:]]
    assert linked
    assert all((results / name).is_file() for name in linked)


def test_the_page_is_made_again_from_the_saved_tables(results: Path) -> None:
    page = (results / PAGE).read_text("utf-8")
    assert page == page_of([read_source(results)])
    assert "<title>Small</title>" in page


def test_the_folder_reads_back_in_one_call(results: Path) -> None:
    read = read_results(results)
    assert read.controllers == ("plain", "second")
    assert read.provenance["scenario"] == "small"
    run = read.run("second")
    assert len(run.calls) == 8
    assert run.trajectory["time_s"].is_monotonic_increasing
    assert read.stations["station"].tolist() == ["first", "middle", "last"]


def test_one_chosen_controller_is_run_alone_and_the_order_is_the_users(
    place: Path, results: Path
) -> None:
    assert results.is_dir()
    alone = kankaku(place / "small", "--out", place / "alone", "--controller", "second")
    assert alone.status == 0
    assert "plain" not in alone.answers
    wanted = ["--controller", "second", "--controller", "plain", "--controller", "second"]
    both = kankaku(place / "small", "--out", place / "both", "--jobs", "1", *wanted)
    assert both.status == 0
    summary = pd.read_csv(place / "both" / "small" / "summary.csv")
    assert summary["controller"].tolist() == ["second", "plain"]


def test_running_some_controllers_keeps_the_results_of_the_others(place: Path) -> None:
    folder = two_controllers(place / "again")
    assert kankaku(folder, "--out", place / "out_2", "--controller", "second").status == 0
    added = kankaku(folder, "--out", place / "out_2", "--controller", "plain")
    assert added.status == 0
    read = read_results(place / "out_2" / "again")
    assert read.controllers == ("plain", "second")
    header = next(line for line in added.answers.splitlines() if "indicator" in line)
    assert header.index("plain") < header.index("second")
    assert list(read.provenance["controllers"]) == ["plain", "second"]
    assert all(run["finished"] for run in read.provenance["runs"])
    whole = kankaku(folder, "--out", place / "out_2_whole", "--jobs", "1")
    assert whole.status == 0
    once, by_parts = (contents(place / out / "again") for out in ("out_2_whole", "out_2"))
    assert once.keys() == by_parts.keys()
    assert all(is_note_of_time(name) for name in once if once[name] != by_parts[name])


@pytest.mark.figures
def test_same_input_same_bytes(place: Path, results: Path) -> None:
    again = kankaku(place / "small", "--out", place / "repeated", "--jobs", "1")
    assert again.status == 0
    first, second = contents(results), contents(place / "repeated" / "small")
    assert first.keys() == second.keys()
    differing = {name for name in first if first[name] != second[name]}
    assert all(map(is_note_of_time, differing))


def test_several_seeds_have_a_folder_each_and_a_confidence_interval(place: Path) -> None:
    folder = two_controllers(place / "seeds")
    screen = kankaku(folder, "--out", place / "out_3", "--seeds", "3", "--seed", "5", "--jobs", "1")
    assert screen.status == 0
    assert "±" in screen.answers
    results = place / "out_3" / "seeds"
    for controller in ("plain", "second"):
        runs = {item.name for item in (results / controller).iterdir()}
        assert runs == {"seed_5", "seed_6", "seed_7"}
    read = read_results(results)
    rows = list(zip(read.summary["controller"], read.summary["seed"], strict=True))
    assert rows == [(name, seed) for name in ("plain", "second") for seed in (5, 6, 7)]
    plain = read.summary[read.summary["controller"] == "plain"]
    assert len(set(plain["primary_delay_s"])) > 1
    assert "±" in (results / "report.md").read_text("utf-8")


@pytest.mark.parametrize("width", [60, 80])
def test_no_line_is_wider_than_the_terminal_but_paths(place: Path, width: int) -> None:
    folder = write_scenario(place / "narrow")
    screen = kankaku(folder, "--out", place / "out_4", width=width)
    assert screen.status == 0
    lines = [line for line in screen.answers.splitlines() if not line.startswith("Results:")]
    assert max(map(len, lines)) <= width


def test_the_controllers_are_listed_without_a_scenario() -> None:
    screen = kankaku("--list-controllers")
    assert screen.status == 0
    for name in ("moving_block", "close_up", "two_stage", "sumo_native_fixed"):
        assert name in screen.answers


def test_peers_run_beside_a_controller_on_the_same_trains_and_delays(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path / "small")
    peers = ("sumo_native_fixed", "sumo_native_moving")
    for name in peers:
        peer(folder, name)
    screen = kankaku(folder, "--out", tmp_path / "out", "--jobs", "1")
    assert screen.status == 0, screen.complaints
    read = read_results(tmp_path / "out" / "small")
    assert read.controllers == ("plain", *peers)
    assert read.summary["trains_completed"].tolist() == [3, 3, 3]
    assert not read.summary[["violations", "collisions"]].to_numpy().any()
    delays = [read.run(name).calls["dwell_delay_s"].tolist() for name in ("plain", *peers)]
    assert delays[0] == delays[1] == delays[2]
    assert set(read.run(peers[0]).trajectory["reason"]) == {"peer", "dwelling"}
    assert read.provenance["controllers"][peers[0]] == {"peer": peers[0]}
    report = (read.folder / "report.md").read_text("utf-8")
    assert "| driven by the peer | 0.0 % | 100.0 % | 100.0 % |" in report
    assert f"Under {', '.join(peers)} another program drives the trains" in report


def test_it_runs_from_another_folder_with_blanks_and_a_trailing_slash(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path / "morning peak")
    done = subprocess.run(  # noqa: S603
        [sys.executable, PROJECT / "run.py", f"{folder.name}/", "--out", "my results"],
        cwd=tmp_path,
        env={**os.environ, "COLUMNS": "100"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "Results: my results/morning peak" in done.stdout
    assert (tmp_path / "my results" / "morning peak" / "summary.csv").is_file()
