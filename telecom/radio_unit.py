"""A radio unit: sends the newest commands in slots and gathers the answers."""

from collections.abc import Callable, Generator
from functools import partial
from typing import Any, TypeAlias

import numpy as np
import simpy

from kankaku.railway.randomness import stream
from kankaku.telecom.cell_commands import RadioCommand
from kankaku.telecom.links import Channel, Network

Process: TypeAlias = Generator[simpy.Event, Any, None]


class RadioUnit:
    """Sends the newest commands in slots, and gathers the answers of each update."""

    def __init__(self, network: Network, number: int, seed: int) -> None:
        self.network, self.system, self.number = network, network.system, number
        self.environment = network.environment
        # Cycles of neighbours are shifted so that their packets do not meet at the switch.
        self.phase_s = number * self.system.update_s / len(network.to_unit)
        self.down, self.up = Channel(self.environment), Channel(self.environment)
        self.inbox: list[RadioCommand] = []
        self._waiting: dict[int, RadioCommand] = {}
        self._unanswered: list[tuple[int, RadioCommand]] = []
        self._slot = 0
        self._slot_s, self._airtime_s = self.system.slot_s, self.system.airtime_s
        # An answer to the last slot of an update is whole so long after its beginning.
        self._gathered_s = self.system.update_s + self.system.answer_slots * self._slot_s
        self._random = stream(seed, "radio traffic", self.system.name, number)

    def serve(self, make: Callable[[int], list[RadioCommand]]) -> Process:
        """
        Serve one update after the other.

        Parameters
        ----------
        make
            Returns the commands of an update that the unit makes on its own.

        Yields
        ------
        simpy.Event
            What to wait for.
        """
        system, per_update = self.system, self.system.slots_per_update
        yield self.environment.timeout(self.phase_s)
        update = 0
        while True:
            if not system.central and update < self.network.updates:
                self.receive(make(update))
            answers: list[RadioCommand] = []
            if system.central:
                self.environment.process(self._bring_back(answers))
            self._take_newest()
            first = update * per_update
            own = system.own_slots_per_cycle if update % system.updates_per_cycle == 0 else 0
            occupied = min(per_update, own + system.broadcasts_per_update)
            for slot in range(occupied):
                self.down.send(self._airtime_s, not_before_s=self._end_s(first + slot))
            for slot in range(first + occupied, first + per_update):
                if not (self._waiting or self._unanswered):
                    break
                yield self._until(slot)
                self._slot = slot
                self._send_next(answers)
            update += 1
            yield self._until(update * per_update)

    def _start_s(self, slot: int) -> float:
        return self.phase_s + slot * self._slot_s

    def _end_s(self, slot: int) -> float:
        return self._start_s(slot) + self._airtime_s

    def _until(self, slot: int) -> simpy.Event:
        return self.environment.timeout(max(0.0, self._start_s(slot) - self.environment.now))

    def receive(self, commands: list[RadioCommand]) -> None:
        """
        Keep commands until the next update begins.

        Parameters
        ----------
        commands
            The newest ones.
        """
        self.inbox = commands

    def _take_newest(self) -> None:
        for command in self.inbox:
            # A newer command takes the place of one that still waits.
            self._waiting[command.device] = command
        self.inbox = []

    def _send_next(self, answers: list[RadioCommand]) -> None:
        system = self.system
        if self._unanswered and self._unanswered[0][0] <= self._slot:
            command = self._unanswered.pop(0)[1]
            if command.device in self._waiting:
                command = self._waiting.pop(command.device)
        elif self._waiting:
            command = self._waiting.pop(next(iter(self._waiting)))
        else:
            return
        command.tries += 1
        self.down.send(self._airtime_s)
        heard, answered, end_s = self._passes(), False, 0.0
        if heard:
            if np.isnan(command.arrived_s):
                command.arrived_s = self.environment.now + self._airtime_s
            end_s = self._end_s(self._slot + system.answer_slots)
            self.up.send(self._airtime_s, not_before_s=end_s)
            answered = self._passes()
        if answered and system.central:
            answers.append(command)
        elif answered:
            command.returned_s = end_s
        elif command.tries <= system.repeats:
            # Nothing is missed before the slot of the answer is over.
            self._unanswered.append((self._slot + system.answer_slots + 1, command))

    def _passes(self) -> bool:
        return self.system.loss == 0.0 or bool(self._random.random() >= self.system.loss)

    def _bring_back(self, answers: list[RadioCommand]) -> Process:
        """Send the answers of an update to the controller, in a packet of the usual length."""
        yield self.environment.timeout(self._gathered_s)
        uplink = self.network.from_unit[self.number]
        self.network.forward(uplink, self.network.to_controller, partial(self._returned, answers))

    def _returned(self, answers: list[RadioCommand]) -> None:
        for command in answers:
            command.returned_s = self.environment.now
