"""Runs of least energy where the optimum is known, and at the ends of what is possible."""

from dataclasses import replace
from itertools import groupby
from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import brentq

from kankaku.railway.motion.eco_run import EcoRun, eco, eco_run, net_energy_j
from kankaku.railway.motion.extremal import (
    BRAKING,
    COASTING,
    ELECTRIC,
    HOLDING,
    SPEEDING_UP,
    holding_speed_mps,
)
from kankaku.railway.motion.run_curve import RunTimeError, StallError, fastest
from kankaku.railway.motion.way import Way, way_on
from kankaku.railway.plan.line import Gradient, SpeedLimit
from kankaku.railway.plan.profile import build_profile
from kankaku.railway.plan.rolling_stock import RunningResistance, Traction, TrainType
from kankaku.testing.example_lines import commuter_train, straight_line

STOP_M = 1500.0
LEVEL = straight_line({"west": 300.0}, 6000.0)


def way_of(train: TrainType, stop_m: float = STOP_M, start_mps: float = 0.0, **line: object) -> Way:
    track = straight_line({"west": 300.0}, 6000.0, **line)  # type: ignore[arg-type]
    profile = build_profile(track, [train])
    return way_on(profile, 0, train, (500.0, 500.0 + stop_m), (start_mps, 0.0))


def phases(run: EcoRun) -> list[int]:
    return [phase for phase, _ in groupby(run.phase.tolist())]


class Known(NamedTuple):
    """A train of constant acceleration and resistance: speed up, coast, brake."""

    acceleration_mps2: float
    resistance_mps2: float
    brake_mps2: float

    def train(self) -> TrainType:
        plain = replace(commuter_train(brake_mps2=self.brake_mps2), rotating_mass_ratio=0.0)
        force_n = plain.mass_kg * (self.acceleration_mps2 + self.resistance_mps2)
        return replace(
            plain,
            traction=Traction(force_n, 100.0, 200.0),
            resistance=RunningResistance(plain.mass_kg * self.resistance_mps2, 0.0, 0.0),
            maximum_speed_mps=60.0,
            supply=replace(plain.supply, regeneration_efficiency=0.0),
        )

    def braked_from_mps(self, top_mps: float, stop_m: float) -> float:
        """Speed at which the brake sets in, from the way that is left."""
        up_m = 0.5 * top_mps**2 / self.acceleration_mps2
        coast_m = 0.5 * top_mps**2 / self.resistance_mps2
        square = 2.0 * (up_m + coast_m - stop_m)
        share = 1.0 / self.resistance_mps2 - 1.0 / self.brake_mps2
        return float(np.sqrt(max(square / share, 0.0)))

    def time_s(self, top_mps: float, stop_m: float) -> float:
        slow_mps = self.braked_from_mps(top_mps, stop_m)
        coast_s = (top_mps - slow_mps) / self.resistance_mps2
        return top_mps / self.acceleration_mps2 + coast_s + slow_mps / self.brake_mps2

    def work_j(self, run_time_s: float, stop_m: float) -> float:
        """Work of traction of the only run of three phases that takes this time."""
        rates = 1.0 / self.acceleration_mps2 + 1.0 / self.brake_mps2
        fastest_mps = np.sqrt(2.0 * stop_m / rates)
        least_mps = np.sqrt(
            2.0 * stop_m / (1.0 / self.acceleration_mps2 + 1.0 / self.resistance_mps2)
        )
        top_mps = brentq(
            lambda v: self.time_s(v, stop_m) - run_time_s, least_mps + 1e-6, fastest_mps
        )
        train = self.train()
        force_n = train.mass_kg * (self.acceleration_mps2 + self.resistance_mps2)
        return float(0.5 * force_n * top_mps**2 / self.acceleration_mps2)


