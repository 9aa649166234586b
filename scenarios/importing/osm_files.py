"""One route of an extract of OpenStreetMap: its ways in order, its stops and its speed limits."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import cos, hypot, radians
from pathlib import Path
from typing import Any, NamedTuple

from kankaku.railway.plan.earth import distance_m
from kankaku.scenarios.importing.formats import SourceError

ROUTES = ("train", "subway", "light_rail", "tram", "railway", "monorail")
"""Values of the key ``route`` that are read."""
RAILS = ("rail", "subway", "light_rail", "tram", "narrow_gauge", "monorail")
STOPPING = {("railway", "stop"), ("railway", "tram_stop"), ("public_transport", "stop_position")}
STATIONS = {("railway", "station"), ("railway", "halt"), ("railway", "tram_stop")}
NAME_WITHIN_M, LINE_WITHIN_M = 250.0, 150.0
"""A stop has the name of a station so near to it; it lies so near to the track. [m]"""
KMH_PER_MPH = 1.609344
_SPEED = re.compile(r"(\d+(?:\.\d+)?)\s*(mph|km/h|kmh|kph)?")


class OsmRoute(NamedTuple):
    """A route relation."""

    id: int
    tags: Mapping[str, str]
    members: tuple[tuple[str, int, str], ...]
    """Kind (n, w, r), identifier and role."""

    @property
    def ways(self) -> tuple[int, ...]:
        """The ways that trains run on."""
        return tuple(
            ref for kind, ref, role in self.members if kind == "w" and "platform" not in role
        )


class OsmWay(NamedTuple):
    """A way."""

    nodes: tuple[int, ...]
    tags: Mapping[str, str]


class OsmStop(NamedTuple):
    """A stop of a route."""

    name: str
    name_local: str
    lon_deg: float
    lat_deg: float
    along_m: float
    """From the start of the route's ways. [m]"""


@dataclass
class OsmLine:
    """A route with what lies along it."""

    route: OsmRoute
    others: tuple[OsmRoute, ...]
    """Routes of the same name, such as the other direction."""
    places: list[tuple[float, float]] = field(default_factory=list)
    """Longitude and latitude along the ways. [deg]"""
    along_m: list[float] = field(default_factory=list)
    """Of these places, from the first one. [m]"""
    stops: list[OsmStop] = field(default_factory=list)
    limits: list[tuple[float, float, float]] = field(default_factory=list)
    """From [m], to [m], speed [km/h]."""
    unread_speeds: set[str] = field(default_factory=set)
    platforms_m: list[float] = field(default_factory=list)
    """Lengths of mapped platforms. [m]"""


class _Extract:
    """A file of OpenStreetMap, read in passes."""

    def __init__(self, source: Path) -> None:
        try:
            # It is needed for this format only, and an extra.
            import osmium  # noqa: PLC0415
        except ImportError as error:
            told = f"{source.name}: the library osmium is not there"
            raise SourceError((f"{told}; allowed: pip install 'kankaku[osm]'",)) from error
        self._osmium: Any = osmium
        self._source = source

    def objects(self, kinds: str, ids: Iterable[int] | None = None) -> Iterator[Any]:
        """Yield objects of some kinds (n, w, r), all of them or those asked for."""
        osm = self._osmium.osm
        bits = osm.NOTHING
        for kind in kinds:
            bits |= {"n": osm.NODE, "w": osm.WAY, "r": osm.RELATION}[kind]
        try:
            found = self._osmium.FileProcessor(str(self._source), bits)
            if ids is not None:
                found = found.with_filter(self._osmium.filter.IdFilter(sorted(ids)))
            yield from found
        except (RuntimeError, OSError, ValueError, self._osmium.InvalidLocationError) as error:
            told = " ".join(str(error).split())
            sentence = f"{self._source.name}: cannot be read: {told}"
            allowed = "a file .osm, .osm.xml or .osm.pbf"
            raise SourceError((f"{sentence}; allowed: {allowed}",)) from error


def read_route(source: Path, route: str) -> OsmLine:
    """
    Read a route.

    Parameters
    ----------
    source
        The extract.
    route
        Name, ``ref`` or identifier of a route relation; may be empty if there is one only.

    Returns
    -------
    OsmLine
        The route.

    Raises
    ------
    SourceError
        With everything that is wrong.
    """
    extract = _Extract(source)
    line = _chosen(source, list(_routes(extract)), route)
    refs = {ref for kind, ref, _ in line.route.members if kind == "w"}
    ways = {
        way.id: OsmWay(tuple(node.ref for node in way.nodes), dict(way.tags))
        for way in extract.objects("w", refs)
    }
    rails = [ref for ref in line.route.ways if _is_rail(ways.get(ref))]
    mistakes = [
        f"{source.name}: way {ref} of relation {line.route.id} is not in the file; allowed: an "
        "extract with the whole route"
        for ref in line.route.ways
        if ref not in ways
    ]
    if not rails:
        mistakes.append(
            f"{source.name}: relation {line.route.id} has no way with railway=*; allowed: "
            f"{', '.join(RAILS)}"
        )
    if mistakes:
        raise SourceError(tuple(mistakes[:20]))
    order = _in_order(source, rails, ways)
    wanted = {node for way in ways.values() for node in way.nodes}
    wanted |= {ref for kind, ref, _ in line.route.members if kind == "n"}
    nodes, stations = _nodes(extract, wanted)
    _place(source, line, order, nodes)
    _add_limits(line, order, ways)
    _add_platforms(line, ways, nodes)
    _add_stops(line, [node for nodes_of, _ in order for node in nodes_of], nodes, stations)
    if len(line.stops) < 2:
        told = f"{source.name}: relation {line.route.id} has {len(line.stops)} stops with a place"
        raise SourceError((f"{told}; allowed: two or more along its ways",))
    return line


