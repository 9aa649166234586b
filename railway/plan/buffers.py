"""
Safety buffers around a train whose position is measured and sent by radio.

The on-board position drifts with the distance from the last position-correction balise, is
resolved to a few metres, and is old by the time that the radio takes. So a train counts as
longer than it is: by a front buffer when it must stop short of something, by a rear buffer
when others must stop short of it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import elementwise
from kankaku.railway.plan.line import Line


@elementwise
def drifted_buffer_m(
    front_m: float, balise_m: float, error_ratio: float, resolution_m: float
) -> float:
    """
    Return the buffer of a train that stands.

    Parameters
    ----------
    front_m
        Front. [m], broadcastable
    balise_m
        The balise that it passed last. [m], broadcastable
    error_ratio
        Drift of the measured position. [-], broadcastable
    resolution_m
        Resolution of the measured position. [m], broadcastable

    Returns
    -------
    FloatArray
        Length. [m], broadcast shape

    References
    ----------
    .. [1] Sakai et al. 2020, eq. (2); eq. (1) without the delay.
    """
    return error_ratio * max(front_m - balise_m, 0.0) + resolution_m


@elementwise
def reaching_front_m(place_m: float, balise_m: float, error_ratio: float, own_m: float) -> float:
    """
    Return where a front is when, with its buffer, it reaches a place.

    Parameters
    ----------
    place_m
        Place. [m], broadcastable
    balise_m
        The balise that counts. [m], broadcastable
    error_ratio
        Drift of the measured position. [-], broadcastable
    own_m
        The part of the buffer that does not drift. [m], broadcastable

    Returns
    -------
    FloatArray
        Front. [m], broadcast shape

    References
    ----------
    .. [1] Sakai et al. 2020, eq. (3).
    """
    return (place_m - own_m + error_ratio * balise_m) / (1.0 + error_ratio)


@dataclass(frozen=True)
class Buffers:
    """The figures that buffers follow from; without any of them there are no buffers."""

    error_ratio: float = 0.0
    """Drift of the measured position over the distance from the last balise. [-]"""
    delay_s: float = 0.0
    """Delay of the radio. [s]"""
    resolution_m: float = 0.0
    """Resolution of the measured position. [m]"""
    balises_m: tuple[float, ...] = (0.0,)
    """Where positions are corrected, rising; before the first one trains count from it. [m]"""

    @classmethod
    def on(cls, line: Line, error_ratio: float, delay_s: float, resolution_m: float) -> "Buffers":
        """
        Return the buffers on a line; its start counts as a balise.

        Parameters
        ----------
        line
            Whose balises.
        error_ratio
            Drift of the measured position. [-]
        delay_s
            Delay of the radio. [s]
        resolution_m
            Resolution of the measured position. [m]

        Returns
        -------
        Buffers
            The buffers.
        """
        inside = sorted(place for place in line.balises_m if place > line.start_m)
        return cls(error_ratio, delay_s, resolution_m, (line.start_m, *inside))

    @property
    def none(self) -> bool:
        """Trains count as just as long as they are."""
        return self.error_ratio == self.delay_s == self.resolution_m == 0.0

    @cached_property
    def balise_m(self) -> FloatArray:
        """Where positions are corrected. [m], shape (n_balises,)"""
        return np.array(self.balises_m)

    @cached_property
    def buffered_at_balise_m(self) -> FloatArray:
        """Where a standing front's buffer ends just before each balise but the first. [m]."""
        before_m, balise_m = self.balise_m[:-1], self.balise_m[1:]
        buffered_m = balise_m + self.error_ratio * (balise_m - before_m) + self.resolution_m
        return np.maximum.accumulate(buffered_m)

    def last_balise_m(self, front_m: FloatArray) -> FloatArray:
        """
        Return the balise that each train passed last.

        Parameters
        ----------
        front_m
            Fronts. [m], any shape

        Returns
        -------
        FloatArray
            Chainages. [m], same shape
        """
        passed = np.searchsorted(self.balise_m, front_m, side="right") - 1
        return self.balise_m[np.maximum(passed, 0)]

    def front_buffer_m(self, front_m: FloatArray, speed_mps: FloatArray) -> FloatArray:
        """
        Return the buffer ahead of the front.

        Parameters
        ----------
        front_m
            Fronts. [m], any shape
        speed_mps
            Speeds. [m/s], same shape

        Returns
        -------
        FloatArray
            Length. [m], same shape

        References
        ----------
        .. [1] Sakai et al. 2020, eq. (1).
        """
        return speed_mps * self.delay_s + self.rear_buffer_m(front_m)

    def rear_buffer_m(self, front_m: FloatArray) -> FloatArray:
        """
        Return the buffer behind the tail.

        Parameters
        ----------
        front_m
            Fronts, from which the distance to the balise counts. [m], any shape

        Returns
        -------
        FloatArray
            Length. [m], same shape

        References
        ----------
        .. [1] Sakai et al. 2020, eq. (2).
        """
        last_m = self.last_balise_m(front_m)
        return drifted_buffer_m(front_m, last_m, self.error_ratio, self.resolution_m)

    def front_limit_m(self, place_m: FloatArray, speed_mps: float = 0.0) -> FloatArray:
        """
        Return where a front is when, with its buffer, it reaches a place.

        A balise counts where the train passes it before the buffer reaches the place.

        Parameters
        ----------
        place_m
            Places, for example starts of speed limits. [m], any shape
        speed_mps
            Speed of the train there. [m/s]

        Returns
        -------
        FloatArray
            Fronts. [m], same shape

        References
        ----------
        .. [1] Sakai et al. 2020, eq. (3).
        """
        delayed_m = speed_mps * self.delay_s
        passed = np.searchsorted(self.buffered_at_balise_m, place_m - delayed_m, side="right")
        own_m = delayed_m + self.resolution_m
        return reaching_front_m(place_m, self.balise_m[passed], self.error_ratio, own_m)

    def rear_limit_m(self, place_m: float, length_m: float) -> float:
        """
        Return where a front is when the tail, with its buffer, has left a place for good.

        Parameters
        ----------
        place_m
            Place, for example the end of a speed limit. [m]
        length_m
            Length of the train. [m]

        Returns
        -------
        float
            Front. [m]

        References
        ----------
        .. [1] Sakai et al. 2020, after eq. (3): ends of limits by the rear.
        """
        r = self.error_ratio
        fronts_m = (place_m + length_m + self.resolution_m - r * self.balise_m) / (1.0 - r)
        # Of the fronts from which the tail is clear, those that the next balise still allows.
        until_m = np.append(self.balise_m[1:], np.inf)
        clear_from_m = np.maximum(fronts_m, self.balise_m)
        return float(clear_from_m[clear_from_m < until_m][0])
