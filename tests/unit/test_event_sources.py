"""Sources of observed events: tables and vehicle positions, good ones and those with faults."""

import gzip
import json
import zipfile
from collections.abc import Iterator, Sequence
from datetime import datetime, time
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.scenarios.observing.event_sources import observed
from kankaku.scenarios.observing.event_table import read_event_table
from kankaku.scenarios.observing.feed_messages import PositionReport, json_reports, protobuf_reports
from kankaku.scenarios.observing.observed_dwells import dwells_of
from kankaku.scenarios.observing.vehicle_positions import read_vehicle_positions
from kankaku.scenarios.observing.visits import EventsError, Visit
from tests.examples import examples
from tests.shared_data import SAMPLES
from tests.unit.excel_books import workbook
from tests.unit.observed_rows import write_events

SAMPLE = SAMPLES / "observed" / "mbta_orange_blue_2023-05-08_0800-1000.csv"
HEAD = "train,station,arrival,departure\n"
DAY_S = 86400.0


def visits_of(text: str, folder: Path, line: str = "", timezone: str = "") -> list[Visit]:
    return read_event_table(write_events(folder / "e.csv", text), line, timezone).visits


def told_by(text: str, folder: Path) -> tuple[str, ...]:
    with pytest.raises(EventsError) as caught:
        visits_of(text, folder)
    return caught.value.sentences


@pytest.mark.parametrize(
    ("text", "of_day_s"),
    [
        ("07:00:00", 25200.0),
        ("7:00:00", 25200.0),
        ("24:10:00", 87000.0),
        ("2026-03-02T07:00:00", 25200.0),
        ("2026-03-02 07:00:00.250", 25200.25),
        ("2026-03-02T07:00:00+09:00", 25200.0),
        ("2026-03-02T07:00:00Z", 25200.0),
        ("2026-03-03T00:10:00", 87000.0),
        ("1772434800", 25200.0),
    ],
)
def test_times_are_understood_as_people_write_them(
    text: str, of_day_s: float, tmp_path: Path
) -> None:
    (visit,) = visits_of(f"{HEAD}A,x,{text},\n", tmp_path)
    assert visit.arrival_s is not None
    assert visit.arrival_s - visit.day_s == of_day_s


def test_times_with_an_offset_are_told_in_the_zone_that_is_asked_for(tmp_path: Path) -> None:
    rows = f"{HEAD}A,x,2026-07-01T07:00:00Z,1782889230\n"
    (visit,) = visits_of(rows, tmp_path, timezone="Europe/Berlin")
    assert visit.arrival_s is not None
    assert visit.departure_s is not None
    assert visit.arrival_s - visit.day_s == 9 * 3600.0
    assert visit.departure_s - visit.arrival_s == 30.0


def test_an_unknown_zone_is_refused(tmp_path: Path) -> None:
    with pytest.raises(EventsError, match="--timezone: no zone 'Mars'"):
        visits_of(HEAD, tmp_path, timezone="Mars")


def test_columns_may_have_other_names_and_separators(tmp_path: Path) -> None:
    text = (
        "\ufeffTrip_ID;Stop_ID;Scheduled_Arrival;Scheduled_Departure;Arrival_Time;Departure_Time\n"
    )
    text += "A;x;07:00:00;07:00:40;07:00:05;NULL\n"
    (visit,) = visits_of(text, tmp_path)
    assert (visit.station, visit.booked_dwell_s, visit.departure_s) == ("x", 40.0, None)


def test_a_sheet_of_excel_says_what_a_table_says(tmp_path: Path) -> None:
    pytest.importorskip("openpyxl")
    rows: list[list[object]] = [
        ["date", "train", "station", "arrival", "departure"],
        [datetime(2026, 3, 2), 747, "x", time(7, 0), 0.5],  # noqa: DTZ001 - as Excel has it
        [datetime(2026, 3, 2), 747, "y", datetime(2026, 3, 2, 12, 5), None],  # noqa: DTZ001
    ]
    (tmp_path / "events.xlsx").write_bytes(workbook(rows))
    one, other = observed(tmp_path / "events.xlsx").visits
    assert one.arrival_s is not None
    assert other.arrival_s is not None
    assert one.departure_s is not None
    begun_s = one.day_s
    assert [one.arrival_s - begun_s, one.departure_s - begun_s] == [7 * 3600.0, 12 * 3600.0]
    assert other.arrival_s - begun_s == 43500.0
    (tmp_path / "events.xlsx").write_bytes(workbook([*rows, ["", 1, "z", "#N/A", ""]]))
    with pytest.raises(EventsError, match="row 4, column arrival: the cell holds the error #N/A"):
        observed(tmp_path / "events.xlsx")


