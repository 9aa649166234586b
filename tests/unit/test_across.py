"""Several scenarios in one table: its numbers, its lines, and what becomes of a scenario."""

from collections.abc import Mapping
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import kankaku
from kankaku.analysis.figures.across_figure import across_figure
from kankaku.analysis.tables.across_tables import ACROSS, across_frame
from kankaku.analysis.tables.columns import read_csv, rows_frame
from kankaku.analysis.tables.compare import comparison
from kankaku.analysis.tables.summary import SUMMARY
from kankaku.analysis.texts.across_texts import Part, across_lines, across_note, across_report
from kankaku.studies.across_study import AcrossResult, choose_across, run_across
from kankaku.studies.outcomes import Go, Hearers, Study, StudyResult
from tests.cli.command import contents, is_note_of_time, two_controllers
from tests.unit.scenario_folder import replace
from tests.unit.sweep_folder import write_sweep

STUDENT_OF_TWO = 12.7062
"""Quantile of 97.5 % with one degree of freedom, of any table."""


def summary(*runs: Mapping[str, object]) -> pd.DataFrame:
    """Return a summary of runs of 40 trains in which everything else is 0."""
    plain: dict[str, object] = {
        column.name: "" if column.dtype == "str" else 0 for column in SUMMARY
    }
    plain |= {"trains": 40, "trains_completed": 40}
    return rows_frame([{**plain, **run} for run in runs], SUMMARY)


def run(controller: str, seed: int, stop_s: float, **others: object) -> dict[str, object]:
    own = {"controller": controller, "seed": seed, "interstation_stop_time_s": stop_s}
    return {**own, **others}


EXAMPLE = summary(
    run("plain", 1, 10.0, energy_net_kwh=100.0),
    run("plain", 2, 20.0, energy_net_kwh=100.0),
    run("gentle_and_early", 1, 5.0, energy_net_kwh=90.0, mean_arrival_delay_s=1.0),
    run("gentle_and_early", 2, 11.0, energy_net_kwh=90.0, mean_arrival_delay_s=3.0),
)


def test_changes_are_paired_by_seed_and_told_in_per_cent_of_the_baseline() -> None:
    table = across_frame({"metro": EXAMPLE}, ["plain", "gentle_and_early"])
    row = table.iloc[1]
    assert (row["runs"], row["pairs"]) == (2, 2)
    assert row["interstation_stop_time_s"] == 8.0
    # Differences of -5 and -9 against a baseline of 15.
    assert row["interstation_stop_time_difference_s"] == -7.0
    half_s = STUDENT_OF_TWO * sqrt(8.0) / sqrt(2.0)
    assert row["interstation_stop_time_confidence_95_s"] == pytest.approx(half_s, abs=1e-3)
    assert row["interstation_stop_time_change_pct"] == pytest.approx(-100.0 * 7.0 / 15.0)
    assert row["interstation_stop_time_change_confidence_95_pct"] == pytest.approx(
        100.0 * half_s / 15.0, abs=1e-3
    )
    # Every seed saves the same: the interval has no width.
    assert row["energy_net_change_pct"] == pytest.approx(-10.0)
    assert row["energy_net_change_confidence_95_pct"] == 0.0
    # A baseline without delay gives no per cents.
    assert row["mean_arrival_delay_difference_s"] == 2.0
    assert table["mean_arrival_delay_change_pct"].isna().all()


def test_a_controller_without_a_run_has_a_row_and_no_numbers() -> None:
    only = EXAMPLE[EXAMPLE["controller"] == "gentle_and_early"]
    table = across_frame({"metro": only, "tram": EXAMPLE}, ["plain", "gentle_and_early"])
    assert table["runs"].tolist() == [0, 2, 2, 2]
    assert table["pairs"].tolist() == [0, 0, 2, 2]
    # Nothing is compared with a baseline that has not run.
    assert table["interstation_stop_time_difference_s"].isna().tolist() == [
        True,
        True,
        False,
        False,
    ]
    assert table.loc[1, "interstation_stop_time_s"] == 8.0
    lines = across_lines(table)
    assert lines[lines.index("metro") + 1].split() == ["plain", *"-------"]


def test_unfinished_trains_and_violations_are_added_up() -> None:
    runs = summary(run("plain", 1, 0.0, trains_completed=38), run("plain", 2, 0.0, violations=3))
    row = across_frame({"metro": runs}, ["plain"]).iloc[0]
    assert (row["unfinished"], row["violations"]) == (2, 3)


