"""Cross-checks between scenario files: every contradiction is named where it stands."""

from pathlib import Path

import pytest

from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.mistakes import ScenarioError
from tests.unit.scenario_folder import replace, write_scenario

LAST_A1 = "A1,last,south-1,07:05:00,07:05:30"

CASES = {
    "station unsorted": ("stations.csv", "三,3.0", "三,1.4", "row 4, column chainage_km"),
    "station outside": ("stations.csv", "三,3.0", "三,3.6", "row 4, column chainage_km"),
    "station twice": ("stations.csv", "last,Last", "first,Last", "row 4, column id"),
    "track twice": ("tracks.csv", "south,south-1", "south,north-1", "row 5, column id"),
    "track gap": ("tracks.csv", "south-1,1.6", "south-1,1.7", "row 5, column start_km"),
    "track overlap": ("tracks.csv", "south-1,1.6", "south-1,1.5", "row 5, column start_km"),
    "track unequal": (
        "tracks.csv",
        "middle-2,1.2,1.6",
        "middle-2,1.3,1.6",
        "row 4, column start_km",
    ),
    "track no length": ("tracks.csv", "south-1,1.6,3.5", "south-1,1.6,1.6", "row 5, column end_km"),
    "platform station": ("platforms.csv", "last,south-1", "lost,south-1", "row 5, column station"),
    "platform track": ("platforms.csv", "last,south-1", "last,south-9", "row 5, column track"),
    "platform outside": ("platforms.csv", "-0.205,0.005", "-0.305,0.005", "row 2, column start_km"),
    "platform twice": ("platforms.csv", "middle,middle-2", "middle,middle-1", "row 4"),
    "stop outside": ("platforms.csv", "3.005,3.0", "3.005,3.1", "row 5, column stop_km"),
    "turnout astray": ("turnouts.csv", "joining,1.6", "joining,1.7", "row 3, column position_km"),
    "turnout missing": (
        "turnouts.csv",
        "joining,1.6,1.54,1.61\n",
        "",
        "column position_km",
    ),
    "turnout twice": (
        "turnouts.csv",
        "joining,1.6,1.54,1.61\n",
        "joining,1.6,1.54,1.61\nagain,1.6,1.54,1.61\n",
        "column position_km",
    ),
    "fouling start": ("turnouts.csv", "1.6,1.54", "1.6,1.65", "row 3, column fouling_start_km"),
    "fouling too early": ("turnouts.csv", "1.6,1.54", "1.6,1.1", "row 3, column fouling_start_km"),
    "fouling end": ("turnouts.csv", "1.19,1.26", "1.19,1.16", "row 2, column fouling_end_km"),
    "limit overlap": ("limits.csv", "1.0,2.0", "0.9,2.0", "row 3, column start_km"),
    "limit outside": ("limits.csv", "1.0,2.0", "1.0,4.0", "row 3, column end_km"),
    "limit no length": ("limits.csv", "1.0,2.0", "1.0,1.0", "row 3, column end_km"),
    "gradient overlap": ("gradients.csv", "0.5,0.9", "0.4,0.9", "row 3, column start_km"),
    "gradient negative": ("gradients.csv", "0.5,0.9", "0.9,0.5", "row 3, column end_km"),
    "curve overlap": ("curves.csv", "2.0,2.2", "0.3,2.2", "row 3, column start_km"),
    "curve outside": ("curves.csv", "0.1,0.5", "-0.4,0.5", "row 2, column start_km"),
    "balise unsorted": ("balises.csv", "1.0", "0.4", "row 3, column chainage_km"),
    "balise outside": ("balises.csv", "1.0", "9.0", "row 3, column chainage_km"),
    "geometry unsorted": ("geometry.csv", "3.5", "-0.5", "row 3, column chainage_km"),
    "block gap": ("blocks.csv", "s2,south-1,2.5", "s2,south-1,2.6", "row 7, column start_km"),
    "block overlap": ("blocks.csv", "s2,south-1,2.5", "s2,south-1,2.4", "row 7, column start_km"),
    "block short": ("blocks.csv", "2.5,3.5", "2.5,3.4", "row 7, column end_km"),
    "block track": ("blocks.csv", "m2,middle-2", "m2,middle-3", "row 5, column track"),
    "blocks missing": ("blocks.csv", "m2,middle-2,1.2,1.6\n", "", "column track"),
    "block twice": ("blocks.csv", "s2,south-1", "s1,south-1", "row 7, column id"),
    "service twice": ("services.csv", "C3,unit", "C3,unit\nA1,unit", "row 5, column train"),
    "service type": ("services.csv", "C3,unit", "C3,units", "row 4, column train_type"),
    "service idle": ("services.csv", "C3,unit", "C3,unit\nD4,unit", "row 5, column train"),
    "call train": ("calls.csv", LAST_A1, f"X{LAST_A1}", "row 4, column train"),
    "call station": ("calls.csv", "A1,last", "A1,lost", "row 4, column station"),
    "call track": ("calls.csv", LAST_A1, LAST_A1.replace("h-1", "h-2"), "row 4, column track"),
    "call no platform": (
        "calls.csv",
        LAST_A1,
        LAST_A1.replace("south-1", "middle-2"),
        "row 4, column track",
    ),
    "call order": ("calls.csv", "A1,last", "A1,first", "row 4, column station"),
    "call back in time": (
        "calls.csv",
        LAST_A1,
        LAST_A1.replace("05:00", "02:00"),
        "row 4, column arrival",
    ),
    "call dwell": (
        "calls.csv",
        LAST_A1,
        LAST_A1.replace("05:30", "05:10"),
        "row 4, column departure",
    ),
    "call reversed": (
        "calls.csv",
        LAST_A1,
        LAST_A1.replace("05:00", "05:40"),
        "row 4, column departure",
    ),
    "platform taken": (
        "calls.csv",
        "07:07:00,07:07:30",
        "07:05:20,07:07:30",
        "row 6, column arrival",
    ),
    "overtaking at the end": (
        "calls.csv",
        "07:10:00,07:10:30",
        "07:08:30,07:07:20",
        "row 9, column departure",
    ),
    "overtaking by the other track": (
        "calls.csv",
        "B2,middle,middle-2,07:04:00,07:05:00",
        "B2,middle,middle-2,07:01:00,07:02:00",
        "row 5, column departure",
    ),
    "start in the way": (
        "calls.csv",
        "B2,middle,middle-2",
        "B2,middle,middle-1",
        "row 5, column track",
    ),
    "dwell station": ("dwell_stations.csv", "last,20", "lost,20", "row 4, column station"),
    "dwell station twice": ("dwell_stations.csv", "last,20", "first,20", "row 4, column station"),
    "dwell station missing": ("dwell_stations.csv", "last,20,30,1.0\n", "", "column station"),
    "dwell booked": (
        "dwell_stations.csv",
        "last,20,30",
        "last,20,10",
        "row 4, column booked_dwell_s",
    ),
    "dwell scale": ("dwell_stations.csv", "30,1.5", "30,-1.5", "row 3, column delay_scale"),
    "level start": ("dwell_quantiles.csv", "0.0,0", "0.1,0", "row 2, column level"),
    "level end": ("dwell_quantiles.csv", "1.0,60", "0.9,60", "row 4, column level"),
    "level falling": ("dwell_quantiles.csv", "0.5,4", "0.0,4", "row 3, column level"),
    "level above one": ("dwell_quantiles.csv", "0.5,4", "1.5,4", "row 3, column level"),
    "delay falling": ("dwell_quantiles.csv", "0.5,4", "0.5,99", "row 4, column delay_s"),
}