def test_a_train_of_another_day_is_another_train(tmp_path: Path) -> None:
    text = (
        "date,train,station,arrival,departure\n2026-03-02,A,x,07:00:00,\n20260303,A,x,07:00:00,\n"
    )
    one, other = visits_of(text, tmp_path)
    assert one.train != other.train
    assert other.day_s - one.day_s == DAY_S


def test_one_line_is_taken_and_an_unknown_one_refused(tmp_path: Path) -> None:
    text = "line,train,station,arrival,departure\nRed,A,x,07:00:00,\nBlue,B,x,07:00:00,\n"
    assert [visit.train for visit in visits_of(text, tmp_path, "red")] == ["0 A"]
    with pytest.raises(EventsError, match="no events of line 'Green'; allowed: Blue, Red"):
        visits_of(text, tmp_path, "Green")


def test_every_mistake_is_told_at_once_by_row_and_column(tmp_path: Path) -> None:
    rows = "A,x,late,07:00\n,x,07:00:00,\nB,y,soon,\nC,z,,2026-02-30T07:00:00\n"
    assert told_by(HEAD + rows, tmp_path)[0].startswith(
        "e.csv: row 2, column arrival: 'late' is no time, and so in row 4; allowed: HH:MM:SS"
    )
    told = told_by(HEAD + rows, tmp_path)
    assert len(told) == 3
    assert any(
        "row 2, column departure: '07:00' is no time: it has no seconds" in one for one in told
    )
    assert "e.csv: row 3, column train: is empty; allowed: a name" in told


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("train,station,arrival\nA,x,07:00:00\n", "row 1: no column for departure; allowed:"),
        ("", "row 1: no column for train"),
        ("date,train,station,arrival,departure\nMonday,A,x,,\n", "'Monday' is no date"),
    ],
)
def test_a_table_without_what_is_needed_is_refused(text: str, part: str, tmp_path: Path) -> None:
    assert any(part in one for one in told_by(text, tmp_path))


def test_what_is_no_table_is_refused(tmp_path: Path) -> None:
    with pytest.raises(EventsError, match="the file is missing"):
        observed(tmp_path / "none.csv")
    (tmp_path / "odd.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(EventsError, match="not UTF-8"):
        observed(tmp_path / "odd.csv")
    with pytest.raises(EventsError, match="no messages in the folder"):
        observed(tmp_path)


@given(st.text(max_size=200))
@examples(200)
def test_no_text_is_read_with_a_traceback(
    tmp_path_factory: pytest.TempPathFactory, text: str
) -> None:
    file = tmp_path_factory.getbasetemp() / "any.csv"
    file.write_text(HEAD + text, encoding="utf-8", errors="replace")
    try:
        events = read_event_table(file)
    except EventsError:
        return
    assert all(visit.station for visit in events.visits)


def position(
    time_s: int, stop: str, *, stands: bool, trip: str = "T1", route: str = "R"
) -> dict[str, Any]:
    return {
        "trip": {"trip_id": trip, "start_date": "20260701", "route_id": route, "direction_id": 1},
        "vehicle": {"id": "V"},
        "stop_id": stop,
        "current_status": "STOPPED_AT" if stands else "IN_TRANSIT_TO",
        "timestamp": time_s,
    }


def message(*positions: dict[str, Any]) -> dict[str, Any]:
    entities = [{"id": str(at), "vehicle": one} for at, one in enumerate(positions)]
    return {"header": {"gtfs_realtime_version": "2.0", "timestamp": 1}, "entity": entities}


BEGIN_S = 1782889200
JOURNEY = (
    position(BEGIN_S, "a", stands=True),
    position(BEGIN_S + 30, "b", stands=False),
    position(BEGIN_S + 90, "b", stands=True),
    position(BEGIN_S + 100, "b", stands=True),
    position(BEGIN_S + 130, "c", stands=False),
    position(BEGIN_S + 200, "c", stands=True),
)
SEEN = [("a", None, 30.0), ("b", 90.0, 130.0), ("c", 200.0, None)]


def seen(path: Path) -> list[tuple[str, float | None, float | None]]:
    visits = read_vehicle_positions(path).visits
    begin_s = 7 * 3600.0 + visits[0].day_s
    return [
        (
            visit.station,
            None if visit.arrival_s is None else visit.arrival_s - begin_s,
            None if visit.departure_s is None else visit.departure_s - begin_s,
        )
        for visit in sorted(visits, key=lambda one: one.station)
    ]


def test_reports_become_visits_from_a_folder_an_archive_and_lines(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    with zipfile.ZipFile(tmp_path / "all.zip", "w") as archive:
        for at, one in enumerate(JOURNEY):
            text = json.dumps(message(one))
            (folder / f"{at}.json.gz").write_bytes(gzip.compress(text.encode()))
            archive.writestr(f"{9 - at}.json", text)
    lines = tmp_path / "lines.jsonl"
    lines.write_text("\n".join(json.dumps(message(one)) for one in JOURNEY), "utf-8")
    assert seen(folder) == seen(tmp_path / "all.zip") == seen(lines) == SEEN


def test_names_of_json_may_be_those_of_protobuf() -> None:
    told = {
        "header": {"timestamp": "5"},
        "entity": [{"vehicle": {"trip": {"tripId": "T"}, "stopId": "a", "currentStatus": 1}}],
    }
    assert [*json_reports(json.dumps(told))] == [
        PositionReport(5.0, "T", "", "", "", "", "a", True)
    ]


def varint(value: int) -> bytes:
    parts = []
    while value > 0x7F:
        parts.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*parts, value])


