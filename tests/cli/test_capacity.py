"""The command ``capacity``: what is on the screen, in its folder, and what it refuses."""

import json
from itertools import pairwise
from pathlib import Path

import pandas as pd
import pytest

from kankaku.controllers import registry
from kankaku.controllers.protection.moving_block import MovingBlock, MovingBlockOptions
from kankaku.controllers.registry import Layer
from kankaku.railway.arrays import FloatArray
from tests.cli.command import FAILED, Screen, contents, kankaku, refused, two_controllers
from tests.unit.scenario_folder import replace

FILES = {
    *("capacity.csv", "headways.csv", "blocking_times.csv", "columns.csv", "stations.csv"),
    *("capacity.png", "capacity.svg", "stairway.png", "stairway.svg", "provenance.json"),
}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("capacity")


@pytest.fixture(scope="module")
def screen(place: Path) -> Screen:
    folder = two_controllers(place / "small")
    return kankaku("capacity", folder, "--out", place / "out", "--jobs", "1", "--simulate", "all")


@pytest.fixture(scope="module")
def results(place: Path, screen: Screen) -> Path:
    assert screen.status == 0, screen.complaints
    return place / "out" / "small_capacity"


def test_the_screen_shows_headways_by_station_and_the_capacity(
    screen: Screen, results: Path
) -> None:
    header = next(line for line in screen.answers.splitlines() if "dwell [s]" in line)
    assert header.index("plain") < header.index("second")
    for told in ("Middle", "Last", "trains per hour", "occupation [%]", "critical station"):
        assert told in screen.answers
    assert f"Results: {results}" in screen.answers
    assert "capacity: 6 of 6, " in screen.complaints


def test_the_folder_holds_tables_figures_and_an_explanation_of_every_column(results: Path) -> None:
    assert {file.name for file in results.iterdir()} == FILES
    explained = pd.read_csv(results / "columns.csv", keep_default_na=False)
    ends = {"_s": "s", "_m": "m", "_kmh": "km/h", "_percent": "%"}
    for name in ("capacity", "headways", "blocking_times", "stations"):
        rows = explained[explained["table"] == name].set_index("column")
        assert list(rows.index) == list(pd.read_csv(results / f"{name}.csv", nrows=0).columns)
        for column, unit in rows["unit"].items():
            told = [ends[end] for end in ends if str(column).endswith(end)]
            assert told in ([], [unit]), (name, column, unit)
    told = json.loads((results / "provenance.json").read_text("utf-8"))
    assert (told["scenario"], told["check"]) == ("small", "all")


def test_two_simulated_trains_agree_with_the_blocking_times(results: Path) -> None:
    headways = pd.read_csv(results / "headways.csv")
    plain = headways[headways["controller"] == "plain"]
    # A step is 0.5 s: a train is late that loses one, and sees its leader a step ago.
    off_s = plain["simulated_headway_s"] - plain["blocking_time_headway_s"]
    assert off_s.abs().max() <= 2.0
    # A follower that leaves room beforehand comes later than protection would let it.
    second = headways[headways["controller"] == "second"]
    least_s = second["blocking_time_headway_s"] - 2.0
    assert (second["simulated_headway_s"] >= least_s).all()
    assert headways["headway_s"].tolist() == headways["simulated_headway_s"].tolist()


@pytest.mark.figures
def test_the_same_input_gives_the_same_bytes_and_replaces_what_was_there(
    place: Path, results: Path
) -> None:
    before = contents(results)
    again = kankaku("capacity", place / "small", "--out", place / "out", "--jobs", "2")
    assert again.status == 0, again.complaints
    after = contents(results)
    assert {"headways.csv", "capacity.csv"} <= after.keys()
    for name in ("blocking_times.csv", "stations.csv", "stairway.svg"):
        assert before[name] == after[name]
    # By default only the line's own headway is simulated.
    headways = pd.read_csv(results / "headways.csv")
    critical = headways.sort_values("headway_s").groupby("controller").last()
    assert critical["simulated_headway_s"].tolist() == critical["headway_s"].tolist()


