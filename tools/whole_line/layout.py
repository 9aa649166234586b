"""
The invented track layout of the whole line: nodes, tracks, platforms and blocks.

Two mains from Omiya to Ofuna; the rising (southbound) one lies left of the falling (northbound)
one. Where trains turn back, one or two middle tracks lie between the mains, with points north
and south of the platforms. Both ends of the line are three platform tracks behind a scissors.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from math import ceil

MIDDLE_TRACKS = {
    "minami-urawa": 2,
    "akabane": 2,
    "higashi-jujo": 1,
    "kamata": 2,
    "tsurumi": 2,
    "sakuragicho": 2,
    "isogo": 2,
}
"""Tracks between the mains by station where trains turn back."""
JUNCTION = "higashi-kanagawa"
"""Where the trains of the Yokohama line come and go."""
TERMINAL_ACROSS = (1.0, 2.5, 4.0)
SOUTHBOUND_ACROSS, NORTHBOUND_ACROSS = 1.0, 4.0
TRAIN_KM = 0.2
BEFORE_KM, BEYOND_KM = 0.205, 0.010
"""A platform, from the station's chainage, which is where rising fronts stop. [km]"""
NORTH_KM, SOUTH_KM, FOULING_KM = -0.36, 0.18, 0.08
"""Points, from the station's chainage; they foul so far to both sides. [km]"""
BUFFER_KM = 0.1
"""Ends of the terminal tracks beyond the platforms. [km]"""
BRANCH_KM = 1.0
"""Length of the Yokohama line's tracks before its junction. [km]"""
BLOCK_KM = 0.35
THROW_S, PROOF_S = 5.0, 1.5


@dataclass(frozen=True, slots=True)
class Node:
    """Where tracks begin and end."""

    id: str
    km: float
    kind: str

    @property
    def fouling_km(self) -> tuple[float, float]:
        """Where conflicting movements may not be at the same time. [km]"""
        reach_km = FOULING_KM if self.kind == "points" else 0.0
        return round(self.km - reach_km, 3), round(self.km + reach_km, 3)


@dataclass(frozen=True, slots=True)
class Track:
    """A track between two nodes."""

    id: str
    start: Node
    end: Node
    direction: str
    across: float


@dataclass(frozen=True, slots=True)
class Platform:
    """The platform of a station at a track."""

    station: str
    track: str
    station_km: float

    @property
    def start_km(self) -> float:
        """Lower end. [km]"""
        return round(self.station_km - BEFORE_KM, 3)

    @property
    def end_km(self) -> float:
        """Higher end. [km]"""
        return round(self.station_km + BEYOND_KM, 3)

    def front_km(self, direction: str) -> float:
        """
        Return where fronts stop.

        Parameters
        ----------
        direction
            Of the trains, or of the track.

        Returns
        -------
        float
            Chainage. [km]
        """
        if direction == "falling":
            return round(self.start_km + self.end_km - self.station_km, 3)
        return self.station_km


@dataclass(frozen=True, slots=True)
class Passage:
    """A movement over a node: from a track to the next one."""

    node: Node
    before: Track
    after: Track

    @property
    def low_high(self) -> tuple[Track, Track]:
        """The track on the side of lower chainage, and the other one."""
        if self.before.end == self.node:
            return self.before, self.after
        return self.after, self.before

    def conflicts(self, other: "Passage") -> bool:
        """
        Return whether two movements share a track or cross.

        Parameters
        ----------
        other
            Another movement over the same node.

        Returns
        -------
        bool
            Whether they do.
        """
        (low, high), (other_low, other_high) = self.low_high, other.low_high
        if low == other_low or high == other_high:
            return True
        return (low.across - other_low.across) * (high.across - other_high.across) < 0


