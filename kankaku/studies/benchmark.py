"""
The benchmark: controllers on fixed suites, and whether somebody else's result can be repeated.

``kankaku benchmark`` gives this a command line.
"""

import hashlib
import json
import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from kankaku import interrupts
from kankaku.analysis.results import refuse_foreign
from kankaku.analysis.tables.columns import write_whole
from kankaku.analysis.tables.run_tables import RunTables, run_tables
from kankaku.analysis.tables.summary import summary_frame
from kankaku.controllers.choosing import by_layers, foretold
from kankaku.railway.step.engine_ways import WITNESS
from kankaku.store.fingerprint import content_sha256, sources_sha256
from kankaku.store.holding import held
from kankaku.store.json_lines import append_line, json_line, whole_lines
from kankaku.store.run_store import controller_told
from kankaku.studies.benchmark_file import (
    FIGURES,
    RUN,
    TASK,
    differences,
    result_told,
    sample_of,
    write_result,
)
from kankaku.studies.benchmark_suites import (
    STEP_S,
    VERSION,
    BenchmarkPlan,
    BenchmarkTask,
    met_scenario,
    suite_scenario,
    tasks_of,
)
from kankaku.studies.provenance import VERSIONED
from kankaku.studies.registered_layers import Registered, registered
from kankaku.studies.study import StudyError, run_once
from kankaku.workers import performed

RESULT, JOURNAL = "benchmark.json", "benchmark_journal.jsonl"
SOURCES = ("benchmark_suites", "benchmark_score", "benchmark", "movers", "study")
"""Studies that decide what a result is."""
TABLES = ("calls", "interstation_stops", "energy", "violations")
"""Of a run, whose bytes a result file tells the digest of."""
Run: TypeAlias = dict[str, Any]
Progress: TypeAlias = Callable[[int, int], None]
"""Called with the number of finished runs, and of all."""


class BenchmarkResult(NamedTuple):
    """What is finished."""

    file: Path | None
    """None while runs are missing."""
    told: Mapping[str, Any]
    interrupted: bool


class Repeated(NamedTuple):
    """What came of repeating some of the runs of a result file."""

    runs: int
    wrong: list[str]
    """Where figures are other ones, a sentence each."""
    doubts: list[str]
    """What is otherwise here than where the file was made."""


def benchmark_sources_sha256() -> str:
    """
    Return a digest of the sources that decide what a result is.

    Returns
    -------
    str
        Another one after any change that might change a figure or a score.
    """
    return sources_sha256(studies=SOURCES)


def provenance_here(names: Sequence[str], plan: BenchmarkPlan) -> dict[str, Any]:
    """
    Return what results are made from here.

    Parameters
    ----------
    names
        Controllers.
    plan
        What is run of the benchmark.

    Returns
    -------
    dict[str, Any]
        Versions, and digests of sources, scenarios and controllers.
    """
    specs = [by_layers(name) for name in names]
    future = foretold(specs)
    told = {
        "versions": {
            "kankaku": version("kankaku"),
            "python": platform.python_version(),
            **{name: version(name) for name in VERSIONED},
        },
        "sources_sha256": benchmark_sources_sha256(),
        "machine": platform.machine(),
        "processors": os.cpu_count(),
        "scenarios": {
            suite: {
                "scenario_sha256": suite_scenario(suite).digest,
                "trains": len(suite_scenario(suite).timetable.services),
            }
            for suite in plan.suites
        },
        "controllers": {
            spec.name: {**controller_told(spec), "knows_future": spec.name in future}
            for spec in specs
        },
    }
    # As a reader of the file has it.
    read: dict[str, Any] = json.loads(json.dumps(told))
    return read


def run_benchmark(
    names: Sequence[str],
    contract: Mapping[str, Sequence[str]],
    plan: BenchmarkPlan,
    out: Path,
    jobs: int = 1,
    progress: Progress = lambda *_: None,
) -> BenchmarkResult:
    """
    Run what is missing, and write the result file.

    Parameters
    ----------
    names
        Controllers by their layers, the reference among them.
    contract
        What of the contract each of them breaks.
    plan
        What to run of the benchmark.
    out
        Results folder; runs that it holds of the same program and controllers are not repeated.
    jobs
        Processes to use.
    progress
        Called when a run is finished.

    Returns
    -------
    BenchmarkResult
        What is finished, even if the user interrupts.

    Raises
    ------
    KankakuError
        If there is no such controller, or another command writes there.
    FileExistsError
        If something else stands where the results would go.
    """
    specs = [by_layers(name) for name in names]
    refuse_foreign(out, (JOURNAL,))
    with held(out) as work:
        provenance = provenance_here(names, plan)
        done = _Journal(out / JOURNAL, provenance)
        tasks = tasks_of(tuple(names), plan)
        missing = [task for task in tasks if task not in done.runs]
        interrupted = False
        perform = partial(perform_run, registered(specs))
        answers = performed(perform, missing, jobs, folder=work)
        progress(len(tasks) - len(missing), len(tasks))
        try:
            with closing(answers):
                for answer in answers:
                    with interrupts.undisturbed():
                        failure = answer.failure
                        told = failure.sentence if failure else ""
                        run = answer.result or failed_run(answer.task, told)
                        done.add(answer.task, run)
                    progress(sum(task in done.runs for task in tasks), len(tasks))
        except KeyboardInterrupt:
            interrupts.answered()
            interrupted = True
        if interrupted or any(task not in done.runs for task in tasks):
            return BenchmarkResult(None, {}, interrupted)
        provenance["finished"] = datetime.now(UTC).isoformat(timespec="seconds")
        result = result_told(plan, provenance, contract, [done.runs[task] for task in tasks])
        write_result(out / RESULT, result)
        return BenchmarkResult(out / RESULT, result, interrupted)


