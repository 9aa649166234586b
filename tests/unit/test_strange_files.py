"""Files that are not what they seem: refused with the true reason, at once, and never read past."""

import os
from pathlib import Path

import pytest

from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.dependability_files import load_fault_tree
from kankaku.scenarios.reading.mistakes import Mistake, ScenarioError
from kankaku.scenarios.reading.raw import UnreadableError, read_whole
from tests.unit.scenario_folder import FILES, replace, write_scenario


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_scenario(tmp_path / "small")


def faults_of(folder: Path) -> tuple[Mistake, ...]:
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    return caught.value.mistakes


def only_fault(folder: Path) -> Mistake:
    (mistake,) = faults_of(folder)
    return mistake


def dangling(file: Path) -> None:
    file.symlink_to("nowhere")


def circular(file: Path) -> None:
    file.symlink_to(file.name)


def device(file: Path) -> None:
    file.symlink_to("/dev/zero")


@pytest.mark.parametrize("name", ["curves.csv", "limits.csv", "scenario.toml", "calls.csv"])
@pytest.mark.parametrize(
    ("make", "told"),
    [
        (os.mkfifo, "is a pipe"),
        (os.mkdir, "is a folder"),
        (dangling, "is a link to nothing"),
        (circular, "cannot be read"),
        (device, "is a device"),
    ],
)
def test_what_is_there_and_no_file_is_never_taken_for_absent(
    folder: Path, name: str, make: object, told: str
) -> None:
    assert callable(make)
    (folder / name).unlink()
    make(folder / name)
    named = [mistake for mistake in faults_of(folder) if mistake.file == name]
    assert [told in mistake.problem for mistake in named] == [True]


def test_a_fault_tree_that_links_to_nothing_is_refused(folder: Path) -> None:
    assert load_fault_tree(folder) is None
    dangling(folder / "fault_tree.toml")
    with pytest.raises(ScenarioError, match="is a link to nothing"):
        load_fault_tree(folder)


def test_a_file_longer_than_allowed_is_not_read(tmp_path: Path) -> None:
    file = tmp_path / "long"
    with file.open("wb") as made:
        made.truncate(10**12)
    with pytest.raises(UnreadableError) as caught:
        read_whole(file, 1000)
    assert caught.value.problem == "is too long to be read"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("x = " + "[" * 20_000, "nested too deeply"),
        ("x = " + "{a=" * 20_000, "nested too deeply"),
        ("a." * 200_000 + "a = 1", "a key of more than 30 parts"),
        ("seed = " + "9" * 5000, "a number of more than 4300 digits"),
        ("seed = " + "9_" * 5000 + "9", "a number of more than 4300 digits"),
        ("seed = 0x" + "f" * 5000, "more than 60 digits"),
        ("".join(f"k{number} = 1\n" for number in range(60_000)), "unknown key"),
        ("[[work_zones]]\n" * 50_000, "more keys are wrong"),
    ],
)
def test_deep_and_huge_keys_are_refused_in_words(folder: Path, text: str, told: str) -> None:
    main = FILES["scenario.toml"].replace("seed = 7\n", "") if "seed" in text else ""
    (folder / "scenario.toml").write_text(f"{text}\n{main}", encoding="utf-8")
    problems = [mistake.problem for mistake in faults_of(folder)]
    assert any(told in problem for problem in problems)
    assert len(problems) < 60


def test_an_option_beyond_all_floating_point_numbers_is_refused(folder: Path) -> None:
    replace(folder, "scenario.toml", "margin_m = 10.0", f"margin_m = 1{'0' * 400}")
    mistake = only_fault(folder)
    assert "a number of more than 60 digits is not allowed" in mistake.problem
    assert "a finite number" in mistake.allowed


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"start_km,end_km,limit_kmh\n" + b"1" * 200_000, "a row of more than 100,000 characters"),
        (b'start_km,end_km,limit_kmh\n"' + b"1\n" * 200_000, "a row of more than 100,000"),
        (b"x" + b"," * 99_000 + b"\n", "a column without a name"),
        (",".join(f"c{n}" for n in range(15_000)).encode(), "14997 more unknown columns"),
        (b"start_km,end_km,limit_kmh\n0,1,\x00\n", "a zero byte"),
        ("start_km,end_km,limit_kmh\n".encode("utf-16"), "the text is in UTF-16"),
        (b"start_km,end_km,limit_kmh\n" + b"\n" * 2_000_001, "too many rows"),
        (b"start_km,end_km,limit_kmh\n0,1,\xe9\n", "bytes that are not UTF-8"),
    ],
)
def test_huge_and_binary_tables_are_refused_in_words(
    folder: Path, content: bytes, told: str
) -> None:
    (folder / "limits.csv").write_bytes(content)
    assert any(told in mistake.problem for mistake in faults_of(folder))


