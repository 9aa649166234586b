"""An infrastructure in RailJSON: what stands in the file, checked."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from kankaku.scenarios.importing.source_keys import KeyPlace, safe_text

VERSIONS = ("3.4.12", "3.4.13", "3.4.14")
"""Of infrastructures that are read."""
BEGIN, END = "BEGIN", "END"
START_TO_STOP, STOP_TO_START, BOTH = "START_TO_STOP", "STOP_TO_START", "BOTH"
STRAIGHT_M = 1e5
"""A curve of a greater radius is no curve to a scenario. [m]"""
LONGEST_M = 1e6
MOST_KMH = 400.0
"""A limit above it is none to a scenario. [km/h]"""
SWITCH_TYPES: Mapping[str, tuple[tuple[str, ...], tuple[tuple[str, str], ...]]] = {
    "link": (("A", "B"), (("A", "B"),)),
    "point_switch": (("A", "B1", "B2"), (("A", "B1"), ("A", "B2"))),
    "crossing": (("A1", "B1", "A2", "B2"), (("A1", "B1"), ("A2", "B2"))),
    "single_slip_switch": (
        ("A1", "B1", "A2", "B2"),
        (("A1", "B1"), ("A1", "B2"), ("A2", "B2")),
    ),
    "double_slip_switch": (
        ("A1", "B1", "A2", "B2"),
        (("A1", "B1"), ("A1", "B2"), ("A2", "B1"), ("A2", "B2")),
    ),
}
"""Ports and ways of the types that every infrastructure knows."""


class TrackEnd(NamedTuple):
    """One end of a track section."""

    track: str
    endpoint: str


class Spot(NamedTuple):
    """A place on a track section."""

    track: str
    position_m: float


class Stretch(NamedTuple):
    """A value that holds on a part of a track section."""

    track: str
    begin_m: float
    end_m: float
    value: float
    directions: str = BOTH


class Beside(NamedTuple):
    """Something at the track, for trains of one direction or both."""

    spot: Spot
    direction: str


@dataclass(frozen=True, slots=True)
class Stopping:
    """An operational point."""

    id: str
    name: str
    spots: tuple[Spot, ...]
    codes: frozenset[str]
    """What trains may call it by: identifier, name, short name, UIC code."""


@dataclass
class RailjsonTracks:
    """An infrastructure."""

    version: str
    lengths_m: dict[str, float] = field(default_factory=dict)
    """By track section. [m]"""
    joined: dict[TrackEnd, list[TrackEnd]] = field(default_factory=dict)
    """Where trains may go on."""
    points: list[Stopping] = field(default_factory=list)
    slopes: list[Stretch] = field(default_factory=list)
    """[permil]"""
    curves: list[Stretch] = field(default_factory=list)
    """[m]"""
    limits: list[Stretch] = field(default_factory=list)
    """[km/h]"""
    signals: list[Beside] = field(default_factory=list)
    detectors: list[Beside] = field(default_factory=list)
    tags: set[str] = field(default_factory=set)
    """Trains with one of these have limits of their own."""
    switches: int = 0
    buffer_stops: int = 0
    routes: int = 0
    left_out: list[tuple[str, str]] = field(default_factory=list)
    """What no scenario has, and what that means."""
    assumed: list[tuple[str, str, str]] = field(default_factory=list)


def read_infrastructure(source: KeyPlace) -> RailjsonTracks:
    """
    Read an infrastructure.

    Parameters
    ----------
    source
        All of the file.

    Returns
    -------
    RailjsonTracks
        What it holds.

    Raises
    ------
    SourceError
        With everything that is wrong with it.
    """
    version = source.at("version")
    version.one_of(VERSIONS)
    source.refuse()  # of another version nothing else would be said rightly
    tracks = RailjsonTracks(version.text())
    for place in source.at("track_sections").items():
        _read_track(place, tracks)
    _read_switches(source, tracks)
    tracks.points = list(_points(source.at("operational_points").items(), tracks))
    for place in source.at("speed_sections").items():
        _read_speed_section(place, tracks)
    for key, into in (("signals", tracks.signals), ("detectors", tracks.detectors)):
        into += [_beside(place, tracks, key) for place in source.parts(key)]
    for place in source.parts("buffer_stops"):
        _spot(place, tracks)
    tracks.buffer_stops = len(source.parts("buffer_stops"))
    tracks.routes = len(source.parts("routes"))
    _tell_left_out(source, tracks)
    source.refuse()
    return tracks


def _read_track(place: KeyPlace, tracks: RailjsonTracks) -> None:
    name = place.at("id").text()
    if name in tracks.lengths_m:
        place.at("id").wrong(f"is {name!r}, as of another track section", "every one once")
    length_m = place.at("length").number(0.1, LONGEST_M)
    tracks.lengths_m[name] = length_m
    for slope in place.parts("slopes"):
        value = slope.at("gradient").number(-120.0, 120.0)
        if value:
            tracks.slopes.append(Stretch(name, *_range_m(slope, length_m), value))
    for curve in place.parts("curves"):
        radius_m = abs(curve.at("radius").number(-1e9, 1e9))
        if 0.0 < radius_m < 50.0:
            curve.at("radius").wrong(f"is {radius_m:g}", "50 m or more, or 0 for straight")
        if 0.0 < radius_m <= STRAIGHT_M:
            tracks.curves.append(Stretch(name, *_range_m(curve, length_m), radius_m))


def _range_m(place: KeyPlace, length_m: float) -> tuple[float, float]:
    begin_m = place.at("begin").number(0.0, LONGEST_M)
    end_m = place.at("end").number(0.0, LONGEST_M)
    if end_m <= begin_m:
        place.at("end").wrong(f"is {end_m:g}", f"beyond the beginning, {begin_m:g}")
    if end_m > length_m + 0.5:
        place.at("end").wrong(f"is {end_m:g}", f"up to the length of the track, {length_m:g}")
    return begin_m, min(end_m, length_m)


def _track(place: KeyPlace, tracks: RailjsonTracks) -> str:
    return place.at("track").one_of(tracks.lengths_m)


def _spot(place: KeyPlace, tracks: RailjsonTracks) -> Spot:
    track = _track(place, tracks)
    longest_m = tracks.lengths_m.get(track, LONGEST_M)
    return Spot(track, min(place.at("position").number(0.0, longest_m + 0.5), longest_m))


def _beside(place: KeyPlace, tracks: RailjsonTracks, key: str) -> Beside:
    direction = BOTH
    if key == "signals":
        direction = place.at("direction").one_of((START_TO_STOP, STOP_TO_START))
    return Beside(_spot(place, tracks), direction)


def _read_switches(source: KeyPlace, tracks: RailjsonTracks) -> None:
    types = dict(SWITCH_TYPES)
    for place in source.parts("extended_switch_types"):
        ports = tuple(port.text() for port in place.at("ports").items())
        ways = tuple(
            (way.at("src").one_of(ports), way.at("dst").one_of(ports))
            for _, group in place.at("groups").pairs()
            for way in group.items()
        )
        types[place.at("id").text()] = ports, ways
    used: dict[TrackEnd, str] = {}
    for place in source.at("switches").items():
        kind = place.at("switch_type").one_of(types)
        if not kind:
            continue
        tracks.switches += 1
        names, ways = types[kind]
        ends = {name: _end(place.at("ports").at(name), tracks) for name in names}
        for name, end in ends.items():
            if end in used:
                problem = f"is the {end.endpoint} of {end.track!r}, as of {used[end]}"
                place.at("ports").at(name).wrong(problem, "every end at one switch")
            used[end] = place.where
        for one, other in ways:
            if one in ends and other in ends:
                tracks.joined.setdefault(ends[one], []).append(ends[other])
                tracks.joined.setdefault(ends[other], []).append(ends[one])


def _end(place: KeyPlace, tracks: RailjsonTracks) -> TrackEnd:
    return TrackEnd(_track(place, tracks), place.at("endpoint").one_of((BEGIN, END)))


def _points(places: Iterable[KeyPlace], tracks: RailjsonTracks) -> Iterator[Stopping]:
    seen = set()
    for place in places:
        name = place.at("id").text()
        if name in seen:
            place.at("id").wrong(f"is {name!r}, as of another point", "every one once")
        seen.add(name)
        spots = tuple(_spot(part, tracks) for part in place.at("parts").items())
        codes, title = {name}, name
        for key, inner in (("identifier", "name"), ("identifier", "uic"), ("sncf", "trigram")):
            told = _extension(place, key, inner)
            if isinstance(told, str | int) and not isinstance(told, bool) and told:
                codes.add(str(told)[:200])
                title = str(told) if inner == "name" else title
        yield Stopping(name, safe_text(title, name), spots, frozenset(codes))


def _extension(place: KeyPlace, key: str, inner: str) -> object:
    told = place.value.get("extensions") if isinstance(place.value, dict) else None
    table = told.get(key) if isinstance(told, dict) else None
    return table.get(inner) if isinstance(table, dict) else None


def _read_speed_section(place: KeyPlace, tracks: RailjsonTracks) -> None:
    if place.has("speed_limit_by_tag"):
        tracks.tags |= {tag for tag, _ in place.at("speed_limit_by_tag").pairs()}
    if not place.has("speed_limit"):
        return
    limit_kmh = round(3.6 * place.at("speed_limit").number(3.0 / 3.6, 1e4), 3)
    if place.has("on_routes") and place.at("on_routes").items():
        value = "hold for all trains of the way"
        tracks.assumed.append(("limits of some routes", value, "routes are not read"))
    for part in place.at("track_ranges").items():
        track = _track(part, tracks)
        ends_m = _range_m(part, tracks.lengths_m.get(track, LONGEST_M))
        directions = part.at("applicable_directions").one_of((BOTH, START_TO_STOP, STOP_TO_START))
        if limit_kmh <= MOST_KMH:
            tracks.limits.append(Stretch(track, *ends_m, limit_kmh, directions))


def _tell_left_out(source: KeyPlace, tracks: RailjsonTracks) -> None:
    if tracks.tags:
        what = f"limits of trains with the tags {', '.join(sorted(tracks.tags))}"
        tracks.left_out.append((what, "the limit of the other trains holds for all"))
    for key, what, effect in (
        ("electrifications", "electrifications", "trains have their power everywhere"),
        ("neutral_sections", "neutral sections", "trains have their power there, too"),
    ):
        if source.parts(key):
            tracks.left_out.append((f"{len(source.parts(key))} {what}", effect))
    gauges = [
        place
        for place in source.at("track_sections").items()
        if place.parts("loading_gauge_limits")
    ]
    if gauges:
        what = f"loading gauges of {len(gauges)} track sections"
        tracks.left_out.append((what, "every train fits everywhere"))
