"""Saved results are shown, explained, drawn, exported; broken ones are answered on one screen."""

import csv
import io
import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import sumolib

from kankaku.analysis.figures.style import PNG_DPI
from kankaku.sumo_net.build import sumo_binary
from tests.cli.command import PROJECT, SCREEN_LINES, Screen, kankaku, refused, two_controllers
from tests.unit.asked_folder import write_queue

NAME = "[red]<script>alert(1)</script>\x1b[2J"
"""A name that would colour, script or clear."""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("asked")


@pytest.fixture(scope="module")
def queue(place: Path) -> Path:
    return write_queue(place / "queue")


@pytest.fixture(scope="module")
def small(place: Path) -> Path:
    """Results of a scenario folder, with coordinates."""
    screen = kankaku(two_controllers(place / "small"), "--out", place / "out", "--jobs", "1")
    assert screen.status == 0, screen.complaints
    return place / "out" / "small"


def whole(screen: Screen) -> str:
    """Return what a command answered, without line ends."""
    assert screen.status == 0, screen.complaints
    return " ".join(screen.answers.split())


def test_a_run_shows_the_verdict_first_and_marks(small: Path) -> None:
    told = kankaku("show", small)
    lines = told.answers.splitlines()
    assert lines[0].startswith("second stands least between stations")
    assert "No safety rule was violated. Every train finished." in told.answers
    assert "▲ better, ▼ worse than plain, ★ best." in whole(told)
    stops = next(line for line in lines if "stop time between stations [s]" in line)
    assert stops.rstrip("│ ").endswith("▲★")


def test_other_programs_read_the_comparison(place: Path) -> None:
    again = (place / "small", "--out", place / "out", "--jobs", "1")
    told = json.loads(kankaku(*again, "--format", "json").answers)
    assert told["verdict"].startswith("second stands least")
    rows = told["comparison"]
    assert {row["controller"] for row in rows} == {"plain", "second"}
    shown = kankaku(*again, "--format", "csv").answers
    table = list(csv.DictReader(io.StringIO(shown)))
    assert len(table) == len(rows)
    for one, other in zip(rows, table, strict=True):
        assert one["mark"] == other["mark"]
        assert one["mean"] == pytest.approx(float(other["mean"]))
        if not other["change_pct"]:
            assert one["change_pct"] is None


@pytest.mark.parametrize("width", [40, 60, 80, 120, 200])
@pytest.mark.parametrize(
    "table", ["comparison", "by_station", "by_train", "calls", "remaining_stops"]
)
def test_no_table_is_wider_than_the_screen(queue: Path, table: str, width: int) -> None:
    screen = kankaku("show", queue, "--table", table, width=width)
    assert screen.status == 0, screen.complaints
    assert max(len(line.rstrip()) for line in screen.answers.splitlines()) <= width


def test_a_narrow_screen_has_a_row_for_each_controller(queue: Path) -> None:
    screen = kankaku("show", queue, width=80)
    for name in ("close_up", "two_stage", "eco"):
        assert any(line.startswith(f"│ {name} ") for line in screen.answers.splitlines())
    assert "more indicators" in whole(screen)
    wide = kankaku("show", queue, width=200)
    header = next(line for line in wide.answers.splitlines() if "indicator" in line)
    assert header.index("close_up") < header.index("two_stage") < header.index("eco")


def test_into_a_file_of_ascii_nothing_else_is_written(queue: Path) -> None:
    done = subprocess.run(  # noqa: S603 - our own arguments
        [sys.executable, "-m", "kankaku", "show", str(queue)],
        env={"PYTHONPATH": str(PROJECT), "PYTHONIOENCODING": "ascii", "PATH": ""},
        capture_output=True,
        check=False,
        timeout=300.0,
    )
    assert done.returncode == 0, done.stderr
    told = done.stdout.decode("ascii")
    assert "^ better, v worse" in " ".join(told.split())
    assert max(map(len, told.splitlines())) <= 80


