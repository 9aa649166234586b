"""A net brake takes its rate on any gradient: in tables, in runs, and in what is promised."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.controllers.registry import build
from kankaku.railway.motion.eco_run import eco
from kankaku.railway.motion.extremal import ELECTRIC
from kankaku.railway.motion.feasibility import Lack, assess
from kankaku.railway.motion.run_curve import fastest, fastest_run
from kankaku.railway.motion.way import way_on
from kankaku.railway.plan.line import Gradient, SpeedLimit
from kankaku.railway.plan.profile import build_profile
from kankaku.railway.plan.rolling_stock import Traction
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.step.control import Command, Controller, Drive
from kankaku.railway.step.state import Advice, Authority, LineState
from kankaku.testing.example_lines import (
    commuter_train,
    straight_line,
    two_station_scenario,
    world_of,
)
from tests.examples import examples
from tests.property.runs import (
    GRAVITY,
    mean_slope,
    random_gradients,
    random_limits,
    run,
    solo_scenario,
)
from tests.unit.test_monitor import Altered, kinds, overstay

END_M = 3000.0
NET = replace(commuter_train(), net_brake=True)
QUICK = examples(15)
PAIRS = [
    ("moving_block", {}),
    ("relative_braking", {"leader_brake_kmhps": 5.0}),
    ("multi_step_atc", {}),
    ("atd", {}),
]


@QUICK
@given(random_gradients(END_M, 0.05), st.floats(8.0, 25.0))
def test_a_train_stops_from_any_speed_in_v_squared_over_2_b(
    gradients: list[Gradient], speed_mps: float
) -> None:
    line = straight_line({"west": 300.0}, END_M, gradients)
    needs_m = 0.5 * speed_mps**2 / NET.service_brake_mps2
    # It enters at this speed and has just the way that it needs.
    curve = fastest_run(line, NET, 2000.0 - needs_m, 2000.0, start_mps=speed_mps)
    assert curve.run_time_s == pytest.approx(speed_mps / NET.service_brake_mps2, rel=1e-3)
    left_m = 2000.0 - curve.chainage_m
    braked_mps = np.sqrt(2.0 * NET.service_brake_mps2 * left_m)
    assert curve.speed_mps == pytest.approx(braked_mps, abs=0.01)


@QUICK
@given(random_gradients(END_M, 0.05), random_limits(END_M), st.sampled_from([0.1, 0.5]))
def test_in_a_run_no_gradient_makes_it_brake_otherwise_and_nobody_is_accused(
    gradients: list[Gradient], limits: list[SpeedLimit], step_s: float
) -> None:
    scenario = solo_scenario(
        NET, [300.0, 1300.0, 2400.0], END_M, gradients=gradients, limits=limits, step_s=step_s
    )
    record, engine = run(scenario)
    assert record.completed.all()
    assert record.violations == ()
    assert np.abs(record.stop_error_m).max() <= 0.3
    lost_mps2 = -np.diff(engine.speed_mps[:, 0]) / step_s
    moving = engine.speed_mps[1:, 0] > 0.5
    assert lost_mps2[moving].max() == pytest.approx(NET.service_brake_mps2, abs=0.01)


@QUICK
@given(random_gradients(END_M, 0.05))
def test_the_work_of_a_run_still_adds_up(gradients: list[Gradient]) -> None:
    scenario = solo_scenario(NET, [300.0, 2400.0], 2400.5, gradients=gradients, step_s=0.1)
    record, engine = run(scenario)
    energy = record.energy
    spent_j = energy.braking_j + energy.resistance_j + energy.potential_j + energy.kinetic_j
    assert energy.traction_j[0] == pytest.approx(spent_j[0], rel=0.02)
    fronts_m = np.linspace(engine.front_m[0, 0], engine.front_m[:, 0].max(), 4001)
    slopes = [mean_slope(scenario.line, float(at_m), NET.length_m) for at_m in fronts_m]
    rise_m = np.trapezoid(slopes, fronts_m)
    work_j = float(energy.traction_j[0])
    assert energy.potential_j[0] == pytest.approx(400e3 * GRAVITY * rise_m, abs=0.01 * work_j)


@pytest.mark.parametrize("gradient", [-0.03, 0.0, 0.03])
@pytest.mark.parametrize(("protection", "options"), PAIRS)
def test_behind_any_protection_a_net_braked_train_is_right(
    protection: str, options: dict[str, float], gradient: float
) -> None:
    slopes = (Gradient(500.0, 1200.0, gradient),)
    scenario = two_station_scenario(2, 90.0, gradients=slopes, block_m=250.0, step_s=0.25)
    scenario = replace(scenario, train_types={NET.id: NET})
    spec = ControllerSpec("x", protection, "close_up", options, {})
    record, _ = run(scenario, controller=build(spec, world_of(scenario)), delay_s=overstay(60.0))
    assert record.completed.all()
    assert record.violations == ()


def descent(*, net: bool) -> tuple[Scenario, Controller]:
    """Two trains on a fall of 30 permil, the first of which overstays."""
    slopes = (Gradient(400.0, 1300.0, -0.03),)
    scenario = two_station_scenario(2, 90.0, gradients=slopes)
    train = replace(commuter_train(), net_brake=net)
    scenario = replace(scenario, train_types={train.id: train})
    world = world_of(scenario)
    return scenario, build(ControllerSpec("x", "moving_block", "close_up", {}, {}), world)


def test_a_protection_that_lets_a_net_braked_train_too_far_is_accused() -> None:
    scenario, honest = descent(net=True)
    broken = replace(honest, protection=Altered(honest.protection, extra_m=60.0))
    record, _ = run(scenario, controller=broken, delay_s=overstay(60.0))
    assert ("spacing", "T2") in kinds(record)
    record, _ = run(scenario, controller=honest, delay_s=overstay(60.0))
    assert record.violations == ()


def test_a_protection_that_takes_a_level_rate_for_a_net_one_is_accused() -> None:
    """What is right for a net brake is too late on a fall of 30 permil for a level one."""
    scenario, _ = descent(net=False)
    _, honest = descent(net=True)
    record, _ = run(scenario, controller=honest, delay_s=overstay(60.0))
    assert ("authority", "T2") in kinds(record)


@dataclass
class Harder:
    """A drive that loses so much speed in every step between two moments."""

    honest: Drive
    lost_mps: float
    since_s: float
    until_s: float

    def command(self, state: LineState, authority: Authority, advice: Advice) -> Command:
        command = self.honest.command(state, authority, advice)
        if not self.since_s <= state.time_s < self.until_s:
            return command
        return command._replace(speed_mps=np.maximum(state.speed_mps - self.lost_mps, 0.0))


@pytest.mark.parametrize("gradient", [-0.03, 0.03])
def test_a_train_that_brakes_harder_than_its_net_brakes_is_accused_on_any_gradient(
    gradient: float,
) -> None:
    slopes = (Gradient(0.0, 1800.0, gradient),)
    scenario = two_station_scenario(1, gradients=slopes, step_s=0.1)
    scenario = replace(scenario, train_types={NET.id: NET})
    spec = ControllerSpec("x", "moving_block", "close_up", {}, {})
    honest = build(spec, world_of(scenario))
    _, free = run(scenario, controller=honest)
    since_s = float(free.passes_s(0, 700.0))
    for lost_mps2, kind in ((1.2, "braking"), (1.5, "acceleration")):
        drive = Harder(honest.drive, 0.1 * lost_mps2, since_s, since_s + 1.0)
        record, _ = run(scenario, controller=replace(honest, drive=drive))
        assert (kind, "T1") in kinds(record), (lost_mps2, kinds(record))


def test_a_climb_that_takes_more_than_a_net_brake_does_is_nobodys_fault() -> None:
    """On 60 permil a train without much force loses 0.5 m/s2; its brakes are of 0.2 m/s2."""
    weak = replace(
        NET,
        traction=Traction(60e3, 11.0, 22.0),
        service_brake_mps2=0.2,
        emergency_brake_mps2=0.25,
    )
    hill = [Gradient(3000.0, 3600.0, 0.06)]
    scenario = solo_scenario(weak, [300.0, 8000.0], 8600.0, gradients=hill, step_s=0.1)
    record, engine = run(scenario)
    assert record.violations == ()
    lost_mps2 = -np.diff(engine.speed_mps[:, 0]) / 0.1
    on_it = (engine.front_m[:-1, 0] > 3250.0) & (engine.front_m[:-1, 0] < 3550.0)
    assert lost_mps2[on_it].min() > 0.35


@pytest.mark.parametrize("net", [False, True])
def test_only_a_level_rate_can_be_too_weak_for_a_descent(net: bool) -> None:
    scenario = two_station_scenario(1, gradients=(Gradient(400.0, 1000.0, -0.06),))
    train = replace(commuter_train(brake_mps2=0.4), net_brake=net, emergency_brake_mps2=0.45)
    found = assess(scenario.line, {train.id: train}, scenario.timetable)
    lacks = {shortfall.lack for shortfall in found.shortfalls}
    assert lacks == (set() if net else {Lack.SERVICE_BRAKE, Lack.EMERGENCY_BRAKE})


def test_the_electric_brake_of_a_thrifty_run_takes_no_more_than_the_net_rate() -> None:
    """On a fall the gradient is part of a net rate, so that more is left to be brought back."""
    hill = straight_line({"west": 300.0}, 4000.0, [Gradient(0.0, 4000.0, -0.03)])
    for train, most_mps2 in ((NET, 1.0), (commuter_train(), 1.0 - GRAVITY * 0.03 / 1.08)):
        supply = replace(train.supply, regeneration_force_n=900e3, regeneration_power_w=90e6)
        strong = replace(train, supply=supply)
        way = way_on(build_profile(hill, [strong]), 0, strong, (500.0, 2500.0))
        run_of = eco(way, 1.1 * fastest(way).run_time_s)
        curve = run_of.curve
        lost_mps2 = -0.5 * np.diff(np.square(curve.speed_mps)) / np.diff(curve.chainage_m)
        braked = run_of.phase == ELECTRIC
        assert np.count_nonzero(braked) > 20
        assert lost_mps2[braked].max() == pytest.approx(most_mps2, abs=0.01)
