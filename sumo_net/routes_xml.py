"""A timetable as the routes file that SUMO reads."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple
from xml.etree import ElementTree as ET

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.timetable import Service, Timetable
from kankaku.railway.plan.world import leaves_at_stop
from kankaku.sumo_net import names
from kankaku.sumo_net.edge_cuts import STOP_TOLERANCE_M, Edge, cut_tracks, edge_of_stop
from kankaku.sumo_net.plain_xml import text_of


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
        route = _own_route(line, edges, service, train)
        train.attrib.update(driver.train_attributes)
        ET.SubElement(train, "route", edges=" ".join(edge.id for edge in route))
        _add_stops(train, edges, service, dwell_delay_s[row].tolist(), (step_s, driver))
    return text_of(root)


def _own_route(
    line: Line, edges: Mapping[str, tuple[Edge, ...]], service: Service, train: ET.Element
) -> list[Edge]:
    """Return the edges of a train from its origin on; where it ends is written to it."""
    first = service.calls[0]
    route = _route(edges, service, edge_of_stop(edges, first.track, first.stop_m))
    if leaves_at_stop(line, service):
        last = edge_of_stop(edges, service.calls[-1].track, service.calls[-1].stop_m)
        route = route[: route.index(last) + 1]
        arrival_m = service.calls[-1].stop_m - STOP_TOLERANCE_M
        train.set("arrivalPos", f"{arrival_m - last.start_m:.3f}")
    elif route[-1].end_m > line.end_m:
        train.set("arrivalPos", f"{line.end_m - route[-1].start_m:.3f}")
    return route


def _add_stops(
    train: ET.Element,
    edges: Mapping[str, tuple[Edge, ...]],
    service: Service,
    dwell_delay_s: Sequence[float],
    driven: tuple[float, Driver],
) -> None:
    step_s, driver = driven
    late_s = (driver.late_steps - 1) * step_s
    dwells_s = [
        call.minimum_dwell_s + delay_s
        for call, delay_s in zip(service.calls, dwell_delay_s, strict=False)
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
