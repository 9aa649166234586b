"""Small GTFS feeds: what becomes of them, and what stands in the notes."""

from collections.abc import Callable
from pathlib import Path

import pytest

from kankaku.railway.errors import KankakuError
from kankaku.scenarios.drafts.completing import mistakes_of
from kankaku.scenarios.drafts.draft import Draft, write_files
from kankaku.scenarios.importing.formats import Wish, imported
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.row_formats import CallRow, ServiceRow, StationRow
from tests.shared_data import SAMPLES
from tests.unit.feed_maker import (
    calls,
    draft_of,
    good_feed,
    replaced,
    rising,
    with_line,
    zipped_feed,
)


def calls_of(draft: Draft, train: str) -> list[CallRow]:
    """Return the calls of a train."""
    rows = [row for row in draft.rows["calls.csv"] if isinstance(row, CallRow)]
    return [row for row in rows if row.train == train]


def stations(draft: Draft) -> list[StationRow]:
    """Return the stations."""
    return [row for row in draft.rows["stations.csv"] if isinstance(row, StationRow)]


def following(draft: Draft) -> dict[str, str]:
    """Return who goes on as whom."""
    rows = [row for row in draft.rows["services.csv"] if isinstance(row, ServiceRow)]
    return {row.train: row.next_train for row in rows if row.next_train}


def assumed(draft: Draft, what: str) -> str:
    """Return the value of the one assumption whose name has a text."""
    (found,) = [note.value for note in draft.notes.assumed if what in note.what]
    return found


def missing(draft: Draft) -> str:
    """Return all that is missing."""
    return "; ".join(note.what for note in draft.notes.missing)


def refused(place: Path, files: dict[str, str | bytes], wish: Wish | None = None) -> str:
    """Return why a feed is refused."""
    with pytest.raises(KankakuError) as caught:
        draft_of(place, files, wish)
    return "\n".join(caught.value.sentences)


def test_a_feed_becomes_a_scenario_that_can_be_read(tmp_path: Path) -> None:
    draft = draft_of(tmp_path, good_feed())
    write_files(draft.files(), tmp_path / "line")
    scenario = load(tmp_path / "line")
    assert scenario.title == "M1 Line one"
    assert [station.name for station in scenario.line.stations] == [
        f"Station {name}" for name in "ABCDE"
    ]
    # 0.01 degrees of a circle of 6371.009 km.
    for number, row in enumerate(stations(draft)):
        assert row.chainage_km == pytest.approx(number * 1.11195, abs=2e-3)
    assert assumed(draft, "distances") == "great-circle"
    assert following(draft) == {f"out{number}": f"back{number}" for number in range(4)}
    assert [(row.arrival, row.departure) for row in calls_of(draft, "out1")[1:3]] == [
        ("08:12:00", "08:12:30"),
        ("08:14:30", "08:15:00"),
    ]
    assert "licence" in draft.notes.terms
    assert "agency Example" in draft.notes.origin


@pytest.mark.parametrize(
    "change",
    [
        lambda text: "\ufeff" + text,
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\r"),
        lambda text: text.replace("\n", "\r\n", 2),
        lambda text: text.rstrip("\n"),
        lambda text: text.replace("\n", "\n\n ,,\n"),
        lambda text: text.replace(",08:0", ",8:0"),
        lambda text: "\n".join(
            ",".join(f'"{cell}"' for cell in line.split(",")) for line in text.splitlines()
        ),
        lambda text: text.replace(",", " , "),
    ],
)
def test_how_a_file_is_written_changes_nothing(
    tmp_path: Path, change: Callable[[str], str]
) -> None:
    plain = draft_of(tmp_path / "plain", good_feed())
    draft = draft_of(tmp_path / "other", {name: change(text) for name, text in good_feed().items()})
    assert draft.rows == plain.rows


@pytest.mark.parametrize("inside", ["", "feed/", "a/b/"])
def test_an_archive_is_read_like_a_folder(tmp_path: Path, inside: str) -> None:
    archive = zipped_feed(tmp_path / "feed.zip", good_feed(), inside)
    assert imported("gtfs", archive, Wish()).rows == draft_of(tmp_path, good_feed()).rows


