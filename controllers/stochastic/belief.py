"""
How likely it is that a train that overstays departs now, as far as anybody can know.

Known are the measured distribution of dwell delays, its correlation along a trip, and what has been
seen in this run. What was drawn is not.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.dwell import DwellDelays

LEVELS = (0.5, 1.0, 2.0)
"""Factors on what is expected for which plans are made; others lie between. [-]"""
LEAST_HAZARD_PS = 0.01
"""A delay longer than any that is expected must not freeze a plan. [1/s]"""
HALF_S = 0.5
"""Delays are whole seconds. [s]"""
WORTH_CALLS = 20.0
"""What is expected counts as much as so many calls that have been seen. [-]"""
LONGEST_S = 3600
SCORES = np.linspace(-3.0, 3.0, 61)
DRAWS = 400


@dataclass(frozen=True)
class Belief:
    """The expected distribution of dwell delays, and what follows from it."""

    expected: DwellDelays

    def cumulative(self, delay_s: FloatArray, scale: float = 1.0) -> FloatArray:
        """
        Return how likely a delay is not longer than some values.

        Parameters
        ----------
        delay_s
            The values. [s], any shape
        scale
            Factor on what is measured. [-]

        Returns
        -------
        FloatArray
            Probabilities. [-], same shape
        """
        delays_s = self.expected.scale * scale * np.array(self.expected.delays_s)
        levels = np.array(self.expected.levels)
        after = np.searchsorted(delays_s, delay_s, side="right")
        first, last = np.maximum(after - 1, 0), np.minimum(after, delays_s.size - 1)
        rise_s = np.maximum(delays_s[last] - delays_s[first], 1e-9)
        part = np.clip((delay_s - delays_s[first]) / rise_s, 0.0, 1.0)
        level = levels[first] + part * (levels[last] - levels[first])
        level = np.where(after == 0, 0.0, np.where(after == delays_s.size, 1.0, level))
        return np.where(delay_s >= self.expected.cap_s, 1.0, level)

    def hazards(self, scale: float, bin_s: float, bins: int) -> FloatArray:
        """
        Return how likely a delay that has not ended before a bin ends in it.

        Parameters
        ----------
        scale
            Factor on what is measured. [-]
        bin_s
            Length of a bin. [s]
        bins
            How many, from no delay on.

        Returns
        -------
        FloatArray
            Never below a least hazard. [-], shape (bins,)
        """
        ends_s = HALF_S + bin_s * np.arange(bins + 1, dtype=np.float64)
        left = 1.0 - self.cumulative(ends_s, scale)
        with np.errstate(divide="ignore", invalid="ignore"):
            hazard = 1.0 - left[1:] / left[:-1]
        # Beyond the longest delay nothing is known.
        hazard = np.where(left[:-1] > 0.0, hazard, 0.0)
        return np.maximum(hazard, LEAST_HAZARD_PS * bin_s)

    def none(self, scale: float) -> float:
        """
        Return how likely there is no delay.

        Parameters
        ----------
        scale
            Factor on what is measured. [-]

        Returns
        -------
        float
            Probability. [-]
        """
        return float(self.cumulative(np.array([HALF_S]), scale)[0])

    def excess_s(self, scale: float) -> FloatArray:
        """
        Return by how much a delay is longer than whole seconds, in the mean.

        Parameters
        ----------
        scale
            Factor on what is measured. [-]

        Returns
        -------
        FloatArray
            Where a delay that is not longer counts as no excess. [s], shape (n_seconds,)
        """
        left = 1.0 - self.cumulative(HALF_S + np.arange(LONGEST_S, dtype=np.float64), scale)
        return np.cumsum(left[::-1])[::-1]

    @cached_property
    def mean_s(self) -> float:
        """Of the delays that are expected. [s]"""
        return float(self.excess_s(1.0)[0])

    def score(self, delay_s: float, scale: float) -> float:
        """
        Return the normal score of a delay.

        Parameters
        ----------
        delay_s
            The delay, in whole seconds. [s]
        scale
            Factor on what is measured. [-]

        Returns
        -------
        float
            In the middle of all that are rounded to the same. [-]
        """
        from scipy.special import ndtri  # noqa: PLC0415 - takes long to import

        ends_s = np.array([max(delay_s - HALF_S, -HALF_S), delay_s + HALF_S])
        below, up_to = self.cumulative(ends_s, scale)
        return float(np.clip(ndtri(0.5 * (below + up_to)), SCORES[0], SCORES[-1]))

    def after_score(self, score: float) -> float:
        """
        Return by what factor the next delay of a trip is longer than others in the mean.

        Parameters
        ----------
        score
            Normal score of the last delay of the trip. [-]

        Returns
        -------
        float
            The factor. [-]
        """
        return float(np.interp(score, SCORES, self._after_score))

    @cached_property
    def _after_score(self) -> FloatArray:
        from scipy.special import ndtr, ndtri  # noqa: PLC0415 - takes long to import

        def delays_s(scores: FloatArray) -> FloatArray:
            measured_s = np.interp(ndtr(scores), self.expected.levels, self.expected.delays_s)
            return np.minimum(self.expected.scale * measured_s, self.expected.cap_s)

        correlation = self.expected.trip_correlation
        draws = ndtri((np.arange(DRAWS) + 0.5) / DRAWS)
        mean_s = float(delays_s(draws).mean())
        if mean_s <= 0.0:
            return np.ones(SCORES.size)
        scores = correlation * SCORES[:, None] + np.sqrt(1.0 - correlation**2) * draws
        factors: FloatArray = delays_s(scores).mean(axis=1) / mean_s
        return factors
