"""Throw times, level crossings and disruptions in the files of a scenario."""

from pathlib import Path

import numpy as np
import pytest

from kankaku.railway.plan.disruptions import (
    UNDISTURBED,
    Cause,
    Closure,
    Disruptions,
    Obstacle,
    PointsFailure,
)
from kankaku.railway.plan.line import Crossing
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.reading.mistakes import ScenarioError
from tests.unit.scenario_folder import replace, write_scenario

CROSSINGS = """\
id,start_km,end_km,strike_in_km,closing_s
road,2.6,2.61,1.5,20
"""
DISRUPTIONS = """
[[work_zones]]
id = "tamping"
tracks = ["south-1"]
start_km = 2.0
end_km = 2.2
from = "07:10:00"
to = "07:20:00"
released = "07:25:30"

[[work_zones]]
id = "cabling"
start_km = 1.0
end_km = 1.3
from = "07:10:00"
to = "07:20:00"

[[equipment_faults]]
id = "rail"
start_km = 0.5
end_km = 0.6
from = "07:00:00"
to = "07:01:00"

[[points_failures]]
turnout = "parting"
from = "07:02:00"
to = "07:04:00"

[[crossing_obstacles]]
crossing = "road"
from = "07:05:00"
to = "07:05:30"

[random_disruptions]
points_failure_percent = 2.5
points_repair_s = 120.0
obstacle_percent = 1.0
obstacle_s = 45.0
"""
SEVEN_S = 7 * 3600.0


def disturbed(folder: Path, *changes: tuple[str, str]) -> Path:
    write_scenario(folder)
    (folder / "crossings.csv").write_text(CROSSINGS, encoding="utf-8")
    file = folder / "scenario.toml"
    text = file.read_text("utf-8") + DISRUPTIONS
    for old, new in changes:
        text = text.replace(old, new, 1)
    file.write_text(text, encoding="utf-8")
    return folder


def test_without_a_word_of_it_nothing_goes_wrong_and_points_move_in_no_time(tmp_path: Path) -> None:
    write_scenario(tmp_path)
    scenario = load(tmp_path)
    assert scenario.disruptions == UNDISTURBED
    assert scenario.line.crossings == ()
    assert {(item.throw_s, item.proof_s) for item in scenario.line.turnouts} == {(0.0, 0.0)}


def test_what_is_beside_the_track_is_read_in_si_units(tmp_path: Path) -> None:
    disturbed(tmp_path)
    replace(tmp_path, "turnouts.csv", "fouling_end_km\n", "fouling_end_km,throw_s\n")
    replace(tmp_path, "turnouts.csv", "1.26\n", "1.26,5.0\n")
    replace(tmp_path, "turnouts.csv", "1.61\n", "1.61,6\n")
    scenario = load(tmp_path)
    assert [item.throw_s for item in scenario.line.turnouts] == [5.0, 6.0]
    assert scenario.line.crossings == (Crossing("road", 2600.0, 2610.0, 1500.0, 20.0),)
    work_s = SEVEN_S + 600.0, SEVEN_S + 1200.0
    rail_s = SEVEN_S, np.inf, SEVEN_S + 60.0
    assert scenario.disruptions == Disruptions(
        closures=(
            Closure("tamping", Cause.WORK, ("south-1",), 2000.0, 2200.0, *work_s, SEVEN_S + 1530.0),
            # Without tracks it lies across all of them, and without a release it is on time.
            Closure(
                "cabling",
                Cause.WORK,
                ("north-1", "middle-1", "middle-2"),
                1000.0,
                1300.0,
                *work_s,
                work_s[1],
            ),
            Closure("rail", Cause.FAILURE, ("north-1",), 500.0, 600.0, *rail_s),
        ),
        points_failures=(PointsFailure("parting", SEVEN_S + 120.0, SEVEN_S + 240.0),),
        obstacles=(Obstacle("road", SEVEN_S + 300.0, SEVEN_S + 330.0),),
        points_failure_ratio=0.025,
        points_repair_s=120.0,
        obstacle_ratio=0.01,
        obstacle_s=45.0,
    )


