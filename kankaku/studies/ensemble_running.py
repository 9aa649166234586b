"""How an ensemble is run: what is missing, into its dataset, and then what all of it shows."""

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeAlias

import pandas as pd

from kankaku import interrupts
from kankaku.analysis.results import FAILURES, UNFINISHED
from kankaku.analysis.tables.columns import json_text
from kankaku.analysis.tables.parquet_bytes import note_of
from kankaku.controllers import registry
from kankaku.railway.places import CACHE, chosen_cache, refuse_unwritable
from kankaku.railway.step.engine_ways import EVERY_STEP
from kankaku.store import dataset_store, failed_runs
from kankaku.store.dataset_store import MAIN, EnsembleTask, RunFiles, Saved
from kankaku.store.ensemble_plan import FIRST_LOOK, PLAN, EnsembleError
from kankaku.store.holding import PARTS_HELD, held, held_part
from kankaku.studies.dataset import RUNS
from kankaku.studies.ensemble import Ensemble
from kankaku.studies.ensemble_findings import (
    Drawing,
    EnsembleFindings,
    all_saved,
    findings_of,
    publish_findings,
    root_of,
    summary_of,
)
from kankaku.studies.ensemble_runs import EnsembleRuns, MakeRecord, on_sumo
from kankaku.studies.page_sources import LINES, lines_text, page_of_folder
from kankaku.studies.registered_layers import registered
from kankaku.studies.running import NO_ROOM
from kankaku.studies.study import world_of
from kankaku.workers import Done, Failure, attempt, performed

RunDone: TypeAlias = Done[EnsembleTask, RunFiles]
More: TypeAlias = Callable[[], Sequence[EnsembleTask]]
Tell: TypeAlias = Callable[[str, int, int], None]
"""Called with what has ended, how many runs are finished, and how many there are at most."""


class Workers(NamedTuple):
    """Who does the runs of an ensemble."""

    perform: EnsembleRuns
    jobs: int
    work: Path
    """A place for temporary files."""
    say: Callable[[str], None]


Crew: TypeAlias = Callable[[Workers, More], Generator[RunDone]]
"""Does what ``More`` returns until that is nothing, and yields what became of it."""


def own_processes(workers: Workers, more: More) -> Generator[RunDone]:
    """
    Perform runs in processes of this machine.

    Parameters
    ----------
    workers
        Who and where.
    more
        What there is to do.

    Yields
    ------
    RunDone
        In order of completion.
    """
    yield from performed(workers.perform, (), workers.jobs, folder=workers.work, more=more)


def crew_of(scheduler: str | None) -> Crew:
    """
    Return who does the runs.

    Parameters
    ----------
    scheduler
        Address of a scheduler of Dask, or ``local``; processes of this machine if None.

    Returns
    -------
    Crew
        Does them.

    Raises
    ------
    EnsembleError
        If Dask is not installed.
    """
    if scheduler is None:
        return own_processes
    try:
        from kankaku.studies.dask_crew import on_dask  # noqa: PLC0415 - an optional part
    except ImportError as error:
        option = "--scheduler"
        allowed = "pip install 'kankaku[cluster]'; without Dask --jobs, and --shard on a cluster"
        raise EnsembleError(option, "Dask is not installed", allowed) from error
    return partial(on_dask, scheduler)


@dataclass(slots=True)
class EnsembleResult:
    """What is finished of an ensemble."""

    folder: Path
    findings: EnsembleFindings | None = None
    """None of a part of a study, and if nothing was published."""
    finished: int = 0
    """Runs that were asked for and are there, earlier ones included."""
    performed: int = 0
    """Runs of this time."""
    failed: list[str] = field(default_factory=list)
    """Sentences about the runs that failed this time, and what else went wrong."""
    interrupted: bool = False


