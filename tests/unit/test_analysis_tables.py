"""Tables: declared columns and types, bytes that can be reproduced, a folder read back."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from kankaku.analysis.publish.study_publishing import publish
from kankaku.analysis.results import COLUMNS, columns_frame, read_results, run_folder
from kankaku.analysis.tables.columns import csv_text, read_csv, typed_frame
from kankaku.analysis.tables.compare import change_pct, comparison, half_width
from kankaku.analysis.tables.indicators import COMPARED
from kankaku.analysis.tables.run_tables import REASONS, RunTables, run_tables, write_run
from kankaku.analysis.tables.summary import SUMMARY, summary_frame
from kankaku.analysis.texts.comparison_texts import change_text, comparison_note, comparison_texts
from kankaku.analysis.texts.report import reason_shares, report_text
from kankaku.railway.plan.disruptions import Cause
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.step.obstructions import Obstruction
from kankaku.railway.step.records import RAW_TABLES, Column, Unfinished, Violation
from kankaku.railway.step.state import Reason
from kankaku.testing.example_lines import (
    make_scenario,
    merge_scenario,
    two_station_scenario,
    world_of,
)
from tests.records import (
    READY_S,
    Stand,
    make_record,
    punctual,
    run_times_s,
    three_station_world,
)

STAND: Stand = (1, READY_S + 200.0, 30.0, 900.0, 1)

ZOOMED = ("time_distance", "zoom")


def example(controller: str = "close_up", seed: int = 1, late_s: float = 20.0) -> RunTables:
    world = three_station_world(trains=3)
    arrival_s, departure_s = punctual(world)
    arrival_s[1, 1:] += late_s
    departure_s[1, 1:] += late_s / 3.0
    record = make_record(
        world,
        arrival_s,
        departure_s,
        stands=[STAND] if late_s else [],
        controller=controller,
        seed=seed,
        energy_j=3.6e8 - 1e6 * late_s,
    )
    return run_tables(record, run_times_s(world, 90.0, 110.0))


def scenario() -> Scenario:
    world = three_station_world()
    return make_scenario(world.line, world.timetable.services)


def publish_all(folder: Path, runs: list[RunTables]) -> None:
    seeds = len({run.seed for run in runs})
    for run in runs:
        write_run(run, run_folder(folder, run.controller, run.seed, seeds=seeds))
    publish(folder, scenario(), runs, {"step_s": 0.5})


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {
        str(file.relative_to(folder)): file.read_bytes()
        for file in folder.rglob("*")
        if file.is_file()
    }


@pytest.mark.parametrize("table", RAW_TABLES)
def test_every_raw_table_has_the_declared_columns_and_types(table: str) -> None:
    frame = example().frames[table]
    declared = {column.name: column.dtype for column in RAW_TABLES[table]}
    assert {name: str(dtype) for name, dtype in frame.dtypes.items()} == declared


def test_a_run_without_stops_and_violations_has_typed_empty_tables() -> None:
    tables = example(late_s=0.0)
    assert tables.interstation_stops.empty
    assert str(tables.violations["train"].dtype) == "str"
    assert str(tables.interstation_stops["duration_s"].dtype) == "float64"


def test_the_summary_has_the_declared_columns_and_types() -> None:
    summary = summary_frame([example()])
    assert {name: str(dtype) for name, dtype in summary.dtypes.items()} == {
        column.name: column.dtype for column in SUMMARY
    }


def test_what_was_in_the_way_stands_in_a_table_of_its_own() -> None:
    world = world_of(two_station_scenario(1))
    found = (
        Obstruction("fan", Cause.POINTS, ("in", "north"), 940.0, 1060.0, 10.0, 10.0, 16.5),
        Obstruction("zone", Cause.WORK, ("in",), 500.0, 600.0, 20.0, np.nan, 90.0),
    )
    record = make_record(world, *punctual(world), obstructions=found)
    frame = run_tables(record, run_times_s(world, 60.0)).obstructions
    assert frame["obstruction"].tolist() == ["fan", "zone"]
    assert frame["cause"].tolist() == ["points", "work"]
    assert frame["tracks"].tolist() == ["in north", "in"]
    assert frame["lifted_s"].tolist() == [16.5, 90.0]
    assert frame["established_s"].isna().tolist() == [False, True]


def test_a_column_that_is_not_declared_is_refused() -> None:
    with pytest.raises(ValueError, match="not declared: colour"):
        typed_frame({"train": ["T1"], "colour": ["red"]}, (Column("train", "str", "", ""),))


def test_samples_name_the_track_of_the_trains_route_and_what_bound_it() -> None:
    world = world_of(merge_scenario(trains=2))
    tables = run_tables(make_record(world, *punctual(world)), run_times_s(world, 60.0))
    samples = tables.trajectory
    throat = samples["front_m"] < 400.0
    assert set(samples.loc[throat & (samples["train"] == "T1"), "track"]) == {"north"}
    assert set(samples.loc[throat & (samples["train"] == "T2"), "track"]) == {"south"}
    assert set(samples.loc[~throat, "track"]) == {"main"}
    # T1 is booked at east from 07:02:00 to 07:02:30.
    seconds = samples["time_s"].between(READY_S + 120.0, READY_S + 149.0)
    at_east = samples[seconds & (samples["train"] == "T1")]
    assert set(at_east["front_m"]) == {1500.0}
    assert set(at_east["reason"]) == {"dwelling"}
    assert set(samples.loc[samples["front_m"].between(500.0, 1400.0), "reason"]) == {"traction"}


def test_every_reason_has_its_own_name() -> None:
    words = "traction line_limit train_ahead obstruction_ahead station_stop plan emergency peer"
    assert (*words.split(), "dwelling", "held") == REASONS
    assert len(REASONS) == len(Reason)


def test_shares_of_the_running_time_leave_dwells_out() -> None:
    reasons = ["dwelling"] * 5 + ["traction"] * 3 + ["plan"]
    samples = pd.DataFrame({"reason": reasons, "plan": [""] * 8 + ["eco"]})
    shares = reason_shares(samples)
    assert shares["traction", ""] == 0.75
    assert shares["plan", "eco"] == 0.25
    assert shares.sum() == pytest.approx(1.0)


def test_collisions_are_counted_among_the_violations() -> None:
    world = three_station_world()
    found = (
        Violation(READY_S, 1, "spacing", 3.0, "T2 was 3 m too close"),
        Violation(READY_S + 1.0, 1, "collision", 0.0, "T2 ran into T1"),
    )
    record = make_record(world, *punctual(world), violations=found)
    summary = summary_frame([run_tables(record, run_times_s(world, 90.0, 110.0))])
    assert summary["violations"].tolist() == [2]
    assert summary["collisions"].tolist() == [1]


def test_the_summary_of_a_small_run_can_be_worked_by_hand() -> None:
    row = summary_frame([example(late_s=30.0)]).iloc[0]
    assert row["trains"] == row["trains_completed"] == 3
    assert row["interstation_stop_time_s"] == 30.0
    assert row["interstation_stops"] == row["interstation_stop_trains"] == 1
    # T2 is 30 s late at two of the six calls that are not origins.
    assert row["mean_arrival_delay_s"] == 10.0
    assert row["final_arrival_delay_s"] == 10.0
    # 2500 m in 250 s, T2 in 280 s.
    assert row["scheduled_speed_kmh"] == pytest.approx(3.6 * 7500.0 / 780.0, abs=5e-4)
    # 3.3e8 J of traction work: 1.2 of it consumed, 0.4 recovered, three trains.
    assert row["energy_gross_kwh"] == 330.0
    assert row["energy_net_kwh"] == pytest.approx(220.0, abs=1e-5)


@pytest.mark.figures
def test_files_written_twice_are_equal_byte_by_byte(tmp_path: Path) -> None:
    runs = [example(), example("two_stage", late_s=6.0)]
    for name in ("first", "second"):
        publish_all(tmp_path / name, runs)
    first = bytes_of(tmp_path / "first")
    assert len(first) == 2 * len(RAW_TABLES) + 15
    assert first == bytes_of(tmp_path / "second")
    publish_all(tmp_path / "second", runs)
    assert first == bytes_of(tmp_path / "second")


def test_numbers_are_written_with_fixed_decimals_and_plain_line_ends(tmp_path: Path) -> None:
    write_run(example(), tmp_path / "run")
    stops = (tmp_path / "run" / "interstation_stops.csv").read_bytes()
    assert stops == (
        b"train,start_s,duration_s,front_m,next_station,start_clock\n"
        b"T2,25400.000,30.000,900.000,mid,07:03:20\n"
    )
    energy = (tmp_path / "run" / "energy.csv").read_text().splitlines()[1]
    assert energy.startswith("T1,3300.000,94.444444,")


@pytest.mark.parametrize("seeds", [(1,), (1, 2)])
def test_a_results_folder_is_read_as_it_was_written(tmp_path: Path, seeds: tuple[int, ...]) -> None:
    runs = [example(name, seed, late_s=seed) for name in ("close_up", "atd") for seed in seeds]
    publish_all(tmp_path, runs)
    results = read_results(tmp_path)
    assert results.controllers == ("close_up", "atd")
    assert results.provenance == {"step_s": 0.5}
    assert results.stations["name"].tolist() == ["West", "Mid", "East"]
    pd.testing.assert_frame_equal(results.summary, summary_frame(runs))
    for run in runs:
        read = results.run(run.controller, run.seed)
        for table, frame in run.frames.items():
            pd.testing.assert_frame_equal(read.frames[table], frame, check_exact=True)


def test_one_seed_left_of_an_interrupted_study_can_be_read(tmp_path: Path) -> None:
    run = example()
    write_run(run, run_folder(tmp_path, run.controller, run.seed, seeds=3))
    publish(tmp_path, scenario(), [run], {})
    pd.testing.assert_frame_equal(read_results(tmp_path).run("close_up").calls, run.calls)


def test_trajectories_can_be_left_on_disk(tmp_path: Path) -> None:
    publish_all(tmp_path, [example()])
    trajectory = read_results(tmp_path, trajectories=False).run("close_up").trajectory
    assert trajectory.empty
    assert list(trajectory.columns) == [column.name for column in RAW_TABLES["trajectory"]]


def test_a_line_on_which_no_train_moved_is_published_without_a_close_look(tmp_path: Path) -> None:
    world = three_station_world()
    arrival_s, departure_s = punctual(world)
    arrival_s[:, 1:] = departure_s[:, 1:] = np.nan
    record = make_record(world, arrival_s, departure_s)
    publish_all(tmp_path, [run_tables(record, run_times_s(world, 90.0, 110.0))])
    assert not (tmp_path / "zoom.png").exists()
    assert read_results(tmp_path).summary["trains_completed"].tolist() == [0]


def test_every_column_of_every_table_is_explained() -> None:
    columns = columns_frame()
    assert (columns["meaning"] != "").all()
    assert {*RAW_TABLES, "summary"} <= set(columns["table"])
    assert not columns.duplicated(["table", "column"]).any()


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="nowhere: no such results folder"):
        read_results(tmp_path / "nowhere")


def test_a_folder_without_a_summary_is_no_results_folder(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"has no summary\.csv"):
        read_results(tmp_path)


def test_a_station_called_na_is_not_a_missing_value(tmp_path: Path) -> None:
    columns = (Column("station", "str", "", ""), Column("arrival_s", "float64", "s", ""))
    frame = typed_frame({"station": ["NA", "0815"], "arrival_s": [np.nan, -0.0001]}, columns)
    (tmp_path / "table.csv").write_text(csv_text(frame, columns))
    assert (tmp_path / "table.csv").read_text() == "station,arrival_s\nNA,\n0815,0.000\n"
    pd.testing.assert_frame_equal(read_csv(tmp_path / "table.csv", columns), frame)


def test_a_table_with_other_columns_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "columns.csv"
    file.write_text("table,meaning\n")
    with pytest.raises(ValueError, match="columns are table, meaning; expected table, column"):
        read_csv(file, COLUMNS)


def test_an_unknown_run_is_answered_with_the_known_ones(tmp_path: Path) -> None:
    publish_all(tmp_path, [example()])
    with pytest.raises(KeyError, match=r"close_up \(seed 1\)"):
        read_results(tmp_path).run("atd")


def test_a_change_is_counted_against_the_first_controller() -> None:
    summary = summary_frame([example(late_s=30.0), example("atd", late_s=0.0)])
    compared = comparison(summary, ["interstation_stop_time_s", "energy_gross_kwh"])
    change = compared.set_index(["controller", "indicator"])["change_pct"]
    assert change["atd", "interstation_stop_time_s"] == -100.0
    assert change["atd", "energy_gross_kwh"] == pytest.approx(100.0 / 11.0, abs=1e-6)
    assert change["close_up", "energy_gross_kwh"] == 0.0
    header, rows = comparison_texts(compared)
    assert header == ["indicator", "close_up", "atd"]
    assert rows[0] == ["stop time between stations [s]", "30.0", "0.0 (-100.0 %)"]


def test_differences_are_paired_by_seed() -> None:
    runs = [
        example(name, seed, late_s=late_s)
        for name, lates_s in {"close_up": (30.0, 90.0), "atd": (24.0, 78.0)}.items()
        for seed, late_s in enumerate(lates_s)
    ]
    row = comparison(summary_frame(runs), ["final_arrival_delay_s"]).iloc[1]
    # A third of the trains is late: differences of -2 s and -4 s.
    assert (row["pairs"], row["mean"], row["difference"]) == (2, 17.0, -3.0)
    assert row["change_pct"] == -15.0
    # t(0.975, 1) = 12.7062, s / sqrt(2) = 1.
    assert row["confidence_95"] == pytest.approx(12.7062, abs=1e-3)


def test_the_confidence_interval_of_a_mean_agrees_with_students_table() -> None:
    # Student's table gives t(0.975, 4) = 2.776; 1..5 has s = sqrt(2.5).
    expected = 2.776 * np.sqrt(2.5) / np.sqrt(5.0)
    assert half_width(np.arange(1.0, 6.0)) == pytest.approx(expected, rel=1e-3)
    assert np.isnan(half_width(np.array([1.0])))


def test_a_report_does_not_depend_on_how_long_the_runs_took() -> None:
    runs = [example()]
    reports = {
        report_text("Example", runs, summary_frame(runs), {"step_s": 0.5, "wall_s": wall_s}, ())
        for wall_s in (1.0, 2.0)
    }
    assert len(reports) == 1
    assert "- step [s]: 0.5" in reports.pop()


def test_a_report_warns_of_trains_that_never_arrived(tmp_path: Path) -> None:
    publish_all(tmp_path, [example()])
    assert "no safety invariant was violated" in (tmp_path / "report.md").read_text()
    world = three_station_world()
    arrival_s, departure_s = punctual(world)
    arrival_s[1, 2] = departure_s[1, 2] = np.nan
    record = make_record(world, arrival_s, departure_s)
    told = Unfinished(1, "running", "", 2000.0, "T2 was still running at km 2.000")
    record = replace(record, unfinished=(told,))
    publish_all(tmp_path, [run_tables(record, run_times_s(world, 90.0, 110.0))])
    report = (tmp_path / "report.md").read_text()
    assert "Every train finished" not in report
    assert "## 1 train had not finished when patience_min = 30 ended the run" in report
    assert "- close_up, seed 1: T2 was still running at km 2.000" in report


@pytest.mark.parametrize(
    ("reference", "percent"),
    [(20.0, 10.0), (5.1, 2.0 / 0.051), (5.0, None), (0.0, None), (-20.0, None)],
)
def test_a_change_is_told_in_per_cent_only_of_a_baseline_that_is_large_enough(
    reference: float, percent: float | None
) -> None:
    assert COMPARED["mean_arrival_delay_s"].per_cent_above == 5.0
    found = change_pct("mean_arrival_delay_s", 2.0, reference)
    assert np.isnan(found) if percent is None else found == pytest.approx(percent)


@pytest.mark.parametrize(
    ("unit", "difference", "interval", "percent", "text"),
    [
        ("s", 2.34, np.nan, np.nan, "+2.3 s"),
        ("s", -0.456, np.nan, np.nan, "-0.46 s"),
        ("s", -2.34, 0.71, np.nan, "-2.3 ± 0.7 s"),
        ("s", -2.34, 1.17, -20.0, "-20.0 ± 10.0 %"),
        ("", 3.0, np.nan, np.nan, "+3.0"),
        ("s", 0.0, 0.0, 0.0, "+0.0 %"),
        ("s", 0.0, np.nan, np.nan, "+0.0 s"),
        ("kWh", 1234.5, np.nan, np.nan, "+1,234 kWh"),
    ],
)
def test_a_change_without_per_cents_is_told_in_the_unit_of_the_indicator(
    unit: str, difference: float, interval: float, percent: float, text: str
) -> None:
    cell = {
        "unit": unit,
        "difference": difference,
        "confidence_95": interval,
        "change_pct": percent,
    }
    assert change_text(cell) == text


def test_trains_that_are_early_are_compared_by_seconds_on_screen_and_in_the_report() -> None:
    runs = [example(late_s=-9.0), example("atd", late_s=-3.0)]
    summary = summary_frame(runs)
    compared = comparison(summary, ["final_arrival_delay_s", "energy_gross_kwh"])
    # A third of the trains is 9 s early under the baseline, and 3 s under the other.
    _, (delays, energies) = comparison_texts(compared)
    assert delays == ["delay at the last station [s]", "-3.0", "-1.0 (+2.0 s)"]
    assert energies[2].endswith(" %)")
    note = comparison_note(compared)
    assert note.startswith("In brackets: change against close_up, no per cents where")
    assert "(delay at the last station)" in note
    report = report_text("Example", runs, summary, {}, ())
    assert "| -1.0 (+2.0 s) |" in report
    assert f"{comparison_note(comparison(summary))}." in report


@pytest.mark.parametrize(
    ("formats", "images", "shown"),
    [
        (("svg",), {"time_distance.svg", "zoom.svg"}, "zoom.svg"),
        (("svg", "png"), {f"{n}.{e}" for n in ZOOMED for e in ("png", "svg")}, "zoom.png"),
        ((), set(), ""),
    ],
)
def test_only_asked_formats_are_drawn_and_shown_and_earlier_ones_are_removed(
    tmp_path: Path, formats: tuple[str, ...], images: set[str], shown: str
) -> None:
    for name in ("zoom.png", "zoom.svg"):
        (tmp_path / name).write_text("of an earlier run", encoding="utf-8")
    publish(tmp_path, scenario(), [example()], {"step_s": 0.5}, formats=formats)
    written = {file.name for file in tmp_path.iterdir() if file.suffix in {".png", ".svg"}}
    assert written == images
    report = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert ("](zoom" in report) == bool(shown)
    assert f"]({shown})" in report or not shown
