"""The meters that every run is measured with."""

from kankaku.railway.meters.energy_meter import EnergyMeter
from kankaku.railway.meters.standstill import StandstillWatch
from kankaku.railway.plan.world import World
from kankaku.railway.step.step_block import Meter

METERS = (EnergyMeter, StandstillWatch)


def all_meters(world: World) -> tuple[Meter, ...]:
    """
    Return new meters for a run.

    Parameters
    ----------
    world
        The trains.

    Returns
    -------
    tuple[Meter, ...]
        One of each.
    """
    return tuple(meter(world) for meter in METERS)
