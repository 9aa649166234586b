"""All processes of a network together: controller, switch and radio units."""

from collections.abc import Callable
from functools import partial

import numpy as np
import simpy

from kankaku.railway.arrays import FloatArray
from kankaku.railway.radio.cells import Cells, Link, RadioSystem
from kankaku.railway.radio.traffic import LinkName, Traffic
from kankaku.telecom.cell_commands import Presence, RadioCommand
from kankaku.telecom.links import Network
from kankaku.telecom.radio_unit import Process, RadioUnit

DRAIN_S = 4.0
"""So long after the last update commands may still arrive. [s]"""
REPORT_S = 60.0
"""Simulated time between two reports of progress. [s]"""


class RadioSimulation:
    """All processes of a network."""

    def __init__(self, system: RadioSystem, cells: Cells, front_m: FloatArray, seed: int) -> None:
        self.system, self.presence = system, Presence(system, cells, front_m)
        self.environment = simpy.Environment()
        self.network = Network(self.environment, system, cells.size, len(front_m))
        self.units = [RadioUnit(self.network, number, seed) for number in range(cells.size)]
        self.commands: list[RadioCommand] = []
        for unit in self.units:
            self.environment.process(unit.serve(partial(self._made_by_unit, unit)))
        if system.central:
            self.environment.process(self._control())

    def _control(self) -> Process:
        """Send a packet to every radio unit in every update."""
        room = self.system.telegrams_per_packet - self.system.broadcasts_per_update
        for update in range(self.network.updates):
            for unit in self.units:
                made = self._made(update, unit)
                # What the packet has no room for never arrives.
                self.network.forward(
                    self.network.to_switch,
                    self.network.to_unit[unit.number],
                    partial(unit.receive, made[:room]),
                )
            yield self.environment.timeout(
                (update + 1) * self.system.update_s - self.environment.now
            )

    def _made(self, update: int, unit: RadioUnit) -> list[RadioCommand]:
        made = self.presence.commands(update, unit.number, self.environment.now)
        self.commands += made
        return made

    def _made_by_unit(self, unit: RadioUnit, update: int) -> list[RadioCommand]:
        for other in self.presence.shared(update, unit.number):
            link = self.network.from_unit[unit.number]
            self.network.forward(link, self.network.to_unit[other], lambda: None)
        return self._made(update, unit)

    def traffic(self, seconds: int) -> Traffic:
        """
        Return what has happened.

        Parameters
        ----------
        seconds
            For how many seconds links are measured. [-]

        Returns
        -------
        Traffic
            All commands and links.
        """
        channels = self.network.channels()
        for unit in self.units:
            channels[LinkName(Link.ANTENNA_TRAIN, unit.number)] = unit.down
            channels[LinkName(Link.TRAIN_ANTENNA, unit.number)] = unit.up
        order = sorted(channels, key=lambda link: (list(Link).index(link.kind), link.cell or 0))
        made = self.commands
        return Traffic(
            links=tuple(order),
            busy=np.array([channels[link].busy_shares(seconds) for link in order]),
            made_s=np.array([command.made_s for command in made]),
            arrived_s=np.array([command.arrived_s for command in made]),
            returned_s=np.array([command.returned_s for command in made]),
            cell=np.array([command.cell for command in made], dtype=np.intp),
            to_train=np.array([command.device >= 0 for command in made], dtype=bool),
            tries=np.array([command.tries for command in made], dtype=np.intp),
        )


def simulate(
    system: RadioSystem,
    cells: Cells,
    front_m: FloatArray,
    seed: int,
    progress: Callable[[float], None] = lambda _: None,
) -> Traffic:
    """
    Simulate the radio traffic of trains on their way.

    Parameters
    ----------
    system
        How commands reach trains.
    cells
        Where radio units are.
    front_m
        Fronts at the beginning of each update; not a number for trains off the line.
        [m], shape (n_updates, n_trains)
    seed
        Seed of the losses. [-]
    progress
        Called with the simulated time now and then. [s]

    Returns
    -------
    Traffic
        Links over time, and every command.
    """
    simulation = RadioSimulation(system, cells, front_m, seed)
    end_s = len(front_m) * system.update_s
    for until_s in np.append(np.arange(REPORT_S, end_s, REPORT_S), end_s).tolist():
        simulation.environment.run(until_s)
        progress(until_s)
    simulation.environment.run(end_s + DRAIN_S)
    return simulation.traffic(int(end_s + 1e-9))
