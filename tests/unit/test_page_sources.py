"""Pages of whatever a results folder holds, and the command that makes them."""

import json
import sys
import webbrowser
from pathlib import Path

import pandas as pd
import pytest

from kankaku.analysis.page.html import PAGE, page_of
from kankaku.analysis.page.page_data import page_data
from kankaku.analysis.page.page_reading import PageError, read_source
from kankaku.commands import page_shown
from kankaku.studies import dataset
from kankaku.studies.ensemble_findings import Drawing
from kankaku.studies.page_sources import LINES, sources_of
from tests.cli.command import BAD_INPUT, two_controllers
from tests.cli.command import kankaku as command
from tests.unit.ensemble_helpers import run_some
from tests.unit.page_folder import saved_run, write_results

PAGE_ALONE = Drawing(formats=("svg",))


@pytest.fixture(scope="module")
def ensemble(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("ensemble")
    out = place / "out"
    run_some(two_controllers(place / "small"), out, drawing=PAGE_ALONE)
    return out


def test_a_study_has_a_page_of_its_dataset(ensemble: Path) -> None:
    (source,) = sources_of(ensemble)
    assert (ensemble / PAGE).read_text("utf-8") == page_of([source])
    saved = dataset.read(ensemble, "calls")
    assert len(source.results.runs) == 6
    for run in source.results.runs:
        own = saved[(saved["controller"] == run.controller) & (saved["seed"] == run.seed)]
        pd.testing.assert_frame_equal(
            run.calls, own[list(run.calls.columns)].reset_index(drop=True)
        )
    assert source.line["title"] == "Small"
    assert not source.notes
    (told,) = page_data([source]).told["results"]
    assert told["seeds"] == [7, 8, 9]
    assert all(cell["pairs"] == 3 for cell in told["comparison"])


def test_a_study_without_its_lines_takes_stations_from_the_calls(
    ensemble: Path, tmp_path: Path
) -> None:
    copy = tmp_path / "copy"
    copy.mkdir()
    (copy / "plan.json").write_bytes((ensemble / "plan.json").read_bytes())
    (copy / "runs").symlink_to(ensemble / "runs")
    assert (ensemble / LINES).is_file()
    (source,) = sources_of(copy)
    known = {*source.results.runs[0].calls["station"]}
    assert {*source.results.stations["station"]} == known
    page_of([source])


def test_a_study_without_a_run_is_refused(ensemble: Path, tmp_path: Path) -> None:
    (tmp_path / "plan.json").write_bytes((ensemble / "plan.json").read_bytes())
    with pytest.raises(PageError, match="no finished run"):
        sources_of(tmp_path)
    (tmp_path / "plan.json").write_text("{}", "utf-8")
    with pytest.raises(PageError, match=r"plan\.json: cannot be read"):
        sources_of(tmp_path)


def test_several_scenarios_have_a_page_with_all_of_them(tmp_path: Path) -> None:
    folders = [
        write_results(tmp_path / name, [saved_run("plain"), saved_run("early", late_s=late_s)])
        for name, late_s in (("one", 3.0), ("two", 9.0))
    ]
    across = tmp_path / "across"
    across.mkdir()
    for name in ("across.csv", "columns.csv"):
        (across / name).write_text("scenario\n", "utf-8")
    told = {"scenarios": [{"scenario": folder.name} for folder in folders]}
    (across / "provenance.json").write_text(json.dumps(told), "utf-8")
    assert [source.results.folder.name for source in sources_of(across)] == ["one", "two"]
    (across / "provenance.json").write_text('{"scenarios": [{"scenario": "../x"}]}', "utf-8")
    with pytest.raises(PageError, match="outside"):
        sources_of(across)


def test_the_command_writes_the_page_beside_the_tables(tmp_path: Path) -> None:
    folder = write_results(tmp_path / "tiny", [saved_run("plain")])
    shown = command("report", folder, "--no-open")
    assert shown.status == 0
    assert (folder / PAGE).read_text("utf-8") == page_of([read_source(folder)])
    assert f"Page: {folder / PAGE}" in shown.answers


def test_the_command_compares_several_folders(tmp_path: Path) -> None:
    folders = [
        write_results(tmp_path / name, [saved_run("plain", late_s=late_s)])
        for name, late_s in (("before", 30.0), ("after", 10.0))
    ]
    assert command("report", *folders).status == 0
    assert (tmp_path / PAGE).is_file()
    other = tmp_path / "other.html"
    assert command("report", *folders, "--out", other).status == 0
    assert other.read_bytes() == (tmp_path / PAGE).read_bytes()


@pytest.mark.parametrize("missing", ["nowhere", ""])
def test_the_command_refuses_what_holds_no_results(tmp_path: Path, missing: str) -> None:
    shown = command("report", tmp_path / missing)
    assert shown.status == BAD_INPUT
    assert "allowed: what `kankaku run` wrote" in " ".join(shown.complaints.split())


@pytest.mark.parametrize(
    ("environment", "terminal", "wanted", "opens"),
    [
        ({"DISPLAY": ":0"}, True, None, True),
        ({"WAYLAND_DISPLAY": "w"}, True, None, True),
        ({}, True, None, False),
        ({"DISPLAY": ":0", "CI": "true"}, True, None, False),
        ({"DISPLAY": ":0"}, False, None, False),
        ({"DISPLAY": ":0"}, True, False, False),
        ({}, False, True, True),
    ],
)
def test_a_page_opens_where_somebody_sees_it(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    environment: dict[str, str],
    terminal: bool,
    wanted: bool | None,
    opens: bool,
) -> None:
    seen: list[str] = []
    monkeypatch.setattr(webbrowser, "open", seen.append)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(sys.stdout, "isatty", lambda: terminal, raising=False)
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "CI"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    file = tmp_path / PAGE
    page_shown.open_page(file, wanted=True)
    assert seen == []
    file.write_text("a page", "utf-8")
    page_shown.open_page(file, wanted=wanted)
    assert seen == ([file.as_uri()] if opens else [])
