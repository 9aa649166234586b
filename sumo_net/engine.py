"""The engine that commands the trains in SUMO."""

from types import TracebackType
from typing import Self

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.world import World
from kankaku.railway.step.bundles import Span
from kankaku.railway.step.engine_contract import Observation
from kankaku.sumo_net import names
from kankaku.sumo_net.build import IGNORE_SIGNALS, SumoFiles
from kankaku.sumo_net.door import bare, close, disarm, start
from kankaku.sumo_net.edge_cuts import STOP_TOLERANCE_M
from kankaku.sumo_net.signals import BlockSignals, shown_network

HALTING_SPEED_MPS = 0.1
"""SUMO begins a stop at this speed or less, and the train comes to a stand. [m/s]"""
ALL_CHECKS_OFF = 0
"""Speed mode in which SUMO obeys any speed."""
RUN_AHEAD_S = 2.0
"""SUMO is this much behind at most. [s]"""
AGREEMENT_M = 1e-3
"""SUMO and the integration of our commands may differ by rounding only. [m]"""
ARRIVAL_M = 1.0
"""SUMO may take a slow train off this much before the end of the line. [m]"""
LONGEST_STOP_S = 1e6
"""A stop that is extended for ever lasts so long in SUMO. [s]"""
ALERT_STEPS = 3
"""SUMO reports an event up to two steps late; so long it is asked in every step."""


class EngineDisagreementError(RuntimeError):
    """SUMO did something else than it was told, or when it was not expected to."""


