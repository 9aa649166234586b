"""A central and a conventional system to vary, and trains that stand in a cell."""

from dataclasses import replace
from typing import Any

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.radio.cells import Cells, RadioSystem

CENTRAL = RadioSystem(
    name="central",
    title="central controller",
    central=True,
    wired_bps=10e6,
    radio_bps=64e3,
    radio_packet_bytes=180,
    wired_packet_bytes=7740,
    cycle_s=1.0,
    updates_per_cycle=2,
    broadcasts_per_update=2,
    own_slots_per_cycle=1,
    answer_slots=6,
    trackside_devices=3,
    trackside_devices_max=20,
    loss=0.0,
    repeats=1,
)
CONVENTIONAL = replace(
    CENTRAL,
    name="conventional",
    title="base units",
    central=False,
    radio_bps=9600.0,
    radio_packet_bytes=72,
    wired_packet_bytes=72,
    updates_per_cycle=1,
    broadcasts_per_update=0,
    own_slots_per_cycle=0,
    answer_slots=1,
    trackside_devices=0,
    trackside_devices_max=0,
    repeats=0,
)
ONE_CELL = Cells(np.array([0.0, 1000.0]), 0.0)


def changed(system: RadioSystem, **values: Any) -> RadioSystem:  # noqa: ANN401
    """Return a system with other values."""
    return replace(system, **values)


def standing(system: RadioSystem, trains: int, seconds: float) -> FloatArray:
    """Return trains that stand in the middle of the first kilometre."""
    return np.full((round(seconds / system.update_s), trains), 500.0)