def test_calls_show_clock_times_to_people_and_both_to_programs(queue: Path) -> None:
    asked = ("show", queue, "--table", "calls", "--controller", "eco", "--train", "t2")
    assert "07:01:00" in kankaku(*asked).answers
    rows = json.loads(kankaku(*asked, "--format", "json").answers)
    assert [row["booked_arrival_s"] for row in rows][:1] == [25_260.0]
    assert [row["booked_arrival_clock"] for row in rows][:1] == ["07:01:00"]
    assert {row["train"] for row in rows} == {"T2"}
    table = list(csv.DictReader(io.StringIO(kankaku(*asked, "--format", "csv").answers)))
    assert table[0]["booked_arrival_clock"] == "07:01:00"


def test_a_slow_train_is_explained_in_words_a_table_and_a_figure(queue: Path) -> None:
    stops = pd.read_csv(queue / "close_up" / "interstation_stops.csv")
    at = stops["start_clock"].iloc[0]
    train = stops["train"].iloc[0]
    told = kankaku("explain", queue, "--train", train, "--at", at, width=80)
    assert told.answers.startswith(f"Under close up, train {train} stood at")
    assert "it was bound by the end of its authority" in whole(told).lower()
    for name in ("close_up", "two_stage", "eco"):
        assert any(line.startswith(f"│ {name} ") for line in told.answers.splitlines())
    drawn = list((queue / "explained").iterdir())
    assert [file.suffix for file in drawn] == [".png"]
    rows = json.loads(
        kankaku("explain", queue, "--train", train, "--at", at, "--format", "json").answers
    )
    assert rows[0]["train"] == train
    assert rows[0]["text"].startswith("Under close up")


def test_figures_are_drawn_in_every_format(queue: Path, tmp_path: Path) -> None:
    files = [tmp_path / "deep" / f"figure.{ending}" for ending in ("png", "svg", "pdf")]
    outs = [part for file in files for part in ("--out", file)]
    choice = ("--from", "07:00", "--to", "07:10", "--train", "T1", "--train", "T2")
    told = kankaku("draw", queue, *choice, "--station", "West", "--title", "東急 鶯谷", *outs)
    assert told.status == 0, told.complaints
    assert not told.complaints
    png, svg, pdf = (file.read_bytes() for file in files)
    assert png.startswith(b"\x89PNG")
    assert b"<svg" in svg
    assert pdf.startswith(b"%PDF")
    kankaku("draw", queue, *choice, "--station", "West", "--title", "東急 鶯谷", *outs)
    assert [file.read_bytes() for file in files] == [png, svg, pdf]
    assert PNG_DPI >= 150


@pytest.mark.parametrize("figure", ["time_distance", "zoom", "pareto", "speed", "delays"])
def test_every_figure_can_be_drawn(queue: Path, tmp_path: Path, figure: str) -> None:
    file = tmp_path / "figure.svg"
    told = kankaku("draw", queue, "--figure", figure, "--out", file)
    assert told.status == 0, told.complaints
    assert file.stat().st_size > 5_000


def test_a_replay_lies_on_the_network_that_sumo_loads(small: Path, tmp_path: Path) -> None:
    scenario = small.parents[1] / "small"
    told = kankaku("export", small, "--to", "fcd", "--scenario", scenario, "--out", tmp_path)
    assert told.status == 0, told.complaints
    assert "changed since" not in told.complaints
    done = subprocess.run(  # noqa: S603 - our own arguments
        [sumo_binary("sumo"), "-c", tmp_path / "replay.sumocfg", "--no-step-log"],
        capture_output=True,
        text=True,
        check=False,
        timeout=300.0,
    )
    assert done.returncode == 0, done.stderr
    west_m, south_m, east_m, north_m = (
        sumolib.net.readNet(str(tmp_path / "line.net.xml")).getBBoxXY()[0]
        + sumolib.net.readNet(str(tmp_path / "line.net.xml")).getBBoxXY()[1]
    )
    places = [
        (float(vehicle.x), float(vehicle.y))
        for step in sumolib.xml.parse(str(tmp_path / "plain.fcd.xml"), "timestep")
        for vehicle in step.getChildList()
    ]
    x_m, y_m = np.array(places).T
    assert west_m - 20.0 < x_m.min()
    assert x_m.max() < east_m + 20.0
    assert south_m - 20.0 < y_m.min()
    assert y_m.max() < north_m + 20.0
    run = pd.read_parquet(small / "plain" / "trajectory.parquet")
    assert len(places) == len(run)


