"""Everything of a results folder beside the raw tables: summary, figures, report."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from analysis.figures import write_figure
from analysis.report import report_text
from analysis.results import COLUMNS, STATIONS, columns_frame, stations_frame
from analysis.schema import csv_text, write_whole
from analysis.summary import SUMMARY, summary_frame
from analysis.tables import RunTables
from analysis.time_distance import time_distance_figure
from analysis.zoom import worst_moment, zoom_figure
from railway.line import Line


def publish(
    folder: Path,
    title: str,
    line: Line,
    runs: Sequence[RunTables],
    provenance: Mapping[str, Any],
) -> pd.DataFrame:
    """
    Write summary, stations, columns, provenance, figures and report.

    The raw tables are written before, run by run, with :func:`analysis.tables.write_run`.

    Parameters
    ----------
    folder
        Results folder; made if missing.
    title
        Title of the scenario.
    line
        The line.
    runs
        All finished runs, baseline first. Figures and report show those of the first run's
        seed; only they need their trajectories.
    provenance
        What was run; anything that JSON can hold.

    Returns
    -------
    pd.DataFrame
        The table ``summary``.

    Raises
    ------
    ValueError
        If there are no runs.
    """
    if not runs:
        msg = "nothing to publish: no run was finished"
        raise ValueError(msg)
    folder.mkdir(parents=True, exist_ok=True)
    summary, stations = summary_frame(runs), stations_frame(line)
    shown = [run for run in runs if run.seed == runs[0].seed]
    write_whole(folder / "columns.csv", csv_text(columns_frame(), COLUMNS))
    write_whole(folder / "stations.csv", csv_text(stations, STATIONS))
    write_whole(folder / "provenance.json", _json(provenance))
    figures = {"time_distance": time_distance_figure(shown, stations, title=title)}
    if worst_moment(shown[0]) is not None:
        figures["zoom"] = zoom_figure(shown, stations)
    for name, figure in figures.items():
        write_figure(figure, folder / name)
    images = [f"{name}.png" for name in figures]
    write_whole(folder / "report.md", report_text(title, shown, summary, provenance, images))
    # Last, because a folder counts as results once it has a summary.
    write_whole(folder / "summary.csv", csv_text(summary, SUMMARY))
    return summary


def _json(provenance: Mapping[str, Any]) -> str:
    return json.dumps(dict(provenance), indent=2, ensure_ascii=False) + "\n"
