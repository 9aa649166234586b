"""A line and its timetable as the plain XML that SUMO reads; pure functions."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise, product
from typing import NamedTuple
from xml.etree import ElementTree as ET

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.timetable import Service, Timetable
from kankaku.railway.plan.world import leaves_at_stop
from kankaku.sumo_net import names
from kankaku.sumo_net.drawing import centre_line, track_points

STOP_TOLERANCE_M = 0.5
"""A front this far before or beyond the aimed stop position starts the stop. [m]"""
EDGE_SPEED_MPS = 150.0
"""Speed limit of an edge without one. [m/s]"""
BEYOND_STOP_M = 1.0
"""Track that SUMO is given beyond a stop at the end of a track. [m]"""
SIGNAL_BEYOND_STOP_M = 1.0
"""Least distance from a stop position to the signal that it waits at. [m]"""
SHORTEST_EDGE_M = 1.0
"""Limits that begin nearer to another cut begin there. [m]"""


@dataclass(frozen=True, slots=True)
class Edge:
    """A stretch of one track without a signal inside, and of one speed limit."""

    id: str
    section: int
    track_index: int
    start_m: float
    end_m: float
    from_node: str
    to_node: str
    limit_mps: float
    at_signal: bool
    """It begins at a signal within the track."""

    @property
    def length_m(self) -> float:
        """Length in metres, to the millimetre."""
        return round(self.end_m - self.start_m, 3)


def cut_tracks(line: Line) -> Mapping[str, tuple[Edge, ...]]:
    """
    Cut each track at its signals, and where its speed limit changes.

    Parameters
    ----------
    line
        The line.

    Returns
    -------
    Mapping[str, tuple[Edge, ...]]
        Edges by track, in running direction.
    """
    edges: dict[str, tuple[Edge, ...]] = {}
    joints_m = joints(line)
    for section, stretch in enumerate(line.sections):
        ends_m = joints_m[section], joints_m[section + 1]
        for index, track in enumerate(stretch.tracks):
            signals_m = _signals_m(line, track.id, ends_m)
            cuts = _with_limits(line, [ends_m[0], *signals_m, ends_m[1]])
            inner = [
                (names.signal_node if cut_m in signals_m else names.limit_node)(track.id, count)
                for count, cut_m in enumerate(cuts[1:-1], start=1)
            ]
            nodes = [names.section_node(section), *inner, names.section_node(section + 1)]
            edges[track.id] = tuple(
                Edge(
                    id=names.edge(track.id, count),
                    section=section,
                    track_index=index,
                    start_m=round(start_m, 3),
                    end_m=round(end_m, 3),
                    from_node=nodes[count],
                    to_node=nodes[count + 1],
                    limit_mps=_limit_mps(line, 0.5 * (start_m + end_m)),
                    at_signal=start_m in signals_m,
                )
                for count, (start_m, end_m) in enumerate(pairwise(cuts))
            )
    return edges


def joints(line: Line) -> list[float]:
    """
    Return where SUMO's sections begin and end: past stops that lie at the end of a track.

    A front may stand half a metre beyond the aimed position, and SUMO begins the stop only on
    the edge that holds it.

    Parameters
    ----------
    line
        The line.

    Returns
    -------
    list[float]
        Start of each section, then the end of the last one. [m]
    """
    joints_m = [line.start_m]
    for section in line.sections:
        tracks = {track.id for track in section.tracks}
        stops_m = [place.stop_m for place in line.platforms if place.track in tracks]
        near_m = [stop_m for stop_m in stops_m if stop_m + STOP_TOLERANCE_M > section.end_m]
        past_m = max(near_m, default=-np.inf) + BEYOND_STOP_M
        joints_m.append(max(section.end_m, past_m))
    return joints_m


def _signals_m(line: Line, track: str, ends_m: tuple[float, float]) -> list[float]:
    stops_m = [platform.stop_m for platform in line.platforms if platform.track == track]
    signals_m: set[float] = set()
    for block in line.blocks:
        if block.track == track:
            for end_m in (block.start_m, block.end_m):
                # A front within the tolerance of its stop must not be past the signal.
                at_stop = [s for s in stops_m if abs(end_m - s) < SIGNAL_BEYOND_STOP_M]
                signals_m.add(at_stop[0] + SIGNAL_BEYOND_STOP_M if at_stop else end_m)
    first_m = ends_m[0] + SIGNAL_BEYOND_STOP_M
    last_m = ends_m[1] - SIGNAL_BEYOND_STOP_M
    return sorted(signal for signal in signals_m if first_m < signal < last_m)


def _with_limits(line: Line, cuts_m: list[float]) -> list[float]:
    changes_m = {at_m for limit in line.limits for at_m in (limit.start_m, limit.end_m)}
    clear_m = [
        change_m
        for change_m in changes_m
        if cuts_m[0] < change_m < cuts_m[-1]
        and min(abs(change_m - cut_m) for cut_m in cuts_m) >= SHORTEST_EDGE_M
    ]
    return sorted([*cuts_m, *clear_m])


def _limit_mps(line: Line, place_m: float) -> float:
    here = [limit for limit in line.limits if limit.start_m <= place_m < limit.end_m]
    return min((limit.limit_mps for limit in here), default=EDGE_SPEED_MPS)


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
    return _text(root)


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
    return _text(root)


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
    return _text(root)


def edge_of_stop(edges: Mapping[str, tuple[Edge, ...]], track: str, stop_m: float) -> Edge:
    """
    Return the edge on which a train stops.

    Parameters
    ----------
    edges
        Edges by track.
    track
        Identifier of the track.
    stop_m
        Chainage of the stop position. [m]

    Returns
    -------
    Edge
        The edge that holds the stop position and the tolerance on both sides.

    Raises
    ------
    ValueError
        If there is none.
    """
    first_m, last_m = stop_m - STOP_TOLERANCE_M, stop_m + STOP_TOLERANCE_M
    for edge in edges[track]:
        if edge.start_m <= first_m and last_m <= edge.end_m:
            return edge
    msg = (
        f"the stop position {stop_m:.2f} m on track {track} is closer than {STOP_TOLERANCE_M} m "
        "to the track's end or to the signal behind it"
    )
    raise ValueError(msg)


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
    return _text(root)


class Driver(NamedTuple):
    """What the files say by who drives the trains."""

    type_attributes: Callable[[TrainType], dict[str, str]]
    train_attributes: Mapping[str, str]
    stop_end_m: float
    """End of a stop beyond the aimed position, which SUMO's own model makes for. [m]"""
    late_steps: int
    """Steps by which stops end later in the files than SUMO reports their end. [-]"""