def run_ensemble(
    ensemble: Ensemble,
    folder: Path,
    drawing: Drawing | None = None,
    *,
    crew: Crew = own_processes,
    run: MakeRecord = on_sumo,
    say: Callable[[str], None] = lambda _: None,
    tell: Tell = lambda *_: None,
) -> EnsembleResult:
    """
    Run what is missing of an ensemble.

    Every finished run is put into the dataset at once, whole or not at all, and stays there.

    Parameters
    ----------
    ensemble
        What to run.
    folder
        Results folder. Parts of one study may be run into it at the same time.
    drawing
        What is drawn.
    crew
        Who does the runs.
    run
        Makes the record of a run.
    say
        Called with sentences.
    tell
        Called when a run has ended.

    Returns
    -------
    EnsembleResult
        What is finished.

    Raises
    ------
    KankakuError
        If a controller cannot be built, another command writes to the folder, or it holds runs
        that were made from something else, and ``fresh`` is not set.
    FileExistsError
        If something else stands there.
    """
    refuse_other(folder)
    for study in ensemble.studies:
        world = world_of(study.scenario, study.step_s)
        for spec in study.specs:
            registry.build(spec, world, study.scenario.radio)
    if cache := chosen_cache():
        refuse_unwritable(cache, CACHE)
    layers = registered([spec for study in ensemble.studies for spec in study.specs])
    with _held(ensemble, folder) as work:
        running = EnsembleRunning(ensemble, folder, work)
        workers = Workers(EnsembleRuns(ensemble, layers, run), ensemble.jobs, work, say)
        result = running.run(partial(crew, workers), say, tell)
        if ensemble.shard is None:
            running.publish(drawing or Drawing())
        return result


@contextmanager
def _held(ensemble: Ensemble, folder: Path) -> Iterator[Path]:
    part = ensemble.shard
    name = f"{part.number}_of_{part.parts}" if part else ""
    with held_part(folder, name) if part else held(folder) as work:
        refuse_unwritable(folder, "results")
        yield work


def refuse_other(folder: Path) -> None:
    """
    Raise an error if something else stands where an ensemble would go.

    Parameters
    ----------
    folder
        Any path.

    Raises
    ------
    FileExistsError
        If there is something without a plan.
    """
    if folder.is_dir():
        left = {UNFINISHED, FAILURES, PARTS_HELD}
        ours = (folder / PLAN).is_file() or {item.name for item in folder.iterdir()} <= left
    else:
        nearest = next(place for place in (folder, *folder.absolute().parents) if place.exists())
        ours = nearest.is_dir()
    if not ours:
        msg = f"{folder}: exists and holds no study of many seeds; choose another folder"
        raise FileExistsError(msg)


