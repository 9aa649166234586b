"""What a cell may say, and the true reason where it may not."""

from pathlib import Path

import pytest

from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.cell_texts import clock, number, printable, shown
from kankaku.scenarios.reading.mistakes import Mistake, ScenarioError
from tests.unit.scenario_folder import FILES, replace, write_scenario


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_scenario(tmp_path / "small")


def only_fault(folder: Path) -> Mistake:
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    (mistake,) = caught.value.mistakes
    return mistake


@pytest.mark.parametrize(
    ("cell", "limit_kmh"),
    [
        ("7.5e1", 75),
        ("75E0", 75),
        ("+75", 75),
        ("75.", 75),
        ("075", 75),
        (" 75 ", 75),
        ("7500e-2", 75),
    ],
)
def test_every_way_to_write_a_number_is_read(folder: Path, cell: str, limit_kmh: float) -> None:
    replace(folder, "limits.csv", "1.0,2.0,75", f"1.0,2.0,{cell}")
    assert load(folder).line.limits[1].limit_mps == limit_kmh / 3.6


@pytest.mark.parametrize(
    ("cell", "told"),
    [
        ('"0,5"', "has a decimal comma; write 0.5"),
        ('"1,234.5"', "has commas between thousands; write 1234.5"),
        ('"1,234,567"', "has commas between thousands; write 1234567"),
        ('"1,234"', "has a comma; write 1234 or 1.234, whichever is meant"),
        ("1 234", "has separators between digits; write 1234"),
        ("1_000", "has separators between digits; write 1000"),
        ("1'000", "has separators between digits; write 1000"),
        ("\uff17\uff15", "has characters other than 0-9, '-' and '.'; write 75"),
        ("\N{MINUS SIGN}5", "has characters other than 0-9, '-' and '.'; write -5"),
        ("75 km/h", "has a unit; write 75"),
        ("75km/h", "has a unit; write 75"),
        ("50%", "has a unit; write 50"),
        ("'75'", "has quotation marks; write 75"),
        ("True", "is true or false"),
        ("-inf", "is no finite number"),
        ("NaN", "is no finite number"),
    ],
)
def test_what_is_no_number_is_refused_for_its_own_reason(
    folder: Path, cell: str, told: str
) -> None:
    replace(folder, "limits.csv", "1.0,2.0,75", f"1.0,2.0,{cell}")
    mistake = only_fault(folder)
    assert mistake.where == "row 3, column limit_kmh"
    assert mistake.problem == f"{cell.strip(chr(34))!r} is not allowed: it {told}"


@pytest.mark.parametrize("cell", ["0x10", "1e5", "-", "#REF!", "1.2.3", "--5", "1e", "e5"])
def test_what_is_out_of_range_or_no_number_at_all_is_refused(folder: Path, cell: str) -> None:
    replace(folder, "limits.csv", "1.0,2.0,75", f"1.0,2.0,{cell}")
    mistake = only_fault(folder)
    assert mistake.problem.startswith(f"{cell!r} is not allowed")
    assert mistake.allowed == "a number from 3 up to 400"


@pytest.mark.parametrize(
    ("cell", "told"),
    [
        ("7:00", "has no seconds; write 7:00:00"),
        ("07:60:00", "has minutes or seconds above 59"),
        ("100:00:00", "has an hour above 99"),
        ("07:00:00.5", "has a fraction of a second; write 07:00:00"),
        ("7:00 pm", "has am or pm; write hours from 0 on"),
        ("2024-05-01 07:00:00", "has a date"),
        ("0.29166", "is a number, as spreadsheets keep times; format the column as HH:MM:SS"),
        ("\uff10\uff17:00:00", "has characters other than 0-9 and ':'; write 07:00:00"),
    ],
)
def test_what_is_no_time_is_refused_for_its_own_reason(folder: Path, cell: str, told: str) -> None:
    replace(folder, "calls.csv", "A1,first,north-1,07:00:00", f"A1,first,north-1,{cell}")
    mistake = only_fault(folder)
    assert mistake.problem == f"{cell!r} is not allowed: it {told}"
    assert "HH:MM:SS" in mistake.allowed
    assert "99" in mistake.allowed


def test_times_of_one_digit_and_of_the_days_after_are_read(folder: Path) -> None:
    text = FILES["calls.csv"]
    early = text.replace(",07:", ",7:").replace(",08:", ",8:")
    (folder / "calls.csv").write_text(early, encoding="utf-8")
    booked_s = load(folder).timetable.services[0].calls[0].arrival_s
    assert booked_s == 25_200.0
    late = text.replace(",07:", ",31:").replace(",08:", ",32:")
    (folder / "calls.csv").write_text(late, encoding="utf-8")
    assert load(folder).timetable.services[0].calls[0].arrival_s == booked_s + 86_400.0


def test_times_are_compared_as_times_whatever_their_digits(folder: Path) -> None:
    text = FILES["calls.csv"].replace(",07:", ",9:").replace(",9:10:", ",10:10:")
    (folder / "calls.csv").write_text(text, encoding="utf-8")
    assert load(folder).timetable.services[2].calls[2].arrival_s == 36_600.0