def test_times_over_midnight_go_on_counting(tmp_path: Path) -> None:
    late = {**good_feed(), "stop_times.txt": good_feed()["stop_times.txt"].replace(",08:", ",24:")}
    late["stop_times.txt"] = late["stop_times.txt"].replace(",09:", ",25:")
    assert calls_of(draft_of(tmp_path, late), "out0")[-1].arrival == "24:09:30"


def test_a_missing_dwell_is_taken_from_the_run_before(tmp_path: Path) -> None:
    head = good_feed()["stop_times.txt"].splitlines()[0]
    rows = calls("out0", "ABCDE", 28800, "1", dwell_s=0)
    files = {**good_feed(), "stop_times.txt": "\n".join([head, *rows]) + "\n"}
    files["trips.txt"] = "route_id,service_id,trip_id\nM,WD,out0\n"
    draft = draft_of(tmp_path, files)
    found = [(row.arrival, row.departure) for row in calls_of(draft, "out0")[1:-1]]
    assert found[0] == ("08:01:30", "08:02:00")
    assert [departure for _, departure in found] == ["08:02:00", "08:04:00", "08:06:00"]
    assert "30 s" in assumed(draft, "dwells")


def test_a_dwell_shrinks_where_the_run_before_is_short(tmp_path: Path) -> None:
    files = replaced(good_feed(), "stop_times.txt", "08:02:00,08:02:30", "08:01:25,08:01:25")
    call = calls_of(draft_of(tmp_path, files), "out0")[1]
    assert (call.arrival, call.departure) == ("08:01:10", "08:01:25")


def test_missing_times_lie_between_by_least_run_times(tmp_path: Path) -> None:
    files = good_feed()
    for old in ("08:02:00,08:02:30", "08:04:30,08:05:00"):
        files = replaced(files, "stop_times.txt", old, ",")
    draft = draft_of(tmp_path, files)
    rows = calls_of(draft, "out0")
    # Equal distances: 420 s less two dwells of 30 s, in three equal parts.
    assert [(row.arrival, row.departure) for row in rows[1:3]] == [
        ("08:02:00", "08:02:30"),
        ("08:04:30", "08:05:00"),
    ]
    assert assumed(draft, "times of 2 calls without times")


def test_whole_minutes_that_repeat_are_spread(tmp_path: Path) -> None:
    files = replaced(good_feed(), "stop_times.txt", "08:04:30,08:05:00", "08:02:30,08:02:30")
    draft = draft_of(tmp_path, files)
    times = [row.arrival for row in calls_of(draft, "out0")]
    assert times == sorted(set(times))
    assert assumed(draft, "times of 1 calls that have the time of the call before")


def test_frequencies_repeat_a_trip(tmp_path: Path) -> None:
    files = good_feed()
    files["frequencies.txt"] = (
        "trip_id,start_time,end_time,headway_secs,exact_times\n"
        "out0,6:00:00,6:15:00,300,1\nout0,6:15:00,6:35:00,600,1\n"
    )
    draft = draft_of(tmp_path, files)
    starts = [calls_of(draft, f"out0-{number:03d}")[0].departure for number in range(1, 6)]
    assert starts == ["06:00:00", "06:05:00", "06:10:00", "06:15:00", "06:25:00"]
    assert not [note for note in draft.notes.assumed if note.what == "departures by headway"]
    assert calls_of(draft, "out0") == []
    loose = replaced(files, "frequencies.txt", "300,1", "300,0")
    assert "out0" in assumed(draft_of(tmp_path, loose), "departures by headway")


def test_without_blocks_stock_goes_on_first_in_first_out(tmp_path: Path) -> None:
    files = good_feed()
    for number in range(4):
        files["trips.txt"] = files["trips.txt"].replace(f",b{number}", ",")
    draft = draft_of(tmp_path, files)
    assert following(draft)["out0"] == "back0"
    assert "first in, first out" in assumed(draft, "circulation")
    assert all(row.arrival <= row.departure for row in calls_of(draft, "back0"))


