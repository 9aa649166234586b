"""
Safety invariants, checked in every step by code that protection does not share.

The monitor finds leaders by sorting positions on each track, integrates gradients exactly
instead of reading tables, and reads limits from the line itself.
"""

from collections.abc import Callable, Iterator

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.plan.line import Turnout
from kankaku.railway.plan.world import World
from kankaku.railway.safety.examination import Clear, breaches
from kankaku.railway.safety.intrusion import Intrusions
from kankaku.railway.safety.movements import Movements
from kankaku.railway.safety.permissions import NOTHING, Permissions
from kankaku.railway.safety.positions import (
    Trains,
    nearest_on_track,
    raise_to_depth,
    raise_to_entered,
)
from kankaku.railway.safety.proofs import Proofs
from kankaku.railway.safety.rules import AUTHORITY, KINDS
from kankaku.railway.safety.survey import stands_m, survey_of
from kankaku.railway.safety.terms import terms_of
from kankaku.railway.safety.train_steps import Moves, TrainSteps, by_train, moves_of
from kankaku.railway.step.control import Separation, exclusive_pieces
from kankaku.railway.step.obstructions import Obstruction
from kankaku.railway.step.promises import Promises
from kankaku.railway.step.records import Violation
from kankaku.railway.step.step_block import StepBlock


