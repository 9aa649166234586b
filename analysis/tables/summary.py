"""One row of indicators per run, computed from the raw tables alone."""

from collections.abc import Iterable

import pandas as pd

from kankaku.analysis.tables.columns import rows_frame
from kankaku.analysis.tables.indicators import INDICATORS, MeasuredRun
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.railway.step.records import Column

SUMMARY = (
    Column("controller", "str", "", "name of the controller"),
    Column("seed", "int64", "", "seed of the dwell delays"),
    Column("initial_delay_s", "float64", "s", "swept delay of one train; 0 without a sweep"),
    *(indicator.column for indicator in INDICATORS),
)


def summary_frame(runs: Iterable[RunTables]) -> pd.DataFrame:
    """
    Return the table ``summary``.

    Parameters
    ----------
    runs
        Runs in the order in which they are to appear; the first controller is the baseline.

    Returns
    -------
    pd.DataFrame
        Columns ``SUMMARY``, one row per run.
    """
    return rows_frame((_summary_row(run) for run in runs), SUMMARY)


def _summary_row(run: RunTables) -> dict[str, object]:
    measured = MeasuredRun(run)
    return {
        "controller": run.controller,
        "seed": run.seed,
        "initial_delay_s": run.initial_delay_s,
        **{indicator.column.name: indicator.of(measured) for indicator in INDICATORS},
    }
