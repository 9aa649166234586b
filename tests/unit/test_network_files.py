"""Files of a network: every mistake is told with file, row, column and what is allowed."""

from pathlib import Path

import pytest

from kankaku.railway.plan.line import Direction, Gradient, SpeedLimit
from kankaku.railway.plan.met import line_met
from kankaku.scenarios.reading.mistakes import Mistake
from tests.networks import LOOP, TERMINAL, changed, mistakes_of, network


def assert_told(found: tuple[Mistake, ...], file: str, expected: tuple[str, str, str]) -> None:
    """Find the mistake at a place of a file, and in it what is wrong and what is allowed."""
    where, problem, allowed = expected
    told = {(mistake.file, mistake.where): mistake for mistake in found}
    assert problem in told[file, where].problem
    assert allowed in told[file, where].allowed


def test_both_directions_become_tracks_of_their_own_in_their_own_coordinate(tmp_path: Path) -> None:
    line = network(tmp_path).line
    tracks = {track.id: track for track in line.network}
    assert list(tracks) == ["left", "left~", "up", "down", "right", "right~"]
    assert (tracks["left"].start_m, tracks["left"].end_m) == (-150.0, 750.0)
    assert (tracks["left~"].start_m, tracks["left~"].end_m) == (1250.0, 2150.0)
    assert (tracks["left~"].from_node, tracks["left~"].to_node) == ("w", "A")
    assert tracks["left~"].place == tracks["left"].place == "left"
    assert tracks["down"].direction is Direction.FALLING
    assert line.platform_at["a", "left"].stop_m == 0.0
    # At km -0.1: as far from the other end of the platform.
    assert line.platform_at["a", "left~"].stop_m == pytest.approx(2100.0)
    assert [turnout.id for turnout in line.turnouts] == ["w", "e"]
    assert line.fouling_m(0, Direction.FALLING) == (1220.0, 1280.0)


def test_the_next_train_begins_where_the_stock_stands(tmp_path: Path) -> None:
    scenario = network(tmp_path)
    r1, _, f2 = scenario.timetable.services
    assert (r1.next_train, f2.turn_back_s) == ("f2", 60.0)
    # The front is where the tail was, at km 1.9.
    assert f2.calls[0].stop_m == pytest.approx(100.0)
    # 20 s of the 60 s were over when the train before left its last call.
    assert f2.calls[0].minimum_dwell_s == 40.0


def test_limits_and_gradients_are_met_in_the_running_direction_and_on_their_track(
    tmp_path: Path,
) -> None:
    scenario = network(
        tmp_path,
        limits="start_km,end_km,limit_kmh,track\n0.2,0.6,54,\n0.8,1.1,36,up\n",
        gradients="start_km,end_km,gradient_permil\n1.3,1.7,10\n",
    )
    rising = line_met(scenario.line, scenario.timetable.services[0].route)
    falling = line_met(scenario.line, scenario.timetable.services[1].route)
    assert rising.limits == (
        SpeedLimit(200.0, 600.0, 15.0),
        SpeedLimit(800.0, 1100.0, 10.0, "up"),
    )
    assert falling.limits == (SpeedLimit(1400.0, 1800.0, 15.0),)
    assert rising.gradients == (Gradient(1300.0, 1700.0, 0.01),)
    assert falling.gradients == (Gradient(300.0, 700.0, -0.01),)


def test_what_is_booked_too_fast_is_asked_of_what_a_train_meets(tmp_path: Path) -> None:
    """A limit beside the second station slows the way there and back, not the other half."""
    slow = network(tmp_path / "slow", limits="start_km,end_km,limit_kmh\n0.2,0.7,18\n")
    told = [warning for warning in slow.warnings if "at least" in warning]
    assert len(told) == 2
    assert "from 'a' to 'm': booked 100 s" in told[0]
    assert "from 'm' to 'a': booked 100 s" in told[1]


def test_a_falling_train_climbs_what_falls_with_chainage(tmp_path: Path) -> None:
    steep = "start_km,end_km,gradient_permil\n0.1,0.7,-80\n"
    force = "starting_force_kn = 180.0"
    weak = changed(LOOP, "rolling_stock.toml", force, "starting_force_kn = 120.0")
    (mistake,) = mistakes_of(tmp_path, LOOP, gradients=steep, **weak)
    assert mistake.where == "train.unit.traction.starting_force_kn"
    assert "from 'm' to 'a'" in mistake.problem
    # It stalls on the way down from km 0.7 to km 0.1.
    stalls_km = float(mistake.problem.split("km ")[1].split(",")[0])
    assert 0.1 < stalls_km < 0.7


