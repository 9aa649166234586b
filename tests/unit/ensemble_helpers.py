"""Ensembles without SUMO: ways to make their runs that worker processes can read."""

import os
import signal
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.step.engine_ways import EVERY_STEP, WITNESS
from kankaku.railway.step.records import RunRecord
from kankaku.studies.ensemble import choose_ensemble
from kankaku.studies.ensemble_findings import Drawing
from kankaku.studies.ensemble_running import Crew, EnsembleResult, own_processes, run_ensemble
from kankaku.studies.ensemble_runs import MakeRecord
from kankaku.studies.study import world_of
from tools.plain_runs import run_plain

MORE = 1e-3
"""Share of energy that a witness takes too much. [-]"""
TABLES_ALONE = Drawing(formats=())


def on_plain(
    scenario: Scenario,
    spec: ControllerSpec,
    seed: int,
    step_s: float,
    engine: str,
    progress: Callable[[float], None],
) -> RunRecord:
    """Run one controller without SUMO; where that would only watch, it takes a bit more energy."""
    world = world_of(scenario, step_s).driven_as(spec.driving)
    delays_s = scenario.dwell_delays.draw(scenario.timetable, seed)
    record = run_plain(scenario, world, spec, delays_s, seed, progress)
    if engine != WITNESS:
        return record
    more = record.energy.consumed_j * (1.0 + MORE)
    return replace(record, energy=record.energy._replace(consumed_j=more))


@dataclass(frozen=True)
class Dying:
    """Kills its process in one run, but only once."""

    mark: Path
    seed: int

    def __call__(
        self,
        scenario: Scenario,
        spec: ControllerSpec,
        seed: int,
        step_s: float,
        engine: str,
        progress: Callable[[float], None],
    ) -> RunRecord:
        """Run one controller without SUMO."""
        if seed == self.seed and not self.mark.exists():
            self.mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return on_plain(scenario, spec, seed, step_s, engine, progress)


def run_some(
    scenario: Path,
    out: Path,
    *,
    run: MakeRecord = on_plain,
    crew: Crew = own_processes,
    drawing: Drawing = TABLES_ALONE,
    wanted: dict[str, Any] | None = None,
    **choices: object,
) -> EnsembleResult:
    """Run a small ensemble, by default of three seeds and without figures."""
    ensemble = choose_ensemble(
        [scenario], {"seeds": 3, **choices}, **{"engine": EVERY_STEP, **(wanted or {})}
    )
    return run_ensemble(ensemble, out, drawing, run=run, crew=crew)
