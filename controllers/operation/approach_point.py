"""
Approach-point control: the shortest departure-to-arrival interval (Sakai et al. 2020).

Nobody knows when the leader will depart until it does. So the follower (i) runs to the
timetable at first; (ii) some time after the leader's booked departure it brakes, as late as it
can, to the optimal stop, from which it can still run in best; (iii) at the leader's departure,
whose further run is known, it runs so as to pass the approach point at the very moment when
the way is free; (iv) and from there as fast as it may.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kankaku.controllers.operation.approach_plan import (
    ApproachPoint,
    Site,
    approach_point,
    plan_passing,
)
from kankaku.controllers.operation.close_up import NO_CEILING_MPS, no_advice
from kankaku.controllers.options import require
from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import Plain, count_up_to, formula, plain
from kankaku.railway.motion.kinematics import next_speed_mps
from kankaku.railway.motion.run_curve import RunCurve, fastest
from kankaku.railway.motion.way import way_on
from kankaku.railway.plan.brake_table import BrakeTable, braking_loss_mps, braking_v2_at
from kankaku.railway.plan.profile import Profile
from kankaku.railway.plan.world import World
from kankaku.railway.step.bundles import LayerSteps
from kankaku.railway.step.control import Foresight
from kankaku.railway.step.state import NO_REASON, Advice, Authority, LineState, Whereabouts

OPTIMAL_STOP, APPROACH = 0, 1
LOOK_AHEAD_M = 1500.0
"""So far a leader is followed when it departs. [m]"""
MOMENT_M = 0.1
"""Spacing of the leader's places at which the authority behind it is asked for. [m]"""
MISSED_M2PS2 = 1.0
"""Twice the work of braking over half a metre. [m2/s2]"""


@dataclass(frozen=True, slots=True)
class ApproachPointOptions:
    """Options of approach-point control."""

    patience_s: float = 0.0
    """How long after the leader's booked departure the timetable run goes on. [s]"""

    def __post_init__(self) -> None:
        require("patience_s", self.patience_s, -3600.0, 3600.0)


class ApproachPlans(NamedTuple):
    """What every train is about to do; arrays of shape (n_trains,) but the last ones."""

    call: IntArray
    """The call that the plan is for; -1 without a plan."""
    leader: IntArray
    """The leader that it is for."""
    stop_m: FloatArray
    """Brake to a stand here [m] ..."""
    stop_from_s: FloatArray
    """... from this time on [s] ..."""
    run_from_s: FloatArray
    """... until the curve is to be followed ... [s]"""
    run_until_s: FloatArray
    """... and until then at the latest, wherever the train is. [s]"""
    left_call: IntArray
    """The last call that the train has departed from; -1 before the first."""
    left_s: FloatArray
    """When that was. [s]"""
    curves: tuple[FloatArray | None, ...]
    """Chainage [m], speed [m/s] and time [s] of each curve. shape (3, n_points) each"""
    pieces: IntArray
    """First and last point of each curve below. shape (2, n_trains)"""
    points: FloatArray
    """All curves, one after the other. shape (3, n_points)"""
    begins_s: float
    """Before this moment no plan asks for anything. [s]"""


class Followed(NamedTuple):
    """What steps need of :class:`ApproachPlans`."""

    stop_m: FloatArray
    stop_from_s: FloatArray
    run_from_s: FloatArray
    run_until_s: FloatArray
    pieces: IntArray
    points: FloatArray


class Near(NamedTuple):
    """A site and its approach point."""

    site: Site
    point: ApproachPoint


