"""What a planner knows of a line: stations, trips, a train, limits and gradients."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.reading.row_formats import (
    CurveRow,
    GeometryRow,
    GradientRow,
    LimitRow,
)


@dataclass(frozen=True, slots=True)
class Stop:
    """A station."""

    id: str
    name: str
    chainage_km: float
    name_local: str = ""
    lon_deg: float | None = None
    lat_deg: float | None = None


class TripCall(NamedTuple):
    """A booked stop; times are whole seconds after midnight, from 24 hours on after the next."""

    station: str
    arrival_s: int
    departure_s: int


@dataclass(frozen=True, slots=True)
class DraftTrip:
    """A train from where it begins to where it ends, in one running direction."""

    id: str
    train_type: str
    calls: tuple[TripCall, ...]
    next_trip: str = ""
    """What the same stock runs next, the other way, from where this one ends."""


@dataclass
class Sketch:
    """A line and its traffic, without a track yet."""

    title: str
    notes: SourceNotes
    stops: tuple[Stop, ...]
    """By rising chainage."""
    trips: tuple[DraftTrip, ...]
    train_types: Mapping[str, Mapping[str, Any]]
    """Tables ``[train.NAME]`` of ``rolling_stock.toml`` by name."""
    limits: list[LimitRow] = field(default_factory=list)
    gradients: list[GradientRow] = field(default_factory=list)
    curves: list[CurveRow] = field(default_factory=list)
    geometry: list[GeometryRow] = field(default_factory=list)
    single_track: bool = False
    """One track between stations, with loops where trains of both directions meet."""
    left_hand: bool = True
    """Which track rising trains use, looking along them."""
    minimum_turn_back_s: float = 120.0
    driving: Mapping[str, Any] = field(default_factory=dict)
    """Keys that ``scenario.toml`` has besides those of every scenario."""

    @property
    def at_km(self) -> dict[str, float]:
        """Chainage by station. [km]"""
        return {stop.id: stop.chainage_km for stop in self.stops}

    def rises(self, trip: DraftTrip) -> bool:
        """Return whether a trip runs towards higher chainage."""
        at_km = self.at_km
        return at_km[trip.calls[-1].station] > at_km[trip.calls[0].station]
