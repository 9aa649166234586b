"""MATSim railsim: network, schedule and vehicles to a line in one direction."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from kankaku.scenarios.drafts.draft import Draft
from kankaku.scenarios.drafts.equipment import longest_block_m
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.sketch import DraftTrip, Stop, TripCall
from kankaku.scenarios.importing.formats import SourceError, Wish
from kankaku.scenarios.importing.one_way import (
    DWELL_S,
    LEAST_APART_M,
    OneWay,
    drafted,
    even_edges_km,
)
from kankaku.scenarios.importing.one_way_trips import kept_apart
from kankaku.scenarios.importing.railsim_files import (
    RailsimLink,
    RailsimRoute,
    RailsimSource,
    read_railsim,
)
from kankaku.scenarios.importing.source_keys import SafeIds, safe_text
from kankaku.scenarios.reading.mistakes import Mistake, meant
from kankaku.scenarios.reading.row_formats import LimitRow

HEADWAY_S = 180.0
"""Between trains that a source lets depart at once. [s]"""
MOST_KMH = 400.0
MASS_T_PER_M = 2.0
"""Of a train whose mass no file tells: only energy depends on it. [t/m]"""


def read(source: Path, wish: Wish) -> Draft:
    """
    Read a scenario of railsim.

    Parameters
    ----------
    source
        Folder with network, schedule and vehicles.
    wish
        Route, and headway where trains depart at once.

    Returns
    -------
    Draft
        A chain along the links of the route, with all trains that run along them.

    Raises
    ------
    SourceError
        With everything that is wrong with the files.
    """
    told = read_railsim(source)
    route = _chosen(told, wish.route, source)
    notes = SourceNotes(f"MATSim railsim scenario in the folder {source.name}.")
    links = [told.links[name] for name in route.links if not told.links[name].turns]
    if not links:
        allowed = "a route with links from one node to another"
        raise SourceError((str(Mistake(source.name, f"route {route.id}", "has none", allowed)),))
    begins_km, start_km = {}, 0.0
    for link in links:
        begins_km[link.id] = start_km
        start_km = _km(start_km + link.length_m / 1000.0)
    stops = _stops(told, route, begins_km, start_km)
    ids = SafeIds()
    riding = [other for other in told.routes if _rides(told, other, stops, links)]
    if not riding:
        problem = "no train calls at the first stop along it and then at more of them in order"
        allowed = "two stops or more, the first of them at its beginning"
        raise SourceError((str(Mistake(source.name, f"route {route.id}", problem, allowed)),))
    kinds = sorted({told.vehicles[d.vehicle] for other in riding for d in other.departures})
    names = {kind: ids.of(kind) for kind in kinds}
    types = {name: _train_type(told, kind) for kind, name in names.items()}
    way = OneWay(
        title=safe_text(f"{source.name}, {route.id}", source.name),
        notes=notes,
        stops=tuple(stops.values()),
        train_types=types,
        extent_km=(0.0, start_km),
        limits=_limits(links, begins_km, names),
        block_edges_km=tuple(_edges_km(links, begins_km, longest_block_m(types))),
    )
    headway_s = HEADWAY_S if wish.headway_s is None else wish.headway_s
    trips = _trips(told, riding, stops, headway_s, (way, names))
    _note(told, way, links, riding, route)
    return drafted(way, kept_apart(way, trips))


def _chosen(told: RailsimSource, wanted: str, source: Path) -> RailsimRoute:
    names = [route.id for route in told.routes] + [route.line for route in told.routes]
    mine = [route for route in told.routes if wanted in {"", route.id, route.line}]
    if not mine:
        problem = f"unknown route {wanted!r}" if wanted else "no route with a departure"
        allowed = meant(wanted, dict.fromkeys(names))
        raise SourceError((str(Mistake(source.name, "--route", problem, allowed)),))
    alike = Counter(route.links for route in told.routes)
    # The links that most routes take; of their routes the one with most stops.
    return max(mine, key=lambda route: (alike[route.links], len(route.stops)))


def _stops(
    told: RailsimSource,
    route: RailsimRoute,
    begins_km: Mapping[str, float],
    end_km: float,
) -> dict[str, Stop]:
    """Return stops by facility, at the end of their links; turning links lie at either end."""
    at_km: dict[str, float] = {}
    for name, facility in told.facilities.items():
        link = told.links[facility.link]
        if link.id in begins_km:
            at_km[name] = _km(begins_km[link.id] + link.length_m / 1000.0)
        elif link.turns and link.id == route.links[0]:
            at_km[name] = 0.0
        elif link.turns and link.id == route.links[-1]:
            at_km[name] = end_km
    found: dict[str, Stop] = {}
    ids = SafeIds()
    last_km = -1e9
    for name in sorted(at_km, key=lambda name: at_km[name]):
        if at_km[name] - last_km >= LEAST_APART_M / 1000.0:
            title = safe_text(told.facilities[name].name, name)
            found[name] = Stop(ids.of(name), title, at_km[name])
            last_km = at_km[name]
    return found


def _rides(
    told: RailsimSource,
    route: RailsimRoute,
    stops: Mapping[str, Stop],
    links: Sequence[RailsimLink],
) -> bool:
    """Return whether a route has the links of the way, its first stop, and only its stops."""
    mine = tuple(name for name in route.links if not told.links[name].turns)
    calls = [stop.facility for stop in route.stops]
    known = all(name in stops for name in calls)
    way = tuple(link.id for link in links)
    if mine != way or not known or len(calls) < 2 or calls[0] != next(iter(stops), ""):
        return False
    along = [stops[name].chainage_km for name in calls]
    return along == sorted(set(along))


def _train_type(told: RailsimSource, kind: str) -> dict[str, Any]:
    """Return a train that speeds up and brakes at constant rates, as in the source."""
    train = told.types[kind]
    mass_t = MASS_T_PER_M * train.length_m
    force_kn = round(mass_t * train.acceleration_mps2, 6)
    top_kmh = round(3.6 * train.speed_mps, 6)
    return {
        "length_m": train.length_m,
        "mass_t": mass_t,
        "rotating_mass_percent": 0.0,
        "maximum_speed_kmh": top_kmh,
        "service_brake_kmhps": round(3.6 * train.deceleration_mps2, 6),
        "traction": {"force_speed": [[0.0, force_kn], [top_kmh, force_kn]]},
        "resistance": {"a_n": 0.0},
    }


def _limits(
    links: Sequence[RailsimLink], begins_km: Mapping[str, float], names: Mapping[str, str]
) -> list[LimitRow]:
    rows: list[LimitRow] = []
    for kind, name in {"": "", **names}.items():
        for link in links:
            speed_mps = link.speed_of_mps.get(kind) if kind else link.speed_mps
            if speed_mps is None or 3.6 * speed_mps > MOST_KMH:
                continue
            limit_kmh, low_km = round(3.6 * speed_mps, 3), begins_km[link.id]
            high_km = _km(low_km + link.length_m / 1000.0)
            last = rows[-1] if rows else None
            if (
                last
                and last.end_km == low_km
                and (last.limit_kmh, last.train_type)
                == (
                    limit_kmh,
                    name,
                )
            ):
                rows.pop()
                low_km = last.start_km
            rows.append(LimitRow(0, low_km, high_km, limit_kmh, "", name))
    return rows


def _edges_km(
    links: Sequence[RailsimLink], begins_km: Mapping[str, float], longest_m: float
) -> list[float]:
    """Return where blocks begin: at every resource, and within those that hold several trains."""
    found: list[float] = []
    for number, link in enumerate(links):
        low_km = begins_km[link.id]
        high_km = _km(low_km + link.length_m / 1000.0)
        if number == 0 or links[number - 1].resource != link.resource:
            found.append(low_km)
        if link.capacity > 1 or link.moving:
            found += even_edges_km(low_km, high_km, longest_m)
    return sorted(set(found))


def _trips(
    told: RailsimSource,
    riding: Sequence[RailsimRoute],
    stops: Mapping[str, Stop],
    headway_s: float,
    way_and_types: tuple[OneWay, Mapping[str, str]],
) -> list[DraftTrip]:
    way, names = way_and_types
    ids, made, last_s, moved = SafeIds(), [], -1e9, []
    booked = [(item.time_s, route, item) for route in riding for item in route.departures]
    earliest_s = min(time_s for time_s, *_ in booked)
    uses = Counter(item.id for *_, item in booked)
    at_once = {time_s for time_s, count in Counter(at for at, *_ in booked).items() if count > 1}
    # Who is booked at midnight stands ready before it; days begin with hour 0 in files.
    shift_s = 3600 if earliest_s < 3600 else 0
    for time_s, route, item in sorted(booked, key=lambda item: item[0]):
        leaves_s = time_s + shift_s
        # Of two routes each may have a departure of that name.
        name = item.id if uses[item.id] == 1 else f"{route.line}-{route.id}-{item.id}"
        if leaves_s < last_s + headway_s and time_s in at_once:
            leaves_s = round(last_s + headway_s)
            moved.append(name)
        last_s = float(leaves_s)
        calls = []
        for number, stop in enumerate(route.stops):
            arrival_s = leaves_s + stop.arrival_s
            departure_s = max(leaves_s + stop.departure_s, arrival_s + stop.least_stay_s)
            if number == 0:
                arrival_s = departure_s - DWELL_S
            elif number == len(route.stops) - 1:
                departure_s = max(departure_s, arrival_s + DWELL_S)
            calls.append(TripCall(stops[stop.facility].id, arrival_s, departure_s))
        kind = names[told.vehicles[item.vehicle]]
        made.append(DraftTrip(ids.of(name), kind, tuple(calls)))
    notes = way.notes
    if shift_s:
        notes.assume("all times", "an hour later", "trains stand ready before they depart")
    if moved:
        value = f"{', '.join(moved)}: {headway_s:g} s after the one before"
        notes.assume("departures", value, "the source lets trains depart at once from one place")
    stay = f"{DWELL_S} s, or longer where it is booked"
    notes.assume("stay at the first and last station", stay, "the source lets trains appear there")
    return made


def _note(
    told: RailsimSource,
    way: OneWay,
    links: Sequence[RailsimLink],
    riding: Sequence[RailsimRoute],
    route: RailsimRoute,
) -> None:
    notes = way.notes
    notes.take(f"{len(links)} links of route {route.id!r}: lengths and speeds", "network")
    notes.take("blocks, from resource to resource", "network, railsimResourceId")
    names = ", ".join(other.id for other in riding)
    notes.take(f"{len(riding)} routes with stops and departures: {names}", "schedule")
    notes.take("lengths, greatest speeds, accelerations and brakes of trains", "vehicles")
    mass = f"{MASS_T_PER_M:g} t for every metre, no running resistance"
    notes.assume("masses", mass, "the source has accelerations only; energy is no result here")
    if any(link.capacity > 1 or link.moving for link in links):
        value = "blocks of equal length"
        notes.assume("links that hold several trains", value, "fixed blocks hold one train each")
    others = [other.id for other in told.routes if other not in riding]
    if others:
        notes.miss(f"routes on other links: {', '.join(others)}", "their trains do not run")
    beside = len(told.links) - len(links) - sum(link.turns for link in told.links.values())
    if beside:
        notes.miss(f"{beside} links beside the way", "no train overtakes or turns aside there")
    times_s = sorted({link.least_s for link in links if link.least_s})
    if times_s:
        told_s = ", ".join(f"{value:g}" for value in times_s)
        what = f"least times that resources stay taken ({told_s} s)"
        notes.miss(what, "blocks are free as soon as trains have left them")


def _km(value: float) -> float:
    return round(value, 6)
