"""
What authorities may not count on: the monitor's part that looks at permissions, not at trains.

What is in the way is worked out from recorded fronts, the line and the timetable; of what a
protection promises only the figures are believed, and of obstructions only place and times.
"""

from collections.abc import Callable, Iterator

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray
from kankaku.railway.plan.disruptions import SUDDEN, Cause
from kankaku.railway.plan.world import World
from kankaku.railway.safety.positions import (
    Circuits,
    Trains,
    lower_to_platforms,
    nearest_unreleased,
)
from kankaku.railway.safety.proofs import ENTERED_M, Proofs
from kankaku.railway.safety.rules import ROUNDING_S
from kankaku.railway.safety.train_steps import TrainSteps
from kankaku.railway.step.control import Separation, exclusive_pieces
from kankaku.railway.step.obstructions import Obstruction
from kankaku.railway.step.promises import Promises
from kankaku.railway.step.step_block import StepBlock

IN_PLATFORM_M = 1.0
"""A front this far in a platform section has entered it. [m]"""
NOTHING: FloatArray = np.zeros((0, 0))
"""Where nothing is in the way of anybody."""


class Permissions:
    """Finds authorities that reach further than what was promised."""

    def __init__(
        self,
        world: World,
        separation: Separation,
        promises: Promises,
        obstructions: Callable[[], tuple[Obstruction, ...]],
        *,
        by_radio: bool,
    ) -> None:
        self._world, self._promises = world, promises
        self._obstructions, self._by_radio = obstructions, by_radio
        services = world.timetable.services
        self._routes = [frozenset(service.route) for service in services]
        kept = exclusive_pieces(world.line, separation)
        self._pieces = kept
        circuits = world.line.track_circuits if kept else ()
        self._circuit_ends_m = np.array([(piece.start_m, piece.end_m) for piece in circuits])
        self._uses = np.array([[c.track in route for c in circuits] for route in self._routes])
        self._hold_m = np.array([self._held_m(c.start_m, {c.track}) for c in circuits])
        self._touched_s = np.full(len(circuits), -np.inf)
        tracks = list(world.line.track_by_id)
        # Past its last call a train calls nowhere: number -1, the last column.
        self._comes_by = np.array(
            [[track in r for track in tracks] + [False] for r in self._routes]
        )
        self._thrown: set[tuple[str, float]] = set()
        self._users_of: dict[tuple[str, ...], BoolArray] = {}

    def thrown_under(self, block: StepBlock) -> Iterator[tuple[int, float, float]]:
        """
        Yield the trains that points were thrown under.

        Parameters
        ----------
        block
            The steps.

        Yields
        ------
        tuple[int, float, float]
            Row of the train, when [s], and how far its front was in the points. [m]
        """
        front_m = block.front_m
        tail_m = front_m - self._world.length_m[block.rows]
        for record in self._obstructions():
            key = record.id, record.requested_s
            if record.cause is not Cause.POINTS or not record.requested_s >= block.time_s[0]:
                continue
            at = int(np.searchsorted(block.time_s, record.requested_s - ROUNDING_S))
            if at == block.time_s.size or key in self._thrown:
                continue
            self._thrown.add(key)
            within = (front_m[at] > record.start_m + ENTERED_M) & (tail_m[at] < record.end_m)
            within &= block.present[min(at, block.present.shape[0] - 1)]
            within &= self._users(record)[block.rows]
            for column in np.flatnonzero(within).tolist():
                depth_m = float(front_m[at, column] - record.start_m)
                yield int(block.rows[column]), float(block.time_s[at]), depth_m

    def _users(self, record: Obstruction) -> BoolArray:
        """Return whose routes take tracks of an obstruction. shape (n_trains,)"""
        if record.tracks not in self._users_of:
            uses = [not route.isdisjoint(record.tracks) for route in self._routes]
            self._users_of[record.tracks] = np.array(uses)
        return self._users_of[record.tracks]

    def _held_m(self, place_m: float, route: frozenset[str] | set[str]) -> float:
        """Return where a route's piece of track begins that a place is in."""
        inside = (
            piece.start_m
            for piece in self._pieces
            if piece.track in route and piece.start_m <= place_m < piece.end_m
        )
        return min(inside, default=place_m)

    def granted_m(self, block: StepBlock, steps: TrainSteps, proofs: Proofs) -> FloatArray:
        """
        Return where the first place begins that is not proven to be free for each train.

        Parameters
        ----------
        block
            The steps.
        steps
            The same, train by train.
        proofs
            When points and crossings were proven, the block included.

        Returns
        -------
        FloatArray
            Infinite where there is none. [m], shape (n_columns, n_steps), or without any place
        """
        time_s, front_m = block.time_s[:-1], steps.front_m[:, :-1]
        granted_to_m = NOTHING
        column_of = {row: column for column, row in enumerate(block.rows.tolist())}
        for row, place_m, until_s in proofs.unproven(block):
            column = column_of[row]
            waits = slice(int(np.searchsorted(time_s, until_s - ROUNDING_S)))
            before = front_m[column, waits] <= place_m + ENTERED_M
            if before.any():
                granted_to_m = granted_to_m if granted_to_m.size else _endless(front_m)
                held_m = self._held_m(place_m, self._routes[row])
                grants_m = granted_to_m[column, waits]
                grants_m[before] = np.minimum(grants_m[before], held_m)
        for record in self._obstructions():
            during, concerned = self._concerned(record, steps)
            if concerned.any():
                granted_to_m = granted_to_m if granted_to_m.size else _endless(front_m)
                # A zone is established when nobody may go into it; the margin comes with a
                # telegram.
                late_m = self._promises.margin_m if self._by_radio else 0.0
                place_m = record.start_m + (late_m if record.cause is Cause.WORK else 0.0)
                holds_m = [self._held_m(place_m, self._routes[row]) for row in block.rows.tolist()]
                grants_m = granted_to_m[:, during]
                lower_m = np.minimum(grants_m, np.array(holds_m)[:, np.newaxis])
                grants_m[concerned] = lower_m[concerned]
        return granted_to_m

    def _concerned(self, record: Obstruction, steps: TrainSteps) -> tuple[slice, BoolArray]:
        """Return when an obstruction is in force, and whom it is in the way of then."""
        time_s, lifted_s = steps.time_s[:-1], record.lifted_s - ROUNDING_S
        sudden = record.cause in SUDDEN
        # Not-a-number, for what was never established, is never reached.
        begun = record.established_s <= time_s[-1] and not lifted_s <= time_s[0]
        # By radio trains hear of it later; whether they keep out is looked at elsewhere.
        if not begun or (sudden and self._by_radio):
            return slice(0), np.zeros((1, 0), dtype=np.bool_)
        begins, ends = np.searchsorted(time_s, (record.established_s, lifted_s)).tolist()
        during = slice(begins, ends)
        front_m = steps.front_m[:, :-1][:, during]
        concerned: BoolArray = front_m <= record.start_m + ENTERED_M
        concerned &= self._users(record)[steps.rows, np.newaxis]
        if sudden:
            concerned &= ~steps.surprised[:, :-1][:, during]
        return during, concerned

    def unreleased_m(self, steps: TrainSteps) -> FloatArray:
        """
        Return where the first track circuit begins that is not released.

        Parameters
        ----------
        steps
            The steps; each is looked at once, in turn.

        Returns
        -------
        FloatArray
            As of :meth:`granted_m`.
        """
        if not self._pieces:
            return NOTHING
        nearest_m = _endless(steps.present)
        nearest_unreleased(
            steps.time_s,
            Trains(steps.front_m, self._world.length_m[steps.rows], steps.present),
            Circuits(
                self._circuit_ends_m,
                self._hold_m,
                self._uses[steps.rows],
                self._world.line.release_delay_s - ROUNDING_S,
                self._touched_s,
            ),
            nearest_m,
        )
        return nearest_m

    def occupied_m(self, steps: TrainSteps, rear_m: FloatArray) -> FloatArray:
        """
        Return where the platform section begins that a train calls in next and another one is in.

        Parameters
        ----------
        steps
            The steps.
        rear_m
            Rear that each train shows to the next one, with its buffer. [m], as the fronts

        Returns
        -------
        FloatArray
            As of :meth:`granted_m`.
        """
        if not self._promises.exclusive_platform:
            return NOTHING
        free_m, sections_m = _endless(steps.present), self._sections_m(steps)
        comes_by = self._calls_behind(steps)
        lower_to_platforms(steps.front_m, rear_m, steps.present, sections_m, comes_by, free_m)
        return free_m

    def in_platform_m(self, steps: TrainSteps) -> FloatArray:
        """
        Return how far fronts have entered a platform section that another train is in.

        Parameters
        ----------
        steps
            The steps.

        Returns
        -------
        FloatArray
            Zero where they have not. [m], shape (n_columns, n_steps)
        """
        tail_m = steps.front_m - self._world.length_m[steps.rows, np.newaxis]
        sections_m = np.ascontiguousarray(self._sections_m(steps)[:, :, :-1])
        comes_by = self._calls_behind(steps)[:-1]
        rows = steps.rows[:, np.newaxis]
        start_m = self._world.platform_m[0, rows, steps.next_call[:, :-1]]
        front_m = np.ascontiguousarray(steps.front_m[:, 1:])
        rear_m, there_m = np.ascontiguousarray(tail_m[:, 1:]), _endless(steps.present)
        lower_to_platforms(front_m, rear_m, steps.present, sections_m, comes_by, there_m)
        enters = np.isfinite(there_m) & (front_m > start_m + IN_PLATFORM_M)
        return np.where(enters, front_m - start_m, 0.0)

    def _sections_m(self, steps: TrainSteps) -> FloatArray:
        """Return the platform sections ahead, empty for who is in its own; (2, n, n_steps + 1)."""
        section_m = self._world.platform_m[:, steps.rows[:, np.newaxis], steps.next_call].copy()
        section_m[1, steps.front_m > section_m[0] + IN_PLATFORM_M] = -np.inf
        return np.ascontiguousarray(section_m)

    def _calls_behind(self, steps: TrainSteps) -> BoolArray:
        """Return whose route takes the track of each train's next call; (n_steps + 1, n, n)."""
        track = self._world.call_track[steps.rows[:, np.newaxis], steps.next_call]
        return np.ascontiguousarray(self._comes_by[steps.rows][:, track].transpose(2, 1, 0))


def _endless(like: FloatArray | BoolArray) -> FloatArray:
    return np.full(like.shape, np.inf)
