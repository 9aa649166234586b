"""
When trains can leave their next stop at the earliest.

Booked departures, minimum dwells and the trains' own abilities are known; dwell delays are
not. So this is a lower bound, and a follower loses nothing by counting on it.
"""

from collections.abc import Sequence

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray
from kankaku.railway.motion.run_up import RunUp
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import LineState


class DepartureForecast:
    """Forecasts departures along the queue of trains, first train first."""

    def __init__(
        self,
        world: World,
        run_up: Sequence[RunUp],
        acceleration_mps2: float,
        brake_mps2: float,
    ) -> None:
        self._world = world
        self._brake_mps2 = brake_mps2
        self._run_up = run_up
        self._type_index: list[int] = world.type_index.tolist()
        self._travel_s = np.cumsum(1.0 / world.driven_profile.ceiling_mps, axis=1)
        # v/(2a) + L/v + v/b after the departure of a leader of length L, from Sato et al. 2025,
        # eqs. (14) and (15), least over the speed v that is held into the platform.
        shortest_s = 2.0 * np.sqrt(world.length_m * (0.5 / acceleration_mps2 + 1.0 / brake_mps2))
        self._interval_s: list[float] = shortest_s.tolist()

    def earliest_departures_s(self, state: LineState) -> FloatArray:
        """
        Return the earliest departure of every train from its next stop.

        Parameters
        ----------
        state
            The line.

        Returns
        -------
        FloatArray
            Seconds after midnight; minus infinity where there is no next stop or no train.
            [s], shape (n_trains,)
        """
        world, now_s = self._world, state.time_s
        earliest_s = np.full(world.size, -np.inf)
        waits = waits_for_leader(world, state)
        for row in np.flatnonzero(state.present).tolist():
            call = state.next_call[row]
            if call >= world.call_count[row]:
                continue
            arrival_s = float(state.arrival_s[row])
            if state.running[row]:
                arrival_s = now_s + self._free_run_s(state, row)
                if waits[row]:
                    leader = state.leader[row]
                    clear_s = earliest_s[leader] + self._interval_s[leader]
                    arrival_s = max(arrival_s, clear_s)
            ready_s = arrival_s + world.minimum_dwell_s[row, call]
            earliest_s[row] = max(ready_s, world.booked_departure_s[row, call], now_s)
        return earliest_s

    def _free_run_s(self, state: LineState, row: int) -> float:
        """Return the time to the next stop if nothing is in the way."""
        kind = self._type_index[row]
        front_m, stop_m = float(state.front_m[row]), float(state.stop_m[row])
        origin_m = self._world.profile.origin_m
        start, stop = int(front_m - origin_m), int(stop_m - origin_m)
        if start >= stop:
            return 0.0
        at_ceiling_s = float(self._travel_s[kind, stop] - self._travel_s[kind, start])
        mean_mps = (stop - start) / at_ceiling_s
        speed = float(state.speed_mps[row])
        return self._run_up[kind].shortest_s(stop_m - front_m, speed, mean_mps, self._brake_mps2)


def waits_for_leader(world: World, state: LineState) -> BoolArray:
    """
    Return which trains need their leader to leave the platform that they run to.

    Parameters
    ----------
    world
        The trains and their calls.
    state
        The line.

    Returns
    -------
    BoolArray
        True where the next platform of a train is also its leader's. shape (n_trains,)
    """
    track = world.call_track[np.arange(world.size), state.next_call]
    same_track = (track == track[state.leader]) & (state.leader >= 0)
    waits: BoolArray = same_track & (state.stop_m[state.leader] == state.stop_m)
    return waits
