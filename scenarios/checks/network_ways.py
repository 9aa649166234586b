"""The ways of trains through a network, as the files tell them."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from kankaku.railway.plan.line import Direction, Line
from kankaku.railway.plan.routing import joined, onward, straightest
from kankaku.scenarios.checks.line_tables import LineTables
from kankaku.scenarios.reading.row_formats import CallRow, ServiceRow


class WayFound(NamedTuple):
    """The way of a train, or why there is none."""

    direction: Direction
    tracks: tuple[str, ...] = ()
    problem: str = ""
    call: CallRow | None = None
    """The call that it is about."""


def direction_of(tables: LineTables, calls: Sequence[CallRow]) -> Direction:
    """
    Return where a train runs to.

    Parameters
    ----------
    tables
        The files of the line.
    calls
        Its calls.

    Returns
    -------
    Direction
        By the stations of its first and last call; by the track where it has one call only; rising
        where it has none.
    """
    if not calls:
        return Direction.RISING
    at_km = {station.id: station.chainage_km for station in tables.stations}
    run_km = at_km.get(calls[-1].station, 0.0) - at_km.get(calls[0].station, 0.0)
    if run_km:
        return Direction.RISING if run_km > 0.0 else Direction.FALLING
    links = {link.id: link.direction for link in tables.links}
    return Direction.FALLING if links.get(calls[0].track) == "falling" else Direction.RISING


def directed(line: Line, track: str, direction: Direction) -> str:
    """
    Return a track as trains of one direction use it.

    Parameters
    ----------
    line
        A network.
    track
        The track as files name it.
    direction
        Of the trains.

    Returns
    -------
    str
        Its identifier; empty if they do not use it.
    """
    return next(
        (one.id for one in line.network if one.physical == track and one.direction is direction),
        "",
    )


def route_in(
    line: Line, tables: LineTables, service: ServiceRow, calls: Sequence[CallRow]
) -> WayFound:
    """
    Return the way of a train.

    Parameters
    ----------
    line
        The network.
    tables
        The files that it was read from.
    service
        The train.
    calls
        Its calls, one or more, at tracks that exist.

    Returns
    -------
    WayFound
        The route that the service names; else the straightest way from call to call.
    """
    direction = direction_of(tables, calls)
    stops = [directed(line, call.track, direction) for call in calls]
    if "" in stops:
        call = calls[stops.index("")]
        problem = f"{direction.name.lower()} trains do not use track {call.track!r}"
        return WayFound(direction, (), problem, call)
    if service.route:
        return _named(line, tables, service, direction, (stops, calls))
    ways: list[tuple[str, ...]] = [(stops[0],)]
    for (before, after), call in zip(pairwise(stops), calls[1:], strict=True):
        way = straightest(line, before, after)
        if not way.tracks:
            problem = (
                f"no way leads from track {line.track_by_id[before].physical!r} to {call.track!r}"
            )
            return WayFound(direction, (), problem, call)
        if way.others:
            problem = f"{way.others + 1} ways to track {call.track!r} are equally straight"
            return WayFound(direction, (), problem, call)
        ways.append(way.tracks)
    return WayFound(direction, joined(ways))


def _named(
    line: Line,
    tables: LineTables,
    service: ServiceRow,
    direction: Direction,
    stopping: tuple[Sequence[str], Sequence[CallRow]],
) -> WayFound:
    stops, calls = stopping
    named = [row.track for row in tables.routes if row.route == service.route]
    tracks = tuple(directed(line, track, direction) for track in named)
    behind = onward(line)
    if not named:
        return WayFound(direction, (), f"unknown route {service.route!r}", calls[0])
    for name, track in zip(named, tracks, strict=True):
        if not track:
            way = direction.name.lower()
            problem = f"route {service.route!r}: {way} trains do not use track {name!r}"
            return WayFound(direction, (), problem, calls[0])
    for number, (before, after) in enumerate(pairwise(tracks)):
        if after not in behind[before]:
            problem = f"no way from {named[number]!r} to {named[number + 1]!r}"
            return WayFound(direction, (), f"route {service.route!r}: {problem}", calls[0])
    for stop, call in zip(stops, calls, strict=True):
        if stop not in tracks:
            problem = f"route {service.route!r} does not pass track {call.track!r}"
            return WayFound(direction, (), problem, call)
    return WayFound(direction, tracks[tracks.index(stops[0]) : tracks.index(stops[-1]) + 1])