def test_table_and_report_fit_on_eighty_columns() -> None:
    wide = summary(
        run("moving_block+close_up", 1, 12345.6, energy_net_kwh=123456.0, trains_completed=0),
        run("moving_block+close_up", 2, 22345.6, energy_net_kwh=223456.0),
        run("control_map", 1, 345.6, energy_net_kwh=123450.0, mean_arrival_delay_s=1234.5),
        run("control_map", 2, 22345.6, energy_net_kwh=23456.0, mean_arrival_delay_s=0.25),
    )
    table = across_frame({"metro": wide, "tram": wide}, ["moving_block+close_up", "control_map"])
    lines = across_lines(table)
    assert max(map(len, lines)) <= 80
    assert [line.split()[0] for line in lines if line.startswith(("metro", "tram"))] == [
        "metro",
        "tram",
    ]
    assert "  moving_block+close_up" in lines
    parts = [
        Part(name, "A title of a scenario_with_words " * 4, (1, 2), 0.1) for name in ("a", "b")
    ]
    text = across_report(parts, table, ["something that failed " * 9], ["across.png"])
    assert max(map(len, text.splitlines())) <= 80
    assert "2 seeds from 1 to 2" in " ".join(text.split())
    assert "## Take note" in text
    assert "Second lines: change against moving_block+close_up" in text


def test_a_baseline_alone_has_no_second_lines() -> None:
    table = across_frame({"metro": EXAMPLE}, ["plain"])
    assert not across_note(table)
    assert len(across_lines(table)) == 5


def test_the_figure_has_a_panel_for_each_indicator_with_scenarios_side_by_side() -> None:
    table = across_frame({"metro": EXAMPLE, "tram": EXAMPLE}, ["plain", "gentle_and_early"])
    panels = across_figure(table).axes
    assert [axes.get_xlabel().splitlines()[-1] for axes in panels] == ["[%]", "[s]", "[s]", "[%]"]
    assert [text.get_text() for text in panels[0].get_yticklabels()] == ["metro", "tram"]
    (dots,) = [line for line in panels[0].lines if line.get_marker() == "o"]
    assert np.asarray(dots.get_xdata()).tolist() == pytest.approx([-700.0 / 15.0] * 2)


@pytest.fixture
def folders(tmp_path: Path) -> list[Path]:
    """Two scenarios; in the second the trains overstay longer."""
    found = [two_controllers(tmp_path / name) for name in ("metro", "tram")]
    replace(found[1], "scenario.toml", "delay_s = 90.0", "delay_s = 200.0")
    return found


def chosen(folders: list[Path], **choices: object) -> tuple[Study, ...]:
    return choose_across(folders, choices)