LINE_MISTAKES = [
    (
        "nodes.csv",
        "w,0.75,points,0.72,0.78",
        "w,0.75,points,0.76,0.78",
        ("row 3, column km", "0.75 lies outside its fouling section", "from 0.76 to 0.78"),
    ),
    (
        "nodes.csv",
        "B,2.15,buffer,2.15,2.15",
        "B,2.15,buffer,2.1,2.15",
        ("row 5, column fouling_end_km", "a buffer has no fouling section", "2.15, or points"),
    ),
    (
        "nodes.csv",
        "A,-0.15,buffer",
        "A,-0.15,bumper",
        ("row 2, column kind", "'bumper' is not allowed", "joint or points or buffer or boundary"),
    ),
    (
        "nodes.csv",
        "B,2.15,buffer,2.15,2.15,0,0\n",
        "B,2.15,buffer,2.15,2.15,0,0\nC,3,buffer,3,3,0,0\n",
        ("row 6, column id", "no track begins or ends there", "a track"),
    ),
    (
        "nodes.csv",
        "B,2.15,buffer,2.15,2.15,0,0\n",
        "B,2.15,buffer,2.15,2.15,0,0\nB,2.15,buffer,2.15,2.15,0,0\n",
        ("row 6, column id", "'B' stands in row 5 already", "every id once"),
    ),
    (
        "tracks.csv",
        "left,A,w",
        "left,A,v",
        ("row 2, column to_node", "unknown node 'v'", "A, w, e, B"),
    ),
    (
        "tracks.csv",
        "left,A,w,both,1.5",
        "left,w,A,both,1.5",
        ("row 2, column to_node", "node 'A' does not lie after 'w'", "above km 0.75"),
    ),
    (
        "tracks.csv",
        "down,w,e,falling,2",
        "down,w,e,falling,1",
        (
            "row 4, column across",
            "track 'up' of row 3 meets 'w' at the same place",
            "another place across",
        ),
    ),
    (
        "tracks.csv",
        "right,e,B,both,1.5",
        "right,e,B,sideways,1.5",
        ("row 5, column direction", "'sideways' is not allowed", "rising or falling or both"),
    ),
    (
        "tracks.csv",
        "right,e,B,both,1.5\n",
        "right,e,B,both,1.5\nright,e,B,rising,3\n",
        ("row 6, column id", "'right' stands in row 5 already", "every id once"),
    ),
    (
        "platforms.csv",
        "b,right,1.89,2.01,2.0",
        "b,right,1.09,2.01,2.0",
        (
            "row 5, column start_km",
            "the platform lies outside its track 'right'",
            "from 1.15 to 2.15",
        ),
    ),
]


@pytest.mark.parametrize(("name", "old", "new", "told"), LINE_MISTAKES)
def test_a_mistake_of_the_line(
    tmp_path: Path, name: str, old: str, new: str, told: tuple[str, str, str]
) -> None:
    assert_told(mistakes_of(tmp_path, LOOP, **changed(LOOP, name, old, new)), name, told)


STRETCHES = [
    ("limits", "limit_kmh", "0,1,60,lef", ("row 2, column track", "unknown track 'lef'", "'left'")),
    ("limits", "limit_kmh", "0,3,60,", ("row 2, column end_km", "outside the line", "to 2.15")),
    (
        "gradients",
        "gradient_permil",
        "0,1,5,\n0.5,1.5,7,",
        ("row 3, column start_km", "the stretch at 0.5 overlaps the one of row 2", "not below 1"),
    ),
    (
        "gradients",
        "gradient_permil",
        "0,1,5,\n0.5,0.7,7,left",
        ("row 3, column start_km", "the stretch at 0.5 overlaps the one of row 2", "not below 1"),
    ),
    ("curves", "radius_m", "0.5,0.5,300,", ("row 2, column end_km", "0.5", "above 0.5")),
]


@pytest.mark.parametrize(("stem", "value", "rows", "told"), STRETCHES)
def test_a_mistake_of_what_lies_on_tracks(
    tmp_path: Path, stem: str, value: str, rows: str, told: tuple[str, str, str]
) -> None:
    text = f"start_km,end_km,{value},track\n{rows}\n"
    found = mistakes_of(tmp_path, LOOP, **{stem: text})
    assert len(found) == 1
    assert_told(found, f"{stem}.csv", told)


def test_limits_of_one_track_may_lie_within_limits_of_all(tmp_path: Path) -> None:
    limits = "start_km,end_km,limit_kmh,track\n0,2,60,\n0.1,0.5,45,left\n"
    assert len(network(tmp_path, limits=limits).line.limits) == 2


