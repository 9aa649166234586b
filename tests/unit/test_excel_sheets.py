"""Excel files in place of CSV files: the same scenario, and mistakes told by sheet, row, column."""

import csv
import io
import sys
import zipfile
from collections.abc import Callable, Sequence
from datetime import datetime, time, timedelta
from pathlib import Path
from typing import Any

import pytest

from kankaku.railway.plan.scenario import Scenario
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.excel_sheets import ENDING, read_sheet
from kankaku.scenarios.reading.mistakes import Mistake, ScenarioError
from kankaku.scenarios.reading.neighbours import SHEETS
from tests.unit.excel_books import workbook
from tests.unit.scenario_folder import FILES, write_scenario

pytest.importorskip("openpyxl")
TABLES = [name for name in FILES if name.endswith(".csv")]


def typed(text: str) -> object:
    """Return a cell as somebody types it into Excel."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            pass
    return time.fromisoformat(text) if text.count(":") == 2 else text or None


def in_excel(
    folder: Path, *names: str, change: Callable[[list[list[Any]]], None] | None = None
) -> None:
    """Put Excel files in place of CSV files."""
    for name in names:
        rows = [list(map(typed, row)) for row in csv.reader(io.StringIO(FILES[name]))]
        if change:
            change(rows)
        (folder / name).unlink()
        (folder / name).with_suffix(ENDING).write_bytes(workbook(rows))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_scenario(tmp_path / "small")


def faults_of(folder: Path) -> list[str]:
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    return [str(mistake) for mistake in caught.value.mistakes]


def same(one: Scenario, other: Scenario) -> bool:
    parts = ("line", "train_types", "timetable", "dwell_delays", "controllers")
    return all(getattr(one, part) == getattr(other, part) for part in parts)


def test_a_scenario_in_excel_is_the_scenario_in_csv(folder: Path) -> None:
    before = load(folder)
    in_excel(folder, *TABLES)
    after = load(folder)
    assert same(before, after)
    assert after.warnings == before.warnings
    assert after.digest != before.digest


def test_the_digest_covers_the_bytes_of_an_excel_file(folder: Path) -> None:
    in_excel(folder, "stations.csv")
    first = load(folder).digest
    assert load(folder).digest == first

    def renamed(rows: list[list[Any]]) -> None:
        rows[1][1] = "Terminus"

    write_scenario(folder)
    in_excel(folder, "stations.csv", change=renamed)
    assert load(folder).digest != first


def test_both_files_are_one_too_many(folder: Path) -> None:
    (folder / "limits.xlsx").write_bytes(workbook([["start_km"]]))
    (told,) = faults_of(folder)
    assert told == (
        "limits.csv: limits.xlsx is there, too, and nobody knows which one holds; "
        "allowed: one of the two"
    )


def test_a_mistake_names_file_sheet_row_and_column(folder: Path) -> None:
    def wrong(rows: list[list[Any]]) -> None:
        rows[2][2] = "fast"

    in_excel(folder, "limits.csv", change=wrong)
    (told,) = faults_of(folder)
    assert told == (
        "limits.xlsx, sheet Sheet: row 3, column limit_kmh: 'fast' is not allowed; "
        "allowed: a number from 3 up to 400"
    )


def test_a_mistake_that_a_check_finds_names_them_too(folder: Path) -> None:
    def wrong(rows: list[list[Any]]) -> None:
        rows[1][1] = "nowhere"

    in_excel(folder, "calls.csv", change=wrong)
    (told,) = faults_of(folder)
    assert told.startswith("calls.xlsx, sheet Sheet: row 2, column station: ")


def texts(rows: Sequence[Sequence[object]], *clocks: str) -> list[list[str]]:
    sheet = read_sheet(workbook(rows), "calls", clocks, "calls.csv")
    assert not sheet.troubles
    return [cells for _, piece in sheet.pieces() for cells in piece]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (time(7, 2, 30), "07:02:30"),
        (timedelta(hours=24, minutes=5), "24:05:00"),
        (datetime(1900, 1, 1, 0, 5), "24:05:00"),  # noqa: DTZ001 - as the library has it
        (7.0 / 24.0, "07:00:00"),
        (7.0 / 24.0 + 1e-12, "07:00:00"),
        (0.2934375, "07:02:33"),
        (1.0 + 1.0 / 24.0, "25:00:00"),
        ("7:02:30", "7:02:30"),
        (time(7, 2, 30, 500_000), "07:02:30.500"),
        (datetime(2026, 3, 1, 7, 2), "2026-03-01 07:02:00"),  # noqa: DTZ001 - the same
        (None, ""),
    ],
)
def test_times_of_excel_become_times_of_day(value: object, text: str) -> None:
    rows = texts([["arrival", "train"], [value, "A1"]], "arrival")
    assert rows == [["arrival", "train"], [text, "A1"]]


@pytest.mark.parametrize(
    ("value", "text"),
    [(747, "747"), (16.9, "16.9"), (0.1 + 0.2, "0.3"), (1e-7, "1e-07"), (True, "true"), ("x", "x")],
)
def test_other_cells_are_what_they_show(value: object, text: str) -> None:
    assert texts([["km"], [value]])[1] == [text]


def test_a_fraction_is_no_time_where_no_time_stands() -> None:
    assert texts([["km", "arrival"], [0.25, 0.25]], "arrival")[1] == ["0.25", "06:00:00"]


def test_empty_rows_and_columns_around_a_table_do_not_count() -> None:
    rows = texts([[None], ["id", "km", None], [None, None], ["a", 1, None], ["b", None, None, "x"]])
    assert rows == [["", ""], ["id", "km"], ["", ""], ["a", "1"], ["b", "", "", "x"]]


def test_the_sheet_of_the_files_name_is_taken_among_several(folder: Path) -> None:
    in_excel(folder, "stations.csv")
    rows = [list(map(typed, row)) for row in csv.reader(io.StringIO(FILES["stations.csv"]))]
    (folder / "stations.xlsx").write_bytes(workbook(rows, title="Stations", others=2))
    assert len(load(folder).line.stations) == 3
    (folder / "stations.xlsx").write_bytes(workbook(rows, title="Tabelle", others=1))
    (told, *_) = faults_of(folder)
    assert told == (
        "stations.xlsx: has the sheets 'Tabelle', 'Other 0'; "
        "allowed: one sheet, or one that is called 'stations'"
    )


def test_a_formula_without_a_value_is_told(folder: Path) -> None:
    def formula(rows: list[list[Any]]) -> None:
        rows[1][2] = "=45+45"

    in_excel(folder, "limits.csv", change=formula)
    (told,) = faults_of(folder)
    assert told.startswith("limits.xlsx, sheet Sheet: row 2, column limit_kmh: the formula has no")


def test_an_error_of_excel_is_told(folder: Path) -> None:
    def error(rows: list[list[Any]]) -> None:
        rows[2][1] = "#N/A"

    in_excel(folder, "stations.csv", change=error)
    (told,) = faults_of(folder)
    place = "stations.xlsx, sheet Sheet: row 3, column name: "
    assert told == f"{place}the cell holds the error #N/A; allowed: a value"


@pytest.mark.parametrize(
    "content", [b"", b"id,km\n", b"PK\x03\x04 broken", b"\xd0\xcf\x11\xe0" * 9]
)
def test_what_is_no_workbook_is_refused(folder: Path, content: bytes) -> None:
    (folder / "limits.csv").unlink()
    (folder / "limits.xlsx").write_bytes(content)
    (told,) = faults_of(folder)
    assert told.startswith("limits.xlsx: is no Excel workbook, or has a password; allowed: ")


def test_an_archive_that_is_no_workbook_is_refused(folder: Path) -> None:
    (folder / "limits.csv").unlink()
    with zipfile.ZipFile(folder / "limits.xlsx", "w") as archive:
        archive.writestr("[Content_Types].xml", "<Types>")
    (told,) = faults_of(folder)
    assert "is no Excel workbook" in told


def test_without_the_library_a_sentence_says_what_to_install(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_excel(folder, "limits.csv")
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    (told,) = faults_of(folder)
    assert told == (
        "limits.xlsx: Excel files are read by openpyxl, which is not installed; "
        "allowed: pip install 'kankaku[excel]', or limits.csv"
    )


def test_an_excel_file_of_a_wrong_name_is_told(folder: Path) -> None:
    (folder / "curves.csv").unlink()
    (folder / "curve.xlsx").write_bytes(workbook([["a"]]))
    (folder / "~$limits.xlsx").write_bytes(b"open")
    assert "'curve.xlsx' is not read; did you mean curves.xlsx?" in load(folder).warnings
    assert not any("~$" in told for told in load(folder).warnings)
    assert set(SHEETS.values()) >= set(TABLES)


def test_mistakes_in_the_same_column_of_a_sheet_are_one_mistake(folder: Path) -> None:
    def wrong(rows: list[list[Any]]) -> None:
        rows[1][2] = rows[2][2] = 700

    in_excel(folder, "limits.csv", change=wrong)
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    (mistake,) = caught.value.mistakes
    assert mistake == Mistake(
        "limits.xlsx, sheet Sheet",
        "row 2, column limit_kmh",
        "'700' is not allowed, and so in row 3",
        "a number from 3 up to 400",
    )