@dataclass(frozen=True)
class Layout:
    """The tracks of the line."""

    station_km: Mapping[str, float]
    nodes: tuple[Node, ...]
    tracks: Mapping[str, Track]
    platforms: Mapping[tuple[str, str], Platform]

    def turning_tracks(self, station: str) -> list[str]:
        """
        Return the platform tracks where trains turn back.

        Parameters
        ----------
        station
            The station.

        Returns
        -------
        list[str]
            Tracks for both directions, from the left.
        """
        here = [track for place, track in self.platforms if place == station]
        return [track for track in here if self.tracks[track].direction == "both"]

    def main_track(self, station: str, direction: str) -> str:
        """
        Return the platform track of trains that go on.

        Parameters
        ----------
        station
            The station.
        direction
            Of the trains.

        Returns
        -------
        str
            The main of that direction.
        """
        across = SOUTHBOUND_ACROSS if direction == "rising" else NORTHBOUND_ACROSS
        here = [self.tracks[track] for place, track in self.platforms if place == station]
        return next(t.id for t in here if (t.direction, t.across) == (direction, across))

    def share(self, leg: tuple[str, str], km: float, direction: str) -> float:
        """
        Return how much of a leg lies before a place.

        Parameters
        ----------
        leg
            Stations of departure and of arrival.
        km
            The place.
        direction
            Of the train.

        Returns
        -------
        float
            From 0 to 1.
        """
        shift_km = 0.0 if direction == "rising" else BEYOND_KM - BEFORE_KM
        start_km, end_km = (self.station_km[station] + shift_km for station in leg)
        return (km - start_km) / (end_km - start_km)

    def passages(self, start: str, end: str, direction: str) -> list[Passage]:
        """
        Return the movements over nodes from one track to another.

        Parameters
        ----------
        start, end
            Tracks.
        direction
            Of the train.

        Returns
        -------
        list[Passage]
            In running order.
        """
        rising = direction == "rising"
        found = []
        here = self.tracks[start]
        while here.id != end:
            node = here.end if rising else here.start
            beyond = [t for t in self.tracks.values() if (t.start if rising else t.end) == node]
            ahead = [t for t in beyond if t.id == end] or [
                t for t in beyond if t.direction == direction and t.across in (1.0, 4.0)
            ]
            found.append(Passage(node, here, ahead[0]))
            here = ahead[0]
        return found


def build_layout(station_km: Mapping[str, float]) -> Layout:
    """
    Return the layout.

    Parameters
    ----------
    station_km
        Chainage of the stations, rising.

    Returns
    -------
    Layout
        Nodes, tracks and platforms.
    """
    first, *_, last = station_km
    north_end = Node(f"{first}-end", round(station_km[first] - BEFORE_KM - BUFFER_KM, 3), "buffer")
    south_end = Node(f"{last}-end", round(station_km[last] + BEYOND_KM + BUFFER_KM, 3), "buffer")
    before = Node(first, round(station_km[first] + SOUTH_KM, 3), "points")
    nodes, tracks = [north_end, before], _terminal(first, north_end, before)
    place = first
    for station, km in station_km.items():
        if station not in MIDDLE_TRACKS and station != JUNCTION:
            continue
        south = Node(f"{station}-s", round(km + SOUTH_KM, 3), "points")
        if station == JUNCTION:
            branch = Node("yokohama-line", round(km - BRANCH_KM, 3), "boundary")
            tracks += [*_mains(before, south, place, station), *_branch(branch, south)]
            nodes += [branch, south]
        else:
            north = Node(f"{station}-n", round(km + NORTH_KM, 3), "points")
            tracks += [*_mains(before, north, place, station), *_loop(station, north, south)]
            nodes += [north, south]
        before, place = south, station
    throat = Node(last, round(station_km[last] + NORTH_KM, 3), "points")
    tracks += [*_mains(before, throat, place, last), *_terminal(last, throat, south_end)]
    nodes += [throat, south_end]
    found = [
        Platform(station, track.id, km)
        for station, km in station_km.items()
        for track in sorted(tracks, key=lambda track: track.across)
        if track.start.km <= km - BEFORE_KM and km + BEYOND_KM <= track.end.km
    ]
    by_id = {track.id: track for track in tracks}
    return Layout(station_km, tuple(nodes), by_id, {(p.station, p.track): p for p in found})


