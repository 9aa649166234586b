"""An ensemble in one table: means, paired intervals and quantiles; and how precise a mean is."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from kankaku.analysis.tables.columns import rows_frame, rows_of
from kankaku.analysis.tables.compare import comparison, half_width, student
from kankaku.analysis.tables.indicators import COMPARED, INDICATOR_OF
from kankaku.railway.arrays import FloatArray
from kankaku.railway.errors import KankakuError, suggesting
from kankaku.railway.plan.seed_design import SeedDesign
from kankaku.railway.step.records import Column

LEVELS: Mapping[str, float] = {
    "minimum": 0.0,
    "quantile_05": 0.05,
    "quantile_25": 0.25,
    "median": 0.5,
    "quantile_75": 0.75,
    "quantile_95": 0.95,
    "maximum": 1.0,
}
"""Quantiles of the runs by their column."""
STUDY = (
    Column("scenario", "str", "", "name of the scenario"),
    Column("controller", "str", "", "name of the controller; the first one is the baseline"),
    Column("indicator", "str", "", "column of the table summary"),
    Column("unit", "str", "", "unit of the indicator"),
    Column("runs", "int64", "", "finished runs, one per seed"),
    Column("mean", "float64", "as unit", "mean over runs"),
    Column("mean_confidence_95", "float64", "as unit", "half width of its 95 % interval"),
    Column("deviation", "float64", "as unit", "sample standard deviation over runs"),
    Column("pairs", "int64", "", "seeds that the baseline has finished, too"),
    Column("difference", "float64", "as unit", "mean of the differences paired by seed"),
    Column("confidence_95", "float64", "as unit", "half width of its 95 % interval"),
    Column("change_pct", "float64", "%", "difference over the baseline's mean; empty if too small"),
    *(
        Column(name, "float64", "as unit", f"quantile {level:g} of the runs")
        for name, level in LEVELS.items()
    ),
)
STUDY_TABLES: Mapping[str, tuple[Column, ...]] = {"study": STUDY}
UNTIL = "--until"
_UNTIL = re.compile(r"\s*([A-Za-z]\w*)\s*(?:±|\+/?-)\s*([0-9]*\.?[0-9]+)\s*(\S+)\s*")


def study_frame(
    summary: pd.DataFrame, scenarios: Mapping[str, SeedDesign], controllers: Sequence[str]
) -> pd.DataFrame:
    """
    Return the table ``study``.

    Parameters
    ----------
    summary
        The table ``summary`` of all runs that count, with a column ``scenario``.
    scenarios
        How their seeds share draws, in their order.
    controllers
        Baseline first.

    Returns
    -------
    pd.DataFrame
        Columns ``STUDY``: a row per scenario, controller and indicator that is told.
    """
    rows = (
        row
        for scenario, design in scenarios.items()
        for row in _rows(scenario, summary[summary["scenario"] == scenario], controllers, design)
    )
    return rows_frame(rows, STUDY)


def _rows(
    scenario: str, summary: pd.DataFrame, controllers: Sequence[str], design: SeedDesign
) -> Iterator[dict[str, object]]:
    for cell in rows_of(comparison(summary, controllers=controllers, design=design)):
        own = summary[summary["controller"] == cell["controller"]]
        values = own[cell["indicator"]].to_numpy(dtype=np.float64)
        known = values[~np.isnan(values)]
        means = design.replicate_means(values, own["seed"].to_numpy())
        yield {
            "scenario": scenario,
            **cell,
            "runs": len(own),
            "mean_confidence_95": half_width(means[~np.isnan(means)]),
            "deviation": float(known.std(ddof=1)) if known.size > 1 else np.nan,
            **{
                name: float(np.quantile(known, level)) if known.size else np.nan
                for name, level in LEVELS.items()
            },
        }


def running_means(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    Return the mean of the first values, of more and more of them, and how sure it is.

    Parameters
    ----------
    values
        Of independent runs, or means of independent replicates of runs, in order. shape (n,)

    Returns
    -------
    tuple[FloatArray, FloatArray]
        Means, and half the widths of their 95 % intervals (nan of the first). shape (n,) each
    """
    counts = np.arange(1, values.size + 1)
    # Counted from their mean, so that squares lose no digits.
    middle = float(values.mean()) if values.size else 0.0
    sums = np.cumsum(values - middle)
    squares = np.cumsum((values - middle) ** 2)
    with np.errstate(invalid="ignore", divide="ignore"):
        variances = np.maximum(squares - sums**2 / counts, 0.0) / (counts - 1)
        halves: FloatArray = student(counts - 1) * np.sqrt(variances / counts)
    return middle + sums / counts, halves


