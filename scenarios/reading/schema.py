"""
The file formats: every key and column with its range, in field units.

A unit stands in the name. Everything behind it works with the checked objects. The files of single
commands have modules of their own: ``radio_network`` and ``dependability``.
"""

from collections.abc import Mapping
from typing import Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from kankaku.railway.plan.scenario import GREATEST_ECO_MARGIN_S, LEAST_ECO_MARGIN_S
from kankaku.scenarios.reading.explain import explained
from kankaku.scenarios.reading.fields import (
    CLOCK_TEXT,
    MOST,
    Brake,
    Clock,
    Mass,
    Name,
    Option,
    OptionalName,
    Percent,
    Points,
    Speed,
    SweptDelay,
    Text,
)
from kankaku.scenarios.reading.mistakes import Mistake

M = TypeVar("M", bound=BaseModel)
MOST_TOLD = 50
"""Mistakes of one file with keys that are told; whoever has more has one great one. [-]"""


class Checked(BaseModel):
    """A table whose keys are all known, and whose values are as they are written."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class ControllerEntry(Checked):
    """
    A named pair of protection and operation, perhaps with a supervision, or a peer.

    The options are checked by their owners.
    """

    peer: OptionalName = None
    protection: OptionalName = None
    operation: OptionalName = None
    protection_options: dict[str, Option] = {}
    operation_options: dict[str, Option] = {}
    supervision: OptionalName = None
    supervision_options: dict[str, Option] = {}
    radio: bool = False
    by_default: bool = True
    driving: OptionalName = None
    eco_margin_s: float | None = Field(None, ge=LEAST_ECO_MARGIN_S, le=GREATEST_ECO_MARGIN_S)
    eco_reserve: bool = False


class DwellSettings(Checked):
    """How the measured dwell delays are applied."""

    folder: Text = "."
    scale: float = Field(1.0, ge=0.0, le=100.0)
    cap_s: float = Field(300.0, ge=0.0, le=7200.0)
    trip_correlation: float = Field(0.0, ge=0.0, lt=1.0)


class DetectionSettings(Checked):
    """Train detection by track circuits."""

    release_delay_s: float = Field(1.0, ge=0.0, le=60.0)


class RadioEntry(Checked):
    """The radio between the centre and the trains."""

    cycle_s: float = Field(1.0, ge=0.1, le=2.0)
    delay_least_s: float = Field(0.3, ge=0.0, le=2.0)
    delay_most_s: float = Field(0.6, ge=0.0, le=2.0)
    loss_percent: float = Field(0.0, ge=0.0, lt=100.0)
    burst_factor: float = Field(1.0, ge=1.0, le=100.0)


class WindowEntry(Checked):
    """Something that lasts from one time of day to another."""

    from_: Clock = Field(alias="from")
    to: Clock


class ClosureEntry(WindowEntry):
    """A closed stretch; all tracks between start and end where none are named."""

    id: Name
    tracks: tuple[Name, ...] = Field((), strict=False, max_length=MOST)
    start_km: float = Field(ge=-1000.0, le=10000.0)
    end_km: float = Field(ge=-1000.0, le=10000.0)


class WorkZoneEntry(ClosureEntry):
    """A work zone with its announced end, and when it is really released."""

    released: Clock | None = Field(None, description=CLOCK_TEXT)


class EquipmentFaultEntry(ClosureEntry):
    """Faulty equipment that closes a stretch of track at once."""


class PointsFailureEntry(WindowEntry):
    """Points that do not throw."""

    turnout: Name


class CrossingObstacleEntry(WindowEntry):
    """Something that stands on a level crossing."""

    crossing: Name


class RandomDisruptions(Checked):
    """What goes wrong beside the track by chance."""

    points_failure_percent: float = Field(0.0, ge=0.0, le=100.0)
    points_repair_s: float = Field(300.0, gt=0.0, le=86400.0)
    obstacle_percent: float = Field(0.0, ge=0.0, le=100.0)
    obstacle_s: float = Field(60.0, gt=0.0, le=86400.0)


class OverstayEntry(Checked):
    """A delay of one train at one station."""

    train: Name
    station: Name
    delay_s: float = Field(ge=0.0, le=7200.0)


class SweepEntry(Checked):
    """One run per controller and delay of one train at one station."""

    train: Name
    station: Name
    first_s: SweptDelay
    last_s: SweptDelay
    step_s: float = Field(gt=0.0, lt=1000.0)


class PublishedEntry(Checked):
    """Published results of a sweep, printed beside ours."""

    source: Text
    shortest_interval_s: float | None = Field(None, ge=0.0, le=7200.0)
    greatest_shortening_s: float | None = Field(None, ge=0.0, le=7200.0)
    headway_margin_s: float | None = Field(None, ge=0.0, le=7200.0)


class TurnBackSettings(Checked):
    """The table ``turn_back`` of ``scenario.toml``."""

    minimum_s: float = Field(120.0, ge=0.0, le=7200.0)


class InterlockingSettings(Checked):
    """The table ``interlocking`` of ``scenario.toml``."""

    order: Literal["timetable", "first_come"] = "timetable"


class DrivingStyleEntry(Checked):
    """How trains are driven within what they can and may do."""

    traction_percent: float = Field(100.0, ge=20.0, le=100.0)
    station_brake_kmhps: Brake | None = None
    below_limit_kmh: float = Field(0.0, ge=0.0, le=30.0)
    coasting_band_kmh: float = Field(0.0, ge=0.0, le=60.0)
    departure_reaction_s: float = Field(0.0, ge=0.0, le=30.0)
    driven_speeds: bool = False
    late_after_s: float | None = Field(None, ge=0.0, le=600.0)


class ScenarioFile(Checked):
    """The file ``scenario.toml``."""

    schema_version: Literal[1]
    title: Text
    seed: int = Field(ge=0, le=2**63 - 1)
    step_s: float = Field(ge=0.01, le=0.5)
    patience_min: float = Field(ge=0.0, le=600.0)
    line: Text = "."
    rolling_stock: Text = "."
    timetable: Text = "."
    driving: Name = "fastest"
    driving_styles: dict[Name, DrivingStyleEntry] = {}
    dwell_delays: DwellSettings | None = None
    train_detection: DetectionSettings = DetectionSettings()
    turn_back: TurnBackSettings = TurnBackSettings()
    interlocking: InterlockingSettings = InterlockingSettings()
    radio: RadioEntry | None = None
    work_zones: tuple[WorkZoneEntry, ...] = Field((), strict=False, max_length=MOST)
    equipment_faults: tuple[EquipmentFaultEntry, ...] = Field((), strict=False, max_length=MOST)
    points_failures: tuple[PointsFailureEntry, ...] = Field((), strict=False, max_length=MOST)
    crossing_obstacles: tuple[CrossingObstacleEntry, ...] = Field((), strict=False, max_length=MOST)
    random_disruptions: RandomDisruptions = RandomDisruptions()
    overstays: tuple[OverstayEntry, ...] = Field((), strict=False, max_length=MOST)
    sweep: SweepEntry | None = None
    published: PublishedEntry | None = None
    controllers: dict[Name, ControllerEntry] = Field(min_length=1)


class TractionEntry(Checked):
    """
    Wheel force of the whole train: constant, then constant power, then falling with v^2.

    Or a table, linear between its speeds.
    """

    starting_force_kn: float | None = Field(None, gt=0.0, le=5000.0)
    power_kw: float | None = Field(None, gt=0.0, le=50000.0)
    power_speed_kmh: float | None = Field(None, ge=5.0, le=400.0)
    characteristic_speed_kmh: float | None = Field(None, ge=5.0, le=400.0)
    force_speed: Points = None


class ResistanceEntry(Checked):
    """
    Running resistance of the whole train, ``a + b v + c v^2``, in one of three families of units.

    A coefficient that is left out is 0.
    """

    a_n: float | None = Field(None, ge=0.0, le=1e6)
    b_nspm: float | None = Field(None, ge=0.0, le=1e5)
    c_ns2pm2: float | None = Field(None, ge=0.0, le=1e4)
    a_kn: float | None = Field(None, ge=0.0, le=1000.0)
    b_kn_per_kmh: float | None = Field(None, ge=0.0, le=100.0)
    c_kn_per_kmh2: float | None = Field(None, ge=0.0, le=1.0)
    a_n_per_t: float | None = Field(None, ge=0.0, le=1000.0)
    b_n_per_t_kmh: float | None = Field(None, ge=0.0, le=100.0)
    c_n_per_t_kmh2: float | None = Field(None, ge=0.0, le=1.0)


class SupplyEntry(Checked):
    """Electrical side of the whole train; what is left out is derived from the traction."""

    traction_efficiency_percent: Percent = 85.0
    regeneration_efficiency_percent: float = Field(80.0, ge=0.0, le=100.0)
    regeneration_force_kn: float | None = Field(None, ge=0.0, le=5000.0)
    regeneration_power_kw: float | None = Field(None, ge=0.0, le=50000.0)
    regeneration_cutoff_kmh: float = Field(5.0, ge=0.0, le=100.0)
    auxiliary_kw: float | None = Field(None, ge=0.0, le=5000.0)


class TrainEntry(Checked):
    """
    A train type. ``mass_t`` is the loaded train, ``motor_mass_t`` its motor cars.

    What is left out is that of a typical electric multiple unit.
    """

    cars: int | None = Field(None, ge=1, le=100)
    length_m: float = Field(ge=10.0, le=900.0)
    mass_t: Mass
    motor_mass_t: float | None = Field(None, gt=0.0, le=20000.0)
    rotating_mass_percent: float = Field(8.0, ge=0.0, le=30.0)
    maximum_speed_kmh: Speed
    service_brake_kmhps: Brake
    emergency_brake_kmhps: float | None = Field(None, ge=0.5, le=12.0)
    curve_resistance_permil_m: float = Field(600.0, ge=0.0, le=2000.0)
    jerk_mps3: float | None = Field(None, ge=0.1, le=10.0)
    brake_build_up_s: float = Field(0.0, ge=0.0, le=10.0)
    safety_factor: float = Field(1.0, ge=1.0, le=3.0)
    overspeed_kmh: float = Field(0.0, ge=0.0, le=20.0)
    traction: TractionEntry
    resistance: ResistanceEntry | None = None
    supply: SupplyEntry = SupplyEntry()


class RollingStockFile(Checked):
    """The file ``rolling_stock.toml``."""

    schema_version: Literal[1]
    brake_rate: Literal["level", "net"] = "level"
    train: dict[Name, TrainEntry] = Field(min_length=1)


def check(model: type[M], data: Mapping[str, Any], file: str) -> tuple[M | None, list[Mistake]]:
    """
    Check a TOML file against its schema.

    Parameters
    ----------
    model
        The schema.
    data
        What the file holds.
    file
        Name of the file, for the mistakes.

    Returns
    -------
    tuple[M | None, list[Mistake]]
        The checked object, or nothing and every mistake.
    """
    try:
        return model.model_validate(data), []
    except ValidationError as error:
        details = error.errors(include_url=False)
        mistakes = [
            Mistake(file, *explained(model, detail["loc"], detail["type"], detail["input"]))
            for detail in details[:MOST_TOLD]
        ]
        if len(details) > MOST_TOLD:
            problem = f"{len(details) - MOST_TOLD} more keys are wrong"
            mistakes.append(Mistake(file, "", problem, "keys as documented"))
        return None, mistakes
