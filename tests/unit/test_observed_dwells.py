"""Observed dwells: faults are left out and counted, and a scenario draws what was observed."""

from dataclasses import replace
from math import asin, pi, sqrt
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ndtri
from scipy.stats import rankdata, spearmanr

from kankaku.railway.plan.timetable import Call, Service, Timetable
from kankaku.scenarios.drafts.draft import DraftError
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.observing.dwell_files import (
    NOTES_FILE,
    write_dwells,
    write_into_scenario,
)
from kankaku.scenarios.observing.dwell_statistics import DwellStatistics, dwell_statistics
from kankaku.scenarios.observing.event_table import read_event_table
from kankaku.scenarios.observing.observed_dwells import DwellSample, dwells_of
from kankaku.scenarios.observing.visits import EventsError, ObservedEvents, Visit
from tests.examples import examples
from tests.unit.observed_rows import STATIONS, event_text, exponential_s, scores, write_events
from tests.unit.scenario_folder import replace as put
from tests.unit.scenario_folder import write_scenario

TRAINS = 1400
LEAST_S, MEAN_S = np.array([12.0, 15.0, 18.0]), np.array([10.0, 20.0, 15.0])
CORRELATION = 0.45


def statistics(folder: Path, trains: int = TRAINS, seed: int = 5) -> DwellStatistics:
    dwells_s = exponential_s(scores(trains, 3, CORRELATION, seed), LEAST_S, MEAN_S)
    file = write_events(folder / "events.csv", event_text(dwells_s))
    return dwell_statistics(dwells_of(read_event_table(file)))


def sample_of(rows: str, folder: Path) -> DwellSample:
    text = f"train,station,arrival,departure\n{rows}"
    return dwells_of(read_event_table(write_events(folder / "events.csv", text)))


def left_out(sample: DwellSample) -> list[str]:
    return [note.what for note in sample.notes.missing]


def test_quantiles_and_correlation_of_known_dwells_come_back(tmp_path: Path) -> None:
    found = statistics(tmp_path)
    count = len(found.sample.dwells)
    assert count > 0.97 * 3 * TRAINS
    # The minimum is the quantile of 10 % of an exponential delay, rounded down.
    minima_s = {one.station: one.minimum_s for one in found.groups if one.hour is None}
    for name, least_s, mean_s in zip(STATIONS, LEAST_S, MEAN_S, strict=True):
        tenth_s = least_s - mean_s * np.log(0.9)
        error_s = mean_s * sqrt(0.1 / 0.9 / TRAINS)
        assert tenth_s - 4 * error_s - 1 <= minima_s[name] <= tenth_s + 4 * error_s
    # Four standard errors of a correlation.
    error = (1 - CORRELATION**2) / sqrt(found.correlation.pairs)
    assert found.correlation.value == pytest.approx(CORRELATION, abs=4 * error)
    assert found.correlation.low < CORRELATION < found.correlation.high


def long_timetable(scale: float, trains: int = 4000) -> Timetable:
    calls = tuple(
        Call(name, "main", 500.0 * at, 60.0 * at, 60.0 * at + 30.0, 20.0, scale)
        for at, name in enumerate(STATIONS)
    )
    names = (f"T{number}" for number in range(trains))
    return Timetable(tuple(Service(name, "first", "unit", ("main",), calls) for name in names))


