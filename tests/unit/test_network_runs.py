"""Networks that users asked for run as they wanted, and delay passes on with the stock."""

from pathlib import Path

import numpy as np
import pytest

from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.step.records import RunRecord
from kankaku.scenarios.loading.load import load
from tests.networks import (
    CALL,
    LOOP,
    MAIN,
    NODE,
    PLATFORM,
    STOCK,
    TERMINAL,
    TRACK,
    Files,
    arrival_s,
    departure_s,
    dwells,
    network,
    row_of,
    run_network,
    stations,
)

OPERATIONS = ("close_up", "two_stage")
STEP_S = 0.5


def line(**files: str) -> Files:
    """Return a network of three stations at km 0, 1.5 and 3.0."""
    stops = stations(a=0.0, d=1.5, i=3.0), dwells("a", "d", "i")
    common = {"scenario.toml": MAIN, "rolling_stock.toml": STOCK}
    return {
        **common,
        "stations.csv": stops[0],
        "dwell_stations.csv": stops[1],
        **{f"{stem}.csv": text for stem, text in files.items()},
    }


PARTING = line(
    nodes=NODE
    + "W,-0.2,boundary,-0.2,-0.2,0,0\np,0.6,points,0.55,0.65,4,1\n"
    + "E,3.3,boundary,3.3,3.3,0,0\nB,1.8,boundary,1.8,1.8,0,0\n",
    tracks=TRACK + "main,W,p,rising,1\nend,p,E,rising,1\nbranch,p,B,rising,2\n",
    platforms=PLATFORM + "a,main,-0.11,0.01,0.0\nd,branch,1.39,1.51,1.5\ni,end,2.89,3.01,3.0\n",
    services="train,train_type\nm01,unit\nb01,unit\n",
    calls=CALL
    + "m01,a,main,07:00:00,07:00:40\nm01,i,end,07:04:10,07:04:30\n"
    + "b01,a,main,07:01:30,07:02:10\nb01,d,branch,07:04:10,07:04:30\n",
)

OVERTAKING = line(
    nodes=NODE
    + "W,-0.2,boundary,-0.2,-0.2,0,0\nw,1.1,points,1.05,1.15,4,1\n"
    + "e,1.7,points,1.65,1.75,4,1\nE,3.3,boundary,3.3,3.3,0,0\n",
    tracks=TRACK + "west,W,w,rising,1\nd1,w,e,rising,1\nd2,w,e,rising,2\neast,e,E,rising,1\n",
    platforms=PLATFORM
    + "a,west,-0.11,0.01,0.0\nd,d1,1.39,1.51,1.5\nd,d2,1.39,1.51,1.5\ni,east,2.89,3.01,3.0\n",
    services="train,train_type\nx01,unit\nl01,unit\n",
    calls=CALL
    + "x01,a,west,07:01:40,07:02:00\nx01,i,east,07:05:00,07:05:20\n"
    + "l01,a,west,07:00:00,07:00:40\nl01,d,d2,07:02:30,07:04:20\n"
    + "l01,i,east,07:06:20,07:06:40\n",
)

ONE_TRACK = line(
    nodes=NODE + "W,-0.2,boundary,-0.2,-0.2,0,0\nE,3.3,boundary,3.3,3.3,0,0\n",
    tracks=TRACK + "main,W,E,rising,1\n",
    platforms=PLATFORM + "a,main,-0.11,0.01,0.0\nd,main,1.39,1.51,1.5\ni,main,2.89,3.01,3.0\n",
    services="train,train_type\nn1,unit\ns1,unit\nn2,unit\n",
    calls=CALL
    + "n1,a,main,07:00:00,07:00:30\nn1,d,main,07:02:30,07:03:00\nn1,i,main,07:05:00,07:05:30\n"
    + "s1,d,main,07:05:00,07:05:30\ns1,i,main,07:07:30,07:08:00\n"
    + "n2,a,main,07:05:00,07:05:30\nn2,d,main,07:07:30,07:08:00\nn2,i,main,07:10:30,07:11:00\n",
)

SHORT = {
    **ONE_TRACK,
    "services.csv": "train,train_type\nm1,unit\nm2,unit\nm3,unit\n",
    "calls.csv": CALL
    + "m1,a,main,07:00:00,07:00:40\nm1,d,main,07:02:35,07:02:55\nm1,i,main,07:04:50,07:05:10\n"
    + "m2,a,main,07:01:30,07:02:10\nm2,d,main,07:04:05,07:04:25\n"
    + "m3,a,main,07:03:00,07:03:40\nm3,d,main,07:05:35,07:05:55\nm3,i,main,07:07:50,07:08:10\n",
}

