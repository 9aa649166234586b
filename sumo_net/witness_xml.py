"""What SUMO reads of trains that it only looks at: their types and routes, on any line."""

from collections.abc import Iterable, Mapping, Sequence
from xml.etree import ElementTree as ET

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.timetable import Service
from kankaku.sumo_net import names
from kankaku.sumo_net.edge_cuts import cut_tracks
from kankaku.sumo_net.network_xml import edge_of
from kankaku.sumo_net.plain_xml import text_of
from kankaku.sumo_net.routes_xml import COMMANDED


def route_names(services: Sequence[Service]) -> Mapping[tuple[str, ...], str]:
    """
    Return the routes of trains.

    Parameters
    ----------
    services
        The trains.

    Returns
    -------
    Mapping[tuple[str, ...], str]
        Identifiers by the tracks of the route.
    """
    ways = dict.fromkeys(service.route for service in services)
    return {way: names.route(number) for number, way in enumerate(ways)}


def route_starts_m(line: Line, services: Sequence[Service]) -> FloatArray:
    """
    Return where the first edges of routes begin.

    Parameters
    ----------
    line
        The line, as SUMO's network was built from it.
    services
        The trains.

    Returns
    -------
    FloatArray
        Chainages. [m], shape (n_trains,)
    """
    if line.network:
        start_m = {track.id: track.start_m for track in line.network}
    else:
        start_m = {track: edges[0].start_m for track, edges in cut_tracks(line).items()}
    return np.array([start_m[service.route[0]] for service in services])


def witness_routes_xml(
    line: Line, train_types: Iterable[TrainType], services: Sequence[Service]
) -> str:
    """
    Return types and routes of trains; the trains themselves are added while SUMO runs.

    Parameters
    ----------
    line
        The line, as SUMO's network is built from it.
    train_types
        Types of the trains.
    services
        The trains.

    Returns
    -------
    str
        XML for SUMO.
    """
    edges: dict[str, list[str]] = {track.id: [edge_of(track.id)] for track in line.network}
    if not edges:
        cut = cut_tracks(line)
        edges = {track: [edge.id for edge in cut[track]] for track in cut}
    root = ET.Element("routes")
    for kind in train_types:
        ET.SubElement(root, "vType", COMMANDED.type_attributes(kind))
    for way, name in route_names(services).items():
        along = " ".join(edge for track in way for edge in edges[track])
        ET.SubElement(root, "route", id=name, edges=along)
    return text_of(root)
