"""Bad input: status 2, the file, the key and what is allowed, and nothing written."""

from pathlib import Path

import pytest

from kankaku.analysis.results import read_results
from tests.cli.command import BAD_INPUT, FAILED, SCREEN_LINES, Screen, kankaku, peer
from tests.unit.scenario_folder import FILES, replace, write_scenario


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_scenario(tmp_path / "small")


def refused(folder: Path, *arguments: str | Path) -> Screen:
    out = folder.parent / "out"
    screen = kankaku(folder, "--out", out, *arguments)
    assert screen.status == BAD_INPUT
    assert not screen.answers
    assert len(screen.complaints.splitlines()) <= SCREEN_LINES
    assert "Traceback" not in screen.complaints
    assert not out.exists()
    return screen


def test_a_wrong_value_is_named_with_file_key_and_range(folder: Path) -> None:
    replace(folder, "scenario.toml", "patience_min = 10.0", "patience_min = -1.0")
    told = refused(folder).complaints
    assert "scenario.toml: patience_min: -1.0 is not allowed" in told
    assert "allowed: a number from 0 up to 600" in told


def test_a_misspelt_key_is_answered_with_the_right_one(folder: Path) -> None:
    replace(folder, "scenario.toml", "cap_s", "caps_s")
    assert "did you mean" in refused(folder).complaints


def test_a_wrong_cell_is_named_with_row_and_column(folder: Path) -> None:
    replace(folder, "limits.csv", "1.0,2.0,75", "1.0,2.0,fast")
    told = refused(folder).complaints
    assert "limits.csv: row 3, column limit_kmh: 'fast' is not allowed" in told
    assert "allowed: a number from 3 up to 400" in told


def test_a_file_wrong_in_every_row_stays_on_one_screen(folder: Path) -> None:
    rows = "".join(f'"{0.1 * number:.1f}","x,5",90\n' for number in range(300))
    (folder / "limits.csv").write_text(f"start_km,end_km,limit_kmh\n{rows}", encoding="utf-8")
    told = refused(folder).complaints
    assert "limits.csv: row 2, column end_km: 'x,5' is not allowed" in told
    *_, last, pointer = told.splitlines()
    assert "more" in last
    assert pointer == "kankaku describe limits.csv tells every column"


def test_a_decimal_comma_is_refused_and_not_read_as_thousands(folder: Path) -> None:
    replace(folder, "limits.csv", "1.0,2.0,75", '1.0,2.0,"75,5"')
    assert "'75,5' is not allowed" in refused(folder).complaints


def test_semicolons_are_refused(folder: Path) -> None:
    text = FILES["limits.csv"].replace(",", ";")
    (folder / "limits.csv").write_text(text, encoding="utf-8")
    assert "limits.csv" in refused(folder).complaints


def test_text_that_is_not_utf8_is_refused_with_its_line(folder: Path) -> None:
    text = FILES["stations.csv"].replace("Middle", "M\N{LATIN SMALL LETTER U WITH DIAERESIS}")
    (folder / "stations.csv").write_bytes(text.encode("latin-1", errors="replace"))
    assert "stations.csv: line 3: bytes that are not UTF-8" in refused(folder).complaints


def test_windows_line_ends_a_byte_order_mark_and_empty_lines_are_read(folder: Path) -> None:
    for name, text in FILES.items():
        ended = text.replace("\n", "\r\n").encode("utf-8-sig")
        (folder / name).write_bytes(ended + (b"\r\n\r\n" if name.endswith(".csv") else b""))
    assert kankaku(folder, "--out", folder.parent / "out").status == 0


def test_an_unknown_operation_is_named_with_file_key_and_those_known(folder: Path) -> None:
    replace(folder, "scenario.toml", '"close_up"', '"closeup"')
    told = refused(folder).complaints
    assert "scenario.toml: controllers.plain.operation: 'closeup' is not known" in told
    assert "close_up, two_stage" in told


def test_an_unknown_option_of_a_controller_is_named_with_file_key_and_those_known(
    folder: Path,
) -> None:
    replace(folder, "scenario.toml", "margin_m", "margn_m")
    told = refused(folder).complaints
    assert "scenario.toml: controllers.plain.protection_options.margn_m: " in told
    assert "allowed: 'margin_m' (did you mean that?) among margin_m" in told


def test_a_controller_option_out_of_range_is_named_with_file_and_range(folder: Path) -> None:
    replace(folder, "scenario.toml", "margin_m = 10.0", "margin_m = -10.0")
    told = refused(folder).complaints
    assert "scenario.toml: controllers.plain.protection_options" in told
    assert "margin_m" in told
    assert "allowed: 0 " in told


def test_a_peer_beside_a_protection_is_named_with_file_key_and_what_is_allowed(
    folder: Path,
) -> None:
    replace(folder, "scenario.toml", 'operation = "close_up"', 'peer = "sumo_native_moving"')
    told = refused(folder).complaints
    assert "scenario.toml: controllers.plain.protection: stands beside peer" in told
    assert "allowed: both protection and operation, or peer alone" in told


