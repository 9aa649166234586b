"""Tracks and trains of TTOBench."""

import csv
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.scenarios.drafts.draft import Draft, DraftError, write_files
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

PROJECT = Path(__file__).parents[2]
YIZHUANG = PROJECT / "tests" / "data" / "ttobench" / "CN_Songjiazhuang_Yizhuang.json"
BEIJING = YIZHUANG.parent / "CN_Beijing_Subway_train.json"
SHIPPED = PROJECT / "scenarios" / "yizhuang"
PUBLIC = SAMPLES / "ttobench"
UNITS = {"position": "m", "velocity": "km/h"}
TRACK: dict[str, Any] = {
    "metadata": {"id": "small", "license": "none"},
    "altitude": {"unit": "m", "value": 12.0},
    "stops": {"unit": "m", "values": [0.0, 1200.0, 3000.5]},
    "speed limits": {"units": UNITS, "values": [[0.0, 60], [900.0, 80]]},
    "gradients": {
        "units": {"position": "m", "slope": "permil"},
        "values": [[0.0, 0.0], [500.0, -12.5], [1500.0, 4.0]],
    },
    "curvatures": {
        "units": {"position": "m", "radius at start": "m", "radius at end": "m"},
        "values": [[0.0, "infinity", "infinity"], [400.0, -800.0, 500.0], [700.0, "infinity", 9e8]],
    },
}


def columns(draft: Draft, file: str, *names: str) -> list[tuple[Any, ...]]:
    return [tuple(getattr(row, name) for name in names) for row in draft.rows[file]]


def shipped(file: str, *names: str) -> list[tuple[float, ...]]:
    with (SHIPPED / file).open(encoding="utf-8", newline="") as rows:
        return [tuple(float(row[name]) for name in names) for row in csv.DictReader(rows)]


def told(notes: list[Any]) -> Mapping[str, str]:
    return {note[0]: note[1] for note in notes}


def test_the_yizhuang_line_is_the_shipped_one() -> None:
    draft = imported("ttobench", YIZHUANG, Wish(stock=BEIJING))
    assert columns(draft, "stations.csv", "chainage_km") == shipped("stations.csv", "chainage_km")
    for file, column in (("limits.csv", "limit_kmh"), ("gradients.csv", "gradient_permil")):
        names = ("start_km", "end_km", column)
        assert columns(draft, file, *names) == shipped(file, *names)
    assert columns(draft, "tracks.csv", "start_km", "end_km") == [(-0.2, 23.028)]


def test_the_beijing_train_is_the_shipped_one_where_the_source_tells_it() -> None:
    entry = imported("ttobench", YIZHUANG, Wish(stock=BEIJING)).stock["train"]["CN_Beijing_Subway"]
    assert entry["mass_t"] == 278.0
    assert entry["maximum_speed_kmh"] == 80.0
    assert entry["traction"] == {"starting_force_kn": 310.0, "power_kw": 3100.0}
    assert entry["resistance"]["c_kn_per_kmh2"] == 0.0022294
    assert entry["service_brake_kmhps"] == pytest.approx(3.6 * 260.0 / 278.0, abs=1e-3)


def test_a_small_line_loads_and_tells_what_was_assumed(tmp_path: Path) -> None:
    draft = imported("ttobench", write_json(tmp_path / "small.json", TRACK), Wish(trains=3))
    write_files(draft.files(), tmp_path / "made")
    scenario = load(tmp_path / "made")
    assert not scenario.warnings
    assert len(scenario.timetable.services) == 3
    assert {c.name for c in scenario.controllers} == {"close_up", "two_stage", "atc", "atd"}
    assert columns(draft, "curves.csv", "start_km", "end_km", "radius_m") == [(0.4, 0.7, 500.0)]
    assert {"train", "timetable", "booked run times", "platforms", "blocks"} <= set(
        told(draft.notes.assumed)
    )
    assert "the other running direction" in told(draft.notes.missing)
    assert draft.notes.terms == "none"


def test_headway_and_number_are_as_wished(tmp_path: Path) -> None:
    source = write_json(tmp_path / "small.json", TRACK)
    draft = imported("ttobench", source, Wish(headway_s=240.0, trains=2))
    firsts = columns(draft, "calls.csv", "station", "departure", "train")
    assert [time for station, time, _ in firsts if station == "stop-01"] == ["07:00:00", "07:04:00"]


def test_a_booked_run_is_the_least_one_with_an_allowance(tmp_path: Path) -> None:
    flat = {**TRACK, "stops": {"unit": "m", "values": [0.0, 2000.0]}}
    flat["gradients"] = {**TRACK["gradients"], "values": [[0.0, 0.0]]}
    flat["speed limits"] = {"units": UNITS, "values": [[0.0, 72]]}
    flat.pop("curvatures")
    train = json.loads(BEIJING.read_text("utf-8"))
    for key in ("rolling resistance r0", "rolling resistance r2"):
        train[key]["value"] = 0.0
    train["max traction force"]["value"] = 278.0
    train["max traction power"]["value"] = 6000.0
    train["max reg braking force"]["value"] = 278.0
    stock = write_json(tmp_path / "train.json", train)
    draft = imported("ttobench", write_json(tmp_path / "flat.json", flat), Wish(stock=stock))
    leaves, arrives = columns(draft, "calls.csv", "arrival", "departure")[:2]
    # 1 m/s2 up to 20 m/s and down again: 20 s and 200 m each, and 1600 m between them.
    assert leaves[1] == "07:00:00"
    assert arrives[0] == f"07:0{126 // 60}:{126 % 60:02d}"  # 1.05 times 120 s


