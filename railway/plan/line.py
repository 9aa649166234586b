"""
The infrastructure: stations, sections with parallel tracks, limits, gradients, curves.

Chainage (distance along the line in the running direction) is the one coordinate. A line
is a chain of *sections*; a section has one or more parallel *tracks*. Where the number of
tracks changes stands a *turnout* with its fouling section.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kankaku.railway.arrays import GRAVITY_MPS2, FloatArray


@dataclass(frozen=True, slots=True)
class Station:
    """A station; ``chainage_m`` is its official chainage."""

    id: str
    name: str
    name_local: str
    chainage_m: float
    longitude_deg: float
    latitude_deg: float


@dataclass(frozen=True, slots=True)
class Track:
    """One of the parallel tracks of a section."""

    id: str
    start_m: float
    end_m: float


@dataclass(frozen=True, slots=True)
class Section:
    """A stretch of line with a constant number of tracks."""

    start_m: float
    end_m: float
    tracks: tuple[Track, ...]


@dataclass(frozen=True, slots=True)
class Platform:
    """The platform of a station at one track, with the stop position of a train's front."""

    station: str
    track: str
    start_m: float
    end_m: float
    stop_m: float


@dataclass(frozen=True, slots=True)
class Turnout:
    """
    Points at a section boundary.

    A train that has no grant stops before ``fouling_start_m``; a train has cleared the
    turnout when its tail is past ``fouling_end_m``.
    """

    id: str
    position_m: float
    fouling_start_m: float
    fouling_end_m: float
    throw_s: float = 0.0
    """How long the point machine takes from one end position to the other. [s]"""
    proof_s: float = 0.0
    """How long it then takes until the lock is proven. [s]"""


@dataclass(frozen=True, slots=True)
class Crossing:
    """
    A level crossing, across all parallel tracks of its section.

    It begins to close when a front passes ``strike_in_m``, and opens when the last tail that is
    on its way past ``end_m`` has passed it.
    """

    id: str
    start_m: float
    end_m: float
    strike_in_m: float
    closing_s: float


@dataclass(frozen=True, slots=True)
class SpeedLimit:
    """A limit that holds for every part of the train between start and end."""

    start_m: float
    end_m: float
    limit_mps: float


@dataclass(frozen=True, slots=True)
class Gradient:
    """A stretch of constant gradient, rising positive, as a ratio (1 permil is 0.001)."""

    start_m: float
    end_m: float
    gradient: float


@dataclass(frozen=True, slots=True)
class TrackCurve:
    """A stretch of constant curve radius."""

    start_m: float
    end_m: float
    radius_m: float


@dataclass(frozen=True, slots=True)
class Block:
    """A stretch of one track between two signals."""

    id: str
    track: str
    start_m: float
    end_m: float


