"""Scenarios told in RailJSON: what was exported is imported again."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from kankaku.railway.plan.line import SpeedLimit
from kankaku.railway.plan.scenario import Scenario
from kankaku.scenarios.drafts.draft import Draft
from kankaku.scenarios.exporting.railjson_routes import GROUPS
from kankaku.scenarios.exporting.railjson_scenario import railjson_of
from kankaku.scenarios.importing.formats import Wish, imported
from kankaku.scenarios.importing.railjson_network import RailjsonTracks, read_infrastructure
from kankaku.scenarios.importing.source_keys import read_json
from kankaku.scenarios.loading.load import load

SHIPPED = Path(__file__).parents[2] / "scenarios"
NAMES = ("yizhuang", "terminal", "branch", "overtaking", "single_track", "loop_line", "rush_hour")


def again(scenario: Scenario, folder: Path, route: str = "") -> Draft:
    file = folder / "told.json"
    file.write_text(json.dumps(railjson_of(scenario), allow_nan=False), encoding="utf-8")
    return imported("railjson", file, Wish(route=route, trains=2))


def read_again(scenario: Scenario, folder: Path) -> RailjsonTracks:
    file = folder / "told.json"
    file.write_text(json.dumps(railjson_of(scenario)), encoding="utf-8")
    return read_infrastructure(read_json(file))


def rows(draft: Draft, file: str, *names: str) -> list[tuple[Any, ...]]:
    return [tuple(getattr(row, name) for name in names) for row in draft.rows[file]]


def test_a_chain_comes_back_as_it_was(tmp_path: Path) -> None:
    scenario = load(SHIPPED / "yizhuang")
    line, draft = scenario.line, again(scenario, tmp_path)

    def km(place_m: float) -> float:
        """Along the way, which begins where the line does."""
        return round((place_m - line.start_m) / 1000.0, 6)

    assert rows(draft, "tracks.csv", "start_km", "end_km") == [(0.0, km(line.end_m))]
    assert rows(draft, "stations.csv", "id", "name", "chainage_km") == [
        (station.id, station.name, km(station.chainage_m)) for station in line.stations
    ]
    assert rows(draft, "limits.csv", "start_km", "end_km", "limit_kmh") == [
        (km(row.start_m), km(row.end_m), pytest.approx(3.6 * row.limit_mps)) for row in line.limits
    ]
    # Level stretches are not told.
    assert rows(draft, "gradients.csv", "start_km", "end_km", "gradient_permil") == [
        (km(row.start_m), km(row.end_m), pytest.approx(1000.0 * row.gradient))
        for row in line.gradients
        if row.gradient
    ]
    assert rows(draft, "blocks.csv", "start_km", "end_km") == [
        (km(block.start_m), km(block.end_m)) for block in line.blocks
    ]


def test_parallel_tracks_of_a_chain_join_where_points_stand(tmp_path: Path) -> None:
    scenario = load(SHIPPED / "rush_hour")
    line, tracks = scenario.line, read_again(scenario, tmp_path)
    assert tracks.lengths_m == {
        track.id: pytest.approx(track.end_m - track.start_m) for track in line.tracks
    }
    for before, after in zip(line.sections, line.sections[1:], strict=False):
        ends = {(track.id, "END") for track in before.tracks}
        begins = {(track.id, "BEGIN") for track in after.tracks}
        joined = {e: set(tracks.joined.get(e, ())) for e in ends}  # type: ignore[call-overload]
        if len(before.tracks) != len(after.tracks):
            assert joined == dict.fromkeys(ends, begins)
    draft = again(scenario, tmp_path)
    assert len(draft.rows["curves.csv"]) == len(line.curves)


@pytest.mark.parametrize("name", NAMES)
def test_every_track_end_is_joined_or_has_a_buffer_stop(name: str, tmp_path: Path) -> None:
    scenario = load(SHIPPED / name)
    tracks = read_again(scenario, tmp_path)
    assert len(tracks.joined) + tracks.buffer_stops == 2 * len(tracks.lengths_m)
    assert {point.id for point in tracks.points} == {s.id for s in scenario.line.stations}
    assert all(point.spots for point in tracks.points)


def test_a_network_can_be_run_through_either_way(tmp_path: Path) -> None:
    scenario = load(SHIPPED / "terminal")
    stations = scenario.line.stations
    there = again(scenario, tmp_path, f"{stations[0].id},{stations[-1].id}")
    back = again(scenario, tmp_path, f"{stations[-1].id},{stations[0].id}")
    for draft in (there, back):
        assert len(draft.rows["stations.csv"]) == len(stations)
        (extent,) = rows(draft, "tracks.csv", "start_km", "end_km")
        assert 1000.0 * (extent[1] - extent[0]) >= scenario.line.end_m - scenario.line.start_m


def test_trains_of_one_way_have_signals_for_that_way_only(tmp_path: Path) -> None:
    scenario = load(SHIPPED / "terminal")
    tracks = read_again(scenario, tmp_path)
    ways = {
        name: {signal.direction for signal in tracks.signals if signal.spot.track == name}
        for name in tracks.lengths_m
    }
    for track in scenario.line.network:
        wanted = "START_TO_STOP" if track.direction > 0 else "STOP_TO_START"
        if ways[track.physical]:
            assert wanted in ways[track.physical]
    assert {len(found) for found in ways.values()} >= {1}


def test_limits_of_a_train_type_are_those_of_a_tag() -> None:
    scenario = load(SHIPPED / "eco_driving")
    line = scenario.line
    mine = SpeedLimit(line.start_m + 100.0, line.start_m + 900.0, 12.5, train_type="freight")
    told = railjson_of(replace(scenario, line=replace(line, limits=(*line.limits, mine))))
    *others, last = told["speed_sections"]
    assert [section["speed_limit"] for section in others] == [
        limit.limit_mps for limit in line.limits
    ]
    assert last["speed_limit"] is None
    assert last["speed_limit_by_tag"] == {"freight": 12.5}
    (part,) = last["track_ranges"]
    assert (part["begin"], part["end"]) == (100.0, 900.0)


@pytest.mark.parametrize("name", NAMES)
def test_routes_lead_from_each_detector_to_the_next(name: str) -> None:
    told = railjson_of(load(SHIPPED / name))
    known = {
        "Detector": {detector["id"] for detector in told["detectors"]},
        "BufferStop": {stop["id"] for stop in told["buffer_stops"]},
    }
    kind_of = {switch["id"]: switch["switch_type"] for switch in told["switches"]}
    own = {kind["id"]: set(kind["groups"]) for kind in told["extended_switch_types"]}
    groups = {kind: {group for group, *_ in told} for kind, told in GROUPS.items()} | own
    assert len({route["id"] for route in told["routes"]}) == len(told["routes"])
    entered: set[str] = set()
    left: set[str] = set()
    for route in told["routes"]:
        for point, into in ((route["entry_point"], entered), (route["exit_point"], left)):
            assert point["id"] in known[point["type"]]
            into.add(point["id"])
        for switch, group in route["switches_directions"].items():
            assert group in groups[kind_of[switch]]
    assert known["Detector"] <= entered & left
    assert bool(told["routes"]) is bool(known["Detector"])
    signals = {(signal["track"], signal["position"]) for signal in told["signals"]}
    assert signals == {(place["track"], place["position"]) for place in told["detectors"]}


def test_routes_of_a_chain_follow_each_other() -> None:
    told = railjson_of(load(SHIPPED / "yizhuang"))
    after = {route["entry_point"]["id"]: route["exit_point"]["id"] for route in told["routes"]}
    assert len(after) == len(told["routes"]) == len(told["detectors"]) + 1
    here, passed = "buffer.yizhuang-1.BEGIN", 0
    while here in after:
        here, passed = after[here], passed + 1
    assert here == "buffer.yizhuang-1.END"
    assert passed == len(told["routes"])
