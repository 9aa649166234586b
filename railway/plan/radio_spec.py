"""A radio link between centre and trains, as a scenario describes it."""

import math
from dataclasses import dataclass

TOLERANCE_S = 1e-6
"""Sums of steps come this close to the times that they stand for. [s]"""


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

    def last_report_s(self, time_s: float) -> float:
        """
        Return when trains have reported last: at multiples of the cycle.

        Parameters
        ----------
        time_s
            Now. [s]

        Returns
        -------
        float
            The same number for all who ask within a cycle. [s]
        """
        return math.floor((time_s + TOLERANCE_S) / self.cycle_s) * self.cycle_s

    def last_telegram_s(self, time_s: float) -> float:
        """
        Return when the centre has sent commands last: half a cycle after the reports.

        Parameters
        ----------
        time_s
            Now. [s]

        Returns
        -------
        float
            The same number for all who ask within a cycle. [s]
        """
        half_s = 0.5 * self.cycle_s
        return self.last_report_s(time_s - half_s) + half_s


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
