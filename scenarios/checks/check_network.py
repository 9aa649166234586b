"""Cross-checks of a network's files: nodes, tracks, and what lies on them."""

from collections import Counter

from kankaku.scenarios.checks.check_blocks import (
    block_mistakes,
    circuit_mistakes,
    point_mistakes,
)
from kankaku.scenarios.checks.check_line import platform_mistakes, station_mistakes
from kankaku.scenarios.checks.line_tables import (
    LineTables,
    duplicates,
    length_mistakes,
    tiling_mistakes,
)
from kankaku.scenarios.reading.files import Table
from kankaku.scenarios.reading.mistakes import Mistake, meant
from kankaku.scenarios.reading.row_formats import (
    CurveRow,
    DrivenSpeedRow,
    GradientRow,
    LimitRow,
    LinkRow,
    NodeRow,
    StretchRow,
)


def network_mistakes(line: LineTables) -> list[Mistake]:
    """
    Return everything that is wrong between the files of a network.

    Parameters
    ----------
    line
        The files.

    Returns
    -------
    list[Mistake]
        The mistakes.
    """
    mistakes = _node_mistakes(line) + _link_mistakes(line)
    mistakes += station_mistakes(line) + platform_mistakes(line)
    mistakes += block_mistakes(line) + circuit_mistakes(line) + point_mistakes(line)
    for stretches in (line.limits, line.driven_speeds, line.gradients, line.curves):
        mistakes += _stretch_mistakes(line, stretches)
    return mistakes + _foreign_mistakes(line)


def _foreign_mistakes(line: LineTables) -> list[Mistake]:
    """Return files that only a chain can have."""
    return [
        Mistake(table.file, "", f"a network has no {table.file}", allowed)
        for table, allowed in (
            (line.turnouts, "points as nodes of nodes.csv"),
            (line.crossings, "level crossings on a line without nodes.csv"),
        )
        if table.present
    ]


def _node_mistakes(line: LineTables) -> list[Mistake]:
    table = line.nodes
    mistakes = duplicates(table)
    ends = Counter(node for link in line.links for node in (link.from_node, link.to_node))
    for row in table:
        if not row.fouling_start_km <= row.km <= row.fouling_end_km:
            problem = f"{row.km:g} lies outside its fouling section"
            allowed = f"from {row.fouling_start_km:g} to {row.fouling_end_km:g}"
            mistakes.append(table.mistake(row, "km", problem, allowed))
        elif row.kind != "points" and row.fouling_end_km > row.fouling_start_km:
            problem = f"a {row.kind} has no fouling section"
            mistakes.append(table.mistake(row, "fouling_end_km", problem, f"{row.km:g}, or points"))
        if line.links.complete and ends[row.id] == 0:
            mistakes.append(table.mistake(row, "id", "no track begins or ends there", "a track"))
    return mistakes


def _link_mistakes(line: LineTables) -> list[Mistake]:
    table = line.links
    nodes = {node.id: node for node in line.nodes}
    mistakes = duplicates(table)
    for row in table:
        for column in ("from_node", "to_node"):
            name = getattr(row, column)
            if name not in nodes and line.nodes.complete:
                problem = f"unknown node {name!r}"
                mistakes.append(table.mistake(row, column, problem, meant(name, nodes)))
        if row.from_node in nodes and row.to_node in nodes:
            start_km, end_km = nodes[row.from_node].km, nodes[row.to_node].km
            if end_km <= start_km:
                problem = f"node {row.to_node!r} does not lie after {row.from_node!r}"
                mistakes.append(table.mistake(row, "to_node", problem, f"above km {start_km:g}"))
    return mistakes + _side_mistakes(line, nodes)


def _side_mistakes(line: LineTables, nodes: dict[str, NodeRow]) -> list[Mistake]:
    """Return tracks that meet a node on one side at the same place across."""
    seen: dict[tuple[str, str, float], LinkRow] = {}
    mistakes = []
    for row in line.links:
        for column, node in (("to_node", row.to_node), ("from_node", row.from_node)):
            key = column, node, row.across
            other = seen.setdefault(key, row)
            if other is not row and node in nodes:
                problem = f"track {other.id!r} of row {other.row} meets {node!r} at the same place"
                mistakes.append(line.links.mistake(row, "across", problem, "another place across"))
    return mistakes


def _stretch_mistakes(
    line: LineTables,
    table: Table[LimitRow] | Table[DrivenSpeedRow] | Table[GradientRow] | Table[CurveRow],
) -> list[Mistake]:
    stretches: Table[StretchRow] = table
    mistakes = length_mistakes(stretches)
    tracks = {link.resource or link.id for link in line.links}
    by_track: dict[tuple[str, str], list[StretchRow]] = {}
    for stretch in table:
        track = stretch.track
        if track and track not in tracks and line.links.complete:
            problem = f"unknown track {track!r}"
            mistakes.append(table.mistake(stretch, "track", problem, meant(track, tracks)))
        train_type = stretch.train_type if isinstance(stretch, LimitRow) else ""
        by_track.setdefault((track, train_type), []).append(stretch)
    everywhere = by_track.pop(("", ""), [])
    # Of limits the lowest counts; anything else is told once for every place.
    shared = [] if table in (line.limits, line.driven_speeds) else everywhere
    for group in (everywhere, *by_track.values()):
        rows = group if group is everywhere else group + shared
        mistakes += tiling_mistakes(stretches, rows, "the stretch", gaps=False)
    if line.extent_km:
        from_km, to_km = line.extent_km
        for row in stretches:
            if row.start_km < from_km or row.end_km > to_km:
                problem = f"{row.start_km:g} to {row.end_km:g} lies outside the line"
                where = "start_km" if row.start_km < from_km else "end_km"
                allowed = f"from {from_km:g} to {to_km:g}"
                mistakes.append(stretches.mistake(row, where, problem, allowed))
    return list(dict.fromkeys(mistakes))
