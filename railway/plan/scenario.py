"""A scenario: one world that every controller meets."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from kankaku.railway.plan.disruptions import UNDISTURBED, Disruptions
from kankaku.railway.plan.driving_style import FASTEST, DrivingStyle
from kankaku.railway.plan.dwell import DwellDelays, Overstay
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.radio_spec import LOSSLESS, RadioSpec
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.timetable import Timetable

MAIN_FILE = "scenario.toml"
"""The file of a scenario that names its controllers and its other files."""
UNSUPERVISED = "none"
"""The supervision of controllers that have none."""
LEAST_ECO_MARGIN_S, GREATEST_ECO_MARGIN_S = 0.001, 60.0
"""What the energy layer of a controller may spend on a leg. [s]"""
Option: TypeAlias = float | bool | tuple[float, ...]
"""A number, a switch, or a table of numbers."""


@dataclass(frozen=True, slots=True)
class ControllerSpec:
    """
    A named pair of protection and operation, with their options and a supervision, or a peer.

    Options are as in the file, with the unit in the key; a layer's own options class is where
    they are checked and converted.
    """

    name: str
    protection: str
    operation: str
    protection_options: Mapping[str, Option]
    operation_options: Mapping[str, Option]
    peer: str | None = None
    """Another program's own control of the trains; protection and operation are empty then."""
    by_default: bool = True
    """Runs where no controllers are named."""
    radio: bool = False
    """The protection's commands go by radio."""
    driving: DrivingStyle | None = None
    """How its trains are driven, if not as the scenario says."""
    eco_margin_s: float | None = None
    """Time that its energy layer may spend on every leg; None for no such layer. [s]"""
    eco_reserve: bool = False
    """That layer also spends recovery time."""
    supervision: str = UNSUPERVISED
    """What decides at platforms."""
    supervision_options: Mapping[str, Option] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Sweep:
    """One run per controller and initial delay of one train at one station."""

    train: str
    station: str
    delays_s: tuple[float, ...]
    """By how much the train overstays, rising. [s]"""


@dataclass(frozen=True, slots=True)
class Published:
    """Published results of a sweep."""

    source: str
    values: Mapping[str, float]
    """By indicator, with the unit in the key."""


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
    sweep: Sweep | None = None
    published: Published | None = None
    radio: RadioSpec = LOSSLESS
    disruptions: Disruptions = UNDISTURBED
    driving: DrivingStyle = FASTEST
    planned_delays: DwellDelays | None = None
    """What planners are told of dwell delays; None where they are told what is so."""
    warnings: tuple[str, ...] = ()
    """What is allowed but doubtful in its files, a sentence each."""

    def with_initial_delay(self, delay_s: float | None) -> "Scenario":
        """
        Return one run of the sweep.

        Parameters
        ----------
        delay_s
            By how much the swept train overstays; None without a sweep. [s]

        Returns
        -------
        Scenario
            The same trains with that delay beside all others.
        """
        if self.sweep is None or delay_s is None:
            return self
        overstay = Overstay(self.sweep.train, self.sweep.station, delay_s)
        return replace(self, dwell_delays=self.dwell_delays.overstaying(overstay))