class ApproachPointControl:
    """Approach-point control over any protection."""

    reasons = ("optimal_stop", "approach")

    def __init__(self, world: World, options: ApproachPointOptions, foresight: Foresight) -> None:
        self._world = world
        self._patience_s = options.patience_s
        self._foresight = foresight
        self._braking = plain(world.braking)
        self._nothing = no_advice(world.size)
        # What has been worked out once holds for all trains of these types at a platform.
        self._known: dict[tuple[object, ...], Near | None] = {}

    def initial(self) -> ApproachPlans:
        """Return the memory before the first step: no train has a plan."""
        size = self._world.size
        return _with_curves(
            ApproachPlans(
                call=np.full(size, -1, dtype=np.intp),
                leader=np.full(size, -1, dtype=np.intp),
                stop_m=np.full(size, self._world.far_m),
                stop_from_s=np.full(size, np.inf),
                run_from_s=np.full(size, np.inf),
                run_until_s=np.full(size, np.inf),
                left_call=np.full(size, -1, dtype=np.intp),
                left_s=np.full(size, np.nan),
                curves=(None,) * size,
                pieces=np.zeros((2, size), dtype=np.intp),
                points=np.zeros((3, 0)),
                begins_s=np.inf,
            ),
            {},
        )

    def advise(
        self, state: LineState, authority: Authority, memory: ApproachPlans
    ) -> tuple[Advice, ApproachPlans]:
        """Return the advice for every train."""
        if state.events:
            memory = self._plan(state, memory)
        told = self._untold(memory)
        _advise(state.instant, tuple(authority[:5]), self._fields(memory), (), (), told)
        return Advice(*told), memory

    def _fields(self, memory: ApproachPlans) -> Plain:
        asked = (
            memory.stop_m,
            memory.stop_from_s,
            memory.run_from_s,
            memory.run_until_s,
            memory.pieces,
            memory.points,
        )
        return asked, (self._braking, self._world.step_s, memory.begins_s)

    def _untold(self, memory: ApproachPlans) -> Plain:
        """Return the advice before any was told; nothing is for anybody before it begins."""
        return self._nothing.ceiling_mps.copy(), self._nothing.reason.copy(), memory.leader

    def steps(self, state: LineState, memory: ApproachPlans) -> LayerSteps:
        """Return the compiled step."""
        del state
        told = self._untold(memory)
        return LayerSteps(_advise, self._fields(memory), (), told, np.inf)

    def resumed(self, memory: ApproachPlans, after: Plain) -> ApproachPlans:
        """Return the memory after a bundle of steps."""
        del after
        return memory

    def _plan(self, state: LineState, memory: ApproachPlans) -> ApproachPlans:
        """Plan for those whom the events concern."""
        events, follows = state.events, state.running & state.follows
        due = follows & ((memory.call < 0) | (memory.leader != state.leader))
        for row in events.departed:
            due |= follows & (state.leader == row)
        over = (memory.call >= 0) & ((memory.call != state.next_call) | ~state.running)
        # A leader that ends its service in the platform never leaves it: it is gone.
        over |= np.isfinite(memory.stop_from_s) & (memory.leader != state.leader)
        if not (events.departed or due.any() or over.any()):
            return memory
        memory = memory._replace(
            call=memory.call.copy(),
            leader=memory.leader.copy(),
            stop_m=memory.stop_m.copy(),
            stop_from_s=memory.stop_from_s.copy(),
            run_from_s=memory.run_from_s.copy(),
            run_until_s=memory.run_until_s.copy(),
            left_call=memory.left_call.copy(),
            left_s=memory.left_s.copy(),
        )
        for row in events.departed:
            memory.left_call[row] = state.next_call[row] - 1
            # The departure is seen one step after it began.
            memory.left_s[row] = state.time_s - self._world.step_s
        curves: dict[int, FloatArray | None] = {}
        for row in np.flatnonzero(over).tolist():
            curves[row] = None
            self._forget(memory, row)
            memory.call[row] = -1
        for row in np.flatnonzero(due).tolist():
            leader = int(state.leader[row])
            leaders_call = self._leaders_call(state, row, leader)
            if leaders_call is None:
                continue
            memory.call[row], memory.leader[row] = state.next_call[row], leader
            curves[row] = None
            self._forget(memory, row)
            if memory.left_call[leader] >= leaders_call:
                curves[row] = self._run_in(state, memory, row, leaders_call)
            else:
                self._stop_outside(state, memory, row, leaders_call)
        begins_s = min(memory.stop_from_s.min(), memory.run_from_s.min())
        memory = memory._replace(begins_s=float(begins_s))
        return _with_curves(memory, curves) if curves else memory

    def _leaders_call(self, state: LineState, row: int, leader: int) -> int | None:
        """Return the leader's next or last call, if it is at the platform that a train runs to."""
        world, next_call = self._world, int(state.next_call[leader])
        track = world.call_track[row, state.next_call[row]]
        for call in (next_call, next_call - 1):
            if 0 <= call < world.call_count[leader]:
                same_track = world.call_track[leader, call] == track
                if same_track and world.stop_m[leader, call] == state.stop_m[row]:
                    return call
        return None

    def _stop_outside(
        self, state: LineState, memory: ApproachPlans, row: int, leaders_call: int
    ) -> None:
        """Rule (ii): brake to the optimal stop some time after the booked departure."""
        leader = int(state.leader[row])
        near = self._near(state, row, leaders_call)
        if near is not None:
            booked_s = self._world.booked_departure_s[leader, leaders_call]
            memory.stop_m[row] = near.point.optimal_stop_m
            memory.stop_from_s[row] = booked_s + self._patience_s

    def _run_in(
        self, state: LineState, memory: ApproachPlans, row: int, leaders_call: int
    ) -> FloatArray | None:
        """Rule (iii): pass the approach point when the way is free."""
        near = self._near(state, row, leaders_call)
        if near is None:
            return None
        # That the way is free is seen at the end of a step.
        step_s = self._world.step_s
        until_s = float(memory.left_s[state.leader[row]]) + near.point.passed_s - state.time_s
        left_s = float(np.ceil(until_s / step_s)) * step_s
        if left_s <= 0.0:
            return None
        front_m, speed_mps = float(state.front_m[row]), float(state.speed_mps[row])
        passing = plan_passing(near.site, near.point, front_m, speed_mps, left_s)
        if passing is None:
            return None
        memory.stop_m[row], memory.stop_from_s[row] = passing.stop_m, -np.inf
        memory.run_from_s[row] = state.time_s + passing.wait_s
        memory.run_until_s[row] = memory.run_from_s[row] + passing.curve.run_time_s
        return np.array([passing.curve.chainage_m, passing.curve.speed_mps, passing.curve.time_s])

    def _forget(self, memory: ApproachPlans, row: int) -> None:
        memory.stop_m[row] = self._world.far_m
        memory.stop_from_s[row] = memory.run_from_s[row] = np.inf

    def _near(self, state: LineState, row: int, leaders_call: int) -> Near | None:
        """Return the site of a train behind its leader, if there is an approach point."""
        world, leader = self._world, int(state.leader[row])
        kinds = int(world.type_index[row]), int(world.type_index[leader])
        next_stop_m = float(world.stop_m[leader, leaders_call + 1])
        own_call = int(state.next_call[row])
        key = (*kinds, int(world.call_track[row, own_call]), float(state.stop_m[row]), next_stop_m)
        if key not in self._known:
            site = self._site(row, own_call, leader, (float(state.stop_m[row]), next_stop_m))
            point = approach_point(site)
            self._known[key] = None if point is None else Near(site, point)
        return self._known[key]

    def _site(self, row: int, call: int, leader: int, leaders_m: tuple[float, float]) -> Site:
        world, profile = self._world, self._foresight.profile
        kind, ahead = int(world.type_index[row]), int(world.type_index[leader])
        away = leaving(world, profile, ahead, leaders_m)
        fronts_m = np.arange(leaders_m[0], away.chainage_m[-1], MOMENT_M)
        speeds_mps = np.interp(fronts_m, away.chainage_m, away.speed_mps)
        eoas_m = self._foresight.eoa_behind_m(row, call, leader, fronts_m, speeds_mps)
        permitted_after_s = away.time_s + self._foresight.release_delay_s
        return Site(
            profile=profile,
            row=kind,
            train_type=world.driven_types[kind],
            stop_m=leaders_m[0],
            delay_s=self._foresight.delay_s,
            eoa_m=np.maximum.accumulate(eoas_m),
            since_departure_s=np.interp(fronts_m, away.chainage_m, permitted_after_s),
        )


