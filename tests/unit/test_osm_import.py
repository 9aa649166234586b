"""Routes of OpenStreetMap: what an extract says stays, what it does not say is told."""

import sys
from pathlib import Path

import pytest

from kankaku.scenarios.drafts.draft import Draft, write_files
from kankaku.scenarios.importing.formats import SourceError, Wish, imported
from kankaku.scenarios.importing.osm_files import nearest_m, read_route, speed_kmh
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.row_formats import LimitRow, StationRow
from tests.unit.osm_extracts import STEP_DEG, extract, rail, route

# The mean radius of 6371.0088 km times the angle.
STEP_KM = 6371.0088 * STEP_DEG * 3.141592653589793 / 180.0
PLATFORM = (
    '<node id="20" version="1" lon="0.0" lat="0.0001"/>'
    '<node id="21" version="1" lon="0.0009" lat="0.0001"/>'
)
WAYS = (
    (101, (1, 2, 3), rail(("maxspeed", "50 mph"))),
    # Drawn against the running direction of the route.
    (102, (6, 5, 4, 3), rail(("maxspeed", "60"), ("maxspeed:backward", "50"))),
    (103, (6, 7, 8, 9), rail(("maxspeed", "signals"))),
    (104, (20, 21), '<tag k="railway" v="platform"/>'),
)
STOPS = (1, 3, 5, 7, 9)


@pytest.fixture
def source(tmp_path: Path) -> Path:
    more = '<member type="way" ref="104" role="platform"/>'
    routes = [route(9, "A", (101, 102, 103), STOPS, more), route(8, "B", (101,), (1, 3))]
    folder = tmp_path / "source"
    folder.mkdir()
    path = extract(folder, ways=WAYS, relations=[PLATFORM, *routes])
    # Nodes come before ways in files that others write.
    text = path.read_text("utf-8").replace(PLATFORM, "")
    path.write_text(text.replace('<way id="101"', f'{PLATFORM}<way id="101"', 1), "utf-8")
    return path


def rows(draft: Draft, file: str) -> list[object]:
    return list(draft.rows[file])


def test_route_becomes_a_line_that_is_read(source: Path, tmp_path: Path) -> None:
    draft = imported("osm", source, Wish(route="A", headway_s=300.0, trains=3))
    write_files(draft.files(), tmp_path / "made")
    scenario = load(tmp_path / "made")
    assert len(scenario.timetable.services) == 6
    departures_s = sorted(
        service.calls[0].departure_s
        for service in scenario.timetable.services
        if service.calls[0].station == "stop-1"
    )
    assert departures_s == [25_200.0, 25_500.0, 25_800.0]


def test_chainage_is_the_length_of_the_ways(source: Path) -> None:
    draft = imported("osm", source, Wish(route="9"))
    stations = [row for row in rows(draft, "stations.csv") if isinstance(row, StationRow)]
    assert [row.chainage_km for row in stations] == pytest.approx(
        [2 * STEP_KM * number for number in range(5)], abs=1e-3
    )
    assert [row.name_local for row in stations] == ["駅1", "駅3", "駅5", "駅7", "駅9"]


def test_lower_limit_of_both_directions_holds_and_miles_are_turned_into_kilometres(
    source: Path,
) -> None:
    draft = imported("osm", source, Wish(route="Line A"))
    limits = [row for row in rows(draft, "limits.csv") if isinstance(row, LimitRow)]
    assert [row.limit_kmh for row in limits] == pytest.approx([80.5, 50.0])
    assert limits[1].end_km == pytest.approx(5 * STEP_KM, abs=1e-3)
    assert any("signals" in missing.what for missing in draft.notes.missing)


@pytest.mark.parametrize(
    ("text", "expected"),
    [("80", 80.0), ("50 mph", 80.5), ("30 km/h", 30.0), ("none", None), ("1", None), ("", None)],
)
def test_speed_is_read_as_maps_write_it(text: str, expected: float | None) -> None:
    assert speed_kmh(text) == expected


def test_terms_name_the_licence_and_the_contributors(source: Path) -> None:
    text = imported("osm", source, Wish(route="A")).files()["SOURCES.md"]
    assert "OpenStreetMap contributors" in text
    assert "Open Database License 1.0" in text
    assert "stay under this licence" in text