class SumoEngine:
    """
    Runs trains in SUMO; implements :class:`kankaku.railway.step.engine_contract.Engine`.

    Used as a context manager. Without a window SUMO runs inside this process, which holds
    one simulation at a time. With a window it is a program of its own, and signals show
    which blocks are occupied.

    A ballistic step moves a train exactly as commanded, so between events the commands of
    up to two seconds are integrated here and then handed to SUMO step by step in one go: both
    programs run several times faster when they do not take turns in every step. SUMO's
    places are compared with the integrated ones each time, and around events, which SUMO
    alone decides, it is asked in every step.
    """

    def __init__(self, files: SumoFiles, world: World, *, gui: bool = False) -> None:
        self._files = files
        self._world = world
        self._gui = gui
        self._step_s = world.step_s
        self._end_m = world.line.end_m
        self._types = tuple(names.vehicle_type(kind.id) for kind in world.train_types)
        vehicles = [names.vehicle(train) for train in world.timetable.trains]
        self._row_of = {vehicle: row for row, vehicle in enumerate(vehicles)}
        self._origin_m = world.stop_m[:, 0].copy()
        self._front_m = self._origin_m
        self._speed_mps = np.zeros(world.size)
        self._vehicles = vehicles
        self._stops_m = world.stop_m
        self._booked_departure_s = world.booked_departure_s
        self._call = [0] * world.size
        self._running: set[int] = set()
        self._due_s = dict(enumerate(world.booked_arrival_s[:, 0].tolist()))
        """When each train that is not running will enter or be released at the earliest."""
        self._over_s: dict[int, float] = {}
        """When each stop that lasts now is over of itself."""
        self._begun: set[int] = set()
        """Trains whose stop SUMO has begun: a step after they came to a stand."""
        self._regroup()
        self._colliding: frozenset[int] = frozenset()
        self._collided: set[int] = set()
        # Whole milliseconds, as SUMO counts: a sum of steps would drift.
        self._begin_ms = round(files.begin_s * 1000.0)
        self._step_ms = round(world.step_s * 1000.0)
        self._steps = 0
        self._pending: list[FloatArray] = []
        self._most_pending = 1 if gui else max(1, round(RUN_AHEAD_S / world.step_s))
        self._alert_until = ALERT_STEPS
        self._commands_mps = self._speed_mps
        self._signals: BlockSignals | None = None

    def __enter__(self) -> Self:
        """Start SUMO."""
        shown = {"net-file": str(shown_network(self._files.network))} if self._gui else {}
        self._sumo = sumo = start(self._files, IGNORE_SIGNALS | shown, gui=self._gui)
        vehicle, simulation = sumo.vehicle, sumo.simulation
        self._advance = bare(simulation, "step")
        self._get_distance = bare(vehicle, "getDistance")
        self._get_speed = bare(vehicle, "getSpeed")
        self._set_speed = bare(vehicle, "setSpeed")
        self._set_speed_mode = vehicle.setSpeedMode
        self._set_stop = vehicle.setStopParameter
        self._departed = bare(simulation, "getDepartedIDList")
        self._arrived = bare(simulation, "getArrivedIDList")
        self._stop_starting = bare(simulation, "getStopStartingVehiclesIDList")
        self._stop_ending = bare(simulation, "getStopEndingVehiclesIDList")
        self._collisions = bare(simulation, "getCollisions")
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
        time_s = self._time_s
        if self._pending:
            return Observation(time_s, self._front_m, self._speed_mps)
        left = self._rows(self._arrived())
        entered = self._rows(self._departed())
        begun = self._rows(self._stop_starting())
        released = self._rows(self._stop_ending())
        if left or entered or released:
            self._take_up(left, entered, released)
        halted = self._read()
        stopped: tuple[int, ...] = ()
        if begun or halted:
            stopped = self._stop(begun)
        if left:
            # Only now, so that earlier observations stay as they were.
            self._front_m[list(left)] = self._end_m
            self._speed_mps[list(left)] = 0.0
        if left or entered or begun or released or stopped:
            self._alert_until = self._steps + ALERT_STEPS
        collided, self._collided = tuple(sorted(self._collided)), set()
        seen = Observation(
            time_s, self._front_m, self._speed_mps, entered, stopped, released, left, collided
        )
        if self._signals:
            self._signals.show(seen)
        return seen

    @property
    def _time_s(self) -> float:
        return (self._begin_ms + self._steps * self._step_ms) / 1000.0

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
        for row in (*entered, *released):
            self._due_s.pop(row, None)
            self._over_s.pop(row, None)
        self._begun -= set(released)
        self._running |= {*entered, *released}
        self._running -= set(left)
        self._regroup()

    def _regroup(self) -> None:
        """Take note of who is running, after an event."""
        rows = sorted(self._running)
        self._rows_running = np.array(rows, dtype=np.intp)
        self._vehicles_running = [self._vehicles[row] for row in rows]
        self._origins_m = self._origin_m[rows]
        self._aims_m = np.array([self._stops_m[row, self._call[row]] for row in rows])
        self._ends_m = np.full(len(rows), self._end_m)
        self._nowhere_m = np.full(len(rows), np.inf)
        self._next_due_s = min(self._due_s.values(), default=np.inf)

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

    def _stop(self, begun: tuple[int, ...]) -> tuple[int, ...]:
        # SUMO begins a stop in the step after the train came to a stand; the stop is
        # reported at once, and then not again.
        stopped = {row for row in begun if row in self._running}
        for row in begun:
            distance_m = self._get_distance(self._vehicles[row])
            self._front_m[row] = self._origin_m[row] + distance_m
        for row in self._running:
            off_m = abs(self._front_m[row] - self._stops_m[row, self._call[row]])
            if self._speed_mps[row] <= HALTING_SPEED_MPS and off_m <= STOP_TOLERANCE_M:
                stopped.add(row)
        if stopped:
            for row in stopped:
                # Or SUMO would start from the last speed commanded when the stop ends.
                self._set_speed(self._vehicles[row], 0.0)
                call = self._call[row]
                until_s = self._time_s + self._files.dwell_s[row, call]
                over_s = max(self._booked_departure_s[row, call], until_s)
                self._over_s[row] = self._due_s[row] = over_s
            self._running -= stopped
            self._speed_mps[list(stopped)] = 0.0
            self._regroup()
        self._begun |= set(begun)
        for row in begun:
            if self._due_s[row] > self._over_s[row]:
                self._extend(row)
        return tuple(sorted(stopped))

    def hold(self, until_s: FloatArray) -> None:
        """
        Let no stop that lasts now end before a time.

        Parameters
        ----------
        until_s
            Seconds after midnight; entries of trains not held by a stop are ignored.
            [s], shape (n_trains,)
        """
        for row, over_s in self._over_s.items():
            due_s = max(over_s, float(until_s[row]))
            if due_s != self._due_s[row]:
                self._due_s[row] = due_s
                if row in self._begun:
                    self._extend(row)
        self._next_due_s = min(self._due_s.values(), default=np.inf)

    def _extend(self, row: int) -> None:
        """Tell SUMO how long a stop that it has begun still lasts."""
        # SUMO counts from where it is, which may be some steps behind.
        left_s = max(self._due_s[row] - self._time_s, self._step_s)
        left_s = min(left_s, LONGEST_STOP_S) + len(self._pending) * self._step_s
        self._set_stop(self._vehicles[row], 0, "duration", f"{left_s:.3f}")

    def apply(self, speed_mps: FloatArray) -> None:
        """
        Command the speed at the end of the next step for every train not held by a stop.

        Parameters
        ----------
        speed_mps
            Next speeds; entries of other trains are ignored. [m/s], shape (n_trains,)
        """
        self._commands_mps = speed_mps.copy()

    def advance(self) -> None:
        """Move on by one step of constant acceleration."""
        self._front_m, self._speed_mps = self._front_m.copy(), self._speed_mps.copy()
        rows, commands_mps = self._rows_running, self._commands_mps[self._rows_running]
        self._pending.append(commands_mps)
        self._front_m[rows] += 0.5 * (self._speed_mps[rows] + commands_mps) * self._step_s
        self._speed_mps[rows] = commands_mps
        self._steps += 1
        self._look_out()

    def span(self) -> Span | None:
        """
        Return the steps up to where SUMO has to be asked.

        Returns
        -------
        Span | None
            One step while it is to be asked in every step; None in a window.
        """
        if self._gui:
            return None
        most = self._most_pending - len(self._pending)
        until_s, ends_m, halting_mps = self._next_due_s, self._ends_m, 2.0 * HALTING_SPEED_MPS
        until_s -= ALERT_STEPS * self._step_s
        if self._steps < self._alert_until or self._time_s >= until_s:
            # Whatever happens in it, SUMO is asked right behind it.
            most, until_s, ends_m, halting_mps = 1, np.inf, self._nowhere_m, -np.inf
        steps = np.arange(self._steps, self._steps + most)
        return Span(
            (self._begin_ms + steps * self._step_ms) / 1000.0,
            self._step_s,
            until_s,
            self._rows_running,
            self._aims_m,
            ends_m,
            halting_mps,
            2.0 * STOP_TOLERANCE_M,
            2.0 * self._step_s,
            ARRIVAL_M,
        )

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
        self._pending.extend(commands_mps)
        self._front_m, self._speed_mps = front_m, speed_mps
        self._steps += len(commands_mps)
        self._look_out()

    def _look_out(self) -> None:
        """Let SUMO catch up when an event is near, or it is too far behind."""
        if _is_event_near(
            self._front_m[self._rows_running],
            self._speed_mps[self._rows_running],
            self._aims_m,
            self._end_m,
            self._step_s,
        ):
            self._alert_until = self._steps + ALERT_STEPS
        due = self._time_s >= self._next_due_s - ALERT_STEPS * self._step_s
        if due or self._steps <= self._alert_until or len(self._pending) >= self._most_pending:
            self._catch_up()

    def _catch_up(self) -> None:
        """Let SUMO do what was commanded, and compare."""
        running = self._vehicles_running
        last = len(self._pending) - 1
        commands = [commands_mps.tolist() for commands_mps in self._pending]
        for step, commands_mps in enumerate(commands):
            # Each step anew: SUMO forgets a speed while a stop lies ahead.
            for _ in map(self._set_speed, running, commands_mps):
                pass
            self._advance()
            if self._collisions() or self._colliding:
                self._collided |= self._new_collisions()
            if step < last and (
                self._arrived() or self._departed() or self._stop_starting() or self._stop_ending()
            ):
                msg = f"SUMO reports an event before {self._time_s:.1f} s that was not expected"
                raise EngineDisagreementError(msg)
        self._pending.clear()
        if last:
            integrated_m = self._front_m.take(self._rows_running) - self._origins_m
            apart_m = np.abs(integrated_m - list(map(self._get_distance, running)))
            if self._collided or self._colliding:
                # What SUMO does with trains that have collided is its own affair.
                met = [*self._collided, *self._colliding]
                apart_m[np.isin(self._rows_running, met)] = 0.0
            if apart_m.max(initial=0.0) > AGREEMENT_M:
                train = running[int(apart_m.argmax())]
                msg = f"{train} is {apart_m.max():.3f} m off its commands at {self._time_s:.1f} s"
                raise EngineDisagreementError(msg)

    def _new_collisions(self) -> frozenset[int]:
        pairs = [(collision.collider, collision.victim) for collision in self._collisions()]
        colliding = frozenset(self._row_of[train] for pair in pairs for train in pair)
        fresh = colliding - self._colliding
        self._colliding = colliding
        return fresh


def _is_event_near(
    front_m: FloatArray, speed_mps: FloatArray, aims_m: FloatArray, end_m: float, step_s: float
) -> bool:
    """Return whether a running train is about to stop, or to leave the line."""
    halted = speed_mps <= 2.0 * HALTING_SPEED_MPS
    stops = halted & (np.abs(front_m - aims_m) <= 2.0 * STOP_TOLERANCE_M)
    ends = front_m + 2.0 * speed_mps * step_s + ARRIVAL_M >= end_m
    return bool((stops | ends).any())
