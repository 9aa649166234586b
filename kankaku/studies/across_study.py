"""
Several scenarios at once: each is run as a study of its own, and one table has them all.

``kankaku across`` gives this a command line; scripts call :func:`kankaku.across`.
"""

import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import pandas as pd

from kankaku import interrupts
from kankaku.analysis.publish.across_publishing import ACROSS_RESULTS, publish_across
from kankaku.analysis.results import refuse_foreign
from kankaku.analysis.tables.across_tables import across_frame
from kankaku.analysis.tables.columns import rows_frame
from kankaku.analysis.tables.summary import SUMMARY
from kankaku.analysis.texts.across_texts import Part
from kankaku.controllers.choosing import foretold
from kankaku.railway.errors import KankakuError
from kankaku.store import failed_runs
from kankaku.store.holding import held
from kankaku.store.run_store import controller_told
from kankaku.studies.outcomes import Go, Hearers, Study, StudyError, StudyResult
from kankaku.studies.page_sources import page_of_folder
from kankaku.studies.provenance import provenance_of
from kankaku.studies.study import choose, ready
from kankaku.workers import attempt

FOLDER = "across"
"""Results folder of the table; those of the scenarios lie beside it."""
Run: TypeAlias = Callable[[Study, Go], StudyResult]
"""Runs one of the studies, and may show how it comes along."""


class AcrossError(KankakuError):
    """What of several scenarios cannot be run together, a sentence for each reason."""

    def __init__(self, told: Sequence[str]) -> None:
        super().__init__("\n".join(told))
        self._told = tuple(told)

    @property
    def sentences(self) -> tuple[str, ...]:
        """The reasons, each with its scenario."""
        return self._told


@dataclass(slots=True)
class AcrossResult:
    """What is finished of several scenarios."""

    folder: Path
    studies: tuple[Study, ...]
    results: dict[str, StudyResult] = field(default_factory=dict)
    """By the name of the scenario; those that were begun."""
    table: pd.DataFrame | None = None
    """The table ``across``; None if no run was finished."""
    failures: list[str] = field(default_factory=list)
    """What went wrong beside single runs: a whole scenario, or the table."""
    interrupted: bool = False

    @property
    def controllers(self) -> list[str]:
        """What is compared in every scenario, baseline first."""
        return [spec.name for spec in self.studies[0].specs]


def choose_across(scenarios: Sequence[str | Path], choices: Mapping[str, Any]) -> tuple[Study, ...]:
    """
    Read several scenarios and choose what to run of all of them.

    Parameters
    ----------
    scenarios
        Folders, or names of shipped ones.
    choices
        As of :func:`kankaku.studies.study.choose`, the same for all scenarios. Without names
        those controllers that run by default in every scenario.

    Returns
    -------
    tuple[Study, ...]
        One for each scenario, with the same controllers in the same order.

    Raises
    ------
    AcrossError
        With every reason of every scenario: what cannot be used, a controller that it has not, a
        sweep, two scenarios of one name, or nothing that all of them compare by default.
    """
    told: list[str] = []
    studies: list[Study] = []
    for scenario in scenarios:
        try:
            studies.append(_without_sweep(choose(scenario, **choices)))
        except KankakuError as error:
            told += [f"{scenario}: {sentence}" for sentence in error.sentences]
    if not told:
        told = list(_clashes(scenarios, studies))
    if told or not studies:
        raise AcrossError(told or ["SCENARIO: missing; allowed: scenario folders"])
    same = _with_the_same(studies)
    if len(same[0].specs) < 2 and not choices.get("names"):
        known = "; ".join(
            f"{study.scenario.name} has {', '.join(spec.name for spec in study.specs)}"
            for study in studies
        )
        problem = f"fewer than two controllers run by default in every scenario ({known})"
        raise AcrossError([f"--controller: {problem}; allowed: to name some, baseline first"])
    return same


def _without_sweep(study: Study) -> Study:
    if study.scenario.sweep:
        where, problem = "scenario.toml: sweep", "has a sweep, whose delays are no sample"
        allowed = f"scenarios without one, or kankaku run {study.scenario.name}"
        raise StudyError(where, problem, allowed)
    return study


def _clashes(scenarios: Sequence[str | Path], studies: Sequence[Study]) -> Iterator[str]:
    """Yield why results of two scenarios would come to lie in one folder."""
    places = defaultdict(list)
    for scenario, study in zip(scenarios, studies, strict=True):
        places[study.scenario.name].append(str(scenario))
    for name, places_of_name in places.items():
        if len(places_of_name) > 1:
            yield (
                f"{' and '.join(places_of_name)}: the results of both would go to {name}; "
                "allowed: folders of different names, each one once"
            )
        if name == FOLDER:
            yield (
                f"{places_of_name[0]}: the table of all scenarios goes to {FOLDER}; "
                "allowed: a folder of another name"
            )


def _with_the_same(studies: Sequence[Study]) -> tuple[Study, ...]:
    """Return the studies with the controllers that all of them have, in the first one's order."""
    every = [{spec.name: spec for spec in study.specs} for study in studies]
    names = [name for name in every[0] if all(name in known for known in every)]
    return tuple(
        replace(study, specs=tuple(known[name] for name in names))
        for study, known in zip(studies, every, strict=True)
    )