def test_line_whose_directions_share_their_ways_is_single(tmp_path: Path) -> None:
    back = route(10, "A", (103, 102, 101), STOPS[::-1])
    there = route(9, "A", (101, 102, 103), STOPS)
    path = extract(tmp_path, ways=WAYS[:3], relations=[there, back])
    draft = imported("osm", path, Wish(route="A", headway_s=600.0, trains=2))
    tracks = [row.value for row in draft.notes.assumed if row.what == "track"]
    assert tracks == ["single, with loops"]


def test_mapped_platforms_are_told(source: Path) -> None:
    line = read_route(source, "A")
    assert line.platforms_m == pytest.approx([100.0 * STEP_KM], rel=1e-3)


def test_place_beside_the_track_is_where_the_perpendicular_meets_it(source: Path) -> None:
    line = read_route(source, "A")
    along_m, away_m = nearest_m(line, (1.5 * STEP_DEG, 0.001))
    assert along_m == pytest.approx(1500.0 * STEP_KM, abs=0.5)
    assert away_m == pytest.approx(1000.0 * STEP_KM / 9.0, rel=1e-6)


@pytest.mark.parametrize(
    ("asked", "told"),
    [("Z", "no route 'Z'; allowed: --route with one of A, B"), ("", "2 routes; allowed:")],
)
def test_route_that_is_not_there_is_refused(source: Path, asked: str, told: str) -> None:
    with pytest.raises(SourceError, match=told):
        read_route(source, asked)


def test_gap_in_the_ways_is_refused(tmp_path: Path) -> None:
    path = extract(tmp_path, ways=WAYS[:3], relations=[route(9, "A", (101, 103), STOPS)])
    with pytest.raises(SourceError, match="no way of the route goes on behind way 101"):
        read_route(path, "A")


def test_two_stops_at_one_place_are_refused(source: Path) -> None:
    text = source.read_text(encoding="utf-8").replace('lon="0.054000"', 'lon="0.036000"')
    source.write_text(text, encoding="utf-8")
    with pytest.raises(SourceError) as refusal:
        imported("osm", source, Wish(route="A"))
    told = "town.osm: stops 'Stop 5' and 'Stop 7' lie at the same place of the route, km 4.003;"
    assert [told in sentence for sentence in refusal.value.sentences] == [True]


def test_cut_extract_is_refused(tmp_path: Path) -> None:
    routes = [route(9, "A", (101, 102, 103), STOPS)]
    (tmp_path / "ways").mkdir()
    path = extract(tmp_path, ways=WAYS[:3], relations=routes, lost=[4])
    with pytest.raises(SourceError, match="1 nodes of the ways have no place, the first is 4"):
        read_route(path, "A")
    path = extract(tmp_path / "ways", ways=WAYS[:2], relations=routes)
    with pytest.raises(SourceError, match="way 103 of relation 9 is not in the file"):
        read_route(path, "A")


def test_ring_is_refused(tmp_path: Path) -> None:
    ring = ((101, (1, 2, 3, 1), rail()),)
    path = extract(tmp_path, ways=ring, relations=[route(9, "A", (101,), (1, 3))])
    with pytest.raises(SourceError, match="the route is a ring"):
        read_route(path, "A")


@pytest.mark.parametrize("name", ["town.osm", "town.osm.pbf", "town.osm.xml", "town.txt"])
def test_file_that_is_no_extract_is_refused(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_text("no map at all", encoding="utf-8")
    with pytest.raises(SourceError, match="cannot be read"):
        read_route(path, "A")


@pytest.mark.parametrize("place", ["seven", "", "1e5"])
def test_place_that_is_no_number_is_refused(source: Path, place: str) -> None:
    text = source.read_text(encoding="utf-8").replace('lat="0.0"', f'lat="{place}"', 1)
    source.write_text(text, encoding="utf-8")
    with pytest.raises(SourceError, match=r"town\.osm: cannot be read: wrong format for coord"):
        read_route(source, "A")


def test_absent_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match="cannot be read"):
        read_route(tmp_path / "town.osm", "A")


def test_absent_library_is_told_with_what_installs_it(
    source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "osmium", None)
    with pytest.raises(SourceError, match=r"pip install 'kankaku\[osm\]'"):
        read_route(source, "A")


@pytest.mark.parametrize("name", ["town.osm.pbf", "town.osm.xml"])
def test_other_forms_of_the_extract_are_read_alike(source: Path, tmp_path: Path, name: str) -> None:
    osmium = pytest.importorskip("osmium")
    other = tmp_path / name
    with osmium.SimpleWriter(str(other)) as writer:
        for one in osmium.FileProcessor(str(source)):
            writer.add(one)
    assert read_route(other, "A") == read_route(source, "A")
