"""The results folder of a capacity assessment: tables, two figures, columns and provenance."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from kankaku.analysis.publish.results_folder import Draw, Kind, publish_folder
from kankaku.analysis.results import STATIONS, stations_frame
from kankaku.analysis.tables.capacity_tables import (
    CAPACITY_TABLES,
    CapacityAssessment,
    blocking_times_frame,
    capacity_frame,
    headways_frame,
)
from kankaku.railway.plan.scenario import Scenario

CAPACITY_RESULTS = Kind(
    "capacity",
    {**CAPACITY_TABLES, "stations": STATIONS},
    figures=("capacity", "stairway"),
)


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
    stations = stations_frame(scenario.line)
    frames = {
        "headways": headways,
        "capacity": capacity,
        "blocking_times": blocking_times_frame(assessments),
        "stations": stations,
    }
    figures = _figures(assessments, stations, scenario.title)
    publish_folder(folder, CAPACITY_RESULTS, frames, figures, provenance)
    return CapacityTables(folder, headways, capacity)


def _figures(
    assessments: Sequence[CapacityAssessment], stations: pd.DataFrame, name: str
) -> dict[str, Draw]:
    # Here, because matplotlib takes half a second that not every command needs.
    from kankaku.analysis.figures.capacity_diagram import capacity_figure  # noqa: PLC0415
    from kankaku.analysis.figures.capacity_stairway import stairway_figure  # noqa: PLC0415

    close = f"Trains as close as they can follow: {name}"
    return {
        "capacity": lambda: capacity_figure(assessments, title=f"Capacity: {name}"),
        "stairway": lambda: stairway_figure(assessments, stations, title=close),
    }
