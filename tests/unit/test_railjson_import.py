"""Infrastructures, rolling stock and train schedules in RailJSON."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.scenarios.drafts.draft import Draft, write_files
from kankaku.scenarios.importing.formats import SourceError, Wish, imported
from kankaku.scenarios.loading.load import load
from tests.examples import examples
from tests.shared_data import SAMPLES
from tests.unit.mutated_sources import (
    STRANGE,
    changed,
    load_or_too_weak,
    places,
    read_or_refused,
    write_json,
)
from tests.unit.railjson_sources import INFRA, SCHEDULES, STOCK, end, point, section

PUBLIC = SAMPLES / "railjson"


def rows(draft: Draft, file: str, *names: str) -> list[tuple[Any, ...]]:
    return [tuple(getattr(row, name) for name in names) for row in draft.rows[file]]


def whole(draft: Draft) -> str:
    return draft.notes.markdown(draft.title)


@pytest.fixture
def infra(tmp_path: Path) -> Path:
    return write_json(tmp_path / "infra.json", INFRA)


@pytest.fixture
def stock(tmp_path: Path) -> Path:
    return write_json(tmp_path / "unit.json", STOCK)


def test_the_longest_way_has_its_own_slopes_curves_and_limits(infra: Path) -> None:
    """By the straight track, which is the shorter of the two: 2000, 1000, 3000 m."""
    draft = imported("railjson", infra, Wish())
    assert rows(draft, "stations.csv", "id", "chainage_km") == [
        ("west", 0.4),
        ("mid", 2.5),
        ("east", 5.7),
    ]
    # The last track is run against its own direction: what rises there falls here.
    assert rows(draft, "gradients.csv", "start_km", "end_km", "gradient_permil") == [
        (1.0, 2.0, 5.0),
        (4.5, 5.5, -8.0),
    ]
    assert rows(draft, "curves.csv", "start_km", "end_km", "radius_m") == [(2.1, 2.3, 800.0)]
    assert rows(draft, "limits.csv", "start_km", "end_km", "limit_kmh") == [
        (0.5, 1.5, 72.0),
        (1.5, 2.0, 54.0),
        (5.3, 6.0, 72.0),
    ]


def test_signals_of_the_direction_begin_blocks(infra: Path) -> None:
    draft = imported("railjson", infra, Wish())
    edges = rows(draft, "blocks.csv", "start_km", "end_km")
    assert [low for low, _ in edges[1:]] == [1.0, 3.5]


def test_trains_are_as_far_apart_as_long_blocks_want(tmp_path: Path) -> None:
    """Blocks of 7 km and 2 km at less than 10 m/s: a train every 300 s would pile up."""
    far = {**INFRA, "track_sections": [section("w", 2000.0), section("straight", 1000.0)]}
    far["track_sections"] += [section("loop", 1010.0), section("e", 9000.0)]
    slow = write_json(tmp_path / "slow.json", {**STOCK, "max_speed": 10.0})
    for infra, least_s in ((INFRA, 300.0), (far, 1000.0)):
        draft = imported("railjson", write_json(tmp_path / "i.json", infra), Wish(stock=slow))
        leaving = [
            int(clock[:2]) * 3600 + int(clock[3:5]) * 60 + int(clock[6:])
            for station, clock in rows(draft, "calls.csv", "station", "departure")
            if station == "west"
        ]
        assert leaving[1] - leaving[0] >= least_s
    fast = imported("railjson", write_json(tmp_path / "i.json", far), Wish(headway_s=300.0))
    assert rows(fast, "calls.csv", "departure")[3] == ("07:05:00",)


def test_without_signals_detectors_begin_blocks(tmp_path: Path) -> None:
    source = write_json(tmp_path / "infra.json", {**INFRA, "signals": []})
    edges = rows(imported("railjson", source, Wish()), "blocks.csv", "start_km", "end_km")
    assert [low for low, _ in edges[1:]] == [0.7]


def test_what_is_left_out_is_told(infra: Path) -> None:
    text = whole(imported("railjson", infra, Wish()))
    for told in ("1 track sections beside the way: loop", "FREIGHT", "2 switches", "direction"):
        assert told in text, told


def test_a_route_is_the_way_past_its_places(infra: Path) -> None:
    draft = imported("railjson", infra, Wish(route="West, loop, east"))
    assert rows(draft, "stations.csv", "id", "chainage_km")[1] == ("mid", 2.52)
    back = imported("railjson", infra, Wish(route="3,1"))
    assert rows(back, "stations.csv", "id", "chainage_km") == [
        ("east", 0.3),
        ("mid", 3.5),
        ("west", 5.6),
    ]
    assert rows(back, "gradients.csv", "start_km", "end_km", "gradient_permil") == [
        (0.5, 1.5, 8.0),
        (4.0, 5.0, -5.0),
    ]
    short = imported("railjson", infra, Wish(route="mid,east"))
    assert rows(short, "stations.csv", "id") == [("mid",), ("east",)]


def test_an_unknown_place_and_no_way_are_refused(infra: Path) -> None:
    with pytest.raises(SourceError, match=r"unknown place 'wset'.*'west|'West"):
        imported("railjson", infra, Wish(route="wset,east"))
    with pytest.raises(SourceError, match="no way from 'loop' past 'straight'"):
        imported("railjson", infra, Wish(route="loop,straight"))


def test_the_train_is_that_of_the_file(infra: Path, stock: Path) -> None:
    draft = imported("railjson", infra, Wish(stock=stock))
    entry = draft.stock["train"]["unit"]
    assert draft.stock["brake_rate"] == "net"
    assert (entry["length_m"], entry["mass_t"], entry["rotating_mass_percent"]) == (100, 200, 6)
    assert entry["service_brake_kmhps"] == pytest.approx(2.52)
    assert entry["resistance"] == {"a_n": 3000.0, "b_nspm": 100.0, "c_ns2pm2": 6.0}
    forces = entry["traction"]["force_speed"]
    assert forces == [[0.0, 180.0], [36.0, 180.0], [90.0, 90.0], [108.0, 90.0]]
    text = whole(draft)
    for told in ("1 curves that hold under conditions", "modes thermal", "startup_acceleration"):
        assert told in text, told


def test_it_loads_without_warnings(infra: Path, stock: Path, tmp_path: Path) -> None:
    draft = imported("railjson", infra, Wish(stock=stock, trains=4, headway_s=200.0))
    write_files(draft.files(), tmp_path / "made")
    scenario = load(tmp_path / "made")
    assert not scenario.warnings
    assert len(scenario.timetable.services) == 4
    assert scenario.line.start_m <= 400.0 - 100.0


def test_schedules_beside_the_infrastructure_are_its_trains(infra: Path, tmp_path: Path) -> None:
    write_json(tmp_path / "train_schedules.json", SCHEDULES)
    draft = imported("railjson", infra, Wish())
    calls = rows(draft, "calls.csv", "train", "station", "arrival", "departure")
    assert [call[:2] for call in calls] == [
        ("Slow", "west"),
        ("Slow", "mid"),
        ("Slow", "east"),
        ("Fast", "west"),
        ("Fast", "east"),
    ]
    assert calls[0][3] == "06:00:00"
    assert calls[1][2:] == ("06:08:00", "06:09:30")
    assert calls[3][3] == "06:10:00"
    assert "1 trains of train_schedules.json: Back" in whole(draft)
    write_files(draft.files(), tmp_path / "made")
    assert not load(tmp_path / "made").warnings
    even = imported("railjson", infra, Wish(trains=2))
    assert len(even.rows["services.csv"]) == 2


def test_schedules_find_their_rolling_stock_beside_them(infra: Path, tmp_path: Path) -> None:
    names = ("quick", "heavy", "heavy")
    told = [{**SCHEDULES[at], "rolling_stock_name": name} for at, name in enumerate(names)]
    write_json(tmp_path / "train_schedules.json", told)
    write_json(tmp_path / "quick.json", {**STOCK, "name": "quick", "mass": 150000.0})
    assert set(imported("railjson", infra, Wish()).stock["train"]) == {"metro"}
    write_json(tmp_path / "heavy.json", {**STOCK, "name": "heavy", "length": 400.0})
    draft = imported("railjson", infra, Wish())
    assert rows(draft, "services.csv", "train", "train_type") == [
        ("Slow", "heavy"),
        ("Fast", "quick"),
    ]
    assert draft.stock["train"]["quick"]["mass_t"] == 150.0
    assert draft.stock["brake_rate"] == "net"
    write_files(draft.files(), tmp_path / "made")
    assert not load(tmp_path / "made").warnings


def test_without_operational_points_trains_call_at_the_ends(tmp_path: Path) -> None:
    source = write_json(tmp_path / "infra.json", {**INFRA, "operational_points": []})
    draft = imported("railjson", source, Wish())
    assert rows(draft, "stations.csv", "id", "chainage_km") == [("begin", 0.14), ("end", 5.98)]
    assert "fewer than two operational points" in whole(draft)


def test_a_ring_is_cut_before_its_first_track(tmp_path: Path) -> None:
    ring = {
        **INFRA,
        "operational_points": [],
        "speed_sections": [],
        "signals": [],
        "detectors": [],
        "buffer_stops": [],
        "track_sections": [section("a", 900.0), section("b", 800.0)],
        "switches": [
            {"switch_type": "link", "ports": {"A": end("a", "END"), "B": end("b", "BEGIN")}},
            {"switch_type": "link", "ports": {"A": end("b", "END"), "B": end("a", "BEGIN")}},
        ],
    }
    draft = imported("railjson", write_json(tmp_path / "ring.json", ring), Wish())
    assert rows(draft, "tracks.csv", "start_km", "end_km") == [(0.0, 1.7)]


def test_crossing_and_slips_let_trains_through_where_they_do(tmp_path: Path) -> None:
    four = {
        **INFRA,
        "speed_sections": [],
        "signals": [],
        "detectors": [],
        "buffer_stops": [],
        "track_sections": [section(name, 1000.0) for name in "abcd"],
        "operational_points": [
            point(name, (name, 500.0), uic=n) for n, name in enumerate("abcd", 1)
        ],
    }
    ports = {"A1": end("a", "END"), "A2": end("b", "END")}
    ports |= {"B1": end("c", "BEGIN"), "B2": end("d", "BEGIN")}

    def way(kind: str, route: str) -> bool:
        infra = {**four, "switches": [{"switch_type": kind, "ports": ports}]}
        try:
            imported("railjson", write_json(tmp_path / "four.json", infra), Wish(route=route))
        except SourceError:
            return False
        return True

    ways = ("a,c", "a,d", "b,c", "b,d")
    found = {
        kind: [way(kind, route) for route in ways]
        for kind in ("crossing", "single_slip_switch", "double_slip_switch")
    }
    assert found["crossing"] == [True, False, False, True]
    assert found["single_slip_switch"] == [True, True, False, True]
    assert found["double_slip_switch"] == [True] * 4


@pytest.mark.parametrize("version", ["3.4.11", "3.5.0", "", 3, None])
def test_other_versions_are_refused_by_name(tmp_path: Path, version: object) -> None:
    source = write_json(tmp_path / "infra.json", {**INFRA, "version": version})
    with pytest.raises(SourceError, match=r"infra\.json: version: .*3\.4\.12, 3\.4\.13, 3\.4\.14"):
        imported("railjson", source, Wish())


def test_stock_of_another_version_is_refused(infra: Path, tmp_path: Path) -> None:
    other = write_json(tmp_path / "old.json", {**STOCK, "railjson_version": "2.9"})
    with pytest.raises(SourceError, match=r"old\.json: railjson_version: is '2\.9'; allowed: 3\.2"):
        imported("railjson", infra, Wish(stock=other))


@pytest.mark.parametrize(
    ("place", "value", "sentence"),
    [
        (("track_sections", 0, "length"), -1, "track_sections[0].length: is -1"),
        (("track_sections", 1, "id"), "w", "track_sections[1].id: is 'w', as of another"),
        (("switches", 0, "ports", "A", "track"), "q", "switches[0].ports.A.track: is 'q'"),
        (("switches", 1, "switch_type"), "triple", "switches[1].switch_type: is 'triple'"),
        (
            ("switches", 1, "ports", "B1"),
            end("w", "END"),
            "switches[1].ports.B1: is the END of 'w'",
        ),
        (("signals", 0, "direction"), "UP", "signals[0].direction: is 'UP'"),
        (("speed_sections", 0, "speed_limit"), 0.1, "speed_sections[0].speed_limit: is 0.1"),
        (("operational_points", 0, "parts", 0, "position"), 9e3, "parts[0].position: is 9000"),
    ],
)
def test_wrong_values_name_file_and_key(
    tmp_path: Path, place: tuple[str | int, ...], value: object, sentence: str
) -> None:
    source = write_json(tmp_path / "infra.json", changed(INFRA, place, value, drop=False))
    with pytest.raises(SourceError) as caught:
        imported("railjson", source, Wish())
    told = caught.value.sentences
    assert any(one.startswith("infra.json: ") and sentence in one for one in told), told


@examples(250)
@given(
    st.sampled_from([*((0, place) for place in places(INFRA)), *((1, p) for p in places(STOCK)),
                     *((2, p) for p in places(SCHEDULES))]),
    STRANGE,
    st.booleans(),
)  # fmt: skip
def test_changed_files_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory,
    at: tuple[int, tuple[str | int, ...]],
    value: object,
    drop: bool,
) -> None:
    folder = tmp_path_factory.mktemp("rj")
    sources: list[Any] = [INFRA, STOCK, SCHEDULES]
    sources[at[0]] = changed(sources[at[0]], at[1], value, drop=drop)
    infra, stock, _ = (
        write_json(folder / name, source)
        for name, source in zip(
            ("infra.json", "unit.json", "train_schedules.json"), sources, strict=True
        )
    )
    draft = read_or_refused("railjson", infra, Wish(stock=stock))
    if draft is not None:
        load_or_too_weak(draft, folder / "made")


@pytest.mark.skipif(not PUBLIC.is_dir(), reason="samples that are not part of the project")
def test_every_public_infrastructure_loads_with_every_train(tmp_path: Path) -> None:
    for source in sorted(PUBLIC.glob("*_infra.json")):
        for train in sorted(PUBLIC.glob("*_rolling_stock.json")):
            folder = tmp_path / f"{source.stem}-{train.stem}"
            draft = imported("railjson", source, Wish(stock=train, trains=2))
            write_files(draft.files(), folder)
            assert not load(folder).warnings, folder.name
