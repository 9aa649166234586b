"""What a study is asked for and what it answers, in plain data."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, TypeAlias

import pandas as pd

from kankaku.analysis.publish.results_folder import EVERY_FORMAT, FORMATS
from kankaku.analysis.tables.sweep import SweepTables
from kankaku.railway.errors import KankakuError, suggesting
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.step.engine_ways import ENGINES, EVERY_STEP
from kankaku.store.run_store import Kept, Task

NO_FIGURES = "none"
"""What the formats of figures are called if there are to be no figures."""


class StudyError(KankakuError):
    """What of a scenario cannot be run: the option or the run, and what is wrong."""


def refuse_unknown_engine(engine: str) -> None:
    """
    Refuse an engine that there is not.

    Parameters
    ----------
    engine
        Its name.

    Raises
    ------
    StudyError
        If it is none of :data:`~kankaku.railway.step.engine_ways.ENGINES`.
    """
    if engine not in ENGINES:
        msg = f"--engine: {engine!r}; allowed: {suggesting(engine, ENGINES, ', '.join(ENGINES))}"
        raise StudyError(msg)


def formats_of(asked: Sequence[str]) -> tuple[str, ...]:
    """
    Return what figures are to be written as.

    Parameters
    ----------
    asked
        Formats, or :data:`NO_FIGURES` alone; the usual ones if empty.

    Returns
    -------
    tuple[str, ...]
        Formats, each once; empty if no figure is to be drawn.

    Raises
    ------
    StudyError
        If there is no such format.
    """
    if tuple(asked) == (NO_FIGURES,):
        return ()
    for name in asked:
        if name not in EVERY_FORMAT:
            allowed = suggesting(
                name, EVERY_FORMAT, ", ".join((*EVERY_FORMAT, f"or {NO_FIGURES} alone"))
            )
            msg = f"--figures: {name!r}; allowed: {allowed}"
            raise StudyError(msg)
    return tuple(dict.fromkeys(asked)) or FORMATS


@dataclass(frozen=True, slots=True)
class Study:
    """What to run."""

    scenario: Scenario
    specs: tuple[ControllerSpec, ...]
    seeds: tuple[int, ...]
    step_s: float
    jobs: int = 1
    gui: bool = False
    fresh: bool = False
    """Run what is finished in the results folder, too."""
    engine: str = EVERY_STEP
    """One of :data:`~kankaku.railway.step.engine_ways.ENGINES`."""
    formats: tuple[str, ...] = FORMATS
    """Of the figures; none are drawn without any."""

    def __post_init__(self) -> None:
        refuse_unknown_engine(self.engine)
        if self.scenario.sweep and len(self.seeds) > 1:
            msg = f"--seeds: {len(self.seeds)} seeds of a scenario with a sweep; allowed: 1"
            raise StudyError(msg)

    @property
    def delays_s(self) -> tuple[float | None, ...]:
        """Initial delays of the sweep; a single None without one. [s]"""
        sweep = self.scenario.sweep
        return sweep.delays_s if sweep else (None,)

    @property
    def tasks(self) -> tuple[Task, ...]:
        """Controllers in order, then seeds, then initial delays."""
        return tuple(
            Task(spec.name, seed, delay_s)
            for spec in self.specs
            for seed in self.seeds
            for delay_s in self.delays_s
        )


@dataclass(frozen=True, slots=True)
class Outcome:
    """What the whole study needs to know of a run whose tables are written."""

    task: Task
    violations: tuple[str, ...]
    wall_s: float
    train_steps: int
    failure: str = ""
    """What ended the run after violations; empty if it came to its end."""
    unfinished: tuple[str, ...] = ()
    """Sentences about the trains that were still under way when it ended."""


@dataclass(frozen=True, slots=True)
class Failed:
    """A run without results."""

    task: Task
    time_s: float | None
    """Simulated time up to which it came, seconds after midnight. [s]"""
    sentence: str
    file: Path | None = None
    """Where the traceback is."""

    def __str__(self) -> str:
        at = ""
        if self.time_s is not None:
            minutes, seconds = divmod(int(self.time_s), 60)
            at = f" at {minutes // 60:02d}:{minutes % 60:02d}:{seconds:02d}"
        return f"{self.task}{at}: {self.sentence}"


@dataclass(slots=True)
class StudyResult:
    """What is finished."""

    folder: Path
    summary: pd.DataFrame | None = None
    """Of all runs that the folder holds; None if nothing was published."""
    sweep: SweepTables | None = None
    outcomes: list[Outcome] = field(default_factory=list)
    """Of the runs that were asked for, earlier ones included."""
    kept: list[Kept] = field(default_factory=list)
    """All runs that the folder holds."""
    failed: list[Failed] = field(default_factory=list)
    troubles: list[str] = field(default_factory=list)
    """What else went wrong, a sentence each."""
    interrupted: bool = False

    @property
    def violations(self) -> list[str]:
        """Sentences about every violation, run by run."""
        return [
            f"{outcome.task}: {sentence}"
            for outcome in self.outcomes
            for sentence in outcome.violations
        ]

    @property
    def unfinished(self) -> list[str]:
        """Sentences about every train that had not finished, run by run."""
        return [
            f"{outcome.task}: {sentence}"
            for outcome in self.outcomes
            for sentence in outcome.unfinished
        ]

    @property
    def failures(self) -> list[str]:
        """Sentences about every run that failed or was ended early, and what else went wrong."""
        ended = [f"{run.task} {run.failure}" for run in self.outcomes if run.failure]
        files = {failed: f" ({failed.file})" if failed.file else "" for failed in self.failed}
        return [*(f"{one}{file}" for one, file in files.items()), *ended, *self.troubles]


Progress: TypeAlias = Callable[[Task, float, float], None]
"""Called with the task, its simulated seconds so far and those expected in all."""
Say: TypeAlias = Callable[[str], None]
"""Called with sentences about what is finished."""
Tell: TypeAlias = Callable[[Task, str, int, int], None]
"""Called with a run that has ended, how it ended, how many have, and how many there are."""


class Hearers(NamedTuple):
    """Who wants to know how a study comes along."""

    progress: Progress = lambda *_: None
    say: Say = lambda _: None
    tell: Tell = lambda *_: None


Go: TypeAlias = Callable[[Hearers], StudyResult]
"""Runs what is missing of a study whose results folder is held."""
