"""A results folder to be asked: a queue of six trains under three controllers."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from kankaku.analysis.publish.study_publishing import publish
from kankaku.analysis.results import run_folder
from kankaku.analysis.tables.run_tables import RunTables, run_tables, write_run
from kankaku.railway.plan.scenario import Scenario
from kankaku.testing.example_lines import two_station_scenario
from tests.property.runs import run

TRAINS = 6
OVERSTAY_S = 150.0
OPERATIONS = ("close_up", "two_stage", "eco")


def queue_scenario() -> Scenario:
    """Return a line of two stations on which trains follow each other every minute."""
    line = two_station_scenario(TRAINS, 60.0, spacing_m=2000.0, run_s=110.0, block_m=200.0)
    return replace(line, title="Queue", name="queue")


@cache
def queue_runs(operations: tuple[str, ...] = OPERATIONS) -> tuple[RunTables, ...]:
    """Return runs in which the first train overstays at the second station."""
    drawn_s = np.zeros((TRAINS, 2))
    drawn_s[0, 1] = OVERSTAY_S
    runs = []
    for name in operations:
        record, _ = run(queue_scenario(), name, delay_s=drawn_s)
        runs.append(run_tables(replace(record, controller=name)))
    return tuple(runs)


def write_queue(folder: Path, operations: tuple[str, ...] = OPERATIONS) -> Path:
    """Write the runs as a results folder without figures."""
    runs = queue_runs(operations)
    for one in runs:
        write_run(one, run_folder(folder, one.controller, one.seed, seeds=1))
    publish(folder, queue_scenario(), runs, {"scenario": "queue"}, formats=())
    return folder
