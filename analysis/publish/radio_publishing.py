"""The results folder of a radio network: tables, three figures, columns and provenance."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from kankaku.analysis.publish.results_folder import Draw, Kind, publish_folder
from kankaku.analysis.saved_run import SavedRun
from kankaku.analysis.tables.radio_tables import (
    RADIO_TABLES,
    CellPoint,
    LoadCase,
    cell_capacity_frame,
    radio_load_frame,
    round_trips_frame,
    utilisation_frame,
)
from kankaku.analysis.words import label_of
from kankaku.railway.radio.cells import RadioPlan

RADIO_RESULTS = Kind(
    "radio_load",
    RADIO_TABLES,
    figures=("radio_load", "round_trips", "cell_capacity"),
    large=frozenset({"utilisation"}),
)


class RadioTables(NamedTuple):
    """What was found and written, and where."""

    folder: Path
    plan: RadioPlan
    run: SavedRun
    cases: Sequence[LoadCase]
    points: Sequence[CellPoint]
    load: pd.DataFrame
    cell_capacity: pd.DataFrame


def publish_radio(  # noqa: PLR0917 - what was asked, found and done
    folder: Path,
    title: str,
    run: SavedRun,
    plan: RadioPlan,
    cases: Sequence[LoadCase],
    points: Sequence[CellPoint],
    provenance: Mapping[str, Any],
) -> RadioTables:
    """
    Write tables, figures, columns and provenance.

    Parameters
    ----------
    folder
        Results folder; made if missing.
    title
        Of the scenario.
    run
        The saved run that trains were taken from.
    plan
        What was asked.
    cases
        All simulations of the line.
    points
        All simulations of a cell.
    provenance
        What was simulated; anything that JSON can hold.

    Returns
    -------
    RadioTables
        The tables that a reader looks at first.
    """
    load, capacity = radio_load_frame(cases, plan), cell_capacity_frame(points)
    frames = {
        "radio_load": load,
        "utilisation": utilisation_frame(cases),
        "round_trips": round_trips_frame(cases),
        "cell_capacity": capacity,
    }
    figures = _figures(title, run, plan, cases, points)
    publish_folder(folder, RADIO_RESULTS, frames, figures, provenance)
    return RadioTables(folder, plan, run, cases, points, load, capacity)


def _figures(
    title: str,
    run: SavedRun,
    plan: RadioPlan,
    cases: Sequence[LoadCase],
    points: Sequence[CellPoint],
) -> dict[str, Draw]:
    # Here, because matplotlib takes half a second that not every command needs.
    from kankaku.analysis.figures.radio_figures import (  # noqa: PLC0415
        cell_capacity_figure,
        radio_load_figure,
        round_trip_figure,
    )

    shown = next(case for case in cases if case.start_s is not None)
    heading = f"Radio load, {shown.system.title}, trains of {label_of(run.controller)}"
    carried = "How many trains can one cell carry?"
    return {
        "radio_load": lambda: radio_load_figure(shown, run, plan, title=heading),
        "round_trips": lambda: round_trip_figure(cases, title=f"Round trips: {title}"),
        "cell_capacity": lambda: cell_capacity_figure(points, plan, title=carried),
    }