class _Journal:
    """Finished runs, a line each: a benchmark can go on, and another controller be added."""

    def __init__(self, file: Path, provenance: Mapping[str, Any]) -> None:
        self._file = file
        self._digests = {
            name: content_sha256(json.dumps(told, sort_keys=True))
            for name, told in provenance["controllers"].items()
        }
        self._settings = {
            "version": VERSION,
            "sources_sha256": provenance["sources_sha256"],
            "versions": provenance["versions"],
        }
        self.runs: dict[BenchmarkTask, Run] = {}
        whole = whole_lines(file)
        if whole and self._read(whole[0], 1) != self._settings:
            # Of another program: none of its runs counts.
            whole = []
        for number, line in enumerate(whole[1:], start=2):
            told = self._read(line, number)
            run = told.get("run", {})
            if set(RUN) <= set(run) and told.get("made_from") == self._digests.get(
                run["controller"]
            ):
                self.runs[BenchmarkTask(*(run[key] for key in TASK))] = run
        if not whole:
            write_whole(file, json_line(self._settings))

    def _read(self, line: bytes, number: int) -> dict[str, Any]:
        try:
            told = json.loads(line)
        except ValueError:
            told = None
        if not isinstance(told, dict):
            msg = f"{self._file}, line {number}: damaged; allowed: another --out, or to remove it"
            raise StudyError(msg)
        return told

    def add(self, task: BenchmarkTask, run: Run) -> None:
        """Take note of a finished run."""
        append_line(self._file, {"made_from": self._digests[task.controller], "run": run})
        self.runs[task] = run


def perform_run(layers: Registered, task: BenchmarkTask, _: Callable[[float], None]) -> Run:
    """
    Run a controller once.

    Parameters
    ----------
    layers
        What was registered in the process that asks.
    task
        Which run.

    Returns
    -------
    dict[str, Any]
        The run as a result file tells it.
    """
    layers.restore()
    spec = by_layers(task.controller)
    scenario = met_scenario(task)
    begun_s = time.process_time()
    record = run_once(scenario, spec, task.seed, STEP_S, engine=WITNESS)
    processor_s = time.process_time() - begun_s
    tables = run_tables(record)
    row = summary_frame([tables]).iloc[0]
    figures = {key: kind(row[key]) for key, kind in FIGURES.items() if key in row.index}
    return {
        **task._asdict(),
        **figures,
        "train_steps": int(record.train_steps),
        "tables_sha256": _tables_sha256(tables),
        "failure": record.failure,
        "processor_s": round(processor_s, 3),
    }


def _tables_sha256(tables: RunTables) -> str:
    digest = hashlib.sha256()
    for name in TABLES:
        digest.update(getattr(tables, name).to_csv(index=False).encode())
    return digest.hexdigest()


def failed_run(task: BenchmarkTask, sentence: str) -> Run:
    """
    Return what a result file tells of a run without results.

    Parameters
    ----------
    task
        Which run.
    sentence
        Why there are none.

    Returns
    -------
    dict[str, Any]
        With a failure, so that it has no score.
    """
    nothing = {key: kind() for key, kind in RUN.items()}
    return {**nothing, **task._asdict(), "failure": sentence or "no result"}


def repeat(
    told: Mapping[str, Any],
    size: int,
    drawn_by: int,
    jobs: int = 1,
    progress: Progress = lambda *_: None,
) -> Repeated:
    """
    Repeat some of the runs of a result file, and compare.

    Parameters
    ----------
    told
        What :func:`~kankaku.studies.benchmark_file.read_result` returned.
    size
        How many runs.
    drawn_by
        Seed of the draw.
    jobs
        Processes to use.
    progress
        Called when a run is finished.

    Returns
    -------
    Repeated
        Where figures are other ones.

    Raises
    ------
    KankakuError
        If a controller of the file is not known here.
    """
    chosen = {
        BenchmarkTask(*(run[key] for key in TASK)): run for run in sample_of(told, size, drawn_by)
    }
    names = tuple(dict.fromkeys(task.controller for task in chosen))
    specs = [by_layers(name) for name in names]
    suites = tuple(dict.fromkeys(task.suite for task in chosen))
    here = provenance_here(names, BenchmarkPlan(suites=suites))
    perform, wrong = partial(perform_run, registered(specs)), []
    for number, done in enumerate(performed(perform, list(chosen), jobs), start=1):
        failure = done.failure.sentence if done.failure else ""
        found = done.result or failed_run(done.task, failure)
        wrong += [f"{done.task}: {told}" for told in differences(chosen[done.task], found)]
        progress(number, len(chosen))
    return Repeated(len(chosen), wrong, _doubts(told["provenance"], here))


def _doubts(there: Mapping[str, Any], here: Mapping[str, Any]) -> list[str]:
    doubts = []
    for key, words in (
        ("sources_sha256", "the program is another one"),
        ("versions", "versions are other ones"),
        ("machine", "the machine is of another kind"),
    ):
        if there.get(key) != here[key]:
            doubts.append(words)
    for key, words in (("scenarios", "scenario"), ("controllers", "controller")):
        known = there.get(key)
        for name, told in here[key].items():
            if not isinstance(known, dict) or known.get(name) != told:
                doubts.append(f"{words} {name} is another one")
    return doubts