def test_blocks_cover_every_physical_track(tmp_path: Path) -> None:
    blocks = "id,track,start_km,end_km\nl,left,-0.15,0.75\nu,up,0.75,1.15\nr,right,1.15,2.15\n"
    (mistake,) = mistakes_of(tmp_path, LOOP, blocks=blocks)
    assert (mistake.file, mistake.where) == ("blocks.csv", "column track")
    assert mistake.problem == "track 'down' has no block"
    assert mistake.allowed == "blocks from 0.75 to 1.15"
    whole = network(tmp_path, blocks=blocks + "d,down,0.75,1.15\n").line
    assert {(block.id, block.track, block.start_m) for block in whole.blocks} == {
        ("l", "left", -150.0),
        ("l", "left~", 1250.0),
        ("u", "up", 750.0),
        ("d", "down", 850.0),
        ("r", "right", 1150.0),
        ("r", "right~", -150.0),
    }


@pytest.mark.parametrize(
    ("stem", "text", "allowed"),
    [
        ("turnouts", "id,position_km,fouling_start_km,fouling_end_km\nw,0.75,0.7,0.8\n", "nodes"),
        (
            "crossings",
            "id,start_km,end_km,strike_in_km,closing_s\nc,0.3,0.31,0.1,20\n",
            "without nodes.csv",
        ),
    ],
)
def test_files_that_only_a_chain_has(tmp_path: Path, stem: str, text: str, allowed: str) -> None:
    (mistake,) = mistakes_of(tmp_path, LOOP, **{stem: text})
    assert (mistake.file, mistake.where) == (f"{stem}.csv", "")
    assert mistake.problem == f"a network has no {stem}.csv"
    assert allowed in mistake.allowed


CALL_MISTAKES = [
    (
        "calls.csv",
        "r1,b,right,07:04:50,07:05:10",
        "r1,a,left,07:04:50,07:05:10",
        (
            "row 4, column station",
            "'a' does not lie after 'm' of row 3",
            "calls in one running direction",
        ),
    ),
    (
        "calls.csv",
        "f2,m,down,07:08:40",
        "f2,m,down,07:06:40",
        (
            "row 9, column arrival",
            "07:06:40 is earlier than the departure of row 8",
            "from 07:07:00",
        ),
    ),
    (
        "calls.csv",
        "f2,b,right,07:05:10,07:07:00",
        "f2,b,right,07:05:30,07:07:00",
        ("row 8, column arrival", "07:05:30 is not when the stock of 'r1' is ready", "07:05:10"),
    ),
    (
        "calls.csv",
        "f1,a,left,07:04:50,07:05:10",
        "f1,a,left,07:04:50,07:04:55",
        ("row 7, column departure", "a dwell of 5 s at 'a' is too short", "20 s or more"),
    ),
    (
        "calls.csv",
        "r1,m,up,07:02:40",
        "r1,m,right,07:02:40",
        ("row 3, column track", "station 'm' has no platform at track 'right'", "down, up"),
    ),
    (
        "rolling_stock.toml",
        "length_m = 100.0",
        "length_m = 115.0",
        ("row 2, column track", "a train of 115 m does not fit at 'a'", "up to 110 m"),
    ),
    (
        "services.csv",
        "r1,unit,f2",
        "r1,unit,f3",
        ("row 2, column next_train", "unknown train 'f3'", "r1, f1, f2"),
    ),
    (
        "services.csv",
        "r1,unit,f2",
        "r1,unit,r1",
        ("row 2, column next_train", "goes on as itself", "f2"),
    ),
    (
        "services.csv",
        "f1,unit,\n",
        "f1,unit,f2\n",
        (
            "row 3, column next_train",
            "'f2' has the stock of 'r1' of row 2 already",
            "every train once",
        ),
    ),
]


@pytest.mark.parametrize(("name", "old", "new", "told"), CALL_MISTAKES)
def test_a_mistake_of_the_timetable(
    tmp_path: Path, name: str, old: str, new: str, told: tuple[str, str, str]
) -> None:
    file = "services.csv" if "next_train" in told[0] else "calls.csv"
    assert_told(mistakes_of(tmp_path, LOOP, **changed(LOOP, name, old, new)), file, told)


def test_stock_goes_on_as_a_train_of_its_own_type_and_on_its_track(tmp_path: Path) -> None:
    stock = TERMINAL["rolling_stock.toml"]
    other = stock + stock.split("\n\n", 1)[1].replace("[train.unit", "[train.other")
    services = TERMINAL["services.csv"].replace("f1,unit,", "f1,other,")
    calls = TERMINAL["calls.csv"].replace("f1,b,p1", "f1,b,p2")
    found = mistakes_of(tmp_path, TERMINAL, rolling_stock=other, services=services, calls=calls)
    told = {(mistake.file, mistake.where): mistake for mistake in found}
    assert told["services.csv", "row 2, column next_train"].problem == "'f1' is of type 'other'"
    assert told["services.csv", "row 2, column next_train"].allowed == "a 'unit'"
    where = told["calls.csv", "row 4, column track"]
    assert where.problem == "'f1' begins on track 'p2', not where 'r1' ends"
    assert where.allowed == "p1"
