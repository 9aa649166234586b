"""
A study: every controller, seed and swept delay of a scenario, run, written and compared.

This is the one place where the rooms meet: files -> scenario -> SUMO -> loop -> tables.
``run.py`` gives it a command line; scripts and notebooks may call :func:`run_study`.
"""

import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from kankaku.analysis.publish.study_publishing import STUDY_RESULTS
from kankaku.analysis.results import refuse_foreign
from kankaku.analysis.tables.run_tables import run_tables
from kankaku.asking import MOST_JOBS, MOST_SEEDS, SEED_MAX, STEP_RANGE_S
from kankaku.controllers import registry
from kankaku.controllers.choosing import named, with_settings
from kankaku.railway.failures.unit_failures import UnitFailure
from kankaku.railway.loop.simulate import simulate
from kankaku.railway.meters.all_meters import all_meters
from kankaku.railway.places import CACHE, chosen_cache, refuse_unwritable
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.step.engine_ways import EVERY_STEP
from kankaku.railway.step.records import RunRecord
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.shipped import folder_of
from kankaku.store import run_store
from kankaku.store.holding import held
from kankaku.store.run_store import Task
from kankaku.studies.opening import Opening, foresight_of, world_of
from kankaku.studies.outcomes import (
    Failed,
    Go,
    Hearers,
    Outcome,
    Progress,
    Say,
    Study,
    StudyError,
    StudyResult,
    Tell,
    formats_of,
)
from kankaku.studies.registered_layers import Registered, registered
from kankaku.studies.running import Running

__all__ = [
    "Failed",
    "Outcome",
    "Progress",
    "Study",
    "StudyError",
    "StudyResult",
    "Task",
    "choose",
    "foresight_of",
    "run_once",
    "run_study",
    "world_of",
]


def run_once(  # noqa: PLR0913 - one argument per part of a run
    scenario: Scenario,
    spec: ControllerSpec,
    seed: int,
    step_s: float,
    *,
    gui: bool = False,
    engine: str = EVERY_STEP,
    progress: Callable[[float], None] = lambda _: None,
    wrap: Callable[[str, Any], Any] = lambda _, layer: layer,
    unit_failures: Sequence[UnitFailure] | None = None,
) -> RunRecord:
    """
    Run one controller on SUMO.

    Parameters
    ----------
    scenario
        Line, fleet, timetable and delays.
    spec
        Which controller.
    seed
        Seed of the dwell delays.
    step_s
        Length of a step. [s]
    gui
        Show the run in sumo-gui.
    engine
        How SUMO takes part, one of :data:`~kankaku.railway.step.engine_ways.ENGINES`.
    progress
        Called with the simulated time now and then. [s]
    wrap
        Called with "engine", "protection", "supervision", "operation" or "drive" and that layer;
        returns what stands in for it, for example something that measures it.
    unit_failures
        What units and the centre do wrong; with any, even none, a protection sees what units
        measure, otherwise what is.

    Returns
    -------
    RunRecord
        Everything that happened.

    Raises
    ------
    StudyError
        If a train cannot start, climb, hold or stop wherever its service takes it, or there is no
        such engine.
    """
    opening = Opening(scenario, spec, step_s, engine=engine, gui=gui)
    record = None
    try:
        with opening.opened(seed, wrap=wrap, unit_failures=unit_failures) as opened:
            record = simulate(
                opened.run,
                opened.engine,
                opened.controller,
                all_meters(opening.world),
                units=opened.units,
                progress=progress,
            )
    except Exception:
        # After a collision an engine may even fail to end.
        if record is None or not record.failure:
            raise
    return record if spec.peer else replace(record, foresight=foresight_of(opened.bare))


def run_study(
    study: Study,
    out: Path,
    progress: Progress = lambda *_: None,
    say: Say = lambda _: None,
    tell: Tell = lambda *_: None,
) -> StudyResult:
    """
    Run what is missing of a study, and write its results folder.

    Every finished run is put into the folder at once and stays there, whatever happens to the
    others; summary, figures and report are of all runs that the folder holds. A folder that
    holds anything but results of this program is left alone.

    Parameters
    ----------
    study
        What to run.
    out
        Folder that will hold the results folder, named as the scenario.
    progress
        Called now and then.
    say
        Called with sentences about what is finished.
    tell
        Called when a run has ended.

    Returns
    -------
    StudyResult
        What is finished.

    Raises
    ------
    StudyError
        If the folder holds runs that were made from something else, and ``fresh`` is not set.
    HeldError
        If another command writes to the folder.
    FileExistsError
        If something else stands where the results would go.
    """
    with ready(study, out) as run:
        return run(Hearers(progress, say, tell))