def test_a_scenario_draws_the_dwells_that_were_written_into_it(tmp_path: Path) -> None:
    found = statistics(tmp_path)
    folder = write_scenario(tmp_path / "small")
    write_into_scenario(found, folder, force=True)
    scenario = load(folder)
    delays = scenario.dwell_delays
    assert (delays.levels, delays.delays_s) == (found.levels, found.delays_s)
    assert delays.trip_correlation == pytest.approx(found.correlation.value, abs=5e-4)
    assert delays.cap_s == found.cap_s

    trains = 4000
    table = long_timetable(1.0, trains)
    drawn = replace(delays, overstays=(), cap_s=np.inf).draw(table, 3)
    observed_s = {group.station: group for group in found.groups if group.hour is None}
    assert set(observed_s) == set(STATIONS)
    for at in range(3):
        for level in (0.25, 0.5, 0.75, 0.9):
            expected_s = float(np.interp(level, found.levels, found.delays_s))
            # Draws are whole seconds: the share below lies between the levels half a second off.
            low, high = np.interp(
                [expected_s - 0.5, expected_s + 0.5], found.delays_s, found.levels
            )
            share = float(np.mean(drawn[:, at] <= expected_s))
            error = sqrt(level * (1 - level) / trains)
            assert low - 4 * error <= share <= high + 4 * error
    for lag in (1, 2):
        # Rank correlation of a Gaussian copula: 6/pi asin(r/2), Kruskal 1958.
        expected = 6 / pi * asin(delays.trip_correlation**lag / 2)
        ranks = spearmanr(drawn[:, 0], drawn[:, lag]).statistic
        assert ranks == pytest.approx(expected, abs=4 / sqrt(trains) + 0.01)


def test_drawn_dwells_of_each_station_are_distributed_like_the_observed_ones(
    tmp_path: Path,
) -> None:
    found = statistics(tmp_path)
    folder = write_scenario(tmp_path / "small")
    write_into_scenario(found, folder, force=True)
    delays = replace(load(folder).dwell_delays, overstays=())
    for group in (one for one in found.groups if one.hour is None):
        drawn_s = group.minimum_s + delays.draw(long_timetable(group.delay_scale), 9)[:, 0]
        seen_s = np.array([d.dwell_s for d in found.sample.dwells if d.station == group.station])
        for level in (0.5, 0.75, 0.9):
            seen = np.mean(drawn_s <= np.quantile(seen_s, level))
            # Of both samples; a second of an exponential distribution is up to 1/10 of its share.
            error = sqrt(level * (1 - level) * (1 / 4000 + 1 / seen_s.size))
            assert seen == pytest.approx(level, abs=4 * error + 0.5 / 10 * (1 - level) + 0.02)


def test_rows_by_time_of_day_hold_for_their_hour(tmp_path: Path) -> None:
    found = statistics(tmp_path)
    folder = write_scenario(tmp_path / "small")
    written = write_into_scenario(found, folder, force=True)
    assert not written.kept
    scenario = load(folder)
    hours = {group.hour for group in found.groups if group.station == "middle"}
    assert {None, 7, 8} <= hours
    (call,) = (one for one in scenario.timetable.services[0].calls if one.station == "middle")
    (group,) = (one for one in found.groups if (one.station, one.hour) == ("middle", 7))
    assert (call.minimum_dwell_s, call.delay_scale) == (group.minimum_s, group.delay_scale)


def test_nothing_is_replaced_without_being_told(tmp_path: Path) -> None:
    found = statistics(tmp_path, 60)
    folder = write_scenario(tmp_path / "small")
    before = {file.name: file.read_bytes() for file in folder.iterdir()}
    with pytest.raises(DraftError, match="is there already"):
        write_into_scenario(found, folder)
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == before
    write_dwells(found, tmp_path / "own")
    with pytest.raises(DraftError, match="is there already"):
        write_dwells(found, tmp_path / "own")


def test_a_scenario_without_delays_gets_them_and_keeps_its_comments(tmp_path: Path) -> None:
    found = statistics(tmp_path, 60)
    folder = write_scenario(tmp_path / "small")
    (folder / "dwell_stations.csv").unlink()
    (folder / "dwell_quantiles.csv").unlink()
    table = "[dwell_delays]\nscale = 1.0\ncap_s = 60.0\ntrip_correlation = 0.3\n"
    put(folder, "scenario.toml", table, "# no delays yet\n")
    write_into_scenario(found, folder)
    assert "# no delays yet" in (folder / "scenario.toml").read_text("utf-8")
    assert load(folder).dwell_delays.levels == found.levels


