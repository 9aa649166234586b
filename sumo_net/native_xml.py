"""What SUMO needs to know beside the plain XML in order to drive the trains itself."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple
from xml.etree import ElementTree as ET

import numpy as np

from kankaku.railway.plan.line import Block, Line, SpeedLimit
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.timetable import Timetable
from kankaku.sumo_net import names
from kankaku.sumo_net.edge_cuts import SIGNAL_BEYOND_STOP_M, Edge, cut_tracks
from kankaku.sumo_net.routes_xml import Driver

STANDING_GAP_M = 5.0
"""What a train keeps from the one ahead that stands: SUMO's own value for rail. [m]"""
TABLE_SPACING_MPS = 0.5
"""SUMO interpolates the tractive force between these speeds. [m/s]"""


def native_line(line: Line, *, moving_block: bool) -> Line:
    """
    Return a line with the signals and limits that SUMO obeys.

    Before points stands a signal on every track, at the fouling point: it takes the place
    of a block boundary at the points themselves. Behind it SUMO keeps trains of two tracks
    apart. A limit that changes at a stop position changes a metre beside it, on the slow side.

    Parameters
    ----------
    line
        The line.
    moving_block
        Leave out all other signals; trains are then kept apart by their distance.

    Returns
    -------
    Line
        The same tracks with other blocks, and limits that do not change at a stop position.
    """
    fouling_at = {
        turnout.position_m: turnout.fouling_start_m
        for turnout in line.turnouts
        if turnout.position_m - turnout.fouling_start_m > SIGNAL_BEYOND_STOP_M
    }
    at_points = tuple(
        Block(f"{track.id} before points", track.id, signal_m, signal_m)
        for section in line.sections[:-1]
        for track in section.tracks
        for signal_m in [fouling_at.get(section.end_m, section.end_m)]
    )
    moved = tuple(
        replace(
            block,
            start_m=fouling_at.get(block.start_m, block.start_m),
            end_m=fouling_at.get(block.end_m, block.end_m),
        )
        for block in line.blocks
    )
    limits = tuple(_off_the_stops(line))
    return replace(line, blocks=at_points if moving_block else moved + at_points, limits=limits)


def _off_the_stops(line: Line) -> Iterator[SpeedLimit]:
    begins = {limit.start_m: limit.limit_mps for limit in line.limits}
    ends = {limit.end_m: limit.limit_mps for limit in line.limits}

    def place_m(change_m: float) -> float:
        slower = begins.get(change_m, np.inf) < ends.get(change_m, np.inf)
        beyond_m = -SIGNAL_BEYOND_STOP_M if slower else SIGNAL_BEYOND_STOP_M
        off_m = change_m
        for stop_m in sorted((platform.stop_m for platform in line.platforms), reverse=slower):
            if abs(stop_m - off_m) < SIGNAL_BEYOND_STOP_M:
                off_m = stop_m + beyond_m
        return off_m

    for limit in line.limits:
        yield replace(limit, start_m=place_m(limit.start_m), end_m=place_m(limit.end_m))


def rail_attributes(kind: TrainType) -> dict[str, str]:
    """
    Return a train type for SUMO's car-following model ``Rail``.

    Traction is tabulated, resistance is exact, braking is the service brake. The resistance
    of curves is not known to SUMO.

    Parameters
    ----------
    kind
        The train type.

    Returns
    -------
    dict[str, str]
        Attributes of a ``vType``; forces in kN, speeds in m/s, mass in kg.
    """
    traction, resistance = kind.traction, kind.resistance
    grid = np.arange(0.0, kind.maximum_speed_mps + TABLE_SPACING_MPS, TABLE_SPACING_MPS)
    speed_mps = np.unique(np.concatenate([grid, traction.bends_mps]))
    return {
        "id": names.vehicle_type(kind.id),
        "vClass": "rail",
        "carFollowModel": "Rail",
        "trainType": "custom",
        "minGap": f"{STANDING_GAP_M:g}",
        "speedDev": "0",
        "length": f"{kind.length_m:.3f}",
        "maxSpeed": f"{kind.maximum_speed_mps:.4f}",
        "decel": f"{kind.service_brake_mps2:.4f}",
        "emergencyDecel": f"{kind.emergency_brake_mps2:.4f}",
        "mass": f"{kind.mass_kg:.1f}",
        "massFactor": f"{1.0 + kind.rotating_mass_ratio:.6g}",
        "speedTable": " ".join(f"{value:.6g}" for value in speed_mps),
        "tractionTable": " ".join(f"{value / 1000.0:.6g}" for value in traction.force_n(speed_mps)),
        "resCoef_constant": f"{resistance.a_n / 1000.0:.9g}",
        "resCoef_linear": f"{resistance.b_nspm / 1000.0:.9g}",
        "resCoef_quadratic": f"{resistance.c_ns2pm2 / 1000.0:.9g}",
    }


NATIVE = Driver(rail_attributes, {}, stop_end_m=0.0, late_steps=1)
"""
SUMO itself: it brakes to the very end of a stop, and it starts in the same step in which the
stop ends, one before the end is reported.
"""


class Precedence(NamedTuple):
    """At points where tracks join, one train waits for another one of another track."""

    signal: str
    train: str
    other_signal: str
    other_train: str


def precedences(line: Line, timetable: Timetable) -> Iterator[Precedence]:
    """
    Return who goes after whom where tracks join, as the timetable has it.

    Parameters
    ----------
    line
        From :func:`native_line`.
    timetable
        Services, first train first.

    Yields
    ------
    Precedence
        One for every train whose predecessor comes from another track.
    """
    edges = cut_tracks(line)
    for before, after in pairwise(line.sections):
        joined = {track.id for track in before.tracks}
        onwards = {track.id for track in after.tracks}
        ahead: dict[str, tuple[str, str]] = {}
        for service in timetable.services:
            here = next((track for track in service.route if track in joined), None)
            there = next((track for track in service.route if track in onwards), None)
            if here is None or there is None:
                continue
            other = ahead.get(there)
            if other and other[0] != here:
                yield Precedence(
                    _last_signal(edges[here]),
                    service.train,
                    _last_signal(edges[other[0]]),
                    other[1],
                )
            ahead[there] = (here, service.train)


def _last_signal(edges: tuple[Edge, ...]) -> str:
    """Return the signal at which a train waits before it leaves a track."""
    return next((edge.from_node for edge in reversed(edges) if edge.at_signal), edges[-1].to_node)


def order_xml(line: Line, timetable: Timetable) -> str:
    """
    Return the order of the timetable as constraints on signals.

    Without them SUMO lets the train go first that comes first.

    Parameters
    ----------
    line
        From :func:`native_line`.
    timetable
        Services, first train first.

    Returns
    -------
    str
        XML for SUMO.
    """
    root = ET.Element("additional")
    for rule in precedences(line, timetable):
        signal = ET.SubElement(root, "railSignalConstraints", id=rule.signal)
        attributes = {
            "tripId": names.vehicle(rule.train),
            "tl": rule.other_signal,
            "foes": names.vehicle(rule.other_train),
        }
        ET.SubElement(signal, "predecessor", attributes)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"
