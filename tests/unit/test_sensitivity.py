"""The sensitivity study: what each assumption changes, the journal, effects, figure and tables."""

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.patches import Rectangle

from kankaku.analysis.figures.sensitivity_diagram import BAR_HEIGHT, Moved, sensitivity_figure
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.timetable import Call
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.shipped import folder_of
from tools.sensitivity.assumptions import ASSUMPTIONS, CONTROLLERS, changed
from tools.sensitivity.conclusion import CHANGES, conclusion, conclusions
from tools.sensitivity.journal import Journal, Measured
from tools.sensitivity.points import Task, keys, measured
from tools.sensitivity.texts import (
    assumptions_table,
    effects_table,
    plain_effects,
    plain_ranges,
    ranges,
)

BY_KEY = {one.key: one for one in ASSUMPTIONS}
TOUCHED = {
    "delay_scale": {"dwell_delays.scale"},
    "doubted_factor": {"timetable.delay_scale"},
    "cap": {"dwell_delays.cap_s"},
    "correlation": {"dwell_delays.trip_correlation"},
    "recovery": {"timetable.minimum_dwell_s"},
    "station_brake": {"driving.station_brake_mps2"},
    "hurry": {"driving.late_after_s"},
    "brake_rise": {"train_types.brake_build_up_s", "train_types.jerk_mps3"},
    "margin": {"controllers.protection_options"},
    "regeneration": {"train_types.supply"},
}


@pytest.fixture(scope="module")
def rush_hour() -> Scenario:
    return changed(load(folder_of("rush_hour")), ())


def calls_of(scenario: Scenario) -> list[Call]:
    return [call for service in scenario.timetable.services for call in service.calls]


def differences(one: Scenario, other: Scenario) -> set[str]:
    """Return the fields that differ, of parts of the scenario and of what these parts hold."""
    found = set()
    parts: dict[str, tuple[list[Any], list[Any]]] = {
        "dwell_delays": ([one.dwell_delays], [other.dwell_delays]),
        "driving": ([one.driving], [other.driving]),
        "controllers": (list(one.controllers), list(other.controllers)),
        "train_types": (list(one.train_types.values()), list(other.train_types.values())),
        "timetable": (calls_of(one), calls_of(other)),
    }
    for field in fields(one):
        if getattr(one, field.name) == getattr(other, field.name):
            continue
        ours, theirs = parts[field.name]
        for part, its in zip(ours, theirs, strict=True):
            names = (inner.name for inner in fields(part))
            unequal = {name for name in names if getattr(part, name) != getattr(its, name)}
            found |= {f"{field.name}.{name}" for name in unequal}
    return found


@pytest.mark.parametrize("key", list(TOUCHED))
def test_an_assumption_changes_what_it_says_and_nothing_else(rush_hour: Scenario, key: str) -> None:
    assumption = BY_KEY[key]
    ends = [assumption.changed(rush_hour, value) for value in (assumption.low, assumption.high)]
    assert differences(*ends) == TOUCHED[key]
    assert differences(rush_hour, ends[1]) <= TOUCHED[key]
    if key not in {"delay_scale", "recovery"}:
        said = [assumption.said(end) for end in ends]
        assert said == pytest.approx([assumption.low, assumption.high])


def test_ten_assumptions_have_a_range_around_what_the_scenario_says(rush_hour: Scenario) -> None:
    assert set(BY_KEY) == set(TOUCHED)
    for one in ASSUMPTIONS:
        assert one.low <= one.said(rush_hour) <= one.high, one.key
        assert one.value_at(0.0) == one.low
        assert one.value_at(1.0) == one.high
        assert one.reason


def test_delays_are_scaled_from_what_the_scenario_says(rush_hour: Scenario) -> None:
    doubled = replace(rush_hour, dwell_delays=replace(rush_hour.dwell_delays, scale=2.0))
    assert BY_KEY["delay_scale"].changed(doubled, 1.25).dwell_delays.scale == 2.5


