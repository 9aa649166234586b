"""Who goes before whom in a network, and timetables in which everybody would wait."""

from itertools import combinations
from pathlib import Path

import pytest

from kankaku.railway.plan.line import Line
from kankaku.railway.plan.passing import (
    Precursors,
    Predecessor,
    conflicting,
    passages,
    waiting_cycle,
)
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.timetable import Service
from kankaku.railway.plan.turns import orders
from kankaku.scenarios.reading.mistakes import ScenarioError
from tests.networks import CALL, JUNCTION, LENGTH_M, TERMINAL, network, run_network


def found_in(scenario: Scenario) -> tuple[Line, tuple[Service, ...], tuple[Precursors, ...]]:
    services = scenario.timetable.services
    return scenario.line, services, orders(scenario.line, services)


def test_passages_tell_where_fronts_wait_and_where_tails_have_left(tmp_path: Path) -> None:
    line = network(tmp_path).line
    rising = passages(line, ("left", "up", "right"))
    assert [(p.track, p.entry_m, p.clear_m, p.turnout) for p in rising] == [
        ("left", -150.0, 780.0, -1),
        ("up", 720.0, 1180.0, 0),
        ("right", 1120.0, 2150.0, 1),
    ]
    falling = passages(line, ("right~", "down", "left~"))
    # Mirrored: a place x of the files is 2000 - x on the way of falling trains.
    assert [(p.track, p.entry_m, p.clear_m, p.turnout) for p in falling] == [
        ("right~", -150.0, 880.0, -1),
        ("down", 820.0, 1280.0, 1),
        ("left~", 1220.0, 2150.0, 0),
    ]


@pytest.mark.parametrize(
    ("one", "other", "conflict"),
    [
        (("in", "p1"), ("in", "p1"), False),
        (("in", "p1"), ("in", "p2"), True),
        (("in", "p1"), ("p1~", "out"), True),
        (("in", "p1"), ("p2~", "out"), False),
        (("in", "p2"), ("p1~", "out"), True),
        (("in", "p2"), ("p2~", "out"), True),
        (("p1~", "out"), ("p2~", "out"), True),
    ],
)
def test_movements_at_a_scissors_conflict_if_they_share_a_track_or_cross(
    tmp_path: Path, one: tuple[str, str], other: tuple[str, str], conflict: bool
) -> None:
    line = network(tmp_path, TERMINAL).line
    assert conflicting(line, one, other) is conflict
    assert conflicting(line, other, one) is conflict


def test_movements_at_a_flat_junction(tmp_path: Path) -> None:
    line = network(tmp_path, JUNCTION).line
    moves = [("n-in", "in"), ("s-in", "in"), ("out", "n-out"), ("out", "s-out")]
    meeting = [
        (one, other) for one, other in combinations(moves, 2) if conflicting(line, one, other)
    ]
    assert meeting == [
        (("n-in", "in"), ("s-in", "in")),
        (("s-in", "in"), ("out", "n-out")),
        (("out", "n-out"), ("out", "s-out")),
    ]


def test_trains_pass_single_track_and_points_in_the_order_of_booked_times(tmp_path: Path) -> None:
    _, services, found = found_in(network(tmp_path))
    r1, f1, f2 = 0, 1, 2
    assert [service.train for service in services] == ["r1", "f1", "f2"]
    assert found[r1].waits == ((), (), (Predecessor(f1, 0),))
    assert found[f1].waits == ((), (), (Predecessor(r1, 0),))
    # It begins where r1 ends, comes behind f1, and goes through the points after both.
    assert found[f2].waits[0] == (Predecessor(r1, 2),)
    assert [before.row for before in found[f2].ahead] == [f1, f1, f1]
    assert found[r1].ahead == (Predecessor(-1, 0),) * 3


