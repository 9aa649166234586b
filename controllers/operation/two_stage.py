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

from controllers.operation.close_up import NO_CEILING_MPS
from controllers.operation.pre_deceleration import Approach, RunUp, Slowing, slow_down
from controllers.options import OptionError
from railway.arrays import BoolArray, FloatArray, IntArray
from railway.compiled import compiled
from railway.kinematics import two_stage_brake_mps2, two_stage_speed_mps
from railway.state import Advice, Authority, LineState, Reason
from railway.world import World

# Plain numbers, as compiled functions want them.
TWO_STAGE = int(Reason.TWO_STAGE)
PRE_DECELERATION = int(Reason.PRE_DECELERATION)


@dataclass(frozen=True, slots=True)
class TwoStageOptions:
    """Options of two-stage deceleration."""

    slowest_kmh: float = 15.0
    """Pre-deceleration goes no slower than this. [km/h]"""
    least_gain_s: float = 5.0
    """Waits shorter than this are not worth a pre-deceleration. [s]"""

    def __post_init__(self) -> None:
        if self.slowest_kmh <= 0.0:
            problem = f"slowest_kmh is {self.slowest_kmh:g}"
            raise OptionError(problem, "more than 0 km/h")
        if self.least_gain_s < 0.0:
            problem = f"least_gain_s is {self.least_gain_s:g}"
            raise OptionError(problem, "0 or more seconds")


class Plans(NamedTuple):
    """The pre-decelerations under way, shape (n_trains,), and when the first one ends."""

    ceiling_mps: FloatArray
    release_s: FloatArray
    next_release_s: float


