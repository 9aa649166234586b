"""
Holding at the platform until the way to the next one is clear.

Where a train would stand before its next platform because its leader is still there, it may as
well wait at the one where it is: passengers stand at an open door and not in a tunnel. It leaves
so that it arrives, in its own run time, the shortest departure-to-arrival interval (Sato et al.
2025) after its leader can leave that platform at the earliest. That loses no time, as far as the
timetable and minimum dwells tell; who overstays is not known beforehand, so that a follower that
has left by the forecast may still stand on its way. ``until_departed`` waits until the leader has
really left instead, and costs the time that the train could have used to draw near.
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
    until_departed: bool = False
    """Wait until the leader has left the next platform, whatever the forecast says."""
    run_time_targets: bool = False
    """Tell operations when a train on its way need not arrive before."""
    longest_hold_s: float = 180.0
    """No train is held longer beyond its booked departure and minimum dwell. [s]"""

    def __post_init__(self) -> None:
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
        for row in np.flatnonzero(state.present & (state.speed_mps == 0.0)).tolist():
            call = int(state.next_call[row])
            if state.running[row]:
                call -= 1
                # With open doors nobody is held whose stop is over.
                if not closed or not self._outlook.stands_at(state, row, call):
                    continue
            held_s = self._until_s(state, row, call, forecast, until_s)
            if held_s > state.time_s:
                until_s[row] = held_s
        nobody_s = np.full(self._world.size, NO_HOLD_S)
        return Orders(
            hold_open_until_s=nobody_s if closed else until_s,
            hold_closed_until_s=until_s if closed else nobody_s,
            arrive_by_s=self._targets_s(state, forecast),
            again_s=float(until_s[until_s > NO_HOLD_S].min(initial=np.inf)),
        ), memory

    def _until_s(
        self, state: LineState, row: int, call: int, forecast: Forecast, held_s: FloatArray
    ) -> float:
        """Return until when a train is held at a call; not after now where it is not."""
        outlook, leader = self._outlook, int(state.leader[row])
        if leader < 0 or call + 1 >= self._world.call_count[row]:
            return NO_HOLD_S
        there = int(outlook.call_at[leader, outlook.platform[row, call + 1]])
        if there == NOWHERE or not state.present[leader]:
            return NO_HOLD_S
        leaves_s = self._leaves_s(state, leader, there, forecast)
        if leaves_s == NO_HOLD_S:
            return NO_HOLD_S
        until_s = np.inf
        if not self._options.until_departed:
            # The leader may be held itself.
            leaves_s = max(leaves_s, float(held_s[leader]))
            until_s = leaves_s + outlook.interval_s[leader] - float(outlook.run_s[row, call + 1])
        return min(until_s, outlook.over_s(state, row, call) + self._options.longest_hold_s)

    def _leaves_s(self, state: LineState, leader: int, there: int, forecast: Forecast) -> float:
        """Return when a leader leaves a platform at the earliest; ``NO_HOLD_S`` if it has left."""
        next_call = int(state.next_call[leader])
        if there < next_call:
            waits = there == next_call - 1 and self._outlook.stands_at(state, leader, there)
            return state.time_s if waits else NO_HOLD_S
        booked_s = self._world.booked_departure_s[leader]
        return float(forecast.departure_s[leader] + booked_s[there] - booked_s[next_call])

    def _targets_s(self, state: LineState, forecast: Forecast) -> FloatArray:
        """Return when trains on their way to a platform of their leaders need not be there yet."""
        if not self._options.run_time_targets:
            return np.full(self._world.size, np.nan)
        waits = waits_for_leader(self._world, state) & state.running
        free_s = forecast.departure_s + self._outlook.interval_s
        booked_s = self._world.booked_arrival_s[np.arange(self._world.size), state.next_call]
        later = waits & (free_s[state.leader] > booked_s)
        return np.where(later, free_s[state.leader], np.nan)