DWELLS = """\
station,minimum_dwell_s,booked_dwell_s,delay_scale,from_time,until_time,train_type
first,20,30,1.0,,,
middle,30,40,2.0,07:04:00,07:06:00,
middle,20,30,1.5,,,
middle,25,35,1.0,,,unit
middle,15,25,3.0,07:08:00,,unit
last,20,30,1.0,,07:06:00,
last,25,30,0.5,07:06:00,,
"""

DWELL_CASES = {
    "overlap": (
        "last,20,30,1.0,,07:06:00",
        "last,20,30,1.0,,07:06:30",
        "row 8, column from_time: begins before the period of row 7 ends; allowed: from 07:06:30",
    ),
    "endless": (
        "last,20,30,1.0,,07:06:00",
        "last,20,30,1.0,06:00:00,",
        "row 8, column from_time: begins before the period of row 7 ends; allowed: no period after",
    ),
    "gap": (
        "last,25,30,0.5,07:06:00",
        "last,25,30,0.5,07:08:00",
        "no row of 'last' holds for 'unit' at 07:07:30; allowed: a row for every time of day",
    ),
    "turned": (
        "07:04:00,07:06:00",
        "07:06:00,07:04:00",
        "row 3, column until_time: 07:04:00 is not after 07:06:00; allowed: after 07:06:00",
    ),
    "over midnight": (
        "07:04:00,07:06:00",
        "23:04:00,00:06:00",
        "allowed: after 23:04:00; after midnight write 24:06:00",
    ),
    "unknown type": (
        "1.0,,,unit",
        "1.0,,,units",
        "row 5, column train_type: unknown train type 'units'; allowed: 'unit'",
    ),
    "twice": (
        "1.0,,,unit",
        "1.0,,,",
        "row 5, column station: 'middle' stands in row 4 already; allowed: every station once, or",
    ),
    "no time": (
        "07:04:00,07:06:00",
        "7h04,07:06:00",
        "row 3, column from_time: '7h04' is not allowed",
    ),
    "only of another type": (
        "first,20,30,1.0,,,",
        "first,20,30,1.0,07:05:00,,unit",
        "column from_time: no row of 'first' holds for 'unit' at 07:00:30",
    ),
}

