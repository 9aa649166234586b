"""What a page can be made of: results of a run, of several scenarios, or of an ensemble."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from kankaku.analysis.page.html import PAGE, page_of
from kankaku.analysis.page.page_data import MOST_RUNS, Note, PageSource
from kankaku.analysis.page.page_reading import PageError, line_of, read_source
from kankaku.analysis.publish.across_publishing import ACROSS_RESULTS
from kankaku.analysis.results import STATIONS, Results, columns_frame
from kankaku.analysis.tables.columns import json_text, rows_frame, write_whole
from kankaku.analysis.tables.line_told import line_told
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.analysis.tables.summary import SUMMARY
from kankaku.railway.step.records import RAW_TABLES
from kankaku.store.dataset_store import (
    DATASET,
    ON_DEMAND,
    EnsembleTask,
    Saved,
    place_of,
    saved_runs,
)
from kankaku.store.ensemble_plan import PLAN, EnsembleError, Plan, Planned, read_plan
from kankaku.studies.dataset import RUNS, read_files, rows_of_runs
from kankaku.studies.outcomes import Study

LINES = "lines.json"
"""What the page of an ensemble needs to know of its lines, by scenario."""


def sources_of(folder: Path) -> list[PageSource]:
    """
    Read whatever a results folder holds for a page.

    Parameters
    ----------
    folder
        Results folder of ``kankaku run``, ``across`` or ``study``.

    Returns
    -------
    list[PageSource]
        One for each scenario.

    Raises
    ------
    PageError
        If it holds nothing that can be shown.
    """
    if (folder / PLAN).is_file():
        return ensemble_sources(folder)
    if all((folder / name).is_file() for name in ACROSS_RESULTS.marks):
        return _across_sources(folder)
    return [read_source(folder)]


def write_page(file: Path, sources: Sequence[PageSource]) -> None:
    """
    Write a page.

    Parameters
    ----------
    file
        Where; its folder exists.
    sources
        What it shows.
    """
    write_whole(file, page_of(sources))


def page_of_folder(folder: Path) -> None:
    """
    Write the page of a results folder into it.

    Parameters
    ----------
    folder
        As of :func:`sources_of`.
    """
    write_page(folder / PAGE, sources_of(folder))


def lines_text(studies: Sequence[Study], knows_future: Sequence[str]) -> str:
    """
    Return what an ensemble keeps of its lines.

    Parameters
    ----------
    studies
        Its scenarios.
    knows_future
        Controllers that are told the drawn dwell delays.

    Returns
    -------
    str
        Content of ``LINES``.
    """
    return json_text(
        {study.scenario.name: line_told(study.scenario, knows_future) for study in studies}
    )


def _across_sources(folder: Path) -> list[PageSource]:
    try:
        told = json.loads((folder / "provenance.json").read_text("utf-8"))
        names = [str(scenario["scenario"]) for scenario in told["scenarios"]]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise PageError(folder / "provenance.json", "does not name the scenarios") from error
    if any(Path(name).name != name for name in names):
        raise PageError(folder / "provenance.json", "names a scenario outside")
    return [read_source(folder.resolve().parent / name) for name in names]


def ensemble_sources(folder: Path) -> list[PageSource]:
    """
    Read the dataset of an ensemble for a page.

    Parameters
    ----------
    folder
        Its results folder.

    Returns
    -------
    list[PageSource]
        One for each scenario with a finished run; their runs have calls and stops only.

    Raises
    ------
    PageError
        If there is no finished run.
    """
    try:
        plan = read_plan(folder)
    except EnsembleError as error:
        raise PageError(folder / PLAN, "cannot be read") from error
    saved = saved_runs(folder / RUNS)
    lines = _lines(folder / LINES)
    found = [
        _ensemble_source(folder, plan, scenario, saved, lines.get(scenario.name, {}))
        for scenario in plan.scenarios
        if any(task.scenario == scenario.name for task in saved)
    ]
    if not found:
        raise PageError(folder, "holds no finished run")
    return found


def _lines(file: Path) -> Mapping[str, Mapping[str, Any]]:
    try:
        told = json.loads(file.read_text("utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    named = told.items() if isinstance(told, Mapping) else ()
    return {str(name): line_of(line) for name, line in named if isinstance(line, Mapping)}


def _ensemble_source(
    folder: Path,
    plan: Plan,
    scenario: Planned,
    saved: Mapping[EnsembleTask, Saved],
    line: Mapping[str, Any],
) -> PageSource:
    places = {name: number for number, name in enumerate(plan.controllers)}
    tasks = sorted(
        (task for task in saved if task.scenario == scenario.name and task.controller in places),
        key=lambda task: (places[task.controller], task.seed),
    )
    summary = rows_of_runs(folder / RUNS, tasks)[[column.name for column in SUMMARY]]
    seeds = sorted({task.seed for task in tasks})
    shown = set(seeds[: max(MOST_RUNS // len(places), 1)])
    told = [task for task in tasks if task.seed in shown]
    runs = tuple(_runs(folder / RUNS, told))
    kept = dict(line) or {"knows_future": list(plan.knows_future)}
    kept.setdefault("title", scenario.title)
    results = Results(
        folder=folder,
        summary=summary,
        columns=columns_frame(),
        stations=_stations(kept, runs),
        runs=runs,
        provenance=_provenance(plan, scenario, tasks),
    )
    return PageSource(scenario.name, results, kept, tuple(_notes(plan, scenario, saved, told)))


def _runs(root: Path, tasks: Sequence[EnsembleTask]) -> Iterator[RunTables]:
    nothing = {name: rows_frame([], columns) for name, columns in RAW_TABLES.items()}
    first = [task for task in tasks if task.seed == tasks[0].seed]
    calls, stops = _tables(root, "calls", tasks), _tables(root, "stops", tasks)
    samples = _tables(root, ON_DEMAND, first)
    for task in tasks:
        yield RunTables(
            task.controller,
            task.seed,
            calls=calls.get(task, nothing["calls"]),
            trajectory=samples.get(task, nothing[ON_DEMAND]),
            interstation_stops=stops.get(task, nothing["interstation_stops"]),
            remaining_stops=nothing["remaining_stops"],
            energy=nothing["energy"],
            violations=nothing["violations"],
            obstructions=nothing["obstructions"],
            unfinished=nothing["unfinished"],
        )


def _tables(
    root: Path, table: str, tasks: Sequence[EnsembleTask]
) -> dict[EnsembleTask, pd.DataFrame]:
    files = {task: place_of(root, table, task) for task in tasks}
    there = {task: file for task, file in files.items() if file.is_file()}
    if not there:
        return {}
    names = [column.name for column in DATASET[table]]
    read = read_files(table, list(there.values())).groupby(["controller", "seed"], sort=False)
    found = {key: own[names].reset_index(drop=True) for key, own in read}
    return {
        task: found[task.controller, task.seed]
        for task in there
        if (task.controller, task.seed) in found
    }


def _stations(line: Mapping[str, Any], runs: Sequence[RunTables]) -> pd.DataFrame:
    """Return the stations as the line tells them, else where trains stop."""
    told = line.get("stations", ())
    rows = [
        {
            "station": str(one.get("id", "")),
            "name": str(one.get("name", "")),
            "name_local": str(one.get("name_local", "")),
            "chainage_m": one.get("chainage_m"),
        }
        for one in told
    ]
    if not rows:
        stops_m = runs[0].calls.groupby("station", sort=False)["stop_m"].min()
        rows = [
            {"station": name, "name": name, "name_local": "", "chainage_m": stop_m}
            for name, stop_m in stops_m.items()
        ]
    frame = rows_frame(rows, STATIONS)
    return frame.sort_values("chainage_m", ignore_index=True)


def _provenance(plan: Plan, scenario: Planned, tasks: Sequence[EnsembleTask]) -> Mapping[str, Any]:
    told = plan.told()
    ours = [one for one in told["scenarios"] if one.get("name") == scenario.name]
    origins = ours[0].get("origins", {}) if ours else {}
    controllers = {name: dict(origin.get("controller", {})) for name, origin in origins.items()}
    return {
        "scenario": scenario.name,
        "step_s": scenario.step_s,
        "first_seed": scenario.first_seed,
        "seeds": len({task.seed for task in tasks}),
        "engine": plan.engine,
        "until": plan.until,
        "controllers": controllers,
    }


def _notes(
    plan: Plan,
    scenario: Planned,
    saved: Mapping[EnsembleTask, Saved],
    told: Sequence[EnsembleTask],
) -> Iterator[Note]:
    own = [task for task in saved if task.scenario == scenario.name]
    planned = scenario.seeds * len(plan.controllers)
    if plan.until is None and len(own) < planned:
        yield Note(
            f"{len(own)} of {planned} runs are finished.",
            f"{planned} 回のうち {len(own)} 回が終了。",
        )
    if len(told) < len(own):
        seeds = len({task.seed for task in told})
        yield Note(
            f"Trains are shown of the first {seeds} seeds only.",
            f"列車ごとの結果は最初の {seeds} シードだけを示す。",
        )
