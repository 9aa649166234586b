"""How a study is run: what is missing, into the results folder, and the summary of it all."""

import errno
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TypeAlias

import pandas as pd

from kankaku import interrupts
from kankaku.analysis.publish.study_publishing import publish
from kankaku.analysis.results import RUN_RECORD, run_folder
from kankaku.analysis.tables.run_tables import read_run
from kankaku.analysis.tables.sweep import SweepTables, shown_delays_s
from kankaku.controllers import registry
from kankaku.controllers.choosing import foretold
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.plan.world import World
from kankaku.store import failed_runs, run_store
from kankaku.store.run_store import Kept, Origin, Task
from kankaku.studies.outcomes import Failed, Hearers, Outcome, Say, Study, StudyError, StudyResult
from kankaku.studies.provenance import provenance_of
from kankaku.workers import Done, Failure, attempt, performed

Perform: TypeAlias = Callable[[Task, Callable[[float], None]], Path]
NO_ROOM = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EROFS})
"""Errors of the system that no other run will escape."""


class Running:
    """A study that is being run, and its results folder."""

    def __init__(self, study: Study, folder: Path, work: Path, world: World) -> None:
        """Look at what the folder holds; see :func:`study.run_study` for what is refused."""
        self._study, self._folder, self._work, self._world = study, folder, work, world
        self._origins: Mapping[str, Origin] = {
            spec.name: run_store.origin_of(study.scenario, spec, study.step_s, study.engine)
            for spec in study.specs
        }
        self._result = StudyResult(folder)
        found = run_store.kept_runs(folder)
        self._stale = [
            *(kept.place for kept in found if self._differences(kept)),
            *run_store.unrecorded(folder),
        ]
        """Places of runs that cannot stand beside new ones."""
        if self._stale and not study.fresh:
            raise StudyError(self._refusal(found))
        self._kept = {kept.task: kept for kept in found if kept.place not in self._stale}
        self._finished: dict[Task, Kept] = {}
        """What was asked for and need not be run any more."""

    def _differences(self, kept: Kept) -> list[str]:
        own = kept.task.controller in self._origins
        origin = self._origins[kept.task.controller if own else self._study.specs[0].name]
        other = kept.differences(origin, options=own)
        # The runs of a sweep lie in folders named by their delays alone.
        swept = self._study.scenario.sweep is not None
        return [*other, "seed"] if swept and kept.task.seed not in self._study.seeds else other

    def _refusal(self, found: Sequence[Kept]) -> str:
        other = dict.fromkeys(word for kept in found for word in self._differences(kept))
        told = ", ".join(other) if other else "they do not say of which"
        return (
            f"{self._folder}: holds runs of something else ({told}); "
            "allowed: --fresh, to replace them, or another --out"
        )

    def run(self, perform: Perform, hearers: Hearers) -> StudyResult:
        """
        Run what is missing and publish.

        Parameters
        ----------
        perform
            Performs a run in whatever process, and returns where its tables lie.
        hearers
            Who wants to know.

        Returns
        -------
        StudyResult
            What is finished.
        """
        result, started = self._result, time.perf_counter()
        if not self._study.fresh:
            self._finished = {
                task: self._kept[task] for task in self._study.tasks if task in self._kept
            }
            self._tell_what_is_finished(hearers.say)
            self._make_room()
        fresh = self._study.fresh
        try:
            self._run_missing(perform, hearers)
        except KeyboardInterrupt:
            interrupts.answered()
            result.interrupted = True
        self._collect()
        wall_s = time.perf_counter() - started
        if result.kept and not (fresh and not self._finished):
            try:
                self._publish(wall_s)
            except KeyboardInterrupt:
                interrupts.answered()
                result.interrupted = True
                self._publish_after_all(wall_s)
        return result

    def _publish_after_all(self, wall_s: float) -> None:
        try:
            self._publish(wall_s)
        except KeyboardInterrupt:
            # Somebody is in a hurry. The runs are in place; the same command publishes them.
            interrupts.answered()

    def _tell_what_is_finished(self, say: Say) -> None:
        if not self._finished:
            return
        last = max(str(kept.told["finished"]) for kept in self._finished.values())
        at = datetime.fromisoformat(last).astimezone().strftime("%Y-%m-%d %H:%M")
        done, total = len(self._finished), len(self._study.tasks)
        if done < total:
            say(f"{done} of {total} runs were finished on {at}; going on.")
        else:
            runs = "The run was" if total == 1 else f"All {total} runs were"
            say(f"{runs} finished on {at}: nothing had to be run; --fresh runs them anew.")

    def _make_room(self) -> None:
        """Give every seed a folder of its own where a controller has several."""
        for task, kept in list(self._kept.items()):
            above = kept.place.parent
            if task.initial_delay_s is not None:
                continue
            alone = above == self._folder
            if alone and len(self._seeds_of(task.controller)) > 1:
                self._kept[task] = run_store.make_room(kept, self._folder, self._work)
            elif not alone and (above / RUN_RECORD).is_file():
                run_store.make_room(kept, self._folder, self._work)
        self._finished = {task: self._kept[task] for task in self._finished}

    def _seeds_of(self, controller: str) -> set[int]:
        kept = {task.seed for task in self._kept if task.controller == controller}
        return kept | set(self._study.seeds if controller in self._origins else ())

    def _place_of(self, task: Task) -> Path:
        if task in self._kept:
            return self._kept[task].place
        nested = any(
            kept.place.parent != self._folder
            for kept in self._kept.values()
            if kept.task.controller == task.controller
        )
        seeds = 2 if nested else len(self._seeds_of(task.controller))
        return run_folder(self._folder, *task, seeds=seeds)

    def _run_missing(self, perform: Perform, hearers: Hearers) -> None:
        missing = [task for task in self._study.tasks if task not in self._finished]
        begin_s, end_s = _expected_span_s(self._study.scenario)

        def tell(task: Task, time_s: float) -> None:
            hearers.progress(task, time_s - begin_s, end_s - begin_s)

        answers = performed(perform, missing, self._study.jobs, tell, self._work)
        with closing(answers):
            for done in answers:
                with interrupts.undisturbed():
                    self._take(done)
                if done.killed and done.failure is None:
                    hearers.say(f"{done.task}: {done.killed}; the second try succeeded.")
                end = "finished" if done.task in self._finished else "failed"
                ended = len(self._finished) + len(self._result.failed)
                hearers.tell(done.task, end, ended, len(self._study.tasks))
                if done.failure is not None and done.failure.errno in NO_ROOM:
                    return

    def _take(self, done: Done[Task, Path]) -> None:
        task, written = done.task, done.result
        if written is None:
            self._fail(task, done.failure or Failure("no result"))
            return
        if self._stale:
            run_store.clear(self._folder, self._stale)
            failed_runs.clear(self._folder)
            self._stale = []
        if not self._finished and self._study.fresh:
            self._make_room()
        place = self._place_of(task)
        failure = attempt(partial(run_store.accept, written, place))[1]
        kept = run_store.kept_run(self._folder, place)
        if failure is not None or kept is None:
            self._fail(task, failure or Failure("its tables are not all there"))
            return
        if other := self._differences(kept):
            run_store.remove_run(place)
            self._fail(task, Failure(f"changed while it ran: {', '.join(other)}"))
            return
        failed_runs.forget(self._folder, task.file_name)
        self._kept[task] = self._finished[task] = kept

    def _fail(self, task: Task, failure: Failure) -> None:
        failed = Failed(task, failure.progress, failure.sentence)
        note = partial(
            failed_runs.note, self._folder, task.file_name, str(failed), failure.traceback
        )
        file, _ = attempt(note)
        self._result.failed.append(replace(failed, file=file))

    def _collect(self) -> None:
        result, study = self._result, self._study
        names = [spec.name for spec in study.specs]
        known = [spec.name for spec in study.scenario.controllers]
        result.kept = run_store.in_order(list(self._kept.values()), names, known)
        result.failed.sort(key=lambda failed: study.tasks.index(failed.task))
        for task in study.tasks:
            if task in self._finished:
                kept = self._finished[task]
                told = kept.told
                # A damaged table is found, and named, when it is published.
                violations = attempt(kept.violations)[0] or ()
                unfinished = attempt(kept.unfinished)[0] or ()
                figures = (float(told["wall_s"]), int(told["train_steps"]), str(told["failure"]))
                result.outcomes.append(Outcome(task, violations, *figures, unfinished))

    def _publish(self, wall_s: float) -> None:
        for formats in dict.fromkeys((self._study.formats, ())):
            work = Path(tempfile.mkdtemp(dir=self._work))
            findings, failure = attempt(partial(self._publish_to, work, wall_s, formats))
            if findings is not None:
                if formats == self._study.formats:
                    failed_runs.forget(self._folder, failed_runs.TROUBLE)
                self._result.summary, self._result.sweep = findings
                return
            interrupts.check()
            if failure is not None:
                what = "the figures could not be drawn" if formats else "no summary was written"
                told = f"{what}: {failure.sentence}"
                told = failed_runs.noted_sentence(self._folder, failed_runs.TROUBLE, told, failure)
                self._result.troubles.append(told)

    def _publish_to(
        self, work: Path, wall_s: float, formats: tuple[str, ...]
    ) -> tuple[pd.DataFrame, SweepTables | None]:
        result, study = self._result, self._study
        # Without a sweep the tables say that no train was delayed.
        ran = [(kept, kept.task.initial_delay_s or 0.0) for kept in result.kept]
        drawn_s = shown_delays_s([(kept.task.controller, delay_s) for kept, delay_s in ran])
        first = result.kept[0].task.seed
        runs = [
            read_run(
                kept.place,
                kept.task.controller,
                kept.task.seed,
                delay_s,
                trajectory=kept.task.seed == first and delay_s in drawn_s,
            )
            for kept, delay_s in ran
        ]
        radio = study.scenario.radio
        built = [registry.build(spec, self._world, radio) for spec in self._specs()]
        findings = publish(
            work,
            study.scenario,
            runs,
            provenance_of(study, result, wall_s),
            by_radio=frozenset(controller.name for controller in built if controller.by_radio),
            knows_future=foretold(self._specs()),
            failures=failed_runs.noted(self._folder),
            formats=formats,
        )
        with interrupts.undisturbed():
            run_store.move_published(work, self._folder)
        return findings.summary, findings.sweep

    def _specs(self) -> list[ControllerSpec]:
        """Return all controllers whose runs are published."""
        known = {
            spec.name: spec for spec in (*self._study.scenario.controllers, *self._study.specs)
        }
        names = dict.fromkeys(kept.task.controller for kept in self._result.kept)
        return [known[name] for name in names if name in known]


def _expected_span_s(scenario: Scenario) -> tuple[float, float]:
    calls = [call for service in scenario.timetable.services for call in service.calls]
    return min(call.arrival_s for call in calls), max(call.departure_s for call in calls)
