"""Who is better in what, and the verdict in a sentence."""

from collections.abc import Mapping

import pandas as pd
import pytest

from kankaku.analysis.tables.columns import rows_frame, rows_of
from kankaku.analysis.tables.compare import comparison
from kankaku.analysis.tables.summary import SUMMARY
from kankaku.analysis.tables.verdict import (
    Mark,
    competing_controllers,
    mark_of,
    marked,
    verdict,
)
from kankaku.analysis.texts.verdict_texts import safety_text, verdict_text

BASE = {"interstation_stop_time_s": 600.0, "mean_arrival_delay_s": 30.0, "energy_net_kwh": 1000.0}
FOUND: dict[str, dict[str, float]] = {
    "plain": {},
    "early": {"interstation_stop_time_s": 100.0, "mean_arrival_delay_s": 30.1},
    "quick": {"interstation_stop_time_s": 500.0, "mean_arrival_delay_s": 20.0},
    "thrifty": {"interstation_stop_time_s": 700.0, "energy_net_kwh": 800.0},
    "oracle": {"interstation_stop_time_s": 1.0, "mean_arrival_delay_s": 1.0},
}


def morning(
    found: Mapping[str, Mapping[str, float]] = FOUND, *, seeds: int = 1, noise: float = 0.0
) -> pd.DataFrame:
    zero: dict[str, object] = {
        column.name: "" if column.dtype == "str" else 0 for column in SUMMARY
    }
    rows = [
        {**zero, "trains": 2, "trains_completed": 2, "controller": name, "seed": seed, **BASE}
        | {key: value + noise * seed * (name != "plain") for key, value in own.items()}
        for name, own in found.items()
        for seed in range(seeds)
    ]
    return rows_frame(rows, SUMMARY)


def test_the_sentence_names_who_stands_least_and_what_it_costs() -> None:
    told = verdict_text(verdict(morning(), ["oracle"]))
    assert told.startswith("early stands least between stations (100.0 s, -83.3 % against plain)")
    assert "it costs no delay and takes as much energy." in told
    assert "Least delayed is quick (20.0 s, -33.3 %)." in told
    assert "Least net energy takes thrifty (800.0 kWh, -20.0 %)." in told
    assert told.endswith("thrifty stands most (700.0 s).")
    assert "oracle" not in told


def test_the_same_is_said_in_japanese() -> None:
    told = verdict_text(verdict(morning(), ["oracle"]), "ja")
    assert "駅間停車が最も少ないのは early(100.0 s、plain 比 -83.3 %)" in told


def test_who_costs_something_is_said_to() -> None:
    found = {"plain": {}, "slow": {"interstation_stop_time_s": 0.0, "mean_arrival_delay_s": 33.0}}
    assert "it raises the mean arrival delay by 3.0 s" in verdict_text(verdict(morning(found)))


def test_a_baseline_that_is_best_is_told_as_such() -> None:
    found: dict[str, dict[str, float]] = {"plain": {}, "worse": {"interstation_stop_time_s": 700.0}}
    told = verdict_text(verdict(morning(found)))
    assert told.startswith("No controller stands less between stations than plain (600.0 s).")


def test_an_unsafe_controller_is_never_best() -> None:
    summary = morning()
    summary.loc[summary["controller"] == "early", "violations"] = 1
    found = verdict(summary, ["oracle"])
    assert found.stops is not None
    assert found.stops.controller == "quick"
    assert "VIOLATED under early" in safety_text(found)


def test_who_left_trains_under_way_is_told_and_not_best() -> None:
    summary = morning()
    summary.loc[summary["controller"] == "early", "trains_completed"] = 1
    found = verdict(summary, ["oracle"])
    assert "early" not in found.competing
    assert safety_text(found).endswith("Trains were still under way at the end under early.")


def test_with_nobody_to_recommend_that_is_the_verdict() -> None:
    summary = morning()
    summary["violations"] = 1
    assert "No controller can be recommended" in verdict_text(verdict(summary))


def test_one_controller_is_told_by_its_figures() -> None:
    told = verdict_text(verdict(morning({"plain": {}})))
    assert told.startswith("plain: trains stand 600.0 s between stations")


def test_names_in_braces_are_told_as_they_are() -> None:
    found: dict[str, dict[str, float]] = {"{0}": {}, "{mean}": {"interstation_stop_time_s": 1.0}}
    assert "{mean} stands least" in verdict_text(verdict(morning(found)))
    assert "against {0}" in verdict_text(verdict(morning(found)))


def test_marks_need_a_change_that_counts() -> None:
    compared = comparison(morning(), ["interstation_stop_time_s", "mean_arrival_delay_s"])
    rows = marked(compared, competing_controllers(morning(), ["oracle"]))
    marks = {(row["controller"], row["indicator"]): row["mark"] for row in rows}
    assert marks["early", "interstation_stop_time_s"] is Mark.BETTER
    assert marks["thrifty", "interstation_stop_time_s"] is Mark.WORSE
    assert marks["early", "mean_arrival_delay_s"] is Mark.ALIKE
    assert marks["plain", "interstation_stop_time_s"] is Mark.NONE
    best = {(row["controller"], row["indicator"]) for row in rows if row["best"]}
    assert best == {("early", "interstation_stop_time_s"), ("quick", "mean_arrival_delay_s")}


def test_an_interval_that_holds_nothing_is_alike() -> None:
    summary = morning(
        {"plain": {}, "noisy": {"interstation_stop_time_s": 500.0}}, seeds=3, noise=90.0
    )
    (_, row) = rows_of(comparison(summary, ["interstation_stop_time_s"]))
    assert abs(row["difference"]) < row["confidence_95"]
    assert mark_of(row) is Mark.ALIKE


def test_more_speed_is_better() -> None:
    found = {"plain": {"scheduled_speed_kmh": 30.0}, "fast": {"scheduled_speed_kmh": 33.0}}
    (_, row) = rows_of(comparison(morning(found), ["scheduled_speed_kmh"]))
    assert mark_of(row) is Mark.BETTER


def test_of_nothing_there_is_no_verdict() -> None:
    with pytest.raises(ValueError, match="no run"):
        verdict(morning({}))
