"""The results folder of a capacity assessment: tables, two figures, columns and provenance."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from kankaku.analysis.figures.capacity_diagram import capacity_figure
from kankaku.analysis.figures.capacity_stairway import stairway_figure
from kankaku.analysis.figures.drawing import write_figure
from kankaku.analysis.results import COLUMNS, STATIONS, columns_frame, stations_frame
from kankaku.analysis.tables.capacity_tables import (
    BLOCKING_TIMES,
    CAPACITY,
    CAPACITY_TABLES,
    HEADWAYS,
    CapacityAssessment,
    blocking_times_frame,
    capacity_frame,
    headways_frame,
)
from kankaku.analysis.tables.columns import csv_text, json_text, write_whole
from kankaku.railway.plan.scenario import Scenario

CAPACITY_FILES = ("capacity.csv", "columns.csv")
"""Every results folder of this kind has them."""


class CapacityTables(NamedTuple):
    """What was written, and where."""

    folder: Path
    headways: pd.DataFrame
    capacity: pd.DataFrame


def publish_capacity(
    folder: Path,
    scenario: Scenario,
    assessments: Sequence[CapacityAssessment],
    provenance: Mapping[str, Any],
) -> CapacityTables:
    """
    Write tables, figures, columns and provenance.

    Parameters
    ----------
    folder
        Results folder; made if missing.
    scenario
        What was assessed.
    assessments
        One per controller.
    provenance
        What was assessed; anything that JSON can hold.

    Returns
    -------
    CapacityTables
        The tables that a reader looks at first.
    """
    headways = headways_frame(assessments, scenario.timetable)
    capacity = capacity_frame(assessments)
    blocking_times = blocking_times_frame(assessments)
    stations = stations_frame(scenario.line)
    name = scenario.title
    folder.mkdir(parents=True, exist_ok=True)
    write_figure(capacity_figure(assessments, title=f"Capacity: {name}"), folder / "capacity")
    stairway = stairway_figure(
        assessments, stations, title=f"Trains as close as they can follow: {name}"
    )
    write_figure(stairway, folder / "stairway")
    explained = {**CAPACITY_TABLES, "stations": STATIONS}
    write_whole(folder / "provenance.json", json_text(provenance))
    write_whole(folder / "stations.csv", csv_text(stations, STATIONS))
    write_whole(folder / "headways.csv", csv_text(headways, HEADWAYS))
    write_whole(folder / "blocking_times.csv", csv_text(blocking_times, BLOCKING_TIMES))
    write_whole(folder / "columns.csv", csv_text(columns_frame(explained), COLUMNS))
    # Last, because a folder counts as results once it has it.
    write_whole(folder / "capacity.csv", csv_text(capacity, CAPACITY))
    return CapacityTables(folder, headways, capacity)