def leaving(world: World, profile: Profile, kind: int, stops_m: tuple[float, float]) -> RunCurve:
    """
    Return the run of a leader away from its platform.

    Parameters
    ----------
    world
        The trains.
    profile
        The line as they are driven on it.
    kind
        Row of the leader's type.
    stops_m
        Where it stands, and its next stop. [m]

    Returns
    -------
    RunCurve
        As fast as it may, as far as followers are concerned.
    """
    from_m, next_m = stops_m
    to_m = min(next_m, from_m + LOOK_AHEAD_M)
    return fastest(way_on(profile, kind, world.driven_types[kind], (from_m, to_m)))


def _with_curves(memory: ApproachPlans, changed: dict[int, FloatArray | None]) -> ApproachPlans:
    """Lay all curves one after the other, as the steps want them."""
    curves = tuple(changed.get(row, curve) for row, curve in enumerate(memory.curves))
    kept = [curve for curve in curves if curve is not None]
    ends = np.cumsum([0 if curve is None else curve.shape[1] for curve in curves])
    pieces = np.array([np.append(0, ends[:-1]), ends])
    points = np.hstack(kept) if kept else np.zeros((3, 0))
    return memory._replace(curves=curves, pieces=pieces, points=points)


@formula
def _follow(
    whereabouts: Plain,
    plan_fields: Plain,
    brake_fields: Plain,
    clock: tuple[float, float],
    found: tuple[FloatArray, IntArray],
) -> None:
    """Write ceilings, and why."""
    trains, plans, braking = (
        Whereabouts(*whereabouts),
        Followed(*plan_fields),
        BrakeTable(*brake_fields),
    )
    (now_s, step_s), (ceiling_mps, reason) = clock, found
    for train in trains.rows:
        ceiling_mps[train], reason[train] = NO_CEILING_MPS, NO_REASON
        front_m, speed = trains.front_m[train], trains.speed_mps[train]
        if now_s >= plans.run_from_s[train]:
            first, last = plans.pieces[0, train], plans.pieces[1, train]
            if now_s < plans.run_until_s[train] and front_m < plans.points[0, last - 1]:
                along = plans.points[:, first:last]
                ceiling_mps[train] = _next_on_curve_mps(along, front_m, step_s)
                reason[train] = APPROACH
        elif now_s >= plans.stop_from_s[train]:
            loss = braking_loss_mps(braking, train, front_m, speed, step_s)
            left = braking_v2_at(braking, train, plans.stop_m[train])
            left -= braking_v2_at(braking, train, front_m)
            # Who can no longer stop there goes on as far as it may.
            if speed * speed <= left + MISSED_M2PS2:
                ceiling_mps[train] = next_speed_mps(speed, left, loss, 0.0)
                reason[train] = OPTIMAL_STOP