def test_one_chosen_controller_without_simulation(place: Path, screen: Screen) -> None:
    assert screen.status == 0
    out = place / "alone"
    chosen = ["--controller", "second", "--simulate", "none", "--step", "0.2"]
    alone = kankaku("capacity", place / "small", "--out", out, *chosen)
    assert alone.status == 0
    frame = pd.read_csv(out / "small_capacity" / "headways.csv")
    assert set(frame["controller"]) == {"second"}
    assert frame["simulated_headway_s"].isna().all()


def test_what_cannot_be_assessed_is_told_on_one_screen(tmp_path: Path) -> None:
    folder, out = two_controllers(tmp_path / "small"), tmp_path / "out"
    assert "no such folder" in refused("capacity", tmp_path / "nowhere", "--out", out)
    told = refused("capacity", folder, "--controller", "third", "--out", out)
    assert "--controller: 'third' is not a controller" in told
    assert "--simulate" in refused("capacity", folder, "--simulate", "some", "--out", out)
    replace(folder, "scenario.toml", "margin_m = 10.0", "margin_m = -10.0")
    assert "scenario.toml: controllers.plain" in refused("capacity", folder, "--out", out)
    assert not out.exists()


def test_a_folder_of_somebody_else_is_left_alone(tmp_path: Path) -> None:
    folder, theirs = two_controllers(tmp_path / "small"), tmp_path / "out" / "small_capacity"
    theirs.mkdir(parents=True)
    (theirs / "notes.txt").write_text("mine", encoding="utf-8")
    told = refused("capacity", folder, "--out", tmp_path / "out", "--simulate", "none")
    assert "holds no results of this program" in told
    assert contents(theirs) == {"notes.txt": b"mine"}


def test_a_peer_has_no_headways(tmp_path: Path) -> None:
    folder = two_controllers(tmp_path / "small")
    with (folder / "scenario.toml").open("a", encoding="utf-8") as file:
        file.write('\n[controllers.peer]\npeer = "sumo_native_moving"\n')
    told = refused("capacity", folder, "--controller", "peer", "--out", tmp_path / "out")
    assert "nothing but peers" in told


@pytest.mark.parametrize("word", ["run", "compare"])
def test_the_command_that_compares_may_be_named(place: Path, screen: Screen, word: str) -> None:
    assert screen.status == 0
    named = kankaku(word, place / "small", "--out", place / word, "--controller", "plain")
    assert named.status == 0, named.complaints
    assert (place / word / "small" / "summary.csv").is_file()


def test_each_command_tells_of_its_own_options() -> None:
    assert "--seeds" in kankaku("run", "--help").answers
    assert "--simulate" in kankaku("capacity", "--help").answers
    assert "--simulate" not in kankaku("run", "--help").answers


def test_the_pattern_is_that_of_the_busiest_hour_and_told_with_its_dwells(place: Path) -> None:
    folder = two_controllers(place / "stays")
    calls = folder / "calls.csv"
    # A1 and C3 run alike; A1 stays 15 s longer at the middle station. C3 comes as soon as ready.
    told = calls.read_text("utf-8").replace(
        "A1,middle,middle-1,07:02:30", "A1,middle,middle-1,07:02:15"
    )
    calls.write_text(told.replace("first,north-1,07:05:00", "first,north-1,07:05:30"), "utf-8")
    replace(folder, "dwell_stations.csv", "first,20,30,0.5", "first,0,30,0.5")
    options = ["--controller", "plain", "--simulate", "none"]
    screen = kankaku("capacity", folder, "--out", place / "out", *options)
    assert screen.status == 0, screen.complaints
    sentence = (
        "Pattern: train C3, for 2 of 3 trains of the busiest hour (07:05 to 08:05 at their last "
        "stations), with the median of their booked dwells, 60 s behind the first station"
    )
    assert sentence in screen.answers
    row = pd.read_csv(place / "out" / "stays_capacity" / "capacity.csv").iloc[0]
    assert (row["train"], row["pattern_trains"], row["busiest_trains"]) == ("C3", 2, 3)
    assert (row["pattern_dwell_s"], row["busiest_begin_s"]) == (60.0, 25_500.0)
    assert 0.0 < row["occupation_percent"] == row["busiest_occupation_percent"]
    headways = pd.read_csv(place / "out" / "stays_capacity" / "headways.csv")
    assert set(headways["train"]) == {"C3"}


