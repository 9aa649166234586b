"""The results folder of availability and fault tree: tables, figures, columns and provenance."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from kankaku.analysis.publish.results_folder import Draw, Kind, publish_folder
from kankaku.analysis.tables.dependability import (
    DEPENDABILITY_TABLES,
    Endurance,
    availability_frame,
    cut_sets_frame,
    outages_frame,
    top_events_frame,
)
from kankaku.railway.failures.fault_tree import FaultTree

DEPENDABILITY_RESULTS = Kind(
    "availability", DEPENDABILITY_TABLES, figures=("availability", "fault_tree")
)


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
    frames = {"availability": table, "outages": outages}
    if tree is not None:
        frames |= {"top_events": top_events_frame(tree), "cut_sets": cut_sets_frame(tree)}
    figures = _figures(systems, tree, source)
    publish_folder(folder, DEPENDABILITY_RESULTS, frames, figures, provenance)
    return DependabilityTables(folder, systems, tree, source, table, outages)


def _figures(systems: Sequence[Endurance], tree: FaultTree | None, source: str) -> dict[str, Draw]:
    # Here, because matplotlib takes half a second that not every command needs.
    from kankaku.analysis.figures.dependability_figures import (  # noqa: PLC0415
        availability_figure,
        fault_tree_figure,
    )

    figures: dict[str, Draw] = {}
    if tree is not None:
        figures["fault_tree"] = partial(fault_tree_figure, tree)
    figures["availability"] = partial(availability_figure, systems, source=source)
    return figures