def routes_xml(
    line: Line,
    train_types: Iterable[TrainType],
    timetable: Timetable,
    dwell_delay_s: FloatArray,
    step_s: float,
    driver: Driver | None = None,
) -> str:
    """
    Return train types and trains with their stops.

    SUMO shows a train one step after its departure time, begins its first stop another
    step later, and reports one step late that the time ``until`` has come. These steps are
    taken off, so that trains keep the timetable whatever the step.

    Parameters
    ----------
    line
        The line.
    train_types
        Types of the trains.
    timetable
        Services, first train first.
    dwell_delay_s
        Dwell delay of every call. [s], shape (n_trains, n_calls_max)
    step_s
        Length of a step. [s]
    driver
        Who drives the trains; our own commands if None.

    Returns
    -------
    str
        XML for SUMO, trains sorted by the time they enter, as SUMO demands.
    """
    driver = driver or COMMANDED
    root = ET.Element("routes")
    for kind in train_types:
        ET.SubElement(root, "vType", driver.type_attributes(kind))
    late_s = (driver.late_steps - 1) * step_s
    edges = cut_tracks(line)
    rows = sorted(
        range(len(timetable.services)),
        key=lambda row: timetable.services[row].calls[0].arrival_s,
    )
    for row in rows:
        service = timetable.services[row]
        first = service.calls[0]
        origin = edge_of_stop(edges, first.track, first.stop_m)
        train = ET.SubElement(root, "vehicle", _train_attributes(service, origin, step_s))
        route = _route(edges, service, origin)
        if leaves_at_stop(line, service):
            last = edge_of_stop(edges, service.calls[-1].track, service.calls[-1].stop_m)
            route = route[: route.index(last) + 1]
            arrival_m = service.calls[-1].stop_m - STOP_TOLERANCE_M
            train.set("arrivalPos", f"{arrival_m - last.start_m:.3f}")
        elif route[-1].end_m > line.end_m:
            train.set("arrivalPos", f"{line.end_m - route[-1].start_m:.3f}")
        train.attrib.update(driver.train_attributes)
        ET.SubElement(train, "route", edges=" ".join(edge.id for edge in route))
        dwells_s = [
            call.minimum_dwell_s + delay_s
            for call, delay_s in zip(service.calls, dwell_delay_s[row].tolist(), strict=False)
        ]
        dwells_s[0] = max(dwells_s[0] - step_s, 0.0)
        for call, dwell_s in zip(service.calls, dwells_s, strict=True):
            edge = edge_of_stop(edges, call.track, call.stop_m)
            aimed_m = call.stop_m - edge.start_m
            attributes = {
                "lane": names.lane(edge.id),
                "startPos": f"{aimed_m - STOP_TOLERANCE_M:.3f}",
                "endPos": f"{aimed_m + driver.stop_end_m:.3f}",
                "duration": f"{dwell_s + driver.late_steps * step_s:.3f}",
                "until": f"{call.departure_s + late_s:.3f}",
            }
            ET.SubElement(train, "stop", attributes)
    return _text(root)


def _route(edges: Mapping[str, tuple[Edge, ...]], service: Service, origin: Edge) -> list[Edge]:
    route = [edge for track in service.route for edge in edges[track]]
    return route[route.index(origin) :]


def _type_attributes(kind: TrainType) -> dict[str, str]:
    acceleration = float(kind.level_acceleration_mps2(np.zeros(1))[0])
    return {
        "id": names.vehicle_type(kind.id),
        "vClass": "rail",
        "carFollowModel": "Krauss",
        "sigma": "0",
        "minGap": "0",
        "speedDev": "0",
        "length": f"{kind.length_m:.3f}",
        "maxSpeed": f"{kind.maximum_speed_mps:.4f}",
        "accel": f"{acceleration:.4f}",
        "decel": f"{kind.service_brake_mps2:.4f}",
        "emergencyDecel": f"{kind.emergency_brake_mps2:.4f}",
    }


def _train_attributes(service: Service, origin: Edge, step_s: float) -> dict[str, str]:
    return {
        "id": names.vehicle(service.train),
        "type": names.vehicle_type(service.train_type),
        "depart": f"{service.calls[0].arrival_s - step_s:.3f}",
        "departPos": f"{service.calls[0].stop_m - origin.start_m:.3f}",
        "departSpeed": "0",
    }


COMMANDED = Driver(
    _type_attributes,
    # Enter as soon as the platform is free, however near the next train behind may be.
    {"insertionChecks": "collision"},
    stop_end_m=STOP_TOLERANCE_M,
    late_steps=0,
)


def _text(root: ET.Element) -> str:
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"
