"""The results folder of a radio network: tables, three figures, columns and provenance."""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from kankaku.analysis.figures.drawing import write_figure
from kankaku.analysis.figures.radio_figures import (
    cell_capacity_figure,
    radio_load_figure,
    round_trip_figure,
)
from kankaku.analysis.results import COLUMNS, columns_frame
from kankaku.analysis.saved_run import SavedRun
from kankaku.analysis.tables.columns import csv_text, json_text, write_whole
from kankaku.analysis.tables.radio_tables import (
    CELL_CAPACITY,
    RADIO_LOAD,
    RADIO_TABLES,
    ROUND_TRIPS,
    CellPoint,
    LoadCase,
    cell_capacity_frame,
    radio_load_frame,
    round_trips_frame,
    utilisation_frame,
)
from kankaku.analysis.words import label_of
from kankaku.railway.radio.cells import RadioPlan

RADIO_FILES = ("radio_load.csv", "columns.csv")
"""Every results folder of this kind has them."""


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
    folder.mkdir(parents=True, exist_ok=True)
    shown = next(case for case in cases if case.start_s is not None)
    heading = f"Radio load, {shown.system.title}, trains of {label_of(run.controller)}"
    write_figure(radio_load_figure(shown, run, plan, title=heading), folder / "radio_load")
    write_figure(round_trip_figure(cases, title=f"Round trips: {title}"), folder / "round_trips")
    figure = cell_capacity_figure(points, plan, title="How many trains can one cell carry?")
    write_figure(figure, folder / "cell_capacity")
    buffer = io.BytesIO()
    frame = utilisation_frame(cases)
    frame.to_parquet(buffer, engine="pyarrow", compression="zstd", index=False)
    write_whole(folder / "utilisation.parquet", buffer.getvalue())
    write_whole(folder / "provenance.json", json_text(provenance))
    write_whole(folder / "round_trips.csv", csv_text(round_trips_frame(cases), ROUND_TRIPS))
    write_whole(folder / "cell_capacity.csv", csv_text(capacity, CELL_CAPACITY))
    write_whole(folder / "columns.csv", csv_text(columns_frame(RADIO_TABLES), COLUMNS))
    # Last, because a folder counts as results once it has it.
    write_whole(folder / "radio_load.csv", csv_text(load, RADIO_LOAD))
    return RadioTables(folder, plan, run, cases, points, load, capacity)
