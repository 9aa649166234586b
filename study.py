"""
A study: every controller, seed and swept delay of a scenario, run, written and compared.

This is the one place where the rooms meet: files -> scenario -> SUMO -> loop -> tables.
``run.py`` gives it a command line; scripts and notebooks may call :func:`run_study`.
"""

import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

import controllers
from analysis import (
    RESULT_FILES,
    SweepTables,
    publish,
    put_in_place,
    read_run,
    refuse_foreign,
    run_folder,
    run_tables,
    shown_delays_s,
    write_run,
)
from provenance import provenance_of
from railway.faults import Fault
from railway.loop import simulate
from railway.places import refuse_unwritable, temporary_folder
from railway.records import RunRecord
from railway.scenario import ControllerSpec, Scenario
from railway.world import World, build_world
from scenarios import load
from sumo_net.build import build, build_native
from sumo_net.engine import SumoEngine
from sumo_net.native import NativeEngine, PeerError
from workers import performed

STEP_RANGE_S = (0.01, 0.5)
SEED_MAX = 2**63 - 1
MOST_SEEDS = 100_000
MOST_JOBS = 10_000


class StudyError(ValueError):
    """What of a scenario cannot be run: the option or the run, and what is wrong."""


@dataclass(frozen=True, slots=True)
class Study:
    """What to run."""

    scenario: Scenario
    specs: tuple[ControllerSpec, ...]
    seeds: tuple[int, ...]
    step_s: float
    jobs: int = 1
    gui: bool = False

    def __post_init__(self) -> None:
        if self.scenario.sweep and len(self.seeds) > 1:
            msg = f"--seeds: {len(self.seeds)} seeds of a scenario with a sweep; allowed: 1"
            raise StudyError(msg)

    @property
    def delays_s(self) -> tuple[float | None, ...]:
        """Initial delays of the sweep; a single None without one. [s]"""
        sweep = self.scenario.sweep
        return sweep.delays_s if sweep else (None,)

    @property
    def tasks(self) -> tuple["Task", ...]:
        """Controllers in order, then seeds, then initial delays."""
        return tuple(
            Task(spec.name, seed, delay_s)
            for spec in self.specs
            for seed in self.seeds
            for delay_s in self.delays_s
        )


class Task(NamedTuple):
    """One run: one controller meets one seed and one delay of a sweep."""

    controller: str
    seed: int
    initial_delay_s: float | None = None
    """None without a sweep. [s]"""

    def __str__(self) -> str:
        delay_s = self.initial_delay_s
        swept = "" if delay_s is None else f", initial delay {delay_s:.1f} s"
        return f"{self.controller} (seed {self.seed}{swept})"


@dataclass(frozen=True, slots=True)
class Outcome:
    """What the whole study needs to know of a run whose tables are written."""

    task: Task
    violations: tuple[str, ...]
    wall_s: float
    train_steps: int


@dataclass(slots=True)
class StudyResult:
    """What is finished."""

    folder: Path
    summary: pd.DataFrame | None = None
    sweep: SweepTables | None = None
    outcomes: list[Outcome] = field(default_factory=list)
    interrupted: bool = False

    @property
    def violations(self) -> list[str]:
        """Sentences about every violation, run by run."""
        return [
            f"{outcome.task}: {sentence}"
            for outcome in self.outcomes
            for sentence in outcome.violations
        ]


Progress = Callable[[Task, float, float], None]
"""Called with the task, its simulated seconds so far and those expected in all."""


def world_of(scenario: Scenario, step_s: float) -> World:
    """
    Return what the controllers of a scenario know.

    Parameters
    ----------
    scenario
        The scenario.
    step_s
        Length of a step. [s]

    Returns
    -------
    World
        Its arrays.
    """
    return build_world(scenario.line, scenario.train_types, scenario.timetable, step_s)


