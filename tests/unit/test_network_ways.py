"""Trains that find no way through a network, and that stand where they may not."""

from pathlib import Path

import pytest

from tests.networks import LOOP, TERMINAL, changed, mistakes_of

WAYS = [
    ("r1,m,up", "r1,m,down", {}, "row 3", "rising trains do not use track 'down'"),
    (
        "r1,m,up,07:02:40,07:03:10\n",
        "",
        {"tracks": LOOP["tracks.csv"].replace("falling,2", "both,2")},
        "row 3",
        "2 ways to track 'right' are equally straight",
    ),
    (
        "r1,m,up,07:02:40,07:03:10\n",
        "",
        {"tracks": LOOP["tracks.csv"].replace("up,w,e,rising", "up,w,e,falling")},
        "row 3",
        "no way leads from track 'left' to 'right'",
    ),
]


@pytest.mark.parametrize(("old", "new", "others", "row", "problem"), WAYS)
def test_a_train_without_a_way(
    tmp_path: Path, old: str, new: str, others: dict[str, str], row: str, problem: str
) -> None:
    platforms = LOOP["platforms.csv"]
    if others:
        platforms = platforms.replace("m,down,0.89,1.01,0.9", "m,down,0.79,1.01,0.9")
    edited = changed(LOOP, "calls.csv", old, new)
    (mistake,) = mistakes_of(tmp_path, LOOP, platforms=platforms, **edited, **others)
    assert (mistake.file, mistake.where) == ("calls.csv", f"{row}, column track")
    assert mistake.problem == f"train 'r1': {problem}"
    assert "routes.csv" in mistake.allowed


@pytest.mark.parametrize(
    ("named", "tracks", "problem"),
    [
        ("other", ("left", "up", "right"), "unknown route 'other'"),
        ("way", ("left", "right"), "route 'way': no way from 'left' to 'right'"),
        ("way", ("left", "up"), "route 'way' does not pass track 'right'"),
        ("way", ("left", "down", "right"), "route 'way': rising trains do not use track 'down'"),
        ("way", ("left", "u", "right"), "route 'way': rising trains do not use track 'u'"),
    ],
)
def test_a_route_that_is_none(
    tmp_path: Path, named: str, tracks: tuple[str, ...], problem: str
) -> None:
    routes = "route,track\n" + "".join(f"way,{track}\n" for track in tracks)
    services = f"train,train_type,next_train,route\nr1,unit,f2,{named}\nf1,unit,,\nf2,unit,,\n"
    (mistake,) = mistakes_of(tmp_path, LOOP, routes=routes, services=services)
    assert mistake.file == "calls.csv"
    assert mistake.problem == f"train 'r1': {problem}"


@pytest.mark.parametrize(
    ("fouling", "problem", "row"),
    [
        ("x,1.6,points,1.55,1.93,4,1", "'f1' begins", 4),
        ("x,1.6,points,-0.05,1.65,4,1", "'r1' begins", 2),
    ],
)
def test_no_train_begins_within_points(
    tmp_path: Path, fouling: str, problem: str, row: int
) -> None:
    nodes = changed(TERMINAL, "nodes.csv", "x,1.6,points,1.55,1.65,4,1", fouling)
    first, *_ = mistakes_of(tmp_path, TERMINAL, **nodes)
    assert (first.file, first.where) == ("calls.csv", f"row {row}, column track")
    assert f"train {problem} in the fouling section of 'x'" in first.problem
    low, high = fouling.split(",")[3:5]
    assert first.allowed == f"a place up to {low} or from {high}"


def test_no_train_ends_within_points(tmp_path: Path) -> None:
    nodes = changed(LOOP, "nodes.csv", "e,1.15,points,1.12", "e,1.15,points,0.95")
    calls = "\n".join(LOOP["calls.csv"].splitlines()[:3])
    services = "train,train_type\nr1,unit\n"
    (mistake,) = mistakes_of(tmp_path, LOOP, calls=calls, services=services, **nodes)
    assert mistake.where == "row 3, column track"
    assert mistake.problem == "train 'r1' ends in the fouling section of 'e'"