def test_minimum_dwells_stay_within_what_is_booked(rush_hour: Scenario) -> None:
    for shift_s in (-10.0, 5.0, 300.0, -300.0):
        shifted = BY_KEY["recovery"].changed(rush_hour, shift_s)
        for ours, its in zip(rush_hour.timetable.services, shifted.timetable.services, strict=True):
            assert its.calls[0] == ours.calls[0]
            for call, moved in zip(ours.calls[1:], its.calls[1:], strict=True):
                booked_s = call.departure_s - call.arrival_s
                least_s, most_s = 5.0, max(booked_s, call.minimum_dwell_s)
                expected_s = min(max(call.minimum_dwell_s + shift_s, least_s), most_s)
                assert moved.minimum_dwell_s == expected_s


def test_a_brake_that_is_whole_at_once_has_no_jerk_limit(rush_hour: Scenario) -> None:
    (kind,) = BY_KEY["brake_rise"].changed(rush_hour, 0.0).train_types.values()
    assert kind.brake_rise_s == 0.0
    (kind,) = BY_KEY["brake_rise"].changed(rush_hour, 1.5).train_types.values()
    assert kind.brake_rise_s == pytest.approx(1.5)


def test_all_assumptions_move_at_once_and_only_two_controllers_run(rush_hour: Scenario) -> None:
    moved = changed(rush_hour, [1.0] * len(ASSUMPTIONS))
    assert differences(rush_hour, moved) == set().union(*TOUCHED.values())
    assert tuple(spec.name for spec in moved.controllers) == CONTROLLERS
    with pytest.raises(ValueError, match="shorter"):
        changed(rush_hour, [1.0])


def test_a_task_is_known_by_all_that_it_depends_on() -> None:
    places = (0.0,) * len(ASSUMPTIONS)
    tasks = [Task((), 1), Task((), 2), Task(places, 1), Task((*places[:-1], 1.0), 1)]
    found = keys(tasks)
    assert len(set(found.values())) == len(tasks)
    assert keys(tasks[:1])[tasks[0]] == found[tasks[0]]


def values(stop_s: float, delay_s: float, energy_kwh: float) -> dict[str, float]:
    return {
        "interstation_stop_time_s": stop_s,
        "mean_arrival_delay_s": delay_s,
        "energy_net_kwh": energy_kwh,
        "trains": 40.0,
        "trains_completed": 40.0,
        "violations": 0.0,
    }


def pair(saved_s: float = 300.0) -> Measured:
    return {
        "close_up": values(500.0, 20.0, 10000.0),
        "two_stage": values(500.0 - saved_s, 21.0, 9900.0),
    }


def test_a_journal_keeps_what_was_noted(tmp_path: Path) -> None:
    file = tmp_path / "runs.jsonl"
    Journal(file).note("a", pair())
    second = Journal(file)
    assert "a" in second
    assert "b" not in second
    second.note("b", pair(10.0))
    assert Journal(file)["a"] == pair()
    assert Journal(file)["b"] == pair(10.0)


