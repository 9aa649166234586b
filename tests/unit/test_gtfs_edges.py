"""GTFS feeds at the edge of what can be: places, times, headways."""

from pathlib import Path

import pytest

from kankaku.railway.errors import KankakuError
from kankaku.scenarios.drafts.completing import mistakes_of
from tests.unit.feed_maker import draft_of, good_feed, replaced

TWO = {
    **good_feed(),
    "trips.txt": "route_id,service_id,trip_id\nM,WD,x\n",
    "stop_times.txt": "trip_id,arrival_time,departure_time,stop_id,stop_sequence\n"
    "x,08:00:00,08:00:00,A1,1\nx,08:02:00,08:02:00,B1,2\n",
}


def refusal(place: Path, files: dict[str, str]) -> str:
    """Return why a feed is refused."""
    with pytest.raises(KankakuError) as caught:
        draft_of(place, files)
    return "\n".join(caught.value.sentences)


@pytest.mark.parametrize("lat_deg", ["35.6001", "35.6003", "35.6015"])
def test_two_stations_at_one_place_are_no_line(tmp_path: Path, lat_deg: str) -> None:
    files = replaced(TWO, "stops.txt", "35.6101", lat_deg)
    assert "allowed: more than 220 m with such trains" in refusal(tmp_path, files)


def test_a_stop_at_the_end_of_the_world_is_a_mistake(tmp_path: Path) -> None:
    files = replaced(TWO, "stops.txt", "35.6101,139.7000", "0,0")
    told = refusal(tmp_path, files)
    assert told.startswith("stops.txt: row 4, column stop_lat: 'Station B' lies 14")
    assert "allowed: up to 500 km" in told


@pytest.mark.parametrize("hours", ["00", "99"])
def test_the_first_and_the_last_hour_of_a_day_run(tmp_path: Path, hours: str) -> None:
    files = replaced(TWO, "stop_times.txt", "08:00:00,08:00:00", f"{hours}:00:00,{hours}:00:00")
    files = replaced(files, "stop_times.txt", "08:02:00,08:02:00", f"{hours}:02:00,{hours}:02:00")
    assert not mistakes_of(draft_of(tmp_path, files))


def test_more_trains_than_a_day_has_are_refused(tmp_path: Path) -> None:
    head = "trip_id,start_time,end_time,headway_secs\n"
    files = {**good_feed(), "frequencies.txt": f"{head}out0,06:00:00,24:00:00,10\n"}
    assert "frequencies.txt: row 2, column headway_secs: makes 6480" in refusal(tmp_path, files)
    dense = {**good_feed(), "frequencies.txt": f"{head}out0,06:00:00,07:00:00,60\n"}
    assert not mistakes_of(draft_of(tmp_path, dense))


def test_stops_without_a_name_have_their_identifier_and_it_is_told(tmp_path: Path) -> None:
    draft = draft_of(tmp_path, replaced(TWO, "stops.txt", "Station A", ""))
    assert [note.value for note in draft.notes.assumed if note.what == "names of stops"] == [
        "their identifiers"
    ]


def test_a_calendar_of_all_days_has_a_first_weekday(tmp_path: Path) -> None:
    draft = draft_of(tmp_path, replaced(TWO, "calendar.txt", "20260101,2026", "00010101,9999"))
    assert [note.value for note in draft.notes.assumed if note.what == "day"] == ["00010101"]


def test_a_shape_that_no_trip_names_is_found(tmp_path: Path) -> None:
    head = "shape_id,shape_pt_lat,shape_pt_lon,shape_pt_sequence\n"
    other = "far,34.0,135.0,1\nfar,34.1,135.0,2\n"
    # From E to A with a bow between B and A; trips of direction 0 run the other way.
    bow = (
        "bow,35.6401,139.70,1\nbow,35.6101,139.70,2\nbow,35.6051,139.703,3\nbow,35.6001,139.70,4\n"
    )
    draft = draft_of(tmp_path, {**good_feed(), "shapes.txt": head + other + bow})
    assert [note.value for note in draft.notes.assumed if note.what == "shape of the line"] == [
        "bow"
    ]
    first, second, third = (row.chainage_km for row in draft.rows["stations.csv"][:3])  # type: ignore[attr-defined]
    assert second - first == pytest.approx(2.0 * 111.195 * (0.005**2 + 0.00244**2) ** 0.5, abs=3e-3)
    assert third - second == pytest.approx(1.112, abs=3e-3)


def test_a_licence_and_attributions_are_named(tmp_path: Path) -> None:
    files = {**good_feed(), "LICENSE.md": "Ask us."}
    files["attributions.txt"] = "organization_name,attribution_url\nOpen Maps,http://example.org\n"
    terms = draft_of(tmp_path, files).notes.terms
    assert terms == "see LICENSE.md of the feed; it attributes Open Maps http://example.org."


def test_trips_without_two_timed_calls_are_no_timetable(tmp_path: Path) -> None:
    files = replaced(TWO, "stop_times.txt", "08:02:00,08:02:00", ",")
    told = refusal(tmp_path, files)
    assert told.startswith("stop_times.txt: row 2: no trip of the day has two calls with times")
