"""Why a train was slow: in words, as a table and as a figure, and true to the raw tables."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kankaku.analysis
from kankaku.analysis.asked_results import NotInResultsError, ResultsError, read_asked
from kankaku.analysis.explaining import Explainer, explain
from kankaku.analysis.publish.study_publishing import publish
from kankaku.analysis.results import Results, read_results, run_folder
from kankaku.analysis.tables.columns import rows_of
from kankaku.analysis.tables.explained import EXPLANATIONS
from kankaku.analysis.tables.run_tables import write_run
from kankaku.analysis.words import time_of_day_s
from tests.unit.asked_folder import OPERATIONS, queue_runs, queue_scenario, write_queue
from tools.explained_stops import RawStop, compare, disagreements, raw_stops


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_queue(tmp_path_factory.mktemp("queue"))


@pytest.fixture(scope="module")
def results(folder: Path) -> Results:
    return read_results(folder)


def a_stop(results: Results, controller: str = "close_up") -> tuple[str, float]:
    """Return who stood longest between stations, and a moment in the middle of it."""
    stops = rows_of(results.run(controller).interstation_stops)
    longest = max(stops, key=lambda stop: stop["duration_s"])
    return longest["train"], longest["start_s"] + longest["duration_s"] / 2.0


def test_random_stops_of_all_controllers_are_explained_as_the_raw_tables_have_them(
    folder: Path,
) -> None:
    stops, wrong = compare(folder)
    assert stops >= 6
    assert not wrong


def test_who_compares_sees_a_wrong_explanation(folder: Path, results: Results) -> None:
    stop = next(stop for stop in raw_stops(folder) if stop.reason == "train_ahead")
    found = explain(results, stop.train, stop.time_s, stop.controller)
    (row, *_) = rows_of(found.table)
    assert disagreements(stop, row, found.text) == []
    for other in (
        stop._replace(ahead="T9"),
        stop._replace(limit_m=stop.limit_m + 7.0),
        stop._replace(front_m=stop.front_m - 7.0),
        stop._replace(reason="plan"),
        stop._replace(ahead_m=stop.ahead_m + 7.0),
    ):
        assert isinstance(other, RawStop)
        assert disagreements(other, row, found.text)


def test_the_words_tell_where_why_since_when_and_the_cost(results: Results) -> None:
    text = explain(results, *a_stop(results)).text
    assert text.startswith("Under close up, train T2 stood at ")
    for part in (
        "between West and East",
        "It had come to a stand at 07:0",
        "It was bound by the end of its authority at ",
        "behind train T1, since 07:0",
        "Ahead, train T1 was at its platform at East",
        "Train T1 overstayed by 150 s at East",
        "from the overstay of train T1 at East",
        "On that leg it lost ",
        "it arrived at East at ",
    ):
        assert part in text


def test_every_controller_has_a_row_and_a_paragraph(results: Results) -> None:
    found = explain(results, *a_stop(results), "two_stage")
    assert found.table["controller"].tolist() == ["two_stage", "close_up", "eco"]
    assert list(found.table.columns) == [column.name for column in EXPLANATIONS]
    assert set(found.texts) == set(OPERATIONS)
    assert str(found) == found.texts["two_stage"]


def test_the_chain_leads_through_standing_trains_to_the_overstay(results: Results) -> None:
    stops = rows_of(results.run("close_up").remaining_stops)
    deep = max(stops, key=lambda stop: stop["links"])
    assert deep["links"] >= 1
    row = explain(results, deep["train"], deep["start_s"]).table.iloc[0]
    chain = row["chain"].split(" < ")
    assert (chain[0], chain[-1]) == (deep["cause"], deep["first_cause"])
    assert (row["origin_train"], row["origin_station"]) == ("T1", "east")


def test_a_dwelling_train_is_told_with_its_own_overstay(results: Results) -> None:
    calls = results.run("close_up").calls
    arrival_s = float(
        calls[(calls["train"] == "T1") & (calls["station"] == "east")].arrival_s.iloc[0]
    )
    text = explain(results, "T1", arrival_s + 60.0).text
    assert "was at its platform at East" in text
    assert "and an overstay of 150 s" in text


def test_a_running_train_that_nobody_hinders_has_no_chain(results: Results) -> None:
    calls = results.run("close_up").calls
    left_s = float(calls["departure_s"].iloc[0])
    found = explain(results, "T1", left_s + 20.0)
    assert found.table["chain"].iloc[0] == ""
    assert "nobody ahead was in its way" in found.text


def test_a_moment_is_said_as_people_do(results: Results) -> None:
    train, time_s = a_stop(results)
    clock = f"{int(time_s // 3600)}:{int(time_s // 60 % 60):02d}:{int(time_s % 60):02d}"
    assert explain(results, train.lower(), clock).table["train"].iloc[0] == train
    assert time_of_day_s("7:36") == 27_360.0
    assert time_of_day_s(" 07:36:20.5 ") == 27_380.5
    assert time_of_day_s("24:10") == 87_000.0
    assert [time_of_day_s(text) for text in ("7", "7:60", "07:36:60", "noon")] == [None] * 4


def test_a_minute_means_when_the_train_was_slowest_in_it(results: Results) -> None:
    train, stood_s = a_stop(results)
    minute_s = stood_s - stood_s % 60.0
    samples = results.run("close_up").trajectory
    own = samples[samples["train"].eq(train) & samples["time_s"].between(minute_s, minute_s + 59.9)]
    at = f"{int(minute_s // 3600):02d}:{int(minute_s // 60 % 60):02d}"
    row = explain(results, train, at).table.iloc[0]
    assert row["state"] == "between_stations"
    assert row["time_s"] == own["time_s"].iloc[int(own["speed_mps"].argmin())]
    assert explain(results, train, f"{at}:00").table["time_s"].iloc[0] == minute_s
    # Who made a stop all the minute is asked about its begin.
    calls = results.run("close_up").calls
    longest = calls.iloc[int((calls["departure_s"] - calls["arrival_s"]).argmax())]
    minute_s = 60.0 * np.ceil(longest["arrival_s"] / 60.0)
    assert longest["departure_s"] > minute_s + 60.0
    at = f"{int(minute_s // 3600):02d}:{int(minute_s // 60 % 60):02d}"
    assert explain(results, longest["train"], at).table["time_s"].iloc[0] == minute_s


def test_after_midnight_the_clock_of_the_run_goes_on(results: Results) -> None:
    later_s = 86_400.0 - 25_200.0
    ends = ("time_s", "start_s", "arrival_s", "departure_s")
    runs = []
    for run in results.runs:
        moved: dict[str, Any] = {}
        for name, frame in run.frames.items():
            times = [column for column in map(str, frame.columns) if column.endswith(ends)]
            moved[name] = frame.assign(**{column: frame[column] + later_s for column in times})
        runs.append(replace(run, **moved))
    shifted = replace(results, runs=tuple(runs))
    train, time_s = a_stop(results)
    found = explain(shifted, train, time_s - 25_200.0).table.iloc[0]
    assert found["time_s"] == pytest.approx(time_s + later_s)


@pytest.mark.parametrize(
    ("train", "at", "controller", "told"),
    [
        ("T99", "07:02", None, "train: there is no 'T99'; allowed: "),
        ("T2", "half past", None, "'half past' is no time of day; allowed: 07:36"),
        ("T2", float("nan"), None, "is no time of day"),
        ("T2", 1e300, None, "is no time of day"),
        ("T2", "12:00", None, "train T2 was not on the line at 12:00:00; allowed: from 07:0"),
        ("T2", "07:02", "closeup", "did you mean that"),
    ],
)
def test_what_the_results_do_not_hold_is_refused(
    results: Results, train: str, at: str | float, controller: str | None, told: str
) -> None:
    with pytest.raises(NotInResultsError, match="allowed") as refusal:
        explain(results, train, at, controller)
    assert told in str(refusal.value)


def test_without_trajectories_nothing_can_be_explained(folder: Path) -> None:
    with pytest.raises(ResultsError, match="without trajectories"):
        explain(read_results(folder, trajectories=False), "T2", "07:02")


def test_seeds_are_asked_one_at_a_time(results: Results) -> None:
    second = replace(results.runs[0], seed=2)
    both = replace(results, runs=(*results.runs, second))
    assert len(Explainer(both).explain("T2", "07:02").found) == 3
    assert len(Explainer(both, seed=2).explain("T2", "07:02").found) == 1
    with pytest.raises(NotInResultsError, match="there is no '3'"):
        Explainer(both, seed=3)


def test_the_figure_shows_the_train_its_chain_and_what_bound_it(results: Results) -> None:
    train, time_s = a_stop(results)
    figure = explain(results, train, time_s).figure()
    diagram, speeds, ribbon = figure.axes
    labels = [line.get_label() for line in diagram.lines]
    assert {"train T2", "train T1", "its end of authority"} <= set(labels)
    assert {"T1", "T2"} <= {text.get_text() for text in diagram.texts}
    assert max(np.asarray(speeds.lines[0].get_ydata())) > 30.0
    assert len(ribbon.patches) > 2
    named = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "bound by: train ahead" in named
    colours = [
        line.get_color() for line in diagram.lines if str(line.get_label()).startswith("train")
    ]
    assert len(set(colours)) == len(colours)


def test_the_public_face_offers_it(folder: Path) -> None:
    results = kankaku.read_results(folder)
    assert "T2" in kankaku.explain(results, *a_stop(results)).text
    assert kankaku.analysis.explain is kankaku.explain


def test_results_with_a_run_missing_are_asked_without_it(tmp_path: Path) -> None:
    whole = write_queue(tmp_path / "queue")
    (whole / "two_stage").rename(tmp_path / "elsewhere")
    asked = read_asked(whole)
    assert asked.results.controllers == ("close_up", "eco")
    assert asked.notes == ("two_stage, seed 1: its folder two_stage is missing",)
    (whole / "eco" / "trajectory.parquet").unlink()
    assert read_asked(whole).results.controllers == ("close_up",)
    assert read_asked(whole, trajectories=False).results.controllers == ("close_up", "eco")
    with pytest.raises(ResultsError, match="holds no run any more"):
        read_asked(whole, controllers=["two_stage"])


def test_of_several_seeds_the_first_one_is_asked_or_the_one_that_is_named(tmp_path: Path) -> None:
    runs = [replace(run, seed=seed) for run in queue_runs() for seed in (1, 2)]
    for one in runs:
        write_run(one, run_folder(tmp_path, one.controller, one.seed, seeds=2))
    publish(tmp_path, queue_scenario(), runs, {}, formats=())
    for wanted, told in ((None, 1), (2, 2)):
        found = read_asked(tmp_path, seed=wanted).results
        assert [(run.controller, run.seed) for run in found.runs] == [
            (name, told) for name in OPERATIONS
        ]
    assert len(read_asked(tmp_path, every_seed=True).results.runs) == 6
    with pytest.raises(NotInResultsError, match="there is no '3'; allowed: 1, 2"):
        read_asked(tmp_path, seed=3)
