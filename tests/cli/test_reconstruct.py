"""The command that writes seconds into a public timetable, and what it refuses."""

from pathlib import Path

import pytest

from kankaku.railway.plan.driving_style import FASTEST
from kankaku.scenarios.loading.difference_programme import UNIT_S
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.loading.public_timetable import read_source
from kankaku.scenarios.loading.reconstruct import main, reconstruct, run_times
from kankaku.scenarios.reading.units import whole_seconds
from tests.unit.scenario_folder import replace, write_scenario

PUBLIC = """\
train,first,middle,last
A1,07:00,07:03,07:05
B2,,07:06,07:08
C3,07:08,07:11,
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = write_scenario(tmp_path / "small")
    (folder / "public_timetable.csv").write_text(PUBLIC, encoding="utf-8")
    return folder


def refused(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> str:
    assert main([str(part) for part in arguments]) == 2
    answers, complaints = capsys.readouterr()
    assert not answers
    assert "Traceback" not in complaints
    return complaints


def test_the_timetable_obeys_the_public_minutes_and_can_be_run(folder: Path) -> None:
    (folder / "calls.csv").unlink()
    assert main([str(folder)]) == 0
    services = load(folder).timetable.services
    minutes = [[int(call.departure_s) // 60 - 420 for call in one.calls] for one in services]
    assert minutes == [[0, 3, 5], [6, 8], [8, 11]]
    assert not [item.name for item in folder.iterdir() if item.name.startswith(".")]


def test_a_file_that_is_there_is_replaced_only_when_told(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = (folder / "calls.csv").read_bytes()
    told = refused(capsys, folder)
    assert "calls.csv: is there already; allowed: --force" in told
    assert (folder / "calls.csv").read_bytes() == before
    assert main([str(folder), "--force"]) == 0
    assert (folder / "calls.csv").read_bytes() != before


def test_help_is_told_and_nothing_is_written(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = {file: file.read_bytes() for file in folder.iterdir()}
    for arguments, status in ((["--help"], 0), ([], 2), ([str(folder), "--fast"], 2)):
        with pytest.raises(SystemExit) as ended:
            main(arguments)
        assert ended.value.code == status
    assert "--force" in capsys.readouterr().out
    assert {file: file.read_bytes() for file in folder.iterdir()} == before


@pytest.mark.parametrize(
    ("file", "old", "new", "told"),
    [
        ("public_timetable.csv", "07:06", "7h06", "row 3, column middle: '7h06'; allowed: HH:MM"),
        ("public_timetable.csv", "07:06", "31:06", "row 3, column middle: '31:06'"),
        ("public_timetable.csv", "B2,,07:06,07:08", "B2", "row 3: train 'B2' departs nowhere"),
        ("public_timetable.csv", "B2,", "A1,", "column train: train 'A1' occurs twice"),
        ("public_timetable.csv", "middle", "midle", "'midle' is no station with a platform"),
        ("public_timetable.csv", "middle", "first", "row 1: a column occurs twice"),
        ("public_timetable.csv", "train,first", "Zug,first", "column train: is missing"),
        ("public_timetable.csv", "first,middle,last", "last,middle,first", "out of order"),
        ("public_timetable.csv", PUBLIC, "", "column train: is missing"),
        ("public_timetable.csv", "07:03", "06:03", "no timetable obeys the public minutes"),
        ("services.csv", "C3,unit", "C3,units", "unknown train type 'units'"),
        ("services.csv", "C3,unit", "D4,unit", "train 'D4' is not in public_timetable.csv"),
        ("dwell_stations.csv", "last,20,30,1.0\n", "", "'last', where trains call, is missing"),
        ("tracks.csv", "middle,middle-2,1.2,1.6", "middle,middle-2,1.3,1.6", "tracks.csv: "),
        ("rolling_stock.toml", "mass_t = 440.0", "mass_t = heavy", "rolling_stock.toml: "),
    ],
)
def test_input_that_cannot_be_used_is_answered_with_file_row_and_reason(
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    file: str,
    old: str,
    new: str,
    told: str,
) -> None:
    before = (folder / "calls.csv").read_bytes()
    replace(folder, file, old, new)
    assert told in refused(capsys, folder, "--force")
    assert (folder / "calls.csv").read_bytes() == before


def test_files_that_cannot_be_read_are_named(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "public_timetable.csv").write_bytes(b"train,first\nA1,\xff\n")
    assert "public_timetable.csv: bytes that are not UTF-8" in refused(capsys, folder, "--force")
    (folder / "public_timetable.csv").unlink()
    assert "public_timetable.csv: cannot be read: No such" in refused(capsys, folder, "--force")
    told = refused(capsys, folder.parent / "nowhere")
    assert "stations.csv: the file is missing" in told


TIMED = """\
station,minimum_dwell_s,booked_dwell_s,delay_scale,from_time,until_time
first,20,30,0.5,,
middle,20,30,1.5,,
middle,40,45,1.5,07:06:00,
last,20,30,1.0,,
"""


def booked(text: str) -> dict[tuple[str, str], tuple[int, int]]:
    """Return arrival and departure by train and station. [s]"""
    rows = [line.split(",") for line in text.splitlines()[1:]]
    return {
        (train, station): (whole_seconds(arrival), whole_seconds(departure))
        for train, station, _, arrival, departure in rows
    }


def test_a_dwell_is_booked_by_the_time_of_day(folder: Path) -> None:
    (folder / "dwell_stations.csv").write_text(TIMED, encoding="utf-8")
    times = booked(reconstruct(read_source(folder)))
    stays_s = {key: departure - arrival for key, (arrival, departure) in times.items()}
    assert stays_s["A1", "middle"] == 30
    assert stays_s["B2", "middle"] == stays_s["C3", "middle"] == 45


STYLE = """
schema_version = 1
title = "Slow"
seed = 1
step_s = 0.1
patience_min = 10.0
driving = "slow"

[driving_styles.slow]
station_brake_kmhps = {brake_kmhps}
departure_reaction_s = 3.0

[controllers.close_up]
protection = "moving_block"
operation = "close_up"
"""


@pytest.mark.parametrize("brake_kmhps", [1.0, 2.0])
def test_booked_runs_are_those_of_the_driving_style(folder: Path, brake_kmhps: float) -> None:
    fastest_s = run_times(read_source(folder), FASTEST)["unit", "first", "middle"]
    text = STYLE.format(brake_kmhps=brake_kmhps)
    (folder / "scenario.toml").write_text(text, encoding="utf-8")
    source = read_source(folder)
    driven_s = run_times(source, source.driving)["unit", "first", "middle"]
    assert driven_s > fastest_s + 3.0
    times = booked(reconstruct(source))
    run_s = times["A1", "middle"][0] - times["A1", "first"][1]
    assert driven_s <= run_s < driven_s + UNIT_S


def test_a_time_without_a_dwell_is_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    only = TIMED.replace("middle,20,30,1.5,,\n", "")
    (folder / "dwell_stations.csv").write_text(only, encoding="utf-8")
    assert "no row of 'middle' holds for 'unit' at 07:03" in refused(capsys, folder, "--force")


def test_an_excel_file_in_its_place_is_not_put_aside(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "calls.csv").rename(folder / "calls.xlsx")
    told = refused(capsys, folder, "--force")
    assert "calls.xlsx: stands in place of calls.csv" in told
    assert not (folder / "calls.csv").exists()
