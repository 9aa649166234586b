"""Delays, intervals and stops of cases small enough to be worked by hand."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from kankaku.analysis.tables.delay import (
    primary_delay_s,
    propagation,
    secondary_delay_s,
    technical_run_times_s,
    unhindered_arrivals_s,
)
from kankaku.analysis.tables.interstation import stop_totals
from kankaku.analysis.tables.intervals import departure_arrival_intervals
from kankaku.analysis.tables.run_tables import RunTables, run_tables
from kankaku.analysis.tables.summary import summary_frame
from kankaku.railway.motion.run_curve import fastest_run
from tests.records import (
    READY_S,
    make_record,
    punctual,
    run_times_s,
    three_station_world,
)


def hindered_follower() -> RunTables:
    """
    Return two trains of which the first overstays at ``mid`` and holds up the second.

    Worked by hand, seconds after 07:00:00. T1 arrives at mid after 90 s, at 120 instead of 130.
    It is injected 50 s there, 40 s more than its slack: it leaves at 120 + 20 + 50 = 190
    instead of 160 and arrives at east after 110 s, at 300 instead of 280. T2, booked 120 s
    later, waits for it outside mid: it arrives at 275 instead of 250, leaves at 295 (its slack
    of 10 s used up), and arrives at east at 405 instead of 400.
    """
    world = three_station_world(trains=2)
    arrival_s = READY_S + np.array([[0.0, 120.0, 300.0], [120.0, 275.0, 405.0]])
    departure_s = READY_S + np.array([[30.0, 190.0, 330.0], [150.0, 295.0, 430.0]])
    injected_s = np.array([[0.0, 50.0, 0.0], [0.0, 0.0, 0.0]])
    record = make_record(
        world,
        arrival_s,
        departure_s,
        dwell_delay_s=injected_s,
        stands=[(1, READY_S + 235.0, 20.0, 1000.0, 1)],
    )
    return run_tables(record, run_times_s(world, 90.0, 110.0))


def test_a_dwell_delay_within_the_booked_slack_is_no_primary_delay() -> None:
    injected_s = np.array([0.0, 10.0, 25.0])
    booked = np.full(3, 100.0), np.full(3, 130.0)
    assert primary_delay_s(*booked, np.full(3, 20.0), injected_s).tolist() == [0.0, 0.0, 15.0]


def test_a_minimum_dwell_above_the_booked_one_is_not_blamed_on_the_input() -> None:
    booked = np.array([100.0]), np.array([110.0])
    assert primary_delay_s(*booked, np.array([20.0]), np.array([7.0])).tolist() == [7.0]


def test_the_overstaying_train_has_primary_and_its_follower_secondary_delay() -> None:
    calls = hindered_follower().calls
    assert calls["primary_delay_s"].tolist() == [0.0, 40.0, 0.0, 0.0, 0.0, 0.0]
    assert calls["secondary_delay_s"].tolist() == [0.0, 0.0, 0.0, 0.0, 25.0, 5.0]
    assert calls["arrival_delay_s"].tolist() == [0.0, -10.0, 20.0, 0.0, 25.0, 5.0]


def test_lateness_is_unhindered_lateness_plus_secondary_delay() -> None:
    calls = hindered_follower().calls
    unhindered_s = calls["unhindered_arrival_s"] - calls["booked_arrival_s"]
    parts_s = unhindered_s.clip(lower=0.0) + calls["secondary_delay_s"]
    pd.testing.assert_series_equal(
        parts_s, calls["arrival_delay_s"].clip(lower=0.0), check_names=False
    )


def test_delay_propagation_counts_those_who_were_held_up() -> None:
    spread = propagation(hindered_follower().calls)
    assert spread.primary_delay_s == 40.0
    assert spread.secondary_delay_s == 5.0
    assert spread.ratio == pytest.approx(0.125)
    assert spread.trains_affected == 1
    assert spread.recovery_time_s == 0.0


def test_a_late_train_alone_on_the_line_has_no_secondary_delay() -> None:
    world = three_station_world(trains=1)
    injected_s = np.array([[30.0, 90.0, 0.0]])
    arrival_s = READY_S + np.array([[0.0, 140.0, 360.0]])
    departure_s = READY_S + np.array([[50.0, 250.0, 390.0]])
    record = make_record(world, arrival_s, departure_s, dwell_delay_s=injected_s)
    calls = run_tables(record, run_times_s(world, 90.0, 110.0)).calls
    assert calls["arrival_delay_s"].tolist() == [0.0, 10.0, 80.0]
    assert calls["secondary_delay_s"].tolist() == [0.0, 0.0, 0.0]


def test_a_punctual_train_that_takes_its_booked_time_has_no_secondary_delay() -> None:
    world = three_station_world(trains=1)
    record = make_record(world, *punctual(world))
    calls = run_tables(record, run_times_s(world, 90.0, 110.0)).calls
    assert calls["secondary_delay_s"].tolist() == [0.0, 0.0, 0.0]


def test_the_line_is_disturbed_from_its_first_to_its_last_event_over_a_minute_late() -> None:
    world = three_station_world(trains=2)
    arrival_s, departure_s = punctual(world)
    departure_s[0, 1] += 61.0
    arrival_s[0, 2] += 60.0
    arrival_s[1, 2] += 90.0
    calls = run_tables(
        make_record(world, arrival_s, departure_s), run_times_s(world, 90.0, 110.0)
    ).calls
    # 07:03:41 at mid until 07:08:10 at east; exactly a minute late is not over a minute.
    assert propagation(calls).recovery_time_s == 269.0


def unfinished_follower(end_s: float) -> RunTables:
    """T2 comes 40 s late to ``mid``, booked at 250 s, and nowhere else before the run ends."""
    world = three_station_world(trains=2)
    arrival_s, departure_s = punctual(world)
    arrival_s[1, 1] += 40.0
    arrival_s[1, 2] = departure_s[1, 1] = departure_s[1, 2] = np.nan
    record = replace(make_record(world, arrival_s, departure_s), end_s=READY_S + end_s)
    return run_tables(record, run_times_s(world, 100.0, 120.0))


def test_a_call_not_reached_is_late_at_least_until_the_end_of_the_run() -> None:
    # Booked: mid at 250 s to 280 s, east at 400 s to 430 s; unhindered it is on time.
    calls = unfinished_follower(1000.0).calls.tail(2)
    assert calls["arrival_s"].isna().tolist() == [False, True]
    assert calls["arrival_delay_s"].tolist() == [40.0, 600.0]
    assert calls["departure_delay_s"].tolist() == [720.0, 570.0]
    assert calls["secondary_delay_s"].tolist() == [40.0, 600.0]


def test_no_indicator_is_lower_because_a_train_never_arrived() -> None:
    row = summary_frame([unfinished_follower(1000.0)]).iloc[0]
    assert row["mean_arrival_delay_s"] == (0.0 + 0.0 + 40.0 + 600.0) / 4.0
    assert row["final_arrival_delay_s"] == 300.0
    assert row["secondary_delay_s"] == 600.0
    assert row["trains_affected"] == 1
    # All that is late by a minute is so until the end.
    assert row["recovery_time_s"] == 0.0


def test_a_call_that_was_not_due_when_the_run_ended_is_not_late() -> None:
    calls = unfinished_follower(300.0).calls.tail(2)
    assert np.isnan(calls["arrival_delay_s"].tolist()[1])
    assert np.isnan(calls["secondary_delay_s"].tolist()[1])


def test_a_train_that_would_not_be_there_alone_either_owes_nothing_to_others() -> None:
    never, booked_s = np.array([np.nan]), np.array([100.0])
    # Alone it would come 5000 s late, or 150 s, and the run ends 800 s after its booking.
    assert secondary_delay_s(never, np.array([5100.0]), booked_s, 900.0).tolist() == [0.0]
    assert secondary_delay_s(never, np.array([250.0]), booked_s, 900.0).tolist() == [650.0]


def test_a_train_that_never_arrives_counts_up_to_its_last_call() -> None:
    world = three_station_world(trains=2)
    arrival_s, departure_s = punctual(world)
    arrival_s[1, 1] += 40.0
    arrival_s[1, 2] = departure_s[1, 1] = departure_s[1, 2] = np.nan
    record = make_record(world, arrival_s, departure_s)
    tables = run_tables(record, run_times_s(world, 100.0, 120.0))
    assert np.isnan(tables.calls["secondary_delay_s"].iloc[-1])
    assert propagation(tables.calls).secondary_delay_s == 40.0
    assert tables.energy["completed"].tolist() == [True, False]


def test_the_unhindered_run_takes_the_fastest_run_of_line_and_train() -> None:
    world = three_station_world(trains=1)
    times_s = technical_run_times_s(world)
    fastest_s = fastest_run(world.line, world.train_types[0], 300.0, 1300.0).run_time_s
    assert np.isnan(times_s[:, 0, 0]).all()
    assert times_s[:, 0, 1].tolist() == [fastest_s, fastest_s]
    arrivals_s = unhindered_arrivals_s(world, np.zeros((1, 3)), times_s)
    assert arrivals_s[0, 1] == pytest.approx(READY_S + 30.0 + fastest_s)


def test_the_interval_runs_from_the_leaders_departure_to_the_followers_arrival() -> None:
    intervals = departure_arrival_intervals(hindered_follower().calls)
    assert intervals["station"].tolist() == ["mid", "east"]
    assert intervals["leader"].tolist() == ["T1", "T1"]
    assert intervals["follower"].tolist() == ["T2", "T2"]
    assert intervals["interval_s"].tolist() == [85.0, 75.0]
    assert intervals["booked_interval_s"].tolist() == [90.0, 90.0]


def test_a_standstill_below_one_second_is_no_stop() -> None:
    world = three_station_world(trains=2)
    stands = [
        (0, READY_S + 60.0, 0.9, 700.0, 1),
        (0, READY_S + 80.0, 1.0 - 1e-10, 900.0, 1),
        (1, READY_S + 200.0, 30.0, 900.0, 1),
        (1, READY_S + 330.0, 4.0, 2000.0, 2),
    ]
    tables = run_tables(
        make_record(world, *punctual(world), stands=stands), run_times_s(world, 90.0, 110.0)
    )
    assert tables.interstation_stops["next_station"].tolist() == ["mid", "mid", "east"]
    assert stop_totals(tables.interstation_stops) == (35.0, 3, 2)
