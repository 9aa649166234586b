"""A scenario as a GTFS feed: read back by our own importer, and by rules of the format."""

import csv
import io
import zipfile
from pathlib import Path

from kankaku.analysis.exports.gtfs_feed import feed_archive
from kankaku.scenarios.drafts.draft import write_files
from kankaku.scenarios.exporting.gtfs_scenario import blocks, timetable_feed
from kankaku.scenarios.importing.formats import Wish, imported
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.shipped import folder_of
from tests.unit.feed_maker import draft_of, good_feed


def tables_of(archive: bytes) -> dict[str, list[dict[str, str]]]:
    """Return the tables of an archive as rows by column."""
    with zipfile.ZipFile(io.BytesIO(archive)) as feed:
        return {
            name: list(csv.DictReader(io.StringIO(feed.read(name).decode())))
            for name in feed.namelist()
        }


def test_a_scenario_comes_back_as_it_was(tmp_path: Path) -> None:
    draft = draft_of(tmp_path, good_feed())
    write_files(draft.files(), tmp_path / "line")
    feed = timetable_feed(load(tmp_path / "line"), "Asia/Tokyo", "20260314")
    assert not feed.left_out
    place = tmp_path / "line.gtfs.zip"
    place.write_bytes(feed_archive(feed.tables))
    again = imported("gtfs", place, Wish())
    # Only the identifiers of platforms were lost: a station is one stop now.
    assert again.rows == draft.rows
    assert again.title == draft.title
    assert not [note for note in again.notes.assumed if note.what == "dwells"]


def test_the_feed_of_a_network_names_stock_and_distances() -> None:
    scenario = load(folder_of("terminal"))
    tables = tables_of(feed_archive(timetable_feed(scenario, "Etc/UTC", "20260101").tables))
    services = {one.train: one for one in scenario.timetable.services}
    assert {row["trip_id"] for row in tables["trips.txt"]} == {*services}
    block_of = {row["trip_id"]: row["block_id"] for row in tables["trips.txt"]}
    for one in services.values():
        if one.next_train:
            assert block_of[one.train] == block_of[one.next_train] != ""
    at_m = {station.id: station.chainage_m for station in scenario.line.stations}
    for row in tables["stop_times.txt"]:
        origin = services[row["trip_id"]].calls[0].station
        assert float(row["shape_dist_traveled"]) == abs(at_m[row["stop_id"]] - at_m[origin])
    assert len(tables["stops.txt"]) == len(scenario.line.stations)
    assert tables["calendar_dates.txt"] == [
        {"service_id": "day", "date": "20260101", "exception_type": "1"}
    ]


def test_blocks_follow_the_stock(tmp_path: Path) -> None:
    write_files(draft_of(tmp_path, good_feed()).files(), tmp_path / "line")
    found = blocks(load(tmp_path / "line").timetable.services)
    assert found == {
        f"{way}{number}": f"out{number}" for number in range(4) for way in ("out", "back")
    }