PARALLEL = line(
    nodes=NODE + "W,-0.2,boundary,-0.2,-0.2,0,0\nE,3.3,boundary,3.3,3.3,0,0\n",
    tracks=TRACK + "one,W,E,rising,1\ntwo,W,E,rising,2\n",
    platforms=PLATFORM
    + "a,one,-0.11,0.01,0.0\nd,one,1.39,1.51,1.5\ni,one,2.89,3.01,3.0\n"
    + "a,two,-0.11,0.01,0.0\nd,two,1.39,1.51,1.5\ni,two,2.89,3.01,3.0\n",
    services="train,train_type\nm1,unit\nr1,unit\n",
    calls=CALL
    + "m1,a,one,07:00:00,07:00:40\nm1,d,one,07:02:35,07:02:55\nm1,i,one,07:04:50,07:05:10\n"
    + "r1,a,two,07:00:00,07:00:40\nr1,d,two,07:02:35,07:02:55\nr1,i,two,07:04:50,07:05:10\n",
)


def good(record: RunRecord) -> RunRecord:
    """Return a record of a run in which nothing went wrong."""
    assert record.violations == ()
    assert record.unfinished == ()
    assert record.completed.all()
    return record


def alone(folder: Path, files: Files, train: str) -> RunRecord:
    """Run one of the trains of a network alone."""
    calls = [row for row in files["calls.csv"].splitlines() if row.startswith(f"{train},")]
    services = f"train,train_type\n{train},unit\n"
    scenario = network(folder, files, services=services, calls=CALL + "\n".join(calls))
    return good(run_network(scenario)[0])


@pytest.mark.parametrize("operation", OPERATIONS)
def test_a_branch_has_stations_and_trains_of_its_own(tmp_path: Path, operation: str) -> None:
    scenario = network(tmp_path / "both", PARTING)
    routes = {service.train: service.route for service in scenario.timetable.services}
    assert routes == {"m01": ("main", "end"), "b01": ("main", "branch")}
    record = good(run_network(scenario, operation)[0])
    for train, station in (("m01", "i"), ("b01", "d")):
        least = alone(tmp_path / train, PARTING, train)
        assert arrival_s(record, train, station) == arrival_s(least, train, station)


@pytest.mark.parametrize("operation", OPERATIONS)
def test_a_rapid_train_overtakes_one_that_waits_in_the_loop(tmp_path: Path, operation: str) -> None:
    scenario = network(tmp_path / "both", OVERTAKING)
    assert scenario.timetable.services[0].route == ("west", "d1", "east")
    record = good(run_network(scenario, operation)[0])
    assert departure_s(record, "l01", "a") < departure_s(record, "x01", "a")
    assert arrival_s(record, "x01", "i") < arrival_s(record, "l01", "i")
    least = alone(tmp_path / "alone", OVERTAKING, "x01")
    assert arrival_s(record, "x01", "i") == arrival_s(least, "x01", "i")


def test_the_local_train_waits_for_a_rapid_one_that_is_late(tmp_path: Path) -> None:
    scenario = network(tmp_path, OVERTAKING)
    record, engine = run_network(scenario, delays_s={"x01": {"a": 120.0}})
    good(record)
    assert departure_s(record, "x01", "a") == 25_200.0 + 100.0 + 20.0 + 120.0
    # It goes on when the other one's tail has left the points, 5 s are over and it has run there.
    cleared_s = engine.passes_s(row_of(record, "x01"), 1750.0 + 100.0)
    assert engine.passes_s(row_of(record, "l01"), 1650.0) > cleared_s + 5.0
    assert arrival_s(record, "x01", "i") < arrival_s(record, "l01", "i")


@pytest.mark.parametrize("late_s", [0.0, 200.0])
def test_a_train_begins_on_the_way_between_others(tmp_path: Path, late_s: float) -> None:
    record, engine = run_network(network(tmp_path, ONE_TRACK), delays_s={"n1": {"a": late_s}})
    good(record)
    entered_s = next(seen.time_s for seen in engine.seen if row_of(record, "s1") in seen.entered)
    # Not before it is booked, nor before the train ahead has left the place.
    ahead_s = engine.passes_s(row_of(record, "n1"), 1500.0 + 100.0)
    assert entered_s == pytest.approx(max(25_500.0, ahead_s), abs=STEP_S)
    order = [arrival_s(record, train, "i") for train in ("n1", "s1", "n2")]
    assert order == sorted(order)