class Monitor:
    """Checks authority, spacing, blocks, obstructions, line limits and acceleration bounds."""

    def __init__(
        self,
        world: World,
        separation: Separation = Separation.STANDING,
        obstructions: Callable[[], tuple[Obstruction, ...]] = tuple,
        *,
        by_radio: bool = False,
        promises: Promises | None = None,
    ) -> None:
        self._world = world
        self._separation = separation
        kept = exclusive_pieces(world.line, separation)
        self._exclusive = sorted(kept, key=lambda piece: piece.start_m)
        self._ends_m = np.array([(piece.start_m, piece.end_m) for piece in self._exclusive])
        routes = [frozenset(service.route) for service in world.timetable.services]
        self._enters = np.array(
            [[piece.track in route for piece in self._exclusive] for route in routes]
        )
        self._survey, self._terms = survey_of(world), terms_of(world, separation, promises)
        self._near_m = float(self._terms.tolerances[AUTHORITY])
        self._closest = np.full(len(KINDS), -np.inf)
        self._users = [
            (np.array([track in route for route in routes]), (place.start_m, place.end_m))
            for track, place in world.line.track_by_id.items()
        ]
        self._fouling = _tracks_at_points(world)
        self._movements = Movements(world)
        self._intrusions = Intrusions(world, obstructions, self._survey, by_radio=by_radio)
        self._proofs = Proofs(world)
        told = Promises() if promises is None else promises
        self._buffers, self._exclusive_platform = told.buffers, told.exclusive_platform
        self._permissions: Permissions | None = None
        if promises is not None:
            self._permissions = Permissions(
                world, separation, promises, obstructions, by_radio=by_radio
            )
        self._open: dict[tuple[int, str], tuple[float, float, float]] = {}
        self._closed: list[Violation] = []

    def add(self, block: StepBlock) -> None:
        """
        Check a block of steps.

        Parameters
        ----------
        block
            The steps.
        """
        early = [*self._proofs.early(block), *self._movements.early(block)]
        steps = by_train(block)
        moves = moves_of(steps, self._world.length_m[block.rows])
        clear = self._clear(block, steps, moves)
        for kind, step, column, excess in breaches(
            self._survey, self._terms, steps, clear, self._closest
        ):
            self._extend(int(block.rows[column]), kind, float(block.time_s[step + 1]), excess)
        for kind, judged, inside_m in self._inside_m(block, steps, moves):
            # Not-a-number is inside of everything.
            deep: BoolArray = ~(inside_m <= 0.0)
            passed = judged & deep if deep.any() else deep
            for step, column in np.argwhere(passed).tolist():
                time_s = float(block.time_s[step + 1])
                self._extend(int(block.rows[column]), kind, time_s, float(inside_m[step, column]))
        for row, kind, time_s, early_s in early:
            self._extend(row, kind, time_s, early_s)
        if self._permissions:
            for row, time_s, depth_m in self._permissions.thrown_under(block):
                self._extend(row, "lock", time_s, depth_m)

    def note_collisions(self, rows: tuple[int, ...], time_s: float) -> None:
        """
        Take note of a collision that the engine saw.

        Parameters
        ----------
        rows
            The trains.
        time_s
            When. [s]
        """
        for row in rows:
            self._extend(row, "collision", time_s, 0.0)

    def violations(self) -> tuple[Violation, ...]:
        """
        Return what was found.

        Returns
        -------
        tuple[Violation, ...]
            In order of time; consecutive steps of one train and kind are one violation.
        """
        still_open = [self._violation(key, seen) for key, seen in self._open.items()]
        return tuple(sorted(self._closed + still_open, key=lambda v: (v.time_s, v.row, v.kind)))

    def closest(self) -> dict[str, float]:
        """
        Return how near trains have come to breaking each rule for single trains.

        Returns
        -------
        dict[str, float]
            By kind the greatest finite excess, negative for rules that were kept with something to
            spare; minus infinity for those that bound nobody.
        """
        return dict(zip(KINDS, self._closest.tolist(), strict=True))

    def _clear(self, block: StepBlock, steps: TrainSteps, moves: Moves) -> Clear:
        """Return how far the way ahead of each train is clear."""
        rear_m = self._rear_m(steps)
        next_rear_m = buffered_m = self._nearest_m(steps, moves, rear_m)
        held = self._permissions
        if held is None:
            return Clear(next_rear_m, buffered_m, NOTHING, NOTHING, NOTHING)
        if not self._buffers.none:
            rear_m -= self._buffers.rear_buffer_m(steps.front_m)
            buffered_m = self._nearest_m(steps, moves, rear_m)
        granted_m = held.granted_m(block, steps, self._proofs)
        unreleased_m = held.unreleased_m(steps)
        return Clear(
            next_rear_m, buffered_m, granted_m, unreleased_m, held.occupied_m(steps, rear_m)
        )

    def _inside_m(
        self, block: StepBlock, steps: TrainSteps, moves: Moves
    ) -> Iterator[tuple[str, BoolArray, FloatArray]]:
        """Yield of whom it is judged, and how far fronts are in what they may not be in. [m]"""
        moving = block.moving
        if self._exclusive:
            yield "block", moving, self._inside_occupied_m(block)
        if self._fouling:
            yield "fouling", moving, self._inside_fouling_m(block, moves)
        if self._world.line.network:
            for kind, inside_m in self._movements.inside_m(block):
                yield kind, moving, inside_m
        yield "obstruction", moving, self._intrusions.inside_m(block, self._near_m)
        if self._permissions and self._exclusive_platform:
            # Of trains that are held by a stop, too.
            yield "platform", block.present, self._permissions.in_platform_m(steps).T

    def _inside_fouling_m(self, block: StepBlock, moves: Moves) -> FloatArray:
        """Return how far each front is in a fouling section that another track's train is in."""
        inside_m = np.zeros(block.front_m[1:].shape)
        front_m = block.front_m[1:]
        tail_m = front_m - self._world.length_m[block.rows]
        for turnout, track_of_row in self._fouling:
            ends_m = turnout.fouling_start_m, turnout.fouling_end_m
            before, beyond = moves.outside(ends_m)
            track = np.where(before | beyond, -1, track_of_row[block.rows])
            if np.count_nonzero(track >= 0) > 1:
                raise_to_depth(front_m, tail_m, block.present, track, ends_m, inside_m)
        return inside_m

    def _rear_m(self, steps: TrainSteps) -> FloatArray:
        """Return the rear that each train shows to the next one: where it may come to a stand."""
        tail_m: FloatArray = steps.front_m - self._world.length_m[steps.rows, np.newaxis]
        if self._separation is not Separation.BRAKING:
            return tail_m
        return tail_m + stands_m(self._survey, steps.rows, steps.front_m, steps.speed_mps)

    def _inside_occupied_m(self, block: StepBlock) -> FloatArray:
        """Return how far each front is in a piece that it entered while a train was in it."""
        inside_m = np.zeros(block.front_m[1:].shape)
        raise_to_entered(
            block.front_m,
            self._world.length_m[block.rows],
            block.present,
            self._enters[block.rows],
            self._ends_m,
            inside_m,
        )
        return inside_m

    def _nearest_m(self, steps: TrainSteps, moves: Moves, rear_m: FloatArray) -> FloatArray:
        """Return the nearest rear ahead among all trains that will use the same track."""
        nearest_m = np.full(steps.front_m.shape, self._world.far_m)
        # Of the first moment only trains count that stay, of the others those that were there.
        present = np.concatenate((steps.present[:, :1], steps.present), axis=1)
        trains = Trains(steps.front_m, self._world.length_m[steps.rows], present)
        for uses, ends_m in self._users:
            before, beyond = moves.outside(ends_m)
            columns = np.flatnonzero(uses[steps.rows] & ~beyond)
            if columns.size > 1 and not before[columns].all():
                nearest_on_track(trains, rear_m, columns, ends_m, nearest_m)
        return nearest_m

    def _extend(self, row: int, kind: str, time_s: float, excess: float) -> None:
        seen = self._open.get((row, kind))
        if seen is not None and time_s - seen[1] < 1.5 * self._world.step_s:
            self._open[row, kind] = (seen[0], time_s, max(seen[2], excess))
            return
        if seen is not None:
            self._closed.append(self._violation((row, kind), seen))
        self._open[row, kind] = (time_s, time_s, excess)

    def _violation(self, key: tuple[int, str], seen: tuple[float, float, float]) -> Violation:
        row, kind = key
        since_s, until_s, excess = seen
        train = self._world.timetable.trains[row]
        lasted = until_s - since_s + self._world.step_s
        bound = {
            "authority": f"could not stop before its end of authority by {excess:.2f} m",
            "spacing": f"could not stop before the train ahead by {excess:.2f} m",
            "block": f"entered an occupied block by {excess:.2f} m",
            "band": f"was permitted {excess:.2f} m beyond the rear of the train ahead",
            "obstruction": f"was {excess:.2f} m inside an obstruction that it may not enter",
            "fouling": f"was {excess:.1f} m inside points that another train was passing",
            "opposing": f"was {excess:.1f} m on a track with a train of another way",
            "buffer": f"ran {excess:.2f} m into the buffer stop",
            "stop": f"ran past its stop by {excess:.2f} m",
            "limit": f"was {3.6 * excess:.1f} km/h above the line limit",
            "margin": f"was permitted {excess:.2f} m into the margin behind the train ahead",
            "grant": f"was permitted {excess:.2f} m further than to what was not free for it",
            "release": f"was permitted {excess:.2f} m further than to what was not released",
            "platform": f"was let {excess:.2f} m into a platform section with another train in it",
            "braking": f"braked {excess:.2f} m/s2 harder than its service brake without need",
            "validity": f"braked {excess:.2f} m/s2 less than in emergency, its commands too old",
            "idle": f"entered a block {excess:.2f} m too late to brake after the idle time",
            "acceleration": f"was {excess:.2f} m/s2 beyond its traction or braking",
        }.get(kind)
        event = {
            "collision": "collided",
            "points": f"entered points {excess:.1f} s or more before they could lie for it",
            "turn_back": f"set off {excess:.1f} s before there was time to turn back",
            "lock": f"was {excess:.1f} m inside points when they were thrown",
            "crossing": f"entered a level crossing {excess:.1f} s before it could be closed",
        }.get(kind)
        message = f"{train} {event}" if event else f"{train} {bound} (for {lasted:.1f} s)"
        return Violation(since_s, row, kind, excess, message)


def _tracks_at_points(world: World) -> list[tuple[Turnout, IntArray]]:
    """Return, for every turnout, on which of the parallel tracks each train passes it."""
    line = world.line
    found: list[tuple[Turnout, IntArray]] = []
    if line.network:
        return found
    for turnout in line.turnouts:
        parallel = max(
            (s for s in line.sections if turnout.position_m in (s.start_m, s.end_m)),
            key=lambda section: len(section.tracks),
        )
        number_of = {track.id: number for number, track in enumerate(parallel.tracks)}
        numbers = [
            next((number_of[track] for track in service.route if track in number_of), -1)
            for service in world.timetable.services
        ]
        found.append((turnout, np.array(numbers, dtype=np.intp)))
    return found
