"""How drivers set off, coast and hurry, in runs over the toy engine."""

from dataclasses import replace

import numpy as np
import pytest

from kankaku.analysis.tables.delay import technical_run_times_s
from kankaku.railway.plan.driving_style import DrivingStyle
from kankaku.railway.plan.line import SpeedLimit
from kankaku.railway.plan.scenario import Scenario
from kankaku.testing.example_lines import merge_scenario, two_station_scenario, world_of
from tests.property.runs import Observed, controller_of, run

DEPARTURE_S = 25_230.0
LIMITS = [SpeedLimit(0.0, 3800.0, 15.0)]


def moves_s(engine: Observed, row: int) -> float:
    """When a train begins to move for the first time."""
    return float(engine.time_s[np.argmax(engine.speed_mps[:, row] > 0.0) - 1])


def reacting(scenario: Scenario, reaction_s: float) -> Scenario:
    driving = DrivingStyle("slow to react", departure_reaction_s=reaction_s)
    return replace(scenario, driving=driving)


@pytest.mark.parametrize("step_s", [0.1, 0.5])
@pytest.mark.parametrize("reaction_s", [0.0, 1.0, 3.2])
def test_a_train_moves_a_reaction_after_it_may(reaction_s: float, step_s: float) -> None:
    scenario = reacting(two_station_scenario(step_s=step_s), reaction_s)
    record, engine = run(scenario)
    whole_s = np.ceil(reaction_s / step_s - 1e-9) * step_s
    assert moves_s(engine, 0) == pytest.approx(DEPARTURE_S + whole_s)
    assert record.departure_s[0, 0] == pytest.approx(DEPARTURE_S)
    plain, _ = run(reacting(scenario, 0.0))
    later_s = record.arrival_s[0, 1] - plain.arrival_s[0, 1]
    assert later_s == pytest.approx(whole_s)


def test_who_is_held_reacts_from_when_it_may_go() -> None:
    scenario = merge_scenario(2, 5.0)
    turnouts = (replace(scenario.line.turnouts[0], fouling_start_m=300.5),)
    scenario = replace(scenario, line=replace(scenario.line, turnouts=turnouts))
    (plain, free), (record, engine) = (run(reacting(scenario, value)) for value in (0.0, 3.0))
    booked_s = world_of(scenario).booked_departure_s[1, 0]
    # The second train waits until the first one has cleared the points; that one reacts, too.
    assert moves_s(free, 1) > booked_s + 10.0
    assert moves_s(engine, 1) == pytest.approx(moves_s(free, 1) + 6.0, abs=0.5)
    assert record.departure_s[1, 0] == pytest.approx(plain.departure_s[1, 0] + 3.0, abs=0.5)


def test_who_reacts_late_is_not_late_for_that() -> None:
    style = DrivingStyle("idle", departure_reaction_s=4.0, coasting_band_mps=3.0, late_after_s=2.0)
    scenario = two_station_scenario(spacing_m=3000.0, limits=LIMITS)
    scenario = replace(scenario, driving=style)
    world = world_of(scenario)
    unhurried_s, hurried_s = technical_run_times_s(world)[:, 0, 1]
    assert unhurried_s > hurried_s + 5.0
    for delay_s, expected_s in ((0.0, unhurried_s), (10.0, hurried_s)):
        record, _ = run(scenario, delay_s=np.array([[delay_s, 0.0]]))
        lasted_s = record.arrival_s[0, 1] - record.departure_s[0, 0]
        assert lasted_s == pytest.approx(expected_s, abs=1.0)


def test_a_train_coasts_between_its_speed_and_the_band_below_it() -> None:
    scenario = two_station_scenario(spacing_m=3000.0, limits=LIMITS)
    held, holding = run(scenario)
    coasted, coasting = run(replace(scenario, driving=DrivingStyle("idle", coasting_band_mps=3.0)))
    front_m, speed_mps = coasting.front_m[:, 0], coasting.speed_mps[:, 0]
    middle = (front_m > 700.0) & (front_m < 3000.0)
    assert speed_mps[middle].max() == pytest.approx(15.0, abs=0.05)
    assert speed_mps[middle].min() == pytest.approx(12.0, abs=0.05)
    assert holding.speed_mps[(holding.front_m > 700.0) & (holding.front_m < 3000.0)].min() > 14.9
    assert coasted.energy.traction_j.sum() < held.energy.traction_j.sum()


def test_where_a_higher_limit_begins_a_coasting_train_speeds_up() -> None:
    limits = [SpeedLimit(0.0, 1500.0, 12.0), SpeedLimit(1500.0, 3800.0, 20.0)]
    scenario = two_station_scenario(spacing_m=3000.0, limits=limits)
    style = DrivingStyle("idle", coasting_band_mps=9.0)
    _, engine = run(replace(scenario, driving=style))
    front_m, speed_mps = engine.front_m[:, 0], engine.speed_mps[:, 0]
    # The limit holds until the tail is out of it.
    at = int(np.argmax(front_m > 1710.0))
    assert speed_mps[at] < 12.0
    assert speed_mps[at + 20] > speed_mps[at] + 3.0


def test_brakes_for_stops_are_the_drivers_and_for_authority_the_trains() -> None:
    scenario = two_station_scenario(2, 60.0, spacing_m=3000.0)
    style = DrivingStyle("gentle", station_brake_mps2=0.6)
    world = world_of(replace(scenario, driving=style))
    _, engine = run(
        replace(scenario, driving=style),
        controller=controller_of(world),
        delay_s=np.array([[0.0, 200.0], [0.0, 0.0]]),
    )
    losses = -np.diff(engine.speed_mps, axis=0) / scenario.step_s
    losses[engine.front_m[1:] > 3300.5] = 0.0
    assert losses[:, 0].max() == pytest.approx(0.6, abs=0.01)
    assert losses[:, 1].max() == pytest.approx(1.0, abs=0.01)