CASES = {
    "zone backwards": ("end_km = 2.2", "end_km = 1.9", "work_zones.0.end_km"),
    "zone outside": ("end_km = 2.2", "end_km = 4.0", "work_zones.0.end_km"),
    "zone track": ('["south-1"]', '["south-9"]', "work_zones.0.tracks"),
    "zone other track": ('["south-1"]', '["north-1"]', "work_zones.0.tracks"),
    "zone twice": ('id = "cabling"', 'id = "tamping"', "work_zones.1.id"),
    "zone named as points": ('id = "cabling"', 'id = "joining"', "work_zones.1.id"),
    "zone back in time": ('to = "07:20:00"', 'to = "07:05:00"', "work_zones.0.to"),
    "zone released before": ("07:25:30", "07:09:00", "work_zones.0.released"),
    "zone before its tracks": ("start_km = 2.0", "start_km = 1.5", "work_zones.0.start_km"),
    "zone with a bare name": ('["south-1"]', '"south-1"', "work_zones.0.tracks"),
    "zone with a bare clock": ('"07:25:30"', "07:25:30", "work_zones.0.released"),
    "zone no clock": ("07:25:30", "soon", "work_zones.0.released"),
    "zone without begin": ('from = "07:10:00"\n', "", "work_zones.0.from"),
    "zone unknown key": ('released = "', 'relased = "', "work_zones.0.relased"),
    "mistake back in time": ("07:01:00", "06:59:59", "equipment_faults.0.to"),
    "mistake at a start": ("start_km = 0.5", "start_km = 0.0", "equipment_faults.0.start_km"),
    "unknown points": ('"parting"', '"partin"', "points_failures.0.turnout"),
    "points back in time": ("07:04:00", "07:02:00", "points_failures.0.to"),
    "unknown crossing": ('crossing = "road"', 'crossing = "rod"', "crossing_obstacles.0.crossing"),
    "share": ("percent = 2.5", "percent = 250.0", "random_disruptions.points_failure_percent"),
    "repair": ("repair_s = 120.0", "repair_s = 0.0", "random_disruptions.points_repair_s"),
}


@pytest.mark.parametrize(("old", "new", "where"), CASES.values(), ids=CASES)
def test_every_contradiction_is_named_where_it_stands(
    tmp_path: Path, old: str, new: str, where: str
) -> None:
    with pytest.raises(ScenarioError) as caught:
        load(disturbed(tmp_path, (old, new)))
    (mistake,) = caught.value.mistakes
    assert mistake.file == "scenario.toml"
    assert mistake.where == where
    assert mistake.allowed


def test_a_stretch_may_be_closed_between_the_trains_that_start_in_it(tmp_path: Path) -> None:
    times = ('"07:00:00"\nto = "07:01:00"', '"07:00:30"\nto = "07:05:00"')
    loaded = load(disturbed(tmp_path, ("start_km = 0.5", "start_km = 0.0"), times))
    assert loaded.disruptions.closures[-1].start_m == 0.0


CROSSING_CASES = {
    "no length": ("2.61", "2.6", "row 2, column end_km"),
    "backwards": ("2.61", "2.5", "row 2, column end_km"),
    "strike-in at the crossing": ("1.5,20", "2.6,20", "row 2, column strike_in_km"),
    # s1 begins at 1.6 km: a train that is kept out of s2 may stop anywhere in it.
    "strike-in behind a stop": ("1.5,20", "1.7,20", "row 2, column strike_in_km"),
    "strike-in outside": ("1.5,20", "-0.5,20", "row 2, column strike_in_km"),
    "across a boundary": ("2.6,2.61,1.5", "1.599,1.62,-0.2", "row 2, column start_km"),
    "in points": ("2.6,2.61,1.5", "1.605,1.62,-0.2", "row 2, column start_km"),
    "closing": ("1.5,20", "1.5,-1", "row 2, column closing_s"),
}


@pytest.mark.parametrize(("old", "new", "where"), CROSSING_CASES.values(), ids=CROSSING_CASES)
def test_a_crossing_must_make_sense_on_its_line(
    tmp_path: Path, old: str, new: str, where: str
) -> None:
    disturbed(tmp_path)
    replace(tmp_path, "crossings.csv", old, new)
    with pytest.raises(ScenarioError) as caught:
        load(tmp_path)
    (mistake,) = caught.value.mistakes
    assert (mistake.file, mistake.where) == ("crossings.csv", where)


def test_a_crossing_is_not_named_as_points(tmp_path: Path) -> None:
    disturbed(tmp_path, ('crossing = "road"', 'crossing = "parting"'))
    replace(tmp_path, "crossings.csv", "road,", "parting,")
    with pytest.raises(ScenarioError) as caught:
        load(tmp_path)
    (mistake,) = caught.value.mistakes
    assert (mistake.file, mistake.where) == ("crossings.csv", "row 2, column id")


def test_a_crossing_has_its_name_once(tmp_path: Path) -> None:
    disturbed(tmp_path)
    replace(tmp_path, "crossings.csv", CROSSINGS, CROSSINGS + "road,3.2,3.21,1.5,20\n")
    with pytest.raises(ScenarioError, match="row 3, column id"):
        load(tmp_path)


def test_a_column_that_may_be_absent_may_not_be_empty(tmp_path: Path) -> None:
    write_scenario(tmp_path)
    replace(tmp_path, "turnouts.csv", "fouling_end_km\n", "fouling_end_km,throw_s\n")
    replace(tmp_path, "turnouts.csv", "1.26\n", "1.26,\n")
    replace(tmp_path, "turnouts.csv", "1.61\n", "1.61,6\n")
    with pytest.raises(ScenarioError, match="row 2, column throw_s: is empty"):
        load(tmp_path)
