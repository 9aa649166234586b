"""The commands ``radio`` and ``availability``: screen, folder, and what they refuse."""

import json
from pathlib import Path

import pandas as pd
import pytest

from kankaku.analysis.saved_run import read_saved_run
from tests.cli.command import Screen, contents, kankaku, refused
from tests.unit.radio_folder import write_radio_scenario
from tests.unit.scenario_folder import replace

KINDS = ("png", "svg")
RADIO_FILES = {
    *("radio_load.csv", "round_trips.csv", "cell_capacity.csv", "utilisation.parquet"),
    *("columns.csv", "provenance.json"),
    *(f"radio_load.{kind}" for kind in KINDS),
    *(f"round_trips.{kind}" for kind in KINDS),
    *(f"cell_capacity.{kind}" for kind in KINDS),
}
AVAILABILITY_FILES = {
    *("availability.csv", "outages.csv", "columns.csv", "provenance.json"),
    *("top_events.csv", "cut_sets.csv"),
    *(f"availability.{kind}" for kind in KINDS),
    *(f"fault_tree.{kind}" for kind in KINDS),
}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("radio")


@pytest.fixture(scope="module")
def run(place: Path) -> Path:
    """A saved run; returns its results folder."""
    folder = write_radio_scenario(place / "small")
    screen = kankaku(folder, "--out", place / "out")
    assert screen.status == 0, screen.complaints
    return place / "out" / "small"


@pytest.fixture(scope="module")
def radio(place: Path, run: Path) -> Screen:
    screen = kankaku(
        "radio", place / "small", "--results", run, "--out", place / "out", "--jobs", "1"
    )
    assert screen.status == 0, screen.complaints
    return screen


@pytest.fixture(scope="module")
def available(place: Path, run: Path) -> Screen:
    assert run.is_dir()
    screen = kankaku("availability", place / "small", "--out", place / "out", "--years", "500")
    assert screen.status == 0, screen.complaints
    return screen


def explained(folder: Path, tables: dict[str, list[str]]) -> None:
    columns = pd.read_csv(folder / "columns.csv", keep_default_na=False)
    assert list(dict.fromkeys(columns["table"])) == list(tables)
    for name, found in tables.items():
        assert columns[columns["table"] == name]["column"].tolist() == found
    assert (columns["meaning"] != "").all()


def header(file: Path) -> list[str]:
    return list(pd.read_csv(file, nrows=0).columns)


def test_the_screen_shows_the_load_and_answers_in_sentences(place: Path, radio: Screen) -> None:
    for told in (
        "central controller",
        "1 train ",
        "published",
        "plain",
        "antenna to train [%]",
        "Published: A table, 2020",
        "central controller, 30 trackside devices: one cell carries 4 trains before",
        "base units: one cell carries 4 trains before commands run late. With 5",
        f"Results: {place / 'out' / 'small_radio'}",
    ):
        assert told in radio.answers.replace("\n", " "), told
    assert "changed since" not in radio.answers
    assert "radio: 6 of 6, " in radio.complaints


def test_the_folder_of_the_radio_explains_every_column(place: Path, radio: Screen) -> None:
    assert radio.status == 0
    folder = place / "out" / "small_radio"
    assert {file.name for file in folder.iterdir()} == RADIO_FILES
    seconds = pd.read_parquet(folder / "utilisation.parquet")
    tables: dict[str, list[str]] = {
        "radio_load": header(folder / "radio_load.csv"),
        "utilisation": [*map(str, seconds)],
    }
    for name in ("round_trips", "cell_capacity"):
        tables[name] = header(folder / f"{name}.csv")
    explained(folder, tables)
    shares = pd.read_csv(folder / "round_trips.csv").groupby(["system", "case"])["share_percent"]
    assert shares.sum().to_numpy() == pytest.approx(100.0, abs=1e-3)
    assert seconds["utilisation_percent"].between(0.0, 100.0).all()
    told = json.loads((folder / "provenance.json").read_text("utf-8"))
    assert (told["run"]["controller"], told["scenario"]) == ("plain", "small")