def test_before_a_train_begins_on_the_way_others_follow_those_before_it(tmp_path: Path) -> None:
    """n2 runs close behind n1, which is late, towards the place where s1 will begin."""
    calls = ONE_TRACK["calls.csv"].replace("n1,d,main,07:02:30,07:03:00\n", "")
    scenario = network(tmp_path, ONE_TRACK, calls=calls)
    record, engine = run_network(scenario, delays_s={"n1": {"a": 275.0}})
    good(record)
    rows = [row_of(record, train) for train in ("n1", "s1", "n2")]
    assert departure_s(record, "n2", "a") < engine.passes_s(rows[0], 1500.0)
    order = [engine.passes_s(row, 2000.0) for row in rows]
    assert order == sorted(order)
    # It stops the margin short of where the tail of s1 will be.
    entered = next(n for n, seen in enumerate(engine.seen) if rows[1] in seen.entered)
    assert engine.front_m[: entered + 1, rows[2]].max() <= 1400.0 - 25.0 + 0.1


def test_a_train_that_ends_on_the_way_is_gone_when_its_stop_is_over(tmp_path: Path) -> None:
    record, engine = run_network(network(tmp_path / "all", SHORT))
    good(record)
    left_s = next(seen.time_s for seen in engine.seen if row_of(record, "m2") in seen.left)
    assert left_s == departure_s(record, "m2", "d") == 25_465.0
    assert record.standstills.duration_s.sum() == 0.0
    least = alone(tmp_path / "alone", SHORT, "m3")
    assert arrival_s(record, "m3", "i") == arrival_s(least, "m3", "i")


def test_trains_on_tracks_side_by_side_know_nothing_of_each_other(tmp_path: Path) -> None:
    record, engine = run_network(network(tmp_path, PARALLEL))
    good(record)
    assert record.arrival_s[0].tolist() == record.arrival_s[1].tolist()
    assert (engine.front_m[:, 0] == engine.front_m[:, 1]).all()


@pytest.mark.parametrize(("files", "first", "second"), [(LOOP, "r1", "f2"), (TERMINAL, "r1", "f1")])
def test_who_arrives_late_departs_late(
    tmp_path: Path, files: Files, first: str, second: str
) -> None:
    scenario = network(tmp_path, files)
    late = {first: {"a": 180.0}}
    record = good(run_network(scenario, delays_s=late)[0])
    arrived_s = arrival_s(record, first, "b")
    booked_s = float(record.world.booked_departure_s[row_of(record, second), 0])
    assert arrived_s + 60.0 > booked_s
    assert departure_s(record, second, "b") == pytest.approx(arrived_s + 60.0, abs=STEP_S)


def test_who_arrives_in_time_departs_in_time(tmp_path: Path) -> None:
    record = good(run_network(network(tmp_path))[0])
    assert departure_s(record, "f2", "b") == 25_620.0
    # As the train that it was it left its last call, and in that moment it came.
    assert departure_s(record, "r1", "b") == arrival_s(record, "f2", "b")


def test_delay_passes_on_with_the_stock_as_far_as_the_reserve_does_not_take_it(
    tmp_path: Path,
) -> None:
    scenario = network(tmp_path)
    departs_s = []
    for late_s in (0.0, 60.0, 120.0, 180.0):
        record = good(run_network(scenario, delays_s={"r1": {"b": late_s}})[0])
        departs_s.append(departure_s(record, "f2", "b") - 25_200.0)
    # The stock arrives after 263 s and takes 60 s to turn back; 420 s are booked.
    assert departs_s[:2] == [420.0, 420.0]
    assert departs_s[2] == pytest.approx(263.0 + 60.0 + 120.0, abs=STEP_S)
    assert departs_s[3] == pytest.approx(263.0 + 60.0 + 180.0, abs=STEP_S)


SHIPPED = ("terminal", "branch", "overtaking", "single_track", "loop_line")


def shipped(name: str) -> Scenario:
    """Return a shipped network."""
    return load(Path("scenarios") / name)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_networks_are_booked_as_trains_can_run(name: str) -> None:
    assert shipped(name).warnings == ()


@pytest.mark.parametrize("name", ["branch", "overtaking"])
def test_shipped_networks_run_without_anything_going_wrong(name: str) -> None:
    record = good(run_network(shipped(name))[0])
    late_s = record.arrival_s - record.world.booked_arrival_s[:, :-1]
    assert np.nanmax(late_s) < 1.0


def test_a_ring_goes_on_where_it_is_cut() -> None:
    scenario = shipped("loop_line")
    services = {service.train: service for service in scenario.timetable.services}
    outer, following = services["o1a"], services["o1b"]
    assert outer.next_train == following.train
    # In the same direction: as it stands, and at once.
    assert following.turn_back_s == following.calls[0].minimum_dwell_s == 0.0
    tracks = scenario.line.track_by_id
    ends = tracks[outer.calls[-1].track], tracks[following.calls[0].track]
    assert ends[0].place == ends[1].place == "outer-ring"
    assert outer.calls[-1].stop_m - following.calls[0].stop_m == pytest.approx(12_000.0)