def test_stations_are_found_by_name_and_those_unseen_keep_their_rows(tmp_path: Path) -> None:
    dwells_s = exponential_s(scores(60, 2, 0.3, 2), LEAST_S[:2], MEAN_S[:2])
    text = event_text(dwells_s, ("FIRST ", "Middle"))
    found = dwell_statistics(dwells_of(read_event_table(write_events(tmp_path / "e.csv", text))))
    folder = write_scenario(tmp_path / "small")
    written = write_into_scenario(found, folder, force=True)
    assert written.kept == ("last",)
    rows = (folder / "dwell_stations.csv").read_text("utf-8").splitlines()
    assert any(row.startswith("last,20,30,1") for row in rows)
    assert "dwells at last" in (folder / NOTES_FILE).read_text("utf-8")
    load(folder)


def test_no_train_is_booked_for_less_than_its_minimum_dwell(tmp_path: Path) -> None:
    dwells_s = exponential_s(scores(60, 3, 0.3, 2), LEAST_S + 20.0, MEAN_S)
    found = dwell_statistics(
        dwells_of(read_event_table(write_events(tmp_path / "e.csv", event_text(dwells_s))))
    )
    folder = write_scenario(tmp_path / "small")
    written = write_into_scenario(found, folder, force=True)
    assert set(written.shortened) == set(STATIONS)
    assert "minimum dwell at middle" in (folder / NOTES_FILE).read_text("utf-8")
    for service in load(folder).timetable.services:
        for call in service.calls:
            assert call.minimum_dwell_s <= call.departure_s - call.arrival_s


def test_a_scenario_of_another_line_is_refused(tmp_path: Path) -> None:
    dwells_s = exponential_s(scores(60, 2, 0.3, 2), LEAST_S[:2], MEAN_S[:2])
    file = write_events(tmp_path / "e.csv", event_text(dwells_s, ("ueno", "akabane")))
    found = dwell_statistics(dwells_of(read_event_table(file)))
    with pytest.raises(DraftError, match="no station of the scenario was observed"):
        write_into_scenario(found, write_scenario(tmp_path / "small"), force=True)


def test_a_timetable_of_another_scenario_is_left_alone(tmp_path: Path) -> None:
    found = statistics(tmp_path, 60)
    folder = write_scenario(tmp_path / "small")
    put(folder, "scenario.toml", "seed = 7\n", 'seed = 7\ntimetable = "../other"\n')
    with pytest.raises(DraftError, match=r"the dwells are those of '\.\./other'"):
        write_into_scenario(found, folder, force=True)


ROWS = """\
A,x,07:00:00,07:00:30
A,y,08:02:00,08:02:40
A,z,09:05:00,09:05:30
"""


def test_only_what_was_seen_from_beginning_to_end_is_a_dwell(tmp_path: Path) -> None:
    sample = sample_of(ROWS, tmp_path)
    assert [(one.station, one.dwell_s) for one in sample.dwells] == [("y", 40.0)]
    assert left_out(sample) == [
        "2 visits at either end of what was seen of a train, where it may lay over"
    ]


def test_a_report_that_wavered_is_one_visit(tmp_path: Path) -> None:
    rows = ROWS.replace("08:02:40", "08:02:20") + "A,y,08:02:25,08:02:50\n"
    sample = sample_of(rows, tmp_path)
    assert [one.dwell_s for one in sample.dwells] == [50.0]
    assert "1 rows of reports that wavered" in left_out(sample)