@contextmanager
def ready(study: Study, out: Path) -> Iterator[Go]:
    """
    Hold the results folder of a study that can be run.

    Parameters
    ----------
    study
        What to run.
    out
        Folder that will hold the results folder.

    Yields
    ------
    Callable[[Hearers], StudyResult]
        Runs what is missing, and writes the results folder.

    Raises
    ------
    KankakuError, OSError
        As :func:`run_study`.
    """
    folder = out / study.scenario.name
    refuse_foreign(folder, STUDY_RESULTS.marks)
    world = world_of(study.scenario, study.step_s)
    for spec in study.specs:
        registry.build(spec, world, study.scenario.radio)
    if cache := chosen_cache():
        refuse_unwritable(cache, CACHE)
    with held(folder) as work:
        refuse_unwritable(folder, "results")
        running = Running(study, folder, work, world)
        yield partial(running.run, partial(_perform, study, registered(study.specs)))


def _perform(
    study: Study, layers: Registered, task: Task, progress: Callable[[float], None]
) -> Path:
    """Run and write where nobody looks yet; return where."""
    layers.restore()
    started = time.perf_counter()
    spec = next(spec for spec in study.specs if spec.name == task.controller)
    scenario = study.scenario.with_initial_delay(task.initial_delay_s)
    record = run_once(
        *(scenario, spec, task.seed, study.step_s),
        gui=study.gui,
        engine=study.engine,
        progress=progress,
    )
    told = {
        "wall_s": round(time.perf_counter() - started, 3),
        "train_steps": record.train_steps,
        "violations": len(record.violations),
        "failure": record.failure,
    }
    place = Path(tempfile.mkdtemp()) / "run"
    # Asked here, where the run was made: whoever edits the program meanwhile changes it.
    origin = run_store.origin_of(study.scenario, spec, study.step_s, study.engine)
    run_store.write_finished(run_tables(record), place, origin, task, told)
    return place


def _refuse_numbers(seed: int | None, seeds: int, step_s: float | None, jobs: int) -> None:
    least_s, most_s = STEP_RANGE_S
    for option, value, least, most in (
        ("--seed", 0 if seed is None else seed, 0, SEED_MAX),
        ("--seeds", seeds, 1, MOST_SEEDS),
        ("--step", least_s if step_s is None else step_s, least_s, most_s),
        ("--jobs", jobs, 1, MOST_JOBS),
    ):
        # Also what is not a number at all.
        if not least <= value <= most:
            msg = f"{option}: {value}; allowed: from {least} to {most}"
            raise StudyError(msg)


def choose(  # noqa: PLR0913 - one argument per choice of the user
    scenario: str | Path,
    *,
    names: Sequence[str] = (),
    settings: Sequence[str] = (),
    seed: int | None = None,
    seeds: int = 1,
    step_s: float | None = None,
    jobs: int = 1,
    gui: bool = False,
    everything: bool = False,
    fresh: bool = False,
    engine: str = EVERY_STEP,
    formats: Sequence[str] = (),
) -> Study:
    """
    Read a scenario and choose what to run of it.

    Parameters
    ----------
    scenario
        Its folder, or the name of a shipped one.
    names
        Controllers to run, baseline first; all that run by default if empty. Layers that the
        scenario does not name together are ``protection+operation``.
    settings
        Other values of their options, ``<controller>.<option>=<value>`` each.
    seed
        First seed; the scenario's own if None.
    seeds
        How many seeds, counting up.
    step_s
        Length of a step; the scenario's own if None. [s]
    jobs
        Processes to use.
    gui
        Show the runs in sumo-gui, one after the other.
    everything
        Where no names are given, take the controllers that do not run by default, too.
    fresh
        Run what is finished in the results folder, too.
    engine
        How SUMO takes part, one of :data:`~kankaku.railway.step.engine_ways.ENGINES`.
    formats
        What figures are written as, ``png`` and ``svg``; both if empty, no figures for ``none``.

    Returns
    -------
    Study
        What to run.

    Raises
    ------
    ScenarioError
        If the files cannot be used.
    ControllerError
        If a name is no controller, or a setting not allowed.
    StudyError
        If a sweep is to run with several seeds, a number is out of range, or there is no such
        engine or format.
    """
    _refuse_numbers(seed, seeds, step_s, jobs)
    chosen = load(folder_of(scenario))
    specs = tuple(named(chosen.controllers, name) for name in dict.fromkeys(names))
    specs = specs or tuple(spec for spec in chosen.controllers if spec.by_default or everything)
    first = chosen.seed if seed is None else seed
    if first + seeds - 1 > SEED_MAX:
        msg = f"--seeds: {seeds} from seed {first} on; allowed: up to seed {SEED_MAX}"
        raise StudyError(msg)
    return Study(
        chosen,
        with_settings(specs, settings),
        tuple(range(first, first + seeds)),
        chosen.step_s if step_s is None else step_s,
        1 if gui else jobs,
        gui,
        fresh,
        engine,
        formats_of(formats),
    )
