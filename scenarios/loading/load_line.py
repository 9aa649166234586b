"""The line's files to a line in SI units."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from kankaku.railway.plan.line import (
    Block,
    Gradient,
    Line,
    Section,
    SpeedLimit,
    Station,
    Track,
    TrackCurve,
)
from kankaku.scenarios.checks.line_tables import LineTables
from kankaku.scenarios.loading.load_network import (
    extent_of,
    met_both_ways,
    read_network,
    to_network,
    to_platforms,
    to_points,
)
from kankaku.scenarios.loading.load_wayside import to_crossings, to_turnouts
from kankaku.scenarios.reading import row_formats
from kankaku.scenarios.reading.files import Reader
from kankaku.scenarios.reading.units import metres


def read_line(reader: Reader, folder: Path) -> LineTables:
    """
    Read the files of a line.

    Parameters
    ----------
    reader
        Collects mistakes.
    folder
        Their folder.

    Returns
    -------
    LineTables
        What they hold.
    """
    network = read_network(reader, folder)
    tracks = network.tracks
    if tracks is None:
        tracks = reader.csv(folder / "tracks.csv", "line", row_formats.TrackRow)
    return LineTables(
        nodes=network.nodes,
        links=network.links,
        routes=network.routes,
        stations=reader.csv(folder / "stations.csv", "line", row_formats.StationRow),
        tracks=tracks,
        platforms=reader.csv(folder / "platforms.csv", "line", row_formats.PlatformRow),
        turnouts=reader.csv(folder / "turnouts.csv", "line", row_formats.TurnoutRow, optional=True),
        crossings=reader.csv(
            folder / "crossings.csv", "line", row_formats.CrossingRow, optional=True
        ),
        limits=reader.csv(folder / "limits.csv", "line", row_formats.LimitRow, optional=True),
        driven_speeds=reader.csv(
            folder / "driven_speeds.csv", "line", row_formats.DrivenSpeedRow, optional=True
        ),
        gradients=reader.csv(
            folder / "gradients.csv", "line", row_formats.GradientRow, optional=True
        ),
        curves=reader.csv(folder / "curves.csv", "line", row_formats.CurveRow, optional=True),
        balises=reader.csv(folder / "balises.csv", "line", row_formats.BaliseRow, optional=True),
        blocks=reader.csv(folder / "blocks.csv", "line", row_formats.BlockRow, optional=True),
        circuits=reader.csv(folder / "circuits.csv", "line", row_formats.CircuitRow, optional=True),
        geometry=reader.csv(
            folder / "geometry.csv", "line", row_formats.GeometryRow, optional=True
        ),
    )


def to_line(tables: LineTables, name: str) -> Line:
    """
    Convert a line to SI units.

    Parameters
    ----------
    tables
        Files without mistakes.
    name
        Name of the line.

    Returns
    -------
    Line
        The line.
    """
    network = to_network(tables)
    return Line(
        name=name,
        stations=tuple(
            Station(
                row.id, row.name, row.name_local, metres(row.chainage_km), row.lon_deg, row.lat_deg
            )
            for row in tables.stations
        ),
        sections=() if network else tuple(map(_to_section, tables.sections)),
        network=network,
        extent_m=extent_of(tables) if network else (0.0, 0.0),
        platforms=to_platforms(tables),
        turnouts=to_points(tables) if network else to_turnouts(tables),
        limits=tuple(
            SpeedLimit(
                metres(row.start_km),
                metres(row.end_km),
                row.limit_kmh / 3.6,
                row.track,
                row.train_type,
            )
            for row in sorted(tables.limits, key=lambda row: row.start_km)
        ),
        driven_speeds=tuple(
            SpeedLimit(metres(row.start_km), metres(row.end_km), row.speed_kmh / 3.6, row.track)
            for row in sorted(tables.driven_speeds, key=lambda row: row.start_km)
        ),
        gradients=tuple(
            Gradient(
                metres(row.start_km), metres(row.end_km), row.gradient_permil / 1000.0, row.track
            )
            for row in sorted(tables.gradients, key=lambda row: row.start_km)
        ),
        curves=tuple(
            TrackCurve(metres(row.start_km), metres(row.end_km), row.radius_m, row.track)
            for row in sorted(tables.curves, key=lambda row: row.start_km)
        ),
        balises_m=tuple(metres(row.chainage_km) for row in tables.balises),
        blocks=met_both_ways(tables, _to_blocks(tables.blocks)),
        circuits=met_both_ways(tables, _to_blocks(tables.circuits)),
        geometry_lon_lat_deg=tuple(
            (metres(row.chainage_km), row.lon_deg, row.lat_deg) for row in tables.geometry
        ),
        crossings=to_crossings(tables),
    )


def _to_blocks(rows: Iterable[row_formats.BlockRow]) -> tuple[Block, ...]:
    return tuple(
        Block(row.id, row.track, metres(row.start_km), metres(row.end_km))
        for row in sorted(rows, key=lambda row: (row.start_km, row.row))
    )


def _to_section(rows: Sequence[row_formats.TrackRow]) -> Section:
    tracks = tuple(Track(row.id, metres(row.start_km), metres(row.end_km)) for row in rows)
    return Section(tracks[0].start_m, tracks[0].end_m, tracks)
