"""Resistance in its original units, and the shape of the traction curve."""

from dataclasses import replace

import numpy as np
import pytest

from kankaku.railway.plan.rolling_stock import Traction, handbook_resistance
from kankaku.testing.example_lines import commuter_train

KGF_N = 9.80665


def original_formula_kgf(speed_kmh: float, motor_t: float, trailer_t: float, cars: int) -> float:
    """Sakai 2020, figure 6, as printed."""
    return (
        (1.65 + 0.0247 * speed_kmh) * motor_t
        + (0.78 + 0.0028 * speed_kmh) * trailer_t
        + (0.028 + 0.0078 * (cars - 1)) * speed_kmh**2
    )


@pytest.mark.parametrize("speed_kmh", [0.0, 12.0, 45.0, 75.0, 110.0])
def test_resistance_is_the_handbook_formula_in_other_units(speed_kmh: float) -> None:
    resistance = handbook_resistance(170_000.0, 125_000.0, 10)
    expected_kgf = original_formula_kgf(speed_kmh, 170.0, 125.0, 10)
    assert resistance.force_n(np.array(speed_kmh / 3.6)) / KGF_N == pytest.approx(expected_kgf)


def test_resistance_of_sakais_train_at_60_kmh_is_about_one_tonne_force() -> None:
    # By hand: 3.132 * 170 + 0.948 * 125 + 0.0982 * 3600 = 532.44 + 118.5 + 353.52 kgf.
    force_n = handbook_resistance(170_000.0, 125_000.0, 10).force_n(np.array(60.0 / 3.6))
    assert force_n / KGF_N == pytest.approx(1004.46)


def test_traction_never_jumps_and_never_rises_with_speed() -> None:
    traction = Traction(400_000.0, 11.0, 22.0)
    speed = np.linspace(0.0, 40.0, 40_001)
    force = traction.force_n(speed)
    assert np.all(np.diff(force) <= 1e-9)
    # The steepest part is at the start of constant power: F / v = 36 kN per m/s.
    assert np.abs(np.diff(force)).max() <= 400_000.0 / 11.0 * 0.001 * (1.0 + 1e-6)


def test_traction_is_constant_force_then_constant_power_then_falls_with_the_square() -> None:
    force = Traction(400_000.0, 11.0, 22.0).force_n(np.array([0.0, 5.0, 11.0, 16.0, 22.0, 33.0]))
    assert force[:3] == pytest.approx([400_000.0] * 3)
    assert force[3:5] * np.array([16.0, 22.0]) == pytest.approx([4.4e6, 4.4e6])
    assert force[5] == pytest.approx(force[4] * (22.0 / 33.0) ** 2)


def test_rotating_parts_slow_acceleration_and_gravity_alike() -> None:
    train = replace(commuter_train(), rotating_mass_ratio=0.25, mass_kg=400_000.0)
    assert train.inertial_mass_kg == pytest.approx(500_000.0)
    assert train.gravity_ratio == pytest.approx(0.8)
    net_n = 400_000.0 - original_formula_kgf(0.0, 160.0, 240.0, 10) * KGF_N
    assert train.level_acceleration_mps2(np.zeros(1))[0] == pytest.approx(net_n / 500_000.0)
