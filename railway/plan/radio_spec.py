"""A radio link between centre and trains, as a scenario describes it."""

import math
from dataclasses import dataclass

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import formula

TOLERANCE_S = 1e-6
"""Sums of steps come this close to the times that they stand for. [s]"""
NEVER = -(2**62)
"""Stands for the cycle of a message that has never come: before all cycles."""
FOREVER = 2**62
"""After all cycles."""


@formula
def cycle_at(time_s: float, cycle_s: float) -> int:
    """
    Return the number of the cycle that has begun last.

    Parameters
    ----------
    time_s
        Now. [s]
    cycle_s
        Length of a cycle. [s]

    Returns
    -------
    int
        Cycles begin at multiples of their length.
    """
    return math.floor((time_s + TOLERANCE_S) / cycle_s)


@formula
def telegram_cycle_at(time_s: float, cycle_s: float) -> int:
    """
    Return the number of the cycle in which the centre has sent commands last.

    Parameters
    ----------
    time_s
        Now. [s]
    cycle_s
        Length of a cycle. [s]

    Returns
    -------
    int
        It sends them half a cycle after the reports.
    """
    return cycle_at(time_s - 0.5 * cycle_s, cycle_s)


@formula
def telegram_sent_s(cycle: int, cycle_s: float) -> float:
    """
    Return when the telegrams of a cycle are sent.

    Parameters
    ----------
    cycle
        Its number, or ``NEVER``.
    cycle_s
        Length of a cycle. [s]

    Returns
    -------
    float
        -inf for never. [s]
    """
    return -np.inf if cycle == NEVER else cycle * cycle_s + 0.5 * cycle_s


@dataclass(frozen=True, slots=True)
class Outage:
    """All messages that are sent in a time window are lost."""

    trains: tuple[str, ...]
    """Whose messages; all trains' if empty."""
    up: bool
    """Those from the train to the centre."""
    down: bool
    """Those from the centre to the train."""
    from_s: float
    until_s: float


@dataclass(frozen=True, slots=True)
class RadioSpec:
    """A radio link; by default as in the source, and losing nothing."""

    cycle_s: float = 1.0
    delay_least_s: float = 0.3
    delay_most_s: float = 0.6
    loss_ratio: float = 0.0
    """Share of telegrams that are lost, in either direction. [-]"""
    burst_factor: float = 1.0
    """How much longer rows of losses are, in the mean, than independent ones would be. [-]"""
    outages: tuple[Outage, ...] = ()

    @property
    def oldest_knowledge_s(self) -> float:
        """
        How old the report can be that commands count on if nothing is lost. [s]

        At the end of the time for which a train goes by one telegram.
        """
        # When a telegram is sent, the report that has surely arrived is cycles and a half old.
        cycles = max(math.ceil(self.delay_most_s / self.cycle_s - 0.5), 0)
        return (cycles + 1.5) * self.cycle_s + self.delay_most_s

    def report_cycle(self, time_s: float) -> int:
        """
        Return the number of the cycle in which trains have reported last.

        Parameters
        ----------
        time_s
            Now. [s]

        Returns
        -------
        int
            They report at multiples of the cycle.
        """
        return cycle_at(time_s, self.cycle_s)

    def telegram_cycle(self, time_s: float) -> int:
        """
        Return the number of the cycle in which the centre has sent commands last.

        Parameters
        ----------
        time_s
            Now. [s]

        Returns
        -------
        int
            It sends them half a cycle after the reports.
        """
        return telegram_cycle_at(time_s, self.cycle_s)

    def report_s(self, cycle: int) -> float:
        """
        Return when the reports of a cycle are made.

        Parameters
        ----------
        cycle
            Its number.

        Returns
        -------
        float
            [s]
        """
        return cycle * self.cycle_s

    def telegram_s(self, cycle: int) -> float:
        """
        Return when the telegrams of a cycle are sent.

        Parameters
        ----------
        cycle
            Its number.

        Returns
        -------
        float
            [s]
        """
        return telegram_sent_s(cycle, self.cycle_s)

    def reports_s(self, cycles: IntArray) -> FloatArray:
        """
        Return when the reports of some cycles are made.

        Parameters
        ----------
        cycles
            Their numbers, or ``NEVER``. shape (n,)

        Returns
        -------
        FloatArray
            -inf for never. [s], shape (n,)
        """
        return np.where(cycles == NEVER, -np.inf, cycles * self.cycle_s)

    def telegrams_s(self, cycles: IntArray) -> FloatArray:
        """
        Return when the telegrams of some cycles are sent.

        Parameters
        ----------
        cycles
            Their numbers, or ``NEVER``. shape (n,)

        Returns
        -------
        FloatArray
            -inf for never. [s], shape (n,)
        """
        return np.where(cycles == NEVER, -np.inf, cycles * self.cycle_s + 0.5 * self.cycle_s)


LOSSLESS = RadioSpec()
"""The radio of the source, losing nothing."""


def keeps_pace(cycle_s: float, step_s: float) -> bool:
    """
    Return whether a radio can be simulated with a step.

    Commands are sent half a cycle after the reports, and nothing happens between two steps.

    Parameters
    ----------
    cycle_s
        Its cycle. [s]
    step_s
        Length of a step. [s]

    Returns
    -------
    bool
        Half a cycle is a whole number of steps, to the microsecond.
    """
    return round(5e5 * cycle_s) % round(1e6 * step_s) == 0
