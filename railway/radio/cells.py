"""Radio cells along a line, and the links, frames and slots of a train-control network."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray

MTU_BYTES = 1500
"""Greatest payload of an Ethernet frame (IEEE 802.3). [bytes]"""
FRAME_BYTES = 8 + 14 + 4 + 12
"""Preamble, header, checksum and gap around a payload (IEEE 802.3). [bytes]"""
LEAST_PAYLOAD_BYTES = 46
"""A shorter payload is filled up (IEEE 802.3). [bytes]"""
IP_BYTES = 20
"""Header of every fragment (RFC 791). [bytes]"""
UDP_BYTES = 8
"""Header of every datagram (RFC 768). [bytes]"""
_FRAGMENT_UNIT_BYTES = 8


class Link(Enum):
    """A kind of link, in the words of the published table."""

    CONTROLLER_SWITCH = "controller_switch"
    SWITCH_CONTROLLER = "switch_controller"
    SWITCH_UNIT = "switch_unit"
    UNIT_SWITCH = "unit_switch"
    ANTENNA_TRAIN = "antenna_train"
    TRAIN_ANTENNA = "train_antenna"


def fragments_bytes(message_bytes: int) -> tuple[int, ...]:
    """
    Return what a message takes on a wire, sent as one UDP datagram over IPv4 and Ethernet.

    Parameters
    ----------
    message_bytes
        Length of the message. [bytes]

    Returns
    -------
    tuple[int, ...]
        Length of every frame with preamble and gap, in order. [bytes]

    References
    ----------
    .. [1] IEEE 802.3; RFC 791 (fragments are cut at multiples of 8 bytes); RFC 768.
    """
    left_bytes = message_bytes + UDP_BYTES
    most_bytes = (MTU_BYTES - IP_BYTES) // _FRAGMENT_UNIT_BYTES * _FRAGMENT_UNIT_BYTES
    frames = []
    while left_bytes > 0:
        taken_bytes = min(left_bytes, most_bytes)
        frames.append(FRAME_BYTES + max(IP_BYTES + taken_bytes, LEAST_PAYLOAD_BYTES))
        left_bytes -= taken_bytes
    return tuple(frames)


@dataclass(frozen=True, slots=True)
class Cells:
    """Stretches of line with a radio unit each; next to a border two units serve a train."""

    edges_m: FloatArray
    """Where the cells begin, and the end of the last. [m], shape (n_cells + 1,)"""
    overlap_m: float
    """Length of the stretch around each border that both cells cover. [m]"""

    @property
    def size(self) -> int:
        """How many cells there are. [-]"""
        return self.edges_m.size - 1

    def serving(self, front_m: FloatArray) -> BoolArray:
        """
        Return which radio units serve trains.

        Parameters
        ----------
        front_m
            Fronts, where the antenna is; not a number for trains off the line. [m], any shape

        Returns
        -------
        BoolArray
            Last axis: cells. shape (..., n_cells)
        """
        beyond_m = 0.5 * self.overlap_m
        low_m, high_m = self.edges_m[:-1] - beyond_m, self.edges_m[1:] + beyond_m
        # What has run past the last border is served until it has left the model.
        low_m[0], high_m[-1] = -np.inf, np.inf
        front = front_m[..., np.newaxis]
        return (front >= low_m) & (front < high_m)


@dataclass(frozen=True, slots=True)
class RadioSystem:
    """
    How commands reach trains.

    Time is divided into cycles, a cycle into updates. In every update each train is sent one
    command, in every cycle each trackside device. A device answers so many slots later, in the
    other direction.
    """

    name: str
    title: str
    central: bool
    """A controller makes the commands and sends them by wire; else each radio unit its own."""
    wired_bps: float
    radio_bps: float
    radio_packet_bytes: int
    wired_packet_bytes: int
    """Length of every wired packet, full or not. [bytes]"""
    cycle_s: float
    updates_per_cycle: int
    broadcasts_per_update: int
    """Telegrams to all devices of a cell. [-]"""
    own_slots_per_cycle: int
    """Slots that the radio unit keeps for its own signals. [-]"""
    answer_slots: int
    """Slots between the beginnings of a command and its answer. [-]"""
    trackside_devices: int
    """Points, level crossings and work terminals in each cell that are reached by radio. [-]"""
    trackside_devices_max: int
    """For how many of them a cell is meant at the most. [-]"""
    loss: float
    """Probability that a radio packet is lost. [-]"""
    repeats: int
    """How often an exchange that was not answered is tried again. [-]"""

    @property
    def update_s(self) -> float:
        """Time between two commands to the same train. [s]"""
        return self.cycle_s / self.updates_per_cycle

    @property
    def airtime_s(self) -> float:
        """Time that a packet is on the air. [s]"""
        return 8.0 * self.radio_packet_bytes / self.radio_bps

    @property
    def slots_per_update(self) -> int:
        """Slots of each direction in an update; whole ones, with a little time to spare. [-]"""
        return int(self.cycle_s / self.airtime_s + 1e-9) // self.updates_per_cycle

    @property
    def slot_s(self) -> float:
        """Time from slot to slot. [s]"""
        return self.update_s / self.slots_per_update

    @property
    def telegrams_per_packet(self) -> int:
        """How many telegrams a wired packet holds. [-]"""
        return self.wired_packet_bytes // self.radio_packet_bytes

    @property
    def trains_per_cell(self) -> int:
        """Trains that one cell carries by counting the slots of a cycle, without losses. [-]"""
        free = self.updates_per_cycle * (self.slots_per_update - self.broadcasts_per_update)
        free -= self.own_slots_per_cycle + self.trackside_devices
        by_slots = max(0, free // self.updates_per_cycle)
        if not self.central:
            return by_slots
        # The trackside devices are spread over the updates of a cycle.
        most_devices = -(-self.trackside_devices // self.updates_per_cycle)
        room = self.telegrams_per_packet - self.broadcasts_per_update - most_devices
        return min(by_slots, max(0, room))


class PublishedLoad(NamedTuple):
    """A published simulation of the same question, printed beside ours."""

    system: str
    trains: int
    utilisation: Mapping[Link, float]
    """Share of time that a link of each kind is busy. [-]"""
    round_trip_mean_s: float | None
    round_trip_max_s: float | None


@dataclass(frozen=True, slots=True)
class RadioPlan:
    """What to find out about the radio of a line."""

    cells: Cells
    late_s: float
    """A command that takes longer from its making to the train is late. [s]"""
    systems: tuple[RadioSystem, ...]
    source: str
    """Of the published loads; empty without any."""
    published: tuple[PublishedLoad, ...]
    digest: str
    """Content hash of the file."""
