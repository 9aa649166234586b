"""The design of Morris and what it tells; the only place that knows SALib."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from SALib.analyze import morris as morris_analysis
from SALib.sample import morris as morris_sample

from kankaku.railway.arrays import FloatArray

LEVELS = 4
DELTA = LEVELS / (2.0 * (LEVELS - 1.0))
"""Every step of a trajectory leads so far through the range of one assumption. [-]"""
CANDIDATES = 4
"""So many times as many trajectories are drawn as are kept: those that lie furthest apart."""
SIZE_OF_NOISE = float(np.sqrt(2.0 / np.pi))
"""Mean absolute value of normal noise with standard deviation 1. [-]"""


def trajectories(names: Sequence[str], count: int, seed: int) -> FloatArray:
    """
    Return a design.

    Parameters
    ----------
    names
        Assumptions.
    count
        Trajectories, two or more. [-]
    seed
        Seed of the design.

    Returns
    -------
    FloatArray
        Places from 0 to 1. shape (count (n_names + 1), n_names)

    References
    ----------
    .. [1] M. D. Morris, *Factorial Sampling Plans for Preliminary Computational Experiments*,
       Technometrics 33, 1991.
    .. [2] F. Campolongo, J. Cariboni, A. Saltelli, *An effective screening design for sensitivity
       analysis of large models*, Environmental Modelling & Software 22, 2007: trajectories that
       lie far apart, and mu*.
    """
    places: FloatArray = morris_sample.sample(
        _problem(names), CANDIDATES * count, LEVELS, optimal_trajectories=count, seed=seed
    )
    # Sums of thirds are not the same to the last bit, and tasks are told apart by their places.
    return np.round(places, 9)


def effects(
    names: Sequence[str], places: FloatArray, results: FloatArray, seed: int
) -> pd.DataFrame:
    """
    Return how much each assumption does to a result.

    Parameters
    ----------
    names
        Assumptions.
    places
        The design. shape (n_points, n_names)
    results
        The result at each of its points; a trajectory with a nan is left out. shape (n_points,)
    seed
        Of the resampling for the confidence interval.

    Returns
    -------
    pd.DataFrame
        A row per assumption: ``assumption``, ``mu``, ``mu_star``, ``confidence_95``, ``sigma``,
        all for the way from one end of the range to the other, and ``trajectories``. All nan with
        fewer than two trajectories.
    """
    size = len(names) + 1
    whole = np.isfinite(results.reshape(-1, size)).all(axis=1)
    count = int(whole.sum())
    shown = pd.DataFrame({"assumption": list(names), "trajectories": count})
    columns = {"mu": "mu", "mu_star": "mu_star", "confidence_95": "mu_star_conf", "sigma": "sigma"}
    if count < 2:
        return shown.assign(**dict.fromkeys(columns, np.nan))
    kept = np.repeat(whole, size)
    told = morris_analysis.analyze(
        _problem(names), places[kept], results[kept], num_levels=LEVELS, seed=seed
    )
    return shown.assign(**{ours: np.asarray(told[its]) for ours, its in columns.items()})


def seed_noise(names: Sequence[str], places: FloatArray, without_a_seed: FloatArray) -> FloatArray:
    """
    Return the mean absolute effect of an assumption that does nothing but to single seeds.

    Seeds are the same at both ends of a step, so that its effect has a standard error over seeds:
    that of the jackknife, which holds for per cents of means as well.

    Parameters
    ----------
    names
        Assumptions.
    places
        The design. shape (n_points, n_names)
    without_a_seed
        The result at each point without the first seed, without the second, and so on; steps with
        a nan are left out. shape (n_seeds, n_points), two seeds or more

    Returns
    -------
    FloatArray
        By assumption, nan without any step. shape (n_names,)

    References
    ----------
    .. [1] B. Efron, C. Stein, *The jackknife estimate of variance*, Annals of Statistics 9, 1981.
    """
    seeds, size = len(without_a_seed), len(names) + 1
    steps = np.diff(places.reshape(-1, size, len(names)), axis=1)
    which = np.abs(steps).argmax(axis=2)
    lengths = np.take_along_axis(steps, which[:, :, np.newaxis], axis=2)[:, :, 0]
    found = np.diff(without_a_seed.reshape(seeds, -1, size), axis=2) / lengths
    variances = (seeds - 1.0) * found.var(axis=0)
    means = [
        np.mean(own[np.isfinite(own)]) if np.isfinite(own).any() else np.nan
        for own in (variances[which == number] for number in range(len(names)))
    ]
    noise: FloatArray = SIZE_OF_NOISE * np.sqrt(means)
    return noise


def _problem(names: Sequence[str]) -> dict[str, object]:
    return {"num_vars": len(names), "names": list(names), "bounds": [[0.0, 1.0]] * len(names)}