class EnsembleRunning:
    """An ensemble that is being run, and its results folder."""

    def __init__(self, ensemble: Ensemble, folder: Path, work: Path) -> None:
        """Look at what the folder holds; see :func:`run_ensemble` for what is refused."""
        self._ensemble, self._folder, self._work = ensemble, folder, work
        self._plan = ensemble.plan
        self._result = EnsembleResult(folder)
        found = all_saved(folder)
        if ensemble.shard is None:
            for root, runs in found.items():
                dataset_store.tidy(root, runs)
        odd = {
            (root, task): told
            for root, runs in found.items()
            for task, saved in runs.items()
            if (told := self._differences(root, saved))
        }
        if odd and not ensemble.fresh:
            words = dict.fromkeys(word for told in odd.values() for word in told)
            problem = f"holds runs of something else ({', '.join(words)})"
            raise EnsembleError(str(folder), problem, "--fresh, to replace them, or another --out")
        self._stale = list(odd)
        self._there = {
            task: saved
            for root, runs in found.items()
            for task, saved in runs.items()
            if (root, task) not in odd
        }
        """Finished runs, whoever asked for them."""
        self._finished = {
            task: self._there[task]
            for task in ensemble.tasks
            if task in self._there and not ensemble.fresh and self._is_whole(self._there[task])
        }
        self._begun = 0
        self._seen: list[pd.DataFrame] = []
        """Summaries of the batches that were looked at."""
        self._ended = len(self._finished)

    def _is_whole(self, saved: Saved) -> bool:
        return not self._plan.trajectories or dataset_store.ON_DEMAND in saved.note["files"]

    def _differences(self, root: Path, saved: Saved) -> list[str]:
        task, plan = saved.task, self._plan
        engine = plan.engine if root == self._folder / RUNS else EVERY_STEP
        same = [one for one in plan.scenarios if one.name == task.scenario]
        if not same:
            # Another scenario may lie beside these; the program has to be the same.
            first = plan.scenarios[0].origins[plan.controllers[0]]
            program = {key: first.get(key) for key in ("versions", "sources_sha256", "draws")}
            return saved.differences({**saved.note, **program, "engine": engine})
        own = task.controller in same[0].origins
        origin = same[0].origins[task.controller if own else plan.controllers[0]]
        return saved.differences({**origin, "engine": engine}, options=own)

    def run(
        self,
        crew: Callable[[More], Generator[RunDone]],
        say: Callable[[str], None],
        tell: Tell,
    ) -> EnsembleResult:
        """
        Run what is missing.

        Parameters
        ----------
        crew
            Does the runs.
        say, tell
            As of :func:`run_ensemble`.

        Returns
        -------
        EnsembleResult
            What is finished.
        """
        if self._finished:
            total = len(self._ensemble.tasks)
            say(f"{len(self._finished)} of {total} runs were finished before.")
        self._write_plan()
        try:
            with closing(crew(self._more)) as answers:
                for done in answers:
                    with interrupts.undisturbed():
                        ended = self._take(done)
                    if done.killed and done.failure is None:
                        say(f"{done.task}: {done.killed}; the second try succeeded.")
                    self._ended += 1
                    tell(f"{done.task} {ended}", self._ended, len(self._ensemble.tasks))
                    if done.failure is not None and done.failure.errno in NO_ROOM:
                        break
        except KeyboardInterrupt:
            interrupts.answered()
            self._result.interrupted = True
        self._result.finished = len(self._finished)
        return self._result

    def _write_plan(self) -> None:
        # Several parts may write it at once, and all of them the same.
        lines = lines_text(self._ensemble.studies, self._plan.knows_future)
        for name, text in ((PLAN, json_text(self._plan.told())), (LINES, lines)):
            written = self._work / name
            written.write_text(text, "utf-8")
            written.replace(self._folder / name)

    def _more(self) -> list[EnsembleTask]:
        """Return what of the next batch is missing, unless enough is known by now."""
        batches = self._ensemble.batches
        while self._begun < len(batches) and not self._knows_enough():
            batch = batches[self._begun]
            self._begun += 1
            missing = [task for task in batch if task not in self._finished]
            if missing:
                return missing
        return []

    def _knows_enough(self) -> bool:
        if self._plan.precision is None or self._begun < FIRST_LOOK:
            return False
        for batch in self._ensemble.batches[len(self._seen) : self._begun]:
            own = [task for task in batch if task.engine == self._plan.engine]
            there = [task for task in own if task in self._finished]
            self._seen.append(summary_of(self._folder, there))
        seeds = self._plan.batches[self._begun - 1].stop
        return self._plan.precise(pd.concat(self._seen), seeds)

    def _take(self, done: RunDone) -> str:
        """Keep what became of a run, and return that in a word."""
        task, made = done.task, done.result
        if made is None:
            return self._fail(task, done.failure or Failure("no result"))
        for root, stale in self._stale:
            dataset_store.remove(root, stale)
        self._stale = []
        saved = Saved(task, note_of(made.files[MAIN]))
        if other := saved.differences(self._plan.origin_of(task)):
            return self._fail(task, Failure(f"changed while it ran: {', '.join(other)}"))
        root = root_of(self._folder, self._plan, task)
        put = partial(dataset_store.put, root, task, made, self._work)
        failure = attempt(put)[1]
        if failure is not None:
            return self._fail(task, failure)
        failed_runs.forget(self._folder, task.file_name)
        self._there[task] = self._finished[task] = saved
        self._result.performed += 1
        return "finished"

    def _fail(self, task: EnsembleTask, failure: Failure) -> str:
        sentence = f"{task}: {failure.sentence}"
        name = task.file_name
        told = failed_runs.noted_sentence(self._folder, name, sentence, failure)
        self._result.failed.append(told)
        return "failed"

    def publish(self, drawing: Drawing) -> None:
        """
        Write what all runs show.

        Parameters
        ----------
        drawing
            What is drawn.
        """
        result = self._result
        if not self._there:
            return
        try:
            self._publish(drawing)
        except KeyboardInterrupt:
            # The runs are in place; the same command writes the table.
            interrupts.answered()
            result.interrupted = True

    def _publish(self, drawing: Drawing) -> None:
        findings = findings_of(self._folder, self._plan, self._there)
        self._result.findings = findings
        for formats in dict.fromkeys((drawing.formats, ())):
            write = partial(
                publish_findings, self._folder, findings, Drawing(drawing.indicators, formats)
            )
            failure = attempt(write)[1]
            if failure is None and formats:
                failure = attempt(partial(page_of_folder, self._folder))[1]
            if failure is None:
                return
            interrupts.check()
            what = "the figures could not be drawn" if formats else "no table was written"
            told = f"{what}: {failure.sentence}"
            name = failed_runs.TROUBLE
            self._result.failed.append(
                failed_runs.noted_sentence(self._folder, name, told, failure)
            )
