"""Where services end, which tracks they share, and which station a platform belongs to."""

from pathlib import Path

import pytest

import kankaku
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.mistakes import ScenarioError
from tests.unit.scenario_folder import replace, write_scenario

LATER_TRAINS = """\
C3,first,north-1,07:05:00,07:05:30
C3,middle,middle-1,07:07:30,07:08:00
C3,last,south-1,07:10:00,07:10:30
"""


def refused(folder: Path) -> list[tuple[str, str, str]]:
    with pytest.raises(ScenarioError) as caught:
        load(folder)
    return [(mistake.file, mistake.where, mistake.problem) for mistake in caught.value.mistakes]


def test_a_train_that_calls_at_the_last_platform_of_its_way_runs_out_of_the_line(
    tmp_path: Path,
) -> None:
    services = load(write_scenario(tmp_path)).timetable.services
    assert not any(service.leaves_at_last_call for service in services)
    assert services[0].route == ("north-1", "middle-1", "south-1")


@pytest.mark.parametrize("track", ["middle-1", "middle-2"])
def test_a_train_that_ends_before_a_platform_of_its_way_leaves_the_line_there(
    tmp_path: Path, track: str
) -> None:
    folder = write_scenario(tmp_path)
    ends = LATER_TRAINS.replace("middle-1", track).replace(
        "C3,last,south-1,07:10:00,07:10:30\n", ""
    )
    replace(folder, "calls.csv", LATER_TRAINS, ends)
    replace(folder, "turnouts.csv", "joining,1.6,1.54,1.61", "joining,1.6,1.51,1.61")
    last = load(folder).timetable.services[-1]
    assert last.leaves_at_last_call
    assert last.route == ("north-1", track)


def test_a_train_may_not_leave_the_line_in_points(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path)
    replace(folder, "calls.csv", "C3,last,south-1,07:10:00,07:10:30\n", "")
    replace(folder, "turnouts.csv", "joining,1.6,1.54,1.61", "joining,1.6,1.49,1.61")
    found = refused(folder)
    assert ("calls.csv", "row 8, column track") in [mistake[:2] for mistake in found]
    assert any("ends in the fouling section of 'joining'" in mistake[2] for mistake in found)


def test_trains_on_tracks_that_never_meet_do_not_overtake_each_other(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path)
    (folder / "turnouts.csv").unlink()
    (folder / "blocks.csv").unlink()
    names = ("north", "middle", "south")
    ends_km = {"north": (-0.3, 1.2), "middle": (1.2, 1.6), "south": (1.6, 3.5)}
    tracks = [f"{n},{n}-{i},{a},{b}" for n, (a, b) in ends_km.items() for i in (1, 2)]
    (folder / "tracks.csv").write_text("\n".join(["section,id,start_km,end_km", *tracks]))
    places = {"first": ("north", 0.0), "middle": ("middle", 1.5), "last": ("south", 3.0)}
    platforms = [
        f"{station},{section}-{i},{stop - 0.205:.3f},{stop + 0.005:.3f},{stop}"
        for station, (section, stop) in places.items()
        for i in (1, 2)
    ]
    header = "station,track,start_km,end_km,stop_km"
    (folder / "platforms.csv").write_text("\n".join([header, *platforms]))
    # Both at the same times; the second one does not call in the middle, and stays on its track.
    calls = [
        "train,station,track,arrival,departure",
        "A1,first,north-1,07:00:00,07:00:30",
        "A1,middle,middle-1,07:02:30,07:03:00",
        "A1,last,south-1,07:05:00,07:05:30",
        "B2,first,north-2,07:00:00,07:00:30",
        "B2,last,south-2,07:04:00,07:04:30",
    ]
    (folder / "calls.csv").write_text("\n".join(calls))
    (folder / "services.csv").write_text("train,train_type\nA1,unit\nB2,unit\n")
    first, second = load(folder).timetable.services
    assert first.route == tuple(f"{name}-1" for name in names)
    assert second.route == tuple(f"{name}-2" for name in names)
    replace(folder, "tracks.csv", "south,south-2,1.6,3.5", "")
    replace(folder, "platforms.csv", "last,south-2,2.795,3.005,3.0", "")
    replace(folder, "calls.csv", "B2,last,south-2", "B2,last,south-1")
    turnout = "id,position_km,fouling_start_km,fouling_end_km\njoining,1.6,1.54,1.61\n"
    (folder / "turnouts.csv").write_text(turnout)
    # Now they share the last track, and there the second one comes first.
    assert any("overtakes train 'A1'" in problem for _, _, problem in refused(folder))


def test_a_platform_far_from_its_station_is_told(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path)
    replace(folder, "platforms.csv", "last,south-1,2.795,3.005,3.0", "last,south-1,2.1,2.4,2.4")
    ((file, where, problem),) = refused(folder)
    assert (file, where) == ("platforms.csv", "row 5, column station")
    assert "0.6 km from its station 'last'" in problem


def test_two_platforms_with_the_names_of_each_other_are_told(tmp_path: Path) -> None:
    folder = write_scenario(tmp_path)
    near = "last,Last,三,1.9,139.8,35.7"
    replace(folder, "stations.csv", "last,Last,三,3.0,139.8,35.7", near)
    replace(folder, "platforms.csv", "first,north-1,-0.205,0.005,0.0", "first,north-1,0.6,0.9,0.85")
    replace(folder, "platforms.csv", "last,south-1,2.795,3.005,3.0", "last,south-1,1.7,2.0,1.9")
    replace(folder, "stations.csv", "first,First,一,0.0", "first,First,一,0.5")
    assert load(folder).line.platforms[0].stop_m == 850.0
    replace(
        folder,
        "platforms.csv",
        "first,north-1,0.6,0.9,0.85",
        "first,north-1,0.6,0.9,0.85\nmiddle,north-1,0.3,0.55,0.5",
    )
    found = refused(folder)
    assert ("platforms.csv", "row 2, column station") in [mistake[:2] for mistake in found]


def test_who_waits_outside_a_platform_goes_on_when_its_leader_ends_there(tmp_path: Path) -> None:
    """B2 ends at the last station, before a platform of its way, and is never seen to depart."""
    folder = write_scenario(tmp_path)
    for file, row in {
        "stations.csv": "halt,Halt,停,3.4,139.8,35.7\n",
        "platforms.csv": "halt,south-1,3.195,3.405,3.4\n",
        "dwell_stations.csv": "halt,20,30,1.0\n",
    }.items():
        with (folder / file).open("a", encoding="utf-8") as opened:
            opened.write(row)
    last = "C3,last,south-1,07:10:00,07:10:30\n"
    replace(folder, "calls.csv", last, f"{last}C3,halt,south-1,07:11:00,07:11:30\n")
    settings = folder / "scenario.toml"
    late = settings.read_text("utf-8").replace('"A1"', '"B2"').replace('"middle"', '"last"')
    late = late.replace("delay_s = 90.0", "delay_s = 400.0").replace("close_up", "approach_point")
    settings.write_text(f"{late}exclusive_platform = true\n", "utf-8")
    run = kankaku.run_once(folder, "plain")
    assert run.calls[run.calls["train"] == "B2"]["departure_delay_s"].max() > 300.0
    assert run.unfinished.empty
    assert run.violations.empty