class PrecisionError(KankakuError):
    """What of a wanted precision cannot be understood."""


@dataclass(frozen=True, slots=True)
class Precision:
    """How precisely a mean is wanted."""

    indicator: str
    width: float
    """Half of the 95 % interval. In ``unit``"""
    unit: str
    """``%`` of the mean, or the indicator's unit."""

    def __str__(self) -> str:
        return f"{self.indicator} ±{self.width:g} {self.unit}"

    def half(self, values: FloatArray) -> float:
        """
        Return how precisely a mean is known.

        Parameters
        ----------
        values
            The indicator in independent runs, or its means over independent replicates of runs.
            shape (n,)

        Returns
        -------
        float
            Half of the 95 % interval, in ``unit``; nan for fewer than two values.
        """
        half = half_width(values)
        if self.unit != "%" or np.isnan(half) or half == 0.0:
            return half
        mean = abs(float(values.mean()))
        return 100.0 * half / mean if mean > 0.0 else np.inf


def precision_of(text: str) -> Precision:
    """
    Read a wanted precision.

    Parameters
    ----------
    text
        An indicator, ``±`` or ``+-``, a number and ``%`` or the indicator's unit, for example
        ``interstation_stop_time_s ±2 %``.

    Returns
    -------
    Precision
        The same in numbers.

    Raises
    ------
    PrecisionError
        If it is none, or of an unknown indicator.
    """
    found = _UNTIL.fullmatch(text)
    if found is None:
        example = '"interstation_stop_time_s ±2 %" or "interstation_stop_time_s +-5 s"'
        raise PrecisionError(UNTIL, f"{text!r} is no indicator with a precision", example)
    name, width, unit = found[1], float(found[2]), found[3]
    if name not in COMPARED:
        allowed = suggesting(name, tuple(COMPARED), ", ".join(COMPARED))
        raise PrecisionError(UNTIL, f"{name!r} is no indicator", allowed)
    units = ["%", *filter(None, [INDICATOR_OF[name].column.unit])]
    if unit not in units:
        raise PrecisionError(UNTIL, f"{name} in {unit!r}", " or ".join(units))
    if width <= 0.0:
        raise PrecisionError(UNTIL, f"{name} ±{width:g} {unit}", "more than 0")
    return Precision(name, width, unit)


def largest_difference(one: Mapping[str, Any], other: Mapping[str, Any]) -> tuple[float, str]:
    """
    Return where two rows of the table ``summary`` differ most.

    Parameters
    ----------
    one, other
        Rows of the same run, made in two ways.

    Returns
    -------
    tuple[float, str]
        Largest relative difference of all numbers, and its column; 0 of rows that are alike.
    """
    worst, where = 0.0, ""
    for name in INDICATOR_OF:
        a, b = float(one[name]), float(other[name])
        if a == b or (np.isnan(a) and np.isnan(b)):
            continue
        apart = abs(a - b) / max(abs(a), abs(b))
        # What only one of them knows is as different as can be.
        apart = np.inf if np.isnan(apart) else apart
        if apart > worst:
            worst, where = apart, name
    return worst, where
