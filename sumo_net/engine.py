"""The only place that talks to a running SUMO."""

import importlib
from types import TracebackType
from typing import Any, Self

import numpy as np

from railway.arrays import FloatArray
from railway.engine import Observation
from railway.world import World
from sumo_net import names
from sumo_net.build import IGNORE_SIGNALS, SumoFiles, sumo_binary
from sumo_net.plain_xml import STOP_TOLERANCE_M

HALTING_SPEED_MPS = 0.1
"""SUMO begins a stop at this speed or less, and the train comes to a stand. [m/s]"""
ALL_CHECKS_OFF = 0
"""Speed mode in which SUMO obeys any speed."""
UNLIMITED_MPS2 = 1000.0
"""More than any brake rate that a command can ask for. [m/s2]"""
GUI_DELAY_MS = 20
"""Wall time that sumo-gui spends on a step at least. [ms]"""


class SumoEngine:
    """
    Runs trains in SUMO; implements :class:`railway.engine.Engine`.

    Used as a context manager. Without a window SUMO runs inside this process, which holds
    one simulation at a time, and a train enters as soon as its platform is free. With a
    window signals show their aspects, and then SUMO lets a train enter only when the block
    of its origin is free, too.
    """

    def __init__(self, files: SumoFiles, world: World, *, gui: bool = False) -> None:
        self._files = files
        self._gui = gui
        self._end_m = world.line.end_m
        self._types = tuple(names.vehicle_type(kind.id) for kind in world.train_types)
        vehicles = [names.vehicle(train) for train in world.timetable.trains]
        self._row_of = {vehicle: row for row, vehicle in enumerate(vehicles)}
        self._origin_m = world.stop_m[:, 0].copy()
        self._front_m = self._origin_m
        self._speed_mps = np.zeros(world.size)
        self._vehicles = vehicles
        self._stops_m: list[list[float]] = world.stop_m.tolist()
        self._call = [0] * world.size
        self._running: set[int] = set()
        self._regroup()
        self._colliding: frozenset[int] = frozenset()
        # Whole milliseconds, as SUMO counts: a sum of steps would drift.
        self._begin_ms = round(files.begin_s * 1000.0)
        self._step_ms = round(world.step_s * 1000.0)
        self._steps = 0

    def __enter__(self) -> Self:
        """Start SUMO."""
        sumo = _library(gui=self._gui)
        sumo.start(self._command())
        vehicle, simulation = sumo.vehicle, sumo.simulation
        self._close = sumo.close
        self._advance = sumo.simulationStep if self._gui else simulation.step
        self._get_distance = vehicle.getDistance
        self._get_speed = vehicle.getSpeed
        self._set_speed = vehicle.setSpeed
        self._set_speed_mode = vehicle.setSpeedMode
        self._departed = simulation.getDepartedIDList
        self._arrived = simulation.getArrivedIDList
        self._stop_starting = simulation.getStopStartingVehiclesIDList
        self._stop_ending = simulation.getStopEndingVehiclesIDList
        self._collisions = simulation.getCollisions
        for train_type in self._types:
            disarm(sumo, train_type)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End SUMO."""
        self._close()

    def _command(self) -> list[str]:
        options = ["-c", str(self._files.config), "--no-warnings"]
        if self._gui:
            window = ["--start", "--quit-on-end", f"--delay={GUI_DELAY_MS}"]
            return [str(sumo_binary("sumo-gui")), *options, *window]
        ignored = [f"--{option}={value}" for option, value in IGNORE_SIGNALS.items()]
        return ["sumo", *options, *ignored]

    def observe(self) -> Observation:
        """
        Return what is, once per step.

        Returns
        -------
        Observation
            The present moment; its arrays are not written to afterwards.
        """
        left = self._rows(self._arrived())
        entered = self._rows(self._departed())
        begun = self._rows(self._stop_starting())
        released = self._rows(self._stop_ending())
        if left or entered or released:
            self._take_up(left, entered, released)
        halted = self._read()
        stopped: tuple[int, ...] = ()
        if begun or halted:
            stopped = self._hold(begun)
        if left:
            # Only now, so that earlier observations stay as they were.
            self._front_m[list(left)] = self._end_m
            self._speed_mps[list(left)] = 0.0
        return Observation(
            (self._begin_ms + self._steps * self._step_ms) / 1000.0,
            self._front_m,
            self._speed_mps,
            entered,
            stopped,
            released,
            left,
            self._new_collisions(),
        )

    def _rows(self, vehicles: tuple[str, ...]) -> tuple[int, ...]:
        if not vehicles:
            return ()
        return tuple(sorted(self._row_of[vehicle] for vehicle in vehicles))

    def _take_up(
        self, left: tuple[int, ...], entered: tuple[int, ...], released: tuple[int, ...]
    ) -> None:
        for row in entered:
            self._set_speed_mode(self._vehicles[row], ALL_CHECKS_OFF)
        for row in released:
            self._call[row] += 1
        self._running |= {*entered, *released}
        self._running -= set(left)
        self._regroup()

    def _regroup(self) -> None:
        rows = sorted(self._running)
        self._rows_running = np.array(rows, dtype=np.intp)
        self._vehicles_running = [self._vehicles[row] for row in rows]
        self._origins_m = self._origin_m[rows]

    def _read(self) -> bool:
        """Read the running trains, and return whether any of them stands."""
        self._front_m, self._speed_mps = self._front_m.copy(), self._speed_mps.copy()
        running = self._vehicles_running
        if not running:
            return False
        speeds_mps: list[float] = list(map(self._get_speed, running))
        self._front_m[self._rows_running] = self._origins_m + list(map(self._get_distance, running))
        self._speed_mps[self._rows_running] = speeds_mps
        return min(speeds_mps) <= HALTING_SPEED_MPS

    def _hold(self, begun: tuple[int, ...]) -> tuple[int, ...]:
        # SUMO begins a stop in the step after the train came to a stand; the stop is
        # reported at once, and then not again.
        stopped = {row for row in begun if row in self._running}
        for row in begun:
            distance_m = self._get_distance(self._vehicles[row])
            self._front_m[row] = self._origin_m[row] + distance_m
        for row in self._running:
            off_m = abs(self._front_m[row] - self._stops_m[row][self._call[row]])
            if self._speed_mps[row] <= HALTING_SPEED_MPS and off_m <= STOP_TOLERANCE_M:
                stopped.add(row)
        if stopped:
            self._running -= stopped
            self._speed_mps[list(stopped)] = 0.0
            self._regroup()
        return tuple(sorted(stopped))

    def _new_collisions(self) -> tuple[int, ...]:
        collisions = self._collisions()
        if not collisions and not self._colliding:
            return ()
        pairs = [(collision.collider, collision.victim) for collision in collisions]
        colliding = frozenset(self._row_of[train] for pair in pairs for train in pair)
        fresh = colliding - self._colliding
        self._colliding = colliding
        return tuple(sorted(fresh))

    def apply(self, speed_mps: FloatArray) -> None:
        """
        Command the speed at the end of the next step for every train not held by a stop.

        Parameters
        ----------
        speed_mps
            Next speeds; entries of other trains are ignored. [m/s], shape (n_trains,)
        """
        # Each step anew: SUMO forgets a speed while a stop lies ahead.
        commands = speed_mps.take(self._rows_running).tolist()
        for _ in map(self._set_speed, self._vehicles_running, commands):
            pass

    def advance(self) -> None:
        """Move on by one step of constant acceleration."""
        self._advance()
        self._steps += 1


def disarm(sumo: Any, train_type: str) -> None:  # noqa: ANN401
    """
    Take from SUMO's own model what it would do to a train beside our commands.

    A train that cannot accelerate stands still where no command reaches it: when it enters
    and when its stop ends. A train that can brake at any rate comes to its stand in the
    step commanded, although SUMO takes over in the step in which the stop begins.

    Parameters
    ----------
    sumo
        The running simulation.
    train_type
        Identifier of the vehicle type.
    """
    sumo.vehicletype.setAccel(train_type, 0.0)
    sumo.vehicletype.setEmergencyDecel(train_type, UNLIMITED_MPS2)
    sumo.vehicletype.setDecel(train_type, UNLIMITED_MPS2)


def _library(*, gui: bool) -> Any:  # noqa: ANN401
    # The package that ships the programs tells SUMO where its data is.
    importlib.import_module("sumo")
    return importlib.import_module("traci" if gui else "libsumo")
