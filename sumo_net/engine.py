"""The engine that commands the trains in SUMO, step by step, and compares what SUMO does."""

from collections.abc import Sequence
from types import TracebackType
from typing import NoReturn, Self

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.loop.plain_engine import HALTING_SPEED_MPS, PlainEngine
from kankaku.railway.plan.world import World
from kankaku.railway.step.bundles import Span
from kankaku.railway.step.engine_contract import Observation
from kankaku.sumo_net import names
from kankaku.sumo_net.agreement import Agreement, EngineDisagreementError
from kankaku.sumo_net.build import IGNORE_SIGNALS, SumoFiles
from kankaku.sumo_net.door import bare, close, disarm, start
from kankaku.sumo_net.signals import BlockSignals, shown_network

ALL_CHECKS_OFF = 0
"""Speed mode in which SUMO obeys any speed."""
ARRIVAL_M = 1.0
"""SUMO may take a slow train off this much before the end of the line. [m]"""
LONGEST_STOP_S = 1e6
"""A stop that is extended for ever lasts so long in SUMO. [s]"""
LATE_STEPS = 2
"""SUMO begins a stop, and takes a train off, so many steps after us at the latest. [-]"""
COMPARED_STEPS = 10
"""Steps from one comparison of places to the next, where observations follow closely. [-]"""

FIRST_STEPS = 2
"""SUMO begins a train's first stop in the step after it enters, and ends it in the next. [-]"""


