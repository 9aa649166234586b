"""The results folder of a campaign: tables, columns and provenance."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from kankaku.analysis.results import COLUMNS, columns_frame
from kankaku.analysis.tables.campaign_tables import (
    FAULT_RUNS,
    FAULT_TABLE,
    FAULT_TABLES,
    fault_table,
)
from kankaku.analysis.tables.columns import csv_text, json_text, rows_frame, write_whole


class FaultTables(NamedTuple):
    """What was written, and where."""

    folder: Path
    runs: pd.DataFrame
    table: pd.DataFrame


def publish_faults(
    folder: Path, rows: Sequence[Mapping[str, object]], provenance: Mapping[str, Any]
) -> FaultTables:
    """
    Write the tables of a campaign, the meaning of their columns, and provenance.

    Parameters
    ----------
    folder
        An existing folder.
    rows
        Rows of ``fault_runs``.
    provenance
        What was run; anything that JSON can hold.

    Returns
    -------
    FaultTables
        What was written.
    """
    runs = rows_frame(rows, FAULT_RUNS)
    table = fault_table(runs)
    write_whole(folder / "provenance.json", json_text(provenance))
    write_whole(folder / "columns.csv", csv_text(columns_frame(FAULT_TABLES), COLUMNS))
    write_whole(folder / "fault_runs.csv", csv_text(runs, FAULT_RUNS))
    write_whole(folder / "fault_table.csv", csv_text(table, FAULT_TABLE))
    return FaultTables(folder, runs, table)
