"""
The infrastructure: stations, tracks, points, limits, gradients, curves.

A line is either a *chain* of sections with parallel tracks, for trains of one direction, or a
*network* of directed tracks that join at nodes, for both directions, branches and turn-backs.
Every train has one coordinate that rises along its own route. On a chain, and for trains towards
higher chainage, that is the chainage itself; for *falling* trains it is the chainage mirrored, so
that both run through the same range. Tracks and turnouts are told in these running coordinates;
:mod:`kankaku.railway.plan.met` turns what is told by chainage into what a train meets.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property

import numpy as np

from kankaku.railway.arrays import GRAVITY_MPS2, FloatArray


@dataclass(frozen=True, slots=True)
class Station:
    """A station; ``chainage_m`` is its official chainage, None a coordinate that nobody told."""

    id: str
    name: str
    name_local: str
    chainage_m: float
    longitude_deg: float | None
    latitude_deg: float | None


CURVE_RESISTANCE_M = 0.6
"""Curve resistance over weight, times the radius: 600 kgf/t m on 1067 mm gauge. [m]"""
BACK = "~"
"""Ends the identifier of a two-way track as falling trains use it; no file can name it."""


class Direction(IntEnum):
    """Where trains run to."""

    RISING = 1
    """Towards higher chainage."""
    FALLING = -1


@dataclass(frozen=True, slots=True)
class Track:
    """
    A track in one running direction.

    A track that trains use both ways is two of them, which share one resource.
    """

    id: str
    start_m: float
    """In the coordinate of its trains. [m]"""
    end_m: float
    direction: Direction = Direction.RISING
    resource: str = ""
    """The physical track; its own identifier if empty."""
    across: float = 0.0
    """Its place across the line, from the left when looking along rising chainage. [-]"""
    from_node: str = ""
    """Where its trains come from; empty on a chain."""
    to_node: str = ""

    @property
    def place(self) -> str:
        """The physical track, which one movement at a time may take."""
        return self.resource or self.id

    @property
    def physical(self) -> str:
        """Its name in files and tables, whichever way trains use it."""
        return self.id.removesuffix(BACK)


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
    node: str = ""
    """The node where it stands; empty on a chain."""


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
    track: str = ""
    """The physical track on which it holds; empty for all."""
    train_type: str = ""
    """The type of train for which it holds; empty for all."""


@dataclass(frozen=True, slots=True)
class Gradient:
    """A stretch of constant gradient, rising positive, as a ratio (1 permil is 0.001)."""

    start_m: float
    end_m: float
    gradient: float
    track: str = ""
    """The physical track on which it lies; empty for all."""


@dataclass(frozen=True, slots=True)
class TrackCurve:
    """A stretch of constant curve radius."""

    start_m: float
    end_m: float
    radius_m: float
    track: str = ""
    """The physical track on which it lies; empty for all."""


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
    A chain of sections, or a network of directed tracks.

    The reader of the scenario files guarantees what this class relies on: sections, or the tracks
    of a route, follow each other without gap or overlap, and everything else lies within them.
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
    network: tuple[Track, ...] = ()
    """The tracks of a network, which has no sections; empty for a chain."""
    extent_m: tuple[float, float] = (0.0, 0.0)
    """Lowest and highest chainage of a network. [m]"""
    first_come: bool = False
    """In a network turns go to who comes first, not by the timetable, where that is safe."""
    driven_speeds: tuple[SpeedLimit, ...] = ()
    """What drivers run at by place, where their style keeps to it."""

    @cached_property
    def tracks(self) -> tuple[Track, ...]:
        """All tracks, each in one running direction."""
        return self.network or tuple(t for section in self.sections for t in section.tracks)

    @property
    def start_m(self) -> float:
        """Coordinate at which the modelled line begins. [m]"""
        return self.extent_m[0] if self.network else self.sections[0].start_m

    @property
    def end_m(self) -> float:
        """Coordinate at which it ends. [m]"""
        return self.extent_m[1] if self.network else self.sections[-1].end_m

    def mirrored_m(self, place_m: float) -> float:
        """
        Return a place in the coordinate of the other running direction.

        Parameters
        ----------
        place_m
            Chainage, or coordinate of a falling train. [m]

        Returns
        -------
        float
            Coordinate of a falling train, or chainage. [m]
        """
        return self.start_m + self.end_m - place_m

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
        return {track.id: track for track in self.tracks}

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

    @cached_property
    def _turnout_number(self) -> Mapping[str | float, int]:
        return {
            turnout.node if self.network else turnout.position_m: number
            for number, turnout in enumerate(self.turnouts)
        }

    def turnout_behind(self, track: str) -> int:
        """
        Return the turnout at the end of a track.

        Parameters
        ----------
        track
            Identifier of the track.

        Returns
        -------
        int
            Its number; -1 where there is none.
        """
        ends = self.track_by_id[track]
        return self._turnout_number.get(ends.to_node if self.network else ends.end_m, -1)

    def fouling_m(self, turnout: int, direction: Direction) -> tuple[float, float]:
        """
        Return the fouling section of a turnout as trains meet it.

        Parameters
        ----------
        turnout
            Number of the turnout.
        direction
            Of the trains.

        Returns
        -------
        tuple[float, float]
            Where fronts wait, and where tails have cleared it. [m]
        """
        points = self.turnouts[turnout]
        if direction is Direction.RISING:
            return points.fouling_start_m, points.fouling_end_m
        return self.mirrored_m(points.fouling_end_m), self.mirrored_m(points.fouling_start_m)

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
        return tuple(t.id for t in self.tracks if t.start_m < end_m and start_m < t.end_m)

    @cached_property
    def track_circuits(self) -> tuple[Block, ...]:
        """All track circuits, from end to end of every track; none without blocks."""
        divided = {
            (block.id, block.track): [
                circuit
                for circuit in self.circuits
                if circuit.track == block.track
                and block.start_m <= circuit.start_m < circuit.end_m <= block.end_m
            ]
            for block in self.blocks
        }
        return tuple(
            circuit
            for block in self.blocks
            for circuit in divided[block.id, block.track] or [block]
        )

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
        self, chainage_m: FloatArray, *, curve_resistance_m: float = CURVE_RESISTANCE_M
    ) -> FloatArray:
        """
        Return the deceleration that the curve at a chainage causes, per unit of train mass.

        Parameters
        ----------
        chainage_m
            Where. [m], any shape
        curve_resistance_m
            Constant of the formula: resistance over weight, times the radius. [m]

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
            resistance[inside] = curve_resistance_m * GRAVITY_MPS2 / curve.radius_m
        return resistance
