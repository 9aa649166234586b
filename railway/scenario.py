"""A scenario: one world that every controller meets."""

from collections.abc import Mapping
from dataclasses import dataclass

from railway.dwell import DwellDelays
from railway.line import Line
from railway.rolling_stock import TrainType
from railway.timetable import Timetable


@dataclass(frozen=True, slots=True)
class ControllerSpec:
    """
    A named pair of protection and operation with their options.

    Options are as in the file, with the unit in the key; a layer's own options class is where
    they are checked and converted.
    """

    name: str
    protection: str
    operation: str
    protection_options: Mapping[str, float]
    operation_options: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Scenario:
    """Line, fleet, timetable, dwell delays, controllers and seed."""

    name: str
    title: str
    line: Line
    train_types: Mapping[str, TrainType]
    timetable: Timetable
    dwell_delays: DwellDelays
    controllers: tuple[ControllerSpec, ...]
    seed: int
    step_s: float
    patience_s: float
    """A run ends this long after the last booked call, finished or not. [s]"""
    digest: str
    """Content hash of the scenario's files."""