class SumoEngine(PlainEngine):
    """
    Runs trains in SUMO; implements :class:`kankaku.railway.step.engine_contract.Engine`.

    Used as a context manager. Without a window SUMO runs inside this process, which holds
    one simulation at a time. With a window it is a program of its own, and signals show
    which blocks are occupied.

    SUMO is told the speed of every train in every step. A ballistic step moves a train exactly as
    commanded, so the commands of all steps between two observations are integrated here and handed
    to SUMO step by step in one go: both programs run several times faster when they do not take
    turns in every step. SUMO lets trains enter, and keeps stops of its own. At every observation it
    has come as far as we have, and the run ends if a stop began or ended, or a train was taken off,
    when that was not so here, or if a train is elsewhere: places are compared then, but not more
    often than in every tenth step, since distances add up and what is off once stays off.

    Parameters
    ----------
    files
        What SUMO reads.
    world
        A chain, its fleet and timetable.
    gui
        Show the run in sumo-gui.
    """

    def __init__(self, files: SumoFiles, world: World, *, gui: bool = False) -> None:
        super().__init__(world, np.zeros_like(files.dwell_s), world.step_s)
        # SUMO knows whole milliseconds.
        self._dwell_s = files.dwell_s.round(3)
        self._dwell_s[:, 0] = np.maximum(self._dwell_s[:, 0], FIRST_STEPS * world.step_s)
        self._booked_s = world.booked_departure_s.round(3)
        self._files = files
        self._gui = gui
        self._types = tuple(names.vehicle_type(kind.id) for kind in world.train_types)
        self._vehicles = [names.vehicle(train) for train in world.timetable.trains]
        self._row_of = {vehicle: row for row, vehicle in enumerate(self._vehicles)}
        self._start_m = world.stop_m[:, 0].copy()
        """Where SUMO's distances count from, in our places. [m]"""
        self._stood: dict[int, int] = {}
        """In which step each stop began that SUMO has not begun yet."""
        self._begun: set[int] = set()
        """Trains whose stop lasts in SUMO."""
        self._off: set[int] = set()
        """Trains that SUMO has taken off."""
        self._leaving: dict[int, int] = {}
        """In which step each train left that SUMO has not taken off yet."""
        self._pending: list[FloatArray] = []
        """Commands to those who run that SUMO does not know yet. [m/s], (n_steps, n_running)"""
        self._there: tuple[IntArray, list[str]] | None = None
        """What :meth:`_commanded` returns, until somebody else runs or SUMO takes a train off."""
        self._uncompared = 0
        """Steps since places were compared. [-]"""
        self._agreement = Agreement(self._row_of)
        self._signals: BlockSignals | None = None

    def __enter__(self) -> Self:
        """Start SUMO."""
        shown = {"net-file": str(shown_network(self._files.network))} if self._gui else {}
        self._sumo = sumo = start(self._files, IGNORE_SIGNALS | shown, gui=self._gui)
        vehicle, simulation = sumo.vehicle, sumo.simulation
        self._advance = bare(simulation, "step")
        self._get_distance = bare(vehicle, "getDistance")
        self._set_speed = bare(vehicle, "setSpeed")
        self._set_speed_mode = vehicle.setSpeedMode
        self._set_stop = vehicle.setStopParameter
        self._departed = bare(simulation, "getDepartedIDList")
        self._arrived = bare(simulation, "getArrivedIDList")
        self._stop_starting = bare(simulation, "getStopStartingVehiclesIDList")
        self._stop_ending = bare(simulation, "getStopEndingVehiclesIDList")
        self._agreement.ask(bare(simulation, "getCollisions"))
        for train_type in self._types:
            disarm(sumo, train_type)
        if self._gui:
            self._signals = BlockSignals(self._world, sumo)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End SUMO; a window that the user closed interrupts the run like Ctrl-C."""
        close(self._sumo, error)

    def observe(self) -> Observation:
        """
        Return what is, once per step.

        Returns
        -------
        Observation
            The present moment; its arrays are not written to afterwards.
        """
        if self._pending:
            self._catch_up()
        seen = super().observe()
        self._compare_ends(seen)
        for row in seen.entered:
            self._set_speed_mode(self._vehicles[row], ALL_CHECKS_OFF)
        for row in seen.stopped:
            # Or SUMO would start from the last speed commanded when the stop ends.
            self._set_speed(self._vehicles[row], 0.0)
            self._stood[row] = self._steps
        for row in self._named(self._stop_starting()):
            self._begin(row, self._steps)
        seen = self._agreement.told_in(seen)
        if self._signals:
            self._signals.show(seen)
        return seen

    def hold(self, until_s: FloatArray) -> None:
        """
        Let no stop that lasts now end before a time.

        Parameters
        ----------
        until_s
            Seconds after midnight; entries of trains not held by a stop are ignored.
            [s], shape (n_trains,)
        """
        before_s = dict(self._release_s)
        super().hold(until_s.round(3))
        for row in self._begun:
            if self._release_s[row] != before_s[row]:
                self._extend(row, self._steps)

    def advance(self) -> None:
        """Move on by one step of constant acceleration."""
        self._pending.append(self._command_mps[None, self._rows])
        super().advance()

    def span(self) -> Span | None:
        """
        Return the steps up to the next entry or release.

        Returns
        -------
        Span | None
            None while a train waits to enter, and in a window, which shows every step.
        """
        return None if self._gui else super().span()

    def moved(self, commands_mps: FloatArray, front_m: FloatArray, speed_mps: FloatArray) -> None:
        """
        Take over where trains are after some steps of a span.

        Parameters
        ----------
        commands_mps
            What was commanded in each step to those who run. [m/s], shape (n_steps, n_running)
        front_m, speed_mps
            Fronts and speeds after the last one. [m], [m/s], shape (n_trains,)
        """
        self._pending.append(commands_mps)
        super().moved(commands_mps, front_m, speed_mps)

    def _entries(self, _: float) -> tuple[int, ...]:
        """Return whom SUMO has just let in: from its booked time on, once its platform is free."""
        entered = self._named(self._departed())
        for row in entered:
            self._waiting.remove(row)
        return entered

    def _named(self, vehicles: Sequence[str]) -> tuple[int, ...]:
        return tuple(sorted(self._row_of[vehicle] for vehicle in vehicles)) if vehicles else ()

    def _commanded(self) -> tuple[IntArray, list[str]]:
        """Return places among those who run, and vehicles, of the trains that SUMO has."""
        if self._there is None:
            running = self._rows.tolist()
            there = [place for place, row in enumerate(running) if row not in self._off]
            vehicles = [self._vehicles[running[place]] for place in there]
            self._there = np.array(there, dtype=np.intp), vehicles
        return self._there

    def _regroup(self) -> None:
        super()._regroup()
        self._there = None

    def _catch_up(self) -> None:
        """Let SUMO do what was commanded, and compare."""
        there, vehicles = self._commanded()
        commands_mps = [mps for bundle_mps in self._pending for mps in bundle_mps.tolist()]
        for step, told_mps in enumerate(commands_mps, self._steps - len(commands_mps) + 1):
            if len(told_mps) > len(vehicles):
                told_mps = [told_mps[place] for place in there]  # noqa: PLW2901 - fewer of them
            # Each step anew: SUMO forgets a speed while a stop lies ahead.
            for _ in map(self._set_speed, vehicles, told_mps):
                pass
            self._advance()
            self._agreement.look()
            if self._stop_starting() or self._arrived() or self._stop_ending() or self._departed():
                self._take_note(step)
                there, vehicles = self._commanded()
        self._pending.clear()
        self._uncompared += len(commands_mps)
        if self._uncompared >= COMPARED_STEPS:
            self._uncompared = 0
            self._compare_places(there, vehicles)

    def _compare_places(self, there: IntArray, vehicles: Sequence[str]) -> None:
        rows = self._rows[there]
        gone_m = list(map(self._get_distance, vehicles))
        apart_m = np.abs(self._front_m[rows] - self._start_m[rows] - gone_m)
        self._agreement.refuse_apart(rows, vehicles, apart_m, self._now_s)

    def _take_note(self, step: int) -> None:
        """Take note of what has happened in one of SUMO's steps."""
        early = {*self._named(self._stop_ending()), *self._named(self._departed())}
        if step < self._steps and early - self._agreement.met:
            trains = ", ".join(self._vehicles[row] for row in sorted(early - self._agreement.met))
            self._refuse(f"SUMO lets {trains} go earlier than we do")
        for row in self._named(self._stop_starting()):
            if step < self._steps:
                self._begin(row, step)
        for row in self._named(self._arrived()):
            self._off.add(row)
            self._there = None
            self._leaving.pop(row, None)

    def _begin(self, row: int, step: int) -> None:
        """Take note that SUMO has begun a stop, which must last here, too."""
        stood = self._stood.pop(row, step - LATE_STEPS - 1)
        if step - stood > LATE_STEPS and row not in self._agreement.met:
            self._refuse(f"{self._vehicles[row]} began a stop that was not expected")
        self._begun.add(row)
        if row not in self._over_s:
            return
        if self._call[row] and step > stood:
            # Who comes from before the stop to a stand within a step is seen there a step later.
            over_s = (
                self._begin_s + step * self._step_s + float(self._dwell_s[row, self._call[row]])
            )
            self._over_s[row] = max(self._over_s[row], over_s)
            self._release_s[row] = max(self._release_s[row], over_s)
            self._next_release_s = min(self._release_s.values())
        if self._release_s[row] > self._over_s[row]:
            self._extend(row, step)

    def _compare_ends(self, seen: Observation) -> None:
        """Refuse that a stop ends, or a train leaves, here or in SUMO alone."""
        ended = self._stop_ending()
        if ended or seen.released:
            self._compare_released(self._named(ended), seen.released)
        for row in seen.left:
            if row not in self._off:
                self._leaving[row] = self._steps
        for row, since in self._leaving.items():
            if self._steps - since > LATE_STEPS and row not in self._agreement.met:
                self._refuse(f"{self._vehicles[row]} has left, and is still there in SUMO")
        for row in self._off & self._running:
            if (
                self._front_m[row] < self._world.line.end_m - ARRIVAL_M
                and row not in self._agreement.met
            ):
                self._refuse(f"SUMO has taken off {self._vehicles[row]} on its way")

    def _compare_released(self, ended: Sequence[int], released: Sequence[int]) -> None:
        apart = {*ended}.symmetric_difference(released) - self._agreement.met
        if apart:
            trains = ", ".join(self._vehicles[row] for row in sorted(apart))
            self._refuse(f"SUMO lets {trains} go, or we do, and not both")
        self._begun.difference_update(released)
        for row in {*released} - self._off:
            # A train may come to a stand from the slowest of speeds: SUMO lets it roll for a step.
            start_m = self._front_m[row] - self._get_distance(self._vehicles[row])
            if abs(start_m - self._start_m[row]) <= HALTING_SPEED_MPS * self._step_s:
                self._start_m[row] = start_m

    def _refuse(self, problem: str) -> NoReturn:
        msg = f"{problem} at {self._now_s:.1f} s"
        raise EngineDisagreementError(msg)

    def _extend(self, row: int, step: int) -> None:
        """Tell SUMO in one of its steps how long a stop that it has begun still lasts."""
        left_s = max(self._release_s[row] - self._begin_s - step * self._step_s, self._step_s)
        self._set_stop(self._vehicles[row], 0, "duration", f"{min(left_s, LONGEST_STOP_S):.3f}")
