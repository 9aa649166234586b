"""The command ``dwells``: what it shows, writes, and refuses."""

import csv
from pathlib import Path

import numpy as np
import pytest

from kankaku.scenarios.loading.load import load
from tests.cli.command import contents, kankaku, refused
from tests.unit.observed_rows import event_text, exponential_s, scores, write_events
from tests.unit.scenario_folder import write_scenario


@pytest.fixture
def events(tmp_path: Path) -> Path:
    drawn = scores(60, 3, 0.4, 8)
    dwells_s = exponential_s(drawn, np.array([12.0, 15.0, 18.0]), np.array([10.0, 20.0, 15.0]))
    return write_events(tmp_path / "events.csv", event_text(dwells_s))


def test_without_a_folder_it_shows_and_writes_nothing(events: Path) -> None:
    before = contents(events.parent)
    shown = kankaku("dwells", events)
    assert shown.status == 0
    assert "Along a trip: correlation 0." in shown.answers
    assert "By headway: " in shown.answers
    assert contents(events.parent) == before


def test_it_writes_files_and_figures_into_a_folder(events: Path, tmp_path: Path) -> None:
    shown = kankaku("dwells", events, "--out", tmp_path / "own")
    assert shown.status == 0
    assert sorted(contents(tmp_path / "own")) == [
        "DWELL_SOURCES.md",
        "dwell_delays.toml",
        "dwell_quantiles.csv",
        "dwell_stations.csv",
        "observed_dwells/dwell_headway.png",
        "observed_dwells/dwell_headway.svg",
        "observed_dwells/station_dwells.png",
        "observed_dwells/station_dwells.svg",
        "observed_dwells/stations.csv",
    ]
    text = (tmp_path / "own/observed_dwells/stations.csv").read_text("utf-8")
    rows = [*csv.DictReader(text.splitlines())]
    assert {row["name"] for row in rows} == {"first", "middle", "last"}
    assert all(float(row["p10_s"]) <= float(row["p50_s"]) <= float(row["p90_s"]) for row in rows)


def test_a_second_time_it_replaces_nothing_without_force(events: Path, tmp_path: Path) -> None:
    folder = tmp_path / "own"
    kankaku("dwells", events, "--out", folder)
    before = contents(folder)
    assert "is there already; allowed: another folder, or --force" in refused(
        "dwells", events, "--out", folder, "--longest", "60"
    )
    assert contents(folder) == before
    assert kankaku("dwells", events, "--out", folder, "--longest", "60", "--force").status == 0
    assert contents(folder) != before


def test_it_writes_into_a_scenario_that_can_then_be_used(events: Path, tmp_path: Path) -> None:
    folder = write_scenario(tmp_path / "small")
    assert "--force" in refused("dwells", events, "--scenario", folder)
    assert kankaku("dwells", events, "--scenario", folder, "--force").status == 0
    scenario = load(folder)
    assert scenario.dwell_delays.trip_correlation > 0.0
    assert not scenario.warnings


def test_a_scenario_that_was_broken_before_is_told_to_be(events: Path, tmp_path: Path) -> None:
    folder = write_scenario(tmp_path / "small")
    (folder / "tracks.csv").unlink()
    told = refused("dwells", events, "--scenario", folder, "--force")
    assert "was written, and cannot be used" in told
    assert "tracks.csv: the file is missing" in told


@pytest.mark.parametrize("option", ["--out", "--scenario"])
def test_it_complains_of_events_with_mistakes(option: str, tmp_path: Path) -> None:
    text = "train,station,arrival,departure\nA,x,soon,later\n"
    file = write_events(tmp_path / "events.csv", text)
    folder = write_scenario(tmp_path / "small")
    before = contents(folder)
    told = refused("dwells", file, option, folder)
    assert "row 2, column arrival: 'soon' is no time" in told
    assert "row 2, column departure: 'later' is no time" in told
    assert contents(folder) == before


def test_two_places_to_write_to_are_one_too_many(events: Path, tmp_path: Path) -> None:
    told = refused("dwells", events, "--out", tmp_path, "--scenario", tmp_path)
    assert "both are named; allowed: one of the two" in told