def run_across(
    studies: Sequence[Study], out: Path, run: Run = lambda _, go: go(Hearers())
) -> AcrossResult:
    """
    Run what is missing of several studies, and write one table of them all.

    Every results folder is looked at and held before the first run. A study that fails is one
    that failed: the others go on.

    Parameters
    ----------
    studies
        What to run, as :func:`choose_across` returns it.
    out
        Folder that will hold the results folders: one for each scenario, and ``across``.
    run
        Runs one of them.

    Returns
    -------
    AcrossResult
        What is finished, even if the user interrupts.

    Raises
    ------
    AcrossError
        If a scenario cannot be run, or its folder holds something else.
    FileExistsError
        If something else stands where the table would go.
    HeldError
        If another command writes there.
    """
    result = AcrossResult(out / FOLDER, tuple(studies))
    started = time.perf_counter()
    with ExitStack() as stack:
        refuse_foreign(result.folder, ACROSS_RESULTS.marks)
        stack.enter_context(held(result.folder))
        goes = _all_ready(studies, out, stack)
        failed_runs.clear(result.folder)
        for study, go in zip(studies, goes, strict=True):
            _run_one(result, study, partial(run, study, go))
            if result.interrupted:
                break
        try:
            _publish(result, time.perf_counter() - started)
        except KeyboardInterrupt:
            # The runs are in place; the same command writes the table.
            interrupts.answered()
            result.interrupted = True
    return result


def _all_ready(studies: Sequence[Study], out: Path, stack: ExitStack) -> list[Go]:
    ways: list[Go] = []
    told: list[str] = []
    for study in studies:
        try:
            ways.append(stack.enter_context(ready(study, out)))
        except (KankakuError, FileExistsError) as error:
            sentences = error.sentences if isinstance(error, KankakuError) else [str(error)]
            told += [f"{study.scenario.name}: {sentence}" for sentence in sentences]
    if told:
        raise AcrossError(told)
    return ways


def _run_one(result: AcrossResult, study: Study, go: Callable[[], StudyResult]) -> None:
    name = study.scenario.name
    try:
        found, failure = attempt(go)
    except KeyboardInterrupt:
        interrupts.answered()
        result.interrupted = True
        return
    if failure is not None:
        told = f"{name}: {failure.sentence}"
        result.failures.append(failed_runs.noted_sentence(result.folder, name, told, failure))
    if found is not None:
        result.results[name] = found
        result.interrupted = found.interrupted


def _publish(result: AcrossResult, wall_s: float) -> None:
    summaries = {study.scenario.name: _summary(result, study) for study in result.studies}
    if all(summary.empty for summary in summaries.values()):
        return
    specs = result.studies[0].specs
    result.table = across_frame(summaries, result.controllers, foretold(specs))
    parts = [
        Part(study.scenario.name, study.scenario.title, study.seeds, study.step_s)
        for study in result.studies
    ]
    told = {
        "interrupted": result.interrupted,
        "failed": result.failures,
        "wall_s": round(wall_s, 3),
        "scenarios": [
            provenance_of(study, result.results[name], wall_s)
            for study in result.studies
            if (name := study.scenario.name) in result.results
        ],
    }
    for formats in dict.fromkeys((result.studies[0].formats, ())):
        write = partial(
            publish_across,
            result.folder,
            parts,
            result.table,
            _notes(result),
            told,
            formats=formats,
        )
        _, failure = attempt(write)
        if failure is None and formats:
            _, failure = attempt(partial(page_of_folder, result.folder))
        if failure is None:
            return
        what = "the figure could not be drawn" if formats else "no table was written"
        told_of_it = f"{what}: {failure.sentence}"
        result.failures.append(
            failed_runs.noted_sentence(result.folder, failed_runs.TROUBLE, told_of_it, failure)
        )


def _summary(result: AcrossResult, study: Study) -> pd.DataFrame:
    """Return the rows of the runs that were asked for; a folder may hold more."""
    found = result.results.get(study.scenario.name)
    if found is None or found.summary is None:
        return rows_frame((), SUMMARY)
    finished = {(outcome.task.controller, outcome.task.seed) for outcome in found.outcomes}
    pairs = zip(found.summary["controller"], found.summary["seed"], strict=True)
    return found.summary[[pair in finished for pair in pairs]].reset_index(drop=True)


def _notes(result: AcrossResult) -> list[str]:
    """Return what a reader has to know of the comparison."""
    return [*_different_options(result.studies), *_shortfalls(result)]


def _different_options(studies: Sequence[Study]) -> Iterator[str]:
    for index, spec in enumerate(studies[0].specs):
        first = controller_told(spec)
        others = [
            study.scenario.name
            for study in studies[1:]
            if controller_told(study.specs[index]) != first
        ]
        if others:
            yield (
                f"{spec.name} has other layers or options in {', '.join(others)} than in "
                f"{studies[0].scenario.name}"
            )


def _shortfalls(result: AcrossResult) -> Iterator[str]:
    for study in result.studies:
        name = study.scenario.name
        found = result.results.get(name)
        if found is None:
            yield f"{name}: was not run to its end"
            continue
        unsafe = {run.task.controller for run in found.outcomes if run.violations}
        for controller in unsafe:
            yield f"{name}: {controller} violated safety; do not use its other figures"
        yield from (f"{name}: {sentence}" for sentence in found.failures)
    yield from result.failures
