"""Several scenarios in one table: a row per scenario and controller."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from kankaku.analysis.tables.columns import rows_frame, rows_of
from kankaku.analysis.tables.compare import comparison
from kankaku.analysis.tables.indicators import INDICATOR_OF
from kankaku.railway.plan.seed_design import EACH_FOR_ITSELF, SeedDesign
from kankaku.railway.step.records import Column

STOPS, CRAWL = "interstation_stop_time_s", "interstation_crawl_time_s"
DELAY, LATENESS = "mean_arrival_delay_s", "mean_arrival_lateness_s"
BOUND = "mean_delay_bound_s"
ENERGY = "energy_net_kwh"
SHOWN = (STOPS, CRAWL, DELAY, LATENESS, ENERGY)
"""Columns of the table ``summary`` that scenarios are compared by."""


def _parts(indicator: str) -> tuple[str, str, str, str]:
    """Return the columns of an indicator's difference, interval, change and its interval."""
    stem, _, unit = indicator.rpartition("_")
    return (
        f"{stem}_difference_{unit}",
        f"{stem}_confidence_95_{unit}",
        f"{stem}_change_pct",
        f"{stem}_change_confidence_95_pct",
    )


def _columns(indicator: str) -> tuple[Column, ...]:
    told = INDICATOR_OF[indicator].column
    difference, interval, change, change_interval = _parts(indicator)
    return (
        Column(indicator, "float64", told.unit, f"{told.meaning}; mean over runs"),
        Column(
            difference,
            "float64",
            told.unit,
            "mean of the differences to the baseline, paired by seed; 0 of the baseline itself",
        ),
        Column(
            interval,
            "float64",
            told.unit,
            "half width of its 95 % confidence interval; empty for fewer than two pairs",
        ),
        Column(
            change,
            "float64",
            "%",
            "difference over the baseline's mean; empty if that is too small or negative",
        ),
        Column(change_interval, "float64", "%", "half width of the interval over the same mean"),
    )


ACROSS = (
    Column("scenario", "str", "", "name of the scenario"),
    Column("controller", "str", "", "name of the controller; the first one is the baseline"),
    Column("runs", "int64", "", "finished runs, one per seed; others are in no mean and no sum"),
    Column("pairs", "int64", "", "seeds that the baseline has finished, too"),
    Column("knows_future", "bool", "", "told the drawn dwell delays: for comparison only"),
    *(column for indicator in SHOWN for column in _columns(indicator)),
    Column(BOUND, "float64", "s", f"{INDICATOR_OF[BOUND].column.meaning}; mean over runs"),
    Column("violations", "int64", "", "safety invariants that did not hold, sum over runs"),
    Column("unfinished", "int64", "", "trains still under way at the end, sum over runs"),
)
ACROSS_TABLES: Mapping[str, tuple[Column, ...]] = {"across": ACROSS}


def across_frame(
    summaries: Mapping[str, pd.DataFrame],
    controllers: Sequence[str],
    knows_future: Collection[str] = (),
    designs: Mapping[str, SeedDesign] | None = None,
) -> pd.DataFrame:
    """
    Return the table ``across``.

    Parameters
    ----------
    summaries
        The table ``summary`` of each scenario by its name, with the runs that are compared.
    controllers
        What is compared in each of them, baseline first.
    knows_future
        Those of them that are told the drawn dwell delays.
    designs
        How the seeds of each scenario share their draws; each for itself if None.

    Returns
    -------
    pd.DataFrame
        Columns ``ACROSS``: for each scenario every controller, also one without a run.
    """
    rows = (
        row
        for scenario, summary in summaries.items()
        for row in _rows(scenario, summary, controllers, (designs or {}).get(scenario))
    )
    told = ({**row, "knows_future": row["controller"] in knows_future} for row in rows)
    return rows_frame(told, ACROSS)


def _rows(
    scenario: str,
    summary: pd.DataFrame,
    controllers: Sequence[str],
    design: SeedDesign | None,
) -> Iterator[dict[str, object]]:
    compared = comparison(summary, SHOWN, controllers, design or EACH_FOR_ITSELF)
    for controller in controllers:
        own = summary[summary["controller"] == controller]
        cells = rows_of(compared[compared["controller"] == controller])
        row: dict[str, object] = {
            "scenario": scenario,
            "controller": controller,
            "runs": len(own),
            "pairs": cells[0]["pairs"],
            BOUND: float(own[BOUND].mean()),
            "violations": int(own["violations"].sum()),
            "unfinished": int((own["trains"] - own["trains_completed"]).sum()),
        }
        for cell in cells:
            row[cell["indicator"]] = cell["mean"]
            told = cell["difference"], cell["confidence_95"], cell["change_pct"], _half_pct(cell)
            row |= dict(zip(_parts(cell["indicator"]), told, strict=True))
        yield row


def _half_pct(cell: Mapping[str, Any]) -> float:
    """Return half the width of an interval in per cent of the baseline's mean."""
    difference, half, percent = cell["difference"], cell["confidence_95"], cell["change_pct"]
    if half == 0.0 and not np.isnan(percent):
        return 0.0
    return abs(half * percent / difference) if difference else np.nan


def cell_of(row: Mapping[str, Any], indicator: str, *, per_cent: bool = True) -> dict[str, Any]:
    """
    Return what a row says of one indicator.

    Parameters
    ----------
    row
        A row of the table ``across``.
    indicator
        One of ``SHOWN``.
    per_cent
        With its change in per cent, if it has one.

    Returns
    -------
    dict[str, Any]
        ``unit``, ``mean``, ``difference``, ``confidence_95``, ``change_pct`` (nan without one) and
        ``change_confidence_95_pct``.
    """
    difference, interval, change, change_interval = _parts(indicator)
    return {
        "unit": INDICATOR_OF[indicator].column.unit,
        "mean": row[indicator],
        "difference": row[difference],
        "confidence_95": row[interval],
        "change_pct": row[change] if per_cent else np.nan,
        "change_confidence_95_pct": row[change_interval] if per_cent else np.nan,
    }
