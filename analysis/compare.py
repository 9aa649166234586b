"""Every controller against the first: means over runs and paired differences."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from analysis.schema import rows_frame, rows_of
from analysis.summary import SUMMARY
from railway.arrays import FloatArray
from railway.records import Column

COMPARISON = (
    Column("controller", "str", "", "name of the controller"),
    Column("indicator", "str", "", "column of the table summary"),
    Column("unit", "str", "", "unit of the indicator"),
    Column("pairs", "int64", "", "runs of both controllers with equal seed and initial delay"),
    Column("mean", "float64", "as unit", "mean over runs"),
    Column("difference", "float64", "as unit", "mean of the paired differences to the baseline"),
    Column("confidence_95", "float64", "as unit", "half width of its 95 % confidence interval"),
    Column("change_pct", "float64", "%", "difference over the baseline's mean"),
)
INDICATORS: Mapping[str, str] = {
    "interstation_stop_time_s": "stop time between stations",
    "interstation_stops": "stops between stations",
    "interstation_crawl_time_s": "crawl between stations",
    "mean_arrival_delay_s": "mean arrival delay",
    "final_arrival_delay_s": "delay at the last station",
    "secondary_delay_s": "secondary delay",
    "energy_gross_kwh": "energy, gross",
    "energy_net_kwh": "energy, net",
    "scheduled_speed_kmh": "scheduled speed",
    "jerk_mps3": "jerk, r.m.s.",
}
"""Indicators that are compared, and what a reader calls them."""
CONFIDENCE = 0.95


def comparison(
    summary: pd.DataFrame, indicators: Sequence[str] = tuple(INDICATORS)
) -> pd.DataFrame:
    """
    Compare every controller with the first one of the summary.

    Runs are paired by seed and initial delay: both controllers met the same dwell delays, so
    the differences vary much less than the values. The interval is Student's for the mean of
    the differences; over the delays of a sweep, which are no sample, it means nothing.

    Parameters
    ----------
    summary
        The table ``summary``.
    indicators
        Its columns to compare.

    Returns
    -------
    pd.DataFrame
        Columns ``COMPARISON``, one row per controller and indicator. ``confidence_95`` is
        nan for a single pair, ``change_pct`` nan where the baseline's mean is 0; the
        baseline itself differs by 0.
    """
    return rows_frame(_rows(summary, indicators), COMPARISON)


def _rows(summary: pd.DataFrame, indicators: Sequence[str]) -> Iterator[dict[str, object]]:
    units = {column.name: column.unit for column in SUMMARY}
    by_delays = summary.set_index(["seed", "initial_delay_s"])
    controllers = list(dict.fromkeys(summary["controller"]))
    for controller in controllers:
        own = by_delays[by_delays["controller"] == controller]
        baseline = by_delays[by_delays["controller"] == controllers[0]]
        shared = own.index.intersection(baseline.index)
        for indicator in indicators:
            values = own.loc[shared, indicator].to_numpy(dtype=np.float64)
            others = baseline.loc[shared, indicator].to_numpy(dtype=np.float64)
            differences = values - others
            difference = float(differences.mean()) if differences.size else np.nan
            reference = float(others.mean()) if others.size else np.nan
            yield {
                "controller": controller,
                "indicator": indicator,
                "unit": units[indicator],
                "pairs": len(shared),
                "mean": float(own[indicator].mean()),
                "difference": difference,
                "confidence_95": half_width(differences),
                "change_pct": 100.0 * difference / abs(reference) if reference else np.nan,
            }


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
    return float(stdtrit(count - 1, 0.5 + CONFIDENCE / 2)) * spread / float(np.sqrt(count))


def comparison_texts(compared: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    """
    Return the comparison as texts, one row per indicator and one column per controller.

    Parameters
    ----------
    compared
        What :func:`comparison` returned.

    Returns
    -------
    tuple[list[str], list[list[str]]]
        Header and rows. A cell shows the mean and, but for the baseline, the change against
        it in per cent with the half width of its 95 % interval where there are several seeds.
    """
    controllers = list(dict.fromkeys(compared["controller"]))
    rows: dict[str, list[str]] = {}
    for cell in rows_of(compared):
        indicator, unit = cell["indicator"], cell["unit"]
        label = INDICATORS.get(indicator, indicator)
        row = rows.setdefault(indicator, [f"{label} [{unit}]" if unit else label])
        row.append(_cell_text(cell, baseline=cell["controller"] == controllers[0]))
    return ["indicator", *controllers], list(rows.values())


def _cell_text(cell: Mapping[str, Any], *, baseline: bool) -> str:
    mean, change_pct, interval = cell["mean"], cell["change_pct"], cell["confidence_95"]
    if np.isnan(mean):
        return "-"
    text = (
        f"{mean:,.0f}" if abs(mean) >= 1000.0 else f"{mean:.{2 if 0.0 < abs(mean) < 1.0 else 1}f}"
    )
    if baseline or np.isnan(change_pct):
        return text
    # Adding nothing turns a rounded -0.0 into 0.0.
    change = f"{round(change_pct, 1) + 0.0:+.1f}"
    if np.isnan(interval) or cell["difference"] == 0.0:
        return f"{text} ({change} %)"
    interval_pct = abs(interval * change_pct / cell["difference"])
    return f"{text} ({change} ± {interval_pct:.1f} %)"