@pytest.mark.parametrize(
    ("row", "told"),
    [
        ("B,y,,08:10:00", "1 visits without an arrival"),
        ("B,y,08:10:00,", "1 visits without a departure"),
        ("B,y,08:10:00,08:10:00", "1 visits of no length"),
        ("B,y,08:10:00,08:20:00", "1 visits of more than 300 s"),
        ("B,y,08:10:00,08:09:00", "1 visits with a departure before the arrival"),
        ("B,y,07:04:00,07:04:30", "1 visits within 300 s of either end"),
        ("B,y,09:02:00,09:02:30", "1 visits within 300 s of either end"),
        ("B,y,,", "1 rows without arrival and departure"),
    ],
)
def test_every_fault_is_counted(row: str, told: str, tmp_path: Path) -> None:
    rows = f"B,w,07:01:00,07:02:00\n{row}\nB,z,09:03:00,09:04:00\n"
    sample = sample_of(ROWS + rows, tmp_path)
    assert [one.station for one in sample.dwells] == ["y"]
    assert any(what.startswith(told) for what in left_out(sample))


def test_the_headway_is_from_the_departure_before_to_the_arrival(tmp_path: Path) -> None:
    rows = ROWS + "B,x,07:30:00,07:31:00\nB,y,08:10:00,08:10:30\nB,z,09:04:00,09:04:10\n"
    sample = sample_of(rows, tmp_path)
    assert [(one.train[-1], one.headway_s) for one in sample.dwells] == [("A", None), ("B", 440.0)]


def test_without_trains_nothing_is_worked_out() -> None:
    with pytest.raises(EventsError, match="no train was seen"):
        dwells_of(ObservedEvents([], SourceNotes("nothing")))


def test_few_dwells_of_a_station_are_refused(tmp_path: Path) -> None:
    with pytest.raises(EventsError, match="no station has 10 dwells"):
        dwell_statistics(sample_of(ROWS, tmp_path))


def test_dwells_that_grow_with_the_headway_are_told_to_grow_so() -> None:
    random = np.random.default_rng(1)
    went_s, visits = 0.0, []
    for number in range(400):
        headway_s = float(random.uniform(60.0, 600.0))
        came_s = went_s + headway_s
        went_s = came_s + 30.0 + 0.05 * headway_s + float(random.normal(0.0, 3.0))
        for station, arrival_s, departure_s in (
            ("x", came_s - 200.0, came_s - 180.0),
            ("y", came_s, went_s),
            ("z", went_s + 100.0, went_s + 120.0),
        ):
            visits.append(Visit(f"T{number}", station, station, 0.0, arrival_s, departure_s))
    found = dwell_statistics(dwells_of(ObservedEvents(visits, SourceNotes("made"), {"y": "Y"})))
    whole, own = found.headways
    assert (whole.station, own.station) == ("", "y")
    assert whole.slope == pytest.approx(0.05, abs=max(4 * whole.slope_error, 0.004))
    assert whole.rank_correlation > 0.8


@given(
    st.lists(
        st.tuples(st.integers(0, 4), st.integers(0, 3), st.integers(0, 4000), st.integers(0, 400)),
        max_size=60,
    )
)
@examples(200)
def test_any_visits_give_dwells_that_were_seen(rows: list[tuple[int, int, int, int]]) -> None:
    visits = [
        Visit(f"T{train}", f"s{station}", "", 0.0, float(came_s), float(came_s + length_s))
        for train, station, came_s, length_s in rows
    ]
    notes = SourceNotes("made")
    try:
        sample = dwells_of(ObservedEvents(visits, notes, {}))
    except EventsError:
        return
    for at, dwell in enumerate(sample.dwells):
        assert 0.0 < dwell.dwell_s <= sample.longest_s
        assert dwell.before in {-1, at - 1}
        assert dwell.before < 0 or sample.dwells[dwell.before].train == dwell.train
        assert dwell.headway_s is None or dwell.headway_s > 0.0
    counted = sum(int(note.what.split()[0]) for note in notes.missing)
    assert counted + len(sample.dwells) == len(visits)


def test_scores_are_those_of_mean_ranks() -> None:
    values = np.array([3.0, 1.0, 3.0, 2.0])
    assert ndtri((rankdata(values) - 0.5) / 4).round(3).tolist() == [0.674, -1.15, 0.674, -0.319]