def _routes(extract: _Extract) -> Iterator[OsmRoute]:
    for one in extract.objects("r"):
        tags = dict(one.tags)
        if tags.get("type") == "route" and tags.get("route") in ROUTES:
            members = tuple((member.type, member.ref, member.role) for member in one.members)
            yield OsmRoute(one.id, tags, members)


def _chosen(source: Path, routes: Sequence[OsmRoute], asked: str) -> OsmLine:
    """Return the route asked for: of several with that name the one with the most stops."""
    exact = [one for one in routes if asked == str(one.id)]
    keys = ("ref", "name", "name:en")
    matching = exact or [one for one in routes if asked in {one.tags.get(key) for key in keys}]
    if not asked:
        matching = list(routes) if len(routes) == 1 else []
    if not matching:
        told = [f"{one.tags.get('ref') or one.tags.get('name') or one.id}" for one in routes]
        names = ", ".join(sorted(set(told))[:30])
        allowed = f"--route with one of {names}" if names else f"relations with route={ROUTES[0]}"
        problem = f"no route {asked!r}" if asked else f"{len(routes)} routes"
        raise SourceError((f"{source.name}: {problem}; allowed: {allowed}",))
    first, *others = sorted(matching, key=lambda one: (-_stop_count(one), one.id))
    return OsmLine(first, tuple(others))


def _stop_count(route: OsmRoute) -> int:
    return sum(role.startswith("stop") for _, _, role in route.members)


def _is_rail(way: OsmWay | None) -> bool:
    return way is not None and way.tags.get("railway") in RAILS and len(way.nodes) > 1


def _in_order(
    source: Path, rails: Sequence[int], ways: Mapping[int, OsmWay]
) -> list[tuple[tuple[int, ...], int]]:
    """Return nodes of ways one behind the other, each from where the one before ends."""
    first, *rest = rails
    nodes = ways[first].nodes
    if rest and nodes[0] in {ways[rest[0]].nodes[0], ways[rest[0]].nodes[-1]}:
        nodes = nodes[::-1]
    found = [(nodes, first)]
    while rest:
        end = found[-1][0][-1]
        after = next((ref for ref in rest if end in {ways[ref].nodes[0], ways[ref].nodes[-1]}), 0)
        if not after:
            problem = f"no way of the route goes on behind way {found[-1][1]}"
            left = f"{len(rest)} are left, the next one is {rest[0]}"
            allowed = "a route relation whose ways are connected, in order, without branches"
            raise SourceError((f"{source.name}: {problem} ({left}); allowed: {allowed}",))
        nodes = ways[after].nodes
        found.append((nodes if nodes[0] == end else nodes[::-1], after))
        rest.remove(after)
    if found[0][0][0] == found[-1][0][-1]:
        told = f"{source.name}: the route is a ring"
        raise SourceError((f"{told}; allowed: a route with two ends",))
    return found


class _Node(NamedTuple):
    place: tuple[float, float]
    tags: Mapping[str, str]


def _nodes(extract: _Extract, wanted: set[int]) -> tuple[dict[int, _Node], list[_Node]]:
    """Return the nodes that are wanted, and all stations with names."""
    found, stations = {}, []
    for one in extract.objects("n"):
        tags = dict(one.tags)
        is_station = "name" in tags and not STATIONS.isdisjoint(tags.items())
        if (one.id in wanted or is_station) and one.location.valid():
            node = _Node((one.location.lon, one.location.lat), tags)
            if is_station:
                stations.append(node)
            if one.id in wanted:
                found[one.id] = node
    return found, stations


def _place(
    source: Path,
    line: OsmLine,
    order: Sequence[tuple[tuple[int, ...], int]],
    nodes: Mapping[int, _Node],
) -> None:
    """Note where the route runs."""
    lost = sorted({node for nodes_of, _ in order for node in nodes_of if node not in nodes})
    if lost:
        told = f"{source.name}: {len(lost)} nodes of the ways have no place, the first is {lost[0]}"
        raise SourceError((f"{told}; allowed: an extract with all nodes",))
    line.places, line.along_m = [], []
    for nodes_of, _ in order:
        for node in nodes_of[1 if line.places else 0 :]:
            place = nodes[node].place
            step_m = distance_m(line.places[-1], place) if line.places else 0.0
            line.along_m.append(line.along_m[-1] + step_m if line.places else 0.0)
            line.places.append(place)