def test_a_peer_that_needs_blocks_is_refused_on_a_line_without(folder: Path) -> None:
    (folder / "blocks.csv").unlink()
    peer(folder, "sumo_native_fixed")
    told = refused(folder).complaints
    assert "scenario.toml: controllers.sumo_native_fixed.peer: " in told
    assert "allowed: a line with blocks.csv, or sumo_native_moving" in told


def test_a_line_on_which_a_peer_leaves_a_stop_out_costs_that_run_alone(folder: Path) -> None:
    peer(folder, "sumo_native_fixed")
    # SUMO takes the slope from the drawn line, and the geometry of this one is far too long.
    (folder / "geometry.csv").unlink()
    replace(folder, "gradients.csv", "0.5,0.9,-10\n", "0.5,0.9,-10\n2.0,3.5,-30\n")
    replace(folder, "blocks.csv", "1.6,2.5\ns2,south-1,2.5", "1.6,3.02\ns2,south-1,3.02")
    screen = kankaku(folder, "--out", folder.parent / "out", "--jobs", "1")
    assert screen.status == FAILED
    assert "sumo_native_fixed (seed 7) at " in screen.complaints
    assert "SUMO ran A1 past a booked stop" in screen.complaints
    assert "Traceback" not in screen.complaints
    assert read_results(folder.parent / "out" / "small").controllers == ("plain",)


def test_a_controller_that_the_scenario_does_not_name_is_refused(folder: Path) -> None:
    told = refused(folder, "--controller", "close_up").complaints
    assert "--controller: 'close_up' is not a controller of this scenario; allowed: plain" in told


@pytest.mark.parametrize("missing", ["nowhere", "small/scenario.toml", "."])
def test_a_folder_without_a_scenario_is_named_in_one_sentence(folder: Path, missing: str) -> None:
    screen = refused(folder.parent / missing)
    assert len(screen.complaints.splitlines()) <= 2
    assert "scenario.toml" in screen.complaints


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--step", "0"),
        ("--step", "0.009"),
        ("--step", "0.6"),
        ("--step", "nan"),
        ("--step", "0.0333"),
        ("--step", "fast"),
        ("--seed", "-1"),
        ("--seed", "9223372036854775808"),
        ("--seeds", "0"),
        ("--jobs", "0"),
    ],
)
def test_an_option_out_of_range_is_refused(folder: Path, option: str, value: str) -> None:
    assert option in refused(folder, option, value).complaints


@pytest.mark.parametrize("text", ["", "# nothing yet\n"])
def test_an_empty_main_file_is_named(folder: Path, text: str) -> None:
    (folder / "scenario.toml").write_text(text, encoding="utf-8")
    assert "scenario.toml: " in refused(folder).complaints


def test_a_table_with_semicolons_is_named_in_one_sentence(folder: Path) -> None:
    table = folder / "limits.csv"
    table.write_text(table.read_text("utf-8").replace(",", ";"), encoding="utf-8")
    told = refused(folder).complaints
    assert "limits.csv: row 1: fields are separated by ';'" in told
    assert told.count("limits.csv:") == 1


def test_what_the_user_lays_beside_results_stays_there(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path / "small")
    assert kankaku(folder, "--out", tmp_path / "out").status == 0
    notes = tmp_path / "out" / "small" / "my_notes.md"
    notes.write_text("mine", encoding="utf-8")
    assert kankaku(folder, "--out", tmp_path / "out").status == 0
    assert notes.read_text("utf-8") == "mine"


def test_a_folder_that_holds_something_else_is_left_alone(folder: Path, tmp_path: Path) -> None:
    theirs = tmp_path / "out" / "small"
    theirs.mkdir(parents=True)
    (theirs / "thesis.txt").write_text("mine", encoding="utf-8")
    screen = kankaku(folder, "--out", tmp_path / "out")
    assert screen.status == BAD_INPUT
    assert str(theirs) in screen.complaints
    assert [item.name for item in (tmp_path / "out").iterdir()] == ["small"]
    assert [item.name for item in theirs.iterdir()] == ["thesis.txt"]


def test_results_are_not_written_into_a_file(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine", encoding="utf-8")
    screen = kankaku(folder, "--out", tmp_path / "notes.txt")
    assert screen.status == BAD_INPUT
    assert "notes.txt" in screen.complaints
    assert (tmp_path / "notes.txt").read_text("utf-8") == "mine"


def test_bad_input_leaves_earlier_results_as_they_were(folder: Path, tmp_path: Path) -> None:
    assert kankaku(folder, "--out", tmp_path / "out").status == 0
    before = (tmp_path / "out" / "small" / "summary.csv").stat().st_mtime_ns
    replace(folder, "limits.csv", "1.0,2.0,75", "1.0,2.0,0")
    assert kankaku(folder, "--out", tmp_path / "out").status == BAD_INPUT
    assert (tmp_path / "out" / "small" / "summary.csv").stat().st_mtime_ns == before