def test_a_line_that_a_kill_has_torn_is_forgotten_and_no_other(tmp_path: Path) -> None:
    file = tmp_path / "runs.jsonl"
    Journal(file).note("a", pair())
    whole = file.read_bytes()
    file.write_bytes(whole + whole[: len(whole) // 2])
    journal = Journal(file)
    journal.note("b", pair(10.0))
    assert Journal(file)["a"] == pair()
    assert Journal(file)["b"] == pair(10.0)
    assert len(file.read_text(encoding="utf-8").splitlines()) == 2


def test_a_conclusion_is_told_of_means_over_seeds() -> None:
    found = conclusion([pair(300.0), pair(100.0)])
    assert found["close_up_stop_s"] == 500.0
    assert found["stop_s"] == -200.0
    assert found["stop_pct"] == pytest.approx(-40.0)
    assert found["delay_s"] == 1.0
    assert found["energy_pct"] == pytest.approx(-1.0)
    assert found["harmed"] == 0


def test_where_nobody_stands_there_are_no_per_cents_of_it() -> None:
    still = {name: {**row, "interstation_stop_time_s": 0.0} for name, row in pair().items()}
    found = conclusion([still])
    assert found["stop_s"] == 0.0
    assert np.isnan(found["stop_pct"])


def test_runs_that_are_harmed_are_counted() -> None:
    harmed = pair()
    harmed["two_stage"]["violations"] = 1.0
    stranded = pair()
    stranded["close_up"]["trains_completed"] = 39.0
    assert conclusion([harmed, stranded, pair()])["harmed"] == 2


def test_a_design_moves_one_assumption_at_a_time_and_finds_what_moves_a_result() -> None:
    design = pytest.importorskip("tools.sensitivity.design", reason="SALib is an extra")
    names = list(BY_KEY)
    places = design.trajectories(names, 5, 1)
    assert places.shape == (5 * (len(names) + 1), len(names))
    assert np.array_equal(places, design.trajectories(names, 5, 1))
    steps = np.abs(np.diff(places.reshape(5, -1, len(names)), axis=1))
    assert (np.count_nonzero(steps, axis=2) == 1).all()
    assert steps.max(axis=2) == pytest.approx(design.DELTA)
    results = 3.0 * places[:, 0] - 2.0 * places[:, 1]
    told = design.effects(names, places, results, 1).set_index("assumption")
    assert told["mu"].tolist()[:3] == pytest.approx([3.0, -2.0, 0.0], abs=1e-6)
    assert told["mu_star"].tolist()[:3] == pytest.approx([3.0, 2.0, 0.0], abs=1e-6)
    results[0] = np.nan
    told = design.effects(names, places, results, 1).set_index("assumption")
    assert told["trajectories"].tolist() == [4] * len(names)
    assert told["mu_star"].tolist()[:2] == pytest.approx([3.0, 2.0], abs=1e-6)
    results[:] = np.nan
    assert design.effects(names, places, results, 1)["mu_star"].isna().all()


def test_seeds_alone_have_the_effect_that_is_told_for_them() -> None:
    design = pytest.importorskip("tools.sensitivity.design", reason="SALib is an extra")
    names = ["a", "b"]
    places = np.tile(design.trajectories(names, 5, 1), (80, 1))
    by_seed = np.random.default_rng(2).standard_normal((4, len(places)))
    less = np.array([np.delete(by_seed, seed, axis=0).mean(axis=0) for seed in range(4)])
    told = design.effects(names, places, by_seed.mean(axis=0), 1)
    noise = design.seed_noise(names, places, less)
    assert noise == pytest.approx(told["mu_star"].to_numpy(), rel=0.1)


def test_what_seeds_change_alike_at_all_points_is_no_noise() -> None:
    design = pytest.importorskip("tools.sensitivity.design", reason="SALib is an extra")
    names = ["a", "b"]
    places = design.trajectories(names, 3, 1)
    less = 5.0 * places[:, 0] + np.array([[0.0], [700.0], [-90.0]])
    assert design.seed_noise(names, places, less) == pytest.approx([0.0, 0.0], abs=1e-9)
    less[0, :] = np.nan
    assert np.isnan(design.seed_noise(names, places, less)).all()


def made_effects(first: float) -> pd.DataFrame:
    count = len(ASSUMPTIONS)
    star = first * np.arange(1.0, count + 1.0)
    columns = {
        "assumption": list(BY_KEY),
        "trajectories": 4,
        "mu": -star,
        "mu_star": star,
        "confidence_95": 0.1 * star,
        "sigma": 0.5 * star,
        "noise": 2.5 * first,
    }
    return pd.DataFrame(columns)


def test_the_figure_has_a_column_per_change_and_the_greatest_effect_on_top() -> None:
    moved = [
        Moved(f"change {number}", made_effects(sign), [-5.0, -1.0], [-3.0, -2.0], -2.5)
        for number, sign in enumerate((10.0, 0.1))
    ]
    titles = {one.key: one.title for one in ASSUMPTIONS}
    figure = sensitivity_figure(moved, titles)
    assert len(figure.axes) == 4
    labels = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert labels == [one.title for one in ASSUMPTIONS]
    drawn = [patch for patch in figure.axes[0].patches if isinstance(patch, Rectangle)]
    bars = [bar for bar in drawn if bar.get_height() == BAR_HEIGHT]
    assert [bar.get_width() for bar in bars] == pytest.approx([10.0 * n for n in range(1, 11)])
    assert [np.size(line.get_xdata()) for line in figure.axes[2].lines[1:]] == [2, 2, 1]


def test_tables_fit_a_terminal_and_name_every_assumption(rush_hour: Scenario) -> None:
    effects = {one.key: made_effects(40.0) for one in CHANGES}
    design = conclusions([[pair(300.0)], [pair(-20.0)]])
    rows = ranges(design, design, conclusion([pair()]))
    for text in (plain_effects(effects), plain_ranges(rows)):
        assert max(map(len, text.splitlines())) <= 80
    lines = plain_effects(effects).splitlines()
    assert [line[:28].strip() for line in lines[1:]] == [one.title for one in reversed(ASSUMPTIONS)]
    assert ["*" in line for line in lines[1:]] == [False] * 8 + [True] * 2
    assert dict(rows)["of the points, less than 0"][0] == "1/2"
    assert dict(rows)["all assumptions moved"][0] == "-300..+20"
    assert effects_table(effects).count("\n") == len(ASSUMPTIONS) + 1
    table = assumptions_table(rush_hour)
    assert all(one.title in table and one.reason in table for one in ASSUMPTIONS)


def test_a_point_is_run_with_the_same_delays_under_both_controllers(rush_hour: Scenario) -> None:
    services = rush_hour.timetable.services[:3]
    few = replace(rush_hour, timetable=replace(rush_hour.timetable, services=services))
    found = measured(few, few.seed)
    assert set(found) == set(CONTROLLERS)
    for row in found.values():
        assert (row["trains"], row["trains_completed"], row["violations"]) == (3.0, 3.0, 0.0)
        assert row["energy_net_kwh"] > 0.0
    assert measured(few, few.seed) == found


def test_a_finished_study_is_written_again_from_its_journal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main = pytest.importorskip("tools.sensitivity.__main__", reason="SALib is an extra")
    planned = main.plan(2, 2, 1)
    tasks = [task for own in (*planned.points, *planned.repeats) for task in own]
    assert len(planned.points) == 2 * (len(ASSUMPTIONS) + 1)
    assert not set(planned.seeds) & set(planned.other_seeds[0])
    journal = Journal(tmp_path / main.RUNS_FILE)
    for task, key in keys(tasks).items():
        first = task.places[0] if task.places else 0.5
        journal.note(key, pair(300.0 - 90.0 * first))
    arguments = ["--trajectories", "2", "--seeds", "2", "--repeats", "1", "--out", str(tmp_path)]
    assert main.main(arguments) == 0
    told = capsys.readouterr()
    assert told.err.startswith("0 of ")
    top = told.out.splitlines()[1]
    assert top.startswith(ASSUMPTIONS[0].title)
    assert "90 (" in top
    table = pd.read_csv(tmp_path / "effects.csv").set_index(["change", "assumption"])
    assert table.loc[("stop_s", "delay_scale"), "mu"] == pytest.approx(90.0, abs=1e-3)
    assert table.loc["stop_s"]["noise"].tolist() == pytest.approx([0.0] * len(ASSUMPTIONS))
    written = {file.name for file in tmp_path.iterdir()}
    assert {"sensitivity.png", "assumptions.md", "effects.md", "conclusion.md"} <= written


def test_too_small_a_study_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    main = pytest.importorskip("tools.sensitivity.__main__", reason="SALib is an extra")
    with pytest.raises(SystemExit):
        main.main(["--trajectories", "1"])
    assert "--trajectories is 1; allowed: 2 or more" in capsys.readouterr().err
