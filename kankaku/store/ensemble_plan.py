"""Which runs an ensemble has, as a file in its results folder that its parts have in common."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from math import ceil
from pathlib import Path
from typing import Any

import pandas as pd

from kankaku.analysis.tables.ensemble_tables import Precision, precision_of
from kankaku.railway.errors import KankakuError
from kankaku.railway.plan.design_names import INDEPENDENT, REPLICATE_SIZES
from kankaku.railway.plan.seed_design import SeedDesign, seed_design
from kankaku.railway.step.engine_ways import EVERY_STEP
from kankaku.store.dataset_store import EnsembleTask, Saved
from kankaku.store.run_store import Origin

PLAN = "plan.json"
LOOK_EVERY = 10
"""Seeds of a batch, after which a study that stops by itself looks whether it may. [-]"""
FIRST_LOOK = 2
"""Batches before the first look: of a few runs the spread is too uncertain. [-]"""
LEAST_REPLICATES = 5
"""Replicates of a batch at least, where seeds come in replicates. [-]"""


class EnsembleError(KankakuError):
    """What of an ensemble cannot be run, or put together."""


@dataclass(frozen=True)
class Planned:
    """A scenario of an ensemble."""

    name: str
    title: str
    step_s: float
    first_seed: int
    seeds: int
    origins: Mapping[str, Origin]
    """What its runs are made from, by controller, with the engine of the plan."""


@dataclass(frozen=True)
class Plan:
    """What the whole study is, whoever runs which part of it."""

    scenarios: tuple[Planned, ...]
    controllers: tuple[str, ...]
    """Baseline first."""
    knows_future: tuple[str, ...]
    engine: str
    trajectories: bool
    until: str | None
    draws: str = INDEPENDENT
    """One of :data:`~kankaku.railway.plan.design_names.DESIGNS`."""

    def __post_init__(self) -> None:
        size = REPLICATE_SIZES[self.draws]
        if self.seeds % size:
            where = "--seeds"
            problem = f"{self.seeds} seeds are no whole replicates of {size} ({self.draws})"
            raise EnsembleError(where, problem, f"a multiple of {size}")

    @property
    def seeds(self) -> int:
        """How many seeds each scenario has at most."""
        return self.scenarios[0].seeds

    @cached_property
    def precision(self) -> Precision | None:
        """The precision at which it stops by itself; None if it does not."""
        return precision_of(self.until) if self.until else None

    @property
    def batches(self) -> list[range]:
        """Numbers of the seeds that are run before somebody looks."""
        size = REPLICATE_SIZES[self.draws]
        # Nobody looks while a replicate is not whole, or at the spread of a few replicates.
        every = LOOK_EVERY if size == 1 else size * max(LEAST_REPLICATES, ceil(LOOK_EVERY / size))
        every = every if self.until else self.seeds
        return [
            range(first, min(first + every, self.seeds)) for first in range(0, self.seeds, every)
        ]

    @cached_property
    def designs(self) -> dict[str, SeedDesign]:
        """How the seeds of each scenario share their draws, from its first seed on."""
        return {one.name: seed_design(self.draws, one.first_seed) for one in self.scenarios}

    def tasks(self, numbers: Sequence[int]) -> list[EnsembleTask]:
        """
        Return runs, seed by seed.

        Parameters
        ----------
        numbers
            Which seeds, counted from 0 on.

        Returns
        -------
        list[EnsembleTask]
            Of every scenario and controller. Where SUMO is no more than a witness, the first seed
            is run in the other way, too.
        """
        return [
            EnsembleTask(scenario.name, controller, scenario.first_seed + number, engine)
            for number in numbers
            for scenario in self.scenarios
            for controller in self.controllers
            for engine in self._engines(number)
        ]

    def _engines(self, number: int) -> tuple[str, ...]:
        compared = self.engine != EVERY_STEP and number == 0
        return (self.engine, EVERY_STEP) if compared else (self.engine,)

    def origin_of(self, task: EnsembleTask) -> Origin:
        """
        Return what a run is made from.

        Parameters
        ----------
        task
            A run of the plan.

        Returns
        -------
        Origin
            As of its controller.
        """
        scenario = next(one for one in self.scenarios if one.name == task.scenario)
        return {**scenario.origins[task.controller], "engine": task.engine}

    def seeds_used(self, summary: pd.DataFrame) -> int:
        """
        Return how many seeds count: all, or those before the study stops by itself.

        Parameters
        ----------
        summary
            The table ``summary`` of the finished runs, with a column ``scenario``.

        Returns
        -------
        int
            Counted from the first seed on.
        """
        for batch in self.batches[FIRST_LOOK - 1 :]:
            if self.precise(summary, batch.stop):
                return batch.stop
        return self.seeds

    def precise(self, summary: pd.DataFrame, seeds: int) -> bool:
        """
        Return whether every mean is known as precisely as wanted.

        Parameters
        ----------
        summary
            As of :meth:`seeds_used`.
        seeds
            How many of them are looked at.

        Returns
        -------
        bool
            Never, if nothing is wanted.
        """
        halves = self.halves(summary, seeds)
        return bool(halves) and all(
            half <= self.precision.width for half in halves.values() if self.precision
        )

    def halves(self, summary: pd.DataFrame, seeds: int) -> dict[tuple[str, str], float]:
        """
        Return how precisely the means are known.

        Parameters
        ----------
        summary
            As of :meth:`seeds_used`.
        seeds
            How many of them are looked at.

        Returns
        -------
        dict[tuple[str, str], float]
            Half of the 95 % interval by scenario and controller, as the precision counts it; none
            if no precision is wanted.
        """
        if self.precision is None:
            return {}
        found: dict[tuple[str, str], float] = {}
        for scenario in self.scenarios:
            own = summary[summary["scenario"] == scenario.name]
            own = own[own["seed"] < scenario.first_seed + seeds]
            for controller in self.controllers:
                runs = own[own["controller"] == controller]
                means = self.designs[scenario.name].replicate_means(
                    runs[self.precision.indicator].to_numpy(float), runs["seed"].to_numpy()
                )
                found[scenario.name, controller] = self.precision.half(means)
        return found

    def differences(self, other: "Plan") -> list[str]:
        """
        Return in what another plan is not the same.

        Parameters
        ----------
        other
            The other one.

        Returns
        -------
        list[str]
            Words for a reader.
        """
        words = [
            word
            for word in ("controllers", "engine", "trajectories", "until", "draws")
            if getattr(self, word) != getattr(other, word)
        ]
        if [one.name for one in self.scenarios] != [one.name for one in other.scenarios]:
            return [*words, "scenarios"]
        for one, two in zip(self.scenarios, other.scenarios, strict=True):
            if (one.first_seed, one.seeds) != (two.first_seed, two.seeds):
                words.append("seeds")
            for name in {*one.origins} & {*two.origins}:
                task = EnsembleTask(one.name, name, one.first_seed, self.engine)
                words += Saved(task, one.origins[name]).differences(two.origins[name])
        return list(dict.fromkeys(words))

    def told(self) -> dict[str, Any]:
        """Return the plan as plain data for JSON."""
        told: dict[str, Any] = json.loads(json.dumps(asdict(self)))
        if self.draws == INDEPENDENT:
            # As in plans that were written before there was a choice.
            del told["draws"]
        return told


def read_plan(folder: Path) -> Plan:
    """
    Read which runs an ensemble has.

    Parameters
    ----------
    folder
        Its results folder.

    Returns
    -------
    Plan
        The plan.

    Raises
    ------
    EnsembleError
        If there is none.
    """
    try:
        told = json.loads((folder / PLAN).read_text("utf-8"))
        scenarios = tuple(Planned(**scenario) for scenario in told.pop("scenarios"))
        controllers, foretold = tuple(told.pop("controllers")), tuple(told.pop("knows_future"))
        return Plan(scenarios=scenarios, controllers=controllers, knows_future=foretold, **told)
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        allowed = "a folder that kankaku study has written"
        raise EnsembleError(str(folder), f"holds no {PLAN} of a study", allowed) from error
