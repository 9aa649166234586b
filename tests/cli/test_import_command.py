"""Feeds become scenarios on the command line, run, and come back as feeds."""

from pathlib import Path

from kankaku.scenarios.drafts.provenance_notes import SOURCES_FILE
from kankaku.scenarios.loading.load import load
from tests.cli.command import kankaku, refused
from tests.unit.feed_maker import good_feed, replaced, write_feed


def test_a_feed_runs_and_its_actual_times_come_back(tmp_path: Path) -> None:
    feed = write_feed(tmp_path / "feed", good_feed())
    line = tmp_path / "line"
    told = kankaku("import", "gtfs", feed, line, "--until", "08:16:00")
    assert told.status == 0, told.complaints
    assert "M1 Line one: 5 stations, 3 trains." in told.answers
    assert "# M1 Line one: sources" in (line / SOURCES_FILE).read_text("utf-8")
    run = kankaku("run", line, "--out", tmp_path / "out", "--no-open", "--controller", "close_up")
    assert run.status == 0, run.complaints
    results = tmp_path / "out" / "line"
    told = kankaku("export", results, "--to", "gtfs", "--scenario", line)
    assert told.status == 0, told.complaints
    actual = results / "exported" / "gtfs" / "close_up.gtfs.zip"
    told = kankaku("import", "gtfs", actual, tmp_path / "again")
    assert told.status == 0, told.complaints
    before, after = load(line), load(tmp_path / "again")
    assert [one.name for one in after.line.stations] == [one.name for one in before.line.stations]
    for one in after.timetable.services:
        (booked,) = [other for other in before.timetable.services if other.train == one.train]
        assert [call.station for call in one.calls] == [call.station for call in booked.calls]
        # The trains are alone on the line: who is booked with time to spare is on time.
        for call, planned in zip(one.calls, booked.calls, strict=True):
            assert abs(call.departure_s - planned.departure_s) <= 30.0
    assert {one.train for one in after.timetable.services} == {"out0", "back0", "out1"}


def test_a_scenario_is_exported_as_booked(tmp_path: Path) -> None:
    line = tmp_path / "line"
    kankaku("import", "gtfs", write_feed(tmp_path / "feed", good_feed()), line)
    told = kankaku("export", line, "--to", "gtfs")
    assert told.status == 0, told.complaints
    file = line / "exported" / "gtfs" / "line.gtfs.zip"
    assert "line.gtfs.zip" in told.answers.replace("\n", "")
    told = kankaku("import", "gtfs", file, tmp_path / "again")
    assert told.status == 0, told.complaints
    assert (tmp_path / "again" / "calls.csv").read_text() == (line / "calls.csv").read_text()
    assert "'gtfs' (did you mean that?)" in refused("export", line, "--to", "gtf")
    assert "'../x'" in refused("export", line, "--to", "gtfs", "--timezone", "../x")


def test_a_line_is_exported_as_an_infrastructure(tmp_path: Path) -> None:
    line = tmp_path / "line"
    kankaku("import", "gtfs", write_feed(tmp_path / "feed", good_feed()), line)
    told = kankaku("export", line, "--to", "railjson", "--out", tmp_path)
    assert told.status == 0, told.complaints
    told = kankaku("import", "railjson", tmp_path / "line.railjson.json", tmp_path / "again")
    assert told.status == 0, told.complaints
    before, after = load(line), load(tmp_path / "again")
    names = [one.name for one in before.line.stations]
    assert [one.name for one in after.line.stations] in (names, names[::-1])


def test_a_wrong_feed_is_refused_and_nothing_written(tmp_path: Path) -> None:
    files = replaced(good_feed(), "stop_times.txt", "08:02:00,", "8.02,")
    told = refused("import", "gtfs", write_feed(tmp_path / "feed", files), tmp_path / "line")
    assert "stop_times.txt: row 3, column arrival_time: '8.02' is no time" in told
    assert not (tmp_path / "line").exists()
