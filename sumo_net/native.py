"""SUMO as a peer: its own rail model and signals drive the trains, and are only looked at."""

from collections.abc import Iterable
from types import TracebackType
from typing import NamedTuple, Self

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.world import World
from kankaku.railway.step.engine_contract import Observation
from kankaku.sumo_net import names
from kankaku.sumo_net.build import SumoFiles
from kankaku.sumo_net.door import close, start


class PeerError(RuntimeError):
    """SUMO did what makes its run worthless: it left out a booked stop."""


class _Moment(NamedTuple):
    """What SUMO reports after a step."""

    front_m: FloatArray
    speed_mps: FloatArray
    entered: frozenset[int] = frozenset()
    stopped: frozenset[int] = frozenset()
    started: frozenset[int] = frozenset()
    """Trains whose stop ended in the step; they have moved in it."""
    left: frozenset[int] = frozenset()
    collided: frozenset[int] = frozenset()


class NativeEngine:
    """
    Lets SUMO drive the trains; commands are ignored.

    Implements :class:`kankaku.railway.step.engine_contract.Engine` but for its commands and for the
    time at which a train enters, which follows SUMO's own rules. Used as a context manager. SUMO is
    one step ahead of what is observed, because only the movement of a train tells that its stop is
    over.

    An Euler step moves a train at its new speed. That is constant acceleration, half a step
    early: places are reported as ``x - v dt / 2``, so that places and speeds agree with each
    other as in every other run, and the account of energy closes.
    """

    def __init__(self, files: SumoFiles, world: World, *, gui: bool = False) -> None:
        self._files = files
        self._gui = gui
        self._step_s = world.step_s
        self._end_m = world.line.end_m
        self._call_count = world.call_count
        self._leaves_at_stop = frozenset(np.flatnonzero(world.leaves_at_stop).tolist())
        self._vehicles = [names.vehicle(train) for train in world.timetable.trains]
        self._row_of = {vehicle: row for row, vehicle in enumerate(self._vehicles)}
        self._origin_m = world.stop_m[:, 0].copy()
        self._running: frozenset[int] = frozenset()
        self._at_origin: frozenset[int] = frozenset()
        """Trains whose first stop has begun, which SUMO has not reported yet."""
        self._stops_made = np.zeros(world.size, dtype=np.intp)
        self._colliding: frozenset[int] = frozenset()
        # Whole milliseconds, as SUMO counts: a sum of steps would drift.
        self._begin_ms = round(files.begin_s * 1000.0)
        self._step_ms = round(world.step_s * 1000.0)
        self._steps = 0
        self._now = _Moment(self._origin_m, np.zeros(world.size))

    def __enter__(self) -> Self:
        """Start SUMO."""
        self._sumo = start(self._files, {}, gui=self._gui)
        self._next = self._step()
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
        now = self._now
        # SUMO takes off who ends at a stop in the step in which the stop ends.
        ended = self._next.left & self._leaves_at_stop
        left = (now.left - self._leaves_at_stop) | ended
        events = (now.entered, now.stopped, self._next.started, left, now.collided)
        time_s = (self._begin_ms + self._steps * self._step_ms) / 1000.0
        return Observation(
            time_s, now.front_m, now.speed_mps, *(tuple(sorted(rows)) for rows in events)
        )

    def apply(self, speed_mps: FloatArray) -> None:
        """
        Ignore what is commanded.

        Parameters
        ----------
        speed_mps
            Not used. [m/s], shape (n_trains,)
        """

    def hold(self, until_s: FloatArray) -> None:
        """
        Refuse to extend stops: SUMO itself drives the trains.

        Parameters
        ----------
        until_s
            Not used. [s], shape (n_trains,)

        Raises
        ------
        NotImplementedError
            Always.
        """
        del until_s
        msg = "SUMO drives the trains of a peer: nobody can hold them at platforms"
        raise NotImplementedError(msg)

    def advance(self) -> None:
        """Move on by one step."""
        self._steps += 1
        self._now = self._next
        self._next = self._step()

    def _step(self) -> _Moment:
        """Let SUMO do the step after the last moment read."""
        simulation = self._sumo.simulation
        self._sumo.simulationStep()
        entered = self._rows(simulation.getDepartedIDList())
        begun = self._rows(simulation.getStopStartingVehiclesIDList())
        started = self._rows(simulation.getStopEndingVehiclesIDList())
        left = self._rows(simulation.getArrivedIDList())
        # A train enters standing at its first stop, which SUMO begins one step later.
        stopped = entered | (begun - self._at_origin)
        self._at_origin = (self._at_origin - begun) | entered
        self._running = (self._running | started) - left
        front_m, speed_mps = self._read(stopped, left)
        self._running -= stopped
        self._stops_made[list(started)] += 1
        for row in left:
            if self._stops_made[row] < self._call_count[row]:
                train = self._vehicles[row]
                msg = f"SUMO ran {train} past a booked stop; its brakes are weaker on descents"
                raise PeerError(msg)
        colliding = self._rows(
            [train for met in simulation.getCollisions() for train in (met.collider, met.victim)]
        )
        collided, self._colliding = colliding - self._colliding, colliding
        return _Moment(front_m, speed_mps, entered, stopped, started, left, collided)

    def _read(self, stopped: frozenset[int], left: frozenset[int]) -> tuple[FloatArray, FloatArray]:
        front_m, speed_mps = self._now.front_m.copy(), self._now.speed_mps.copy()
        vehicle = self._sumo.vehicle
        for row in self._running:
            train = self._vehicles[row]
            # A stop takes the last bit of speed away.
            speed_mps[row] = 0.0 if row in stopped else vehicle.getSpeed(train)
            lead_m = 0.5 * self._step_s * speed_mps[row]
            front_m[row] = self._origin_m[row] + vehicle.getDistance(train) - lead_m
        front_m[list(left)] = self._end_m
        speed_mps[list(left)] = 0.0
        return front_m, speed_mps

    def _rows(self, vehicles: Iterable[str]) -> frozenset[int]:
        return frozenset(self._row_of[vehicle] for vehicle in vehicles)
