"""Trains that are too weak for a hill stand on it, held by the brake."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.controllers.registry import OPERATIONS, build
from kankaku.railway.plan.line import Gradient
from kankaku.railway.plan.rolling_stock import Traction
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.testing.example_lines import blocks_every, commuter_train, world_of
from tests.examples import examples
from tests.property.runs import random_gradients, run, solo_scenario

FEW = examples(3)
END_M = 2000.0
PAIRS = [
    *[("moving_block", operation) for operation in OPERATIONS if operation != "control_map"],
    ("multi_step_atc", "close_up"),
    ("atd", "close_up"),
    ("relative_braking", "close_up"),
    ("over radio", "close_up"),
    ("control_map", "control_map"),
]


@pytest.mark.parametrize(("protection", "operation"), PAIRS)
@FEW
@given(random_gradients(END_M, 0.119), st.floats(40e3, 250e3), st.sampled_from([0.1, 0.5]))
def test_no_command_is_ever_negative_and_whoever_cannot_climb_stands_unaccused(
    protection: str, operation: str, gradients: list[Gradient], force_n: float, step_s: float
) -> None:
    train = commuter_train(brake_mps2=1.5)
    traction = Traction(force_n, 11.0, 22.0)
    train = replace(train, traction=traction, emergency_brake_mps2=1.8)
    scenario = solo_scenario(
        train, [300.0, 1600.0], END_M, gradients=[*gradients], limits=[], step_s=step_s
    )
    track = scenario.line.sections[0].tracks[0]
    line = replace(scenario.line, blocks=blocks_every(track, 250.0))
    scenario = replace(scenario, line=line, patience_s=100.0)
    by_radio = protection == "over radio"
    layer = "moving_block" if by_radio else protection
    spec = ControllerSpec("test", layer, operation, {}, {}, radio=by_radio)
    record, engine = run(scenario, controller=build(spec, world_of(scenario)))
    told = np.array(engine.told_mps)
    assert np.isfinite(told).all()
    assert told.min() >= 0.0
    assert {found.kind for found in record.violations} <= {"stalled"}


def test_a_train_that_meets_a_hill_beyond_its_traction_slows_down_to_a_stand_and_stays() -> None:
    train = commuter_train()
    traction = Traction(100e3, 11.0, 22.0)
    # 80 permil take 0.73 m/s2; the train has 0.23.
    hill = [Gradient(900.0, 1900.0, 0.08)]
    scenario = solo_scenario(
        replace(train, traction=traction), [300.0, 1600.0], END_M, gradients=hill, step_s=0.1
    )
    record, engine = run(replace(scenario, patience_s=300.0))
    front_m, speed_mps = engine.front_m[:, 0], engine.speed_mps[:, 0]
    assert 900.0 < front_m[-1] < 1600.0
    assert np.all(np.diff(front_m) >= 0.0)
    assert speed_mps[-100:].max() == 0.0
    assert {found.kind for found in record.violations} <= {"stalled"}