@pytest.mark.parametrize("supplement", [0.01, 0.0385, 0.1, 0.2])
def test_with_constant_forces_it_is_the_run_that_speeds_up_coasts_and_brakes(
    supplement: float,
) -> None:
    known = Known(0.8, 0.05, 1.0)
    way = way_of(known.train())
    run_time_s = (1.0 + supplement) * fastest(way).run_time_s
    run = eco(way, run_time_s)
    assert phases(run) == [SPEEDING_UP, COASTING, BRAKING]
    work_j = known.work_j(run_time_s, STOP_M)
    assert run.curve.traction_work_j[-1] == pytest.approx(work_j, rel=1e-3)


def test_the_held_speed_is_where_another_second_is_worth_what_it_saves() -> None:
    """Holding a speed for a given way costs ``R(v)`` per metre and ``price / v``: least at V."""
    train = commuter_train()
    for price_wpkg in (0.5, 5.0, 20.0):
        hold_mps = holding_speed_mps(train, price_wpkg)
        speeds = np.linspace(0.5 * hold_mps, 1.5 * hold_mps, 100_001)
        per_kg = train.resistance.force_n(speeds) / train.inertial_mass_kg
        cost = per_kg / train.supply.traction_efficiency + price_wpkg / speeds
        assert hold_mps == pytest.approx(speeds[cost.argmin()], rel=1e-4)


def test_without_resistance_that_rises_no_speed_is_held() -> None:
    assert holding_speed_mps(Known(0.8, 0.05, 1.0).train(), 10.0) == np.inf


def test_a_long_slow_run_holds_one_speed_in_all_sections() -> None:
    limits = [SpeedLimit(2000.0, 2300.0, 20.0)]
    way = way_of(commuter_train(), 5000.0, limits=limits)
    run = eco(way, 1.6 * fastest(way).run_time_s)
    assert phases(run)[:3] == [SPEEDING_UP, HOLDING, COASTING]
    held = run.phase == HOLDING
    assert np.ptp(run.curve.speed_mps[1:][held]) < 1e-9
    assert run.curve.speed_mps.max() < 20.0


def test_a_regenerating_train_brakes_electrically_before_the_friction_brake() -> None:
    way = way_of(commuter_train())
    run = eco(way, 1.05 * fastest(way).run_time_s)
    assert phases(run)[-3:] == [COASTING, ELECTRIC, BRAKING]
    braked = run.phase == ELECTRIC
    assert np.count_nonzero(braked) > 50


def test_no_slack_gives_the_fastest_run_and_less_is_refused() -> None:
    way = way_of(commuter_train(), limits=[SpeedLimit(900.0, 1100.0, 15.0)])
    quickest = fastest(way)
    run = eco(way, quickest.run_time_s)
    assert run.curve.speed_mps == pytest.approx(quickest.speed_mps, abs=0.01)
    assert net_energy_j(way, run.curve) == pytest.approx(net_energy_j(way, quickest), rel=1e-3)
    with pytest.raises(RunTimeError, match=f"the fastest takes {quickest.run_time_s:.2f}"):
        eco(way, quickest.run_time_s - 0.5)
    with pytest.raises(RunTimeError):
        eco(way, quickest.run_time_s + 0.5, least_slack_s=1.0)


@pytest.mark.parametrize("start_mps", [0.0, 5.0, 20.0])
@pytest.mark.parametrize("share", [1.05, 1.5, 3.0])
def test_any_slack_is_used_up_from_any_speed(start_mps: float, share: float) -> None:
    way = way_of(commuter_train(), start_mps=start_mps)
    run_time_s = share * fastest(way).run_time_s
    run = eco(way, run_time_s).curve
    assert run.run_time_s == pytest.approx(run_time_s, abs=0.0101)
    assert run.speed_mps[0] == start_mps


def test_a_wall_is_refused() -> None:
    way = way_of(commuter_train(), gradients=[Gradient(600.0, 1800.0, 0.2)])
    with pytest.raises(StallError, match="cannot climb"):
        eco(way, 500.0)


def test_a_run_on_a_line_is_that_along_its_way() -> None:
    train = commuter_train()
    along = eco(way_of(train), 100.0).curve
    on_line = eco_run(LEVEL, train, 500.0, 500.0 + STOP_M, 100.0).curve
    assert np.array_equal(along.speed_mps, on_line.speed_mps)
