"""The file of train types to train types in SI units."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from kankaku.railway.plan.rolling_stock import (
    AnyTraction,
    ForceTable,
    PowerSupply,
    RunningResistance,
    Traction,
    TrainType,
    handbook_resistance,
)
from kankaku.scenarios.checks.check_stock import FAMILIES, given, rolling_stock_mistakes
from kankaku.scenarios.reading import schema
from kankaku.scenarios.reading.files import Reader

STOCK_FILE = "rolling_stock.toml"
CAR_M = 20.0
"""Length of a car where their number is not told. [m]"""
MOTOR_SHARE = 0.5
"""Mass of the motor cars over that of the train where it is not told. [-]"""
EMERGENCY_SHARE = 1.2
"""Emergency brake over service brake where it is not told. [-]"""
CAR_AUXILIARY_KW = 15.0
"""Auxiliaries of a car where they are not told. [kW]"""
SPEEDS = 1001
"""At so many speeds the greatest power of a traction is looked for. [-]"""


def read_stock(reader: Reader, folder: Path) -> schema.RollingStockFile | None:
    """
    Read the train types.

    Parameters
    ----------
    reader
        Collects mistakes.
    folder
        Their folder.

    Returns
    -------
    RollingStockFile | None
        The train types; nothing if they have mistakes.
    """
    data = reader.toml(folder / STOCK_FILE, "rolling_stock")
    if data is None:
        return None
    stock, mistakes = schema.check(schema.RollingStockFile, data, STOCK_FILE)
    reader.mistakes += mistakes
    if stock:
        reader.mistakes += rolling_stock_mistakes(stock, STOCK_FILE)
    return stock


def to_train_types(stock: schema.RollingStockFile) -> Mapping[str, TrainType]:
    """
    Convert train types to SI units.

    Parameters
    ----------
    stock
        File without mistakes.

    Returns
    -------
    Mapping[str, TrainType]
        Train types by identifier.
    """
    net_brake = stock.brake_rate == "net"
    return {name: _to_train_type(name, entry, net_brake) for name, entry in stock.train.items()}


def _to_train_type(name: str, entry: schema.TrainEntry, net_brake: bool) -> TrainType:
    cars = entry.cars or max(round(entry.length_m / CAR_M), 1)
    traction = _to_traction(entry.traction)
    emergency_kmhps = entry.emergency_brake_kmhps or EMERGENCY_SHARE * entry.service_brake_kmhps
    return TrainType(
        id=name,
        cars=cars,
        length_m=entry.length_m,
        mass_kg=1000.0 * entry.mass_t,
        rotating_mass_ratio=entry.rotating_mass_percent / 100.0,
        traction=traction,
        resistance=_to_resistance(entry, cars),
        service_brake_mps2=entry.service_brake_kmhps / 3.6,
        emergency_brake_mps2=emergency_kmhps / 3.6,
        maximum_speed_mps=entry.maximum_speed_kmh / 3.6,
        supply=_to_supply(entry, cars, traction),
        curve_resistance_m=entry.curve_resistance_permil_m / 1000.0,
        net_brake=net_brake,
        jerk_mps3=np.inf if entry.jerk_mps3 is None else entry.jerk_mps3,
        brake_build_up_s=entry.brake_build_up_s,
        safety_factor=entry.safety_factor,
        overspeed_mps=entry.overspeed_kmh / 3.6,
    )


def _to_traction(entry: schema.TractionEntry) -> AnyTraction:
    if entry.force_speed is not None:
        speeds_kmh, forces_kn = zip(*entry.force_speed, strict=True)
        return ForceTable(
            tuple(speed_kmh / 3.6 for speed_kmh in speeds_kmh),
            tuple(1000.0 * force_kn for force_kn in forces_kn),
        )
    force_kn = entry.starting_force_kn or 0.0
    power_kw, power_speed_kmh = entry.power_kw, entry.power_speed_kmh or 0.0
    power_speed_mps = power_speed_kmh / 3.6 if power_kw is None else power_kw / force_kn
    characteristic_kmh = entry.characteristic_speed_kmh or np.inf
    return Traction(1000.0 * force_kn, power_speed_mps, characteristic_kmh / 3.6)


def _to_resistance(entry: schema.TrainEntry, cars: int) -> RunningResistance:
    mass_kg, told = 1000.0 * entry.mass_t, entry.resistance
    if told is None:
        motor_mass_t = entry.motor_mass_t or MOTOR_SHARE * entry.mass_t
        motor_kg = 1000.0 * motor_mass_t
        return handbook_resistance(motor_kg, mass_kg - motor_kg, cars)
    units_n = dict(zip(FAMILIES, (1.0, 1000.0, entry.mass_t), strict=True))
    family = next(family for family in FAMILIES if set(family) & set(given(told)))
    per_mps = 1.0 if family == FAMILIES[0] else 3.6
    a, b, c = (units_n[family] * (getattr(told, key) or 0.0) for key in family)
    return RunningResistance(a, b * per_mps, c * per_mps**2)


def _to_supply(entry: schema.TrainEntry, cars: int, traction: AnyTraction) -> PowerSupply:
    supply = entry.supply
    force_kn, power_kw = supply.regeneration_force_kn, supply.regeneration_power_kw
    auxiliary_kw = CAR_AUXILIARY_KW * cars if supply.auxiliary_kw is None else supply.auxiliary_kw
    force_n = traction.starting_force_n if force_kn is None else 1000.0 * force_kn
    greatest_w = _greatest_power_w(traction, entry.maximum_speed_kmh / 3.6)
    return PowerSupply(
        traction_efficiency=supply.traction_efficiency_percent / 100.0,
        regeneration_efficiency=supply.regeneration_efficiency_percent / 100.0,
        regeneration_force_n=force_n,
        regeneration_power_w=greatest_w if power_kw is None else 1000.0 * power_kw,
        regeneration_cutoff_mps=supply.regeneration_cutoff_kmh / 3.6,
        auxiliary_w=1000.0 * auxiliary_kw,
    )


def _greatest_power_w(traction: AnyTraction, maximum_mps: float) -> float:
    speeds = np.append(np.linspace(0.0, maximum_mps, SPEEDS), traction.bends_mps)
    speeds = speeds[speeds <= maximum_mps]
    return float((speeds * traction.force_n(speeds)).max())
