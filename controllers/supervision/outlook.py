"""What supervision knows of the way ahead and behind: who comes to which platform, and when."""

from typing import NamedTuple

import numpy as np

from kankaku.controllers.drive import AT_STOP_M
from kankaku.controllers.forecast import DepartureForecast
from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.motion.run_times import run_times_s
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import LineState

NOWHERE = -1
"""No platform, or no call there."""


class Forecast(NamedTuple):
    """When trains are at their next stops, by what can be known; [s], shape (n_trains,)."""

    arrival_s: FloatArray
    """Arrival at the next stop, or at the present one; minus infinity where there is none."""
    departure_s: FloatArray
    """Earliest departure from there; minus infinity where there is none."""


class Outlook:
    """
    Platforms, run times and forecasts of a timetable.

    Parameters
    ----------
    world
        Line, fleet and timetable.
    """

    def __init__(self, world: World) -> None:
        self.world = world
        self._forecast = DepartureForecast(world)
        self.interval_s = self._forecast.interval_s
        """From the departure of each train to the arrival of the next one, at least. [s]"""
        self.run_s = run_times_s(world, world.driven_profile)
        """Run time to each call from the one before. [s], shape (n_trains, n_calls_max)"""
        self.platform, self.call_at = _platforms(world)

    def forecast(self, state: LineState) -> Forecast:
        """
        Return when every train is at its next stop, and when it can leave it.

        Parameters
        ----------
        state
            The line.

        Returns
        -------
        Forecast
            At the earliest.
        """
        ready_s, departure_s = self._forecast.ready_and_earliest_s(state)
        rows = np.arange(self.world.size)
        dwell_s = self.world.minimum_dwell_s[rows, state.next_call]
        arrival_s = np.subtract(ready_s, dwell_s, out=ready_s.copy(), where=np.isfinite(ready_s))
        return Forecast(arrival_s, departure_s)

    def over_s(self, state: LineState, row: int, call: int) -> float:
        """
        Return when the stop of a train is over if it does not overstay.

        Parameters
        ----------
        state
            The line.
        row
            A train that has arrived there last.
        call
            The call.

        Returns
        -------
        float
            Its booked departure, or the end of its minimum dwell if that is later. [s]
        """
        ready_s = float(state.arrival_s[row] + self.world.minimum_dwell_s[row, call])
        return max(ready_s, float(self.world.booked_departure_s[row, call]))

    def stands_at(self, state: LineState, row: int, call: int) -> bool:
        """
        Return whether a train stands at one of its stops, released or not.

        Parameters
        ----------
        state
            The line.
        row
            The train.
        call
            The call.

        Returns
        -------
        bool
            It is there and does not move.
        """
        off_m = abs(float(state.front_m[row] - self.world.stop_m[row, call]))
        return bool(state.present[row] and state.speed_mps[row] == 0.0 and off_m < AT_STOP_M)


def _platforms(world: World) -> tuple[IntArray, IntArray]:
    """
    Return the number of each call's platform, and each train's call at each platform.

    Shapes are those of the world's call arrays and (n_trains, n_platforms); ``NOWHERE`` stands
    where there is none.
    """
    services = world.timetable.services
    places = dict.fromkeys((call.station, call.track) for one in services for call in one.calls)
    number = {place: at for at, place in enumerate(places)}
    platform = np.full(world.stop_m.shape, NOWHERE, dtype=np.intp)
    call_at = np.full((world.size, len(number)), NOWHERE, dtype=np.intp)
    for row, service in enumerate(services):
        for column, call in enumerate(service.calls):
            platform[row, column] = number[call.station, call.track]
            call_at[row, platform[row, column]] = column
    return platform, call_at
