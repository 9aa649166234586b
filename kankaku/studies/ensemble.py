"""An ensemble: controllers of one or more scenarios on many seeds, and which runs that means."""

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from kankaku.analysis.tables.ensemble_tables import precision_of
from kankaku.controllers.choosing import foretold
from kankaku.railway.errors import suggesting
from kankaku.railway.plan.design_names import DESIGNS, INDEPENDENT
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.railway.plan.seed_design import seed_design
from kankaku.railway.step.engine_ways import EVERY_STEP, WITNESS
from kankaku.store.dataset_store import EnsembleTask
from kankaku.store.ensemble_plan import EnsembleError, Plan, Planned
from kankaku.store.run_store import origin_of
from kankaku.studies.across_study import choose_across
from kankaku.studies.outcomes import Study

MOST_SHARDS = 100_000
_SHARD = re.compile(r"\s*(\d+)\s*/\s*(\d+)\s*")


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
    plan: Plan
    shard: Shard | None = None

    @property
    def jobs(self) -> int:
        """Processes to use."""
        return self.studies[0].jobs

    @property
    def fresh(self) -> bool:
        """Run what is finished, too."""
        return self.studies[0].fresh

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
    def batches(self) -> tuple[tuple[EnsembleTask, ...], ...]:
        """The runs of this part; those of a batch may come in any order."""
        return tuple(
            tuple(self._of_this_part(self.plan.tasks(numbers))) for numbers in self.plan.batches
        )

    def _of_this_part(self, tasks: list[EnsembleTask]) -> list[EnsembleTask]:
        if self.shard is None:
            return tasks
        # By lot, but the same one everywhere: runs of one controller take equally long.
        drawn = sorted(tasks, key=_lot)
        own = set(drawn[self.shard.number - 1 :: self.shard.parts])
        return [task for task in tasks if task in own]

    @property
    def tasks(self) -> tuple[EnsembleTask, ...]:
        """All runs of this part, in order."""
        return tuple(task for batch in self.batches for task in batch)


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


def _drawing(study: Study, draws: str) -> Study:
    """Return a study whose seeds share their draws in a way."""
    delays = study.scenario.dwell_delays
    drawn = replace(delays, design=seed_design(draws, study.seeds[0]))
    return replace(study, scenario=replace(study.scenario, dwell_delays=drawn))


def choose_ensemble(
    scenarios: Sequence[str | Path],
    choices: Mapping[str, Any],
    *,
    engine: str | None = None,
    trajectories: bool = False,
    until: str | None = None,
    draws: str = INDEPENDENT,
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
        How SUMO takes part, one of :data:`~kankaku.railway.step.engine_ways.ENGINES`; if None,
        as a witness where there are several seeds.
    trajectories
        Keep the trajectories, too.
    until
        Precision at which the study stops by itself, as :func:`precision_of` reads it.
    draws
        How seeds share their draws, one of :data:`~kankaku.railway.plan.design_names.DESIGNS`.
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
    engine = engine or (WITNESS if choices.get("seeds", 1) > 1 else EVERY_STEP)
    if draws not in DESIGNS:
        allowed = suggesting(draws, DESIGNS, ", ".join(DESIGNS))
        where = "--draws"
        raise EnsembleError(where, f"there is no {draws!r}", allowed)
    found = choose_across(scenarios, {**choices, "engine": engine})
    studies = tuple(_drawing(study, draws) for study in found)
    plan = Plan(
        scenarios=tuple(
            Planned(
                study.scenario.name,
                study.scenario.title,
                study.step_s,
                study.seeds[0],
                len(study.seeds),
                {spec.name: origin_of(study.scenario, spec, study.step_s) for spec in study.specs},
            )
            for study in studies
        ),
        controllers=tuple(spec.name for spec in studies[0].specs),
        knows_future=tuple(sorted(foretold(studies[0].specs))),
        engine=engine,
        trajectories=trajectories,
        until=str(wanted) if wanted else None,
        draws=draws,
    )
    return Ensemble(studies, plan, part)
