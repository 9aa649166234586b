"""An engine that moves trains exactly as commanded and keeps their stops itself."""

from types import TracebackType
from typing import Self

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import formula
from kankaku.railway.plan.world import World
from kankaku.railway.step.bundles import Span
from kankaku.railway.step.engine_contract import Observation

STOP_TOLERANCE_M = 0.5
"""A front this far before or beyond the aimed stop position starts the stop. [m]"""
HALTING_SPEED_MPS = 0.1
"""At this speed or less. [m/s]"""
ROUNDING_S = 1e-6
MOST_STEPS = 300
"""In one span. [-]"""


@formula
def is_past(rows: IntArray, front_m: FloatArray, ends_m: FloatArray) -> bool:
    """
    Return whether a train has come to the end of its line.

    Parameters
    ----------
    rows
        Who runs. shape (n_running,)
    front_m
        Fronts. [m], shape (n_trains,)
    ends_m
        Where they leave; infinite for those who end at a stop. [m], shape (n_running,)

    Returns
    -------
    bool
        Of nearly all moments that nobody has.
    """
    past = False
    for place in range(rows.size):
        past |= front_m[rows[place]] >= ends_m[place]
    return past


@formula
def is_at_stop(
    rows: IntArray, front_m: FloatArray, speed_mps: FloatArray, aims_m: FloatArray
) -> bool:
    """
    Return whether a train begins a stop.

    Parameters
    ----------
    rows
        Who runs. shape (n_running,)
    front_m, speed_mps
        Fronts and speeds. [m], [m/s], shape (n_trains,)
    aims_m
        Where they stop next. [m], shape (n_running,)

    Returns
    -------
    bool
        Of nearly all moments that nobody does.
    """
    for place in range(rows.size):
        slow = speed_mps[rows[place]] <= HALTING_SPEED_MPS
        if slow and abs(front_m[rows[place]] - aims_m[place]) <= STOP_TOLERANCE_M:
            return True
    return False


