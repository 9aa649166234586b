"""
The file formats: every key and column with its range, in field units.

A unit stands in the name. Everything behind it works with the checked objects. The files of single
commands have modules of their own: ``radio_network`` and ``dependability``.
"""

import math
import re
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal, TypeAlias, TypeGuard, TypeVar, get_args, get_origin

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainValidator,
    StringConstraints,
    ValidationError,
)
from pydantic.fields import FieldInfo

from scenarios.faults import Fault, meant, row_place

M = TypeVar("M", bound=BaseModel)

_DECIMAL = re.compile(r"[+-]?\d+(\.\d+)?")
_CLOCK_TEXT = "a time of day as HH:MM:SS, hours 00 to 29"
_CLOCK = re.compile(r"[0-2]\d:[0-5]\d:[0-5]\d")
_OPTION_TEXT = "a finite number, true or false, or a list of finite numbers"
_NAME_TEXT = "text of letters, digits, '-', '_' and '.', at most 60 characters"


def _number(value: object) -> object:
    if isinstance(value, str) and _DECIMAL.fullmatch(value.strip()):
        return float(value)
    return value


def _clock(value: object) -> object:
    # A time without quotes is one to TOML, too.
    if not isinstance(value, str) or not _CLOCK.fullmatch(value):
        raise ValueError(_CLOCK_TEXT)
    return value


def _option(value: object) -> float | bool | tuple[float, ...]:
    if isinstance(value, bool):
        return value
    if _is_finite(value):
        return float(value)
    if isinstance(value, list) and value and all(map(_is_finite, value)):
        return tuple(map(float, value))
    raise ValueError(_OPTION_TEXT)


