"""
Signals that show which blocks are occupied, for a run that is watched.

SUMO's own rail signals cannot be told what to show: it ends with a segmentation fault soon
after. In a run that is watched they are traffic lights instead, which trains that are
commanded ignore just as well.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from kankaku.railway.plan.line import Line
from kankaku.railway.plan.world import World
from kankaku.railway.step.engine_contract import Observation
from kankaku.railway.wayside.detection import Detection
from kankaku.sumo_net import names
from kankaku.sumo_net.edge_cuts import cut_tracks

FREE, OCCUPIED = "G", "r"
PHASE_S = "86400"
"""Length of the one phase of a signal that shows what it is told. [s]"""
RED, GREEN = (220, 0, 0), (0, 150, 0)
LINE_WIDTH_M = 5.0
"""Half of the width of a line: seen from afar, and parallel tracks do not hide each other. [m]"""
ABOVE_TRACKS = 10
"""Layer of the lines; trains are drawn above them."""


def block_of_lane(line: Line) -> Mapping[str, int]:
    """
    Return the block that each lane of SUMO's belongs to.

    Parameters
    ----------
    line
        The line.

    Returns
    -------
    Mapping[str, int]
        Number of the block by lane.
    """
    # Limits are the controller's, SUMO's tracks are not cut at them.
    tracks = cut_tracks(replace(line, limits=()))
    found: dict[str, int] = {}
    for number, block in enumerate(line.blocks):
        for edge in tracks[block.track]:
            # A signal may stand a metre beside the end of its block.
            if block.start_m <= 0.5 * (edge.start_m + edge.end_m) < block.end_m:
                found[names.lane(edge.id)] = number
    return found


def shown_network(network: Path) -> Path:
    """
    Write a network whose signals show what they are told.

    Parameters
    ----------
    network
        A network with SUMO's rail signals.

    Returns
    -------
    Path
        The new one, beside it.
    """
    tree = ET.parse(network)  # noqa: S314 - netconvert has written it
    root = tree.getroot()
    links = Counter(link.attrib["tl"] for link in root.iter("connection") if "tl" in link.attrib)
    for junction in root.iter("junction"):
        if junction.attrib["id"] in links:
            junction.set("type", "traffic_light")
    # SUMO wants to know the lights before the connections that they control.
    place = next(place for place, element in enumerate(root) if element.tag == "junction")
    for signal, count in links.items():
        light = ET.Element("tlLogic", id=signal, type="static", programID="0", offset="0")
        ET.SubElement(light, "phase", duration=PHASE_S, state=FREE * count)
        root.insert(place, light)
    shown = network.with_name("shown.net.xml")
    tree.write(shown, encoding="utf-8", xml_declaration=True)
    return shown


class BlockSignals:
    """
    Shows red for every block that is occupied, and green else.

    What shows it is the signal in front of the block, and a line along its track, because
    sumo-gui draws signals half a metre wide. At the end of a section a signal has one aspect
    for each way across it.
    """

    def __init__(self, world: World, sumo: Any) -> None:  # noqa: ANN401
        self._length_m = world.length_m
        self._present = np.zeros(world.size, dtype=np.bool_)
        self._detection = Detection(world)
        self._circuits = self._detection.initial()
        self._occupied: set[int] = set()
        self._set_aspects = sumo.trafficlight.setRedYellowGreenState
        self._set_colour = sumo.polygon.setColor
        number = block_of_lane(world.line)
        self._blocks_behind = {
            signal: [number[behind] for ((_, behind, _),) in links]
            for signal in sumo.trafficlight.getIDList()
            for links in [sumo.trafficlight.getControlledLinks(signal)]
        }
        self._block_of_lane = number if self._blocks_behind else {}
        for lane in self._block_of_lane:
            shape = sumo.lane.getShape(lane)
            sumo.polygon.add(lane, shape, GREEN, layer=ABOVE_TRACKS, lineWidth=LINE_WIDTH_M)

    def show(self, seen: Observation) -> None:
        """
        Let the signals show what is occupied; to be called once per step.

        Parameters
        ----------
        seen
            What the engine observed.
        """
        if not self._blocks_behind:
            return
        self._present[list(seen.entered)] = True
        self._present[list(seen.left)] = False
        tail_m = seen.front_m - self._length_m
        self._circuits = self._detection.look(
            seen.time_s, seen.front_m, tail_m, self._present, self._circuits
        )
        occupied = set(self._detection.block_of_circuit[self._circuits.occupied].tolist())
        changed = occupied ^ self._occupied
        self._occupied = occupied
        for lane, block in self._block_of_lane.items():
            if block in changed:
                self._set_colour(lane, RED if block in occupied else GREEN)
        for signal, blocks in self._blocks_behind.items():
            if not changed.isdisjoint(blocks):
                aspects = "".join(OCCUPIED if block in occupied else FREE for block in blocks)
                self._set_aspects(signal, aspects)
