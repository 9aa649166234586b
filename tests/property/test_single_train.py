"""One train through the real loop against independent integration, and its driving."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.railway.plan.line import Gradient, SpeedLimit, TrackCurve
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.scenario import Scenario
from kankaku.testing.example_lines import commuter_train
from tests.examples import examples
from tests.property.runs import (
    GRAVITY,
    Observed,
    mean_slope,
    random_gradients,
    random_limits,
    run,
    solo_scenario,
)
from tests.unit.test_run_curve import GRADIENTS, LIMITS, TRAIN, Reference

QUICK = examples(12)
START_M, STOP_M, END_M = 300.0, 2400.0, 3000.0
STEEPEST = 0.035
"""Steeper changes of slope within the last braking cost accuracy at coarse steps. [-]"""


def solo_run_time_s(
    step_s: float, gradients: tuple[Gradient, ...], limits: tuple[SpeedLimit, ...]
) -> tuple[float, Scenario]:
    scenario = solo_scenario(
        TRAIN, [START_M, STOP_M], END_M, gradients=gradients, limits=limits, step_s=step_s
    )
    record, _ = run(scenario)
    assert record.violations == ()
    return float(record.arrival_s[0, 1] - record.departure_s[0, 0]), scenario


@pytest.mark.parametrize(
    ("gradients", "limits"),
    [((), ()), (GRADIENTS, ()), ((), LIMITS), (GRADIENTS, LIMITS)],
    ids=["level", "gradients", "limits", "both"],
)
def test_run_time_agrees_with_event_based_integration(
    gradients: tuple[Gradient, ...], limits: tuple[SpeedLimit, ...]
) -> None:
    lasted_s, scenario = solo_run_time_s(0.05, gradients, limits)
    expected_s = Reference(scenario.line, START_M, STOP_M).run_time_s()
    assert lasted_s == pytest.approx(expected_s, rel=2e-3)


def passing_times_s(step_s: float) -> list[float]:
    """Times at places where the train speeds up, cruises, is limited and brakes."""
    scenario = solo_scenario(
        TRAIN, [START_M, STOP_M], END_M, gradients=GRADIENTS, limits=LIMITS, step_s=step_s
    )
    _, engine = run(scenario)
    left_s = engine.passes_s(0, START_M + 0.5)
    return [engine.passes_s(0, place_m) - left_s for place_m in (450.0, 1300.0, 2390.0)]


def test_halving_the_step_again_and_again_converges() -> None:
    times = np.array([passing_times_s(0.5 / 2**halvings) for halvings in range(6)])
    changes = np.abs(np.diff(times, axis=0)).max(axis=1)
    # First order at worst: every halving at least takes the bound down by half.
    assert np.all(changes <= 1.0 * 0.5 ** np.arange(5))
    assert changes[-1] < 0.2 * changes[0]


@QUICK
@given(
    random_gradients(END_M, STEEPEST), st.sampled_from([0.02, 0.1, 0.25, 0.5]), st.floats(0.0, 1.0)
)
def test_no_stop_is_missed_and_every_stop_is_accurate(
    gradients: list[Gradient], step_s: float, shift_m: float
) -> None:
    stops_m = [300.0, 1100.0 + shift_m, 2300.0 - shift_m]
    scenario = solo_scenario(commuter_train(), stops_m, END_M, gradients=gradients, step_s=step_s)
    record, _ = run(scenario)
    assert record.completed.all()
    assert np.isfinite(record.arrival_s).all()
    assert np.abs(record.stop_error_m).max() <= 0.3
    assert record.violations == ()


def commanded_mps2(engine: Observed, step_s: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return accelerations asked for while the train runs, with place and speed before."""
    told = np.array(engine.told_mps)[:, 0]
    front_m, before = engine.front_m[:-1, 0], engine.speed_mps[:-1, 0]
    moves = np.diff(engine.front_m[:, 0]) > 0.0
    return ((told - before) / step_s)[moves], front_m[moves], before[moves]


@QUICK
@given(random_gradients(END_M), random_limits(END_M), st.sampled_from([0.05, 0.1]))
def test_never_more_than_traction_and_never_harder_than_the_service_brake(
    gradients: list[Gradient], limits: list[SpeedLimit], step_s: float
) -> None:
    train = commuter_train()
    scenario = solo_scenario(
        train, [300.0, 2300.0], END_M, gradients=gradients, limits=limits, step_s=step_s
    )
    record, engine = run(scenario)
    assert record.violations == ()
    asked, front_m, speed_mps = commanded_mps2(engine, step_s)
    slopes = np.array([mean_slope(scenario.line, float(at), train.length_m) for at in front_m])
    pull = GRAVITY * slopes / 1.08
    strongest = np.minimum(400e3, 400e3 * 11.0 / np.maximum(speed_mps, 0.1))
    # The mean over a step lies between the forces at its ends; so does the gradient's pull.
    assert np.all(asked <= strongest / (400e3 * 1.08) - pull + 0.01)
    assert np.all(asked >= -(train.service_brake_mps2 + pull) - 0.01)


def frictionless(brake_mps2: float = 1.0) -> TrainType:
    train = commuter_train(brake_mps2=brake_mps2)
    return replace(train, resistance=replace(train.resistance, a_n=0.0, b_nspm=0.0, c_ns2pm2=0.0))