def test_a_bad_byte_is_named_with_its_line_in_a_long_file(folder: Path) -> None:
    text = "start_km,end_km,limit_kmh\n" + "9.0,9.5,60\n" * 100_000
    content = bytearray(text.encode() + "\u99c5\n".encode())
    (folder / "limits.csv").write_bytes(bytes(content))
    assert all("UTF-8" not in mistake.problem for mistake in faults_of(folder))
    content[-2] = 0x20
    (folder / "limits.csv").write_bytes(bytes(content))
    assert only_fault(folder).where == "line 100002"


@pytest.mark.parametrize("rows", [3, 40_000])
def test_one_bad_column_is_one_sentence(folder: Path, rows: int) -> None:
    body = "".join(f"{number / 1e4},x,90\n" for number in range(rows))
    (folder / "limits.csv").write_text(f"start_km,end_km,limit_kmh\n{body}", encoding="utf-8")
    mistake = only_fault(folder)
    assert mistake.where == "row 2, column end_km"
    more = "rows 3, 4" if rows == 3 else f"{rows - 1} more rows"
    assert mistake.problem == f"'x' is not allowed, and so in {more}"


def test_rows_of_another_length_are_one_sentence(folder: Path) -> None:
    replace(folder, "limits.csv", "-0.3,1.0,90\n1.0,2.0,75", "-0.3,1.0,90,\n1.0,2.0,75,")
    mistake = only_fault(folder)
    assert mistake.where == "row 2"
    told = "has 4 fields, the last one empty after a comma, and so in row 3"
    assert mistake.problem == told


def test_good_rows_of_many_pieces_are_all_read_in_their_order(folder: Path) -> None:
    count = 70_000
    edges = [round(-0.3 + 3.8 * at / count, 9) for at in range(count + 1)]
    rows = [f"{a!r},{b!r},{60 + at % 7}" for at, (a, b) in enumerate(zip(edges, edges[1:]))]  # noqa: B905, RUF007
    text = "start_km,end_km,limit_kmh\n" + "\n".join(rows)
    (folder / "limits.csv").write_text(text, encoding="utf-8")
    limits = load(folder).line.limits
    assert len(limits) == count
    assert [limit.limit_mps for limit in limits[-7:]] == [
        (60 + at % 7) / 3.6 for at in range(count - 7, count)
    ]


def test_quoted_cells_and_rows_of_separators_are_read(folder: Path) -> None:
    text = '\n,,\n"start_km" , end_km,limit_kmh\r\n"-0.3",1.0, 9e1 \r\n,,\r\n1.0,"2.0",+75.\r\n'
    (folder / "limits.csv").write_bytes(text.encode())
    limits = load(folder).line.limits
    assert [(it.start_m, it.end_m, it.limit_mps) for it in limits] == [
        (-300.0, 1000.0, 25.0),
        (1000.0, 2000.0, 75.0 / 3.6),
    ]


def test_an_unread_file_is_told_with_the_name_that_was_meant(folder: Path) -> None:
    assert load(folder).warnings == ()
    (folder / "limits.csv").rename(folder / "limit.csv")
    (folder / "curves.csv").rename(folder / "Curves.CSV")
    (folder / "gradients.csv").rename(folder / "gradients.csv.txt")
    (folder / "extra.toml").write_text("", encoding="utf-8")
    for harmless in ("README.md", ".limits.csv.swp", "plan.png"):
        (folder / harmless).write_text("", encoding="utf-8")
    assert load(folder).warnings == (
        "'Curves.CSV' is not read; did you mean curves.csv?",
        "'extra.toml' is not read",
        "'gradients.csv.txt' is not read; did you mean gradients.csv?",
        "'limit.csv' is not read; did you mean limits.csv?",
    )


def test_measured_delays_that_nobody_asks_for_are_told(folder: Path) -> None:
    text = FILES["scenario.toml"]
    start, end = text.index("[dwell_delays]"), text.index("[[overstays]]")
    (folder / "scenario.toml").write_text(text[:start] + text[end:], encoding="utf-8")
    assert load(folder).warnings == (
        "dwell_quantiles.csv is not read: scenario.toml has no [dwell_delays]",
    )


@pytest.mark.parametrize("name", ["a\x1b[31m", "line\nbreak", "\u202eabc"])
def test_a_folder_whose_name_cannot_be_written_is_refused(tmp_path: Path, name: str) -> None:
    folder = write_scenario(tmp_path / name)
    mistake = only_fault(folder)
    assert "name" in mistake.problem
    assert str(mistake).isprintable()
