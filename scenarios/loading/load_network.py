"""The files of a network to tracks, points and platforms in SI units, by running direction."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from kankaku.railway.plan.line import BACK, Block, Direction, Platform, Track, Turnout
from kankaku.scenarios.checks.line_tables import LineTables
from kankaku.scenarios.reading import row_formats
from kankaku.scenarios.reading.files import Reader, Table
from kankaku.scenarios.reading.units import metres

NODES_FILE = "nodes.csv"
"""A folder that has it holds a network."""


class NetworkTables(NamedTuple):
    """The files that only networks have, and the tracks as a chain's file would tell them."""

    nodes: Table[row_formats.NodeRow]
    links: Table[row_formats.LinkRow]
    routes: Table[row_formats.RouteRow]
    tracks: Table[row_formats.TrackRow] | None
    """None for a chain."""


def read_network(reader: Reader, folder: Path) -> NetworkTables:
    """
    Read the files that make a line a network, if they are there.

    Parameters
    ----------
    reader
        Collects mistakes.
    folder
        Folder of the line.

    Returns
    -------
    NetworkTables
        What they hold.
    """
    nodes = reader.csv(folder / NODES_FILE, "line", row_formats.NodeRow, optional=True)
    if not nodes.present:
        absent = Table[row_formats.LinkRow]("tracks.csv", present=False)
        return NetworkTables(nodes, absent, Table("routes.csv", present=False), None)
    links = reader.csv(folder / "tracks.csv", "line", row_formats.LinkRow)
    routes = reader.csv(folder / "routes.csv", "line", row_formats.RouteRow, optional=True)
    at_km = {node.id: node.km for node in nodes}
    tracks = tuple(
        row_formats.TrackRow(row.row, at_km[row.from_node], at_km[row.to_node], row.id, row.id)
        for row in links
        if row.from_node in at_km and row.to_node in at_km
    )
    complete = nodes.complete and links.complete and len(tracks) == len(links.rows)
    return NetworkTables(nodes, links, routes, Table(links.file, tracks, complete=complete))


def extent_of(tables: LineTables) -> tuple[float, float]:
    """
    Return the lowest and the highest chainage of a network.

    Parameters
    ----------
    tables
        Files without mistakes.

    Returns
    -------
    tuple[float, float]
        Of its nodes. [m]
    """
    places_m = [metres(node.km) for node in tables.nodes]
    return min(places_m), max(places_m)


def _mirrored_m(tables: LineTables, place_m: float) -> float:
    return sum(extent_of(tables)) - place_m


def to_network(tables: LineTables) -> tuple[Track, ...]:
    """
    Convert the tracks of a network to SI units, one for each direction that trains run in.

    Parameters
    ----------
    tables
        Files without mistakes.

    Returns
    -------
    tuple[Track, ...]
        The tracks; none for a chain.
    """
    at_km = {node.id: node.km for node in tables.nodes}
    found = []
    for row in tables.links:
        ends_m = metres(at_km[row.from_node]), metres(at_km[row.to_node])
        rising = Track(
            row.id,
            *ends_m,
            Direction.RISING,
            row.resource or row.id,
            row.across,
            row.from_node,
            row.to_node,
        )
        if row.direction != "falling":
            found.append(rising)
        if row.direction != "rising":
            found.append(
                replace(
                    rising,
                    id=row.id if row.direction == "falling" else row.id + BACK,
                    start_m=_mirrored_m(tables, ends_m[1]),
                    end_m=_mirrored_m(tables, ends_m[0]),
                    direction=Direction.FALLING,
                    from_node=row.to_node,
                    to_node=row.from_node,
                )
            )
    return tuple(found)


def to_points(tables: LineTables) -> tuple[Turnout, ...]:
    """
    Convert the points of a network to SI units, as rising trains meet them.

    Parameters
    ----------
    tables
        Files without mistakes.

    Returns
    -------
    tuple[Turnout, ...]
        In the order of the file.
    """
    return tuple(
        Turnout(
            row.id,
            metres(row.km),
            metres(row.fouling_start_km),
            metres(row.fouling_end_km),
            row.throw_s,
            row.proof_s,
            row.id,
        )
        for row in tables.nodes
        if row.kind == "points"
    )


def _directions(tables: LineTables) -> dict[str, str]:
    return {row.id: row.direction for row in tables.links}


def to_platforms(tables: LineTables) -> tuple[Platform, ...]:
    """
    Convert platforms to SI units.

    Parameters
    ----------
    tables
        Files without mistakes.

    Returns
    -------
    tuple[Platform, ...]
        In a network one for each direction of its track.
    """
    directions, found = _directions(tables), []
    for row in tables.platforms:
        start_m, end_m, stop_m = metres(row.start_km), metres(row.end_km), metres(row.stop_km)
        way = directions.get(row.track, "rising")
        if way != "falling":
            found.append(Platform(row.station, row.track, start_m, end_m, stop_m))
        if way != "rising":
            if way == "both":
                # Trains stop as far from the end that they run to, whichever way they come.
                stop_m = start_m + end_m - stop_m
            places_m = (_mirrored_m(tables, place_m) for place_m in (end_m, start_m, stop_m))
            track = row.track if way == "falling" else row.track + BACK
            found.append(Platform(row.station, track, *places_m))
    return tuple(found)


def met_both_ways(tables: LineTables, pieces: Iterable[Block]) -> tuple[Block, ...]:
    """
    Return blocks or circuits as trains of each direction meet them.

    Parameters
    ----------
    tables
        Files without mistakes.
    pieces
        By chainage, rising.

    Returns
    -------
    tuple[Block, ...]
        Of a track that is used both ways each of them twice, with the same identifier; rising.
    """
    directions, rising, falling = _directions(tables), [], []
    for piece in pieces:
        way = directions.get(piece.track, "rising")
        if way != "falling":
            rising.append(piece)
        if way != "rising":
            ends_m = _mirrored_m(tables, piece.end_m), _mirrored_m(tables, piece.start_m)
            track = piece.track if way == "falling" else piece.track + BACK
            falling.append(Block(piece.id, track, *ends_m))
    return (*rising, *sorted(falling, key=lambda piece: piece.start_m))
