"""A sweep's tables: intervals behind the swept train, and what they come down to."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from kankaku.analysis.publish.study_publishing import STUDY_RESULTS, publish
from kankaku.analysis.results import read_results, run_folder
from kankaku.analysis.tables.columns import typed_frame
from kankaku.analysis.tables.compare import comparison
from kankaku.analysis.tables.network_tables import NETWORK_TABLES
from kankaku.analysis.tables.run_tables import RunTables, run_tables, write_run
from kankaku.analysis.tables.summary import summary_frame
from kankaku.analysis.tables.sweep import (
    MEASURED,
    headway_margin_s,
    measured_frame,
    read_intervals,
    read_sweep,
    shortenings_s,
    shown_delays_s,
    sweep_frame,
)
from kankaku.analysis.texts.sweep_texts import sweep_texts
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.scenario import Published, Scenario, Sweep
from kankaku.railway.step.records import Unfinished, Violation
from kankaku.testing.example_lines import make_scenario
from tests.records import READY_S, make_record, punctual, run_times_s, three_station_world

SWEEP = Sweep("T1", "mid", (0.0, 10.0, 20.0))
PUBLISHED = Published("A table, 2020", {"shortest_interval_s": 51.1, "headway_margin_s": 5.0})
DELAYS_S = np.arange(31.0)
BOOKED_S = 60.0


def frame(delays_s: FloatArray = DELAYS_S, **intervals_s: FloatArray) -> pd.DataFrame:
    """Return the table of controllers whose next train is booked 60 s behind."""
    return pd.concat(
        [
            typed_frame(
                {
                    "controller": [name] * delays_s.size,
                    "initial_delay_s": delays_s,
                    "interval_s": own_s,
                    "arrival_s": READY_S + delays_s + own_s,
                },
                MEASURED,
            )
            for name, own_s in intervals_s.items()
        ],
        ignore_index=True,
    )


def at_least(shortest_s: float, delays_s: FloatArray = DELAYS_S) -> FloatArray:
    """Return intervals that shrink with the delay down to the shortest possible."""
    return np.maximum(BOOKED_S - delays_s, shortest_s)


def indicators(intervals: pd.DataFrame) -> dict[str, pd.Series]:
    table = sweep_frame(intervals, {})
    return {
        str(name): own.set_index("indicator")["value"] for name, own in table.groupby("controller")
    }


def swept_run(delay_s: float, controller: str = "close_up", late_s: float = 0.0) -> RunTables:
    """Return a run in which T1 leaves mid late by the delay, and T2 arrives there late."""
    world = three_station_world(trains=3)
    arrival_s, departure_s = punctual(world)
    departure_s[0, 1] += delay_s
    arrival_s[1, 1] += late_s
    record = make_record(world, arrival_s, departure_s, controller=controller)
    return run_tables(record, run_times_s(world, 90.0, 110.0), initial_delay_s=delay_s)


def swept_scenario() -> Scenario:
    world = three_station_world()
    plain = make_scenario(world.line, world.timetable.services)
    return replace(plain, sweep=SWEEP, published=PUBLISHED)


def publish_all(folder: Path, runs: list[RunTables]) -> None:
    for run in runs:
        place = run_folder(folder, run.controller, run.seed, run.initial_delay_s, seeds=1)
        write_run(run, place)
    publish(folder, swept_scenario(), runs, {})


def all_runs() -> list[RunTables]:
    return [
        swept_run(delay_s, controller, late_s=max(delay_s - margin_s, 0.0))
        for controller, margin_s in {"close_up": 10.0, "atd": 15.0}.items()
        for delay_s in SWEEP.delays_s
    ]


def test_the_interval_runs_from_the_swept_train_to_the_next_at_the_same_track() -> None:
    # T1 is booked to leave mid at 160 s, T2 to arrive there at 250 s.
    table = measured_frame([swept_run(0.0), swept_run(20.0, late_s=5.0)], SWEEP)
    assert table["initial_delay_s"].tolist() == [0.0, 20.0]
    assert table["interval_s"].tolist() == [90.0, 75.0]
    assert table["arrival_s"].tolist() == [READY_S + 250.0, READY_S + 255.0]


def test_a_next_train_that_never_arrives_leaves_the_interval_empty() -> None:
    run = swept_run(0.0)
    first = run.calls[run.calls["train"] == "T1"]
    table = measured_frame([replace(run, calls=first)], SWEEP)
    assert table[["interval_s", "arrival_s"]].isna().to_numpy().all()


def test_the_shortest_interval_is_the_least_over_the_delays() -> None:
    found = indicators(frame(close_up=at_least(55.0), atd=at_least(51.1)))
    assert found["close_up"]["shortest_interval_s"] == 55.0
    assert found["atd"]["shortest_interval_s"] == 51.1


def test_the_shortening_is_taken_at_the_same_delay_and_the_baseline_has_none() -> None:
    rising = at_least(55.0) + np.where(DELAYS_S > 20.0, 0.2, 0.0)
    found = indicators(frame(close_up=rising, atd=at_least(51.1)))
    assert found["close_up"]["greatest_shortening_s"] == 0.0
    assert found["atd"]["greatest_shortening_s"] == pytest.approx(4.1)


def test_delays_that_only_one_controller_ran_shorten_nothing() -> None:
    both = frame(close_up=at_least(55.0), atd=at_least(51.1))
    interrupted = both[(both["controller"] == "close_up") | (both["initial_delay_s"] <= 7.0)]
    baseline, own = (interrupted[interrupted["controller"] == name] for name in ("close_up", "atd"))
    assert shortenings_s(baseline, own).tolist() == [0.0] * 6 + [1.0, 2.0]


def test_the_margin_lies_where_the_next_train_arrives_a_tenth_of_a_second_later() -> None:
    # Undisturbed up to 5.4 s, then late by what goes beyond: 0.6 s at 6 s.
    arrival_s = READY_S + np.maximum(DELAYS_S - 5.4, 0.0)
    assert headway_margin_s(DELAYS_S, arrival_s) == pytest.approx(5.0 + 0.1 / 0.6, abs=1e-3)
    turned = headway_margin_s(DELAYS_S[::-1], arrival_s[::-1])
    assert turned == pytest.approx(5.0 + 0.1 / 0.6, abs=1e-3)


def test_a_tenth_of_a_second_itself_is_no_disturbance() -> None:
    delays_s = np.array([0.0, 1.0, 2.0, 3.0])
    assert headway_margin_s(delays_s, READY_S + np.array([0.0, 0.1, 0.1, 0.2])) == 2.0


def test_a_margin_beyond_the_sweep_is_its_greatest_delay() -> None:
    assert headway_margin_s(DELAYS_S, np.full(DELAYS_S.size, READY_S)) == 30.0


@pytest.mark.parametrize(
    ("delays_s", "late_s"),
    [([0.0], [0.0]), ([0.0, 1.0], [0.0, 1.0]), ([0.0, 1.0], [0.0, np.nan])],
    ids=["one delay", "the second delay disturbs", "one arrival"],
)
def test_a_sweep_that_does_not_show_the_margin_leaves_it_empty(
    delays_s: list[float], late_s: list[float]
) -> None:
    assert np.isnan(headway_margin_s(np.array(delays_s), READY_S + np.array(late_s)))


def test_published_values_stand_beside_the_methods_and_the_margin_beside_all() -> None:
    table = sweep_frame(
        frame(close_up=at_least(55.0), atd=at_least(51.1)),
        {"shortest_interval_s": 51.1, "headway_margin_s": 5.0},
    )
    beside = table.set_index(["controller", "indicator"])["published"]
    assert np.isnan(beside["close_up", "shortest_interval_s"])
    assert beside["atd", "shortest_interval_s"] == 51.1
    assert beside["close_up", "headway_margin_s"] == beside["atd", "headway_margin_s"] == 5.0
    assert beside[:, "greatest_shortening_s"].isna().all()


def test_the_table_of_texts_has_a_row_per_indicator_and_the_published_values_last() -> None:
    intervals = frame(close_up=at_least(55.0), atd=at_least(51.1))
    header, rows = sweep_texts(sweep_frame(intervals, {"shortest_interval_s": 51.1}))
    assert header == ["indicator", "close_up", "atd", "published"]
    assert rows[0] == ["shortest interval [s]", "55.0", "51.1", "51.1"]
    assert rows[1] == ["greatest shortening [s]", "0.0", "3.9", "-"]
    header, rows = sweep_texts(sweep_frame(intervals, {}))
    assert header == ["indicator", "close_up", "atd"]
    assert [len(row) for row in rows] == [3, 3, 3]


def test_five_delays_are_drawn_evenly_between_smallest_and_greatest() -> None:
    ran = [(name, delay_s) for name in ("a", "b") for delay_s in DELAYS_S.tolist()]
    assert shown_delays_s(ran) == (0.0, 7.0, 15.0, 22.0, 30.0)
    assert shown_delays_s([("a", 3.0), ("a", 1.0)]) == (1.0, 3.0)
    assert shown_delays_s([("a", 0.0), ("b", 0.0)]) == (0.0,)


def test_only_delays_that_every_controller_ran_are_drawn_if_there_are_any() -> None:
    assert shown_delays_s([("a", 0.0), ("a", 1.0), ("a", 2.0), ("b", 1.0)]) == (1.0,)
    assert shown_delays_s([("a", 0.0), ("a", 1.0), ("b", 2.0)]) == (0.0, 1.0)


def test_runs_are_compared_at_the_same_initial_delay() -> None:
    runs = [swept_run(20.0), swept_run(0.0), swept_run(0.0, "atd", late_s=6.0)]
    row = comparison(summary_frame(runs), ["shortest_interval_s"]).iloc[1]
    assert (row["pairs"], row["difference"]) == (1, 0.0)
    row = comparison(summary_frame(runs), ["mean_arrival_delay_s"]).iloc[1]
    # One of the six calls that are not origins is 6 s late.
    assert row["difference"] == 1.0


def test_a_published_sweep_reads_back(tmp_path: Path) -> None:
    runs = all_runs()
    publish_all(tmp_path, runs)
    folders = {item.name for item in (tmp_path / "atd").iterdir()}
    assert folders == {"delay_000.0s", "delay_010.0s", "delay_020.0s"}
    results = read_results(tmp_path)
    assert results.summary["initial_delay_s"].tolist() == [0.0, 10.0, 20.0] * 2
    for run in runs:
        read = results.run(run.controller, initial_delay_s=run.initial_delay_s)
        pd.testing.assert_frame_equal(read.calls, run.calls)
        assert read.initial_delay_s == run.initial_delay_s
    assert results.intervals is not None
    assert results.sweep is not None
    measured = measured_frame(runs, SWEEP).drop(columns="arrival_s")
    pd.testing.assert_frame_equal(results.intervals, measured)
    pd.testing.assert_frame_equal(read_intervals(tmp_path), results.intervals)
    pd.testing.assert_frame_equal(read_sweep(tmp_path), results.sweep)
    assert set(results.columns["table"]) >= {"intervals", "sweep", "calls"}
    with pytest.raises(KeyError, match="initial delays"):
        results.run("atd", initial_delay_s=5.0)


def test_one_run_left_of_an_interrupted_sweep_can_be_read(tmp_path: Path) -> None:
    publish_all(tmp_path, [swept_run(0.0)])
    read = read_results(tmp_path)
    pd.testing.assert_frame_equal(read.run("close_up").calls, swept_run(0.0).calls)
    assert read.sweep is not None
    assert read.sweep.set_index("indicator")["value"].isna()["headway_margin_s"]


def test_a_sweep_leaves_no_file_that_is_not_declared(tmp_path: Path) -> None:
    publish_all(tmp_path, all_runs())
    of_others = {f"{table}.csv" for table in NETWORK_TABLES} | {
        f"{figure}.{kind}" for figure in ("track_plan", "pareto") for kind in ("png", "svg")
    }
    found = {item.name for item in tmp_path.iterdir() if item.is_file()}
    # PDF is written when asked for.
    declared = {name for name in STUDY_RESULTS.files if not name.endswith(".pdf")}
    assert found == declared - of_others


def test_without_a_sweep_there_are_no_intervals(tmp_path: Path) -> None:
    run = swept_run(0.0)
    write_run(run, run_folder(tmp_path, run.controller, run.seed, seeds=1))
    publish(tmp_path, replace(swept_scenario(), sweep=None, published=None), [run], {})
    results = read_results(tmp_path)
    assert (results.intervals, results.sweep) == (None, None)
    assert not {"intervals", "sweep"} & set(results.columns["table"])


def test_the_report_puts_ours_beside_the_published_values(tmp_path: Path) -> None:
    publish_all(tmp_path, all_runs())
    report = (tmp_path / "report.md").read_text("utf-8")
    # The baseline is disturbed from 10 s on; the other one at 20 s by 5 s, and 0.1 / 5 of 10 s.
    assert "| headway margin [s] | 10.1 | 10.2 | 5.0 |" in report
    assert "| greatest shortening [s] | 0.0 | 5.0 | - |" in report
    assert "Published: A table, 2020." in report
    assert "by 3 initial delays from 0 s to 20 s" in report


def test_the_report_names_the_delay_of_a_run_that_is_not_safe(tmp_path: Path) -> None:
    world = three_station_world(trains=3)
    arrival_s, departure_s = punctual(world)
    arrival_s[2, 2] = departure_s[2, 2] = np.nan
    overrun = Violation(READY_S, 2, "authority", 1.0, "T3 overran")
    late = Unfinished(2, "running", "", 2000.0, "T3 was still running at km 2.000")
    record = make_record(world, arrival_s, departure_s, violations=(overrun,))
    unsafe = run_tables(replace(record, unfinished=(late,)), run_times_s(world, 90.0, 110.0))
    publish_all(tmp_path, [unsafe, swept_run(10.0)])
    report = (tmp_path / "report.md").read_text("utf-8")
    assert "**close_up, seed 1, initial delay 0.0 s: 1 violations of safety" in report
    assert "- close_up, seed 1, initial delay 0.0 s: T3 was still running at km 2.000" in report
