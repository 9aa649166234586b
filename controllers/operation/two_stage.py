"""
Two-stage deceleration with pre-deceleration (Sato et al. 2025).

Stage one: towards a leader that stands, brake so gently that, should it depart now, the
present speed could be held for good (eq. 16). When it departs, hold that speed until its
path bends away (eq. 14), then run on; stage two is the ordinary stop in the platform.
Here the leader's own speed is part of the formula, so that a leader that crawls or stands
between stations is treated like one in a platform, all the way back along the queue.

Pre-deceleration: while the leader cannot have left the next station yet (booked departure
and minimum dwell are known, the dwell delay is not), the time would be lost anyway. The
follower runs slower and speeds up again so as to begin stage one as fast as it can at the
moment the leader may depart.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kankaku.controllers.forecast import DepartureForecast, waits_for_leader
from kankaku.controllers.operation.close_up import NO_CEILING_MPS
from kankaku.controllers.operation.pre_deceleration import Approach, Slowing, slow_down
from kankaku.controllers.options import require
from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import Plain, formula
from kankaku.railway.motion.kinematics import (
    braking_distance_m,
    two_stage_brake_mps2,
    two_stage_speed_mps,
)
from kankaku.railway.plan.world import World
from kankaku.railway.step.bundles import Lasting, LayerSteps
from kankaku.railway.step.control import Foresight
from kankaku.railway.step.state import Advice, Authority, LineState, Whereabouts

TWO_STAGE, PRE_DECELERATION = 0, 1


@dataclass(frozen=True, slots=True)
class TwoStageOptions:
    """Options of two-stage deceleration."""

    slowest_kmh: float = 15.0
    """Pre-deceleration goes no slower than this. [km/h]"""
    least_gain_s: float = 5.0
    """Waits shorter than this are not worth a pre-deceleration. [s]"""

    def __post_init__(self) -> None:
        require("slowest_kmh", self.slowest_kmh, 1.0, 100.0)
        require("least_gain_s", self.least_gain_s, 0.0, 600.0)


class TwoStagePlans(NamedTuple):
    """The pre-decelerations under way, shape (n_trains,), and when the first one ends."""

    ceiling_mps: FloatArray
    next_release_s: float


class TwoStage:
    """Two-stage deceleration over any protection."""

    reasons = ("two_stage", "pre_deceleration")

    def __init__(
        self,
        world: World,
        options: TwoStageOptions,
        foresight: Foresight,
        *,
        pre_deceleration: bool = True,
    ) -> None:
        self._world = world
        self._options = options
        self._pre_deceleration = pre_deceleration
        self._step_s = world.step_s
        # One a and b for all: the slowest starter ahead and the weakest brake behind.
        self._forecast = forecast = DepartureForecast(world)
        self._acceleration_mps2, self._brake_mps2 = forecast.acceleration_mps2, forecast.brake_mps2
        self._first_stage_mps2 = two_stage_brake_mps2(self._acceleration_mps2, self._brake_mps2)
        self._foresight = foresight
        self._ceiling_mps = foresight.profile.ceiling_mps

    def initial(self) -> TwoStagePlans:
        """Return the memory before the first step: no train is pre-decelerating."""
        return TwoStagePlans(np.full(self._world.size, NO_CEILING_MPS), np.inf)

    def advise(
        self, state: LineState, authority: Authority, memory: TwoStagePlans
    ) -> tuple[Advice, TwoStagePlans]:
        """Return the advice for every train."""
        if self._pre_deceleration and (state.events or state.time_s >= memory.next_release_s):
            memory = self._plan(state)
        told = self._untold(state, memory)
        _advise(state.instant, tuple(authority[:5]), self._fields(memory), (), (), told)
        return Advice(*told), memory

    def _fields(self, memory: TwoStagePlans) -> Plain:
        return memory.ceiling_mps, (self._acceleration_mps2, self._brake_mps2, self._step_s)

    def _untold(self, state: LineState, memory: TwoStagePlans) -> Plain:
        """Return the advice before any was told."""
        reason = np.full(self._world.size, PRE_DECELERATION, dtype=np.intp)
        return memory.ceiling_mps.copy(), reason, state.leader.copy()

    def steps(self, state: LineState, memory: TwoStagePlans) -> LayerSteps:
        """Return the compiled step."""
        until_s = memory.next_release_s if self._pre_deceleration else np.inf
        told = self._untold(state, memory)
        return LayerSteps(_advise, self._fields(memory), (), told, until_s)

    def resumed(self, memory: TwoStagePlans, after: Plain) -> TwoStagePlans:
        """Return the memory after a bundle of steps."""
        del after
        return memory

    def _plan(self, state: LineState) -> TwoStagePlans:
        """Plan every train anew."""
        world, now_s = self._world, state.time_s
        ceiling = np.full(world.size, NO_CEILING_MPS)
        next_release_s = np.inf
        wait_s = self._forecast.earliest_departures_s(state).take(state.leader) - now_s
        waits = waits_for_leader(world, state) & state.running
        worth = waits & (wait_s > self._options.least_gain_s)
        for row in np.flatnonzero(worth).tolist():
            slowing = self._slowing(state, row, float(wait_s[row]))
            if slowing is not None and slowing.lasts_s > 0.0:
                ceiling[row] = slowing.ceiling_mps
                next_release_s = min(next_release_s, now_s + slowing.lasts_s)
        return TwoStagePlans(ceiling, next_release_s)

    def _slowing(self, state: LineState, row: int, wait_s: float) -> Slowing | None:
        world, kind = self._world, int(self._world.type_index[row])
        leader, call = int(state.leader[row]), int(state.next_call[row])
        stands_m = state.stop_m[[leader]], np.zeros(1)
        rear_m = float(self._foresight.eoa_behind_m(row, call, leader, *stands_m)[0])
        entry_m = max(rear_m - self._first_stage_m(kind, rear_m), float(state.front_m[row]))
        cell = int(entry_m - world.profile.origin_m)
        return slow_down(
            Approach(
                distance_m=rear_m - float(state.front_m[row]),
                speed_mps=float(state.speed_mps[row]),
                fastest_mps=float(self._ceiling_mps[kind, cell]),
                slowest_mps=self._options.slowest_kmh / 3.6,
                first_stage_mps2=self._first_stage_mps2,
                service_brake_mps2=self._brake_mps2,
                run_up=self._forecast.run_up[kind],
            ),
            wait_s,
        )

    def _first_stage_m(self, kind: int, rear_m: float) -> float:
        top = float(self._ceiling_mps[kind, int(rear_m - self._world.profile.origin_m)])
        return float(braking_distance_m(top, self._first_stage_mps2))


@formula
def _advise(
    instant: Plain,
    authority: Plain,
    fields: Plain,
    _memory: Plain,
    _after: Plain,
    told: Plain,
) -> bool:
    """Write ceilings, why, and for what."""
    _, whereabouts, _, lasting = instant
    trains, known = Whereabouts(*whereabouts), Lasting(*lasting)
    eoa_m, eoa_by, (ceiling_mps, reason, cause) = authority[0], authority[3], told
    planned_mps, (acceleration_mps2, brake_mps2, step_s) = fields
    front_m, speed_mps = trains.front_m, trains.speed_mps
    stop_m, leader, follows = known.stop_m, known.leader, known.follows
    for train in trains.rows:
        ceiling_mps[train], reason[train] = planned_mps[train], PRE_DECELERATION
        cause[train] = leader[train]
        # Who stops at a platform before the obstacle need not mind it yet.
        if eoa_m[train] >= stop_m[train]:
            continue
        # What is still to come from another track does not move out of the way.
        leader_mps = speed_mps[leader[train]] if follows[train] else 0.0
        gap_m = eoa_m[train] - front_m[train] - speed_mps[train] * step_s
        held_mps = two_stage_speed_mps(gap_m, leader_mps, acceleration_mps2, brake_mps2)
        if held_mps <= ceiling_mps[train]:
            ceiling_mps[train] = held_mps
            reason[train], cause[train] = TWO_STAGE, eoa_by[train]
    return False
