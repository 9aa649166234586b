"""
Safety invariants, checked in every step by code that protection does not share.

The monitor finds leaders by sorting positions on each track, integrates gradients exactly
instead of reading tables, and reads limits from the line itself.
"""

from collections.abc import Callable, Iterator

import numpy as np

from kankaku.railway.arrays import GRAVITY_MPS2, BoolArray, FloatArray, IntArray
from kankaku.railway.plan.line import Turnout
from kankaku.railway.plan.world import World
from kankaku.railway.safety.brakes import Brakes
from kankaku.railway.safety.ground import Ground
from kankaku.railway.safety.handling import Handling
from kankaku.railway.safety.intrusion import Intrusions
from kankaku.railway.safety.movements import Movements
from kankaku.railway.safety.permissions import PERMISSION_KINDS, Permissions
from kankaku.railway.safety.positions import (
    Trains,
    nearest_on_track,
    raise_to_depth,
    raise_to_entered,
)
from kankaku.railway.safety.proofs import Proofs
from kankaku.railway.step.control import Separation, exclusive_pieces
from kankaku.railway.step.obstructions import Obstruction
from kankaku.railway.step.promises import NO_BUFFERS, Promises
from kankaku.railway.step.records import Violation
from kankaku.railway.step.step_block import StepBlock

