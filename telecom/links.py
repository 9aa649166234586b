"""Links that send one packet after the other, and the switch between them."""

from collections.abc import Callable
from functools import partial

import numpy as np
import simpy

from kankaku.railway.arrays import FloatArray
from kankaku.railway.radio.cells import Link, RadioSystem, fragments_bytes
from kankaku.railway.radio.traffic import LinkName, busy_shares


class Channel:
    """One direction of a link: sends one packet after the other."""

    def __init__(self, environment: simpy.Environment) -> None:
        self._environment = environment
        self._free_s = 0.0
        self.starts_s: list[float] = []
        self.ends_s: list[float] = []

    def send(self, taken_s: float, *, not_before_s: float = 0.0) -> float:
        """
        Send a packet as soon as those before it are gone.

        Parameters
        ----------
        taken_s
            How long it takes. [s]
        not_before_s
            It may not be whole before. [s]

        Returns
        -------
        float
            When its last bit is sent. [s]
        """
        start_s = max(self._environment.now, self._free_s, not_before_s - taken_s)
        self._free_s = start_s + taken_s
        self.starts_s.append(start_s)
        self.ends_s.append(self._free_s)
        return self._free_s

    def busy_shares(self, seconds: int) -> FloatArray:
        """
        Return the share of each second in which it is busy.

        Parameters
        ----------
        seconds
            How many seconds, from 0 on. [-]

        Returns
        -------
        FloatArray
            Shares. [-], shape (n_seconds,)
        """
        return busy_shares(np.array(self.starts_s), np.array(self.ends_s), seconds)


class Network:
    """The wired part: a switch between the controller and the radio units."""

    def __init__(
        self, environment: simpy.Environment, system: RadioSystem, cells: int, updates: int
    ) -> None:
        self.environment = environment
        self.system = system
        self.updates = updates
        make = partial(Channel, environment)
        self.to_switch, self.to_controller = make(), make()
        self.to_unit = [make() for _ in range(cells)]
        self.from_unit = [make() for _ in range(cells)]
        frames = fragments_bytes(system.wired_packet_bytes)
        frames_s = [8.0 * size / system.wired_bps for size in frames]
        self._packet_s, self._longest_s = sum(frames_s), max(frames_s)

    def forward(self, first: Channel, second: Channel, then: Callable[[], None]) -> None:
        """
        Send a packet over two links; the switch passes on each frame as soon as it is whole.

        Parameters
        ----------
        first
            Link to the switch.
        second
            Link from the switch.
        then
            Called when the packet has arrived.
        """
        whole_s = first.send(self._packet_s)
        # Frames follow each other without a gap once the switch has had a longest one whole.
        arrived_s = second.send(self._packet_s, not_before_s=whole_s + self._longest_s)
        event = self.environment.timeout(arrived_s - self.environment.now)
        event.callbacks.append(lambda _: then())

    def channels(self) -> dict[LinkName, Channel]:
        """Return the wired links by name."""
        numbered = list(enumerate(self.to_unit)), list(enumerate(self.from_unit))
        links = {LinkName(Link.SWITCH_UNIT, cell): channel for cell, channel in numbered[0]}
        links |= {LinkName(Link.UNIT_SWITCH, cell): channel for cell, channel in numbered[1]}
        if self.system.central:
            links[LinkName(Link.CONTROLLER_SWITCH)] = self.to_switch
            links[LinkName(Link.SWITCH_CONTROLLER)] = self.to_controller
        return links
