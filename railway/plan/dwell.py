"""Dwell delays: how much longer than the minimum a train stands at a platform."""

from dataclasses import dataclass, replace

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.seed_design import EACH_FOR_ITSELF, SeedDesign
from kankaku.railway.plan.timetable import Timetable


@dataclass(frozen=True, slots=True)
class Overstay:
    """A delay that the scenario names: this train, this station, this much."""

    train: str
    station: str
    delay_s: float


@dataclass(frozen=True, slots=True)
class DwellDelays:
    """
    Dwell delays resampled from measured quantiles, plus named overstays.

    Along a trip the draws are correlated: ranks follow a Gaussian copula whose lag-1
    correlation is ``trip_correlation``. The same seed, train and station give the same delay
    under every controller.
    """

    levels: tuple[float, ...] = (0.0, 1.0)
    """Cumulative probabilities, rising from 0 to 1. [-]"""
    delays_s: tuple[float, ...] = (0.0, 0.0)
    """Measured delay at each level, not falling. [s]"""
    scale: float = 1.0
    """Factor on every resampled delay, beside that of the call. [-]"""
    cap_s: float = np.inf
    """Longest resampled delay. [s]"""
    trip_correlation: float = 0.0
    """Lag-1 correlation of the normal scores along a trip. [-]"""
    overstays: tuple[Overstay, ...] = ()
    design: SeedDesign = EACH_FOR_ITSELF
    """How the draws of different seeds hang together."""

    def overstaying(self, overstay: Overstay) -> "DwellDelays":
        """
        Return the same delays with one more overstay.

        Parameters
        ----------
        overstay
            What is added to the delays that the train meets there anyway.

        Returns
        -------
        DwellDelays
            Every other call draws as before.
        """
        return replace(self, overstays=(*self.overstays, overstay))

    def draw(self, timetable: Timetable, seed: int) -> FloatArray:
        """
        Return the delay of every call.

        Parameters
        ----------
        timetable
            Whose calls.
        seed
            Seed of the scenario. [-]

        Returns
        -------
        FloatArray
            Delay beyond the minimum dwell, resampled ones in whole seconds; 0 past a train's
            last call.
            [s], shape (n_trains, n_calls_max)
        """
        from scipy.special import ndtr  # noqa: PLC0415 - takes long to import

        most_calls = max(len(service.calls) for service in timetable.services)
        drawn = np.zeros((len(timetable.services), most_calls))
        innovation = np.sqrt(1.0 - self.trip_correlation**2)
        for row, service in enumerate(timetable.services):
            score = self.design.normal(seed, "dwell", service.train, "origin")
            for column, call in enumerate(service.calls):
                fresh = self.design.normal(seed, "dwell", service.train, call.station)
                score = self.trip_correlation * score + innovation * fresh
                measured = np.interp(ndtr(score), self.levels, self.delays_s)
                factor = self.scale * call.delay_scale
                # Whole seconds, as measured; so no step that divides a second adds to a dwell.
                drawn[row, column] = np.round(min(factor * measured, self.cap_s))
        for overstay in self.overstays:
            row = timetable.trains.index(overstay.train)
            stations = [call.station for call in timetable.services[row].calls]
            drawn[row, stations.index(overstay.station)] += overstay.delay_s
        return drawn


NO_DELAYS = DwellDelays()
"""Nobody overstays."""