def _add_limits(
    line: OsmLine, order: Sequence[tuple[tuple[int, ...], int]], ways: Mapping[int, OsmWay]
) -> None:
    at = 0
    for nodes_of, ref in order:
        start_m, end_m = line.along_m[at], line.along_m[at + len(nodes_of) - 1]
        at += len(nodes_of) - 1
        told = [
            ways[ref].tags[key]
            for key in ("maxspeed", "maxspeed:forward", "maxspeed:backward")
            if key in ways[ref].tags
        ]
        speeds_kmh = [speed for text in told if (speed := speed_kmh(text)) is not None]
        line.unread_speeds |= {text for text in told if speed_kmh(text) is None}
        if not speeds_kmh:
            continue
        limit_kmh = min(speeds_kmh)
        if line.limits and line.limits[-1][1:] == (start_m, limit_kmh):
            start_m = line.limits.pop()[0]
        line.limits.append((start_m, end_m, limit_kmh))


def speed_kmh(text: str) -> float | None:
    """
    Return a speed of the key ``maxspeed``.

    Parameters
    ----------
    text
        A number, of km/h or followed by ``mph``.

    Returns
    -------
    float | None
        The speed; nothing if the text is none from 3 up to 400. [km/h]
    """
    found = _SPEED.fullmatch(text.strip())
    if found is None:
        return None
    speed = float(found[1]) * (KMH_PER_MPH if found[2] == "mph" else 1.0)
    return round(speed, 1) if 3.0 <= speed <= 400.0 else None


def _add_platforms(line: OsmLine, ways: Mapping[int, OsmWay], nodes: Mapping[int, _Node]) -> None:
    for kind, ref, role in line.route.members:
        if kind == "w" and "platform" in role and ref in ways:
            places = [nodes[node].place for node in ways[ref].nodes if node in nodes]
            longest_m = max((distance_m(a, b) for a in places for b in places), default=0.0)
            if longest_m > 0.0:
                line.platforms_m.append(longest_m)


def _add_stops(
    line: OsmLine,
    on_track: Sequence[int],
    nodes: Mapping[int, _Node],
    stations: Sequence[_Node],
) -> None:
    """Note the stops: those that the route names, else those that its ways have."""
    named = [
        ref for kind, ref, role in line.route.members if kind == "n" and role.startswith("stop")
    ]
    tagged = [node for node in on_track if not STOPPING.isdisjoint(nodes[node].tags.items())]
    found: list[OsmStop] = []
    for ref in dict.fromkeys(named or tagged):
        if ref not in nodes:
            continue
        node = nodes[ref]
        along_m, away_m = nearest_m(line, node.place)
        if away_m <= LINE_WITHIN_M:
            name, local = _names(node, stations, ref)
            found.append(OsmStop(name, local, *node.place, along_m))
    found.sort(key=lambda stop: stop.along_m)
    # The stop of another direction, or of another track, is the same station.
    line.stops = [
        stop
        for before, stop in pairwise([None, *found])
        if stop and not (before and before.name == stop.name)
    ]


def _names(node: _Node, stations: Sequence[_Node], ref: int) -> tuple[str, str]:
    """Return the name of a stop, in English where it has one, and the local one."""
    near = sorted(stations, key=lambda one: distance_m(one.place, node.place))[:1]
    tags = node.tags
    if "name" not in tags and near and distance_m(near[0].place, node.place) <= NAME_WITHIN_M:
        tags = near[0].tags
    local = tags.get("name", f"Stop {ref}")
    english = tags.get("name:en", local)
    return english, local if local != english else ""


def nearest_m(line: OsmLine, place: tuple[float, float]) -> tuple[float, float]:
    """
    Return where a route is nearest to a place.

    Parameters
    ----------
    line
        The route.
    place
        Longitude and latitude. [deg]

    Returns
    -------
    tuple[float, float]
        Distance along the route [m], and how far the place is from there [m].
    """
    squeeze = cos(radians(place[1]))
    flat = [((lon - place[0]) * squeeze, lat - place[1]) for lon, lat in line.places]
    best = (float("inf"), 0.0)
    for number, ((x, y), (to_x, to_y)) in enumerate(pairwise(flat)):
        leg = (to_x - x) ** 2 + (to_y - y) ** 2
        share = min(max(-(x * (to_x - x) + y * (to_y - y)) / leg, 0.0), 1.0) if leg else 0.0
        away = hypot(x + share * (to_x - x), y + share * (to_y - y))
        start_m, end_m = line.along_m[number], line.along_m[number + 1]
        best = min(best, (away, start_m + share * (end_m - start_m)))
    # A degree of latitude, from the mean radius.
    return best[1], best[0] * distance_m((0.0, 0.0), (0.0, 1.0))
