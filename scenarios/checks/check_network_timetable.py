"""Cross-checks of the timetable of a network."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from kankaku.railway.plan.line import Direction, Line, Turnout
from kankaku.railway.plan.passing import waiting_cycle
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.timetable import Timetable
from kankaku.railway.plan.turns import orders
from kankaku.scenarios.checks.check_timetable import (
    TimetableTables,
    calls_by_train,
    dwell_mistakes,
    dwell_row_mistakes,
    reference_mistakes,
    service_mistakes,
    time_mistakes,
)
from kankaku.scenarios.checks.line_tables import LineTables
from kankaku.scenarios.checks.network_ways import direction_of, route_in
from kankaku.scenarios.reading.mistakes import Mistake, meant
from kankaku.scenarios.reading.row_formats import CallRow, PlatformRow, ServiceRow
from kankaku.scenarios.reading.schema import RollingStockFile, TrainEntry

STUCK = "trains would wait for each other for ever"
"""How a timetable is told in which everybody waits for somebody."""


def network_timetable_mistakes(
    timetable: TimetableTables, line: LineTables, stock: RollingStockFile | None
) -> list[Mistake]:
    """
    Return everything that is wrong between timetable, network and fleet.

    Parameters
    ----------
    timetable
        The files of the timetable.
    line
        The files of the line.
    stock
        Train types; nothing if they have mistakes of their own.

    Returns
    -------
    list[Mistake]
        The mistakes.
    """
    mistakes = service_mistakes(timetable, stock) + dwell_row_mistakes(timetable, line, stock)
    mistakes += reference_mistakes(timetable, line)
    train_types = {service.train: service.train_type for service in timetable.services}
    for train, calls in calls_by_train(timetable).items():
        kind = stock.train.get(train_types[train]) if stock else None
        mistakes += time_mistakes(timetable, calls) + dwell_mistakes(timetable, calls)
        mistakes += _sequence_mistakes(timetable, line, calls)
        if kind:
            mistakes += _length_mistakes(timetable, line, calls, kind)
    return mistakes + _stock_mistakes(timetable, line)


def _sequence_mistakes(
    timetable: TimetableTables, line: LineTables, calls: Sequence[CallRow]
) -> list[Mistake]:
    """Return calls that do not lie in the running direction of their train."""
    table = timetable.calls
    at_km = {station.id: station.chainage_km for station in line.stations}
    mistakes = []
    for before, after in pairwise(calls):
        if before.station not in at_km or after.station not in at_km:
            continue
        run_km = at_km[after.station] - at_km[before.station]
        if run_km * direction_of(line, calls) <= 0.0:
            problem = f"{after.station!r} does not lie after {before.station!r} of row {before.row}"
            allowed = "calls in one running direction; a service for each, joined by next_train"
            mistakes.append(table.mistake(after, "station", problem, allowed))
    return mistakes


def _room_km(platform: PlatformRow, way: str, direction: Direction) -> float:
    """Return how long a train may be that stops at a platform. [km]"""
    if way == "both" or direction is Direction.RISING:
        return platform.stop_km - platform.start_km
    return platform.end_km - platform.stop_km


def _length_mistakes(
    timetable: TimetableTables, line: LineTables, calls: Sequence[CallRow], kind: TrainEntry
) -> list[Mistake]:
    ways = {link.id: link.direction for link in line.links}
    direction, mistakes = direction_of(line, calls), []
    for call in calls:
        platform = line.platform_at.get((call.station, call.track))
        # Trains that do not run this way there are told so, with their ways.
        if platform is None or ways.get(call.track) not in {"both", direction.name.lower()}:
            continue
        room_m = 1000.0 * _room_km(platform, ways[call.track], direction)
        if kind.length_m > room_m + 1e-3:
            problem = f"a train of {kind.length_m:g} m does not fit at {call.station!r}"
            allowed = f"up to {room_m:g} m from the start of the platform to the stop position"
            mistakes.append(timetable.calls.mistake(call, "track", problem, allowed))
    return mistakes


def _stock_mistakes(timetable: TimetableTables, line: LineTables) -> list[Mistake]:
    """Return what is wrong with trains that go on with the stock of others."""
    table, calls = timetable.services, calls_by_train(timetable)
    rows = {row.train: row for row in table}
    resource = {link.id: link.resource or link.id for link in line.links}
    taken: dict[str, ServiceRow] = {}
    mistakes = []
    for row in table:
        name = row.next_train
        if not name:
            continue
        if name not in rows or name == row.train:
            problem = f"unknown train {name!r}" if name not in rows else "goes on as itself"
            mistakes.append(table.mistake(row, "next_train", problem, meant(name, rows)))
            continue
        first = taken.setdefault(name, row)
        if first is not row:
            problem = f"{name!r} has the stock of {first.train!r} of row {first.row} already"
            mistakes.append(table.mistake(row, "next_train", problem, "every train once"))
        if rows[name].train_type != row.train_type:
            problem = f"{name!r} is of type {rows[name].train_type!r}"
            mistakes.append(table.mistake(row, "next_train", problem, f"a {row.train_type!r}"))
        if not (calls[row.train] and calls[name]):
            continue
        ends, begins = calls[row.train][-1], calls[name][0]
        if resource.get(begins.track) != resource.get(ends.track):
            problem = f"{name!r} begins on track {begins.track!r}, not where {row.train!r} ends"
            mistakes.append(timetable.calls.mistake(begins, "track", problem, ends.track))
        if begins.arrival != ends.departure:
            problem = f"{begins.arrival} is not when the stock of {row.train!r} is ready"
            where = timetable.calls.mistake(begins, "arrival", problem, ends.departure)
            mistakes.append(where)
    return mistakes


def way_mistakes(line: Line, tables: LineTables, timetable: TimetableTables) -> list[Mistake]:
    """
    Return trains that find no way through a network, or more than one.

    Parameters
    ----------
    line
        The network.
    tables
        The files that it was read from.
    timetable
        The files of the timetable.

    Returns
    -------
    list[Mistake]
        One by train.
    """
    calls = calls_by_train(timetable)
    mistakes = []
    for service in timetable.services:
        found = route_in(line, tables, service, calls[service.train])
        if found.problem and found.call is not None:
            problem = f"train {service.train!r}: {found.problem}"
            allowed = "tracks that lead there, or a route of routes.csv in services.csv"
            mistakes.append(timetable.calls.mistake(found.call, "track", problem, allowed))
    return mistakes


def standing_mistakes(
    line: Line,
    services: Timetable,
    train_types: Mapping[str, TrainType],
    timetable: TimetableTables,
) -> list[Mistake]:
    """
    Return trains that begin or end within points, where nobody keeps others away from them.

    Parameters
    ----------
    line
        The line.
    services
        The trains.
    train_types
        Train types by identifier.
    timetable
        The files of the timetable.

    Returns
    -------
    list[Mistake]
        At most two by train.
    """
    if not line.network:
        return []
    calls, mistakes = calls_by_train(timetable), []
    for service in services.services:
        begins, ends = service.calls[0], service.calls[-1]
        tail_m = begins.stop_m - train_types[service.train_type].length_m
        standing = (
            ("begins", begins.track, tail_m, begins.stop_m),
            ("ends", ends.track, np.inf, ends.stop_m),
        )
        for (verb, track, *place_m), row in zip(standing, (0, -1), strict=True):
            points = _fouled(line, track, *place_m)
            if points is not None:
                problem = f"train {service.train!r} {verb} in the fouling section of {points.id!r}"
                ends_km = points.fouling_start_m / 1000.0, points.fouling_end_m / 1000.0
                allowed = f"a place up to {ends_km[0]:g} or from {ends_km[1]:g}"
                call = calls[service.train][row]
                mistakes.append(timetable.calls.mistake(call, "track", problem, allowed))
    return mistakes


def _fouled(line: Line, track: str, tail_m: float, front_m: float) -> Turnout | None:
    """Return the points at an end of a track that a train stands in."""
    ends = line.track_by_id[track]
    for number, points in enumerate(line.turnouts):
        fouling_m = line.fouling_m(number, ends.direction)
        ahead = points.node == ends.to_node and front_m > fouling_m[0]
        behind = points.node == ends.from_node and tail_m < fouling_m[1]
        if ahead or behind:
            return points
    return None


def order_mistakes(
    line: Line,
    services: Timetable,
    train_types: Mapping[str, TrainType],
    timetable: TimetableTables,
) -> list[Mistake]:
    """
    Return trains that would wait for each other for ever.

    Parameters
    ----------
    line
        The line.
    services
        The trains.
    train_types
        Train types by identifier.
    timetable
        The files of the timetable.

    Returns
    -------
    list[Mistake]
        At most one, with the trains and the tracks.
    """
    if not line.network:
        return []
    length_m = {name: kind.length_m for name, kind in train_types.items()}
    found = services.services
    cycle = waiting_cycle(line, found, orders(line, found), length_m)
    if not cycle:
        return []
    track_of = line.track_by_id
    steps = dict.fromkeys(
        (found[row].train, track_of[found[row].route[number]].physical) for row, number in cycle
    )
    told = ", ".join(f"{train} at {track}" for train, track in list(steps)[:6])
    problem = f"{STUCK}: {told}"
    allowed = "booked times in whose order everybody can go on"
    return [Mistake(timetable.calls.file, "", problem, allowed)]
