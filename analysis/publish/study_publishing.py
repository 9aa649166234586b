"""Everything of a results folder beside the raw tables: summary, figures, report."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
from matplotlib.figure import Figure

from kankaku.analysis.figures.interval_diagram import interval_figure
from kankaku.analysis.figures.map_diagram import control_map_figure
from kankaku.analysis.figures.map_window import window_of
from kankaku.analysis.figures.speed_distance import follower_panels, speed_distance_figure
from kankaku.analysis.figures.style import write_figure
from kankaku.analysis.figures.time_distance import time_distance_figure
from kankaku.analysis.figures.zoom import worst_moment, zoom_figure
from kankaku.analysis.results import (
    COLUMNS,
    STATIONS,
    WRITTEN_TABLES,
    columns_frame,
    stations_frame,
)
from kankaku.analysis.tables.columns import csv_text, json_text, write_whole
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.analysis.tables.summary import SUMMARY, summary_frame
from kankaku.analysis.tables.sweep import SWEPT_TABLES, SweepTables, shown_delays_s, sweep_tables
from kankaku.analysis.texts.report import Shortfalls, report_text, unfinished_heading
from kankaku.railway.plan.scenario import Scenario

FIGURES = ("intervals", "speed_distance", "time_distance", "zoom")
PUBLISHED_FILES = frozenset(
    {
        *("summary.csv", "stations.csv", "columns.csv", "provenance.json", "report.md"),
        *(f"{table}.csv" for table in SWEPT_TABLES),
        *(f"{name}.{kind}" for name in FIGURES for kind in ("png", "svg")),
    }
)
"""Every file that :func:`publish` may write."""


class Findings(NamedTuple):
    """What all runs together show."""

    summary: pd.DataFrame
    """The table ``summary``."""
    sweep: SweepTables | None
    """The tables of a sweep; None without one."""


def publish(
    folder: Path,
    scenario: Scenario,
    runs: Sequence[RunTables],
    provenance: Mapping[str, Any],
    *,
    by_radio: Collection[str] = (),
    failures: Sequence[str] = (),
    figures: bool = True,
) -> Findings:
    """
    Write summary, stations, columns, provenance, figures and report.

    A sweep has two tables and two figures of its own; the other figures and the report show
    the greatest initial delay. Controllers by radio have a control map in their folders.

    The raw tables are written before, run by run, with
    :func:`kankaku.analysis.tables.run_tables.write_run`.

    Parameters
    ----------
    folder
        Results folder; made if missing.
    scenario
        What was run: its title, line, sweep and published results.
    runs
        All finished runs, baseline first. Figures and report show those of the first run's seed
        with the initial delays that :func:`kankaku.analysis.tables.sweep.shown_delays_s` chooses;
        only they need their trajectories.
    provenance
        What was run; anything that JSON can hold.
    by_radio
        Names of the controllers whose trains take their commands by radio.
    failures
        Sentences about runs that failed, for the report.
    figures
        Draw figures.

    Returns
    -------
    Findings
        The tables that were written.

    Raises
    ------
    ValueError
        If there are no runs.
    """
    if not runs:
        msg = "nothing to publish: no run was finished"
        raise ValueError(msg)
    folder.mkdir(parents=True, exist_ok=True)
    findings = Findings(
        summary_frame(runs),
        sweep_tables(scenario.sweep, scenario.published, runs) if scenario.sweep else None,
    )
    stations = stations_frame(scenario.line)
    explained = {**WRITTEN_TABLES, **SWEPT_TABLES} if findings.sweep else WRITTEN_TABLES
    drawn_s = shown_delays_s([(run.controller, run.initial_delay_s) for run in runs])
    drawn = [run for run in runs if run.seed == runs[0].seed and run.initial_delay_s in drawn_s]
    shown = [run for run in drawn if run.initial_delay_s == drawn_s[-1]]
    made = {}
    if figures:
        made = _figures(scenario, findings.sweep, drawn, shown, stations)
        made |= _maps(scenario, [run for run in shown if run.controller in by_radio], stations)
    for name, figure in made.items():
        (folder / name).parent.mkdir(exist_ok=True)
        write_figure(figure, folder / name)
    images = [f"{name}.png" for name in made]
    report = report_text(
        scenario.title,
        shown,
        findings.summary,
        provenance,
        images,
        swept=findings.sweep,
        shortfalls=Shortfalls(failures, _unfinished(runs, scenario)),
    )
    write_whole(folder / "report.md", report)
    write_whole(folder / "columns.csv", csv_text(columns_frame(explained), COLUMNS))
    write_whole(folder / "stations.csv", csv_text(stations, STATIONS))
    write_whole(folder / "provenance.json", json_text(provenance))
    if findings.sweep:
        for name, frame in findings.sweep.frames.items():
            write_whole(folder / f"{name}.csv", csv_text(frame, SWEPT_TABLES[name]))
    # Last, because a folder counts as results once it has a summary.
    write_whole(folder / "summary.csv", csv_text(findings.summary, SUMMARY))
    return findings


def _unfinished(runs: Sequence[RunTables], scenario: Scenario) -> list[str]:
    """Return a heading and a sentence per train that had not finished."""
    sentences = []
    for run in runs:
        swept = f", initial delay {run.initial_delay_s:.1f} s" if scenario.sweep else ""
        which = f"{run.controller}, seed {run.seed}{swept}"
        sentences += [f"{which}: {message}" for message in run.unfinished["message"]]
    if not sentences:
        return []
    return [unfinished_heading(len(sentences), scenario.patience_s), *sentences]


def _figures(
    scenario: Scenario,
    swept: SweepTables | None,
    drawn: Sequence[RunTables],
    shown: Sequence[RunTables],
    stations: pd.DataFrame,
) -> dict[str, Figure]:
    """Return the figures by name; the first two show the drawn runs, the others those shown."""
    figures, title = {}, scenario.title
    if swept:
        figures["intervals"] = interval_figure(swept, stations)
        place = scenario.line.station_by_id[swept.sweep.station].name
        figures["speed_distance"] = speed_distance_figure(
            follower_panels(drawn, swept.sweep, scenario.line),
            title=f"The train behind {swept.sweep.train}, on its way to {place}",
            legend="initial delay",
        )
        title += f"; initial delay {shown[0].initial_delay_s:g} s"
    figures["time_distance"] = time_distance_figure(shown, stations, title=title)
    if worst_moment(shown[0]) is not None:
        figures["zoom"] = zoom_figure(shown, stations)
    return figures


def _maps(
    scenario: Scenario, runs: Sequence[RunTables], stations: pd.DataFrame
) -> dict[str, Figure]:
    """Return the control maps of runs by their places in the results folder."""
    return {
        f"{run.controller}/control_map": control_map_figure(run, scenario, stations, window)
        for run in runs
        if (window := window_of(run, scenario)) is not None
    }
