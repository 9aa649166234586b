"""Names of stations, controllers and folders do no harm where results show them."""

import json
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from kankaku.analysis.figures.style import style, write_figure
from kankaku.analysis.results import RESULT_FILES, read_provenance, read_results, run_folder
from kankaku.analysis.saved_run import SavedRunError, read_saved_run
from kankaku.analysis.tables.columns import csv_text, read_csv, typed_frame, write_whole
from kankaku.analysis.tables.summary import SUMMARY
from kankaku.analysis.texts.report import markdown
from kankaku.railway.places import name_problem
from kankaku.railway.step.records import Column

NAMES = ["=1+1", "+1", "-1", "@SUM(1)", "'quoted", "Plain", "$\\frac{", "a|b", ""]
COLUMN = (Column("name", "str", "", "name"),)


def test_a_spreadsheet_takes_no_name_for_a_formula_and_reading_gives_it_back(
    tmp_path: Path,
) -> None:
    frame = typed_frame({"name": NAMES}, COLUMN)
    text = csv_text(frame, COLUMN)
    assert not any(line.startswith(("=", "+", "-", "@")) for line in text.splitlines())
    file = tmp_path / "names.csv"
    file.write_text(text, encoding="utf-8")
    assert read_csv(file, COLUMN)["name"].tolist() == NAMES


def test_a_dollar_sign_in_a_name_is_drawn_and_no_formula(tmp_path: Path) -> None:
    with style():
        figure = Figure()
        axes = figure.subplots()
        axes.set_yticks([0.0], ["$\\frac{"])
        axes.set_title("$x^{ and $y_{")
    files = write_figure(figure, tmp_path / "figure")
    assert all(file.stat().st_size > 0 for file in files)


@pytest.mark.parametrize(
    ("title", "shown"),
    [
        ("Rush hour, 8 to 9", "Rush hour, 8 to 9"),
        ("two_stage and close_up", "two_stage and close_up"),
        ("a|b", "a\\|b"),
        ("<b> & *x* `c` [d](e) $f$ ~g~ @h #1 !", None),
        ("_x_", "\\_x\\_"),
        ("a\\b", "a\\\\b"),
    ],
)
def test_markdown_shows_a_title_as_it_is_written(title: str, shown: str | None) -> None:
    escaped = markdown(title)
    assert escaped.replace("\\", "") == title.replace("\\", "")
    if shown is None:
        bare = "".join(escaped.split("\\")[0:1] + [part[1:] for part in escaped.split("\\")[1:]])
        assert not set(bare) & set("<>&*`[]$~@#!|")
    else:
        assert escaped == shown


@pytest.mark.parametrize("name", ["..", ".", "../../etc", "/etc", "a\\b", ".x", "summary.csv"])
def test_results_of_a_stranger_lead_nowhere_else(tmp_path: Path, name: str) -> None:
    row = {column.name: [0] for column in SUMMARY}
    row |= {column.name: [False] for column in SUMMARY if column.dtype == "bool"}
    summary = typed_frame({**row, "controller": [name]}, SUMMARY)
    for file in RESULT_FILES:
        (tmp_path / file).write_text("", encoding="utf-8")
    (tmp_path / "summary.csv").write_text(csv_text(summary, SUMMARY), encoding="utf-8")
    with pytest.raises(ValueError, match="controller"):
        read_results(tmp_path)
    with pytest.raises(SavedRunError, match="controller"):
        read_saved_run(tmp_path)
    with pytest.raises(ValueError, match="controller"):
        run_folder(tmp_path, name, 1, seeds=1)


def test_names_of_all_shipped_controllers_are_fit_for_folders() -> None:
    for name in ("close_up", "two_stage", "ATC", "a.b", "relative-braking", "sumo_native_fixed"):
        assert not name_problem(name)
    for name in ("con", "Com1", "LPT9.x", "a.", " a", "", "x" * 61, "a\nb", "run.json"):
        assert name_problem(name)


def test_a_file_that_cannot_be_written_is_named_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space left") as caught:
        write_whole(tmp_path / "summary.csv", "x")
    assert caught.value.filename == str(tmp_path / "summary.csv")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("content", ["[" * 100_000, json.dumps([1]), "3"])
def test_provenance_of_a_stranger_is_refused_in_words(tmp_path: Path, content: str) -> None:

    file = tmp_path / "provenance.json"
    file.write_text(content, encoding="utf-8")
    with pytest.raises(ValueError, match=r"provenance\.json"):
        read_provenance(file)