@pytest.mark.parametrize(
    ("place", "value", "sentence"),
    [
        (("stops", "unit"), "km", "small.json: stops.unit: is 'km'; allowed: m"),
        (("stops", "values"), [0.0, 9.0, 5.0], "small.json: stops.values[2]: is 5"),
        (("stops", "values"), [7.0], "small.json: stops.values: has 1 stops"),
        (("stops", "values"), [0.0, 3.0], "are too near"),
        (("speed limits", "values"), [[0.0, 500]], "small.json: speed limits.values[0][1]: is 500"),
        (("gradients", "values"), [[0.0]], "small.json: gradients.values[0]: has 1 values"),
        (("metadata", "id"), 7, "small.json: metadata.id: is 7; allowed: a text"),
    ],
)
def test_mistakes_name_file_and_key(
    tmp_path: Path, place: tuple[str, ...], value: object, sentence: str
) -> None:
    source = write_json(tmp_path / "small.json", changed(TRACK, place, value, drop=False))
    with pytest.raises(SourceError) as caught:
        imported("ttobench", source, Wish())
    assert any(sentence in told for told in caught.value.sentences), caught.value.sentences


def test_all_mistakes_are_told_at_once(tmp_path: Path) -> None:
    wrong = changed(TRACK, ("stops", "unit"), "km", drop=False)
    wrong = changed(wrong, ("gradients", "values", 1, 1), 900, drop=False)
    with pytest.raises(SourceError) as caught:
        imported("ttobench", write_json(tmp_path / "small.json", wrong), Wish())
    assert len(caught.value.sentences) == 2


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, '{"a": NaN}', "\x00", "7" * 5000])
def test_what_is_no_track_is_refused(tmp_path: Path, text: str) -> None:
    source = tmp_path / "small.json"
    source.write_text(text, encoding="utf-8")
    with pytest.raises(SourceError, match=r"small\.json"):
        imported("ttobench", source, Wish())


def test_trains_that_end_too_late_are_refused(tmp_path: Path) -> None:
    source = write_json(tmp_path / "small.json", TRACK)
    with pytest.raises(SourceError, match="small: timetable: train 'T06' ends after 99 hours"):
        imported("ttobench", source, Wish(headway_s=72000.0, trains=20))


def test_trains_that_would_stand_in_one_place_are_refused(tmp_path: Path) -> None:
    source = write_json(tmp_path / "small.json", TRACK)
    with pytest.raises(SourceError, match=r"--headway: 29 s is shorter .*; allowed: 30 s or more"):
        imported("ttobench", source, Wish(headway_s=29.0))
    write_files(imported("ttobench", source, Wish(headway_s=30.0)).files(), tmp_path / "made")
    assert load(tmp_path / "made").timetable.services


def test_no_file_and_an_unasked_option_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match="No such file or directory; allowed: a file"):
        imported("ttobench", tmp_path / "none.json", Wish())
    with pytest.raises(DraftError, match="--route"):
        imported("ttobench", YIZHUANG, Wish(route="x"))


@examples(150)
@given(st.sampled_from(places(TRACK)), STRANGE, st.booleans())
def test_a_changed_track_is_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory,
    place: tuple[str | int, ...],
    value: object,
    drop: bool,
) -> None:
    folder = tmp_path_factory.mktemp("tto")
    source = write_json(folder / "small.json", changed(TRACK, place, value, drop=drop))
    draft = read_or_refused("ttobench", source, Wish(trains=2))
    if draft is not None:
        load_or_too_weak(draft, folder / "made")


TRAIN: dict[str, Any] = json.loads(BEIJING.read_text("utf-8"))


@examples(150)
@given(st.sampled_from(places(TRAIN)), STRANGE, st.booleans())
def test_a_changed_train_is_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory,
    place: tuple[str | int, ...],
    value: object,
    drop: bool,
) -> None:
    folder = tmp_path_factory.mktemp("tto")
    source = write_json(folder / "small.json", TRACK)
    stock = write_json(folder / "train.json", changed(TRAIN, place, value, drop=drop))
    draft = read_or_refused("ttobench", source, Wish(stock=stock, trains=2))
    if draft is not None:
        load_or_too_weak(draft, folder / "made")


@pytest.mark.skipif(not PUBLIC.is_dir(), reason="samples that are not part of the project")
def test_every_public_track_loads(tmp_path: Path) -> None:
    for source in sorted(PUBLIC.glob("[0C-S]*.json")):
        if source.stem.endswith("_train"):
            continue
        folder = tmp_path / source.stem
        write_files(imported("ttobench", source, Wish(trains=2)).files(), folder)
        assert not load(folder).warnings, source.stem