def test_without_resistance_all_traction_work_is_kinetic_energy_and_all_of_it_is_braked() -> None:
    scenario = solo_scenario(frictionless(), [300.0, 1300.0], 1300.5)
    record, engine = run(scenario)
    # The run ends half a metre past the second stop: next to nothing is added there.
    kinetic_j = 0.5 * 432e3 * engine.speed_mps.max() ** 2
    assert record.energy.traction_j[0] == pytest.approx(kinetic_j, rel=5e-3)
    assert record.energy.braking_j[0] == pytest.approx(kinetic_j, rel=5e-3)


def test_a_strong_electric_brake_recovers_everything_above_its_cutoff() -> None:
    train = frictionless()
    strong = replace(
        train.supply,
        regeneration_force_n=1e6,
        regeneration_power_w=1e9,
        regeneration_cutoff_mps=3.0,
    )
    scenario = solo_scenario(replace(train, supply=strong), [300.0, 1300.0], 1300.5, step_s=0.1)
    record, engine = run(scenario)
    above_j = 0.5 * 432e3 * (engine.speed_mps.max() ** 2 - 3.0**2)
    assert record.energy.regenerated_j[0] == pytest.approx(above_j, rel=5e-3)
    assert record.energy.recovered_j[0] == pytest.approx(0.85 * above_j, rel=5e-3)


def test_a_weak_electric_brake_does_its_force_times_the_braking_distance() -> None:
    train = frictionless()
    weak = replace(
        train.supply,
        regeneration_force_n=1e5,
        regeneration_power_w=1e9,
        regeneration_cutoff_mps=1.0,
    )
    scenario = solo_scenario(replace(train, supply=weak), [300.0, 1300.0], 1300.5, step_s=0.1)
    record, engine = run(scenario)
    braking_m = 0.5 * (engine.speed_mps.max() ** 2 - 1.0)
    assert record.energy.regenerated_j[0] == pytest.approx(1e5 * braking_m, rel=1e-2)


@examples(8)
@given(random_gradients(END_M - 200.0), random_limits(END_M), st.sampled_from([0.05, 0.1]))
def test_work_and_energy_balance_on_gradients_and_curves(
    gradients: list[Gradient], limits: list[SpeedLimit], step_s: float
) -> None:
    train = commuter_train()
    level_end = [g for g in gradients if g.end_m <= END_M - 200.0]
    scenario = solo_scenario(
        train, [300.0, 1300.0, 2300.0], END_M, gradients=level_end, limits=limits, step_s=step_s
    )
    curve = TrackCurve(700.0, 1900.0, 350.0)
    scenario = replace(scenario, line=replace(scenario.line, curves=(curve,)))
    record, engine = run(scenario)
    energy = record.energy
    work_in = energy.traction_j[0]
    work_out = energy.braking_j[0] + energy.resistance_j[0]
    stored = energy.potential_j[0] + energy.kinetic_j[0]
    assert work_in - work_out == pytest.approx(stored, abs=0.005 * work_in)

    # The same from what the engine showed, by other means.
    front_m, speed_mps = engine.front_m[:-1, 0], engine.speed_mps[:-1, 0]
    curved_share = np.clip(front_m - 700.0, 0.0, 200.0) - np.clip(front_m - 1900.0, 0.0, 200.0)
    curve_n = 600.0 / 350.0 * GRAVITY * 400.0 * curved_share / 200.0
    kmh = 3.6 * speed_mps
    rolling_kgf = (1.65 + 0.0247 * kmh) * 160 + (0.78 + 0.0028 * kmh) * 240 + 0.0982 * kmh**2
    force_n = GRAVITY * rolling_kgf + curve_n
    resisted_j = float(np.sum(0.5 * (force_n[1:] + force_n[:-1]) * np.diff(front_m)))
    assert energy.resistance_j[0] == pytest.approx(resisted_j, rel=5e-3)
    assert energy.kinetic_j[0] == pytest.approx(0.5 * 432e3 * speed_mps[-1] ** 2, rel=5e-3)
    heights_m = [
        sum(g.gradient * np.clip(at_m - g.start_m, 0.0, g.end_m - g.start_m) for g in level_end)
        for at_m in (np.linspace(100.0, 300.0, 401), np.linspace(END_M - 200.0, END_M, 401))
    ]
    rise_m = float(np.mean(heights_m[1]) - np.mean(heights_m[0])) if level_end else 0.0
    assert energy.potential_j[0] == pytest.approx(400e3 * GRAVITY * rise_m, abs=0.005 * work_in)
    assert 0.0 <= energy.regenerated_j[0] <= energy.braking_j[0]
    assert energy.consumed_j[0] >= energy.consumed_j[0] - energy.recovered_j[0] > 0.0
    assert energy.consumed_j[0] >= work_in / 0.88


def test_auxiliaries_draw_power_as_long_as_the_train_is_on_the_line() -> None:
    scenario = solo_scenario(commuter_train(), [300.0, 1300.0], 1500.0)
    record, engine = run(scenario)
    present = [seen for seen in engine.seen if seen.time_s >= 25_200.0]
    on_the_line_s = present[-1].time_s - present[0].time_s
    assert record.energy.auxiliary_j[0] == pytest.approx(200e3 * on_the_line_s, abs=200e3)