def part(number: int, value: int | str | bytes) -> bytes:
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    content = value.encode() if isinstance(value, str) else value
    return varint(number << 3 | 2) + varint(len(content)) + content


def as_protobuf(positions: Sequence[dict[str, Any]]) -> bytes:
    def entities() -> Iterator[bytes]:
        for at, one in enumerate(positions):
            own = one["trip"]
            trip = part(1, own["trip_id"]) + part(3, own["start_date"]) + part(5, own["route_id"])
            trip += part(6, own["direction_id"])
            place = varint(2 << 3 | 2) + varint(10) + b"\x0d\x00\x00\x00\x00\x15\x00\x00\x00\x00"
            status = part(4, 1 if one["current_status"] == "STOPPED_AT" else 2)
            vehicle = part(1, trip) + place + status + part(5, one["timestamp"])
            vehicle += part(7, one["stop_id"]) + part(8, part(1, "V"))
            yield part(2, part(1, str(at)) + part(4, vehicle))

    return part(1, part(1, "2.0") + part(3, 1)) + b"".join(entities())


def test_protobuf_says_what_json_says(tmp_path: Path) -> None:
    content = as_protobuf(JOURNEY)
    assert [*protobuf_reports(content)] == [*json_reports(json.dumps(message(*JOURNEY)))]
    (tmp_path / "feed.pb").write_bytes(content)
    assert seen(tmp_path / "feed.pb") == SEEN


@pytest.mark.parametrize("length", range(1, 60, 7))
def test_a_message_that_is_cut_off_is_refused(length: int, tmp_path: Path) -> None:
    (tmp_path / "feed.pb").write_bytes(as_protobuf(JOURNEY)[:-length])
    with pytest.raises(EventsError, match=r"feed\.pb: is no message of protobuf, or cut off"):
        observed(tmp_path / "feed.pb")


@given(st.binary(max_size=80))
@examples(300)
def test_no_bytes_are_read_with_a_traceback(content: bytes) -> None:
    try:
        reports = [*protobuf_reports(content)]
    except ValueError:
        return
    assert all(report.stop for report in reports)


@pytest.mark.parametrize(
    "text", ["{", "[]", "{}", "[1]", '{"entity": 3}', '{"entity": [{"vehicle": 1}]}']
)
def test_other_json_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "feed.json").write_text(text, "utf-8")
    with pytest.raises(EventsError):
        observed(tmp_path / "feed.json")


def test_reports_of_another_line_are_left_out(tmp_path: Path) -> None:
    file = tmp_path / "feed.json"
    others = [position(BEGIN_S + at, "q", stands=at == 5, trip="T2", route="S") for at in (0, 5, 9)]
    file.write_text(json.dumps(message(*JOURNEY, *others)), "utf-8")
    assert {visit.station for visit in read_vehicle_positions(file, "S").visits} == {"q"}
    with pytest.raises(EventsError, match="no reports of line 'X'; allowed: R, S"):
        read_vehicle_positions(file, "X")


@pytest.mark.skipif(not SAMPLE.exists(), reason="the samples are not here")
def test_the_sample_of_boston_is_read_with_its_faults() -> None:
    events = read_event_table(SAMPLE)
    sample = dwells_of(events)
    told = {note.what for note in sample.notes.missing}
    assert "10 rows without arrival and departure" in told
    assert "28 visits without an arrival" in told
    assert "53 visits without a departure" in told
    assert "8 rows of reports that wavered" in told
    lengths_s = sorted(one.dwell_s for one in sample.dwells)
    assert lengths_s[0] >= 7.0
    assert lengths_s[-1] <= 285.0
    assert 50.0 <= lengths_s[len(lengths_s) // 2] <= 56.0
