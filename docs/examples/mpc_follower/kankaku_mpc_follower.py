"""A model-predictive follower: a small linear programme says how fast to run behind a leader."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog

from kankaku import Layer
from kankaku.controllers.options import require
from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight
from kankaku.railway.step.state import NO_REASON, Advice, Authority, LineState

NO_CEILING_MPS = 1e3
INTERVALS = 12
INTERVAL_S = 5.0
"""Length of an interval of the programme: it looks a minute ahead. [s]"""
HALVES = 2
"""Steps of the predicted motion in an interval. [-]"""
TANGENTS_MPS = np.array([4.0, 11.0, 20.0])
"""Where the square of the speed is touched by straight lines. [m/s]"""
FADING = 0.8
"""Traction at the greatest speed is less than at rest by this part. [-]"""
NEAR_M = 1.0
"""A train nearer to its stop than this has arrived. [m]"""
SAME_MPS = 0.2
"""A plan that is slower than the line permits by less than this lowers nothing. [m/s]"""


@dataclass(frozen=True)
class MpcFollowerOptions:
    """What a scenario may set; the unit is in the name."""

    replan_s: float = 3.0
    """Time from one plan to the next one. [s]"""
    time_gap_s: float = 2.0
    """Running time to keep before the end of authority. [s]"""
    braking_weight_s: float = 10.0
    """Way that is given up for braking by 1 m/s less. [m per m/s]"""
    gap_weight: float = 5.0
    """Way that is given up for a metre less of gap that is missing at one moment. [-]"""
    speed_weight_s: float = 5.0
    """Way that is given up for 1 m/s more in the end. [m per m/s]"""

    def __post_init__(self) -> None:
        require("replan_s", self.replan_s, 0.5, 30.0)
        require("time_gap_s", self.time_gap_s, 0.0, 60.0)
        require("braking_weight_s", self.braking_weight_s, 0.0, 1000.0)
        require("gap_weight", self.gap_weight, 0.0, 1000.0)
        require("speed_weight_s", self.speed_weight_s, 0.0, 1000.0)


class FollowerPlan(NamedTuple):
    """What is remembered: the plan of every train, and when to make the next one."""

    made_s: float
    again_s: float
    speed_mps: FloatArray
    """At the ends of the intervals; ``NO_CEILING_MPS`` where none. (INTERVALS + 1, n_trains)"""


class Motion(NamedTuple):
    """Where trains are thought to be at the ends of the intervals; (INTERVALS + 1, n_trains)."""

    front_m: FloatArray
    speed_mps: FloatArray


class MpcFollower:
    """Plans the speeds of every train behind a leader for a minute, again and again."""

    reasons = ("mpc_follower",)

    def __init__(self, world: World, options: MpcFollowerOptions, foresight: Foresight) -> None:
        self._world, self._options, self._foresight = world, options, foresight
        self._rows = np.arange(world.size)
        self._brake_mps2 = world.of_type("service_brake_mps2")
        self._start_mps2 = world.of_type("starting_acceleration_mps2")
        self._top_mps = world.of_type("maximum_speed_mps")
        self._ceiling_mps = foresight.profile.ceiling_mps
        delays = world.expected_delays
        usual_s = float(np.interp(0.5, delays.levels, delays.delays_s)) * delays.scale
        self._dwell_s = world.minimum_dwell_s + min(usual_s, delays.cap_s)
        self._shared = _shared_rows()

    def initial(self) -> FollowerPlan:
        """Return that nothing is planned."""
        none_mps = np.full((INTERVALS + 1, self._world.size), NO_CEILING_MPS)
        return FollowerPlan(-np.inf, -np.inf, none_mps)

    def advise(
        self, state: LineState, authority: Authority, memory: FollowerPlan
    ) -> tuple[Advice, FollowerPlan]:
        """Return the speeds of the plans; make new ones when it is time."""
        if state.time_s >= memory.again_s:
            memory = self._planned(state)
        at = (state.time_s + self._world.step_s - memory.made_s) / INTERVAL_S
        place = min(int(at), INTERVALS - 1)
        start_mps, end_mps = memory.speed_mps[place], memory.speed_mps[place + 1]
        between_mps = start_mps + (at - place) * (end_mps - start_mps)
        # Who speeds up does so as its traction can: only the speed it is to end at counts.
        wanted_mps = np.where(end_mps >= start_mps, end_mps, between_mps)
        lowered = state.running & (wanted_mps < NO_CEILING_MPS)
        ceiling_mps = np.where(lowered, np.maximum(wanted_mps, 0.0), NO_CEILING_MPS)
        reason = np.where(lowered, 0, NO_REASON)
        return Advice(ceiling_mps, reason, authority.eoa_by), memory

    def _planned(self, state: LineState) -> FollowerPlan:
        """Return new plans for all trains."""
        speed_mps = np.full((INTERVALS + 1, self._world.size), NO_CEILING_MPS)
        follows = state.running & state.follows & (state.leader >= 0)
        if follows.any():
            motion = self._predicted(state)
            for row in np.flatnonzero(follows).tolist():
                planned_mps = self._plan(state, motion, row)
                if planned_mps is not None:
                    speed_mps[:, row] = planned_mps
        return FollowerPlan(state.time_s, state.time_s + self._options.replan_s, speed_mps)

    def _predicted(self, state: LineState) -> Motion:
        """Return how all trains run on, each to its stop or behind the train ahead."""
        world, rows, step_s = self._world, self._rows, INTERVAL_S / HALVES
        front_m, speed_mps = state.front_m.copy(), state.speed_mps.copy()
        call, stands = state.next_call.copy(), state.present & ~state.running
        ready_s = np.maximum(state.arrival_s, 0.0) + self._dwell_s[rows, call]
        leaves_s = np.where(stands, np.maximum(ready_s, world.booked_departure_s[rows, call]), 0.0)
        behind = state.follows & state.present & (state.leader >= 0)
        found = [(front_m, speed_mps)]
        for number in range(1, INTERVALS * HALVES + 1):
            now_s = state.time_s + number * step_s
            goes = stands & (leaves_s <= now_s)
            over = goes & (call >= world.call_count - 1)
            front_m = np.where(over & world.leaves_at_stop, world.far_m, front_m)
            call = np.where(goes, np.minimum(call + 1, world.call_count), call)
            stands = stands & ~goes
            stop_m = world.stop_m[rows, call]
            tail_m = front_m[state.leader] - world.length_m[state.leader]
            end_m = np.where(behind, np.minimum(stop_m, tail_m), stop_m)
            next_mps = self._next_mps(front_m, speed_mps, end_m - front_m, step_s)
            next_mps = np.where(stands | ~state.present, 0.0, next_mps)
            front_m = np.minimum(front_m + 0.5 * step_s * (speed_mps + next_mps), world.far_m)
            arrives = state.present & ~stands & (stop_m - front_m < NEAR_M)
            arrives &= call < world.call_count
            booked_s = world.booked_departure_s[rows, call]
            leaves_s = np.where(
                arrives, np.maximum(now_s + self._dwell_s[rows, call], booked_s), leaves_s
            )
            stands = stands | arrives
            speed_mps = np.where(arrives, 0.0, next_mps)
            found.append((front_m, speed_mps))
        fronts, speeds = zip(*found[::HALVES], strict=True)
        return Motion(np.array(fronts), np.array(speeds))

    def _next_mps(
        self, front_m: FloatArray, speed_mps: FloatArray, room_m: FloatArray, step_s: float
    ) -> FloatArray:
        """Return the speed after a step from which every train can still stop in its room."""
        loss_mps = self._brake_mps2 * step_s
        stopping = np.square(loss_mps) + 8.0 * self._brake_mps2 * np.maximum(room_m, 0.0)
        kept_mps = 0.5 * (np.sqrt(stopping) - loss_mps)
        more_mps = self._start_mps2 * (1.0 - FADING * speed_mps / self._top_mps) * step_s
        limit_mps = self._limit_mps(self._world.type_index, front_m)
        next_mps: FloatArray = np.minimum(np.minimum(speed_mps + more_mps, kept_mps), limit_mps)
        return next_mps

    def _limit_mps(self, kind: IntArray | int, front_m: FloatArray) -> FloatArray:
        """Return the ceiling of the line where trains of some types are."""
        column = (front_m - self._foresight.profile.origin_m).astype(np.intp)
        places = np.clip(column, 0, self._ceiling_mps.shape[1] - 1)
        limit_mps: FloatArray = self._ceiling_mps[kind, places]
        return limit_mps

    def _plan(self, state: LineState, motion: Motion, row: int) -> FloatArray | None:
        """Return the speeds of one train; None where its leader is not in the way."""
        leader, call = int(state.leader[row]), int(state.next_call[row])
        leads = motion.front_m[1:, leader], motion.speed_mps[1:, leader]
        end_m = self._foresight.eoa_behind_m(row, call, leader, *leads)
        end_m = np.minimum(end_m, state.granted_to_m[row])
        front_m, speed_mps = float(state.front_m[row]), float(state.speed_mps[row])
        stop_m, brake_mps2 = float(state.stop_m[row]), float(self._brake_mps2[row])
        times_s = INTERVAL_S * np.arange(1, INTERVALS + 1)
        top_mps = float(self._top_mps[row])
        reach_m = front_m + top_mps * times_s + 0.5 * top_mps**2 / brake_mps2
        behind = end_m < stop_m
        if not (behind & (end_m < reach_m)).any():
            return None
        limit_mps = self._limit_mps(int(self._world.type_index[row]), motion.front_m[1:, row])
        # Who is too fast already is slowed by the drive as fast as it can be.
        limit_mps = np.maximum(limit_mps, speed_mps - brake_mps2 * times_s)
        goal_m = self._goal_m(state, row, float(limit_mps.max()))
        ends = np.where(behind, end_m, stop_m) - front_m, behind
        planned_mps = self._solved(row, speed_mps, limit_mps, ends, goal_m - front_m)
        if planned_mps is None:
            return None
        lowers = planned_mps < limit_mps - SAME_MPS
        planned_mps = np.where(lowers, planned_mps, limit_mps + SAME_MPS)
        return np.append(min(speed_mps, limit_mps[0]), planned_mps)

    def _goal_m(self, state: LineState, row: int, limit_mps: float) -> float:
        """Return where a train should be after a minute, so as to arrive as it is booked."""
        booked_s = float(self._world.booked_arrival_s[row, state.next_call[row]])
        stop_m, front_m = float(state.stop_m[row]), float(state.front_m[row])
        horizon_s = INTERVALS * INTERVAL_S
        if not np.isfinite(booked_s):
            return front_m + limit_mps * horizon_s
        braking_s = 0.5 * limit_mps / float(self._brake_mps2[row])
        left_s = max(booked_s - state.time_s - braking_s, 1.0)
        pace_mps = min((stop_m - front_m) / left_s, limit_mps)
        return min(front_m + pace_mps * horizon_s, stop_m)

    def _solved(
        self,
        row: int,
        speed_mps: float,
        limit_mps: FloatArray,
        ends: tuple[FloatArray, BoolArray],
        goal_m: float,
    ) -> FloatArray | None:
        """Return the solution of the linear programme that the README states."""
        (end_m, behind), many = ends, INTERVALS
        brake_mps2, options = float(self._brake_mps2[row]), self._options
        gain_mps = float(self._start_mps2[row]) * INTERVAL_S
        kept = 1.0 - FADING * gain_mps / float(self._top_mps[row])
        way_s, before, one, nobody = self._shared
        speed_up = np.hstack([one - kept * before, nobody, nobody, np.zeros((many, 1))])
        slow_down = np.hstack([before - one, -one, nobody, np.zeros((many, 1))])
        gap_s = np.diag(np.where(behind, options.time_gap_s, 0.0))
        keep_apart = [
            np.hstack([way_s + gap_s + one * w / brake_mps2, nobody, -one, np.zeros((many, 1))])
            for w in TANGENTS_MPS
        ]
        arrive = np.concatenate([-way_s[-1], np.zeros(2 * many), [-1.0]])
        begun_m = 0.5 * INTERVAL_S * speed_mps
        first = np.zeros(many)
        first[0] = speed_mps
        at_most = np.concatenate(
            [
                gain_mps + kept * first,
                -first,
                *(end_m - begun_m + 0.5 * w * w / brake_mps2 for w in TANGENTS_MPS),
                [begun_m - goal_m],
            ]
        )
        costs = np.zeros(3 * many + 1)
        costs[many - 1] = -options.speed_weight_s
        costs[many : 2 * many] = options.braking_weight_s
        costs[2 * many : 3 * many], costs[-1] = options.gap_weight, 1.0
        most = np.full(3 * many + 1, np.inf)
        most[:many], most[many : 2 * many] = limit_mps, brake_mps2 * INTERVAL_S
        found = linprog(
            costs,
            A_ub=np.vstack([speed_up, slow_down, *keep_apart, arrive]),
            b_ub=at_most,
            bounds=[(0.0, value) for value in most.tolist()],
            method="highs-ds",
        )
        # Without a solution nothing is lowered: protection holds anyway.
        if found.status != 0 or found.x is None:
            return None
        return np.array(found.x[:many])


def _shared_rows() -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return what the rows of all programmes are made of; (INTERVALS, INTERVALS) each."""
    one = np.eye(INTERVALS)
    way_s = INTERVAL_S * (np.tril(np.ones((INTERVALS, INTERVALS)), -1) + 0.5 * one)
    return way_s, np.eye(INTERVALS, k=-1), one, np.zeros((INTERVALS, INTERVALS))


LAYER = Layer(MpcFollower, MpcFollowerOptions, "a linear programme plans a minute behind a leader")