def test_a_train_alone_on_its_line_has_a_headway_and_no_occupation(place: Path) -> None:
    folder = two_controllers(place / "alone")
    for name in ("calls.csv", "services.csv"):
        kept = [line for line in (folder / name).read_text("utf-8").splitlines() if "A1" in line]
        header = (folder / name).read_text("utf-8").splitlines()[0]
        (folder / name).write_text("\n".join([header, *kept, ""]), "utf-8")
    options = ["--controller", "plain", "--simulate", "none"]
    screen = kankaku("capacity", folder, "--out", place / "out", *options)
    assert screen.status == 0, screen.complaints
    row = pd.read_csv(place / "out" / "alone_capacity" / "capacity.csv").iloc[0]
    assert row["headway_s"] > 0.0
    assert (row["busiest_trains"], row["pattern_trains"]) == (1, 1)
    assert pd.isna(row["occupation_percent"])


class Blank(MovingBlock):
    """Cannot say beforehand what it will permit."""

    def eoa_behind_m(self, *_: object) -> FloatArray:
        msg = "cannot say"
        raise ValueError(msg)


def test_a_controller_that_cannot_be_assessed_costs_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    layer = Layer(Blank, MovingBlockOptions, "cannot say")
    monkeypatch.setitem(registry.PROTECTIONS, "blank", layer)
    folder = two_controllers(tmp_path / "small", protection="blank")
    command = ("capacity", folder, "--out", tmp_path / "out", "--jobs", "1", "--simulate", "none")
    screen = kankaku(*command)
    assert screen.status == FAILED
    assert "second: ValueError: cannot say" in screen.complaints
    assert "Traceback" not in screen.complaints
    results = tmp_path / "out" / "small_capacity"
    assert set(pd.read_csv(results / "headways.csv")["controller"]) == {"plain"}
    assert "eoa_behind_m" in (results / "failures" / "second.txt").read_text("utf-8")
    alone = kankaku(*command, "--controller", "second")
    assert alone.status == FAILED
    assert not alone.answers


ATC = """
[controllers.atc]
protection = "multi_step_atc"
operation = "close_up"

[controllers.atc.protection_options]
codes_kmh = [90, 36, 0]
idle_time_s = 1.0
counted_blocks = 3.0
"""


def test_codes_that_no_block_shows_are_told_and_headways_are_those_of_what_they_show(
    place: Path,
) -> None:
    folder = two_controllers(place / "codes")
    with (folder / "scenario.toml").open("a", encoding="utf-8") as file:
        file.write(ATC)
    replace(folder, "limits.csv", "1.0,2.0,75", "1.0,2.0,90")
    # From 90 to 36 km/h at 5 km/h/s takes 189 m, and 50 m are run before: not in 200 m.
    edges_km = {
        "north-1": (-3, 12),
        "middle-1": (12, 16),
        "middle-2": (12, 16),
        "south-1": (16, 35),
    }
    blocks = ["id,track,start_km,end_km"]
    for track, (first, last) in edges_km.items():
        places = [*range(first, last - 1, 2), last]
        blocks += [
            f"{track}-{number},{track},{start / 10},{end / 10}"
            for number, (start, end) in enumerate(pairwise(places))
        ]
    (folder / "blocks.csv").write_text("\n".join([*blocks, ""]), encoding="utf-8")
    options = ["--controller", "atc", "--simulate", "all", "--jobs", "1"]
    screen = kankaku("capacity", folder, "--out", place / "out", *options)
    assert screen.status == 0, screen.complaints
    assert "1 doubtful" in screen.complaints
    assert "never show more than 36 km/h: from 90 km/h a train needs" in screen.complaints
    headways = pd.read_csv(place / "out" / "codes_capacity" / "headways.csv")
    # A step is 0.5 s, and the brake is released a little below the code.
    off_s = headways["simulated_headway_s"] - headways["blocking_time_headway_s"]
    assert off_s.abs().max() <= 2.0
