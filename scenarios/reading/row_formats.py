"""The formats of CSV rows: every column with its range, in field units."""

from dataclasses import MISSING, dataclass, fields
from typing import Annotated, Literal

from pydantic import Field

from kankaku.scenarios.reading.fields import (
    Cell,
    Clock,
    Kilometre,
    MaybeClock,
    MaybeLatitude,
    MaybeLongitude,
    MaybeName,
    Name,
    OptionalText,
    Text,
)


@dataclass(frozen=True, slots=True)
class Row:
    """A row of a CSV file; ``row`` is its place as a spreadsheet counts it."""

    row: int


@dataclass(frozen=True, slots=True)
class StretchRow(Row):
    """A row that holds between two chainages."""

    start_km: Kilometre
    end_km: Kilometre


@dataclass(frozen=True, slots=True)
class StationRow(Row):
    """A row of ``stations.csv``."""

    id: Name
    name: Text
    chainage_km: Kilometre
    name_local: OptionalText = ""
    lon_deg: MaybeLongitude = None
    lat_deg: MaybeLatitude = None


@dataclass(frozen=True, slots=True)
class TrackRow(StretchRow):
    """A row of ``tracks.csv``: one of the parallel tracks of a section."""

    section: Name
    id: Name


@dataclass(frozen=True, slots=True)
class NodeRow(Row):
    """A row of ``nodes.csv``: where tracks of a network begin, end, join, part or cross."""

    id: Name
    km: Kilometre
    kind: Literal["joint", "points", "buffer", "boundary"]
    fouling_start_km: Kilometre
    fouling_end_km: Kilometre
    throw_s: Annotated[float, Cell, Field(ge=0.0, le=60.0)] = 0.0
    proof_s: Annotated[float, Cell, Field(ge=0.0, le=60.0)] = 0.0


@dataclass(frozen=True, slots=True)
class LinkRow(Row):
    """A row of ``tracks.csv`` of a network: a track between two nodes."""

    id: Name
    from_node: Name
    to_node: Name
    direction: Literal["rising", "falling", "both"]
    across: Annotated[float, Cell, Field(ge=-1000.0, le=1000.0)]
    resource: MaybeName = ""


@dataclass(frozen=True, slots=True)
class RouteRow(Row):
    """A row of ``routes.csv``: a track of a route, in running order."""

    route: Name
    track: Name


@dataclass(frozen=True, slots=True)
class PlatformRow(StretchRow):
    """A row of ``platforms.csv``."""

    station: Name
    track: Name
    stop_km: Kilometre


@dataclass(frozen=True, slots=True)
class TurnoutRow(Row):
    """A row of ``turnouts.csv``."""

    id: Name
    position_km: Kilometre
    fouling_start_km: Kilometre
    fouling_end_km: Kilometre
    throw_s: Annotated[float, Cell, Field(ge=0.0, le=60.0)] = 0.0
    proof_s: Annotated[float, Cell, Field(ge=0.0, le=60.0)] = 0.0


@dataclass(frozen=True, slots=True)
class CrossingRow(StretchRow):
    """A row of ``crossings.csv``."""

    id: Name
    strike_in_km: Kilometre
    closing_s: Annotated[float, Cell, Field(ge=0.0, le=600.0)]


@dataclass(frozen=True, slots=True)
class LimitRow(StretchRow):
    """A row of ``limits.csv``."""

    limit_kmh: Annotated[float, Cell, Field(ge=3.0, le=400.0)]
    track: MaybeName = ""
    train_type: MaybeName = ""


@dataclass(frozen=True, slots=True)
class DrivenSpeedRow(StretchRow):
    """A row of ``driven_speeds.csv``: what drivers run at, where their style keeps to it."""

    speed_kmh: Annotated[float, Cell, Field(ge=5.0, le=400.0)]
    track: MaybeName = ""


@dataclass(frozen=True, slots=True)
class GradientRow(StretchRow):
    """A row of ``gradients.csv``; rising is positive."""

    gradient_permil: Annotated[float, Cell, Field(ge=-120.0, le=120.0)]
    track: MaybeName = ""


@dataclass(frozen=True, slots=True)
class CurveRow(StretchRow):
    """A row of ``curves.csv``."""

    radius_m: Annotated[float, Cell, Field(ge=50.0, le=100000.0)]
    track: MaybeName = ""


@dataclass(frozen=True, slots=True)
class BaliseRow(Row):
    """A row of ``balises.csv``."""

    chainage_km: Kilometre


@dataclass(frozen=True, slots=True)
class BlockRow(StretchRow):
    """A row of ``blocks.csv``."""

    id: Name
    track: Name


@dataclass(frozen=True, slots=True)
class CircuitRow(BlockRow):
    """A row of ``circuits.csv``: one of the track circuits that a block is divided into."""


@dataclass(frozen=True, slots=True)
class GeometryRow(Row):
    """A row of ``geometry.csv``: a point of the drawn centre line."""

    chainage_km: Kilometre
    lon_deg: Annotated[float, Cell, Field(ge=-180.0, le=180.0)]
    lat_deg: Annotated[float, Cell, Field(ge=-90.0, le=90.0)]


@dataclass(frozen=True, slots=True)
class ServiceRow(Row):
    """A row of ``services.csv``, in the order in which the trains leave the line."""

    train: Name
    train_type: Name
    next_train: MaybeName = ""
    route: MaybeName = ""


@dataclass(frozen=True, slots=True)
class CallRow(Row):
    """A row of ``calls.csv``."""

    train: Name
    station: Name
    track: Name
    arrival: Clock
    departure: Clock


@dataclass(frozen=True, slots=True)
class DwellStationRow(Row):
    """A row of ``dwell_stations.csv``: for a time of day or a train type, where it names them."""

    station: Name
    minimum_dwell_s: Annotated[float, Cell, Field(ge=0.0, le=3600.0)]
    booked_dwell_s: Annotated[float, Cell, Field(ge=0.0, le=3600.0)]
    delay_scale: Annotated[float, Cell, Field(ge=0.0, le=100.0)]
    from_time: MaybeClock = ""
    until_time: MaybeClock = ""
    train_type: MaybeName = ""


@dataclass(frozen=True, slots=True)
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
    return tuple(
        field.name
        for field in fields(model)
        if field.name != "row" and (field.default is MISSING or not required)
    )