CIRCUITS = """\
id,track,start_km,end_km
n1a,north-1,-0.3,0.1
n1b,north-1,0.1,0.5
m1a,middle-1,1.2,1.25
m1b,middle-1,1.25,1.6
"""

CIRCUIT_CASES = {
    "before the line": ("n1a,north-1,-0.3", "n1a,north-1,-0.4", "row 2, column start_km", "-0.3"),
    "outside any block": ("1.25,1.6", "1.7,1.8", "row 5, column start_km", "from 1.2 to below 1.6"),
    "unknown track": ("m1a,middle-1", "m1a,middel-1", "row 4, column track", "'middle-1'"),
    "gap": ("1.25,1.6", "1.3,1.6", "row 5, column start_km", "1.25"),
    "overlap": ("1.25,1.6", "1.24,1.6", "row 5, column start_km", "1.25"),
    "late start": ("n1a,north-1,-0.3", "n1a,north-1,-0.2", "row 2, column start_km", "-0.3"),
    "early end": ("1.25,1.6", "1.25,1.5", "row 5, column end_km", "1.6"),
    "into the next block": ("0.1,0.5", "0.1,0.6", "row 3, column end_km", "0.5"),
    "twice": ("m1b", "m1a", "row 5, column id", "every id once"),
    "no length": ("1.25,1.6", "1.25,1.25", "row 5, column end_km", "above 1.25"),
    "unknown column": ("end_km\n", "end_kn\n", "row 1, column end_kn", "end_km"),
    "missing column": (",end_km\n", "\n", "row 1, column end_km", "start_km,end_km,id,track"),
    "no number": ("1.25,1.6", "1.25,x", "row 5, column end_km", "number"),
}


@pytest.mark.parametrize(("old", "new"), [("1.6,1.54", "1.6,1.49"), ("1.19,1.26", "1.19,1.31")])
def test_a_train_does_not_start_in_points(tmp_path: Path, old: str, new: str) -> None:
    folder = write_scenario(tmp_path)
    replace(folder, "turnouts.csv", old, new)
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    (mistake,) = caught.value.mistakes
    assert (mistake.file, mistake.where) == ("calls.csv", "row 5, column track")
    assert "'B2' starts in the fouling section" in mistake.problem


@pytest.mark.parametrize(("file", "old", "new", "where"), CASES.values(), ids=CASES)
def test_contradiction(tmp_path: Path, file: str, old: str, new: str, where: str) -> None:
    folder = write_scenario(tmp_path)
    replace(folder, file, old, new)
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    mistakes = caught.value.mistakes
    assert (file, where) in {(mistake.file, mistake.where) for mistake in mistakes}
    assert all(mistake.problem and mistake.allowed for mistake in mistakes)


def test_a_train_longer_than_the_platform_is_named_at_every_call(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path)
    replace(folder, "rolling_stock.toml", "length_m = 200.0", "length_m = 240.0")
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    mistakes = caught.value.mistakes
    places = [(mistake.file, mistake.where) for mistake in mistakes]
    rows = (2, 3, 4)
    assert places[:3] == [("calls.csv", f"row {row}, column track") for row in rows]
    also = [mistake.problem.partition(", and so in ")[2] for mistake in mistakes]
    assert also == ["row 7", "rows 5, 8", "rows 6, 9"]


def test_parallel_tracks_need_a_turnout_for_a_change(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path)
    replace(
        folder,
        "tracks.csv",
        "south,south-1,1.6,3.5",
        "south,south-1,1.6,3.5\nsouth,south-2,1.6,3.5",
    )
    replace(folder, "blocks.csv", "s2,south-1,2.5,3.5", "s2,south-1,2.5,3.5\ns3,south-2,1.6,3.5")
    load(folder)
    replace(folder, "turnouts.csv", "joining,1.6,1.54,1.61\n", "")
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    assert [(mistake.file, mistake.where) for mistake in caught.value.mistakes] == [
        ("calls.csv", "row 5, column track")
    ]


