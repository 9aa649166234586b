"""Everything of a results folder beside the raw tables: summary, figures, report."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from kankaku.analysis.page.html import PAGE, page_of
from kankaku.analysis.page.page_data import PageSource
from kankaku.analysis.page.page_reading import line_of
from kankaku.analysis.publish.results_folder import FORMATS, Draw, Kind, image_names, publish_folder
from kankaku.analysis.results import WRITTEN_TABLES, Results, columns_frame, stations_frame
from kankaku.analysis.tables.across_tables import across_frame
from kankaku.analysis.tables.columns import json_text
from kankaku.analysis.tables.line_told import LINE_FILE, line_told
from kankaku.analysis.tables.map_window import window_of
from kankaku.analysis.tables.network_tables import NETWORK_TABLES, network_tables
from kankaku.analysis.tables.places_and_trains import by_station, by_train_frame
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.analysis.tables.summary import summary_frame
from kankaku.analysis.tables.sweep import SWEPT_TABLES, SweepTables, shown_delays_s, sweep_tables
from kankaku.analysis.tables.window import busiest_window_s, within
from kankaku.analysis.tables.worst import worst_moment
from kankaku.analysis.texts.remaining_texts import remaining_texts
from kankaku.analysis.texts.report import Notes, Shortfalls, report_text, unfinished_heading
from kankaku.analysis.words import clock
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.step.records import RAW_TABLES

STUDY_RESULTS = Kind(
    "summary",
    {**WRITTEN_TABLES, **SWEPT_TABLES, **NETWORK_TABLES},
    figures=("intervals", "pareto", "speed_distance", "time_distance", "track_plan", "zoom"),
    texts=("report.md", LINE_FILE, PAGE),
    elsewhere=frozenset(RAW_TABLES),
)
AROUND_S = 1800.0
"""Of a network, a close look takes no more than this before and after. [s]"""


class Findings(NamedTuple):
    """What all runs together show."""

    summary: pd.DataFrame
    """The table ``summary``."""
    sweep: SweepTables | None
    """The tables of a sweep; None without one."""


def publish(  # noqa: PLR0913 - one argument per part of the folder
    folder: Path,
    scenario: Scenario,
    runs: Sequence[RunTables],
    provenance: Mapping[str, Any],
    *,
    by_radio: Collection[str] = (),
    knows_future: Collection[str] = (),
    failures: Sequence[str] = (),
    formats: Sequence[str] = FORMATS,
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
    knows_future
        Names of those that are told the drawn dwell delays.
    failures
        Sentences about runs that failed, for the report.
    formats
        Of the figures; nothing is drawn without any.

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
    findings = Findings(
        summary_frame(runs),
        sweep_tables(scenario.sweep, scenario.published, runs) if scenario.sweep else None,
    )
    stations = stations_frame(scenario.line)
    drawn_s = shown_delays_s([(run.controller, run.initial_delay_s) for run in runs])
    drawn = [run for run in runs if run.seed == runs[0].seed and run.initial_delay_s in drawn_s]
    shown = [run for run in drawn if run.initial_delay_s == drawn_s[-1]]
    made: dict[str, Draw] = {}
    if formats:
        made |= _pareto(scenario, findings.summary, knows_future)
        made |= _figures(scenario, findings.sweep, drawn, shown, stations)
        made |= _maps(scenario, [run for run in shown if run.controller in by_radio], stations)
    network = network_tables(scenario, runs, shown) if scenario.line.network else {}
    remaining = () if scenario.sweep else remaining_texts(runs, knows_future)
    report = report_text(
        scenario.title,
        shown,
        findings.summary,
        provenance,
        image_names(made, formats),
        swept=findings.sweep,
        shortfalls=Shortfalls(failures, _unfinished(runs, scenario)),
        notes=Notes(frozenset(knows_future), remaining),
        by_direction=network.get("by_direction"),
    )
    frames = {"stations": stations, **_frames(findings, runs), **network}
    line = line_told(scenario, knows_future)
    texts = {"report.md": report, LINE_FILE: json_text(line)}
    if formats:
        seen = [_seen_in(shown, run) for run in runs]
        read = _results(folder, findings, stations, seen, provenance, network)
        texts[PAGE] = page_of([PageSource(scenario.name, read, line_of(line))])
    publish_folder(folder, STUDY_RESULTS, frames, made, provenance, texts=texts, formats=formats)
    return findings


def _results(
    folder: Path,
    findings: Findings,
    stations: pd.DataFrame,
    runs: Sequence[RunTables],
    provenance: Mapping[str, Any],
    network: Mapping[str, pd.DataFrame],
) -> Results:
    """Return the results as whoever reads the folder will have them."""
    swept = findings.sweep
    return Results(
        folder=folder,
        summary=findings.summary,
        columns=columns_frame(),
        stations=stations,
        runs=tuple(runs),
        provenance=provenance,
        intervals=swept.intervals if swept else None,
        sweep=swept.indicators if swept else None,
        network=network,
    )


def _seen_in(shown: Sequence[RunTables], run: RunTables) -> RunTables:
    """Return a run with its trajectory if it is one of those that figures show."""
    return run if run in shown else replace(run, trajectory=run.trajectory.iloc[:0])


def _frames(findings: Findings, runs: Sequence[RunTables]) -> dict[str, pd.DataFrame]:
    swept = findings.sweep.frames if findings.sweep else {}
    places = {"by_station": by_station(runs), "by_train": by_train_frame(runs)}
    return {"summary": findings.summary, **places, **swept}


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
) -> dict[str, Draw]:
    """Return the figures by name; the first two show the drawn runs, the others those shown."""
    # Here, because matplotlib takes half a second that not every command needs.
    from kankaku.analysis.figures.time_distance import time_distance_figure  # noqa: PLC0415
    from kankaku.analysis.figures.zoom import zoom_figure  # noqa: PLC0415

    figures: dict[str, Draw] = {}
    title = scenario.title
    if swept:
        figures = _sweep_figures(scenario, swept, drawn, stations)
        title += f"; initial delay {shown[0].initial_delay_s:g} s"
    window_s = busiest_window_s(shown[0].calls) if scenario.line.network else None
    seen = shown
    if window_s is not None:
        seen = [within(run, window_s) for run in shown]
        title += f"\n{clock(window_s[0])} to {clock(window_s[1])}, the busiest two hours"
    figures["time_distance"] = partial(
        time_distance_figure, seen, stations, title=title, window_s=window_s
    )
    if (worst := worst_moment(shown[0])) is not None:
        close = shown
        if scenario.line.network:
            close_s = worst.start_s - AROUND_S, worst.end_s + AROUND_S
            close = [within(run, close_s) for run in shown]
        figures["zoom"] = partial(zoom_figure, close, stations)
    if scenario.line.network:
        from kankaku.analysis.figures.track_plan import track_plan_figure  # noqa: PLC0415

        figures["track_plan"] = partial(track_plan_figure, scenario.line)
    return figures


def _pareto(
    scenario: Scenario, summary: pd.DataFrame, knows_future: Collection[str]
) -> dict[str, Draw]:
    """Return the figure of what controllers gain and give up; none of a sweep, or of one."""
    names = list(dict.fromkeys(summary["controller"]))
    if len(names) < 2 or scenario.sweep:
        return {}
    from kankaku.analysis.figures.pareto_figure import pareto_figure  # noqa: PLC0415

    table = across_frame({scenario.name: summary}, names, knows_future)
    return {"pareto": partial(pareto_figure, table)}


def _sweep_figures(
    scenario: Scenario, swept: SweepTables, drawn: Sequence[RunTables], stations: pd.DataFrame
) -> dict[str, Draw]:
    from kankaku.analysis.figures.interval_diagram import interval_figure  # noqa: PLC0415
    from kankaku.analysis.figures.speed_distance import (  # noqa: PLC0415
        follower_panels,
        speed_distance_figure,
    )

    place = scenario.line.station_by_id[swept.sweep.station].name
    return {
        "intervals": lambda: interval_figure(swept, stations),
        "speed_distance": lambda: speed_distance_figure(
            follower_panels(drawn, swept.sweep, scenario.line),
            title=f"The train behind {swept.sweep.train}, on its way to {place}",
            legend="initial delay",
        ),
    }


def _maps(scenario: Scenario, runs: Sequence[RunTables], stations: pd.DataFrame) -> dict[str, Draw]:
    """Return the control maps of runs by their places in the folder; none of a network."""
    if scenario.line.network:
        return {}
    from kankaku.analysis.figures.map_diagram import control_map_figure  # noqa: PLC0415

    return {
        f"{run.controller}/control_map": partial(
            control_map_figure, run, scenario, stations, window
        )
        for run in runs
        if (window := window_of(run, scenario)) is not None
    }
