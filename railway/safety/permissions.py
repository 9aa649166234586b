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
    reach_m,
)
from kankaku.railway.safety.proofs import ENTERED_M, Proofs
from kankaku.railway.step.control import Separation, exclusive_pieces
from kankaku.railway.step.obstructions import Obstruction
from kankaku.railway.step.promises import Promises
from kankaku.railway.step.step_block import StepBlock

PERMITTED_M = 0.05
"""Brake curves from tables come this near to exact ones. [m]"""
IN_PLATFORM_M = 1.0
"""A front this far in a platform section has entered it. [m]"""
ROUNDING_S = 1e-3

PERMISSION_KINDS = frozenset({"margin", "grant", "release", "platform"})
"""What is judged of trains that are held by a stop, too."""
Bound = tuple[str, FloatArray, float]
"""Kind of a rule, by how much it is broken [m], shape (n_steps, n_columns), and its tolerance."""


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

    def beyond_m(
        self, block: StepBlock, rear_m: FloatArray, nearest_m: FloatArray, proofs: Proofs
    ) -> Iterator[Bound]:
        """
        Yield by how much authorities reach too far.

        Parameters
        ----------
        block
            The steps.
        rear_m
            Rear that each train shows to the next one, with its buffer. [m], as the block's fronts
        nearest_m
            The nearest of them ahead of each train. [m], same shape
        proofs
            When points and crossings were proven, the block included.

        Yields
        ------
        Bound
            What is yielded of a step is judged at its start.
        """
        margin_m, buffers = self._promises.margin_m, self._promises.buffers
        eoa_m, front_m = block.eoa_m[:-1], block.front_m[:-1]
        reached_m = eoa_m
        if not buffers.none:
            reached_m = reach_m(
                eoa_m, front_m, buffers.balise_m, buffers.error_ratio, buffers.resolution_m
            )
        reached_m = reached_m + margin_m
        # A train that stands where it may not go any further is permitted nothing.
        reached_m[eoa_m <= front_m] = -np.inf
        behind_m = np.where(nearest_m[:-1] >= self._world.far_m, np.inf, nearest_m[:-1])
        yield "margin", reached_m - behind_m, PERMITTED_M
        yield "grant", reached_m - self._granted_m(block, proofs), PERMITTED_M
        if self._pieces:
            yield "release", reached_m - self._unreleased_m(block), PERMITTED_M
        if self._promises.exclusive_platform:
            free_m = self._platforms_m(block, rear_m)
            yield "platform", reached_m - free_m, PERMITTED_M
            yield "platform", self._in_platform_m(block), 0.0

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
            at = int(np.searchsorted(block.time_s, record.requested_s - ROUNDING_S))
            begun = record.cause is Cause.POINTS and at < block.time_s.size
            if not begun or key in self._thrown or record.requested_s < block.time_s[0]:
                continue
            self._thrown.add(key)
            within = (front_m[at] > record.start_m + ENTERED_M) & (tail_m[at] < record.end_m)
            within &= block.present[min(at, block.present.shape[0] - 1)]
            within &= self._users(record)[block.rows]
            for column in np.flatnonzero(within).tolist():
                depth_m = float(front_m[at, column] - record.start_m)
                yield int(block.rows[column]), float(block.time_s[at]), depth_m

    def _users(self, record: Obstruction) -> BoolArray:
        return np.array([not route.isdisjoint(record.tracks) for route in self._routes])

    def _held_m(self, place_m: float, route: frozenset[str] | set[str]) -> float:
        """Return where a route's piece of track begins that a place is in."""
        inside = (
            piece.start_m
            for piece in self._pieces
            if piece.track in route and piece.start_m <= place_m < piece.end_m
        )
        return min(inside, default=place_m)

    def _granted_m(self, block: StepBlock, proofs: Proofs) -> FloatArray:
        """Return where the first place begins that is not proven to be free for each train."""
        granted_to_m = np.full(block.present.shape, np.inf)
        time_s, front_m = block.time_s[:-1], block.front_m[:-1]
        column_of = {row: column for column, row in enumerate(block.rows.tolist())}
        for row, place_m, until_s in proofs.unproven(block):
            column = column_of[row]
            waits = time_s < until_s - ROUNDING_S
            waits &= front_m[:, column] <= place_m + ENTERED_M
            held_m = self._held_m(place_m, self._routes[row])
            granted_to_m[waits, column] = np.minimum(granted_to_m[waits, column], held_m)
        for record in self._obstructions():
            lifted_s = np.inf if np.isnan(record.lifted_s) else record.lifted_s
            in_force = (record.established_s <= time_s) & (time_s < lifted_s - ROUNDING_S)
            sudden = record.cause in SUDDEN
            # By radio trains hear of it later; whether they keep out is looked at elsewhere.
            if not in_force.any() or (sudden and self._by_radio):
                continue
            concerned = in_force[:, np.newaxis] & (front_m <= record.start_m + ENTERED_M)
            concerned &= self._users(record)[block.rows]
            if sudden:
                concerned &= ~block.surprised[:-1]
            # A zone is established when nobody may go into it; the margin comes with a telegram.
            late_m = self._promises.margin_m if self._by_radio else 0.0
            place_m = record.start_m + (late_m if record.cause is Cause.WORK else 0.0)
            holds_m = [self._held_m(place_m, self._routes[row]) for row in block.rows.tolist()]
            granted_to_m = np.where(concerned, np.minimum(granted_to_m, holds_m), granted_to_m)
        return granted_to_m

    def _unreleased_m(self, block: StepBlock) -> FloatArray:
        nearest_m = np.full(block.present.shape, np.inf)
        nearest_unreleased(
            block.time_s,
            Trains(block.front_m, self._world.length_m[block.rows], block.present),
            Circuits(
                self._circuit_ends_m,
                self._hold_m,
                self._uses[block.rows],
                self._world.line.release_delay_s - ROUNDING_S,
                self._touched_s,
            ),
            nearest_m,
        )
        return nearest_m

    def _sections_m(self, block: StepBlock) -> FloatArray:
        """Return the platform sections ahead, empty for who is in its own; (2, n_steps + 1, n)."""
        section_m = self._world.platform_m[:, block.rows, block.next_call].copy()
        section_m[1, block.front_m > section_m[0] + IN_PLATFORM_M] = -np.inf
        return section_m

    def _calls_behind(self, block: StepBlock) -> BoolArray:
        """Return whose route takes the track of each train's next call."""
        track = self._world.call_track[block.rows, block.next_call]
        return self._comes_by[block.rows][:, track].transpose(1, 2, 0)

    def _platforms_m(self, block: StepBlock, rear_m: FloatArray) -> FloatArray:
        free_m = np.full(block.present.shape, np.inf)
        lower_to_platforms(
            block.front_m,
            rear_m,
            block.present,
            self._sections_m(block),
            self._calls_behind(block),
            free_m,
        )
        return free_m

    def _in_platform_m(self, block: StepBlock) -> FloatArray:
        """Return how far fronts have entered a platform section that another train is in."""
        tail_m = block.front_m - self._world.length_m[block.rows]
        section_m, comes_by = self._sections_m(block)[:, :-1], self._calls_behind(block)[:-1]
        start_m = self._world.platform_m[0, block.rows, block.next_call[:-1]]
        occupied_m = np.full(block.present.shape, np.inf)
        lower_to_platforms(
            block.front_m[1:], tail_m[1:], block.present, section_m, comes_by, occupied_m
        )
        enters = np.isfinite(occupied_m) & (block.front_m[1:] > start_m + IN_PLATFORM_M)
        return np.where(enters, block.front_m[1:] - start_m, 0.0)
