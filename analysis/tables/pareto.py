"""Which controllers no other one beats in stops, delay and energy at once."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from kankaku.analysis.tables.across_tables import DELAY, ENERGY, STOPS
from kankaku.railway.arrays import BoolArray, FloatArray

OBJECTIVES = (STOPS, DELAY, ENERGY)
"""Indicators of which less is better."""


def non_dominated(values: FloatArray) -> BoolArray:
    """
    Return which points no other one dominates.

    Parameters
    ----------
    values
        Points of which less is better in every column. shape (n_points, n_objectives)

    Returns
    -------
    BoolArray
        False where another point is nowhere worse and somewhere better, and where a value is
        missing. shape (n_points,)

    References
    ----------
    .. [1] Ehrgott, *Multicriteria Optimization*, 2nd edition, 2005, definition 2.1.
    """
    known: BoolArray = np.asarray(np.all(np.isfinite(values), axis=1))
    others = np.where(known[:, np.newaxis], values, np.inf)[np.newaxis, :, :]
    own = values[:, np.newaxis, :]
    no_worse: BoolArray = np.all(others <= own, axis=2)
    better: BoolArray = np.any(others < own, axis=2)
    found: BoolArray = known & ~np.any(no_worse & better, axis=1)
    return found


def best_controllers(table: pd.DataFrame, objectives: Sequence[str] = OBJECTIVES) -> list[str]:
    """
    Return the controllers of a scenario that no other one beats in every respect.

    Parameters
    ----------
    table
        The rows of one scenario of the table ``across``.
    objectives
        Indicators of which less is better.

    Returns
    -------
    list[str]
        By their means; those that know the future or violated safety do not compete.
    """
    competes = table[~table["knows_future"] & (table["violations"] == 0)]
    best = non_dominated(competes[list(objectives)].to_numpy(dtype=np.float64))
    return competes["controller"][best].tolist()