def test_the_table_says_what_the_results_of_each_scenario_say(
    folders: list[Path], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    result = kankaku.across(folders, out, names=["plain", "second"], seeds=2)
    assert not result.failures
    assert result.table is not None
    pd.testing.assert_frame_equal(result.table, read_csv(out / "across" / "across.csv", ACROSS))
    for name in ("metro", "tram"):
        alone = comparison(kankaku.read_results(out / name).summary)
        told = alone[(alone["controller"] == "second") & (alone["indicator"] == "energy_net_kwh")]
        rows = result.table[result.table["scenario"] == name]
        assert rows["energy_net_change_pct"].iloc[1] == told["change_pct"].item()
    stops_s = result.table["interstation_stop_time_s"]
    assert stops_s[2] > stops_s[0]


def test_only_what_was_asked_for_is_compared(folders: list[Path], tmp_path: Path) -> None:
    run_across(chosen(folders, seeds=2), tmp_path / "out")
    again = run_across(chosen(folders, names=("second", "plain"), seed=8), tmp_path / "out")
    assert again.table is not None
    assert again.table["controller"].tolist() == ["second", "plain"] * 2
    assert again.table["runs"].tolist() == [1] * 4
    # The folder still holds the other seed.
    assert len(kankaku.read_results(tmp_path / "out" / "metro").summary) == 4


def failing(name: str, error: BaseException) -> Any:  # noqa: ANN401 - as run_across calls it
    def go_on(study: Study, go: Go) -> StudyResult:
        if study.scenario.name == name:
            raise error
        return go(Hearers())

    return go_on


def test_a_scenario_that_fails_does_not_lose_the_others(
    folders: list[Path], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    result = run_across(chosen(folders), out, failing("metro", OSError(28, "No space left")))
    assert result.table is not None
    assert result.table["runs"].tolist() == [0, 0, 1, 1]
    assert len(result.failures) == 1
    assert "metro: OSError" in result.failures[0]
    assert (out / "across" / "failures" / "metro.txt").is_file()
    assert "metro: OSError" in (out / "across" / "report.md").read_text("utf-8")
    assert [item.name for item in sorted(out.iterdir())] == ["across", "tram"]
    # The same again mends it.
    mended = run_across(chosen(folders), out)
    assert mended.table is not None
    assert mended.table["runs"].tolist() == [1, 1, 1, 1]
    assert not (out / "across" / "failures").exists()


def test_an_interrupt_keeps_what_is_finished_and_the_same_goes_on_from_there(
    folders: list[Path], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    first = run_across(chosen(folders), out, failing("tram", KeyboardInterrupt()))
    assert first.interrupted
    assert first.table is not None
    assert first.table["runs"].tolist() == [1, 1, 0, 0]
    said: list[str] = []

    def heard(_: Study, go: Go) -> StudyResult:
        return go(Hearers(say=said.append))

    second = run_across(chosen(folders), out, heard)
    assert [sentence.partition(" finished")[0] for sentence in said] == ["All 2 runs were"]
    whole = run_across(chosen(folders), tmp_path / "whole")
    assert [found.table is not None for found in (second, whole)] == [True, True]
    here, there = contents(out), contents(tmp_path / "whole")
    assert here.keys() == there.keys()
    assert all(map(is_note_of_time, (name for name in here if here[name] != there[name])))


def test_when_nothing_is_finished_nothing_stays(folders: list[Path], tmp_path: Path) -> None:
    result = run_across(chosen(folders), tmp_path / "out", failing("metro", KeyboardInterrupt()))
    assert result.interrupted
    assert result.table is None
    assert not (tmp_path / "out").exists()


def test_options_that_differ_between_scenarios_are_told(
    folders: list[Path], tmp_path: Path
) -> None:
    replace(folders[1], "scenario.toml", "margin_m = 10.0", "margin_m = 30.0")
    result: AcrossResult = run_across(chosen(folders), tmp_path / "out")
    report = (result.folder / "report.md").read_text("utf-8")
    assert "- plain has other layers or options in tram than in metro" in report
    assert "- second has" not in report


def test_everything_that_cannot_be_run_is_told_at_once_and_before_any_run(
    folders: list[Path], tmp_path: Path
) -> None:
    with pytest.raises(kankaku.KankakuError) as caught:
        chosen([*folders, write_sweep(tmp_path / "sweep")], names=("plain", "fast"))
    told = caught.value.sentences
    assert [sentence.partition(": ")[0] for sentence in told] == [
        *map(str, folders),
        str(tmp_path / "sweep"),
    ]
    assert "'fast' is not a controller of this scenario; allowed: plain, second" in told[0]
    with pytest.raises(kankaku.KankakuError, match="has a sweep, whose delays are no sample"):
        chosen([folders[0], tmp_path / "sweep"], names=("moving_block+eco",))


def test_without_names_those_that_every_scenario_runs_by_default(
    folders: list[Path],
) -> None:
    replace(folders[1], "scenario.toml", "[controllers.second]", "[controllers.third]")
    with pytest.raises(kankaku.KankakuError, match=r"metro has plain, second; tram has plain, th"):
        chosen(folders)
    with (folders[1] / "scenario.toml").open("a", encoding="utf-8") as file:
        file.write('\n[controllers.second]\nprotection = "moving_block"\noperation = "eco"\n')
    studies = chosen(folders)
    assert [[spec.name for spec in study.specs] for study in studies] == [["plain", "second"]] * 2


def test_two_scenarios_of_one_name_and_one_named_like_the_table_are_refused(
    folders: list[Path], tmp_path: Path
) -> None:
    other = two_controllers(tmp_path / "elsewhere" / "metro")
    with pytest.raises(kankaku.KankakuError, match="the results of both would go to metro"):
        chosen([folders[0], other])
    with pytest.raises(kankaku.KankakuError, match="the results of both would go to metro"):
        chosen([folders[0], folders[0]])
    named = two_controllers(tmp_path / "across")
    with pytest.raises(kankaku.KankakuError, match="allowed: a folder of another name"):
        chosen([folders[0], named])


def test_a_folder_that_holds_runs_of_something_else_is_refused_before_any_run(
    folders: list[Path], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    run_across(chosen([folders[1]]), out)
    before = contents(out)
    with pytest.raises(kankaku.KankakuError, match=r"tram: .* holds runs of something else \(step"):
        run_across(chosen(folders, step_s=0.25), out)
    assert contents(out) == before
    (out / "across").rename(out / "elsewhere")
    (out / "across").mkdir()
    (out / "across" / "notes.txt").write_text("mine", "utf-8")
    with pytest.raises(FileExistsError, match="choose another folder"):
        run_across(chosen(folders), out)
