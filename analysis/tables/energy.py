"""Energy of each train: joules of the record to kilowatt-hours of the tables."""

from typing import NamedTuple

import pandas as pd

from kankaku.analysis.tables.columns import typed_frame
from kankaku.analysis.tables.comfort import jerk_mps3
from kankaku.railway.step.records import ENERGY, RunRecord

JOULES_PER_KWH = 3.6e6


class EnergyTotals(NamedTuple):
    """Energy of all trains of a run."""

    gross_kwh: float
    recovered_kwh: float
    net_kwh: float


def energy_frame(record: RunRecord) -> pd.DataFrame:
    """
    Return distance, work and energy of each train.

    Parameters
    ----------
    record
        What the run left behind.

    Returns
    -------
    pd.DataFrame
        Table ``energy``, one row per train, first train first.
    """
    account = record.energy
    spent_j = account.braking_j + account.resistance_j + account.potential_j + account.kinetic_j
    return typed_frame(
        {
            "train": list(record.world.timetable.trains),
            "distance_m": account.distance_m,
            "traction_work_kwh": account.traction_j / JOULES_PER_KWH,
            "braking_work_kwh": account.braking_j / JOULES_PER_KWH,
            "resistance_work_kwh": account.resistance_j / JOULES_PER_KWH,
            "potential_energy_kwh": account.potential_j / JOULES_PER_KWH,
            "kinetic_energy_kwh": account.kinetic_j / JOULES_PER_KWH,
            "balance_error_kwh": (account.traction_j - spent_j) / JOULES_PER_KWH,
            "auxiliary_kwh": account.auxiliary_j / JOULES_PER_KWH,
            "gross_kwh": account.consumed_j / JOULES_PER_KWH,
            "recovered_kwh": account.recovered_j / JOULES_PER_KWH,
            "net_kwh": (account.consumed_j - account.recovered_j) / JOULES_PER_KWH,
            "interstation_crawl_time_s": record.crawl_s,
            "jerk_mps3": jerk_mps3(record),
            "completed": record.completed,
        },
        ENERGY,
    )


def energy_totals(energy: pd.DataFrame) -> EnergyTotals:
    """
    Return the energy of all trains.

    Parameters
    ----------
    energy
        The table ``energy`` of one run.

    Returns
    -------
    EnergyTotals
        Gross, recovered and net. [kWh]
    """
    return EnergyTotals(
        gross_kwh=float(energy["gross_kwh"].sum()),
        recovered_kwh=float(energy["recovered_kwh"].sum()),
        net_kwh=float(energy["net_kwh"].sum()),
    )
