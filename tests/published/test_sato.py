"""Two-stage deceleration keeps what Sato et al. 2025 promise for two trains."""

from dataclasses import replace

import numpy as np
import pytest

from kankaku.railway.plan.rolling_stock import RunningResistance, Traction, TrainType
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.timetable import Call, Service
from kankaku.railway.step.records import RunRecord
from kankaku.testing.example_lines import commuter_train, make_scenario, straight_line
from tests.property.runs import READY_S, Observed, run

A, B = 0.9, 1.0
"""Greatest acceleration, at every speed as in the paper, and service brake. [m/s2]"""
V_MAX = 20.0
FIRST_STAGE = A * B / (A + B)
STOPS_M = {"west": 300.0, "east": 2300.0}
RUN_S = V_MAX / (2 * A) + V_MAX / (2 * B) + 2000.0 / V_MAX
DWELL_S = 20.0
HEADWAY_S = 45.0
LENGTH_M, MARGIN_M = 200.0, 25.0


def papers_train() -> TrainType:
    """No resistance, constant acceleration: eqs. (11) to (16) hold exactly."""
    plain = commuter_train(brake_mps2=B)
    return replace(
        plain,
        rotating_mass_ratio=0.0,
        traction=Traction(A * plain.mass_kg, 100.0, 200.0),
        resistance=RunningResistance(0.0, 0.0, 0.0),
        maximum_speed_mps=V_MAX,
    )


def two_trains(headway_s: float = HEADWAY_S) -> Scenario:
    """The leader departs from east as soon as its dwell and its overstay allow."""
    services = []
    for index in range(2):
        ready_s = READY_S + index * headway_s
        calls = (
            Call("west", "main", STOPS_M["west"], ready_s, ready_s + 30.0, 25.0),
            Call("east", "main", STOPS_M["east"], ready_s + 150.0, ready_s + 150.0, DWELL_S),
        )
        services.append(Service(f"T{index + 1}", "west", "commuter", ("main",), calls))
    return make_scenario(straight_line(STOPS_M, 3500.0), services, papers_train(), step_s=0.1)


def with_overstay(overstay_s: float, operation: str) -> tuple[RunRecord, Observed]:
    delay_s = np.zeros((2, 2))
    delay_s[0, 1] = overstay_s
    record, engine = run(two_trains(), operation, delay_s=delay_s)
    assert record.violations == ()
    assert record.completed.all()
    return record, engine


def stop_time_s(record: RunRecord) -> float:
    return float(record.standstills.duration_s.sum())


def test_the_world_is_what_the_closed_forms_say() -> None:
    record, _ = with_overstay(0.0, "close_up")
    run_s = record.arrival_s[0, 1] - record.departure_s[0, 0]
    assert run_s == pytest.approx(RUN_S, abs=0.3)


@pytest.mark.parametrize("operation", ["two_stage", "two_stage_plain"])
@pytest.mark.parametrize("overstay_s", [25.0, 40.0, 60.0, 100.0])
def test_stops_between_stations_become_fewer_and_shorter(operation: str, overstay_s: float) -> None:
    baseline, _ = with_overstay(overstay_s, "close_up")
    proposed, _ = with_overstay(overstay_s, operation)
    assert stop_time_s(baseline) > 0.0
    assert stop_time_s(proposed) < stop_time_s(baseline)
    assert proposed.standstills.row.size <= baseline.standstills.row.size


@pytest.mark.parametrize(("operation", "at_most_s"), [("two_stage", 7.2), ("two_stage_plain", 1.5)])
@pytest.mark.parametrize("overstay_s", [0.0, 10.0, 25.0, 40.0, 60.0, 100.0])
def test_the_follower_is_not_made_later_by_more_than_a_few_seconds(
    operation: str, at_most_s: float, overstay_s: float
) -> None:
    """The most is paid when the leader departs at once: the follower runs in at full speed."""
    baseline, _ = with_overstay(overstay_s, "close_up")
    proposed, _ = with_overstay(overstay_s, operation)
    assert proposed.arrival_s[1, 1] - baseline.arrival_s[1, 1] <= at_most_s
    if overstay_s >= 40.0:
        assert proposed.arrival_s[1, 1] - baseline.arrival_s[1, 1] <= 0.5


