"""What agents are rewarded for: indicators of a run, interval by interval and train by train."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from kankaku.live.agent_spaces import EnvError
from kankaku.live.interval_report import IntervalReport
from kankaku.live.line_view import LineView
from kankaku.railway.arrays import FloatArray

DEFAULT_REWARDS: Mapping[str, float] = {"delay": 1.0}
JOULES_PER_KWH = 3.6e6


class Rewarded(NamedTuple):
    """What a reward may be made of."""

    unit: str
    measure: str
    """What a simulation has to measure for it; empty for nothing."""
    meaning: str


INDICATORS: Mapping[str, Rewarded] = {
    "delay": Rewarded("min", "", "by how much the lateness of the train has grown"),
    "stops": Rewarded("-", "stops", "standstills between stations that began"),
    "standing": Rewarded("min", "stops", "time at a stand between stations"),
    "energy": Rewarded("kWh", "energy", "net energy taken from the line"),
    "shield": Rewarded("min", "", "time for which protection was why the train was slower"),
}
"""Less of each is better: a reward is minus their weighted sum."""


def chosen_rewards(weights: Mapping[str, float]) -> dict[str, float]:
    """
    Return the weights of indicators.

    Parameters
    ----------
    weights
        By indicator, of :data:`INDICATORS`.

    Returns
    -------
    dict[str, float]
        The same.

    Raises
    ------
    EnvError
        If an indicator is unknown, or a weight no finite number.
    """
    for name, weight in weights.items():
        if name not in INDICATORS:
            where = "rewards"
            raise EnvError(where, f"{name!r}", ", ".join(INDICATORS))
        if isinstance(weight, bool) or not np.isfinite(weight):
            where = f"rewards: {name}"
            raise EnvError(where, f"{weight!r}", "a finite number")
    return {name: float(weight) for name, weight in weights.items()}


def measures_of(weights: Mapping[str, float]) -> tuple[str, ...]:
    """
    Return what a simulation has to measure.

    Parameters
    ----------
    weights
        By indicator.

    Returns
    -------
    tuple[str, ...]
        Of :data:`~kankaku.live.simulation.MEASURES`.
    """
    return tuple(sorted({INDICATORS[name].measure for name in weights} - {""}))


def rewards(
    weights: Mapping[str, float], before: LineView, after: LineView, report: IntervalReport
) -> FloatArray:
    """
    Return the reward of every train.

    Parameters
    ----------
    weights
        By indicator.
    before, after
        The line at the decision and at the next one.
    report
        What happened in between.

    Returns
    -------
    FloatArray
        shape (n_trains,)
    """
    reward: FloatArray = np.zeros(before.present.size)
    for name, weight in weights.items():
        reward -= weight * _grown(name, before, after, report)
    return reward


def _grown(name: str, before: LineView, after: LineView, report: IntervalReport) -> FloatArray:
    match name:
        case "delay":
            late_s = np.maximum(after.delay_s, 0.0) - np.maximum(before.delay_s, 0.0)
            return late_s / 60.0
        case "stops":
            return report.stops.astype(np.float64)
        case "standing":
            return report.stood_s / 60.0
        case "energy":
            return report.energy_j / JOULES_PER_KWH
        case _:
            return report.shield_s / 60.0
