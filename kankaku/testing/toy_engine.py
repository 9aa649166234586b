"""An engine of a few lines, for tests that need no SUMO."""

from typing import Self

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.world import World
from kankaku.railway.step.engine_contract import Observation

STOP_TOLERANCE_M = 0.5
HALTING_SPEED_MPS = 0.1


class ToyEngine:
    """Moves trains exactly as commanded; an ``Engine`` of the contract."""

    def __init__(self, world: World, dwell_delay_s: FloatArray, step_s: float) -> None:
        self._world = world
        self._dwell_s = world.minimum_dwell_s[:, :-1] + dwell_delay_s
        self._step_s = step_s
        self._begin_s = float(np.floor(world.booked_arrival_s[:, 0].min() - step_s)) - 1.0
        self._steps = 0
        self._front_m = world.stop_m[:, 0].copy()
        self._speed_mps = np.zeros(world.size)
        self._command_mps = np.zeros(world.size)
        self._waiting = np.argsort(world.booked_arrival_s[:, 0], kind="stable").tolist()
        self._running: set[int] = set()
        self._release_s: dict[int, float] = {}
        self._call = [0] * world.size
        self._present: set[int] = set()
        services = world.timetable.services
        self._first = [world.line.section_of_track[service.route[0]] for service in services]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def observe(self) -> Observation:
        """Return where trains are, and what happened."""
        now_s = self._begin_s + self._steps * self._step_s
        left = tuple(row for row in sorted(self._running) if self._past_end(row))
        self._take_off(left)
        entered = tuple(sorted(row for row in self._waiting if self._may_enter(row, now_s)))
        for row in entered:
            self._waiting.remove(row)
        released = tuple(r for r, end_s in sorted(self._release_s.items()) if now_s > end_s - 1e-6)
        for row in released:
            del self._release_s[row]
            self._call[row] += 1
            self._running.add(row)
        ended = tuple(row for row in released if self._is_through(row))
        self._take_off(ended)
        stopped = tuple(row for row in sorted(self._running) if self._at_stop(row))
        for row in stopped:
            call = self._call[row]
            booked_s = float(self._world.booked_departure_s[row, call])
            self._release_s[row] = max(booked_s, now_s + float(self._dwell_s[row, call]))
            self._speed_mps[row] = 0.0
            self._running.discard(row)
        front_m, speed_mps = self._front_m.copy(), self._speed_mps.copy()
        left = tuple(sorted((*left, *ended)))
        return Observation(now_s, front_m, speed_mps, entered, stopped, released, left, ())

    def apply(self, speed_mps: FloatArray) -> None:
        """Take the speeds at the end of the next step. [m/s], shape (n_trains,)"""
        self._command_mps = speed_mps.copy()

    def advance(self) -> None:
        """Move the trains by a step."""
        rows = np.array(sorted(self._running), dtype=np.intp)
        before_mps, after_mps = self._speed_mps[rows], self._command_mps[rows]
        self._front_m[rows] += 0.5 * (before_mps + after_mps) * self._step_s
        self._speed_mps[rows] = after_mps
        self._steps += 1

    def _past_end(self, row: int) -> bool:
        runs_out = not self._world.leaves_at_stop[row]
        return runs_out and bool(self._front_m[row] >= self._world.line.end_m)

    def _is_through(self, row: int) -> bool:
        last = self._call[row] == self._world.call_count[row]
        return bool(last and self._world.leaves_at_stop[row])

    def _take_off(self, rows: tuple[int, ...]) -> None:
        for row in rows:
            self._front_m[row] = self._world.line.end_m
            self._speed_mps[row] = 0.0
            self._running.discard(row)
            self._present.discard(row)

    def _at_stop(self, row: int) -> bool:
        off_m = abs(self._front_m[row] - self._world.stop_m[row, self._call[row]])
        return bool(off_m <= STOP_TOLERANCE_M and self._speed_mps[row] <= HALTING_SPEED_MPS)

    def _may_enter(self, row: int, now_s: float) -> bool:
        if now_s < self._world.booked_arrival_s[row, 0] - 1e-6:
            return False
        if any(self._overlaps(row, other) for other in self._present):
            return False
        self._present.add(row)
        self._running.add(row)
        return True

    def _overlaps(self, row: int, other: int) -> bool:
        front_m, length_m = self._front_m, self._world.length_m
        apart = (
            front_m[row] - length_m[row] >= front_m[other]
            or front_m[other] - length_m[other] >= front_m[row]
        )
        return not apart and self._track(row) == self._track(other)

    def _track(self, row: int) -> str:
        line, service = self._world.line, self._world.timetable.services[row]
        section = self._first[row]
        while line.sections[section].end_m < self._front_m[row] - self._world.length_m[row]:
            section += 1
        return service.route[section - self._first[row]]