class PlainEngine:
    """
    Moves trains exactly as commanded; an ``Engine`` of the contract.

    In a network a train enters when all that go before it have passed its origin; one that takes
    over the stock of another enters in the observation in which that one leaves.

    Parameters
    ----------
    world
        Line, fleet and timetable.
    dwell_delay_s
        Dwell delay of every call. [s], shape (n_trains, n_calls_max)
    step_s
        Length of a step. [s]
    """

    def __init__(self, world: World, dwell_delay_s: FloatArray, step_s: float) -> None:
        self._world = world
        self._dwell_s = world.minimum_dwell_s[:, :-1] + dwell_delay_s
        self._booked_s = world.booked_departure_s
        self._step_s = step_s
        self._begin_s = float(np.floor(world.booked_arrival_s[:, 0].min() - step_s)) - 1.0
        self._steps = 0
        self._front_m = world.stop_m[:, 0].copy()
        self._speed_mps = np.zeros(world.size)
        self._command_mps = np.zeros(world.size)
        stock_from = world.stock_from
        waiting = np.argsort(world.booked_arrival_s[:, 0], kind="stable").tolist()
        self._waiting = [row for row in waiting if stock_from[row] < 0]
        self._next_of = {int(stock): row for row, stock in enumerate(stock_from) if stock >= 0}
        self._running: set[int] = set()
        self._rows: IntArray = np.zeros(0, dtype=np.intp)
        self._aims_m: FloatArray = np.zeros(0)
        self._ends_m: FloatArray = np.zeros(0)
        self._over_s: dict[int, float] = {}
        """When each stop is over of itself."""
        self._release_s: dict[int, float] = {}
        """When each stop ends, if it is extended, too."""
        self._next_release_s = np.inf
        self._call = [0] * world.size
        # Twice the highest speed of all: no tail is sooner where it lets another train enter.
        self._fastest_mps = 2.0 * max(kind.maximum_speed_mps for kind in world.train_types)
        self._shut_s = np.full(world.size, -np.inf)
        """Before this no train can enter for which another one stands in the way. [s]"""
        self._present: set[int] = set()
        self._gone: set[int] = set()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        return None

    @property
    def _now_s(self) -> float:
        return self._begin_s + self._steps * self._step_s

    def observe(self) -> Observation:
        """Return where trains are, and what happened."""
        now_s = self._now_s
        left = self._past_end()
        self._take_off(left)
        entered = self._entries(now_s)
        released: tuple[int, ...] = ()
        if now_s > self._next_release_s - ROUNDING_S:
            released = self._releases(now_s)
        ended = tuple(row for row in released if self._is_through(row))
        self._take_off(ended)
        over = tuple(self._next_of[row] for row in ended if row in self._next_of)
        entered = tuple(sorted((*entered, *over)))
        for row in entered:
            self._present.add(row)
            self._running.add(row)
        if over:
            self._shut_s.fill(-np.inf)
        if left or entered or released:
            self._regroup()
        stopped = self._at_stop()
        for row in stopped:
            call = self._call[row]
            booked_s = float(self._booked_s[row, call])
            over_s = max(booked_s, now_s + float(self._dwell_s[row, call]))
            self._over_s[row] = self._release_s[row] = over_s
            self._speed_mps[row] = 0.0
            self._running.discard(row)
        if stopped:
            self._regroup()
        front_m, speed_mps = self._front_m.copy(), self._speed_mps.copy()
        gone = tuple(sorted((*left, *ended)))
        return Observation(now_s, front_m, speed_mps, entered, stopped, released, gone, ())

    def apply(self, speed_mps: FloatArray) -> None:
        """Take the speeds at the end of the next step. [m/s], shape (n_trains,)"""
        self._command_mps = speed_mps.copy()

    def hold(self, until_s: FloatArray) -> None:
        """Let no stop that lasts now end before a time. [s], shape (n_trains,)"""
        for row, over_s in self._over_s.items():
            self._release_s[row] = max(over_s, float(until_s[row]))
        self._next_release_s = min(self._release_s.values(), default=np.inf)

    def advance(self) -> None:
        """Move the trains by a step."""
        rows = self._rows
        before_mps, after_mps = self._speed_mps[rows], self._command_mps[rows]
        self._front_m[rows] += 0.5 * (before_mps + after_mps) * self._step_s
        self._speed_mps[rows] = after_mps
        self._steps += 1

    def span(self) -> Span | None:
        """
        Return the steps up to the next entry or release.

        Returns
        -------
        Span | None
            None while a train waits to enter.
        """
        now_s, stop_s = self._now_s, self._next_release_s
        # They wait in the order of their booked times.
        for row in self._waiting:
            booked_s = float(self._world.booked_arrival_s[row, 0])
            if booked_s >= stop_s:
                break
            stop_s = min(stop_s, max(booked_s, float(self._shut_s[row])))
        if now_s >= stop_s - ROUNDING_S:
            return None
        steps = np.arange(self._steps, self._steps + MOST_STEPS, dtype=np.float64)
        return Span(
            self._begin_s + steps * self._step_s,
            self._step_s,
            stop_s - ROUNDING_S,
            self._rows,
            self._aims_m,
            self._ends_m,
            HALTING_SPEED_MPS,
            STOP_TOLERANCE_M,
            0.0,
            0.0,
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
        self._front_m, self._speed_mps = front_m.copy(), speed_mps.copy()
        self._steps += len(commands_mps)

    def _regroup(self) -> None:
        """Take note of who is running, after an event."""
        rows = sorted(self._running)
        self._rows = np.array(rows, dtype=np.intp)
        self._aims_m = np.array([self._world.stop_m[row, self._call[row]] for row in rows])
        leaves = self._world.leaves_at_stop[self._rows]
        self._ends_m = np.where(leaves, np.inf, self._world.line.end_m)
        self._next_release_s = min(self._release_s.values(), default=np.inf)

    def _past_end(self) -> tuple[int, ...]:
        if not is_past(self._rows, self._front_m, self._ends_m):
            return ()
        return tuple(self._rows[self._front_m[self._rows] >= self._ends_m].tolist())

    def _releases(self, now_s: float) -> tuple[int, ...]:
        due = sorted(r for r, end_s in self._release_s.items() if now_s > end_s - ROUNDING_S)
        for row in due:
            del self._release_s[row], self._over_s[row]
            self._call[row] += 1
            self._running.add(row)
        return tuple(due)

    def _is_through(self, row: int) -> bool:
        last = self._call[row] == self._world.call_count[row]
        return bool(last and self._world.leaves_at_stop[row])

    def _take_off(self, rows: tuple[int, ...]) -> None:
        if rows:
            self._shut_s.fill(-np.inf)
        for row in rows:
            self._front_m[row] = self._world.line.end_m
            self._speed_mps[row] = 0.0
            self._running.discard(row)
            self._present.discard(row)
            self._gone.add(row)

    def _at_stop(self) -> tuple[int, ...]:
        trains = self._rows, self._front_m, self._speed_mps
        if not is_at_stop(*trains, self._aims_m):
            return ()
        off_m = np.abs(self._front_m[self._rows] - self._aims_m)
        slow = self._speed_mps[self._rows] <= HALTING_SPEED_MPS
        return tuple(self._rows[(off_m <= STOP_TOLERANCE_M) & slow].tolist())

    def _entries(self, now_s: float) -> tuple[int, ...]:
        arrival_s, entered = self._world.booked_arrival_s, []
        for row in self._waiting:
            if now_s < arrival_s[row, 0] - ROUNDING_S:
                break
            if now_s < self._shut_s[row]:
                continue
            apart_m = self._in_the_way_m(row)
            self._shut_s[row] = now_s + apart_m / self._fastest_mps
            if apart_m < 0.0:
                entered.append(row)
                self._present.add(row)
                self._shut_s.fill(-np.inf)
        for row in entered:
            self._waiting.remove(row)
        return tuple(sorted(entered))

    def _in_the_way_m(self, row: int) -> float:
        """
        Return how far another train has to go at least until one may enter.

        Negative if it may now, infinite if the other one has to enter first. [m]
        """
        if self._world.line.network:
            for one in self._world.enters_after[row]:
                if not self._has_passed(row, *one):
                    return self._to_pass_m(row, *one)
            return -1.0
        for other in self._present:
            if self._overlaps(row, other):
                tail_m = self._front_m[other] - self._world.length_m[other]
                ends_m = self._world.line.track_by_id[self._track(other)].end_m
                return max(float(min(self._front_m[row], ends_m) - tail_m), 0.0)
        return -1.0

    def _to_pass_m(self, row: int, other: int, passage: int) -> float:
        """Return how far a train has to go at least that has not passed another one's origin."""
        if other not in self._present:
            return np.inf
        tail_m, way = self._front_m[other] - self._world.length_m[other], self._world.passages
        same_way = way[other][passage].track == way[row][0].track
        origin_m = self._world.stop_m[row, 0] if same_way else np.inf
        return max(float(min(way[other][passage].clear_m, origin_m) - tail_m), 0.0)

    def _has_passed(self, row: int, other: int, passage: int) -> bool:
        """Return whether a train that goes before another one has left the other's origin."""
        if other in self._gone:
            return True
        if other not in self._present:
            return False
        tail_m, way = self._front_m[other] - self._world.length_m[other], self._world.passages
        if tail_m >= way[other][passage].clear_m:
            return True
        same_way = way[other][passage].track == way[row][0].track
        return bool(same_way and tail_m > self._world.stop_m[row, 0])

    def _overlaps(self, row: int, other: int) -> bool:
        front_m, length_m = self._front_m, self._world.length_m
        apart = (
            front_m[row] - length_m[row] >= front_m[other]
            or front_m[other] - length_m[other] >= front_m[row]
        )
        return not apart and self._track(row) == self._track(other)

    def _track(self, row: int) -> str:
        """Return the track under the tail of a train on a chain."""
        tail_m, way = self._front_m[row] - self._world.length_m[row], self._world.passages[row]
        ends_m = self._world.line.track_by_id
        under = (one.track for one in way if ends_m[one.track].end_m >= tail_m)
        return next(under, way[-1].track)