@pytest.mark.parametrize(
    ("to", "files"),
    [
        ("railsim", ["plain.railsimTimeDistance.csv", "second.railsimTimeDistance.csv"]),
        ("gtfs", ["plain.gtfs.zip", "second.gtfs.zip"]),
        ("parquet", ["calls.parquet", "trajectory.parquet"]),
    ],
)
def test_exports_name_their_files(small: Path, to: str, files: list[str]) -> None:
    scenario = small.parents[1] / "small"
    told = kankaku("export", small, "--to", to, "--scenario", scenario)
    assert told.status == 0, told.complaints
    assert set(files) <= {file.name for file in (small / "exported" / to).iterdir()}
    for file in files:
        assert file in told.answers


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("show", "nowhere"), "nowhere: there is no such folder; allowed: a results folder"),
        (("show", "QUEUE", "--table", "call"), "'calls' (did you mean that?)"),
        (("show", "QUEUE", "--controller", "closeup"), "'close_up' (did you mean that?)"),
        (("show", "QUEUE", "--seed", "99"), "seed: there is no '99'; allowed: 1"),
        (("explain", "QUEUE", "--train", "T9", "--at", "07:01"), "there is no 'T9'; allowed: T1"),
        (("explain", "QUEUE", "--train", "T1", "--at", "7h"), "'7h' is no time of day"),
        (("explain", "QUEUE", "--train", "T1", "--at", "03:00"), "was not on the line at 03:00:00"),
        (("draw", "QUEUE", "--figure", "zom"), "'zoom' (did you mean that?)"),
        (("draw", "QUEUE", "--out", "figure.gif"), ".gif is no kind of figure; allowed: .png"),
        (("draw", "QUEUE", "--from", "noon"), "--from: 'noon' is no time of day"),
        (("draw", "QUEUE", "--from", "08:00", "--to", "07:00"), "allowed: 10 s or more"),
        (("draw", "QUEUE", "--from", "20:00"), "no train ran then"),
        (("draw", "QUEUE", "--station", "north"), "station: there is no 'north'; allowed: west"),
        (("draw", "QUEUE", "--figure", "pareto", "--controller", "eco"), "two controllers or more"),
        (("export", "QUEUE", "--to", "gtf"), "'gtfs' (did you mean that?)"),
        (("export", "QUEUE", "--to", "fcd"), "queue"),
        (("export", "QUEUE", "--to", "gtfs", "--scenario", "rush_hour"), "has no station 'west'"),
        (
            ("export", "QUEUE", "--to", "gtfs", "--scenario", "rush_hour", "--timezone", "../x"),
            "--timezone: there is no '../x'",
        ),
        (
            ("export", "QUEUE", "--to", "gtfs", "--scenario", "rush_hour", "--day", "20261301"),
            "--day: '20261301' is no day",
        ),
    ],
)
def test_what_cannot_be_asked_is_answered_on_one_screen(
    queue: Path, arguments: tuple[str, ...], told: str
) -> None:
    asked = [queue if part == "QUEUE" else part for part in arguments]
    assert told in " ".join(refused(*asked).split())


def broken(queue: Path, place: Path, file: str, old: str, new: str) -> Path:
    """Return a copy of results in which a text of a file is another one."""
    folder = place / "broken"
    shutil.copytree(queue, folder)
    text = (folder / file).read_text("utf-8")
    assert old in text
    (folder / file).write_text(text.replace(old, new, 1), "utf-8")
    return folder


@pytest.mark.parametrize(
    ("file", "old", "new", "told"),
    [
        (
            "eco/calls.csv",
            "25200.000",
            "soon",
            "eco/calls.csv: row 2, column booked_arrival_s: 'soon'",
        ),
        ("eco/calls.csv", "25200.000", "", "eco/calls.csv: row 2, column booked_arrival_s"),
        ("eco/calls.csv", "25200.000", "inf", "inf is no number; allowed: a finite number"),
        ("eco/calls.csv", "train,", "tram,", "columns are tram"),
        ("eco/energy.csv", "True", "perhaps", "eco/energy.csv: row 2, column completed"),
        ("summary.csv", "close_up,1,", "close_up,one,", "summary.csv: row 2, column seed: 'one'"),
        ("summary.csv", "\nclose_up", "\n../../etc", "is a path, not a name"),
        ("stations.csv", "west", '"west', "stations.csv"),
        ("provenance.json", "{", "[", "provenance.json"),
    ],
)
def test_broken_results_are_answered_with_file_row_and_column(
    queue: Path, tmp_path: Path, file: str, old: str, new: str, told: str
) -> None:
    folder = broken(queue, tmp_path, file, old, new)
    for command in (("show",), ("explain", "--train", "T2", "--at", "07:03"), ("draw",)):
        complaint = refused(command[0], folder, *command[1:])
        assert told in " ".join(complaint.split()), command


