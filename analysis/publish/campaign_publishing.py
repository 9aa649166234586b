"""The results folder of a campaign: tables, columns and provenance."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from kankaku.analysis.publish.results_folder import Kind, publish_folder
from kankaku.analysis.tables.campaign_tables import (
    FAULT_RUNS,
    FAULT_TABLES,
    fault_table,
)
from kankaku.analysis.tables.columns import rows_frame

CAMPAIGN_RESULTS = Kind("fault_table", FAULT_TABLES)


class CampaignTables(NamedTuple):
    """What was written, and where."""

    folder: Path
    runs: pd.DataFrame
    table: pd.DataFrame


def publish_campaign(
    folder: Path, rows: Sequence[Mapping[str, object]], provenance: Mapping[str, Any]
) -> CampaignTables:
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
    CampaignTables
        What was written.
    """
    runs = rows_frame(rows, FAULT_RUNS)
    table = fault_table(runs)
    frames = {"fault_runs": runs, "fault_table": table}
    publish_folder(folder, CAMPAIGN_RESULTS, frames, {}, provenance)
    return CampaignTables(folder, runs, table)
