"""An ensemble: controllers of one or more scenarios on many seeds, and which runs that means."""

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from kankaku.analysis.tables.ensemble_tables import Precision, precision_of
from kankaku.controllers.choosing import foretold
from kankaku.railway.errors import KankakuError
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.store.dataset_store import EnsembleTask
from kankaku.store.run_store import Origin, origin_of
from kankaku.studies.across_study import choose_across
from kankaku.studies.outcomes import Study

EVERY_STEP, WITNESS = "every_step", "witness"
LOOK_EVERY = 10
"""Seeds of a batch, after which a study that stops by itself looks whether it may. [-]"""
FIRST_LOOK = 2
"""Batches before the first look: of a few runs the spread is too uncertain. [-]"""
MOST_SHARDS = 100_000
_SHARD = re.compile(r"\s*(\d+)\s*/\s*(\d+)\s*")


class EnsembleError(KankakuError):
    """What of an ensemble cannot be run, or put together."""


class Shard(NamedTuple):
    """A part of the runs."""

    number: int
    """From 1 on. [-]"""
    parts: int

    def __str__(self) -> str:
        return f"{self.number}/{self.parts}"


@dataclass(frozen=True)
class Ensemble:
    """What to run."""

    studies: tuple[Study, ...]
    engine: str = EVERY_STEP
    trajectories: bool = False
    until: Precision | None = None
    shard: Shard | None = None

    @property
    def jobs(self) -> int:
        """Processes to use."""
        return self.studies[0].jobs

    @property
    def fresh(self) -> bool:
        """Run what is finished, too."""
        return self.studies[0].fresh

    @property
    def controllers(self) -> list[str]:
        """What is compared in every scenario, baseline first."""
        return [spec.name for spec in self.studies[0].specs]

    def study_of(self, task: EnsembleTask) -> tuple[Study, ControllerSpec]:
        """
        Return whose run it is.

        Parameters
        ----------
        task
            The run.

        Returns
        -------
        tuple[Study, ControllerSpec]
            Its scenario and its controller.
        """
        study = next(study for study in self.studies if study.scenario.name == task.scenario)
        return study, next(spec for spec in study.specs if spec.name == task.controller)

    @cached_property
    def origins(self) -> Mapping[tuple[str, str], Origin]:
        """What runs are made from, by scenario and controller."""
        return {
            (study.scenario.name, spec.name): origin_of(study.scenario, spec, study.step_s)
            for study in self.studies
            for spec in study.specs
        }

    @cached_property
    def batches(self) -> tuple[tuple[EnsembleTask, ...], ...]:
        """The runs of this part, seed by seed; those of each batch may come in any order."""
        seeds = len(self.studies[0].seeds)
        every = LOOK_EVERY if self.until else seeds
        batches = (range(first, min(first + every, seeds)) for first in range(0, seeds, every))
        return tuple(tuple(self._of_this_part(numbers)) for numbers in batches)

    def _of_this_part(self, numbers: range) -> list[EnsembleTask]:
        tasks = [
            EnsembleTask(study.scenario.name, spec.name, study.seeds[number], engine)
            for number in numbers
            for study in self.studies
            for spec in study.specs
            for engine in self._engines(number)
        ]
        if self.shard is None:
            return tasks
        # By lot, but the same one everywhere: runs of one controller take equally long.
        drawn = sorted(tasks, key=_lot)
        own = set(drawn[self.shard.number - 1 :: self.shard.parts])
        return [task for task in tasks if task in own]

    def _engines(self, number: int) -> tuple[str, ...]:
        compared = self.engine != EVERY_STEP and number == 0
        return (self.engine, EVERY_STEP) if compared else (self.engine,)

    @property
    def tasks(self) -> tuple[EnsembleTask, ...]:
        """All runs of this part, in order."""
        return tuple(task for batch in self.batches for task in batch)

    @cached_property
    def plan(self) -> dict[str, Any]:
        """What the whole study is, whoever runs which part of it: plain data for JSON."""
        whole = replace(self, shard=None)
        return {
            "engine": self.engine,
            "controllers": self.controllers,
            "knows_future": sorted(foretold(self.studies[0].specs)),
            "trajectories": self.trajectories,
            "until": str(self.until) if self.until else None,
            "scenarios": [
                {
                    "name": study.scenario.name,
                    "title": study.scenario.title,
                    "step_s": study.step_s,
                    "first_seed": study.seeds[0],
                    "seeds": len(study.seeds),
                }
                for study in self.studies
            ],
            "runs": len(whole.tasks),
            "origins": [dict(origin) for origin in self.origins.values()],
        }


def _lot(task: EnsembleTask) -> bytes:
    return hashlib.sha256(str(task).encode()).digest()


def shard_of(text: str) -> Shard:
    """
    Read which part of a study is to be run.

    Parameters
    ----------
    text
        For example ``3/20``.

    Returns
    -------
    Shard
        The same in numbers.

    Raises
    ------
    EnsembleError
        If there is no such part.
    """
    found = _SHARD.fullmatch(text)
    part = Shard(int(found[1]), int(found[2])) if found else Shard(0, 0)
    if not 1 <= part.number <= part.parts <= MOST_SHARDS:
        allowed = f"3/20 for the third of 20, up to {MOST_SHARDS} parts"
        where = "--shard"
        raise EnsembleError(where, f"{text!r} is no part of several", allowed)
    return part


def choose_ensemble(
    scenarios: Sequence[str | Path],
    choices: Mapping[str, Any],
    *,
    engine: str = EVERY_STEP,
    trajectories: bool = False,
    until: str | None = None,
    shard: str | None = None,
) -> Ensemble:
    """
    Read scenarios and choose what to run of them.

    Parameters
    ----------
    scenarios
        Folders, or names of shipped ones.
    choices
        As of :func:`kankaku.studies.study.choose`, the same for all scenarios.
    engine
        How SUMO is told of the trains.
    trajectories
        Keep the trajectories, too.
    until
        Precision at which the study stops by itself, as :func:`precision_of` reads it.
    shard
        Which part of the runs, as :func:`shard_of` reads it.

    Returns
    -------
    Ensemble
        What to run.

    Raises
    ------
    KankakuError
        With every reason why it cannot be run.
    """
    wanted = precision_of(until) if until else None
    part = shard_of(shard) if shard else None
    if wanted and part:
        where = "--until"
        raise EnsembleError(where, "a part of a study does not see the others", "without --shard")
    studies = choose_across(scenarios, choices)
    return Ensemble(studies, engine, trajectories, wanted, part)
