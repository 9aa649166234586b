"""What a page tells is what the saved tables say, whatever they hold."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from kankaku.analysis.page.html import BROWSER, page_of, program
from kankaku.analysis.page.page_data import CALLS, PageSource, page_data, together
from kankaku.analysis.page.page_reading import PageError, read_source
from kankaku.analysis.results import read_results
from kankaku.analysis.tables.columns import rows_of
from kankaku.analysis.tables.compare import comparison
from tests.unit.page_folder import HOSTILE, STATION_NAMES, saved_run, write_results
from tests.unit.test_page_packing import unpacked, whole


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_results(tmp_path / "tiny", [saved_run("plain"), saved_run("early", late_s=4.0)])


def column(content: bytes, table: dict[str, Any], name: str) -> list[Any]:
    told = table["columns"][name]
    if told["type"] == "text":
        return [told["texts"][code] for code in whole(content, told, table["rows"])]
    return unpacked(content, told, table["rows"])


def assert_same(content: bytes, table: dict[str, Any], frame: pd.DataFrame) -> None:
    assert table["rows"] == len(frame)
    for name in frame:
        found = column(content, table, str(name))
        wanted = frame[name].tolist()
        if frame[name].dtype == "float64":
            assert np.array_equal(found, wanted, equal_nan=True), name
        else:
            assert found == wanted, name


def test_every_number_is_the_saved_one(folder: Path) -> None:
    results = read_results(folder)
    packed = page_data([read_source(folder)])
    (told,) = packed.told["results"]
    assert_same(packed.content, told["summary"], results.summary)
    for run, saved in zip(told["runs"], results.runs, strict=True):
        assert_same(packed.content, run["calls"], saved.calls[list(CALLS)])
        assert_same(packed.content, run["interstation_stops"], saved.interstation_stops)
        assert_same(packed.content, run["energy"], saved.energy)
        samples = saved.trajectory.sort_values(["train", "time_s"], ignore_index=True)
        assert_same(packed.content, run["trajectory"], samples.drop(columns="train"))
        for train, start, end in run["trips"]:
            assert (samples["train"][start:end] == train).all()
    compared = rows_of(comparison(results.summary))
    for cell, row in zip(told["comparison"], compared, strict=True):
        wanted = {
            name: None if isinstance(value, float) and np.isnan(value) else value
            for name, value in row.items()
        }
        assert {name: cell[name] for name in wanted} == wanted


def test_the_verdict_and_the_line_stand_in_it(folder: Path) -> None:
    (told,) = page_data([read_source(folder)]).told["results"]
    assert told["verdict"]["en"].startswith("early stands least between stations")
    assert told["leaders"]["stops"] == "early"
    assert told["title"] == "A line"
    assert not told["notes"]


def test_who_delayed_whom_stands_in_it(folder: Path) -> None:
    packed = page_data([read_source(folder)])
    edges = packed.told["results"][0]["runs"][0]["edges"]
    assert "1A" in column(packed.content, edges, "by")
    assert "2B" in column(packed.content, edges, "train")


def test_the_same_results_give_the_same_bytes(folder: Path) -> None:
    assert page_of([read_source(folder)]) == page_of([read_source(folder)])


def test_what_passes_is_not_told(folder: Path) -> None:
    before = page_of([read_source(folder)])
    file = folder / "provenance.json"
    told = json.loads(file.read_text("utf-8"))
    file.write_text(json.dumps({**told, "wall_s": 12.5, "runs": [{"finished": "now"}]}), "utf-8")
    assert page_of([read_source(folder)]) == before


@pytest.mark.parametrize("place", ["title", "station", "controller_told"])
def test_a_hostile_name_is_never_markup(tmp_path: Path, place: str) -> None:
    names = {**STATION_NAMES, "b": HOSTILE} if place == "station" else STATION_NAMES
    title = HOSTILE if place == "title" else "A line"
    folder = write_results(tmp_path / "tiny", [saved_run("plain")], names=names, title=title)
    if place == "controller_told":
        told = {"scenario": HOSTILE, "controllers": {"plain": {"operation": HOSTILE}}}
        (folder / "provenance.json").write_text(json.dumps(told), "utf-8")
    page = page_of([read_source(folder)])
    assert len(re.findall(r"<script\b", page)) == 2
    assert len(re.findall(r"</script>", page)) == 2
    assert "<img" not in page


def test_the_page_forbids_every_request_and_every_other_program(folder: Path) -> None:
    page = page_of([read_source(folder)])
    (policy,) = re.findall(r'Content-Security-Policy" content="([^"]*)"', page)
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert not re.findall(r"(?:src|href)=[\"']?(?:https?:)?//", page)


@pytest.mark.parametrize(
    "lost", ["stations.csv", "provenance.json", "line.json", "plain/trajectory.parquet"]
)
def test_a_missing_file_is_told(folder: Path, lost: str) -> None:
    (folder / lost).unlink()
    source = read_source(folder)
    page_of([source])
    told = " ".join(note.en for note in source.notes)
    assert lost.rpartition("/")[2].partition(".")[0] in told


def test_a_missing_run_is_told(folder: Path) -> None:
    for file in (folder / "early").iterdir():
        file.unlink()
    source = read_source(folder)
    assert [run.controller for run in source.results.runs] == ["plain"]
    assert any("early (seed 1)" in note.en for note in source.notes)
    page_of([source])


def test_tables_of_an_earlier_version_are_read(folder: Path) -> None:
    for file, name in (("summary.csv", "jerk_mps3"), ("plain/calls.csv", "closed_doors_s")):
        table = pd.read_csv(folder / file, dtype="str", keep_default_na=False)
        table.drop(columns=name).to_csv(folder / file, index=False)
    source = read_source(folder)
    told = " ".join(note.en for note in source.notes)
    assert "summary.csv has no column jerk_mps3" in told
    assert "calls.csv has no column closed_doors_s" in told
    assert source.results.runs[0].calls["arrival_s"].notna().all()
    page_of([source])


@pytest.mark.parametrize("content", ["", "[]", "{", '{"limits": 5, "stations": [1, "x"]}'])
def test_a_broken_line_is_no_obstacle(folder: Path, content: str) -> None:
    (folder / "line.json").write_text(content, "utf-8")
    source = read_source(folder)
    page_of([source])
    assert source.line.get("limits", []) == []


@pytest.mark.parametrize(
    ("file", "content"),
    [
        ("plain/calls.csv", "train,sequence\n\x00,x\n"),
        ("plain/energy.csv", "net_kwh\ninf\n"),
        ("plain/trajectory.parquet", "no parquet"),
        ("stations.csv", '"'),
    ],
)
def test_a_broken_table_is_told_and_no_obstacle(folder: Path, file: str, content: str) -> None:
    (folder / file).write_text(content, "utf-8")
    source = read_source(folder)
    assert source.notes
    page_of([source])


def test_what_holds_no_run_is_refused(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(PageError, match=r"has no summary\.csv"):
        read_source(tmp_path)
    header = (folder / "summary.csv").read_text("utf-8").splitlines()[0]
    (folder / "summary.csv").write_text(header + "\n", "utf-8")
    with pytest.raises(PageError, match="holds no run"):
        read_source(folder)
    (folder / "summary.csv").write_text(f"{header}\n../out{',1' * header.count(',')}\n", "utf-8")
    with pytest.raises(PageError, match="controller"):
        read_source(folder)


def test_results_of_one_line_are_compared(tmp_path: Path) -> None:
    folders = [
        write_results(tmp_path / name, [saved_run("plain", late_s=late_s)])
        for name, late_s in (("before", 30.0), ("after", 10.0))
    ]
    sources = [read_source(folder, name=folder.name) for folder in folders]
    (joined,) = together(sources)
    assert joined.results.controllers == ("before: plain", "after: plain")
    (told,) = page_data([joined]).told["results"]
    cell = next(
        cell
        for cell in told["comparison"]
        if cell["controller"] == "after: plain" and cell["indicator"] == "interstation_stop_time_s"
    )
    assert cell["difference"] == pytest.approx(-20.0)
    assert cell["mark"] == "better"


def test_results_of_other_lines_stand_side_by_side(tmp_path: Path) -> None:
    first = read_source(write_results(tmp_path / "one", [saved_run("plain")]))
    other = {**STATION_NAMES}
    del other["c"]
    second = read_source(write_results(tmp_path / "two", [saved_run("plain")], names=other))
    assert len(together([first, second])) == 2


def test_of_several_seeds_only_the_first_has_samples(tmp_path: Path) -> None:
    folder = write_results(
        tmp_path / "seeds", [saved_run("plain", seed, late_s=10.0 * seed) for seed in (1, 2, 3)]
    )
    packed = page_data([read_source(folder)])
    (told,) = packed.told["results"]
    assert ["trajectory" in run for run in told["runs"]] == [True, False, False]
    assert told["seeds"] == [1, 2, 3]
    assert column(packed.content, told["summary"], "interstation_stop_time_s") == [10.0, 20.0, 30.0]


def test_without_results_there_is_no_page() -> None:
    with pytest.raises(ValueError, match="there are none"):
        page_data([])


def test_every_module_is_in_the_program_once() -> None:
    text = program()
    for file in BROWSER.glob("*.js"):
        assert text.count(f"const ${file.stem} = (() =>") == 1
    assert not re.search(r"^(import|export)\b", text, re.MULTILINE)


def test_a_peer_is_there_for_comparison_only(folder: Path) -> None:
    told = {"controllers": {"plain": {}, "early": {"peer": "another"}}}
    (folder / "provenance.json").write_text(json.dumps(told), "utf-8")
    source = read_source(folder)
    assert isinstance(source, PageSource)
    (shown,) = page_data([source]).told["results"]
    assert shown["leaders"]["stops"] == "plain"
    assert [one["peer"] for one in shown["controllers"]] == [False, True]