def test_platforms_are_one_station_by_parent_or_by_place(tmp_path: Path) -> None:
    files = good_feed()
    files["stops.txt"] = files["stops.txt"].replace(",139.7000,\n", ",139.7000,ST\n", 2)
    files = with_line(files, "stops.txt", "ST,The station,35.6000,139.7000,")
    draft = draft_of(tmp_path, files)
    assert [row.id for row in stations(draft)] == ["ST", "B1", "C1", "D1", "E1"]
    assert stations(draft)[0].name == "The station"
    assert assumed(draft, "platforms of one station") != ""


def test_short_and_long_trips_make_one_line(tmp_path: Path) -> None:
    files = good_feed()
    for row in calls("short", "CDEF", 32400, "1"):
        files = with_line(files, "stop_times.txt", row)
    files = with_line(files, "stops.txt", "F1,Station F,35.65,139.70,")
    files = with_line(files, "trips.txt", "M,WD,short,0,")
    draft = draft_of(tmp_path, files)
    assert [row.id[0] for row in stations(draft)] == ["A", "B", "C", "D", "E", "F"]
    assert rising([row.chainage_km for row in stations(draft)])
    assert not draft.notes.missing


def test_a_branch_is_cut_and_a_loop_opened(tmp_path: Path) -> None:
    files = good_feed()
    for row in (*calls("branch", "ABX", 32400, "1"), *calls("loop", "ABCDEA", 34200, "1")):
        files = with_line(files, "stop_times.txt", row)
    files = with_line(files, "stops.txt", "X1,Station X,35.60,139.75,")
    files = with_line(files, "trips.txt", "M,WD,branch,0,\nM,WD,loop,0,")
    draft = draft_of(tmp_path, files)
    assert [row.station for row in calls_of(draft, "branch")] == ["A1", "B1"]
    assert [row.station[0] for row in calls_of(draft, "loop")] == [*"ABCDE"]
    assert "branch, loop" in missing(draft)


def test_whoever_is_booked_to_overtake_stays_behind(tmp_path: Path) -> None:
    files = good_feed()
    for row in ("fast,08:01:00,08:01:00,A1,1", "fast,08:06:00,08:06:00,E1,2"):
        files = with_line(files, "stop_times.txt", row)
    files = with_line(files, "trips.txt", "M,WD,fast,0,")
    draft = draft_of(tmp_path, files)
    assert calls_of(draft, "fast")[-1].arrival > calls_of(draft, "out0")[-1].arrival
    assert "behind the train before" in assumed(draft, "later times of 1 trains: fast")


def test_stations_too_near_are_passed(tmp_path: Path) -> None:
    files = replaced(good_feed(), "stops.txt", "35.6101", "35.6201")
    files = replaced(files, "stops.txt", "35.6102", "35.6202")
    draft = draft_of(tmp_path, files)
    assert len(stations(draft)) == 4
    assert "stations too near" in missing(draft)


@pytest.mark.parametrize(
    ("unit", "length"), [("metres", 1200.0), ("kilometres", 1.2), ("feet", 3937.0)]
)
def test_the_unit_of_measured_distances_is_found(tmp_path: Path, unit: str, length: float) -> None:
    files = good_feed()
    head, *rows = files["stop_times.txt"].splitlines()
    measured = [f"{row},{length * (int(row.split(',')[-1]) - 1):.3f}" for row in rows]
    files["stop_times.txt"] = "\n".join([f"{head},shape_dist_traveled", *measured])
    draft = draft_of(tmp_path, files)
    assert [row.chainage_km for row in stations(draft)] == pytest.approx(
        [0.0, 1.2, 2.4, 3.6, 4.8], abs=2e-3
    )
    assert assumed(draft, "unit of shape_dist_traveled") == unit


def test_a_shape_gives_the_distances(tmp_path: Path) -> None:
    files = good_feed()
    files["trips.txt"] = (
        files["trips.txt"].replace("block_id\n", "block_id,shape_id\n").replace(",0,b", ",0,b")
    )
    files["trips.txt"] = "\n".join(
        f"{row},bow" if ",out" in row else row for row in files["trips.txt"].splitlines()
    )
    # Half way between A and B it makes a bow of 0.005 degrees to the east.
    files["shapes.txt"] = (
        "shape_id,shape_pt_lat,shape_pt_lon,shape_pt_sequence\n"
        "bow,35.6001,139.70,1\nbow,35.6051,139.705,5\nbow,35.6101,139.70,9\nbow,35.6401,139.70,12\n"
    )
    found = [row.chainage_km for row in stations(draft_of(tmp_path, files))]
    # 0.005 degrees north and 0.005 degrees times cos 35.6 east, twice.
    assert found[1] == pytest.approx(2.0 * 0.005 * 111.195 * (1.0 + 0.8131**2) ** 0.5, abs=3e-3)
    assert found[2] - found[1] == pytest.approx(1.112, abs=3e-3)


