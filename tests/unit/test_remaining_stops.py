"""Stops between stations, followed back to their first causes by hand and in the loop."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from kankaku.analysis.tables.remaining_stops import remaining_stops_frame
from kankaku.analysis.tables.run_tables import run_tables
from kankaku.analysis.texts.remaining_texts import remaining_texts, stops_text
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.state import NOTHING, beside
from kankaku.testing.example_lines import two_station_scenario
from tests.property.runs import run
from tests.records import READY_S, make_record, punctual, run_times_s, three_station_world

T1, T2, T3 = 0, 1, 2


def queue() -> RunRecord:
    """
    Return three trains of which the first overstays at ``mid``.

    Seconds after 07:00:00. T1 arrives at mid at 120. It might leave as booked at 160, but is
    injected 100 s: it leaves at 120 + 20 + 100 = 240. T2 left west at 150, is slow for T1 from
    200 on and stands from 230 for 15 s. T3 left west at 270 and stands for T2 from 340 on, when T2
    stands at mid, as long as it has to.
    """
    world = three_station_world(trains=3)
    arrival_s = READY_S + np.array(
        [[0.0, 120.0, 350.0], [120.0, 325.0, 455.0], [240.0, 410.0, 550.0]]
    )
    departure_s = READY_S + np.array(
        [[30.0, 240.0, 380.0], [150.0, 345.0, 485.0], [270.0, 430.0, 580.0]]
    )
    drawn_s = np.zeros((3, 3))
    drawn_s[T1, 1] = 100.0
    record = make_record(
        world,
        arrival_s,
        departure_s,
        dwell_delay_s=drawn_s,
        stands=[
            (T2, READY_S + 230.0, 15.0, 1000.0, 1),
            (T3, READY_S + 340.0, 5.0, 1000.0, 1),
        ],
    )
    seen = record.trajectory
    slow = {
        T2: (seen.time_s >= READY_S + 200.0) & (seen.time_s <= READY_S + 230.0),
        T3: (seen.time_s >= READY_S + 320.0) & (seen.time_s <= READY_S + 340.0),
    }
    cause = np.full(seen.row.size, NOTHING)
    for row, moments in slow.items():
        cause[(seen.row == row) & moments] = row - 1
    return replace(record, trajectory=seen._replace(cause=cause))


def test_a_stop_is_told_with_the_overstay_that_it_is_for() -> None:
    row = remaining_stops_frame(queue()).iloc[0]
    assert (row["train"], row["cause"], row["cause_state"]) == ("T2", "T1", "at_platform")
    assert (row["cause_station"], row["links"], row["first_cause"]) == ("mid", 0, "T1")
    # 10 s of the 100 s are in the booked dwell.
    assert (row["overstay_s"], row["overstay_beyond_booked_s"]) == (100.0, 90.0)
    assert row["overstay_began_s"] == READY_S + 160.0
    assert (row["departed_s"], row["slowed_s"]) == (READY_S + 150.0, READY_S + 200.0)
    assert (row["overstayed_at_departure_s"], row["overstayed_when_slowed_s"]) == (-10.0, 40.0)


def test_a_train_at_its_stop_that_had_to_stand_before_is_not_the_first_cause() -> None:
    row = remaining_stops_frame(queue()).iloc[1]
    assert (row["train"], row["cause"], row["cause_state"]) == ("T3", "T2", "at_platform")
    assert (row["links"], row["first_cause"], row["first_cause_station"]) == (1, "T1", "mid")
    assert row["overstay_s"] == 100.0
    assert row["overstayed_at_departure_s"] == 110.0


def test_what_is_beside_the_track_ends_the_chain() -> None:
    record = queue()
    seen = record.trajectory
    cause = np.where(seen.cause == T1, beside(0), seen.cause)
    found = remaining_stops_frame(
        replace(record, trajectory=seen._replace(cause=cause, places=("points-1",)))
    )
    assert found["first_cause"].tolist() == ["points-1", "points-1"]
    assert found["first_cause_state"].tolist() == ["beside_track"] * 2
    assert found["overstay_s"].isna().all()
    assert stops_text(found) == (
        "2 stops between stations remain: 2 before something beside the track."
    )


def test_in_a_queue_everybody_stands_for_the_train_that_overstays() -> None:
    scenario = two_station_scenario(4, 60.0, spacing_m=2000.0, run_s=110.0)
    drawn_s = np.zeros((4, 2))
    drawn_s[0, 1] = 150.0
    record, _ = run(scenario, delay_s=drawn_s)
    found = remaining_stops_frame(record)
    assert found["train"].tolist()[:2] == ["T2", "T3"]
    assert found["cause"].tolist()[:2] == ["T1", "T2"]
    assert found["cause_state"].tolist()[:2] == ["at_platform", "between_stations"]
    assert set(found["first_cause"]) == {"T1"}
    assert set(found["overstay_s"]) == {150.0}
    rows = run_tables(record).interstation_stops
    pd.testing.assert_frame_equal(found[rows.columns], rows)


def test_the_report_counts_long_and_short_overstays() -> None:
    stops = pd.DataFrame(
        {
            "overstay_s": [120.0, 90.0, 40.0, 0.0, np.nan],
            "first_cause_state": ["at_platform"] * 4 + [""],
            "overstayed_at_departure_s": [-20.0, 5.0, -30.0, -10.0, np.nan],
            "overstayed_when_slowed_s": [20.0, 45.0, -5.0, 10.0, np.nan],
        }
    )
    assert stops_text(stops) == (
        "5 stops between stations remain: 2 behind overstays of 90 s or more, 1 behind shorter "
        "ones, 2 behind trains that did not overstay. Of the overstays 1 had begun when the train "
        "behind left its last stop, 2 when it was first slowed."
    )


@pytest.mark.parametrize("stands", [True, False])
def test_every_controller_has_a_sentence_over_all_its_runs(*, stands: bool) -> None:
    record = queue()
    if not stands:
        record = replace(
            record, standstills=make_record(record.world, *punctual(record.world)).standstills
        )
    tables = run_tables(record, run_times_s(record.world, 90.0, 110.0))
    (sentence,) = remaining_texts([tables, tables])
    told = "4 stops between stations remain: 4 behind" if stands else "no train stood"
    assert sentence.startswith(f"`close_up`: {told}")
    (warned,) = remaining_texts([tables], ["close_up"])
    assert warned.startswith("`close_up` (knows the future): ")
