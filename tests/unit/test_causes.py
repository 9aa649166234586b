"""What held a train up at a moment, and who delayed whom, in a queue worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest

from kankaku.analysis.tables.causes import Seen
from kankaku.analysis.tables.delay_tree import (
    DELAY_EDGES,
    DELAY_SHARES,
    branches,
    delay_tree,
    origins,
)
from kankaku.analysis.tables.run_tables import run_tables
from kankaku.testing.example_lines import two_station_scenario
from tests.property.runs import run
from tests.records import READY_S, make_record, punctual, run_times_s, three_station_world
from tests.unit.test_remaining_stops import queue


@pytest.fixture(scope="module")
def seen() -> Seen:
    record = queue()
    return Seen(run_tables(record, run_times_s(record.world, 90.0, 110.0)))


def test_a_moment_is_told_by_the_last_sample_until_then(seen: Seen) -> None:
    sample = seen.sample("T2", READY_S + 210.7)
    assert sample is not None
    assert (sample.time_s, sample.cause) == (READY_S + 210.0, "T1")
    assert seen.sample("T2", READY_S + 100.0) is None
    assert seen.sample("T2", READY_S + 2000.0) is None
    assert seen.sample("nobody", READY_S) is None


def test_a_train_is_bound_since_its_first_slow_sample(seen: Seen) -> None:
    assert seen.bound_since_s("T2", READY_S + 220.0) == READY_S + 200.0
    assert np.isnan(seen.bound_since_s("T2", READY_S + 190.0))


def test_the_chain_goes_through_a_train_that_had_to_stand_itself(seen: Seen) -> None:
    near, far = seen.chain("T3", READY_S + 340.0)
    assert (near.name, near.state, near.station, near.beyond_booked_s) == (
        "T2",
        "at_platform",
        "mid",
        0.0,
    )
    assert (far.name, far.state, far.station, far.overstay_s) == ("T1", "at_platform", "mid", 100.0)
    assert seen.chain("T1", READY_S + 200.0) == []


@pytest.mark.parametrize("delay_s", [60.0, 150.0])
def test_the_chain_of_a_stop_is_the_one_of_the_table(delay_s: float) -> None:
    """The table asks the record of the run, this the tables."""
    scenario = two_station_scenario(6, 60.0, spacing_m=2000.0, run_s=110.0)
    drawn_s = np.zeros((6, 2))
    drawn_s[0, 1] = delay_s
    tables = run_tables(run(scenario, delay_s=drawn_s)[0])
    asked = Seen(tables)
    stops = tables.remaining_stops.to_dict("records")
    assert stops
    for stop in stops:
        chain = asked.chain(str(stop["train"]), float(stop["start_s"]))
        told = [(link.name, link.state, link.station) for link in chain]
        assert told[0] == (stop["cause"], stop["cause_state"], stop["cause_station"])
        first = (stop["first_cause"], stop["first_cause_state"], stop["first_cause_station"])
        assert told[-1] == first
        assert len(told) == stop["links"] + 1


def test_the_shares_of_every_call_sum_up_to_its_lateness(seen: Seen) -> None:
    shares = delay_tree(seen).shares
    assert list(shares.columns) == [column.name for column in DELAY_SHARES]
    calls = seen.run.calls.set_index(["train", "sequence"])
    late_s = calls["unhindered_arrival_s"] - calls["booked_arrival_s"]
    for secondary, wanted_s in ((True, calls["secondary_delay_s"]), (False, late_s)):
        own = shares[shares["secondary"] == secondary].groupby(["train", "sequence"])
        sums_s = own["share_s"].sum().reindex(calls.index, fill_value=0.0)
        assert sums_s.to_numpy() == pytest.approx(np.maximum(wanted_s, 0.0), abs=0.005)
        assert sums_s.max() > 50.0


def test_delay_goes_from_the_train_that_overstays_through_the_next_to_the_last(seen: Seen) -> None:
    tree = delay_tree(seen)
    assert list(tree.edges.columns) == [column.name for column in DELAY_EDGES]
    first, second, third = branches(tree, "T1", "mid")
    assert (first.train, first.by, first.depth) == ("T1", "", 0)
    assert (second.train, second.by, second.depth) == ("T2", "T1", 1)
    # T2 arrives at mid at 325, 75 s late of what is booked: all of that T1 has handed on.
    assert second.time_s == READY_S + 325.0
    assert second.lost_s == pytest.approx(75.0)
    assert (third.train, third.by, third.depth) == ("T3", "T2", 2)
    costliest = origins(tree).iloc[0]
    assert costliest[["origin_train", "origin_station", "origin_kind", "trains"]].tolist() == [
        "T1",
        "mid",
        "overstay",
        2,
    ]
    assert costliest["lost_s"] == pytest.approx(tree.edges["lost_s"].sum())


def test_without_delay_nobody_delays_anybody() -> None:
    world = three_station_world()
    tables = run_tables(make_record(world, *punctual(world)), run_times_s(world, 100.0, 120.0))
    tree = delay_tree(Seen(tables))
    assert tree.edges.empty
    assert tree.shares.empty
    assert origins(tree).empty


def test_who_is_in_time_and_in_the_way_is_an_origin_itself() -> None:
    record = queue()
    drawn_s = np.zeros((3, 3))
    # T1 is where it was, but as if booked so: nobody can owe its lateness to anybody.
    booked = replace(record, dwell_delay_s=drawn_s)
    tables = run_tables(booked, run_times_s(record.world, 90.0, 110.0))
    calls = tables.calls.copy()
    first = calls["train"] == "T1"
    calls.loc[first, "secondary_delay_s"] = 0.0
    calls.loc[first, "unhindered_arrival_s"] = calls.loc[first, "booked_arrival_s"]
    edges = delay_tree(Seen(replace(tables, calls=calls))).edges
    assert set(edges[edges["train"] == "T2"]["origin_kind"]) == {"in_the_way"}
