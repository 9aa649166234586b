"""What the runs of an ensemble show together, from its results folder alone."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from kankaku.analysis.publish.ensemble_publishing import ensemble_results, publish_ensemble
from kankaku.analysis.publish.results_folder import FORMATS
from kankaku.analysis.tables.columns import rows_frame, rows_of
from kankaku.analysis.tables.ensemble_tables import largest_difference, study_frame
from kankaku.railway.plan.design_names import INDEPENDENT
from kankaku.railway.step.engine_ways import EVERY_STEP
from kankaku.store.dataset_store import DATASET, MAIN, PARTS, EnsembleTask, Saved, saved_runs
from kankaku.store.ensemble_plan import PLAN, Plan
from kankaku.studies.dataset import COMPARED_RUNS, RUNS, rows_of_runs

RESULTS = ensemble_results({name: (*PARTS, *columns) for name, columns in DATASET.items()}, PLAN)
"""The kind of results folder."""


@dataclass(frozen=True, slots=True)
class Drawing:
    """What is drawn."""

    indicators: tuple[str, ...] = ()
    """The usual ones if empty."""
    formats: tuple[str, ...] = FORMATS


@dataclass(frozen=True, slots=True, eq=False)
class EnsembleFindings:
    """What all runs together show."""

    plan: Plan
    summary: pd.DataFrame
    """Of the runs that count, seed by seed."""
    table: pd.DataFrame
    """The table ``study``."""
    told: Mapping[str, Any]
    """What ``study.json`` holds."""
    missing: tuple[EnsembleTask, ...]
    """Runs that would count if they were there."""
    violations: tuple[str, ...]
    """Sentences about every violation, run by run."""
    unfinished: tuple[str, ...]
    """Sentences about every train that had not finished, run by run."""
    ended: tuple[str, ...]
    """Sentences about runs that violations ended early."""


def root_of(folder: Path, plan: Plan, task: EnsembleTask) -> Path:
    """
    Return in which dataset a run lies.

    Parameters
    ----------
    folder
        Results folder.
    plan
        The plan of the ensemble.
    task
        A run of it.

    Returns
    -------
    Path
        Folder of the dataset.
    """
    return folder / (RUNS if task.engine == plan.engine else COMPARED_RUNS)


def all_saved(folder: Path) -> dict[Path, dict[EnsembleTask, Saved]]:
    """
    Return the finished runs of a results folder.

    Parameters
    ----------
    folder
        Results folder.

    Returns
    -------
    dict[Path, dict[EnsembleTask, Saved]]
        By the folder of the dataset.
    """
    return {root: saved_runs(root) for root in (folder / RUNS, folder / COMPARED_RUNS)}


def findings_of(folder: Path, plan: Plan, saved: Mapping[EnsembleTask, Saved]) -> EnsembleFindings:
    """
    Put together what the runs show.

    Parameters
    ----------
    folder
        Results folder.
    plan
        Its plan.
    saved
        Finished runs of the plan.

    Returns
    -------
    EnsembleFindings
        The same for the same runs, whoever made them and when.
    """
    own = [task for task in plan.tasks(range(plan.seeds)) if task.engine == plan.engine]
    summary = summary_of(folder, [task for task in own if task in saved])
    seeds = plan.seeds_used(summary)
    tasks = plan.tasks(range(seeds))
    ends = {scenario.name: scenario.first_seed + seeds for scenario in plan.scenarios}
    runs = zip(summary["scenario"], summary["seed"], strict=True)
    counted = summary[[seed < ends[name] for name, seed in runs]].reset_index(drop=True)
    table = study_frame(counted, plan.designs, plan.controllers)
    missing = tuple(task for task in tasks if task not in saved)
    there = [(task, saved[task].note) for task in tasks if task in saved]
    told = {
        "seeds": seeds,
        "first_seed": {scenario.name: scenario.first_seed for scenario in plan.scenarios},
        "until": _until(plan, counted, seeds),
        "engine": plan.engine,
        **({} if plan.draws == INDEPENDENT else {"draws": plan.draws}),
        "engines_compared": _engines_compared(folder, plan, saved),
        "missing": [str(task) for task in missing],
        "results": list(_results(table)),
    }
    return EnsembleFindings(
        plan,
        counted,
        table,
        told,
        missing,
        violations=tuple(f"{task}: {line}" for task, note in there for line in note["violations"]),
        unfinished=tuple(f"{task}: {line}" for task, note in there for line in note["unfinished"]),
        ended=tuple(f"{task} {note['failure']}" for task, note in there if note["failure"]),
    )


def summary_of(folder: Path, tasks: list[EnsembleTask]) -> pd.DataFrame:
    """
    Return the summary of finished runs.

    Parameters
    ----------
    folder
        Results folder.
    tasks
        Runs by the engine of the plan.

    Returns
    -------
    pd.DataFrame
        A row for each, in their order.
    """
    if not tasks:
        return rows_frame((), (*PARTS, *DATASET[MAIN]))
    return rows_of_runs(folder / RUNS, tasks)


def _until(plan: Plan, summary: pd.DataFrame, seeds: int) -> dict[str, Any] | None:
    if plan.precision is None:
        return None
    return {
        "wanted": str(plan.precision),
        "reached": plan.precise(summary, seeds),
        "unit": plan.precision.unit,
        "half_widths": [
            {"scenario": scenario, "controller": controller, "half_width": _plain(half)}
            for (scenario, controller), half in plan.halves(summary, seeds).items()
        ],
    }


def _engines_compared(
    folder: Path, plan: Plan, saved: Mapping[EnsembleTask, Saved]
) -> dict[str, Any] | None:
    """Return how far the first seed of each controller differs where SUMO is told every step."""
    others = [task for task in plan.tasks(range(1)) if task.engine != plan.engine]
    if not others:
        return None
    rows: list[dict[str, Any]] = []
    for other in others:
        task = other._replace(engine=plan.engine)
        if task in saved and other in saved:
            one = rows_of(rows_of_runs(folder / RUNS, [task]))[0]
            two = rows_of(rows_of_runs(folder / COMPARED_RUNS, [other]))[0]
            apart, where = largest_difference(one, two)
            row = {"scenario": task.scenario, "controller": task.controller, "seed": task.seed}
            rows.append({**row, "largest_relative_difference": apart, "indicator": where})
    worst = max((row["largest_relative_difference"] for row in rows), default=math.nan)
    told = [
        {**row, "largest_relative_difference": _plain(row["largest_relative_difference"])}
        for row in rows
    ]
    return {"with": EVERY_STEP, "largest_relative_difference": _plain(worst), "runs": told}


def _results(table: pd.DataFrame) -> Iterator[dict[str, Any]]:
    for (scenario, controller), rows in table.groupby(["scenario", "controller"], sort=False):
        told = rows.drop(columns=["scenario", "controller"]).set_index("indicator")
        yield {
            "scenario": scenario,
            "controller": controller,
            "indicators": {
                indicator: {str(name): _plain(value) for name, value in row.items()}
                for indicator, row in told.to_dict("index").items()
            },
        }


def _plain(value: Any) -> Any:  # noqa: ANN401 - whatever a table holds
    """Return a value as JSON can hold it: what is unknown or endless is nothing."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def publish_findings(folder: Path, findings: EnsembleFindings, drawing: Drawing) -> None:
    """
    Write table, findings and figures of an ensemble beside its dataset.

    Parameters
    ----------
    folder
        Results folder.
    findings
        What :func:`findings_of` returned.
    drawing
        What is drawn.
    """
    publish_ensemble(
        folder,
        RESULTS,
        findings.summary,
        findings.table,
        findings.told,
        findings.plan.told(),
        indicators=drawing.indicators,
        formats=drawing.formats,
        designs=findings.plan.designs,
    )