@formula
def _advise(
    instant: Plain,
    _authority: Plain,
    fields: Plain,
    _memory: Plain,
    _after: Plain,
    told: Plain,
) -> bool:
    now_s, whereabouts, _, _ = instant
    asked, (braking, step_s, begins_s) = fields
    if now_s >= begins_s:
        _follow(whereabouts, asked, braking, (now_s, step_s), (told[0], told[1]))
    return False


@formula
def _next_on_curve_mps(curve: FloatArray, front_m: float, step_s: float) -> float:
    """Return the speed that a curve has one step after the place of the front."""
    chainage_m, speed_mps, time_s = curve
    cell = max(count_up_to(chainage_m, front_m) - 1, 0)
    length_m = chainage_m[cell + 1] - chainage_m[cell]
    share = min(max((front_m - chainage_m[cell]) / length_m, 0.0), 1.0)
    squares = speed_mps[cell] ** 2 + share * (speed_mps[cell + 1] ** 2 - speed_mps[cell] ** 2)
    mean_mps = 0.5 * (speed_mps[cell] + np.sqrt(squares))
    then_s = time_s[cell] + step_s
    if share > 0.0:
        then_s += share * length_m / mean_mps
    while cell < time_s.size - 2 and time_s[cell + 1] < then_s:
        cell += 1
    lasts_s = time_s[cell + 1] - time_s[cell]
    part = min((then_s - time_s[cell]) / lasts_s, 1.0)
    speed: float = speed_mps[cell] + part * (speed_mps[cell + 1] - speed_mps[cell])
    return speed