@dataclass(frozen=True)
class Line:
    """
    A line in one running direction.

    The reader of the scenario files guarantees what this class relies on: sections follow
    each other without gap or overlap, and everything else lies within them.
    """

    name: str
    stations: tuple[Station, ...]
    sections: tuple[Section, ...]
    platforms: tuple[Platform, ...]
    turnouts: tuple[Turnout, ...]
    limits: tuple[SpeedLimit, ...]
    gradients: tuple[Gradient, ...]
    curves: tuple[TrackCurve, ...]
    balises_m: tuple[float, ...]
    blocks: tuple[Block, ...]
    """Either none, or from end to end of every track, rising by chainage."""
    circuits: tuple[Block, ...] = ()
    """Track circuits that blocks are divided into; a block without any is one circuit."""
    release_delay_s: float = 0.0
    """A track circuit counts as occupied this long after the tail has left it. [s]"""
    geometry_lon_lat_deg: tuple[tuple[float, float, float], ...] = ()
    """Chainage, longitude and latitude of points on the drawn centre line."""
    crossings: tuple[Crossing, ...] = ()

    @property
    def start_m(self) -> float:
        """Chainage at which the modelled line begins. [m]"""
        return self.sections[0].start_m

    @property
    def end_m(self) -> float:
        """Chainage at which trains leave the model. [m]"""
        return self.sections[-1].end_m

    @cached_property
    def station_by_id(self) -> Mapping[str, Station]:
        """Stations by identifier."""
        return {station.id: station for station in self.stations}

    @cached_property
    def platform_at(self) -> Mapping[tuple[str, str], Platform]:
        """Platforms by station and track."""
        return {(place.station, place.track): place for place in self.platforms}

    @cached_property
    def track_by_id(self) -> Mapping[str, Track]:
        """Tracks by identifier."""
        return {track.id: track for section in self.sections for track in section.tracks}

    @cached_property
    def section_of_track(self) -> Mapping[str, int]:
        """Index of the section that each track belongs to."""
        return {
            track.id: index
            for index, section in enumerate(self.sections)
            for track in section.tracks
        }

    @cached_property
    def turnout_at(self) -> Mapping[float, Turnout]:
        """Turnouts by their position. [m]"""
        return {turnout.position_m: turnout for turnout in self.turnouts}

    def tracks_between(self, start_m: float, end_m: float) -> tuple[str, ...]:
        """
        Return the tracks that lie, at least in part, between two chainages.

        Parameters
        ----------
        start_m, end_m
            Between where. [m]

        Returns
        -------
        tuple[str, ...]
            Their identifiers, along the line.
        """
        return tuple(
            track.id
            for section in self.sections
            if section.start_m < end_m and start_m < section.end_m
            for track in section.tracks
        )

    @cached_property
    def track_circuits(self) -> tuple[Block, ...]:
        """All track circuits, from end to end of every track; none without blocks."""
        divided = {
            block.id: [
                circuit
                for circuit in self.circuits
                if circuit.track == block.track
                and block.start_m <= circuit.start_m < circuit.end_m <= block.end_m
            ]
            for block in self.blocks
        }
        return tuple(circuit for block in self.blocks for circuit in divided[block.id] or [block])

    @cached_property
    def _height_knots(self) -> tuple[FloatArray, FloatArray]:
        knots_m = [self.start_m]
        heights_m = [0.0]
        for stretch in self.gradients:
            if stretch.start_m > knots_m[-1]:
                knots_m.append(stretch.start_m)
                heights_m.append(heights_m[-1])
            knots_m.append(stretch.end_m)
            heights_m.append(heights_m[-1] + stretch.gradient * (stretch.end_m - stretch.start_m))
        return np.array(knots_m), np.array(heights_m)

    def height_m(self, chainage_m: FloatArray) -> FloatArray:
        """
        Return the height of the track above its start; stretches without gradient are level.

        Parameters
        ----------
        chainage_m
            Where. [m], any shape

        Returns
        -------
        FloatArray
            Height above the start of the line. [m], same shape
        """
        knots_m, heights_m = self._height_knots
        return np.interp(chainage_m, knots_m, heights_m)

    def curve_resistance_mps2(
        self, chainage_m: FloatArray, *, force_times_radius: float = 600.0
    ) -> FloatArray:
        """
        Return the deceleration that the curve at a chainage causes, per unit of train mass.

        Parameters
        ----------
        chainage_m
            Where. [m], any shape
        force_times_radius
            Constant of the formula: 600 for 1067 mm gauge. [kgf/t m]

        Returns
        -------
        FloatArray
            Deceleration, 0 on straight track. [m/s2], same shape

        References
        ----------
        .. [1] Handbook formula of Japanese narrow-gauge lines: curve resistance = 600 / R
           [kgf/t], R in metres (Electric Railway Handbook, Corona, 2007).
        """
        where_m = np.asarray(chainage_m)
        resistance = np.zeros(where_m.shape)
        for curve in self.curves:
            inside = (where_m >= curve.start_m) & (where_m < curve.end_m)
            resistance[inside] = force_times_radius * 1e-3 * GRAVITY_MPS2 / curve.radius_m
        return resistance