def _is_finite(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


Cell = BeforeValidator(_number)
Option: TypeAlias = Annotated[float | bool | tuple[float, ...], PlainValidator(_option)]
Name: TypeAlias = Annotated[
    str,
    StringConstraints(pattern=r"^[A-Za-z0-9_.\-]{1,60}$"),
    Field(description=_NAME_TEXT),
]
OptionalName: TypeAlias = Annotated[Name | None, Field(description=_NAME_TEXT)]
Text: TypeAlias = Annotated[str, StringConstraints(min_length=1, max_length=200)]
Clock: TypeAlias = Annotated[str, BeforeValidator(_clock), Field(description=_CLOCK_TEXT)]
Kilometre: TypeAlias = Annotated[float, Cell, Field(ge=-1000.0, le=10000.0)]
Percent: TypeAlias = Annotated[float, Field(gt=0.0, le=100.0)]
Mass: TypeAlias = Annotated[float, Field(gt=0.0, le=20000.0)]
Brake: TypeAlias = Annotated[float, Field(ge=0.5, le=12.0)]
SweptDelay: TypeAlias = Annotated[float, Field(ge=0.0, lt=1000.0)]
Speed: TypeAlias = Annotated[float, Field(ge=5.0, le=400.0)]


class _Checked(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class Controller(_Checked):
    """
    A named pair of protection and operation, or a peer.

    The options are checked by their owners.
    """

    peer: OptionalName = None
    protection: OptionalName = None
    operation: OptionalName = None
    protection_options: dict[str, Option] = {}
    operation_options: dict[str, Option] = {}
    radio: bool = False
    by_default: bool = True


class DwellSettings(_Checked):
    """How the measured dwell delays are applied."""

    folder: Text = "."
    scale: float = Field(1.0, ge=0.0, le=100.0)
    cap_s: float = Field(300.0, ge=0.0, le=7200.0)
    trip_correlation: float = Field(0.0, ge=0.0, lt=1.0)


class DetectionSettings(_Checked):
    """Train detection by track circuits."""

    release_delay_s: float = Field(1.0, ge=0.0, le=60.0)


class RadioEntry(_Checked):
    """The radio between the centre and the trains."""

    cycle_s: float = Field(1.0, ge=0.1, le=2.0)
    delay_least_s: float = Field(0.3, ge=0.0, le=2.0)
    delay_most_s: float = Field(0.6, ge=0.0, le=2.0)
    loss_percent: float = Field(0.0, ge=0.0, lt=100.0)
    burst_factor: float = Field(1.0, ge=1.0, le=100.0)


class WindowEntry(_Checked):
    """Something that lasts from one time of day to another."""

    from_: Clock = Field(alias="from")
    to: Clock


class ClosureEntry(WindowEntry):
    """A closed stretch; all tracks between start and end where none are named."""

    id: Name
    tracks: tuple[Name, ...] = Field((), strict=False)
    start_km: float = Field(ge=-1000.0, le=10000.0)
    end_km: float = Field(ge=-1000.0, le=10000.0)


class WorkZoneEntry(ClosureEntry):
    """A work zone with its announced end, and when it is really released."""

    released: Clock | None = Field(None, description=_CLOCK_TEXT)


class EquipmentFaultEntry(ClosureEntry):
    """Faulty equipment that closes a stretch of track at once."""


class PointsFailureEntry(WindowEntry):
    """Points that do not throw."""

    turnout: Name


class CrossingObstacleEntry(WindowEntry):
    """Something that stands on a level crossing."""

    crossing: Name


class RandomDisruptions(_Checked):
    """What goes wrong beside the track by chance."""

    points_failure_percent: float = Field(0.0, ge=0.0, le=100.0)
    points_repair_s: float = Field(300.0, gt=0.0, le=86400.0)
    obstacle_percent: float = Field(0.0, ge=0.0, le=100.0)
    obstacle_s: float = Field(60.0, gt=0.0, le=86400.0)


class OverstayEntry(_Checked):
    """A delay of one train at one station."""

    train: Name
    station: Name
    delay_s: float = Field(ge=0.0, le=7200.0)


class SweepEntry(_Checked):
    """One run per controller and delay of one train at one station."""

    train: Name
    station: Name
    first_s: SweptDelay
    last_s: SweptDelay
    step_s: float = Field(gt=0.0, lt=1000.0)


class PublishedEntry(_Checked):
    """Published results of a sweep, printed beside ours."""

    source: Text
    shortest_interval_s: float | None = Field(None, ge=0.0, le=7200.0)
    greatest_shortening_s: float | None = Field(None, ge=0.0, le=7200.0)
    headway_margin_s: float | None = Field(None, ge=0.0, le=7200.0)


class ScenarioFile(_Checked):
    """The file ``scenario.toml``."""

    schema_version: Literal[1]
    title: Text
    seed: int = Field(ge=0, le=2**63 - 1)
    step_s: float = Field(ge=0.01, le=0.5)
    patience_min: float = Field(ge=0.0, le=600.0)
    line: Text = "."
    rolling_stock: Text = "."
    timetable: Text = "."
    dwell_delays: DwellSettings | None = None
    train_detection: DetectionSettings = DetectionSettings()
    radio: RadioEntry | None = None
    work_zones: tuple[WorkZoneEntry, ...] = Field((), strict=False)
    equipment_faults: tuple[EquipmentFaultEntry, ...] = Field((), strict=False)
    points_failures: tuple[PointsFailureEntry, ...] = Field((), strict=False)
    crossing_obstacles: tuple[CrossingObstacleEntry, ...] = Field((), strict=False)
    random_disruptions: RandomDisruptions = RandomDisruptions()
    overstays: tuple[OverstayEntry, ...] = Field((), strict=False)
    sweep: SweepEntry | None = None
    published: PublishedEntry | None = None
    controllers: dict[Name, Controller] = Field(min_length=1)


class TractionEntry(_Checked):
    """Wheel force of the whole train: constant, then constant power, then falling with v^2."""

    starting_force_kn: float = Field(gt=0.0, le=5000.0)
    power_speed_kmh: Speed
    characteristic_speed_kmh: Speed


class SupplyEntry(_Checked):
    """Electrical side of the whole train."""

    traction_efficiency_percent: Percent
    regeneration_efficiency_percent: float = Field(ge=0.0, le=100.0)
    regeneration_force_kn: float = Field(ge=0.0, le=5000.0)
    regeneration_power_kw: float = Field(ge=0.0, le=50000.0)
    regeneration_cutoff_kmh: float = Field(ge=0.0, le=100.0)
    auxiliary_kw: float = Field(ge=0.0, le=5000.0)


class TrainEntry(_Checked):
    """A train type. ``mass_t`` is the loaded train, ``motor_mass_t`` its motor cars."""

    cars: int = Field(ge=1, le=30)
    length_m: float = Field(ge=10.0, le=600.0)
    mass_t: Mass
    motor_mass_t: Mass
    rotating_mass_percent: float = Field(ge=0.0, le=30.0)
    maximum_speed_kmh: Speed
    service_brake_kmhps: Brake
    emergency_brake_kmhps: Brake
    traction: TractionEntry
    supply: SupplyEntry


class RollingStockFile(_Checked):
    """The file ``rolling_stock.toml``."""

    schema_version: Literal[1]
    train: dict[Name, TrainEntry] = Field(min_length=1)


class Row(_Checked):
    """A row of a CSV file; ``row`` is its place as a spreadsheet counts it."""

    row: int


class StretchRow(Row):
    """A row that holds between two chainages."""

    start_km: Kilometre
    end_km: Kilometre


class StationRow(Row):
    """A row of ``stations.csv``."""

    id: Name
    name: Text
    name_local: Text
    chainage_km: Kilometre
    lon_deg: Annotated[float, Cell, Field(ge=-180.0, le=180.0)]
    lat_deg: Annotated[float, Cell, Field(ge=-90.0, le=90.0)]


class TrackRow(StretchRow):
    """A row of ``tracks.csv``: one of the parallel tracks of a section."""

    section: Name
    id: Name


class PlatformRow(StretchRow):
    """A row of ``platforms.csv``."""

    station: Name
    track: Name
    stop_km: Kilometre


class TurnoutRow(Row):
    """A row of ``turnouts.csv``."""

    id: Name
    position_km: Kilometre
    fouling_start_km: Kilometre
    fouling_end_km: Kilometre
    throw_s: Annotated[float, Cell, Field(ge=0.0, le=60.0)] = 0.0
    proof_s: Annotated[float, Cell, Field(ge=0.0, le=60.0)] = 0.0


class CrossingRow(StretchRow):
    """A row of ``crossings.csv``."""

    id: Name
    strike_in_km: Kilometre
    closing_s: Annotated[float, Cell, Field(ge=0.0, le=600.0)]


class LimitRow(StretchRow):
    """A row of ``limits.csv``."""

    limit_kmh: Annotated[float, Cell, Field(ge=5.0, le=400.0)]


class GradientRow(StretchRow):
    """A row of ``gradients.csv``; rising is positive."""

    gradient_permil: Annotated[float, Cell, Field(ge=-120.0, le=120.0)]


class CurveRow(StretchRow):
    """A row of ``curves.csv``."""

    radius_m: Annotated[float, Cell, Field(ge=50.0, le=100000.0)]


class BaliseRow(Row):
    """A row of ``balises.csv``."""

    chainage_km: Kilometre


class BlockRow(StretchRow):
    """A row of ``blocks.csv``."""

    id: Name
    track: Name


class CircuitRow(BlockRow):
    """A row of ``circuits.csv``: one of the track circuits that a block is divided into."""


class GeometryRow(Row):
    """A row of ``geometry.csv``: a point of the drawn centre line."""

    chainage_km: Kilometre
    lon_deg: Annotated[float, Cell, Field(ge=-180.0, le=180.0)]
    lat_deg: Annotated[float, Cell, Field(ge=-90.0, le=90.0)]


class ServiceRow(Row):
    """A row of ``services.csv``, in the order in which the trains leave the line."""

    train: Name
    train_type: Name


class CallRow(Row):
    """A row of ``calls.csv``."""

    train: Name
    station: Name
    track: Name
    arrival: Clock
    departure: Clock


class DwellStationRow(Row):
    """A row of ``dwell_stations.csv``."""

    station: Name
    minimum_dwell_s: Annotated[float, Cell, Field(ge=0.0, le=3600.0)]
    booked_dwell_s: Annotated[float, Cell, Field(ge=0.0, le=3600.0)]
    delay_scale: Annotated[float, Cell, Field(ge=0.0, le=100.0)]


class QuantileRow(Row):
    """A row of ``dwell_quantiles.csv``."""

    level: Annotated[float, Cell, Field(ge=0.0, le=1.0)]
    delay_s: Annotated[float, Cell, Field(ge=0.0, le=7200.0)]


def columns(model: type[Row], *, required: bool = False) -> tuple[str, ...]:
    """
    Return the columns of a CSV file.

    Parameters
    ----------
    model
        Its kind of row.
    required
        Leave out those that may be absent.

    Returns
    -------
    tuple[str, ...]
        Names of the columns.
    """
    fields = model.model_fields.items()
    return tuple(
        name for name, field in fields if name != "row" and (field.is_required() or not required)
    )


def check(
    model: type[M], data: Mapping[str, Any], file: str, row: int | None = None
) -> tuple[M | None, list[Fault]]:
    """
    Check one TOML file or one CSV row against its schema.

    Parameters
    ----------
    model
        The schema.
    data
        What the file holds.
    file
        Name of the file, for the faults.
    row
        Row of a CSV file; absent for a TOML file.

    Returns
    -------
    tuple[M | None, list[Fault]]
        The checked object, or nothing and every fault.
    """
    try:
        return model.model_validate(data), []
    except ValidationError as error:
        faults = []
        for detail in error.errors(include_url=False):
            path = [str(part) for part in detail["loc"] if part != "[key]"]
            owner = _owner(model, path[:-1])
            problem, allowed = _explain(owner, path[-1], detail["type"], detail["input"])
            place = ".".join(path) if row is None else row_place(row, path[-1])
            faults.append(Fault(file, place, problem, allowed))
        return None, faults


def _owner(model: type[BaseModel], path: Iterable[str]) -> type[BaseModel] | None:
    """Return the schema of the table that a key path leads to; nothing for a free table."""
    owner: type[BaseModel] | None = model
    freely_named = False
    for part in path:
        if freely_named:
            freely_named = False
            continue
        if owner is None or part not in owner.model_fields:
            return None
        annotation = owner.model_fields[part].annotation
        owner = _model_within(annotation)
        freely_named = get_origin(annotation) in (dict, tuple)
    return None if freely_named else owner


def _model_within(annotation: object) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    inner = (_model_within(part) for part in get_args(annotation))
    return next((model for model in inner if model), None)


def _explain(owner: type[BaseModel] | None, key: str, kind: str, value: object) -> tuple[str, str]:
    named = owner.model_fields if owner else {}
    fields = {field.alias or name: field for name, field in named.items()}
    if kind == "extra_forbidden":
        return f"unknown key {key!r}", meant(key, fields)
    allowed = _allowed(fields[key]) if key in fields else _OPTION_TEXT
    if kind == "missing":
        return "is missing", allowed
    if kind == "string_pattern_mismatch" and key not in fields:
        return f"the name {value!r} is not allowed", _NAME_TEXT
    return ("is empty" if value in ("", {}) else f"{value!r} is not allowed"), allowed


def _allowed(field: FieldInfo) -> str:
    if field.description:
        return field.description
    if get_origin(field.annotation) is tuple:
        (item, *_) = get_args(field.annotation)
        tables = isinstance(item, type) and issubclass(item, BaseModel)
        return "tables in double brackets" if tables else "a list"
    if get_origin(field.annotation) is Literal:
        return " or ".join(str(value) for value in get_args(field.annotation))
    kinds = {float: "a number", int: "a whole number", str: "text", float | None: "a number"}
    kinds |= {bool: "true or false"}
    kind = kinds.get(field.annotation)  # type: ignore[arg-type]
    signs = {"gt": "above", "ge": "from", "lt": "below", "le": "up to"}
    signs |= {"min_length": "of length", "max_length": "up to"}
    bounds = [
        f"{word} {getattr(entry, sign):g}"
        for entry in field.metadata
        for sign, word in signs.items()
        if getattr(entry, sign, None) is not None
    ]
    if kind is None:
        return "one table or more" if bounds else "a table of keys"
    return " ".join([kind, *bounds])