def interval_s(held_mps: float) -> float:
    """Departure to arrival at a held speed, from eqs. (14) and (15): hold, then brake."""
    away_m = 0.5 * held_mps**2 / A + LENGTH_M + MARGIN_M + 0.5 * held_mps**2 / B
    return (away_m - 0.5 * held_mps**2 / B) / held_mps + held_mps / B


def test_if_the_leader_departs_at_once_the_interval_is_that_of_the_highest_held_speed() -> None:
    record, _ = with_overstay(0.0, "two_stage")
    interval = record.arrival_s[1, 1] - record.departure_s[0, 1]
    assert interval == pytest.approx(interval_s(V_MAX), abs=0.5)


@pytest.mark.parametrize("overstay_s", [45.0, 60.0, 100.0])
def test_the_stop_is_shorter_than_the_overstay_by_the_length_of_the_first_stage(
    overstay_s: float,
) -> None:
    record, _ = with_overstay(overstay_s, "two_stage")
    assert stop_time_s(record) == pytest.approx(overstay_s - V_MAX / FIRST_STAGE, abs=0.7)


def first_stage_begins_s(engine: Observed) -> float:
    """When the way to the tail in the platform, margin off, is v^2 / 2 over the first stage."""
    gap_m = STOPS_M["east"] - LENGTH_M - MARGIN_M - engine.front_m[:, 1]
    curve_m = 0.5 * engine.speed_mps[:, 1] ** 2 / FIRST_STAGE
    running = engine.speed_mps[:, 1] > 0.0
    return float(engine.time_s[running & (gap_m <= curve_m + V_MAX * 0.1)][0])


@pytest.mark.parametrize("margin_s", [1.0, 10.0, 30.0])
def test_no_stop_at_all_if_the_leader_departs_before_the_first_stage_ends(margin_s: float) -> None:
    """The first stage lasts v_max / (a b / (a + b)): 42 s here."""
    stage_s = V_MAX / FIRST_STAGE
    _, probe = with_overstay(500.0, "two_stage_plain")
    leader = with_overstay(0.0, "two_stage_plain")[0]
    free_departure_s = float(leader.departure_s[0, 1])
    overstay_s = first_stage_begins_s(probe) + stage_s - margin_s - free_departure_s
    record, _ = with_overstay(overstay_s, "two_stage_plain")
    assert stop_time_s(record) == 0.0


@pytest.mark.parametrize("share", [0.25, 0.5, 0.75, 0.95])
def test_with_pre_deceleration_no_overstay_below_the_first_stage_stops_the_follower(
    share: float,
) -> None:
    """The first stage begins when the leader may depart: its length is the overstay bridged."""
    overstay_s = share * V_MAX / FIRST_STAGE
    record, _ = with_overstay(overstay_s, "two_stage")
    assert stop_time_s(record) == 0.0


@pytest.mark.parametrize("overstay_s", [10.0, 18.0])
def test_speed_in_the_first_stage_is_equation_16_and_is_held_once_the_leader_departs(
    overstay_s: float,
) -> None:
    record, engine = with_overstay(overstay_s, "two_stage_plain")
    departs_s = float(record.departure_s[0, 1])
    begins_s = first_stage_begins_s(engine)
    stage = (engine.time_s > begins_s + 1.0) & (engine.time_s <= departs_s)
    assert np.count_nonzero(stage) > 20
    gap_m = STOPS_M["east"] - LENGTH_M - MARGIN_M - engine.front_m[stage, 1]
    expected_mps = np.sqrt(2.0 * FIRST_STAGE * gap_m)
    assert engine.speed_mps[stage, 1] == pytest.approx(expected_mps, abs=0.1)
    # From then on it holds its speed until the paths touch, v / a later.
    held_mps = float(engine.speed_mps[stage, 1][-1])
    touch_s = departs_s + held_mps / A
    holds = (engine.time_s > departs_s + 0.5) & (engine.time_s < touch_s - 0.5)
    to_go_m = STOPS_M["east"] - engine.front_m[:, 1]
    holds &= to_go_m > 0.5 * engine.speed_mps[:, 1] ** 2 / B + 5.0
    assert np.count_nonzero(holds) > 10
    assert engine.speed_mps[holds, 1] == pytest.approx(held_mps, abs=0.2)
