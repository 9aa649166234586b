"""
Holding at the platform until the way to the next one is clear.

Where a train would stand before its next platform because its leader is still there, it may as
well wait at the one where it is: passengers stand at an open door and not in a tunnel. It leaves
so that it arrives, in its own run time, the shortest departure-to-arrival interval (Sato et al.
2025) after its leader can leave that platform at the earliest. That loses no time, as far as the
timetable and minimum dwells tell; who overstays is not known beforehand, so that a follower that
has left by the forecast may still stand on its way. With ``overstay_s`` a train also waits until
its leader has really left once that one overstays so long, which costs the time that the train
could have used to draw near, and keeps its platform from the next train.
"""

from dataclasses import dataclass

import numpy as np

from kankaku.controllers.forecast import waits_for_leader
from kankaku.controllers.options import require
from kankaku.controllers.supervision.outlook import NOWHERE, Forecast, Outlook
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import NO_HOLD_S, Authority, LineState, Orders


@dataclass(frozen=True, slots=True)
class HoldForClearWayOptions:
    """Options of holding until the way is clear."""

    doors_closed: bool = False
    """The stop ends as without holding, and the train waits with closed doors."""
    overstay_s: float = 3600.0
    """A leader that overstays longer than this is waited for until it has left. [s]"""
    run_time_targets: bool = False
    """Tell operations when a train on its way need not arrive before."""
    longest_hold_s: float = 180.0
    """No train is held longer beyond its booked departure and minimum dwell. [s]"""

    def __post_init__(self) -> None:
        require("overstay_s", self.overstay_s, 0.0, 3600.0)
        require("longest_hold_s", self.longest_hold_s, 0.0, 3600.0)


class HoldForClearWay:
    """Holds a train until it can run to its next stop without standing."""

    def __init__(self, world: World, options: HoldForClearWayOptions) -> None:
        self._world = world
        self._options = options
        self._outlook = Outlook(world)

    def initial(self) -> None:
        """Return the memory before the first step: none is needed."""

    def supervise(
        self, state: LineState, authority: Authority, memory: None
    ) -> tuple[Orders, None]:
        """Return the orders for every train."""
        del authority
        forecast = self._outlook.forecast(state)
        closed = self._options.doors_closed
        until_s = np.full(self._world.size, NO_HOLD_S)
        again_s = [np.inf]
        for row in np.flatnonzero(state.present & (state.speed_mps == 0.0)).tolist():
            call = int(state.next_call[row])
            if state.running[row]:
                call -= 1
                # With open doors nobody is held whose stop is over.
                if not closed or not self._outlook.stands_at(state, row, call):
                    continue
            held_s, looks_s = self._until_s(state, row, call, forecast, until_s)
            if held_s > state.time_s:
                until_s[row] = held_s
            again_s += [at_s for at_s in (held_s, looks_s) if at_s > state.time_s]
        nobody_s = np.full(self._world.size, NO_HOLD_S)
        return Orders(
            hold_open_until_s=nobody_s if closed else until_s,
            hold_closed_until_s=until_s if closed else nobody_s,
            arrive_by_s=self._targets_s(state, forecast),
            again_s=min(again_s),
        ), memory

    def _until_s(
        self, state: LineState, row: int, call: int, forecast: Forecast, held_s: FloatArray
    ) -> tuple[float, float]:
        """Return until when a train is held at a call, and when its leader overstays too long."""
        outlook, leader = self._outlook, int(state.leader[row])
        if leader < 0 or call + 1 >= self._world.call_count[row] or not state.present[leader]:
            return NO_HOLD_S, NO_HOLD_S
        there = int(outlook.call_at[leader, outlook.platform[row, call + 1]])
        if there == NOWHERE:
            return NO_HOLD_S, NO_HOLD_S
        leaves_s, too_long_s = self._leaves_s(state, leader, there, forecast)
        # The leader may be held itself.
        leaves_s = max(leaves_s, float(held_s[leader])) if leaves_s > NO_HOLD_S else leaves_s
        until_s = leaves_s + outlook.interval_s[leader] - float(outlook.run_s[row, call + 1])
        if NO_HOLD_S < too_long_s <= state.time_s:
            until_s = np.inf
        longest_s = outlook.over_s(state, row, call) + self._options.longest_hold_s
        return min(until_s, longest_s), too_long_s

    def _leaves_s(
        self, state: LineState, leader: int, there: int, forecast: Forecast
    ) -> tuple[float, float]:
        """
        Return when a leader leaves a platform at the earliest, and when it overstays too long.

        Both are ``NO_HOLD_S`` once it has left.
        """
        next_call, outlook = int(state.next_call[leader]), self._outlook
        if there >= next_call:
            booked_s = self._world.booked_departure_s[leader]
            leaves_s = forecast.departure_s[leader] + booked_s[there] - booked_s[next_call]
            stops = there == next_call and not state.running[leader]
        elif there == next_call - 1 and outlook.stands_at(state, leader, there):
            leaves_s, stops = state.time_s, True
        else:
            return NO_HOLD_S, NO_HOLD_S
        over_s = outlook.over_s(state, leader, there) if stops else np.inf
        return float(leaves_s), over_s + self._options.overstay_s

    def _targets_s(self, state: LineState, forecast: Forecast) -> FloatArray:
        """Return when trains on their way to a platform of their leaders need not be there yet."""
        if not self._options.run_time_targets:
            return np.full(self._world.size, np.nan)
        waits = waits_for_leader(self._world, state) & state.running
        free_s = forecast.departure_s + self._outlook.interval_s
        booked_s = self._world.booked_arrival_s[np.arange(self._world.size), state.next_call]
        later = waits & (free_s[state.leader] > booked_s)
        return np.where(later, free_s[state.leader], np.nan)