def test_the_load_follows_the_trains_through_the_cells(
    place: Path, run: Path, radio: Screen
) -> None:
    assert radio.status == 0
    seconds = pd.read_parquet(place / "out" / "small_radio" / "utilisation.parquet")
    own = seconds[(seconds["system"] == "base_units") & (seconds["link"] == "antenna_train")]
    fronts_m = read_saved_run(run).fronts_m(own["time_s"].unique())
    # Each second a train is sent 72 bytes at 2400 bit/s by every unit within 150 m of whose cell
    # it is; the border lies at 1600 m.
    for cell, served in enumerate((fronts_m < 1750.0, fronts_m >= 1450.0)):
        busy = own[own["cell"] == cell]["utilisation_percent"].to_numpy()
        expected = 24.0 * served.sum(axis=1)
        assert expected.max() > 0.0
        assert busy.mean() == pytest.approx(expected.mean(), abs=0.1)
        if cell == 0:
            # The slots of the other unit begin half a second later.
            assert busy == pytest.approx(expected, abs=1e-5)


@pytest.mark.figures
def test_the_same_input_gives_the_same_bytes(
    place: Path, run: Path, radio: Screen, available: Screen
) -> None:
    assert radio.status == available.status == 0
    out = place / "out"
    before = contents(out / "small_radio"), contents(out / "small_availability")
    small = place / "small"
    again = kankaku("radio", small, "--results", run, "--out", out, "--jobs", "2")
    assert again.status == 0, again.complaints
    assert kankaku("availability", small, "--out", out, "--years", "500").status == 0
    after = contents(out / "small_radio"), contents(out / "small_availability")
    for old, new in zip(before, after, strict=True):
        assert old.keys() == new.keys()
        assert [name for name in old if old[name] != new[name]] in ([], ["provenance.json"])


def test_the_screen_shows_availability_and_cut_sets(place: Path, available: Screen) -> None:
    told = available.answers
    for text in ("6.13 (6.13)", "500 years", "In brackets: A table, 2020", "Collision", " 11 "):
        assert text in told, text
    assert "map is wrong + check misses it" in told
    assert f"Results: {place / 'out' / 'small_availability'}" in told


def test_the_folder_of_availability_explains_every_column(place: Path, available: Screen) -> None:
    assert available.status == 0
    folder = place / "out" / "small_availability"
    assert {file.name for file in folder.iterdir()} == AVAILABILITY_FILES
    names = ("availability", "outages", "top_events", "cut_sets")
    explained(folder, {name: header(folder / f"{name}.csv") for name in names})
    sets = pd.read_csv(folder / "cut_sets.csv")
    assert sets["events"].tolist() == ["wrong + missed", "wrong + blind"]
    assert sets["rate_per_1e9_h"].tolist() == pytest.approx([10.0, 1.0])
    outages = pd.read_csv(folder / "outages.csv").set_index("indicator")
    assert outages.loc["failures_per_year", "closed_form"] == pytest.approx(8760 * 7e-4)


def test_without_a_fault_tree_there_is_none_and_an_old_one_goes(
    place: Path, available: Screen
) -> None:
    assert available.status == 0
    folder, out = write_radio_scenario(place / "bare" / "small"), place / "bare" / "out"
    assert kankaku("availability", folder, "--out", out, "--years", "10").status == 0
    (folder / "fault_tree.toml").unlink()
    screen = kankaku("availability", folder, "--out", out, "--years", "10")
    assert screen.status == 0, screen.complaints
    assert "Collision" not in screen.answers
    left = {file.name for file in (out / "small_availability").iterdir()}
    assert left == AVAILABILITY_FILES - {
        *("top_events.csv", "cut_sets.csv", "fault_tree.png", "fault_tree.svg")
    }


def test_radio_without_a_saved_run_says_what_to_do(tmp_path: Path) -> None:
    folder, out = write_radio_scenario(tmp_path / "small"), tmp_path / "out"
    told = refused("radio", folder, "--results", tmp_path / "none", "--out", out)
    assert f"{tmp_path / 'none'}: no such results folder; run a scenario first" in told
    assert not out.exists()