def test_two_tracks_of_one_section_in_one_trip(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path)
    replace(folder, "stations.csv", "last,", "extra,Extra,外,1.55,139.7,35.8\nlast,")
    replace(
        folder,
        "platforms.csv",
        "last,",
        "extra,middle-2,1.51,1.6,1.55\nlast,",
    )
    replace(folder, "dwell_stations.csv", "last,", "extra,0,0,1\nlast,")
    replace(folder, "calls.csv", "A1,last", "A1,extra,middle-2,07:03:30,07:04:00\nA1,last")
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    assert any("same section" in mistake.problem for mistake in caught.value.mistakes)


def test_one_fault_has_no_followers(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path)
    replace(folder, "stations.csv", "二,1.5", "二,x")
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    assert [(mistake.file, mistake.where) for mistake in caught.value.mistakes] == [
        ("stations.csv", "row 3, column chainage_km")
    ]


def test_the_dwell_that_holds_is_that_of_type_and_time(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path)
    (folder / "dwell_stations.csv").write_text(DWELLS, encoding="utf-8")
    other = DWELLS.replace("15,25,3.0,07:08:00", "15,25,3.0,07:07:00")
    calls = [service.calls for service in load(folder).timetable.services]
    held = [[(call.minimum_dwell_s, call.delay_scale) for call in own] for own in calls]
    # A type goes before a time: the row of 07:04 is for other types.
    assert held == [
        [(20.0, 1.0), (25.0, 1.0), (20.0, 1.0)],
        [(25.0, 1.0), (25.0, 0.5)],
        [(20.0, 1.0), (15.0, 3.0), (25.0, 0.5)],
    ]
    (folder / "dwell_stations.csv").write_text(other.replace(",unit", ","), encoding="utf-8")
    with pytest.raises(ScenarioError, match="'middle' stands in row 4 already"):
        load(folder)


def test_the_minute_of_the_booked_departure_counts(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path)
    rows = DWELLS.replace("last,25,30,0.5,07:06:00", "last,25,30,0.5,07:05:30")
    rows = rows.replace("last,20,30,1.0,,07:06:00", "last,20,30,1.0,,07:05:30")
    (folder / "dwell_stations.csv").write_text(rows, encoding="utf-8")
    # A1 leaves at 07:05:30, in public at 07:05.
    assert load(folder).timetable.services[0].calls[-1].minimum_dwell_s == 20.0


@pytest.mark.parametrize(("old", "new", "told"), DWELL_CASES.values(), ids=DWELL_CASES)
def test_dwells_by_time_of_day(tmp_path: Path, old: str, new: str, told: str) -> None:
    folder = write_scenario(tmp_path)
    (folder / "dwell_stations.csv").write_text(DWELLS, encoding="utf-8")
    load(folder)
    replace(folder, "dwell_stations.csv", old, new)
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    (mistake,) = caught.value.mistakes
    assert mistake.file == "dwell_stations.csv"
    assert told in str(mistake)


def test_a_booked_dwell_is_as_long_as_its_row_says(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path)
    (folder / "dwell_stations.csv").write_text(DWELLS, encoding="utf-8")
    replace(folder, "dwell_stations.csv", "15,25,3.0", "31,35,3.0")
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    (mistake,) = caught.value.mistakes
    assert (mistake.file, mistake.where) == ("calls.csv", "row 8, column departure")
    assert "31 s or more" in mistake.allowed


@pytest.mark.parametrize(
    ("old", "new", "where", "allowed"), CIRCUIT_CASES.values(), ids=CIRCUIT_CASES
)
def test_circuits(tmp_path: Path, old: str, new: str, where: str, allowed: str) -> None:
    folder = write_scenario(tmp_path)
    (folder / "circuits.csv").write_text(CIRCUITS, encoding="utf-8")
    load(folder)
    replace(folder, "circuits.csv", old, new)
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    mistakes = caught.value.mistakes
    assert {mistake.file for mistake in mistakes} == {"circuits.csv"}
    assert any(mistake.where == where and allowed in mistake.allowed for mistake in mistakes)
    assert all(mistake.problem for mistake in mistakes)


def test_one_wrong_circuit_has_no_followers(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path)
    wrong = CIRCUITS.replace("n1a,north-1,-0.3,0.1", "n1a,north-1,-0.3,x")
    (folder / "circuits.csv").write_text(wrong, encoding="utf-8")
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    assert [(mistake.file, mistake.where) for mistake in caught.value.mistakes] == [
        ("circuits.csv", "row 2, column end_km")
    ]


def test_circuits_without_blocks_are_refused_once(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path)
    (folder / "circuits.csv").write_text(CIRCUITS, encoding="utf-8")
    (folder / "blocks.csv").unlink()
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    (mistake,) = caught.value.mistakes
    assert (mistake.file, mistake.where, mistake.allowed) == ("circuits.csv", "", "with blocks.csv")
