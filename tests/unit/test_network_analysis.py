"""Tables, texts and figures of networks: chainage, directions, turn-backs, use of nodes."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from kankaku.analysis.figures.time_distance import time_distance_figure
from kankaku.analysis.publish.study_publishing import publish
from kankaku.analysis.results import read_results, stations_frame
from kankaku.analysis.saved_run import SavedRun, Trip
from kankaku.analysis.tables.network_tables import NETWORK_TABLES, network_tables
from kankaku.analysis.tables.node_use import Trail, busiest_hour_s
from kankaku.analysis.tables.run_tables import RunTables, run_tables, write_run
from kankaku.analysis.tables.window import busiest_window_s, within
from kankaku.railway.plan.scenario import Scenario
from kankaku.studies.capacity_study import assess_capacity
from kankaku.studies.outcomes import Study, StudyError
from tests.networks import LOOP, TERMINAL, network, run_network

LATE_S = 200.0


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Scenario:
    return network(tmp_path_factory.mktemp("terminal"), TERMINAL)


@pytest.fixture(scope="module")
def late(scenario: Scenario) -> RunTables:
    """Return a run in which r1 overstays where it begins; f1 goes on with its stock."""
    return run_tables(run_network(scenario, delays_s={"r1": {"a": LATE_S}})[0])


@pytest.fixture(scope="module")
def tables(scenario: Scenario, late: RunTables) -> dict[str, pd.DataFrame]:
    return network_tables(scenario, [late], [late])


def of(frame: pd.DataFrame, train: str) -> pd.DataFrame:
    """Return the rows of a train."""
    return frame[frame["train"] == train]


def test_places_of_falling_trains_are_chainage(late: RunTables) -> None:
    assert of(late.calls, "r1")["stop_m"].tolist() == [0.0, 2000.0]
    # Its front is where the tail was, and at the far end of the platform.
    assert of(late.calls, "f1")["stop_m"].tolist() == [1900.0, -100.0]
    samples = of(late.trajectory, "f1")
    fronts_m, ends_m = samples["front_m"].to_numpy(), samples["limit_m"].to_numpy()
    assert (fronts_m[0], fronts_m[-1]) == pytest.approx((1900.0, -100.0), abs=0.5)
    assert np.all(np.diff(fronts_m) <= 0.0)
    assert np.all(ends_m < fronts_m)


def test_tracks_are_physical_and_change_at_the_points(late: RunTables) -> None:
    assert of(late.calls, "f1")["track"].tolist() == ["p1", "out"]
    samples = of(late.trajectory, "f1")
    beyond = samples["front_m"] > 1600.0
    assert set(samples["track"][beyond]) == {"p1"}
    assert set(samples["track"][~beyond]) == {"out"}


def test_stops_between_stations_are_told_by_chainage(tmp_path: Path) -> None:
    scenario = network(tmp_path, TERMINAL)
    stops = run_tables(run_network(scenario, delays_s={"f1": {"a": 400.0}})[0]).interstation_stops
    (stop,) = of(stops, "f2").to_dict("records")
    # f1 stands at the platform with its tail at km 0; f2 comes from above.
    assert 0.0 < stop["front_m"] < 100.0
    assert stop["next_station"] == "a"


def test_late_stock_is_no_secondary_delay_of_the_train_that_takes_it_over(late: RunTables) -> None:
    calls = of(late.calls, "f1")
    assert (calls["arrival_delay_s"] > 20.0).all()
    assert calls["secondary_delay_s"].tolist() == pytest.approx([0.0, 0.0], abs=3.0)
    assert of(late.calls, "r1")["secondary_delay_s"].tolist() == pytest.approx([0.0, 0.0], abs=3.0)


def test_a_turn_back_takes_up_its_reserve_and_passes_the_rest_on(
    late: RunTables, tables: dict[str, pd.DataFrame]
) -> None:
    first, second = tables["turn_backs"].to_dict("records")
    assert (first["train"], first["next_train"], first["station"]) == ("r1", "f1", "b")
    # Booked 90 s from arrival to departure, and 60 s suffice.
    assert first["reserve_s"] == 30.0
    late_s = of(late.calls, "r1")["arrival_delay_s"].iloc[-1]
    assert first["taken_up_s"] == 30.0
    assert first["passed_on_s"] == pytest.approx(late_s - 30.0)
    assert first["departure_delay_s"] == pytest.approx(first["passed_on_s"], abs=1.5)
    assert second["passed_on_s"] + second["taken_up_s"] == max(second["arrival_delay_s"], 0.0)


def test_indicators_by_direction_add_up_to_those_by_hour(tables: dict[str, pd.DataFrame]) -> None:
    ways, hours = tables["by_direction"], tables["by_hour"]
    assert ways["direction"].tolist() == ["rising", "falling"]
    assert ways["trains"].tolist() == [2, 2]
    assert set(hours["hour"]) == {7}
    assert ways["passed_on_s"].iloc[0] == 0.0
    assert ways["passed_on_s"].iloc[1] == tables["turn_backs"]["passed_on_s"].sum() > 0.0
    for name in ("interstation_stop_time_s", "interstation_stops", "passed_on_s"):
        assert hours[name].sum() == pytest.approx(ways[name].sum())


def test_stock_that_turns_back_came_to_its_platform_once(
    late: RunTables, tables: dict[str, pd.DataFrame]
) -> None:
    use = tables["node_use"].set_index("place")
    assert use["kind"].to_dict() == dict.fromkeys(use.index, "platform") | {"x": "points"}
    passings = {"x": 4, "b p1": 1, "b p2": 1, "a in": 2, "a out": 2}
    assert use["passings"].to_dict() == passings
    occupied_s = float(use["occupied_s"]["b p1"])
    stood_s = of(late.calls, "f1")["departure_s"].iloc[0]
    stood_s -= of(late.calls, "r1")["arrival_s"].iloc[-1]
    # 110 m to come in and 110 m to go, beside the stand itself.
    assert stood_s + 20.0 < occupied_s < stood_s + 60.0
    assert use["busiest_percent"]["b p1"] == pytest.approx(occupied_s / 36.0, abs=1e-3)


def test_a_place_between_samples_is_interpolated() -> None:
    trace = Trail(np.array([0.0, 1.0, 2.0, 5.0]), np.array([10.0, 20.0, 40.0, 40.0]))
    assert [trace.reaches_s(m) for m in (5.0, 15.0, 25.0, 40.0)] == [0.0, 0.5, 1.25, 2.0]
    assert np.isnan(trace.reaches_s(41.0))


def test_what_overlaps_counts_once_in_the_busiest_hour() -> None:
    spans_s = np.array([[1150.0, 1200.0], [1000.0, 1100.0], [1050.0, 1100.0], [4500.0, 4760.0]])
    # From 1150 s to 4750 s: 50 s and 250 s; in all 100 s, 50 s and 260 s.
    assert busiest_hour_s(spans_s) == (1150.0, 300.0, 410.0)


def test_of_a_whole_day_the_two_busiest_hours_are_shown(late: RunTables) -> None:
    assert busiest_window_s(late.calls) is None
    calls = late.calls
    evening = calls.assign(
        train=calls["train"] + "e",
        **{
            name: calls[name] + 8 * 3600.0
            for name in calls.columns
            if name.endswith(("arrival_s", "departure_s"))
        },
    )
    one = evening[evening["train"] == "r1e"]
    day = pd.concat([calls, one], ignore_index=True)
    window_s = busiest_window_s(day)
    assert window_s is not None
    start_s, end_s = window_s
    assert start_s <= calls["booked_arrival_s"].min() < calls["booked_arrival_s"].max() < end_s
    assert end_s - start_s == 7200.0
    assert busiest_window_s(pd.concat([one, evening, calls[:1]])) == pytest.approx(
        (start_s + 8 * 3600.0, end_s + 8 * 3600.0), abs=600.0
    )


def test_a_figure_of_a_window_has_only_what_is_in_it(scenario: Scenario, late: RunTables) -> None:
    arrival_s = of(late.calls, "r1")["arrival_s"].iloc[-1]
    window_s = arrival_s + 100.0, arrival_s + 160.0
    part = within(late, window_s)
    # r1 has gone; f2 is not there yet, but booked.
    assert set(part.calls["train"]) == {"f1", "r2", "f2"}
    assert set(part.trajectory["train"]) == {"f1", "r2"}
    assert part.trajectory["time_s"].between(*window_s).all()
    assert len(part.trajectory)
    figure = time_distance_figure(
        [part], stations_frame(scenario.line), title="A minute", window_s=window_s
    )
    assert figure.axes[0].get_xlim() == window_s


@pytest.mark.figures
def test_a_network_is_published_with_its_own_tables_and_figures(
    scenario: Scenario, late: RunTables, tables: dict[str, pd.DataFrame], tmp_path: Path
) -> None:
    write_run(late, tmp_path / "test")
    publish(tmp_path, scenario, [late], {})
    results = read_results(tmp_path)
    assert set(results.network) == set(NETWORK_TABLES)
    for name, frame in tables.items():
        pd.testing.assert_frame_equal(results.network[name], frame)
    assert set(NETWORK_TABLES) < set(results.columns["table"])
    drawn = {file.stem for file in tmp_path.glob("*.png")}
    assert drawn == {"time_distance", "track_plan", "zoom"}
    report = (tmp_path / "report.md").read_text("utf-8")
    assert "## Directions" in report
    assert "| test, falling | 2 |" in report


def ended_early(scenario: Scenario, train: str, station: str) -> dict[str, tuple[str, str, str]]:
    """Return what is told of whom had not finished when a train overstayed for ever."""
    late_s = {train: {station: 1e4}}
    record, _ = run_network(scenario, delays_s=late_s)
    trains = record.world.timetable.trains
    return {trains[one.row]: (one.cause, one.by, one.sentence) for one in record.unfinished}


def test_who_never_entered_is_told_by_whom_it_waited_for(scenario: Scenario) -> None:
    told = ended_early(scenario, "r1", "b")
    sentence = "f1 never entered the line at 'b': r1 had not brought its stock"
    assert told["f1"] == ("never_entered", "r1", sentence)
    told = ended_early(scenario, "r1", "a")
    sentence = "r2 never entered the line at 'a': r1 goes first there"
    assert told["r2"] == ("never_entered", "r1", sentence)


def test_where_a_falling_train_stood_is_told_by_chainage(scenario: Scenario) -> None:
    cause, by, sentence = ended_early(scenario, "f1", "a")["f2"]
    assert (cause, by) == ("train_ahead", "f1")
    km = float(sentence.removeprefix("f2 stood at km ").removesuffix(", behind f1"))
    assert 0.0 < km < 0.1


def test_who_may_not_pass_points_is_held_by_them(tmp_path: Path) -> None:
    # r1 has the single track; f1 waits in the loop.
    told = ended_early(network(tmp_path, LOOP), "r1", "a")
    assert told["f1"] == ("obstruction", "w", "f1 stood at km 0.805, held by w")


def test_the_typical_trip_may_fall() -> None:
    falling = Trip(np.array([10.0, 110.0]), np.array([2000.0, 0.0]))
    short = Trip(np.array([0.0, 20.0]), np.array([500.0, 1000.0]))
    run = SavedRun(Path(), "test", 1, "", "", (short, falling))
    assert run.typical_trip.front_m.tolist() == [2000.0, 0.0]


def test_capacity_is_not_assessed_on_a_network(scenario: Scenario) -> None:
    study = Study(scenario, scenario.controllers, (1,), scenario.step_s)
    with pytest.raises(StudyError, match="a network; allowed: a chain"):
        assess_capacity(study)