@pytest.mark.parametrize(("sooner", "first", "second"), [(False, 0, 1), (True, 1, 0)])
def test_a_junction_is_passed_in_turn_and_the_trunk_in_the_same_order(
    tmp_path: Path, *, sooner: bool, first: int, second: int
) -> None:
    calls = JUNCTION["calls.csv"]
    if sooner:
        calls = calls.replace("07:01:00,07:02:00", "07:00:00,07:00:20").replace(
            "07:04:20,07:04:40", "07:02:40,07:03:00"
        )
    _, _, found = found_in(network(tmp_path, JUNCTION, calls=calls))
    assert found[second].waits[1] == (Predecessor(first, 0),)
    assert found[second].ahead[1] == Predecessor(first, 1)
    assert found[first].waits[1] == ()


def test_a_train_that_begins_before_another_comes_is_not_behind_it(tmp_path: Path) -> None:
    calls = JUNCTION["calls.csv"] + "e1,e,in,07:00:00,07:01:00\n"
    services = JUNCTION["services.csv"] + "e1,unit\n"
    _, _, found = found_in(network(tmp_path, JUNCTION, calls=calls, services=services))
    assert found[0].ahead[1] == Predecessor(2, 0)
    assert found[2].ahead[0].row == -1


def test_a_timetable_that_everybody_can_follow_has_no_cycle(tmp_path: Path) -> None:
    line, services, found = found_in(network(tmp_path))
    assert waiting_cycle(line, services, found, {"unit": LENGTH_M}) == []


def test_trains_that_meet_on_single_track_wait_for_ever(tmp_path: Path) -> None:
    """Both reach the loop on their own track before either has left the single track ahead."""
    scenario = network(tmp_path)
    line, services, found = found_in(scenario)
    r1, f1 = services[0], services[1]
    swapped = list(found)
    # r1 waits for f1 to leave the right track, and f1 for r1 to have passed it.
    swapped[1] = found[1]._replace(waits=((Predecessor(0, 2),), *found[1].waits[1:]))
    cycle = waiting_cycle(line, services, swapped, {"unit": LENGTH_M})
    assert {services[row].train for row, _ in cycle} == {r1.train, f1.train}


def test_a_train_longer_than_the_loop_cannot_meet_another_one_there(tmp_path: Path) -> None:
    line, services, found = found_in(network(tmp_path))
    # Between the fouling sections lie 340 m; a longer train stands in one of them.
    assert waiting_cycle(line, services, found, {"unit": 339.0}) == []
    cycle = waiting_cycle(line, services, found, {"unit": 341.0})
    assert {services[row].train for row, _ in cycle} == {"r1", "f1"}


TWO_EACH_WAY = (
    CALL
    + """\
r1,a,left,07:00:00,07:01:00
r1,m,up,07:02:40,07:15:00
r1,b,right,07:17:00,07:17:20
r2,a,left,07:05:00,07:06:00
r2,m,up,07:09:30,07:17:00
r2,b,right,07:19:00,07:19:20
f1,b,right,07:01:00,07:02:00
f1,m,down,07:04:00,07:10:00
f1,a,left,07:12:00,07:12:20
f2,b,right,07:11:00,07:12:00
f2,m,down,07:14:00,07:14:20
f2,a,left,07:20:00,07:20:20
"""
)
FOUR = "train,train_type\nr1,unit\nr2,unit\nf1,unit\nf2,unit\n"


def test_a_loop_without_room_for_two_behind_each_other_is_a_deadlock(tmp_path: Path) -> None:
    """r1 lets f2 come first, f2 stands behind f1, f1 lets r2 come first, and that behind r1."""
    with pytest.raises(ScenarioError) as caught:
        network(tmp_path, calls=TWO_EACH_WAY, services=FOUR)
    (mistake,) = caught.value.mistakes
    assert mistake.file == "calls.csv"
    assert "wait for each other for ever" in mistake.problem
    for train in ("r1 at", "r2 at", "f1 at", "f2 at"):
        assert train in mistake.problem


def test_it_runs_where_r2_comes_after_f1(tmp_path: Path) -> None:
    calls = TWO_EACH_WAY.replace(
        "f1,m,down,07:04:00,07:10:00", "f1,m,down,07:04:00,07:04:20"
    ).replace("f1,a,left,07:12:00,07:12:20", "f1,a,left,07:06:00,07:06:20")
    record, _ = run_network(network(tmp_path, calls=calls, services=FOUR))
    assert record.violations == ()
    assert record.completed.all()