def run_once(  # noqa: PLR0913 - one argument per part of a run
    scenario: Scenario,
    spec: ControllerSpec,
    seed: int,
    step_s: float,
    *,
    gui: bool = False,
    progress: Callable[[float], None] = lambda _: None,
    wrap: Callable[[str, Any], Any] = lambda _, layer: layer,
    faults: Sequence[Fault] | None = None,
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
    progress
        Called with the simulated time now and then. [s]
    wrap
        Called with "engine", "protection", "operation" or "drive" and that layer; returns
        what stands in for it, for example something that measures it.
    faults
        What units and the centre do wrong; see :func:`railway.loop.simulate`.

    Returns
    -------
    RunRecord
        Everything that happened.
    """
    world = world_of(scenario, step_s)
    delays_s = scenario.dwell_delays.draw(scenario.timetable, seed)
    bare = controllers.build(spec, world, scenario.radio)
    controller = replace(
        bare,
        protection=wrap("protection", bare.protection),
        operation=wrap("operation", bare.operation),
        drive=wrap("drive", bare.drive),
    )
    peer = controllers.PEERS[spec.peer] if spec.peer else None
    write = partial(build_native, moving_block=peer.moving_block) if peer else build
    engine: type[NativeEngine | SumoEngine] = NativeEngine if peer else SumoEngine
    with tempfile.TemporaryDirectory(prefix="kankaku-") as folder:
        files = write(scenario, world, delays_s, Path(folder))
        with engine(files, world, gui=gui) as sumo:
            return simulate(
                world,
                wrap("engine", sumo),
                controller,
                delays_s,
                seed=seed,
                patience_s=scenario.patience_s,
                disruptions=scenario.disruptions,
                radio=scenario.radio,
                faults=faults,
                progress=progress,
            )


def run_study(study: Study, out: Path, progress: Progress = lambda *_: None) -> StudyResult:
    """
    Run a study and write its results folder.

    The folder is put in place whole, when all runs are finished or the user interrupts; a
    folder that holds anything but earlier results is left alone.

    Parameters
    ----------
    study
        What to run.
    out
        Folder that will hold the results folder, named as the scenario.
    progress
        Called now and then.

    Returns
    -------
    StudyResult
        What is finished.

    Raises
    ------
    FileExistsError
        If something else stands where the results would go.
    """
    target = out / study.scenario.name
    refuse_foreign(target, RESULT_FILES)
    world = world_of(study.scenario, study.step_s)
    built = [controllers.build(spec, world, study.scenario.radio) for spec in study.specs]
    by_radio = frozenset(controller.name for controller in built if controller.by_radio)
    result = StudyResult(target)
    out.mkdir(parents=True, exist_ok=True)
    refuse_unwritable(out, "results")
    refuse_unwritable(temporary_folder(), "temporary files, TMPDIR")
    with tempfile.TemporaryDirectory(dir=out, prefix=f".{study.scenario.name}-") as place:
        work, unfinished = Path(place) / study.scenario.name, Path(place) / "unfinished"
        started = time.perf_counter()
        try:
            for outcome in _outcomes(study, unfinished, progress):
                _accept(_folder_of(study, outcome.task, unfinished), unfinished, work)
                result.outcomes.append(outcome)
        except KeyboardInterrupt:
            result.interrupted = True
        result.outcomes.sort(key=lambda outcome: study.tasks.index(outcome.task))
        wall_s = time.perf_counter() - started
        if result.outcomes:
            try:
                _publish(study, result, work, wall_s, by_radio)
            except KeyboardInterrupt:
                result.interrupted = True
                _publish(study, result, work, wall_s, by_radio)
            put_in_place(work, target, Path(place) / "earlier")
    return result


def _accept(folder: Path, unfinished: Path, work: Path) -> None:
    """Move a finished run to where nothing half-written can be."""
    accepted = work / folder.relative_to(unfinished)
    accepted.parent.mkdir(parents=True, exist_ok=True)
    folder.replace(accepted)


def _publish(
    study: Study, result: StudyResult, work: Path, wall_s: float, by_radio: frozenset[str]
) -> None:
    # Without a sweep the tables say that no train was delayed.
    ran = [(outcome.task, outcome.task.initial_delay_s or 0.0) for outcome in result.outcomes]
    drawn_s = shown_delays_s([(task.controller, delay_s) for task, delay_s in ran])
    runs = [
        read_run(
            _folder_of(study, task, work),
            task.controller,
            task.seed,
            delay_s,
            trajectory=task.seed == study.seeds[0] and delay_s in drawn_s,
        )
        for task, delay_s in ran
    ]
    provenance = provenance_of(study, result, wall_s)
    result.summary, result.sweep = publish(
        work, study.scenario, runs, provenance, by_radio=by_radio
    )


def _folder_of(study: Study, task: Task, work: Path) -> Path:
    return run_folder(work, *task, seeds=len(study.seeds))


def _perform(study: Study, work: Path, task: Task, progress: Callable[[float], None]) -> Outcome:
    started = time.perf_counter()
    spec = next(spec for spec in study.specs if spec.name == task.controller)
    scenario = study.scenario.with_initial_delay(task.initial_delay_s)
    try:
        record = run_once(scenario, spec, task.seed, study.step_s, gui=study.gui, progress=progress)
    except PeerError as error:
        msg = f"{task}: {error}"
        raise StudyError(msg) from error
    write_run(run_tables(record), _folder_of(study, task, work))
    return Outcome(
        task,
        tuple(violation.message for violation in record.violations),
        time.perf_counter() - started,
        record.train_steps,
    )


def _outcomes(study: Study, work: Path, progress: Progress) -> Iterator[Outcome]:
    begin_s, end_s = _expected_span_s(study.scenario)

    def tell(task: Task, time_s: float) -> None:
        progress(task, time_s - begin_s, end_s - begin_s)

    yield from performed(partial(_perform, study, work), study.tasks, study.jobs, tell, work.parent)


def _expected_span_s(scenario: Scenario) -> tuple[float, float]:
    calls = [call for service in scenario.timetable.services for call in service.calls]
    return min(call.arrival_s for call in calls), max(call.departure_s for call in calls)


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
    folder: Path,
    *,
    names: Sequence[str] = (),
    seed: int | None = None,
    seeds: int = 1,
    step_s: float | None = None,
    jobs: int = 1,
    gui: bool = False,
    everything: bool = False,
) -> Study:
    """
    Read a scenario folder and choose what to run of it.

    Parameters
    ----------
    folder
        Scenario folder.
    names
        Controllers to run, baseline first; all that run by default if empty.
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

    Returns
    -------
    Study
        What to run.

    Raises
    ------
    ScenarioError
        If the files cannot be used.
    ControllerError
        If a name is not a controller of the scenario.
    StudyError
        If a sweep is to run with several seeds, or a number is out of range.
    """
    _refuse_numbers(seed, seeds, step_s, jobs)
    scenario = load(folder)
    known = {spec.name: spec for spec in scenario.controllers}
    for name in names:
        if name not in known:
            problem = f"{name!r} is not a controller of this scenario"
            raise controllers.ControllerError(
                where="--controller", problem=problem, allowed=", ".join(known)
            )
    first = scenario.seed if seed is None else seed
    if first + seeds - 1 > SEED_MAX:
        msg = f"--seeds: {seeds} from seed {first} on; allowed: up to seed {SEED_MAX}"
        raise StudyError(msg)
    return Study(
        scenario,
        tuple(known[name] for name in dict.fromkeys(names))
        or tuple(spec for spec in scenario.controllers if spec.by_default or everything),
        tuple(range(first, first + seeds)),
        scenario.step_s if step_s is None else step_s,
        1 if gui else jobs,
        gui,
    )