def test_midnight_is_one_fault_that_says_what_to_write(folder: Path) -> None:
    text = FILES["calls.csv"]
    rows = text.splitlines()
    rows[7] = "C3,first,north-1,23:59:00,23:59:30"
    rows[8] = "C3,middle,middle-1,00:01:30,00:02:00"
    rows.append("C3,last,south-1,00:04:00,00:04:30")
    rows[6:] = ["C3,first,north-1,23:59:00,23:59:30", *rows[8:9], rows[-1]]
    (folder / "calls.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    mistake = only_fault(folder)
    assert mistake.where == "row 8, column arrival"
    assert mistake.allowed == "from 23:59:30; after midnight write 24:01:30"


def test_an_identifier_in_other_letters_is_told_which_letters_may_be_used(folder: Path) -> None:
    replace(folder, "services.csv", "C3,unit", "\u666e\u901a3,unit")
    text = FILES["calls.csv"].replace("C3,", "\u666e\u901a3,")
    (folder / "calls.csv").write_text(text, encoding="utf-8")
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    for mistake in caught.value.mistakes:
        assert "it has \u666e, \u901a" in mistake.problem
        assert "a-z and A-Z, digits, '-', '_' and '.'" in mistake.allowed
    assert len(caught.value.mistakes) == 2


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("Mid\x1b[31mdle", "has the control character U+001B"),
        ("Mid\x9bdle", "has the control character U+009B"),
        ("Mid\x7fdle", "has the control character U+007F"),
        ("Mid\u202edle", "has U+202E, which turns the direction of writing"),
        ("Mid\u2067dle", "has U+2067, which turns the direction of writing"),
        ('"Mid\ndle"', "has a line break; is a quotation mark missing?"),
        ("M" * 201, "has 201 characters"),
    ],
)
def test_names_that_would_move_a_cursor_are_refused(folder: Path, name: str, told: str) -> None:
    replace(folder, "stations.csv", "Middle", name)
    mistake = only_fault(folder)
    assert mistake.where == "row 3, column name"
    assert mistake.problem.endswith(f"it {told}")
    assert str(mistake).isprintable()


@pytest.mark.parametrize(
    "name", ["$\\frac{", "=1+1", "@Home", "a|b`c", "Orl\u00e9ans", "\u05d7\u05d9\u05e4"]
)
def test_names_of_any_script_and_with_any_sign_are_read(folder: Path, name: str) -> None:
    replace(folder, "stations.csv", "Middle", name)
    assert load(folder).line.stations[1].name == name


@pytest.mark.parametrize(
    ("header", "where", "meant"),
    [
        ("START_KM,end_km,limit_kmh", "row 1, column START_KM", "'start_km'"),
        ("start km,end_km,limit_kmh", "row 1, column start km", "'start_km'"),
        ("start_km,end_km,limit_kmh,", "row 1", "start_km"),
        ("start_km;end_km;limit_kmh", "row 1", "commas"),
        ("start_km\tend_km\tlimit_kmh", "row 1", "commas"),
    ],
)
def test_a_strange_header_is_answered_with_the_right_one(
    folder: Path, header: str, where: str, meant: str
) -> None:
    replace(folder, "limits.csv", "start_km,end_km,limit_kmh", header)
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    mistake = caught.value.mistakes[0]
    assert mistake.where.startswith(where)
    assert meant in mistake.allowed


def test_columns_may_stand_in_any_order(folder: Path) -> None:
    text = "limit_kmh,start_km,end_km\n90,-0.3,1.0\n"
    (folder / "limits.csv").write_text(text, encoding="utf-8")
    assert load(folder).line.limits[0].end_m == 1000.0


def test_a_number_in_quotation_marks_is_told_so(folder: Path) -> None:
    replace(folder, "scenario.toml", "step_s = 0.5", 'step_s = "0.5"')
    assert only_fault(folder).problem.endswith("it is a number in quotation marks; write 0.5")


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("..", "is a path"),
        (".", "is a path"),
        (".hidden", "begins or ends with a point"),
        ("summary.csv", "is the name of a file"),
        ("Report.MD", "is the name of a file"),
        ("failures", "is the name of a file or folder"),
        ("NUL", "is the name of a device"),
    ],
)
def test_a_controller_does_not_bear_the_name_of_another_place(
    folder: Path, name: str, told: str
) -> None:
    text = FILES["scenario.toml"].replace("[controllers.plain", f'[controllers."{name}"')
    (folder / "scenario.toml").write_text(text, encoding="utf-8")
    mistake = only_fault(folder)
    assert mistake.where == f"controllers.{name}"
    assert told in mistake.problem


@pytest.mark.parametrize("name", ["a/b", "a\\\\b", "/etc", "a b", "\\u001b[2J", "a" * 61, ""])
def test_a_controller_with_signs_of_a_path_is_refused(folder: Path, name: str) -> None:
    text = FILES["scenario.toml"].replace("[controllers.plain", f'[controllers."{name}"')
    (folder / "scenario.toml").write_text(text, encoding="utf-8")
    mistake = only_fault(folder)
    assert "name" in mistake.problem or "empty" in mistake.problem
    assert str(mistake).isprintable()


def test_wrong_values_are_quoted_shortly() -> None:
    assert shown("a" * 1000) == f"{'a' * 60!r}..."
    assert shown(10**5000) == "a number of more than 60 digits"
    assert shown([[1], 2]) == "a list of 2"
    assert printable("a\x1b[31m\u202e") == "a\\x1b[31m\\u202e"


@pytest.mark.parametrize("text", ["\u0663", "1\n", "0x1", "1e", "", "."])
def test_other_digits_and_half_numbers_are_no_numbers(text: str) -> None:
    assert (number(text) is None) == (text != "1\n")
    assert clock(text) is None
