"""The file of train types to train types in SI units."""

import math
from collections.abc import Mapping
from pathlib import Path

from kankaku.railway.plan.rolling_stock import PowerSupply, Traction, TrainType, handbook_resistance
from kankaku.scenarios.checks.check_settings import (
    rolling_stock_mistakes,
)
from kankaku.scenarios.reading import schema
from kankaku.scenarios.reading.files import Reader

STOCK_FILE = "rolling_stock.toml"


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
    return {name: _to_train_type(name, entry) for name, entry in stock.train.items()}


def _to_train_type(name: str, entry: schema.TrainEntry) -> TrainType:
    traction, supply = entry.traction, entry.supply
    motor_kg, mass_kg = 1000.0 * entry.motor_mass_t, 1000.0 * entry.mass_t
    return TrainType(
        id=name,
        cars=entry.cars,
        length_m=entry.length_m,
        mass_kg=mass_kg,
        rotating_mass_ratio=entry.rotating_mass_percent / 100.0,
        traction=Traction(
            starting_force_n=1000.0 * traction.starting_force_kn,
            power_speed_mps=traction.power_speed_kmh / 3.6,
            characteristic_speed_mps=traction.characteristic_speed_kmh / 3.6,
        ),
        resistance=handbook_resistance(motor_kg, mass_kg - motor_kg, entry.cars),
        service_brake_mps2=entry.service_brake_kmhps / 3.6,
        emergency_brake_mps2=entry.emergency_brake_kmhps / 3.6,
        maximum_speed_mps=entry.maximum_speed_kmh / 3.6,
        supply=PowerSupply(
            traction_efficiency=supply.traction_efficiency_percent / 100.0,
            regeneration_efficiency=supply.regeneration_efficiency_percent / 100.0,
            regeneration_force_n=1000.0 * supply.regeneration_force_kn,
            regeneration_power_w=1000.0 * supply.regeneration_power_kw,
            regeneration_cutoff_mps=supply.regeneration_cutoff_kmh / 3.6,
            auxiliary_w=1000.0 * supply.auxiliary_kw,
        ),
        jerk_mps3=math.inf if entry.jerk_mps3 is None else entry.jerk_mps3,
        brake_build_up_s=entry.brake_build_up_s,
        safety_factor=entry.safety_factor,
        overspeed_mps=entry.overspeed_kmh / 3.6,
    )
