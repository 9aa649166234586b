"""Which platforms of a GTFS feed are one station."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from itertools import combinations
from typing import NamedTuple

from kankaku.railway.plan.earth import distance_m
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.unused_names import unused
from kankaku.scenarios.importing.gtfs_tables import FeedStop
from kankaku.scenarios.importing.gtfs_trips import DayTrip

NEAR_M = 150.0
"""Platforms so near to each other that no train serves both are one station. [m]"""
NAMED_NEAR_M = 500.0
"""The same, if their names are alike. [m]"""
ALIKE = 0.75
"""Share of letters from which on two names are alike. [-]"""
LONGEST_ID = 24
"""Characters of a station's identifier; names of tracks are made of two of them. [-]"""


class FeedStation(NamedTuple):
    """One station of a line, of one or more platforms."""

    id: str
    name: str
    lat_deg: float | None
    lon_deg: float | None


@dataclass
class _Group:
    stops: list[FeedStop]
    trips: set[str]
    parent: str = ""


def stations_of(
    stops: Mapping[str, FeedStop], trips: Sequence[DayTrip], notes: SourceNotes
) -> tuple[dict[str, FeedStation], dict[str, str]]:
    """
    Return the stations of trips.

    Parameters
    ----------
    stops
        By identifier: all that trips call at, and their parents.
    trips
        The trains.
    notes
        Are told which platforms were taken for one station.

    Returns
    -------
    tuple[dict[str, FeedStation], dict[str, str]]
        Stations by identifier, and the station of every stop.
    """
    groups: dict[str, _Group] = {}
    for trip in trips:
        for call in trip.calls:
            stop = stops[call.stop]
            parent = stop.parent if stop.parent in stops else ""
            group = groups.setdefault(parent or stop.id, _Group([], set(), parent))
            group.trips.add(trip.trip)
            if stop not in group.stops:
                group.stops.append(stop)
    if any(len(group.stops) > 1 for group in groups.values()):
        notes.take("which platforms are one station", "stops.txt: parent_station")
    merged = _merged(list(groups.values()), notes)
    names = _identifiers([group.parent or group.stops[0].id for group in merged])
    stations: dict[str, FeedStation] = {}
    station_of: dict[str, str] = {}
    for group, name in zip(merged, names, strict=True):
        heads = [stops[group.parent]] if group.parent else group.stops
        placed = [stop for stop in (*heads, *group.stops) if stop.lat_deg is not None]
        placed = placed[:1] if group.parent else [stop for stop in placed if stop in group.stops]
        lat_deg = _mean(stop.lat_deg for stop in placed)
        lon_deg = _mean(stop.lon_deg for stop in placed)
        stations[name] = FeedStation(name, heads[0].name, lat_deg, lon_deg)
        station_of |= {stop.id: name for stop in group.stops}
    return stations, station_of


def _mean(degrees: Iterable[float | None]) -> float | None:
    known = list(dict.fromkeys(degree for degree in degrees if degree is not None))
    return round(sum(known) / len(known), 7) if known else None


def _merged(groups: list[_Group], notes: SourceNotes) -> list[_Group]:
    """Join groups of platforms that no train serves both of, likeliest ones first."""
    pairs = []
    for a, b in combinations(range(len(groups)), 2):
        if groups[a].trips & groups[b].trips or (groups[a].parent and groups[b].parent):
            continue
        apart_m = _apart_m(groups[a], groups[b])
        alike = _alike(groups[a].stops[0].name, groups[b].stops[0].name)
        # Without coordinates only the same name counts.
        if apart_m is None and alike < 1.0:
            continue
        if (apart_m or 0.0) <= (NAMED_NEAR_M if alike >= ALIKE else NEAR_M):
            pairs.append((-alike if alike >= ALIKE else 0.0, apart_m or 0.0, a, b))
    root = list(range(len(groups)))
    joined = []
    for _, _, a, b in sorted(pairs):
        one, other = sorted((root[a], root[b]))
        if one == other or groups[one].trips & groups[other].trips:
            continue
        groups[one].stops += groups[other].stops
        groups[one].trips |= groups[other].trips
        groups[one].parent = groups[one].parent or groups[other].parent
        joined.append(f"{groups[a].stops[0].id} and {groups[b].stops[0].id}")
        root = [one if place == other else place for place in root]
    if joined:
        why = (
            f"no train calls at both; up to {NEAR_M:g} m apart, "
            f"or {NAMED_NEAR_M:g} m with like names"
        )
        notes.assume("platforms of one station", ", ".join(joined), why)
    return [groups[place] for place in sorted(set(root))]


def _apart_m(one: _Group, other: _Group) -> float | None:
    found = [
        distance_m((a.lon_deg, a.lat_deg), (b.lon_deg, b.lat_deg))
        for a in one.stops
        for b in other.stops
        if a.lat_deg is not None
        and a.lon_deg is not None
        and b.lat_deg is not None
        and b.lon_deg is not None
    ]
    return min(found) if found else None


def _alike(one: str, other: str) -> float:
    a, b = one.casefold(), other.casefold()
    # Numbers tell places apart, however alike the rest is.
    if re.findall(r"\d+", a) != re.findall(r"\d+", b):
        return 0.0
    return 1.0 if a == b else SequenceMatcher(None, a, b, autojunk=False).ratio()


def _identifiers(names: Sequence[str]) -> list[str]:
    return list(identifiers(names, LONGEST_ID, odd=r"[^A-Za-z0-9_]").values())


def identifiers(
    names: Sequence[str], longest: int, odd: str = r"[^A-Za-z0-9_.\-]"
) -> dict[str, str]:
    """
    Return identifiers that a scenario may have.

    Parameters
    ----------
    names
        Of the feed, every one once.
    longest
        Characters of an identifier. [-]
    odd
        Characters that become ``_``.

    Returns
    -------
    dict[str, str]
        By name; all different, however letters are written.
    """
    taken: set[str] = set()
    found = {}
    for name in names:
        plain = re.sub(odd, "_", name)[:longest]
        plain = plain if plain.strip("_.-") else "x"
        found[name] = unused(plain, taken, "_", longest, alike=str.casefold)
        taken.add(found[name].casefold())
    return found
