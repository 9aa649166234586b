"""
A network and the ways of its trains as the plain XML that SUMO reads; pure functions.

A directed track is one edge, and a two-way track two edges between the same nodes, which netconvert
marks as one track: SUMO then sees trains on it collide whichever way they run.

Nodes have no internal links, which would change lengths. Therefore SUMO sees nothing of trains that
only cross each other at a node, as on a diamond, and nothing of a train that stands too near to
one: these are matters of the monitor of safety alone.
"""

from collections.abc import Mapping
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.line import Direction, Line, Track
from kankaku.railway.plan.routing import onward
from kankaku.sumo_net import names
from kankaku.sumo_net.edge_cuts import EDGE_SPEED_MPS
from kankaku.sumo_net.geometry import CentreLine, beside, centre_line
from kankaku.sumo_net.plain_xml import text_of

SPACING_M = 40.0
"""Drawn distance of tracks side by side: as wide as a window draws each of them. [m]"""
RAMP_M = 120.0
"""Drawn length over which tracks spread from the node they share. [m]"""


def plain_network(line: Line) -> dict[str, str]:
    """
    Return what netconvert reads.

    Parameters
    ----------
    line
        A network.

    Returns
    -------
    dict[str, str]
        Plain XML by kind: nodes, edges and connections.
    """
    # Heights are only drawn; those of single tracks would tear their nodes apart.
    drawn_line = replace(line, gradients=tuple(one for one in line.gradients if not one.track))
    drawn = centre_line(drawn_line)
    return {
        "node": _nodes_xml(drawn_line, drawn),
        "edge": _edges_xml(drawn_line, drawn),
        "connection": _connections_xml(line),
    }


def edge_of(track: str) -> str:
    """
    Return the edge of a directed track.

    Parameters
    ----------
    track
        Its identifier. That of a falling twin ends with a tilde, which no file can say and SUMO
        takes as it is.

    Returns
    -------
    str
        Identifier of the edge.
    """
    return names.edge(track, 0)


def twins(line: Line) -> Mapping[str, str]:
    """
    Return the two-way tracks.

    Parameters
    ----------
    line
        A network.

    Returns
    -------
    Mapping[str, str]
        The track of falling trains by that of rising ones. Tracks that meet a node have different
        places across the line, so there is one at most.
    """
    falling = {
        (track.to_node, track.from_node, track.across): track.id
        for track in line.network
        if track.direction is Direction.FALLING
    }
    return {
        track.id: falling[track.from_node, track.to_node, track.across]
        for track in line.network
        if track.direction is Direction.RISING
        and (track.from_node, track.to_node, track.across) in falling
    }


def _ends_m(line: Line, track: Track) -> tuple[float, float]:
    """Return the chainage of the start and of the end of a track, in its running direction."""
    if track.direction is Direction.RISING:
        return track.start_m, track.end_m
    return line.mirrored_m(track.start_m), line.mirrored_m(track.end_m)


def _offset_m(line: Line, across: float) -> float:
    places = [track.across for track in line.network]
    return SPACING_M * (0.5 * (min(places) + max(places)) - across)


def _nodes_m(line: Line) -> Mapping[str, tuple[float, float]]:
    """Return chainage, and the distance to the left of the centre line, of every node."""
    at_m: dict[str, float] = {}
    across: dict[str, list[float]] = {}
    for track in line.network:
        ends_m = _ends_m(line, track)
        for node, place_m in zip((track.from_node, track.to_node), ends_m, strict=True):
            at_m[node] = place_m
            across.setdefault(node, []).append(track.across)
    return {
        node: (place_m, _offset_m(line, float(np.mean(across[node]))))
        for node, place_m in at_m.items()
    }


def _nodes_xml(line: Line, drawn: CentreLine) -> str:
    root = ET.Element("nodes")
    for node, (place_m, offset_m) in _nodes_m(line).items():
        (point,) = beside(line, drawn, np.array([place_m]), offset_m).tolist()
        x, y, z = (f"{value:.3f}" for value in point)
        ET.SubElement(root, "node", id=names.network_node(node), x=x, y=y, z=z, type="priority")
    return text_of(root)


def _edges_xml(line: Line, drawn: CentreLine) -> str:
    nodes_m = _nodes_m(line)
    root = ET.Element("edges")
    for track in line.network:
        points = _points(line, drawn, track, nodes_m)
        attributes = {
            "id": edge_of(track.id),
            "from": names.network_node(track.from_node),
            "to": names.network_node(track.to_node),
            "numLanes": "1",
            "speed": f"{EDGE_SPEED_MPS:.3f}",
            "length": f"{track.end_m - track.start_m:.3f}",
            "allow": "rail",
            "spreadType": "center",
            "shape": " ".join(",".join(f"{value:.3f}" for value in row) for row in points),
        }
        ET.SubElement(root, "edge", attributes)
    return text_of(root)


def _points(
    line: Line, drawn: CentreLine, track: Track, nodes_m: Mapping[str, tuple[float, float]]
) -> FloatArray:
    """
    Return where a track is drawn, in running direction.

    Tracks spread from their nodes at different angles. By these netconvert knows which two edges
    are one track; parallel ones it would pair at random.
    """
    ends = (track.from_node, track.to_node)[:: track.direction]
    (first_m, first_offset_m), (last_m, last_offset_m) = (nodes_m[node] for node in ends)
    ramp_m = min(RAMP_M, 0.25 * (last_m - first_m))
    ramps_m = [first_m, first_m + ramp_m, last_m - ramp_m, last_m]
    knots_m = [end_m for one in line.gradients for end_m in (one.start_m, one.end_m)]
    inner_m = np.concatenate([drawn.chainage_m, knots_m, ramps_m[1:3]])
    inside = (inner_m > first_m + 1.0) & (inner_m < last_m - 1.0)
    where_m = np.unique(np.concatenate([[first_m, last_m], inner_m[inside]]))
    own_m = _offset_m(line, track.across)
    offset_m = np.interp(where_m, ramps_m, [first_offset_m, own_m, own_m, last_offset_m])
    return beside(line, drawn, where_m, offset_m)[:: track.direction]


def _connections_xml(line: Line) -> str:
    root = ET.Element("connections")
    for track, behind in onward(line).items():
        if not behind:
            # Without it, netconvert would guess some.
            ET.SubElement(root, "connection", {"from": edge_of(track)})
        for after in behind:
            attributes = {"from": edge_of(track), "to": edge_of(after)}
            ET.SubElement(root, "connection", attributes | {"fromLane": "0", "toLane": "0"})
    return text_of(root)


def network_platforms_xml(line: Line) -> str:
    """
    Return the platforms, which are only drawn, once for each track.

    Parameters
    ----------
    line
        A network.

    Returns
    -------
    str
        XML for SUMO.
    """
    again = set(twins(line).values())
    root = ET.Element("additional")
    for platform in line.platforms:
        track = line.track_by_id[platform.track]
        if track.id in again:
            continue
        first_m, last_m = max(platform.start_m, track.start_m), min(platform.end_m, track.end_m)
        attributes = {
            "id": names.platform(platform.station, track.id),
            "name": line.station_by_id[platform.station].name,
            "lane": names.lane(edge_of(track.id)),
            "startPos": f"{first_m - track.start_m:.3f}",
            "endPos": f"{last_m - track.start_m:.3f}",
        }
        ET.SubElement(root, "trainStop", attributes)
    return text_of(root)
