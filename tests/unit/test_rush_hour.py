"""The Keihin-Tohoku scenario: the public timetable, the train's physics and the sources."""

import csv
from collections import Counter
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import spearmanr

from kankaku.railway.plan.scenario import Scenario
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.loading.public_timetable import Source, read_source
from kankaku.scenarios.loading.reconstruct import (
    PLATFORM_INTERVAL_S,
    least_run_times,
    reconstruct,
    run_times,
)
from tests.shared_data import SHARED

PROJECT = Path(__file__).parents[2]
FOLDER = PROJECT / "scenarios" / "rush_hour"
PUBLIC = SHARED / "keihin_tohoku_am_peak_40.csv"
DWELLS = SHARED / "dwell_am_peak_boston_2023-05-08.csv"


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return load(FOLDER)


@pytest.fixture(scope="module")
def source() -> Source:
    return read_source(FOLDER)


def booked_minutes(scenario: Scenario) -> dict[tuple[str, str], str]:
    return {
        (service.train, scenario.line.station_by_id[call.station].name.replace("-", "")): (
            f"{int(call.departure_s) // 3600:02d}:{int(call.departure_s) // 60 % 60:02d}"
        )
        for service in scenario.timetable.services
        for call in service.calls
    }


def test_the_forty_trains_and_their_origins(scenario: Scenario) -> None:
    origins = Counter(service.origin for service in scenario.timetable.services)
    expected = {"omiya": 28, "minami-urawa": 10, "akabane": 1, "higashi-jujo": 1}
    assert origins == expected
    assert len(scenario.line.stations) == 15
    assert scenario.line.stations[-1].chainage_m == 24000.0
    for service in scenario.timetable.services:
        second = service.origin != "omiya"
        assert service.route[0].endswith("-2" if second else "-1")
        assert all(track.endswith("-1") for track in service.route[1:])


def test_departures_truncate_to_the_public_minutes(scenario: Scenario) -> None:
    booked = booked_minutes(scenario)
    names = {station.id: station.name.replace("-", "") for station in scenario.line.stations}
    with (FOLDER / "public_timetable.csv").open(encoding="utf-8") as file:
        public = {
            (row["train"], names[station]): clock
            for row in csv.DictReader(file)
            for station, clock in row.items()
            if station != "train" and clock
        }
    assert booked == public


@pytest.mark.skipif(not PUBLIC.exists(), reason="the source table is not beside the project")
def test_the_public_table_is_the_sources(scenario: Scenario) -> None:
    with PUBLIC.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    other = {"order_at_NishiNippori", "train_no", "origin"}
    public = {
        (row["train_no"].lower(), station.lower()): clock
        for row in rows
        for station, clock in row.items()
        if station not in other and clock
    }
    booked = booked_minutes(scenario)
    assert {(train.lower(), name.lower()): m for (train, name), m in booked.items()} == public
    assert list(scenario.timetable.trains) == [row["train_no"] for row in rows]


def test_regenerating_gives_the_shipped_calls(source: Source) -> None:
    assert reconstruct(source) == (FOLDER / "calls.csv").read_text(encoding="utf-8")


def test_run_times_are_near_those_of_normal_driving(scenario: Scenario, source: Source) -> None:
    least, normal_s = least_run_times(source), run_times(source, source.driving)
    off_s = []
    for service in scenario.timetable.services:
        for before, after in pairwise(service.calls):
            booked_s = after.arrival_s - before.departure_s
            leg = (service.train_type, before.station, after.station)
            assert 5.0 * least[leg] <= booked_s
            off_s.append(booked_s - normal_s[leg])
    assert abs(np.mean(off_s)) < 3.0
    assert max(map(abs, off_s)) <= 25.0


def test_dwells_are_plausible_and_times_are_in_five_seconds(
    scenario: Scenario, source: Source
) -> None:
    for service in scenario.timetable.services:
        for call in service.calls:
            dwell_s = call.departure_s - call.arrival_s
            assert call.minimum_dwell_s <= dwell_s
            assert (
                abs(dwell_s - source.dwell_of(service.train, call.station).booked_dwell_s) <= 30.0
            )
            assert call.arrival_s % 5.0 == call.departure_s % 5.0 == 0.0


def test_the_booked_timetable_has_no_conflict(scenario: Scenario) -> None:
    departed: dict[tuple[str, str], float] = {}
    for service in scenario.timetable.services:
        for call in service.calls:
            before_s = departed.get((call.station, call.track), -np.inf)
            assert call.arrival_s - before_s >= PLATFORM_INTERVAL_S
            departed[call.station, call.track] = call.departure_s


def test_an_impossible_minute_is_refused(source: Source) -> None:
    first = next(iter(source.departures))
    hurried = {**source.departures[first], "yono": source.departures[first]["saitama-shintoshin"]}
    impossible = replace(source, departures={**source.departures, first: hurried})
    with pytest.raises(ValueError, match="no timetable obeys the public minutes"):
        reconstruct(impossible)


def test_limits_fit_the_curves(scenario: Scenario) -> None:
    """No curve asks for more than 105 mm cant and 60 mm deficiency on 1067 mm gauge."""
    for curve in scenario.line.curves:
        for limit in scenario.line.limits:
            if limit.start_m < curve.end_m and limit.end_m > curve.start_m:
                cant_mm = 1067.0 * limit.limit_mps**2 / (9.80665 * curve.radius_m)
                assert cant_mm <= 165.0


def test_the_drawn_line_passes_the_stations(scenario: Scenario) -> None:
    points = np.array(scenario.line.geometry_lon_lat_deg)
    scale_m = np.array([111_320.0 * np.cos(np.radians(35.8)), 110_950.0])
    length_m = np.hypot(*(np.diff(points[:, 1:], axis=0) * scale_m).T).sum()
    assert length_m == pytest.approx(scenario.line.end_m - scenario.line.start_m, rel=0.02)
    for station in scenario.line.stations:
        drawn = [np.interp(station.chainage_m, points[:, 0], points[:, axis]) for axis in (1, 2)]
        offset = (np.array([station.longitude_deg, station.latitude_deg]) - drawn) * scale_m
        assert np.hypot(*offset) < 100.0


@pytest.mark.skipif(not DWELLS.exists(), reason="the measured dwells are not beside the project")
def test_quantiles_are_those_of_the_measured_dwells(scenario: Scenario) -> None:
    with DWELLS.open(encoding="utf-8") as file:
        rows = [float(row["excess_over_stop_p25_s"]) for row in csv.DictReader(file)]
    measured_s = np.quantile(np.clip(rows, 0.0, 120.0), scenario.dwell_delays.levels)
    assert scenario.dwell_delays.delays_s == pytest.approx(measured_s, abs=0.051)


@pytest.mark.skipif(not DWELLS.exists(), reason="the measured dwells are not beside the project")
def test_the_correlation_along_a_trip_is_the_measured_one(scenario: Scenario) -> None:
    trips: dict[tuple[str, str], list[tuple[str, float]]] = {}
    with DWELLS.open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            excess_s = min(max(float(row["excess_over_stop_p25_s"]), 0.0), 120.0)
            trips.setdefault((row["line"], row["trip"]), []).append((row["arr_local"], excess_s))
    pairs = [
        (before[1], after[1]) for trip in trips.values() for before, after in pairwise(sorted(trip))
    ]
    rank_correlation = float(spearmanr(*np.array(pairs).T).statistic)
    of_scores = 2.0 * np.sin(np.pi / 6.0 * rank_correlation)
    assert scenario.dwell_delays.trip_correlation == pytest.approx(of_scores, abs=0.03)
