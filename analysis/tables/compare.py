"""
Every controller against the first: means over runs and paired differences.

A change is told in per cent only where the baseline's mean is large enough for that: of a mean
near zero per cents are noise, and of a negative one (trains that are early) they mislead. What is
large enough is declared beside each indicator. Elsewhere the difference itself is told.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

from kankaku.analysis.tables.columns import rows_frame
from kankaku.analysis.tables.indicators import COMPARED, INDICATOR_OF
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.seed_design import EACH_FOR_ITSELF, SeedDesign
from kankaku.railway.step.records import Column

COMPARISON = (
    Column("controller", "str", "", "name of the controller"),
    Column("indicator", "str", "", "column of the table summary"),
    Column("unit", "str", "", "unit of the indicator"),
    Column("pairs", "int64", "", "runs of both controllers with equal seed and initial delay"),
    Column("mean", "float64", "as unit", "mean over runs"),
    Column("difference", "float64", "as unit", "mean of the paired differences to the baseline"),
    Column("confidence_95", "float64", "as unit", "half width of its 95 % confidence interval"),
    Column("change_pct", "float64", "%", "difference over the baseline's mean; empty if too small"),
)


CONFIDENCE = 0.95


def comparison(
    summary: pd.DataFrame,
    indicators: Sequence[str] = (),
    controllers: Sequence[str] = (),
    design: SeedDesign = EACH_FOR_ITSELF,
) -> pd.DataFrame:
    """
    Compare every controller with the first one.

    Runs are paired by seed and initial delay: both controllers met the same dwell delays, so
    the differences vary much less than the values. The interval is Student's for the mean of
    the differences; over the delays of a sweep, which are no sample, it means nothing.

    Parameters
    ----------
    summary
        The table ``summary``.
    indicators
        Its columns to compare; those of :func:`told_indicators` if empty.
    controllers
        Baseline first; those of the summary in their order if empty. One without a run has no
        mean, and nothing differs from a baseline without one.
    design
        How seeds share their draws. The interval is of the means over whole replicates of it.

    Returns
    -------
    pd.DataFrame
        Columns ``COMPARISON``, one row per controller and indicator. ``confidence_95`` is
        nan for a single pair, ``change_pct`` nan where :func:`change_pct` is; the baseline
        itself differs by 0.
    """
    named = controllers or list(dict.fromkeys(summary["controller"]))
    told = indicators or told_indicators(summary)
    return rows_frame(_rows(summary, told, named, design), COMPARISON)


def told_indicators(summary: pd.DataFrame) -> list[str]:
    """
    Return what is compared unless somebody asks for something else.

    Parameters
    ----------
    summary
        The table ``summary``.

    Returns
    -------
    list[str]
        Columns of it, without rare ones that are 0 in every run.
    """
    return [name for name, one in COMPARED.items() if not one.rare or summary[name].any()]


def _rows(
    summary: pd.DataFrame,
    indicators: Sequence[str],
    controllers: Sequence[str],
    design: SeedDesign,
) -> Iterator[dict[str, object]]:
    by_delays = summary.set_index(["seed", "initial_delay_s"])
    for controller in controllers:
        own = by_delays[by_delays["controller"] == controller]
        baseline = by_delays[by_delays["controller"] == controllers[0]]
        shared = own.index.intersection(baseline.index)
        seeds = shared.get_level_values("seed").to_numpy()
        for indicator in indicators:
            values = own.loc[shared, indicator].to_numpy(dtype=np.float64)
            others = baseline.loc[shared, indicator].to_numpy(dtype=np.float64)
            differences = values - others
            difference = float(differences.mean()) if differences.size else np.nan
            reference = float(others.mean()) if others.size else np.nan
            yield {
                "controller": controller,
                "indicator": indicator,
                "unit": INDICATOR_OF[indicator].column.unit,
                "pairs": len(shared),
                "mean": float(own[indicator].mean()),
                "difference": difference,
                "confidence_95": half_width(design.replicate_means(differences, seeds)),
                "change_pct": change_pct(indicator, difference, reference),
            }


def change_pct(indicator: str, difference: float, reference: float) -> float:
    """
    Return a change in per cent, where that means something.

    Parameters
    ----------
    indicator
        Its name. One that is not declared needs a positive reference.
    difference
        The change. In the indicator's unit
    reference
        The baseline's mean. Same unit

    Returns
    -------
    float
        Change over reference; nan unless the reference is greater than the indicator's
        ``per_cent_above``. [%]
    """
    above = INDICATOR_OF[indicator].per_cent_above if indicator in INDICATOR_OF else 0.0
    return 100.0 * difference / reference if reference > above else np.nan


def half_width(differences: FloatArray) -> float:
    """
    Return half the width of the 95 % confidence interval of a mean.

    Parameters
    ----------
    differences
        Independent values. shape (n,)

    Returns
    -------
    float
        ``t(0.975, n - 1) s / sqrt(n)`` with the sample standard deviation s; nan for fewer
        than two values. Same unit

    References
    ----------
    .. [1] Student, *The probable error of a mean*, Biometrika 6, 1908.
    """
    count = differences.size
    if count < 2:
        return np.nan
    spread = float(differences.std(ddof=1))
    return float(student(count - 1)) * spread / float(np.sqrt(count))


def student(freedom: Any) -> Any:  # noqa: ANN401 - a number or an array of them
    """
    Return how many standard errors lie on each side of a mean.

    Parameters
    ----------
    freedom
        Degrees of freedom, one less than there are values. [-]

    Returns
    -------
    Any
        Student's quantile of 97.5 %, of the same shape. [-]
    """
    from scipy.special import stdtrit  # noqa: PLC0415 - takes long to import

    return stdtrit(freedom, 0.5 + CONFIDENCE / 2)