POSITION_TOLERANCE_M = 0.05
"""Beside b dt^2 / 8, by which a train that stops within a step may pass its aim. [m]"""
STOP_TOLERANCE_M = 0.5
"""A front further beyond its stop than this has missed it. [m]"""
SPEED_TOLERANCE_MPS = 0.01
ACCELERATION_TOLERANCE_MPS2 = 0.02
BRAKING_ROUNDS = 6
HALTING_MPS = 0.1
"""An engine may take this last bit of speed away when a stop begins. [m/s]"""


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
        self._service_mps2 = world.of_type("service_brake_mps2")
        self._emergency_mps2 = world.of_type("emergency_brake_mps2")
        self._maximum_mps = world.of_type("maximum_speed_mps")
        self._gravity_mps2 = GRAVITY_MPS2 * world.of_type("gravity_ratio")
        self._ground, self._brakes = Ground(world), Brakes(world)
        self._users = {
            track.id: [row for row, route in enumerate(routes) if track.id in route]
            for track in world.line.tracks
        }
        self._fouling = _tracks_at_points(world)
        self._movements = Movements(world)
        self._intrusions = Intrusions(
            world, obstructions, self._overrun_m, self._ground, self._brakes, by_radio=by_radio
        )
        self._proofs = Proofs(world)
        self._buffers = NO_BUFFERS if promises is None else promises.buffers
        self._permissions: Permissions | None = None
        self._handling: Handling | None = None
        if promises is not None:
            self._permissions = Permissions(
                world, separation, promises, obstructions, by_radio=by_radio
            )
            looked_at = kept, self._overrun_m, self._ground, self._brakes
            self._handling = Handling(world, promises, *looked_at)
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
        for kind, excess, tolerance in self._bounds_passed(block):
            # What a train that is held may do next is a promise, too.
            judged = block.present if kind in PERMISSION_KINDS else block.moving
            # Not-a-number passes every bound.
            passed: BoolArray = judged & ~(excess <= tolerance)
            for step, column in np.argwhere(passed).tolist():
                time_s = float(block.time_s[step + 1])
                self._extend(int(block.rows[column]), kind, time_s, float(excess[step, column]))
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

    def _bounds_passed(self, block: StepBlock) -> Iterator[tuple[str, FloatArray, float]]:
        """Yield by how much each bound is passed, and how much is only discretisation."""
        front_m, speed_mps = block.front_m[1:], block.speed_mps[1:]
        eoa_m, rows = block.eoa_m[:-1], block.rows
        strongest = float(self._service_mps2.max())
        near_m = POSITION_TOLERANCE_M + strongest * self._world.step_s**2 / 8.0
        ahead_m = front_m + speed_mps * block.delay_s[:-1]
        # Nothing holds a train that a sudden obstruction comes too near to but this very thing,
        # and nobody who stands overruns anything.
        excused = block.surprised[:-1] | ((speed_mps == 0.0) & (block.speed_mps[:-1] == 0.0))
        overrun_m = self._overrun_m(ahead_m, speed_mps, eoa_m, rows)
        rising_m = self._rising_m(block) if self._brakes.build_up else np.zeros(1)
        overrun_m += rising_m
        if self._buffers.delay_s > 0.0:
            overrun_m -= self._ahead_of_slope_m(front_m, ahead_m, rows)
        yield "authority", np.where(excused, -np.inf, overrun_m), near_m
        rear_m = self._rear_m(block)
        nearest_m = self._nearest_m(block, rear_m)
        next_rear_m = nearest_m[1:]
        if self._separation is not Separation.BRAKING:
            beyond_m = eoa_m - np.maximum(next_rear_m, block.front_m[:-1])
            yield "band", beyond_m, POSITION_TOLERANCE_M
        beyond_m = self._overrun_m(front_m, speed_mps, next_rear_m, rows) + rising_m
        yield "spacing", beyond_m, near_m
        if self._exclusive:
            yield "block", self._inside_occupied_m(block), 0.0
        yield "fouling", self._inside_fouling_m(block), 0.0
        if self._world.line.network:
            for kind, inside_m in self._movements.inside_m(block):
                yield kind, inside_m, 0.0
        yield "obstruction", self._intrusions.inside_m(block, near_m), 0.0
        yield "stop", front_m - self._world.stop_m[rows, block.next_call[1:]], STOP_TOLERANCE_M
        yield "limit", speed_mps - self._limit_mps(front_m, rows), SPEED_TOLERANCE_MPS
        excess = self._acceleration_excess_mps2(block)
        yield "acceleration", excess, ACCELERATION_TOLERANCE_MPS2
        if self._permissions:
            if not self._buffers.none:
                rear_m = rear_m - self._buffers.rear_buffer_m(block.front_m)
                nearest_m = self._nearest_m(block, rear_m)
            yield from self._permissions.beyond_m(block, rear_m, nearest_m, self._proofs)
        if self._handling:
            harder = excess > ACCELERATION_TOLERANCE_MPS2
            for kind, beyond, tolerance in self._handling.beyond(block):
                # Who brakes harder than in emergency is named once.
                yield kind, np.where(harder, -np.inf, beyond), tolerance

    def _inside_fouling_m(self, block: StepBlock) -> FloatArray:
        """Return how far each front is in a fouling section that another track's train is in."""
        inside_m = np.zeros(block.front_m[1:].shape)
        front_m = block.front_m[1:]
        tail_m = front_m - self._world.length_m[block.rows]
        for turnout, track_of_row in self._fouling:
            ends_m = turnout.fouling_start_m, turnout.fouling_end_m
            track = track_of_row[block.rows]
            raise_to_depth(front_m, tail_m, block.present, track, ends_m, inside_m)
        return inside_m

    def _overrun_m(
        self, front_m: FloatArray, speed_mps: FloatArray, eoa_m: FloatArray, rows: IntArray
    ) -> FloatArray:
        brake = self._service_mps2[rows]
        lift_m = self._ground.mean_height_m(eoa_m, rows) - self._ground.mean_height_m(front_m, rows)
        available = brake * (eoa_m - front_m) + self._brakes.gravity_mps2(rows) * lift_m
        overrun: FloatArray = (0.5 * np.square(speed_mps) - available) / brake
        return overrun

    def _rising_m(self, block: StepBlock) -> FloatArray:
        """Return how much further trains run because their service brakes build up."""
        speed_mps = block.speed_mps[1:]
        slope = self._ground.rises_m(block.front_m[1:], block.rows)
        slope /= self._world.length_m[block.rows]
        gained_mps2 = (speed_mps - block.speed_mps[:-1]) / self._world.step_s
        return self._brakes.rising_m(slope, speed_mps, gained_mps2, block.rows)

    def _ahead_of_slope_m(
        self, front_m: FloatArray, ahead_m: FloatArray, rows: IntArray
    ) -> FloatArray:
        """Return what brakes gain or lose because the gradient counts where a front is now."""
        length_m, gravity = self._world.length_m[rows], self._brakes.gravity_mps2(rows)
        slope = self._ground.rises_m(front_m, rows) / length_m
        rise_m = self._ground.mean_height_m(ahead_m, rows)
        rise_m -= self._ground.mean_height_m(front_m, rows)
        unlike_m: FloatArray = np.abs(rise_m - slope * (ahead_m - front_m))
        return unlike_m * gravity / self._service_mps2[rows]

    def _rear_m(self, block: StepBlock) -> FloatArray:
        """Return the rear that each train shows to the next one: where it may come to a stand."""
        front_m, length_m = block.front_m, self._world.length_m[block.rows]
        tail_m: FloatArray = front_m - length_m
        if self._separation is not Separation.BRAKING:
            return tail_m
        energy = 0.5 * np.square(block.speed_mps)
        gravity = self._brakes.gravity_mps2(block.rows)
        emergency = self._emergency_mps2[block.rows]
        here_m = self._ground.mean_height_m(front_m, block.rows)
        braking_m = energy / emergency
        # Gradients are a tenth of the brake at most, so each round leaves a tenth of the error.
        for _ in range(BRAKING_ROUNDS):
            there_m = self._ground.mean_height_m(front_m + braking_m, block.rows)
            braking_m = (energy - gravity * (there_m - here_m)) / emergency
        return tail_m + braking_m

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

    def _nearest_m(self, block: StepBlock, rear_m: FloatArray) -> FloatArray:
        """Return the nearest rear ahead among all trains that will use the same track."""
        nearest_m = np.full(block.front_m.shape, self._world.far_m)
        # Of the first moment only trains count that stay, of the others those that were there.
        present = np.concatenate((block.present[:1], block.present))
        column_of = {row: column for column, row in enumerate(block.rows.tolist())}
        for track, users in self._users.items():
            columns = np.array([column_of[row] for row in users if row in column_of], dtype=np.intp)
            if columns.size > 1:
                place = self._world.line.track_by_id[track]
                nearest_on_track(
                    Trains(block.front_m, self._world.length_m[block.rows], present),
                    rear_m,
                    columns,
                    (place.start_m, place.end_m),
                    nearest_m,
                )
        return nearest_m

    def _limit_mps(self, front_m: FloatArray, rows: IntArray) -> FloatArray:
        lowest = np.broadcast_to(self._maximum_mps[rows], front_m.shape).copy()
        self._ground.lower_to_limits(lowest, front_m, rows)
        return lowest

    def _acceleration_excess_mps2(self, block: StepBlock) -> FloatArray:
        rows = block.rows
        before, after = block.speed_mps[:-1], block.speed_mps[1:]
        halted = np.where(block.halting, np.minimum(before, HALTING_MPS), 0.0)
        acceleration = (after + halted - before) / self._world.step_s
        slope = self._slope_over_step(block)
        slower, faster = np.minimum(before, after), np.maximum(before, after)
        strongest = np.empty_like(before)
        for index, kind in enumerate(self._world.train_types):
            columns = np.flatnonzero(self._world.type_index[rows] == index)
            strongest[:, columns] = kind.level_acceleration_mps2(slower[:, columns])
        too_strong = acceleration - (strongest - self._gravity_mps2[rows] * slope.min(axis=0))
        emergency_mps2, steepest = self._emergency_mps2[rows], slope.max(axis=0)
        hardest = self._brakes.strongest_mps2(emergency_mps2, steepest, faster, rows)
        too_hard = -hardest - acceleration
        # The brake holds whoever stands, on any gradient.
        too_strong[after == 0.0] = -np.inf
        too_hard[(before == 0.0) & (after == 0.0)] = -np.inf
        excess: FloatArray = np.maximum(too_strong, too_hard)
        return excess

    def _slope_over_step(self, block: StepBlock) -> FloatArray:
        """Return the gradient under trains at the start, middle and end of each step."""
        length_m = self._world.length_m[block.rows]
        start_m, end_m = block.front_m[:-1], block.front_m[1:]
        front_m = np.array([start_m, 0.5 * (start_m + end_m), end_m])
        rise = self._ground.rises_m(front_m, block.rows)
        slope: FloatArray = rise / length_m
        return slope

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