class TwoStage:
    """Two-stage deceleration over any protection."""

    def __init__(
        self, world: World, options: TwoStageOptions, *, pre_deceleration: bool = True
    ) -> None:
        self._world = world
        self._options = options
        self._pre_deceleration = pre_deceleration
        self._step_s = world.step_s
        starts = [float(kind.level_acceleration_mps2(np.zeros(1))[0]) for kind in world.train_types]
        # One a and b for all: the slowest starter ahead and the weakest brake behind.
        self._acceleration_mps2 = min(starts)
        self._brake_mps2 = min(kind.service_brake_mps2 for kind in world.train_types)
        self._first_stage_mps2 = two_stage_brake_mps2(self._acceleration_mps2, self._brake_mps2)
        self._run_up = [RunUp.of(kind) for kind in world.train_types]
        ceiling = np.sqrt(2.0 * world.profile.ceiling_m2ps2)
        self._ceiling_mps = ceiling
        self._travel_s = np.cumsum(1.0 / ceiling, axis=1)

    def initial(self) -> Plans:
        """
        Return the memory before the first step.

        Returns
        -------
        Plans
            No train is pre-decelerating.
        """
        size = self._world.size
        return Plans(np.full(size, NO_CEILING_MPS), np.full(size, np.inf), np.inf)

    def advise(self, state: LineState, authority: Authority, memory: Plans) -> tuple[Advice, Plans]:
        """
        Return the advice for every train.

        Parameters
        ----------
        state
            The line.
        authority
            What protection permits.
        memory
            Pre-decelerations under way.

        Returns
        -------
        tuple[Advice, Plans]
            Ceilings, and the next memory.
        """
        if self._pre_deceleration and (state.events or state.time_s >= memory.next_release_s):
            memory = self._plan(state, authority)
        ceiling_mps, reason = _lowest(
            authority.limit_m - state.front_m - state.speed_mps * self._step_s,
            state.speed_mps,
            state.leader,
            state.follows,
            memory.ceiling_mps,
            self._acceleration_mps2,
            self._brake_mps2,
        )
        return Advice(ceiling_mps, reason), memory

    def _plan(self, state: LineState, authority: Authority) -> Plans:
        """Plan every train anew, first train first: each needs its leader's forecast."""
        world, now_s = self._world, state.time_s
        ceiling = np.full(world.size, NO_CEILING_MPS)
        release_s = np.full(world.size, np.inf)
        departure_s = np.full(world.size, np.inf)
        margin_m = state.clear_to_m - authority.limit_m
        for row in np.flatnonzero(state.present).tolist():
            leader = int(state.leader[row])
            same_stop = leader >= 0 and state.stop_m[leader] == state.stop_m[row]
            wait_until_s = departure_s[leader] if same_stop else -np.inf
            departure_s[row] = self._earliest_departure_s(state, row, wait_until_s)
            if not (state.running[row] and wait_until_s > now_s + self._options.least_gain_s):
                continue
            slowing = self._slowing(state, row, float(margin_m[row]), wait_until_s - now_s)
            if slowing is not None and slowing.lasts_s > 0.0:
                ceiling[row] = slowing.ceiling_mps
                release_s[row] = now_s + slowing.lasts_s
        return Plans(ceiling, release_s, float(release_s.min()))

    def _earliest_departure_s(self, state: LineState, row: int, leader_leaves_s: float) -> float:
        """Return the earliest departure from the next stop, the dwell delay unknown."""
        world, call = self._world, state.next_call[row]
        if call >= world.call_count[row]:
            return -np.inf
        if not state.running[row]:
            arrival_s = float(state.arrival_s[row])
        else:
            free_s = state.time_s + self._free_run_s(state, row)
            arrival_s = max(free_s, leader_leaves_s + self._interval_s(row))
        ready_s = arrival_s + world.minimum_dwell_s[row, call]
        return float(max(ready_s, world.booked_departure_s[row, call], state.time_s))

    def _free_run_s(self, state: LineState, row: int) -> float:
        """Return the time to the next stop if nothing is in the way."""
        kind = int(self._world.type_index[row])
        front_m, stop_m = float(state.front_m[row]), float(state.stop_m[row])
        start, stop = (int(place - self._world.profile.origin_m) for place in (front_m, stop_m))
        if start >= stop:
            return 0.0
        at_ceiling_s = float(self._travel_s[kind, stop] - self._travel_s[kind, start])
        return self._run_up[kind].shortest_s(
            stop_m - front_m,
            float(state.speed_mps[row]),
            (stop - start) / at_ceiling_s,
            self._brake_mps2,
        )

    def _interval_s(self, row: int) -> float:
        """Return the shortest time from the leader's departure to the follower's arrival."""
        a, b = self._acceleration_mps2, self._brake_mps2
        length_m = float(self._world.length_m[row])
        # From eqs. (14) and (15): v/(2a) + L/v + v/b, least over the speed v held.
        return 2.0 * float(np.sqrt(length_m * (0.5 / a + 1.0 / b)))

    def _slowing(
        self, state: LineState, row: int, margin_m: float, wait_s: float
    ) -> Slowing | None:
        world, kind = self._world, int(self._world.type_index[row])
        leader = state.leader[row]
        rear_m = float(state.stop_m[leader] - world.length_m[leader]) - margin_m
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
                run_up=self._run_up[kind],
            ),
            wait_s,
        )

    def _first_stage_m(self, kind: int, rear_m: float) -> float:
        top = float(self._ceiling_mps[kind, int(rear_m - self._world.profile.origin_m)])
        return 0.5 * top**2 / self._first_stage_mps2


@compiled
def _lowest(  # noqa: PLR0917 - compiled functions take plain arrays
    gap_m: FloatArray,
    speed_mps: FloatArray,
    leader: IntArray,
    follows: BoolArray,
    planned_mps: FloatArray,
    acceleration_mps2: float,
    brake_mps2: float,
) -> tuple[FloatArray, IntArray]:
    ceiling_mps = planned_mps.copy()
    reason = np.full(gap_m.size, PRE_DECELERATION)
    for train in range(gap_m.size):
        # What is still to come from another track does not move out of the way.
        leader_mps = speed_mps[leader[train]] if follows[train] else 0.0
        held_mps = two_stage_speed_mps(gap_m[train], leader_mps, acceleration_mps2, brake_mps2)
        if held_mps <= ceiling_mps[train]:
            ceiling_mps[train] = held_mps
            reason[train] = TWO_STAGE
    return ceiling_mps, reason
