"""
A scenario's line as an infrastructure in RailJSON.

Chain and network alike become track sections that begin at their lower chainage. Points become
switches, block boundaries become signals with detectors and routes between them, stop positions
become operational points. Trains are not told.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np

from kankaku.railway.plan.line import BACK, Direction, Line, Track
from kankaku.railway.plan.scenario import Scenario
from kankaku.scenarios.exporting.railjson_routes import (
    BEGIN,
    DOWN,
    END,
    UP,
    EndOfTrack,
    Json,
    routes_of,
)

RAILJSON_VERSION = "3.4.14"
SIGHT_M = 400.0
"""From where drivers see a signal; no scenario tells it. [m]"""
DEGREE_M = 111_320.0
"""Of the equator: lines without coordinates are drawn along it. [m]"""
BOTH = "BOTH"
TOLD = {Direction.RISING: UP, Direction.FALLING: DOWN}
TOLERANCE_M = 0.01


@dataclass(frozen=True, slots=True)
class _Laid:
    """A physical track by chainage."""

    id: str
    low_m: float
    high_m: float
    across: float
    low_node: str
    high_node: str
    ways: frozenset[Direction]

    @property
    def length_m(self) -> float:
        return self.high_m - self.low_m

    def position_m(self, chainage_m: float) -> float:
        """Return a place from the beginning of the track section. [m]"""
        return round(min(max(chainage_m - self.low_m, 0.0), self.length_m), 3)


def railjson_of(scenario: Scenario) -> Json:
    """
    Return the line of a scenario in RailJSON.

    Parameters
    ----------
    scenario
        Its line is told: tracks, points, stations, limits, gradients, curves and blocks.

    Returns
    -------
    dict[str, Any]
        What the JSON file holds; lengths in m, speeds in m/s, slopes in permil. Tracks have no
        direction there: what trains run one way only has signals and routes for that way only.
        Limits of a train type are limits of its tag. Signals are those of an automatic block;
        without blocks there are none, and no routes.
    """
    line = scenario.line
    tracks = list(_laid(line))
    switches, types, joined = _switches(line, tracks)
    borders = list(_borders(line, tracks, joined))
    told: Json = {
        "version": RAILJSON_VERSION,
        "operational_points": list(_points(line, tracks)),
        "routes": [],
        "extended_switch_types": types,
        "switches": switches,
        "track_sections": [_section(line, track) for track in tracks],
        "speed_sections": list(_speed_sections(line, tracks)),
        "electrifications": [],
        "signals": [_signal(*placed) for placed in borders],
        "buffer_stops": [
            {
                "track": track.id,
                "position": round(0.0 if end == BEGIN else track.length_m, 3),
                "id": f"buffer.{track.id}.{end}",
            }
            for track in tracks
            for end in (BEGIN, END)
            if (track.id, end) not in joined
        ],
        "detectors": [
            {"track": track, "position": at_m, "id": f"detector.{track}.{at_m:g}"}
            for track, at_m in dict.fromkeys((track, at_m) for track, at_m, _ in borders)
        ],
        "neutral_sections": [],
    }
    if borders:
        ways = {track.id: frozenset(TOLD[way] for way in track.ways) for track in tracks}
        told["routes"] = routes_of(told, ways)
    return told


def _laid(line: Line) -> Iterator[_Laid]:
    """Yield physical tracks by chainage; one that is used both ways once."""
    if not line.network:
        for number, section in enumerate(line.sections):
            for across, track in enumerate(section.tracks):
                ends = (track.id, track.start_m, track.end_m, float(across))
                nodes = (f"{number}", f"{number + 1}")
                yield _Laid(*ends, *nodes, frozenset({Direction.RISING}))
        return
    ways: dict[str, set[Direction]] = {}
    for track in line.network:
        ways.setdefault(track.physical, set()).add(track.direction)
    for track in line.network:
        if not track.id.endswith(BACK):
            yield _Laid(
                *(track.id, *_by_chainage(line, track), track.across),
                *_nodes(track),
                frozenset(ways[track.physical]),
            )


def _by_chainage(line: Line, track: Track) -> tuple[float, float]:
    if track.direction is Direction.RISING:
        return track.start_m, track.end_m
    return line.mirrored_m(track.end_m), line.mirrored_m(track.start_m)


def _nodes(track: Track) -> tuple[str, str]:
    ends = (track.from_node, track.to_node)
    return ends if track.direction is Direction.RISING else (ends[1], ends[0])


def _switches(
    line: Line, tracks: Sequence[_Laid]
) -> tuple[list[Json], list[Json], set[EndOfTrack]]:
    """Return switches, their own types, and the ends of track that they join."""
    points = {turnout.node for turnout in line.turnouts}
    if not line.network:
        places_m = {round(turnout.position_m, 3) for turnout in line.turnouts}
        points = {track.high_node for track in tracks if round(track.high_m, 3) in places_m}
    switches: list[Json] = []
    types: dict[str, Json] = {}
    joined: set[EndOfTrack] = set()
    for node in dict.fromkeys(track.high_node for track in tracks):
        before = sorted((t for t in tracks if t.high_node == node), key=lambda t: t.across)
        behind = sorted((t for t in tracks if t.low_node == node), key=lambda t: t.across)
        ways = [
            ((one.id, END), (other.id, BEGIN))
            for one, other in _going_on(line, before, behind, points=node in points)
        ]
        parts = _apart(ways)
        for number, part in enumerate(parts):
            name = f"switch.{node}" if len(parts) == 1 else f"switch.{node}.{number}"
            switches.append(_switch(name, part, types))
            joined.update(end for way in part for end in way)
    return switches, list(types.values()), joined


def _going_on(
    line: Line, before: Sequence[_Laid], behind: Sequence[_Laid], *, points: bool
) -> Iterator[tuple[_Laid, _Laid]]:
    """Yield tracks of which some train can go on from one to the other."""
    if not line.network and not points:
        yield from zip(before, behind, strict=False)
        return
    for one in before:
        for other in behind:
            if one.ways & other.ways and (points or one.across == other.across):
                yield one, other


Way = tuple[EndOfTrack, EndOfTrack]


def _apart(ways: Sequence[Way]) -> list[list[Way]]:
    """Return ways by the switch that they belong to: those that share an end do."""
    parts: list[list[Way]] = []
    for way in ways:
        near = [part for part in parts if any(set(way) & set(other) for other in part)]
        parts = [part for part in parts if part not in near]
        parts.append([*(other for part in near for other in part), way])
    return parts


def _switch(name: str, ways: Sequence[Way], types: dict[str, Json]) -> Json:
    """Return a switch with these ways, of its own type where none of RailJSON fits."""
    low, high = (list(dict.fromkeys(way[side] for way in ways)) for side in (0, 1))
    few, many = sorted((low, high), key=len)
    full = len(ways) == len(few) * len(many)
    if len(many) == 1:
        kind, ports = "link", {"A": few[0], "B": many[0]}
    elif len(few) == 1 and len(many) == 2:
        kind, ports = "point_switch", {"A": few[0], "B1": many[0], "B2": many[1]}
    else:
        ports = {f"A{number}": end for number, end in enumerate(low, 1)}
        ports |= {f"B{number}": end for number, end in enumerate(high, 1)}
        port_of = {end: port for port, end in ports.items()}
        between = [(port_of[one], port_of[other]) for one, other in ways]
        kind = "double_slip_switch"
        if not full or len(low) != 2 or len(high) != 2:
            kind = "_".join(["points", *(f"{one}{other}" for one, other in between)])
            types[kind] = {
                "id": kind,
                "ports": list(ports),
                "groups": {f"{a}_{b}": [{"src": a, "dst": b}] for a, b in between},
            }
    return {
        "id": name,
        "switch_type": kind,
        "group_change_delay": 0.0,
        "ports": {port: {"track": track, "endpoint": end} for port, (track, end) in ports.items()},
        "extensions": {"sncf": {"label": name}},
    }


def _section(line: Line, track: _Laid) -> Json:
    slopes = ((row.start_m, row.end_m, row.track, 1000.0 * row.gradient) for row in line.gradients)
    curves = ((row.start_m, row.end_m, row.track, row.radius_m) for row in line.curves)
    coordinates = [_place_deg(line, end_m, track.across) for end_m in (track.low_m, track.high_m)]
    names = {"line_code": 0, "line_name": line.name, "track_number": 0, "track_name": track.id}
    return {
        "id": track.id,
        "length": round(track.length_m, 3),
        "slopes": [
            {"gradient": round(value, 6), "begin": begin_m, "end": end_m}
            for begin_m, end_m, value in _on(track, slopes)
        ],
        "curves": [
            {"radius": round(value, 3), "begin": begin_m, "end": end_m}
            for begin_m, end_m, value in _on(track, curves)
        ],
        "loading_gauge_limits": [],
        "geo": {"type": "LineString", "coordinates": coordinates},
        "extensions": {"sncf": names},
    }


def _on(
    track: _Laid, told: Iterable[tuple[float, float, str, float]]
) -> Iterator[tuple[float, float, float]]:
    """Yield begin, end [m] and value of stretches on a track section."""
    for start_m, end_m, mine, value in told:
        low_m, high_m = max(start_m, track.low_m), min(end_m, track.high_m)
        if mine in {"", track.id} and high_m - low_m > TOLERANCE_M:
            yield track.position_m(low_m), track.position_m(high_m), value


def _place_deg(line: Line, chainage_m: float, across: float) -> list[float]:
    """Return longitude and latitude, from what is drawn, from stations, or along the equator."""
    known = list(line.geometry_lon_lat_deg) or [
        (station.chainage_m, station.longitude_deg, station.latitude_deg)
        for station in line.stations
        if station.longitude_deg is not None and station.latitude_deg is not None
    ]
    if len(known) < 2:
        return [round(chainage_m / DEGREE_M, 7), round(across * 1e-4, 7)]
    along, lon, lat = (np.array(column, dtype=float) for column in zip(*known, strict=True))
    return [round(float(np.interp(chainage_m, along, of)), 7) for of in (lon, lat)]


def _points(line: Line, tracks: Sequence[_Laid]) -> Iterator[Json]:
    by_id = {track.id: track for track in tracks}
    for number, station in enumerate(line.stations, 1):
        parts = []
        for place in line.platforms:
            if place.station != station.id or place.track not in by_id:
                continue  # the other direction of a track for both
            falls = line.track_by_id[place.track].direction is Direction.FALLING
            stop_m = line.mirrored_m(place.stop_m) if falls else place.stop_m
            at_m = by_id[place.track].position_m(stop_m)
            parts.append({"track": place.track, "position": at_m})
        short = {"ci": 0, "ch": "BV", "ch_short_label": "BV", "ch_long_label": "0"}
        yield {
            "id": station.id,
            "parts": parts,
            "weight": None,
            "is_station": True,
            "extensions": {
                "sncf": {**short, "trigram": station.id[:3].upper()},
                "identifier": {"name": station.name, "uic": number},
            },
        }


def _speed_sections(line: Line, tracks: Sequence[_Laid]) -> Iterator[Json]:
    for number, limit in enumerate(line.limits):
        stretch = (limit.start_m, limit.end_m, limit.track, 0.0)
        ranges = [
            {
                "track": track.id,
                "begin": begin_m,
                "end": end_m,
                "applicable_directions": BOTH,
            }
            for track in tracks
            for begin_m, end_m, _ in _on(track, [stretch])
        ]
        tags = {limit.train_type: limit.limit_mps} if limit.train_type else {}
        yield {
            "id": f"limit.{number}",
            "speed_limit": None if limit.train_type else limit.limit_mps,
            "speed_limit_by_tag": tags,
            "track_ranges": ranges,
            "on_routes": None,
        }


def _borders(
    line: Line, tracks: Sequence[_Laid], joined: AbstractSet[EndOfTrack]
) -> Iterator[tuple[str, float, str]]:
    """Yield track, place [m] and direction where a block ends and trains can go on."""
    by_id = {track.id: track for track in tracks}
    edges_m: Mapping[str, set[float]] = {track.id: set() for track in tracks}
    for block in line.blocks:
        track = line.track_by_id[block.track]
        ends_m = (block.start_m, block.end_m)
        if track.direction is Direction.FALLING:
            ends_m = (line.mirrored_m(block.end_m), line.mirrored_m(block.start_m))
        edges_m[track.physical].update(by_id[track.physical].position_m(at_m) for at_m in ends_m)
    for name, places_m in edges_m.items():
        length_m = by_id[name].length_m
        for at_m in sorted(places_m):
            begins, ends = at_m <= TOLERANCE_M, length_m - at_m <= TOLERANCE_M
            if (begins and (name, BEGIN) not in joined) or (ends and (name, END) not in joined):
                continue
            for way in sorted(by_id[name].ways, reverse=True):
                # At either end of a track only trains that leave it come to a signal.
                if not (begins if way is Direction.RISING else ends):
                    yield name, at_m, TOLD[way]


def _signal(track: str, at_m: float, direction: str) -> Json:
    name = f"{track}.{at_m:g}.{direction}"
    return {
        "track": track,
        "position": at_m,
        "id": f"signal.{name}",
        "direction": direction,
        "sight_distance": SIGHT_M,
        "logical_signals": [
            {
                "signaling_system": "BAL",
                "next_signaling_systems": ["BAL"],
                "settings": {"Nf": "true"},
                "default_parameters": {"jaune_cli": "false"},
                "conditional_parameters": [],
            }
        ],
        "extensions": {"sncf": {"label": name, "side": "LEFT", "kp": ""}},
    }
