"""One run of an ensemble, in whatever process: from a task to tables as files."""

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from kankaku.analysis.tables.parquet_bytes import parquet_bytes
from kankaku.analysis.tables.run_tables import RunTables, run_tables
from kankaku.analysis.tables.summary import summary_frame
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.step.records import RunRecord
from kankaku.store.dataset_store import DATASET, MAIN, ON_DEMAND, EnsembleTask, RunFiles
from kankaku.store.run_store import Origin, origin_of
from kankaku.studies.ensemble import Ensemble
from kankaku.studies.registered_layers import Registered
from kankaku.studies.study import run_once

_ALONE = threading.Lock()
"""A process holds one simulation at a time."""


class MakeRecord(Protocol):
    """Makes a record; one that can be imported, because it crosses processes."""

    def __call__(
        self,
        scenario: Scenario,
        spec: ControllerSpec,
        seed: int,
        step_s: float,
        engine: str,
        progress: Callable[[float], None],
    ) -> RunRecord:
        """Run one controller."""
        ...


def on_sumo(
    scenario: Scenario,
    spec: ControllerSpec,
    seed: int,
    step_s: float,
    engine: str,
    progress: Callable[[float], None],
) -> RunRecord:
    """Run one controller on SUMO; see :func:`kankaku.studies.study.run_once`."""
    return run_once(scenario, spec, seed, step_s, engine=engine, progress=progress)


@dataclass(frozen=True)
class EnsembleRuns:
    """Performs the runs of an ensemble; read once in each process, and kept there."""

    ensemble: Ensemble
    layers: Registered
    run: MakeRecord = on_sumo
    origins: dict[tuple[str, str, str], Origin] = field(default_factory=dict)
    """What runs are made from in this process, by scenario, controller and engine; asked once."""

    def __call__(self, task: EnsembleTask, progress: Callable[[float], None]) -> RunFiles:
        """
        Perform a run.

        Parameters
        ----------
        task
            Which one.
        progress
            Called with the simulated time now and then. [s]

        Returns
        -------
        RunFiles
            Its tables.
        """
        with _ALONE:
            self.layers.restore()
            started = time.perf_counter()
            study, spec = self.ensemble.study_of(task)
            record = self.run(study.scenario, spec, task.seed, study.step_s, task.engine, progress)
            tables = run_tables(record)
            told = {
                **self._origin_of(task),
                "name": spec.name,
                "seed": task.seed,
                "engine": task.engine,
            }
            files = _files(tables, told, record.failure, trajectory=self.ensemble.plan.trajectories)
            return RunFiles(files, time.perf_counter() - started, record.train_steps)

    def _origin_of(self, task: EnsembleTask) -> Origin:
        # Asked here, where the run was made: whoever edits the program meanwhile changes it.
        key = task.scenario, task.controller, task.engine
        if key not in self.origins:
            study, spec = self.ensemble.study_of(task)
            self.origins[key] = origin_of(study.scenario, spec, study.step_s, task.engine)
        return self.origins[key]


def _files(
    tables: RunTables, told: Mapping[str, Any], failure: str, *, trajectory: bool
) -> dict[str, bytes]:
    frames = {"calls": tables.calls, "stops": tables.interstation_stops}
    if trajectory:
        frames[ON_DEMAND] = tables.trajectory
    files = {name: parquet_bytes(frame, DATASET[name], told) for name, frame in frames.items()}
    note = {
        **told,
        "failure": failure,
        "violations": list(tables.violations["message"]),
        "unfinished": list(tables.unfinished["message"]),
        "files": {name: len(content) for name, content in files.items()},
    }
    return {**files, MAIN: parquet_bytes(summary_frame([tables]), DATASET[MAIN], note)}