def test_the_day_is_asked_for_or_an_ordinary_one_with_most_trips(tmp_path: Path) -> None:
    files = with_line(good_feed(), "calendar.txt", "SA,0,0,0,0,0,1,0,20260101,20261231")
    files["calendar_dates.txt"] = "service_id,date,exception_type\nSA,20260107,1\nWD,20260101,2\n"
    files["trips.txt"] = files["trips.txt"].replace("M,WD,out3", "M,SA,out3")
    usual = draft_of(tmp_path, files)
    assert assumed(usual, "day") == "20260102"
    assert len(usual.rows["services.csv"]) == 7
    saturday = draft_of(tmp_path, files, Wish(day="20260103"))
    assert [row.train for row in saturday.rows["services.csv"] if isinstance(row, ServiceRow)] == [
        "out3"
    ]
    assert len(draft_of(tmp_path, files, Wish(day="20260107")).rows["services.csv"]) == 8
    assert "allowed: for example 20260102" in refused(tmp_path, {**files}, Wish(day="20260101"))


def test_times_asked_for_leave_out_the_rest(tmp_path: Path) -> None:
    wish = Wish(from_time="08:10:00", until_time="08:20:00")
    draft = draft_of(tmp_path, good_feed(), wish)
    rows = [row.train for row in draft.rows["services.csv"] if isinstance(row, ServiceRow)]
    assert rows == ["out1", "back0", "out2"]
    assert "5 trains that begin before or after" in missing(draft)
    late = Wish(from_time="23:00:00")
    assert "allowed: between 08:00:00 and 08:45:00" in refused(tmp_path, {**good_feed()}, late)


def test_routes_are_asked_for_by_any_name(tmp_path: Path) -> None:
    files = with_line(good_feed(), "routes.txt", "N,M2,Line two,1")
    told = refused(tmp_path, {**files})
    assert "allowed: M (M1 Line one), N (M2 Line two)" in told
    for name in ("M", "m1", "LINE ONE"):
        assert draft_of(tmp_path, files, Wish(route=name)).title == "M1 Line one"
    assert "'M2' (did you mean that?)" in refused(tmp_path, {**files}, Wish(route="M2x"))
    assert "has no trips" in refused(tmp_path, {**files}, Wish(route="N"))
    bus = replaced(good_feed(), "routes.txt", "Line one,1", "Line one,700")
    assert "no routes on rails" in refused(tmp_path, {**bus})
    assert "route_type 700" in "".join(
        note.why for note in draft_of(tmp_path, bus, Wish(route="M")).notes.assumed
    )


def test_booked_runs_that_are_too_fast_are_told(tmp_path: Path) -> None:
    files = replaced(good_feed(), "stop_times.txt", "08:02:00,08:02:30", "08:00:40,08:02:30")
    assert "time for 1 runs" in missing(draft_of(tmp_path, files))


