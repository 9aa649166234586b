r"""
Regulating headways: a train is held so that it runs midway between its neighbours.

With the departure ``d`` of the train ahead from the same platform and the expected arrival ``a``
of the one behind, the train leaves at

    min(d + (a - d) / 2, d + ratio x booked headway),

or when its stop is over, if that is later: the mean of the headways ahead and behind, and not
beyond the booked one [1]_. Holding against the headways of both neighbours goes back to feedback
laws for metro lines [2]_ and for buses [3]_; their ``gain`` is the share of the wanted hold that
is taken at one stop.

References
----------
.. [1] O. Cats, A. N. Larijani, H. N. Koutsopoulos, W. Burghout, *Impacts of holding control
   strategies on transit performance: bus simulation model analysis*, Transportation Research
   Record 2216, 2011: the even-headway strategy with the planned headway as its limit.
.. [2] V. Van Breusegem, G. Campion, G. Bastin, *Traffic modeling and state feedback control for
   metro lines*, IEEE Transactions on Automatic Control 36 (7), 1991.
.. [3] C. F. Daganzo, *A headway-based approach to eliminate bus bunching: systematic analysis and
   comparisons*, Transportation Research Part B 43 (10), 2009.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kankaku.controllers.options import require
from kankaku.controllers.supervision.outlook import NOWHERE, Forecast, Outlook
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import NO_HOLD_S, Authority, LineState, Orders, no_orders


@dataclass(frozen=True, slots=True)
class HeadwayRegulationOptions:
    """Options of regulating headways."""

    gain: float = 1.0
    """Share of the wanted hold that is taken. [-]"""
    headway_ratio: float = 1.0
    """The headway to the train ahead is not made longer than this many booked ones. [-]"""
    longest_hold_s: float = 60.0
    """No train is held longer beyond its booked departure and minimum dwell. [s]"""

    def __post_init__(self) -> None:
        require("gain", self.gain, 0.0, 1.0)
        require("headway_ratio", self.headway_ratio, 0.0, 10.0)
        require("longest_hold_s", self.longest_hold_s, 0.0, 3600.0)


class Departures(NamedTuple):
    """The last departure from each platform; [s], shape (n_platforms,), nan for none."""

    actual_s: FloatArray
    booked_s: FloatArray


class HeadwayRegulation:
    """Holds a train, doors open, until it is midway between its neighbours."""

    def __init__(self, world: World, options: HeadwayRegulationOptions) -> None:
        self._world = world
        self._options = options
        self._outlook = Outlook(world)

    def initial(self) -> Departures:
        """Return the memory before the first step: nobody has departed."""
        never_s = np.full(self._outlook.call_at.shape[1], np.nan)
        return Departures(never_s, never_s)

    def supervise(
        self, state: LineState, authority: Authority, memory: Departures
    ) -> tuple[Orders, Departures]:
        """Return the orders for every train."""
        del authority
        memory = self._with_departures(state, memory)
        forecast = self._outlook.forecast(state)
        until_s = np.full(self._world.size, NO_HOLD_S)
        for row in np.flatnonzero(state.present & ~state.running).tolist():
            call = int(state.next_call[row])
            if call + 1 < self._world.call_count[row]:
                until_s[row] = self._until_s(state, row, call, memory, forecast)
        until_s[until_s <= state.time_s] = NO_HOLD_S
        return no_orders(self._world.size)._replace(hold_open_until_s=until_s), memory

    def _with_departures(self, state: LineState, memory: Departures) -> Departures:
        if not state.events.departed:
            return memory
        actual_s, booked_s = memory.actual_s.copy(), memory.booked_s.copy()
        for row in state.events.departed:
            call = int(state.next_call[row]) - 1
            platform = self._outlook.platform[row, call]
            actual_s[platform] = state.time_s
            booked_s[platform] = self._world.booked_departure_s[row, call]
        return Departures(actual_s, booked_s)

    def _until_s(
        self, state: LineState, row: int, call: int, memory: Departures, forecast: Forecast
    ) -> float:
        """Return until when a train is held at a call."""
        platform = int(self._outlook.platform[row, call])
        ahead_s = float(memory.actual_s[platform])
        behind_s = self._next_arrival_s(state, row, platform, forecast)
        # Who has one neighbour only has nothing to be midway of.
        if not np.isfinite(ahead_s) or not np.isfinite(behind_s):
            return NO_HOLD_S
        options, over_s = self._options, self._outlook.over_s(state, row, call)
        headway_s = float(self._world.booked_departure_s[row, call] - memory.booked_s[platform])
        wanted_s = ahead_s + min(0.5 * (behind_s - ahead_s), options.headway_ratio * headway_s)
        return over_s + min(options.gain * (wanted_s - over_s), options.longest_hold_s)

    def _next_arrival_s(
        self, state: LineState, row: int, platform: int, forecast: Forecast
    ) -> float:
        """Return when the next train is expected at a platform; inf if none is on its way."""
        world, call = self._world, self._outlook.call_at[:, platform]
        comes = state.present & (call != NOWHERE) & (call >= state.next_call)
        comes[row] = False
        rows = np.flatnonzero(comes)
        there, following = call[rows], state.next_call[rows]
        booked_s = world.booked_arrival_s[rows, there] - world.booked_departure_s[rows, following]
        later_s = forecast.departure_s[rows] + booked_s
        arrival_s = np.where(there == following, forecast.arrival_s[rows], later_s)
        return float(arrival_s.min(initial=np.inf))
