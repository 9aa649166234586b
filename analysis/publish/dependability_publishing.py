"""The results folder of availability and fault tree: tables, figures, columns and provenance."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from kankaku.analysis.figures.dependability_figures import availability_figure, fault_tree_figure
from kankaku.analysis.figures.style import write_figure
from kankaku.analysis.results import COLUMNS, columns_frame
from kankaku.analysis.tables.columns import csv_text, json_text, write_whole
from kankaku.analysis.tables.dependability import (
    AVAILABILITY,
    CUT_SETS,
    DEPENDABILITY_TABLES,
    OUTAGES,
    TOP_EVENTS,
    Endurance,
    availability_frame,
    cut_sets_frame,
    outages_frame,
    top_events_frame,
)
from kankaku.railway.failures.fault_tree import FaultTree

OF_THE_TREE = ("top_events.csv", "cut_sets.csv", "fault_tree.png", "fault_tree.svg")

DEPENDABILITY_FILES = ("availability.csv", "columns.csv")
"""Every results folder of this kind has them."""


class DependabilityTables(NamedTuple):
    """What was found and written, and where."""

    folder: Path
    systems: Sequence[Endurance]
    tree: FaultTree | None
    source: str
    availability: pd.DataFrame
    outages: pd.DataFrame


def publish_dependability(
    folder: Path,
    systems: Sequence[Endurance],
    tree: FaultTree | None,
    source: str,
    provenance: Mapping[str, Any],
) -> DependabilityTables:
    """
    Write tables, figures, columns and provenance.

    Parameters
    ----------
    folder
        Results folder; made if missing.
    systems
        What was found about each system.
    tree
        Fault tree, if there is one.
    source
        Of what was published.
    provenance
        What was worked out; anything that JSON can hold.

    Returns
    -------
    DependabilityTables
        The tables that a reader looks at first.
    """
    table, outages = availability_frame(systems), outages_frame(systems)
    # Before anything is written: a tree may be too large.
    files = (
        {}
        if tree is None
        else {
            "top_events.csv": csv_text(top_events_frame(tree), TOP_EVENTS),
            "cut_sets.csv": csv_text(cut_sets_frame(tree), CUT_SETS),
        }
    )
    folder.mkdir(parents=True, exist_ok=True)
    for name in OF_THE_TREE:
        (folder / name).unlink(missing_ok=True)
    if tree is not None:
        write_figure(fault_tree_figure(tree), folder / "fault_tree")
    write_figure(availability_figure(systems, source=source), folder / "availability")
    explained = {
        name: columns
        for name, columns in DEPENDABILITY_TABLES.items()
        if tree is not None or f"{name}.csv" not in OF_THE_TREE
    }
    files |= {
        "provenance.json": json_text(provenance),
        "outages.csv": csv_text(outages, OUTAGES),
        "columns.csv": csv_text(columns_frame(explained), COLUMNS),
        # Last, because a folder counts as results once it has it.
        "availability.csv": csv_text(table, AVAILABILITY),
    }
    for name, text in files.items():
        write_whole(folder / name, text)
    return DependabilityTables(folder, systems, tree, source, table, outages)