def test_a_trajectory_that_is_none_is_answered(queue: Path, tmp_path: Path) -> None:
    folder = tmp_path / "cut"
    shutil.copytree(queue, folder)
    file = folder / "eco" / "trajectory.parquet"
    whole = file.read_bytes()
    samples = pd.read_parquet(file)
    for content, told in (
        (whole[: len(whole) // 2], "trajectory.parquet"),
        (b"", "trajectory.parquet"),
        (samples.drop(columns="cause"), "has no column cause"),
        (samples.assign(speed_mps="fast"), "column speed_mps: holds no numbers"),
        (samples.assign(front_m=np.nan), "row 1, column front_m: nan is no number"),
    ):
        if isinstance(content, bytes):
            file.write_bytes(content)
        else:
            content.to_parquet(file)
        complaint = refused("explain", folder, "--train", "T2", "--at", "07:03")
        assert told in " ".join(complaint.split())


def test_missing_runs_are_said_and_the_others_are_shown(queue: Path, tmp_path: Path) -> None:
    folder = tmp_path / "part"
    shutil.copytree(queue, folder)
    shutil.rmtree(folder / "two_stage")
    told = kankaku("explain", folder, "--train", "T2", "--at", "07:03")
    assert told.status == 0
    assert "two_stage, seed 1: its folder two_stage is missing" in told.complaints
    assert "close_up" in told.answers


def test_names_of_strangers_neither_colour_nor_script_nor_clear(
    queue: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "hostile"
    shutil.copytree(queue, folder)
    stations = pd.read_csv(folder / "stations.csv")
    stations["name"] = [NAME, "East"]
    stations.to_csv(folder / "stations.csv", index=False)
    for name in ("close_up", "two_stage", "eco"):
        for file in (folder / name).iterdir():
            if file.suffix == ".csv":
                table = pd.read_csv(file, dtype="str", keep_default_na=False)
                table.replace("T2", NAME).to_csv(file, index=False)
            elif file.suffix == ".parquet":
                samples = pd.read_parquet(file)
                samples["train"] = samples["train"].replace("T2", NAME)
                samples["cause"] = samples["cause"].replace("T2", NAME)
                samples.to_parquet(file)
    asked = (
        ("show", folder),
        ("show", folder, "--table", "by_train"),
        ("explain", folder, "--train", NAME, "--at", "07:03"),
        ("draw", folder, "--out", tmp_path / "figure.svg"),
        ("export", folder, "--to", "railsim", "--out", tmp_path),
    )
    for command in asked:
        told = kankaku(*command, width=100)
        assert told.status == 0, told.complaints
        assert "\x1b" not in told.answers + told.complaints
        assert len(told.complaints.splitlines()) <= SCREEN_LINES
    assert "<script" not in (tmp_path / "figure.svg").read_text("utf-8")
    assert "\x1b" not in (tmp_path / "figure.svg").read_text("utf-8")


def test_whom_another_program_drives_or_who_knows_the_future_is_no_best(
    queue: Path, tmp_path: Path
) -> None:
    best = kankaku("show", queue).answers.split()[0]
    folder = tmp_path / "aside"
    shutil.copytree(queue, folder)
    for layers in ({"peer": "sumo_native_fixed"}, {"operation": "clairvoyant"}):
        told = {"controllers": {best: layers}}
        (folder / "provenance.json").write_text(json.dumps(told), "utf-8")
        rows = json.loads(kankaku("show", folder, "--format", "json").answers)["comparison"]
        assert not any(row["best"] for row in rows if row["controller"] == best)
        assert any(row["best"] for row in rows if row["controller"] != best)