def _mains(start: Node, end: Node, place: str, to: str) -> list[Track]:
    return [
        Track(f"southbound-{place}-{to}", start, end, "rising", SOUTHBOUND_ACROSS),
        Track(f"northbound-{to}-{place}", start, end, "falling", NORTHBOUND_ACROSS),
    ]


def _terminal(station: str, start: Node, end: Node) -> list[Track]:
    return [
        Track(f"{station}-{number}", start, end, "both", across)
        for number, across in enumerate(TERMINAL_ACROSS, start=1)
    ]


def _loop(station: str, start: Node, end: Node) -> list[Track]:
    middles = MIDDLE_TRACKS[station]
    middle = [
        Track(f"{station}-{number}", start, end, "both", float(number))
        for number in range(2, 2 + middles)
    ]
    return [
        Track(f"{station}-1", start, end, "rising", SOUTHBOUND_ACROSS),
        *middle,
        Track(f"{station}-{2 + middles}", start, end, "falling", NORTHBOUND_ACROSS),
    ]


def _branch(start: Node, end: Node) -> list[Track]:
    return [
        Track(f"{JUNCTION}-2", start, end, "rising", 2.0),
        Track(f"{JUNCTION}-3", start, end, "falling", 3.0),
    ]


def layout_tables(layout: Layout) -> dict[str, list[list[object]]]:
    """
    Return the files of the layout.

    Parameters
    ----------
    layout
        The layout.

    Returns
    -------
    dict[str, list[list[object]]]
        Rows by file name, heading first.
    """
    nodes: list[list[object]] = [
        ["id", "km", "kind", "fouling_start_km", "fouling_end_km", "throw_s", "proof_s"]
    ]
    for node in layout.nodes:
        moves = (THROW_S, PROOF_S) if node.kind == "points" else (0, 0)
        nodes.append([node.id, node.km, node.kind, *node.fouling_km, *moves])
    tracks: list[list[object]] = [["id", "from_node", "to_node", "direction", "across"]]
    tracks += [
        [t.id, t.start.id, t.end.id, t.direction, f"{t.across:g}"] for t in layout.tracks.values()
    ]
    platforms: list[list[object]] = [["station", "track", "start_km", "end_km", "stop_km"]]
    for p in layout.platforms.values():
        stop_km = p.front_km(layout.tracks[p.track].direction)
        platforms.append([p.station, p.track, p.start_km, p.end_km, stop_km])
    blocks: list[list[object]] = [["id", "track", "start_km", "end_km"]]
    for track in layout.tracks.values():
        for number, (start_km, end_km) in enumerate(pairwise(_edges(layout, track)), start=1):
            blocks.append([f"{track.id}.{number:02d}", track.id, start_km, end_km])
    return {
        "nodes.csv": nodes,
        "tracks.csv": tracks,
        "platforms.csv": platforms,
        "blocks.csv": blocks,
    }


def _edges(layout: Layout, track: Track) -> list[float]:
    """Return where blocks begin and end: fouling zones, platforms, and even parts between."""
    fixed = {track.start.km, track.start.fouling_km[1], track.end.fouling_km[0], track.end.km}
    ends = "points" in {track.start.kind, track.end.kind}
    for platform in layout.platforms.values():
        if platform.track != track.id or (ends and track.end.km - track.start.km < 2 * BLOCK_KM):
            continue
        front_km = platform.front_km(track.direction)
        ahead, behind = (0.06, -0.22) if track.direction == "rising" else (-0.06, 0.22)
        fixed |= {
            round(km, 3)
            for km in (front_km + ahead, front_km + behind)
            if min(abs(km - there) for there in fixed) > 0.1
        }
    edges = []
    for start_km, end_km in pairwise(sorted(fixed)):
        parts = ceil((end_km - start_km) / BLOCK_KM - 0.2)
        edges += [round(start_km + (end_km - start_km) * i / parts, 3) for i in range(parts)]
    return [*edges, track.end.km]