def test_results_that_cannot_be_used_are_refused(place: Path, run: Path, tmp_path: Path) -> None:
    command: list[str | Path] = ["radio", place / "small", "--out", tmp_path / "out", "--results"]
    told = refused(*command, run, "--controller", "third")
    assert "no run of 'third'; allowed: plain" in told
    copy = tmp_path / "copy"
    for name, content in contents(run).items():
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        (copy / name).write_bytes(content)
    file = copy / "provenance.json"
    file.write_text(file.read_text("utf-8").replace('"small"', '"other"'), "utf-8")
    assert "of the scenario other; allowed: a run of small" in refused(*command, copy)
    trajectory = copy / "plain" / "trajectory.parquet"
    trajectory.write_bytes(b"PAR1 and nonsense PAR1")
    assert "trajectory.parquet: cannot be read" in refused(*command, copy)
    pd.DataFrame({"time_s": [1.0]}).to_parquet(trajectory)
    assert "trajectory.parquet: cannot be read" in refused(*command, copy)
    empty: dict[str, list[float]] = {"time_s": [], "train": [], "front_m": []}
    pd.DataFrame(empty).to_parquet(trajectory)
    assert "no train ran" in refused(*command, copy)
    trajectory.unlink()
    assert "trajectory.parquet: the file is missing" in refused(*command, copy)
    (copy / "summary.csv").write_text("nonsense\n", encoding="utf-8")
    assert "summary.csv: columns are nonsense" in refused(*command, copy)
    (copy / "summary.csv").unlink()
    assert "not a results folder" in refused(*command, copy)
    assert not (tmp_path / "out").exists()


def test_wrong_files_are_told_with_place_and_what_is_allowed(tmp_path: Path) -> None:
    folder, out = write_radio_scenario(tmp_path / "small"), tmp_path / "out"
    replace(folder, "radio_network.toml", "cells = 2", "cell = 2")
    told = refused("radio", folder, "--results", out, "--out", out)
    assert "radio_network.toml: cell: unknown key 'cell'" in told
    replace(folder, "fault_tree.toml", '["missed", "blind"]', '["missed", "collision", "blind"]')
    told = refused("availability", folder, "--out", out)
    assert "gates.collision: follows from itself: collision <- unnoticed <- collision" in told
    (folder / "availability.toml").unlink()
    assert "availability.toml: the file is missing" in refused("availability", folder)
    assert "--years" in refused("availability", folder, "--years", "1", "--out", out)
    assert not out.exists()


def test_a_folder_of_somebody_else_is_left_alone(tmp_path: Path) -> None:
    folder = write_radio_scenario(tmp_path / "small")
    for command in ("radio", "availability"):
        theirs = tmp_path / "out" / f"small_{command}"
        theirs.mkdir(parents=True)
        (theirs / "notes.txt").write_text("mine", encoding="utf-8")
        told = refused(command, folder, "--out", tmp_path / "out")
        assert "holds no results of this program" in told
        assert contents(theirs) == {"notes.txt": b"mine"}


def test_a_file_where_a_folder_should_be_is_told_before_anything_is_simulated(
    tmp_path: Path,
) -> None:
    folder = write_radio_scenario(tmp_path / "small")
    (tmp_path / "out").write_text("mine", encoding="utf-8")
    for command in ("radio", "availability"):
        told = refused(command, folder, "--out", tmp_path / "out")
        assert "is no folder; choose another one" in told


def test_failures_that_leave_no_time_to_run_are_refused(tmp_path: Path) -> None:
    folder = write_radio_scenario(tmp_path / "small")
    replace(folder, "availability.toml", "1e-4\nrepair_h = 2.0", "0.1\nrepair_h = 24.0")
    told = refused("availability", folder, "--out", tmp_path / "out")
    assert "is stopped for longer than a year has hours" in told


def test_a_changed_scenario_is_told(place: Path, run: Path, tmp_path: Path) -> None:
    folder = write_radio_scenario(tmp_path / "small")
    replace(folder, "scenario.toml", "seed = 7", "seed = 8")
    assert place.is_dir()
    out = tmp_path / "out"
    screen = kankaku("radio", folder, "--results", run, "--out", out, "--jobs", "1")
    assert screen.status == 0
    assert "of a scenario that has been changed since" in screen.answers


def test_help_names_the_commands() -> None:
    assert "radio" in kankaku("--help").answers
    assert "--results" in kankaku("radio", "--help").answers
    assert "--years" in kankaku("availability", "--help").answers