@pytest.mark.parametrize(
    ("name", "old", "new", "told"),
    [
        ("stop_times.txt", "08:02:00,", "8h02,", "row 3, column arrival_time: '8h02' is no time"),
        ("stop_times.txt", "08:04:30,", "07:04:30,", "row 4, column arrival_time: is earlier"),
        ("stop_times.txt", "B1,2", "B1,1", "row 3, column stop_sequence: 1 stands in row 2"),
        ("stop_times.txt", "B1,2", "B1,", "row 3, column stop_sequence: is empty"),
        ("stop_times.txt", "B1,2", "Q,2", "row 3, column stop_id: there is no stop 'Q'"),
        ("stop_times.txt", "B1,2", '"B1,2', "cannot be read: unexpected end of data"),
        ("stop_times.txt", "stop_id", "stop", "row 1, column stop_id: is not in the header"),
        ("stop_times.txt", "B1,2", "B1,2,9", "row 3: has 6 cells"),
        ("stops.txt", "35.6101", "95.61", "row 4, column stop_lat: '95.61' is not allowed"),
        ("stops.txt", "139.7000,", "139.7000,ZZ", "column parent_station: there is no stop 'ZZ'"),
        ("trips.txt", "out1", "out0", "row 4, column trip_id: 'out0' stands in row 2 already"),
        ("calendar.txt", "20260101", "20260230", "row 2, column start_date: '20260230' is no day"),
        ("routes.txt", ",1\n", ",\n", "row 2, column route_type: is empty"),
    ],
)
def test_a_wrong_cell_is_refused_with_its_place(
    tmp_path: Path, name: str, old: str, new: str, told: str
) -> None:
    sentences = refused(tmp_path, {**replaced(good_feed(), name, old, new)})
    assert f"{name}: " in sentences
    assert told in sentences


def test_all_mistakes_are_told_at_once(tmp_path: Path) -> None:
    files = replaced(good_feed(), "stop_times.txt", "08:02:00,", "x,")
    files = replaced(files, "stop_times.txt", "E1,5", "E1,five")
    files = replaced(files, "stops.txt", "35.6101", "north")
    assert len(refused(tmp_path, {**files}).splitlines()) >= 3


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("stop_id,stop_name\n".encode("utf-16"), "row 1: is UTF-16"),
        (b"stop_id,stop_name,stop_lat,stop_lon\nA1,Caf\xe9,1,1\n", "row 2: has the byte 0xE9"),
        (b"", "row 1: has no header"),
        (b"a\0b\n", "row 1: is UTF-16 or no text"),
    ],
)
def test_other_encodings_are_refused(tmp_path: Path, content: bytes, told: str) -> None:
    assert f"stops.txt: {told}" in refused(tmp_path, {**good_feed(), "stops.txt": content})


def test_what_is_no_feed_is_refused(tmp_path: Path) -> None:
    files = good_feed()
    del files["trips.txt"], files["calendar.txt"]
    told = refused(tmp_path, {**files})
    assert "has no trips.txt" in told
    assert "has no calendar.txt or calendar_dates.txt" in told
    for content in (b"", b"PK\x03\x04 and no more", b"text"):
        (tmp_path / "feed.zip").write_bytes(content)
        with pytest.raises(KankakuError, match="cannot be read"):
            imported("gtfs", tmp_path / "feed.zip", Wish())
    with pytest.raises(KankakuError, match="cannot be read"):
        imported("gtfs", tmp_path / "nowhere", Wish())


@pytest.mark.parametrize(
    ("wish", "told"),
    [
        (Wish(day="2026-13-01"), "--day"),
        (Wish(from_time="eight"), "--from"),
        (Wish(until_time="1"), "--until"),
        (Wish(from_time="09:00:00", until_time="08:00:00"), "--until"),
        (Wish(train="submarine"), "train 'submarine'"),
        (Wish(headway_s=90.0), "--headway"),
    ],
)
def test_wishes_that_mean_nothing_are_refused(tmp_path: Path, wish: Wish, told: str) -> None:
    assert told in refused(tmp_path, {**good_feed()}, wish)


FEEDS = SAMPLES / "gtfs"


@pytest.mark.skipif(not FEEDS.is_dir(), reason="the sample feeds are not here")
@pytest.mark.parametrize(
    ("source", "route", "stations_there", "trains"),
    [
        ("metro_sevilla.zip", "", 21, 346),
        ("busan-metro-line4", "", 14, 310),
        ("seattle-link-2017-11-16", "", 16, 305),
        ("troublesome.zip", "", 5, 252),
        ("cairo-metro-2016", "L3", 9, 824),
        ("amazon-2017-08-06", "2208", 3, 5),
        ("transitfeed/bad_eol.zip", "CITY", 5, 104),
    ],
)
def test_published_feeds_are_read(
    source: str, route: str, stations_there: int, trains: int
) -> None:
    draft = imported("gtfs", FEEDS / source, Wish(route=route))
    assert len(stations(draft)) == stations_there
    assert len(draft.rows["services.csv"]) == trains
    assert not mistakes_of(draft)
