"""A campaign in words: its table for a terminal."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from kankaku.analysis.tables.columns import rows_of


def campaign_texts(table: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    """
    Return the table of failures as a reader likes to see it.

    Parameters
    ----------
    table
        The table ``fault_table``.

    Returns
    -------
    tuple[list[str], list[list[str]]]
        Header and rows.
    """
    header = [
        *("fault", "runs", "detection", "reaction"),
        *("trains stopped", "delay caused [s]", "unsafe events"),
    ]
    return header, [
        [
            row["variant"],
            str(row["runs"]),
            _detection(row),
            row["reaction"],
            f"{row['trains_stopped']:.2f}",
            f"{row['delay_caused_s']:.1f}",
            str(row["unsafe_events"]),
        ]
        for row in rows_of(table)
    ]


def _detection(row: Mapping[str, Any]) -> str:
    if not row["detected_percent"]:
        return "none"
    told = f"{row['detected_percent']:.0f} %, after {row['detected_after_s']:.1f} s"
    return f"{row['detection']} ({told})"
