"""A line and its timetable as the plain XML that SUMO reads; pure functions."""

from itertools import pairwise, product
from xml.etree import ElementTree as ET

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.line import Line
from kankaku.sumo_net import names
from kankaku.sumo_net.edge_cuts import cut_tracks, edge_of_stop, joints
from kankaku.sumo_net.geometry import centre_line, track_points


def nodes_xml(line: Line) -> str:
    """
    Return the nodes: the ends of sections, and signals and changes of the limit between them.

    Parameters
    ----------
    line
        The line.

    Returns
    -------
    str
        Plain XML for netconvert.
    """
    drawn = centre_line(line)
    root = ET.Element("nodes")
    signalled = _signalled_boundaries(line)
    bounds_m = np.array(joints(line))
    x_m, y_m = drawn.at(bounds_m)
    for index, place in enumerate(np.column_stack([x_m, y_m, line.height_m(bounds_m)])):
        _add_node(root, names.section_node(index), place, signal=index in signalled)
    for edges in cut_tracks(line).values():
        for edge in edges[1:]:
            points = track_points(
                line, drawn, edge.section, edge.track_index, (edge.start_m, edge.end_m)
            )
            _add_node(root, edge.from_node, points[0], signal=edge.at_signal)
    return text_of(root)


def _signalled_boundaries(line: Line) -> set[int]:
    ends_m = {end_m for block in line.blocks for end_m in (block.start_m, block.end_m)}
    return {
        index
        for index, section in enumerate(line.sections)
        if index > 0 and any(abs(end_m - section.start_m) < 0.5 for end_m in ends_m)
    }


def _add_node(root: ET.Element, identifier: str, place_m: FloatArray, *, signal: bool) -> None:
    x, y, z = (f"{value:.3f}" for value in place_m)
    kind = "rail_signal" if signal else "priority"
    ET.SubElement(root, "node", id=identifier, x=x, y=y, z=z, type=kind)


def edges_xml(line: Line) -> str:
    """
    Return the edges, with explicit lengths so that chainage is exact however they are drawn.

    Parameters
    ----------
    line
        The line.

    Returns
    -------
    str
        Plain XML for netconvert.
    """
    drawn = centre_line(line)
    root = ET.Element("edges")
    for edges in cut_tracks(line).values():
        for edge in edges:
            points = track_points(
                line, drawn, edge.section, edge.track_index, (edge.start_m, edge.end_m)
            )
            attributes = {
                "id": edge.id,
                "from": edge.from_node,
                "to": edge.to_node,
                "numLanes": "1",
                "speed": f"{edge.limit_mps:.3f}",
                "length": f"{edge.length_m:.3f}",
                "distance": f"{edge.start_m:.3f}",
                "allow": "rail",
                "spreadType": "center",
                "shape": " ".join(",".join(f"{value:.3f}" for value in row) for row in points),
            }
            ET.SubElement(root, "edge", attributes)
    return text_of(root)


def connections_xml(line: Line) -> str:
    """
    Return which edge leads to which: at a section's end every track to every track.

    Parameters
    ----------
    line
        The line.

    Returns
    -------
    str
        Plain XML for netconvert.
    """
    edges = cut_tracks(line)
    root = ET.Element("connections")
    pairs = [pair for track in edges.values() for pair in pairwise(track)]
    for before, after in pairwise(line.sections):
        for here, there in product(before.tracks, after.tracks):
            pairs.append((edges[here.id][-1], edges[there.id][0]))
    for source, target in pairs:
        attributes = {"from": source.id, "to": target.id, "fromLane": "0", "toLane": "0"}
        ET.SubElement(root, "connection", attributes)
    return text_of(root)


def platforms_xml(line: Line) -> str:
    """
    Return the platforms, which are only drawn: trains stop at positions on the edge.

    SUMO begins the stop of a train anywhere at a platform that is longer than the train.

    Parameters
    ----------
    line
        The line.

    Returns
    -------
    str
        XML for SUMO.
    """
    edges = cut_tracks(line)
    root = ET.Element("additional")
    for platform in line.platforms:
        edge = edge_of_stop(edges, platform.track, platform.stop_m)
        attributes = {
            "id": names.platform(platform.station, platform.track),
            "name": line.station_by_id[platform.station].name,
            "lane": names.lane(edge.id),
            "startPos": f"{max(platform.start_m - edge.start_m, 0.0):.3f}",
            "endPos": f"{min(platform.end_m - edge.start_m, edge.length_m):.3f}",
        }
        ET.SubElement(root, "trainStop", attributes)
    return text_of(root)


def text_of(root: ET.Element) -> str:
    """Return a tree of elements as indented text."""
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"
