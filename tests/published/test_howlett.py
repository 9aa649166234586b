"""Where a thrifty train that has held a speed begins to brake, as optimal control has it."""

from dataclasses import replace

import numpy as np
import pytest

from kankaku.railway.motion.eco_run import eco
from kankaku.railway.motion.extremal import BRAKING, HOLDING, extremal, holding_speed_mps
from kankaku.railway.motion.way import way_on
from kankaku.railway.plan.profile import build_profile
from kankaku.railway.plan.rolling_stock import TrainType, handbook_resistance
from kankaku.testing.example_lines import commuter_train, straight_line


def e233() -> TrainType:
    """Ten cars of 440 t, 271 t of them motored; nothing is brought back."""
    train = commuter_train()
    return replace(
        train,
        mass_kg=440e3,
        rotating_mass_ratio=0.076,
        resistance=handbook_resistance(271e3, 169e3, 10),
        supply=replace(train.supply, regeneration_efficiency=0.0),
    )


def braked_from_mps(train: TrainType, held_mps: float) -> float:
    """Return ``U = V^2 R' / (R + V R')``."""
    resistance = train.resistance
    slope = resistance.b_nspm + 2.0 * resistance.c_ns2pm2 * held_mps
    resisting_n = float(resistance.force_n(np.array(held_mps)))
    return held_mps**2 * slope / (resisting_n + held_mps * slope)


@pytest.mark.parametrize(("held_kmh", "braked_kmh"), [(83.0, 42.57), (70.0, 33.86)])
def test_braking_begins_at_the_speed_of_howlett_and_pudney(
    held_kmh: float, braked_kmh: float
) -> None:
    # Howlett and Pudney, Energy-Efficient Train Control, 1995: level track, friction brake only.
    train, held_mps = e233(), held_kmh / 3.6
    wanted_mps = braked_from_mps(train, held_mps)
    assert 3.6 * wanted_mps == pytest.approx(braked_kmh, rel=1e-3)
    resistance = train.resistance
    slope = resistance.b_nspm + 2.0 * resistance.c_ns2pm2 * held_mps
    wire_kg = train.inertial_mass_kg * train.supply.traction_efficiency
    price_wpkg = held_mps**2 * slope / wire_kg
    assert holding_speed_mps(train, price_wpkg) == pytest.approx(held_mps)
    line = straight_line({"west": 300.0}, 21_000.0)
    way = way_on(build_profile(line, [train]), 0, train, (500.0, 20_500.0))
    run = eco(way, extremal(way, price_wpkg).run_time_s)
    speed_mps = run.curve.speed_mps
    assert speed_mps[1:][run.phase == HOLDING].max() == pytest.approx(held_mps, rel=1e-3)
    # The brake sets in within a metre, over which the speed falls by a percent: the nearer end.
    brakes = int(np.argmax(run.phase == BRAKING))
    ends_mps = speed_mps[brakes - 1 : brakes + 1]
    off = np.abs(ends_mps - wanted_mps).min() / wanted_mps
    assert off < 5e-3
    assert ends_mps[1] < 1.005 * wanted_mps
    assert ends_mps[0] > 0.995 * wanted_mps
