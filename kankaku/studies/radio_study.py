"""
Radio load: what the trains of a saved run ask of the radio network of a scenario.

``run.py radio`` gives this a command line.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np

from kankaku.analysis.publish.radio_publishing import RADIO_RESULTS, RadioTables, publish_radio
from kankaku.analysis.results import refuse_foreign
from kankaku.analysis.saved_run import SavedRun, SavedRunError, read_saved_run
from kankaku.analysis.tables.radio_tables import CellPoint, LoadCase, late_share
from kankaku.railway.arrays import FloatArray
from kankaku.railway.radio.cells import Cells, Link, PublishedLoad, RadioPlan, RadioSystem
from kankaku.scenarios.reading.radio_network import load_radio_plan
from kankaku.store import failed_runs
from kankaku.store.holding import held
from kankaku.studies.provenance import provenance_of
from kankaku.studies.study import Study, StudyResult
from kankaku.telecom import simulate
from kankaku.workers import performed

EVEN_S = 3600.0
"""How long evenly spaced trains are simulated. [s]"""
CELL_S = 60.0
"""How long a cell full of trains is simulated. [s]"""
BEYOND = 6
"""So many trains more than a cell should carry are tried. [-]"""
MOST_TRAINS = 60
"""More trains than this are not tried in one cell. [-]"""
ONE_CELL_M = 1000.0


@dataclass(frozen=True, slots=True, eq=False)
class Question:
    """What every worker needs to know."""

    plan: RadioPlan
    run: SavedRun
    seed: int


class EvenTrains(NamedTuple):
    """Task: so many evenly spaced trains."""

    system: int
    trains: int


class RunTrains(NamedTuple):
    """Task: the trains of the saved run."""

    system: int


class FullCell(NamedTuple):
    """Task: one cell with more and more trains."""

    system: int
    trackside_devices: int


Task: TypeAlias = EvenTrains | RunTrains | FullCell
Found: TypeAlias = LoadCase | tuple[CellPoint, ...]
Progress: TypeAlias = Callable[[int, int], None]
"""Called with the number of finished tasks, and of all."""


class RadioResult(NamedTuple):
    """What is written."""

    folder: Path
    tables: RadioTables | None
    """None if every system failed."""
    failures: list[str]
    """A sentence each."""


def tasks_of(plan: RadioPlan) -> tuple[Task, ...]:
    """
    Return what there is to simulate.

    Parameters
    ----------
    plan
        What is asked.

    Returns
    -------
    tuple[Task, ...]
        By system: the numbers of trains that were published for any system, the saved run, and
        a cell with the usual and with the greatest number of trackside devices.
    """
    numbers = sorted({published.trains for published in plan.published})
    tasks: list[Task] = []
    for number, system in enumerate(plan.systems):
        tasks += [EvenTrains(number, trains) for trains in numbers]
        tasks.append(RunTrains(number))
        devices = (system.trackside_devices, system.trackside_devices_max)
        tasks += [FullCell(number, count) for count in dict.fromkeys(devices)]
    return tuple(tasks)


def perform(question: Question, task: Task) -> Found:
    """
    Simulate.

    Parameters
    ----------
    question
        Plan, run and seed.
    task
        Which simulation.

    Returns
    -------
    Found
        A case of the line, or the points of a cell.
    """
    system = question.plan.systems[task.system]
    if isinstance(task, FullCell):
        return tuple(
            _full_cell(replace(system, trackside_devices=task.trackside_devices), question)
        )
    if isinstance(task, EvenTrains):
        times_s = np.arange(0.0, EVEN_S, system.update_s)
        fronts_m = question.run.evenly_spaced_m(task.trains, times_s)
        published = _published(question.plan, system, task.trains)
        name = f"{task.trains} train{'s' if task.trains > 1 else ''}"
        return _case(question, system, name, fronts_m, published=published)
    start_s = question.run.start_s
    times_s = np.arange(start_s, question.run.end_s + system.update_s, system.update_s)
    fronts_m = question.run.fronts_m(times_s)
    return _case(question, system, question.run.controller, fronts_m, start_s=start_s)


def _published(plan: RadioPlan, system: RadioSystem, trains: int) -> PublishedLoad | None:
    wanted = (system.name, trains)
    return next((it for it in plan.published if (it.system, it.trains) == wanted), None)


def _case(
    question: Question,
    system: RadioSystem,
    name: str,
    fronts_m: FloatArray,
    *,
    published: PublishedLoad | None = None,
    start_s: float | None = None,
) -> LoadCase:
    cells = question.plan.cells
    present = int((~np.isnan(fronts_m)).sum())
    return LoadCase(
        system=system,
        name=name,
        trains=present / len(fronts_m),
        units_per_train=float(cells.serving(fronts_m).sum()) / present,
        traffic=simulate(system, cells, fronts_m, question.seed),
        published=published,
        start_s=start_s,
    )


def _full_cell(system: RadioSystem, question: Question) -> Iterator[CellPoint]:
    cell = Cells(np.array([0.0, ONE_CELL_M]), 0.0)
    updates = round(CELL_S / system.update_s)
    for trains in range(1, min(system.trains_per_cell + BEYOND, MOST_TRAINS) + 1):
        fronts_m = np.full((updates, trains), 0.5 * ONE_CELL_M)
        traffic = simulate(system, cell, fronts_m, question.seed)
        delays_s = traffic.delays_s[np.isfinite(traffic.delays_s)]
        yield CellPoint(
            system=system,
            trackside_devices=system.trackside_devices,
            trains=trains,
            utilisation=traffic.utilisation(Link.ANTENNA_TRAIN),
            late=late_share(traffic, question.plan.late_s),
            longest_delay_s=float(delays_s.max()) if delays_s.size else np.nan,
        )


def _perform(question: Question, task: Task, _: Callable[[float], None]) -> Found:
    return perform(question, task)


def run_radio(
    study: Study,
    scenario_folder: Path,
    results: Path,
    out: Path,
    controller: str | None = None,
    progress: Progress = lambda *_: None,
) -> RadioResult:
    """
    Simulate the radio traffic of a saved run and write what is found.

    Parameters
    ----------
    study
        Scenario and processes; its first seed is that of the losses.
    scenario_folder
        Folder of the scenario, with ``radio_network.toml``.
    results
        Results folder of an earlier run of the scenario.
    out
        Folder that will hold the results folder, named as the scenario with ``_radio``.
    controller
        Whose trains; the first controller of the results if None.
    progress
        Called when a task is finished.

    Returns
    -------
    RadioResult
        What was found and written; a system that fails takes no other with it.

    Raises
    ------
    ScenarioError
        If ``radio_network.toml`` cannot be used.
    SavedRunError
        If there is no saved run of this scenario.
    FileExistsError
        If something else stands where the results would go.
    """
    folder = out / f"{study.scenario.name}_radio"
    plan = load_radio_plan(scenario_folder, study.scenario.line)
    refuse_foreign(folder, RADIO_RESULTS.marks)
    run = read_saved_run(results, controller)
    if run.scenario not in {"", study.scenario.name}:
        msg = f"{results}: of the scenario {run.scenario}; allowed: a run of {study.scenario.name}"
        raise SavedRunError(msg)
    with held(folder) as work:
        return _simulated(study, folder, work, Question(plan, run, study.seeds[0]), progress)


def _simulated(
    study: Study, folder: Path, work: Path, question: Question, progress: Progress
) -> RadioResult:
    started = time.perf_counter()
    plan, run = question.plan, question.run
    tasks, found, failed = tasks_of(plan), {}, {}
    progress(0, len(tasks))
    answers = performed(partial(_perform, question), tasks, study.jobs, folder=work)
    for finished, done in enumerate(answers, start=1):
        if done.result is not None:
            found[done.task] = done.result
        elif done.failure is not None:
            failed[done.task.system] = done.failure
        progress(finished, len(tasks))
    in_order = [found[task] for task in tasks if task.system not in failed]
    cases = [answer for answer in in_order if isinstance(answer, LoadCase)]
    points = [point for answer in in_order if isinstance(answer, tuple) for point in answer]
    failed_runs.clear(folder)
    names = {number: plan.systems[number].name for number in failed}
    sentences = [
        failed_runs.noted_sentence(
            folder, names[number], f"{names[number]}: {failure.sentence}", failure
        )
        for number, failure in failed.items()
    ]
    if not cases:
        return RadioResult(folder, None, sentences)
    whole = tuple(system for number, system in enumerate(plan.systems) if number not in failed)
    provenance = provenance_of(study, StudyResult(folder), time.perf_counter() - started)
    told = {**provenance, **_asked(question), "failed": sentences}
    plan = replace(plan, systems=whole)
    tables = publish_radio(folder, study.scenario.title, run, plan, cases, points, told)
    return RadioResult(folder, tables, sentences)


def _asked(question: Question) -> dict[str, object]:
    """Return what the load was worked out from."""
    run = question.run
    return {
        "radio_network_sha256": question.plan.digest,
        "run": {
            "results": str(run.folder),
            "controller": run.controller,
            "seed": run.seed,
            "scenario_sha256": run.scenario_digest,
        },
    }
