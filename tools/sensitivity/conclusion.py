"""What two-stage deceleration changes at a point, as a mean over its seeds."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from kankaku.analysis.tables.compare import change_pct
from kankaku.railway.arrays import FloatArray
from tools.sensitivity.assumptions import CONTROLLERS
from tools.sensitivity.journal import Measured

STOPS, DELAY, ENERGY = "interstation_stop_time_s", "mean_arrival_delay_s", "energy_net_kwh"
BASE_STOPS = "close_up_stop_s"


class Change(NamedTuple):
    """A number that the conclusion is told in."""

    key: str
    title: str
    short: str
    """The title where there is little room."""
    unit: str
    column: str
    """Column of the table ``summary``."""

    def of(self, base: FloatArray, other: FloatArray) -> float:
        """
        Return the change.

        Parameters
        ----------
        base, other
            Values of the baseline and of the other controller. shape (n_seeds,)

        Returns
        -------
        float
            Of the means, in the unit; nan where per cents mean nothing.
        """
        difference = float((other - base).mean())
        if self.unit != "%":
            return difference
        return change_pct(self.column, difference, float(base.mean()))


CHANGES = (
    Change("stop_s", "stop time between stations", "stops", "s", STOPS),
    Change("stop_pct", "stop time between stations", "stops", "%", STOPS),
    Change("delay_s", "mean arrival delay", "delay", "s", DELAY),
    Change("energy_pct", "net energy", "energy", "%", ENERGY),
)
"""The first one orders the assumptions."""


def conclusion(runs: Sequence[Measured]) -> dict[str, float]:
    """
    Return what the runs of one point say.

    Parameters
    ----------
    runs
        One per seed.

    Returns
    -------
    dict[str, float]
        ``close_up_stop_s``, the key of every ``CHANGES``, nan where per cents mean nothing, and
        ``harmed``: runs with a violation or with a train that did not get through.
    """

    def values(controller: str, name: str) -> FloatArray:
        return np.array([run[controller][name] for run in runs])

    base, other = CONTROLLERS
    found = {BASE_STOPS: float(values(base, STOPS).mean())}
    for change in CHANGES:
        found[change.key] = change.of(values(base, change.column), values(other, change.column))
    rows = [row for run in runs for row in run.values()]
    found["harmed"] = sum(
        row["violations"] > 0 or row["trains_completed"] < row["trains"] for row in rows
    )
    return found


def conclusions(runs_by_point: Sequence[Sequence[Measured]]) -> pd.DataFrame:
    """
    Return what the runs of many points say.

    Parameters
    ----------
    runs_by_point
        For each point one run per seed.

    Returns
    -------
    pd.DataFrame
        A row per point, as :func:`conclusion` tells it.
    """
    return pd.DataFrame([conclusion(runs) for runs in runs_by_point])
