"""Ways through a network: the straightest, the ambiguous, and those that are not there."""

from pathlib import Path

import pytest

from kankaku.railway.plan.line import Line
from kankaku.railway.plan.routing import joined, onward, straightest
from tests.networks import JUNCTION, LOOP, NODE, TERMINAL, TRACK, network


def test_at_points_any_track_goes_on_into_any_other_of_its_direction(tmp_path: Path) -> None:
    behind = onward(network(tmp_path, TERMINAL).line)
    assert behind["in"] == ("p1", "p2")
    assert behind["p1~"] == behind["p2~"] == ("out",)
    assert behind["p1"] == behind["out"] == ()


def test_at_a_joint_a_track_goes_on_at_its_own_place_across(tmp_path: Path) -> None:
    nodes = NODE + "A,-0.2,boundary,-0.2,-0.2,0,0\nk,1,joint,1,1,0,0\nB,2.1,boundary,2.1,2.1,0,0\n"
    tracks = TRACK + "u1,A,k,rising,1\nd1,A,k,falling,2\nu2,k,B,rising,1\nd2,k,B,falling,2\n"
    platforms = (
        "station,track,start_km,end_km,stop_km\n"
        "a,u1,-0.11,0.01,0.0\na,d1,-0.11,0.01,-0.1\nb,u2,1.89,2.01,2.0\nb,d2,1.89,2.01,1.9\n"
    )
    calls = (
        "train,station,track,arrival,departure\n"
        "r1,a,u1,07:00:00,07:00:20\nr1,b,u2,07:03:00,07:03:20\n"
        "f1,b,d2,07:00:00,07:00:20\nf1,a,d1,07:03:00,07:03:20\n"
    )
    scenario = network(
        tmp_path,
        LOOP,
        nodes=nodes,
        tracks=tracks,
        platforms=platforms,
        calls=calls,
        services="train,train_type\nr1,unit\nf1,unit\n",
    )
    assert onward(scenario.line) == {"u1": ("u2",), "d1": (), "u2": (), "d2": ("d1",)}
    assert [service.route for service in scenario.timetable.services] == [
        ("u1", "u2"),
        ("d2", "d1"),
    ]


BOTH_WAYS = LOOP["tracks.csv"].replace("down,w,e,falling", "down,w,e,both")
STOPS = LOOP["platforms.csv"].replace("m,down,0.89,1.01,0.9", "m,down,0.89,1.01,1.0")


def loop(tmp_path: Path, tracks: str = LOOP["tracks.csv"]) -> Line:
    """Return the line with a loop; its second track may be for both directions."""
    stops = LOOP["platforms.csv"] if "down,w,e,falling" in tracks else STOPS
    return network(tmp_path, tracks=tracks, platforms=stops).line


def test_the_straightest_way_has_the_least_change_of_place_across(tmp_path: Path) -> None:
    line = loop(tmp_path, BOTH_WAYS.replace("left,A,w,both,1.5", "left,A,w,both,1.2"))
    assert straightest(line, "left", "right") == (("left", "up", "right"), 0)
    line = loop(tmp_path, BOTH_WAYS.replace("right,e,B,both,1.5", "right,e,B,both,1.8"))
    assert straightest(line, "left", "right") == (("left", "down", "right"), 0)
    assert straightest(line, "right~", "left~") == (("right~", "down~", "left~"), 0)


def test_equally_straight_ways_are_counted(tmp_path: Path) -> None:
    assert straightest(loop(tmp_path, BOTH_WAYS), "left", "right").others == 1


@pytest.mark.parametrize(
    ("origin", "destination"),
    [("left", "down"), ("right", "left"), ("up", "up~"), ("left", "left~")],
)
def test_no_way_leads_against_the_direction_of_a_track(
    tmp_path: Path, origin: str, destination: str
) -> None:
    line = loop(tmp_path, LOOP["tracks.csv"].replace("up,w,e,rising", "up,w,e,both"))
    assert straightest(line, origin, destination).tracks == ()


def test_a_way_to_where_one_is_has_one_track(tmp_path: Path) -> None:
    assert straightest(loop(tmp_path), "up", "up") == (("up",), 0)


def test_ways_are_joined_where_they_meet(tmp_path: Path) -> None:
    line = network(tmp_path, JUNCTION).line
    first, second = straightest(line, "n-in", "n-in"), straightest(line, "n-in", "in")
    assert joined([first.tracks, second.tracks]) == ("n-in", "in")
    assert joined([first.tracks, ()]) == ()


@pytest.mark.parametrize("through", ["up", "down"])
def test_a_route_says_which_of_two_ways_that_are_equally_straight(
    tmp_path: Path, through: str
) -> None:
    calls = [row for row in LOOP["calls.csv"].splitlines() if row[:5] != "r1,m,"]
    scenario = network(
        tmp_path,
        tracks=BOTH_WAYS,
        platforms=STOPS,
        calls="\n".join(row for row in calls if row[:3] != "f1,"),
        services="train,train_type,next_train,route\nr1,unit,f2,way\nf2,unit,,\n",
        routes=f"route,track\nway,left\nway,{through}\nway,right\n",
    )
    assert scenario.timetable.services[0].route == ("left", through, "right")
    assert scenario.timetable.services[1].route == ("right~", "down~", "left~")
