"""
What lost telegrams cost: ``make losses``.

Runs the rush hour under the control map and under the moving block by radio while the radio
loses more and more telegrams, independently of each other, and counts what it does to delay and how
often a moving train brakes in emergency because its commands have run out.
"""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from kankaku.analysis.figures.loss_diagram import loss_figure
from kankaku.analysis.figures.style import write_figure
from kankaku.analysis.tables.run_tables import run_tables
from kankaku.analysis.tables.summary import summary_frame
from kankaku.railway.step.state import Reason
from kankaku.scenarios.loading.load import load
from kankaku.studies import study
from kankaku.workers import performed

PROJECT = Path(__file__).parents[1]
SCENARIO = PROJECT / "scenarios" / "rush_hour"
CONTROLLERS = ("close_up_radio", "control_map")
LOSSES_PERCENT = (0.0, 1.0, 2.0, 5.0, 10.0, 15.0, 20.0)
SEEDS = 3
JOBS = 2


class LossTask(NamedTuple):
    """One run."""

    controller: str
    loss_percent: float
    seed: int


def emergency_brakings(trajectory: pd.DataFrame) -> int:
    """
    Count how often moving trains began to brake in emergency.

    Parameters
    ----------
    trajectory
        The table ``trajectory`` of a run.

    Returns
    -------
    int
        A train that stands without commands does not count. [-]
    """
    braking = trajectory["reason"] == Reason.EMERGENCY.name.lower()
    before = braking.groupby(trajectory["train"], sort=False).shift(fill_value=False)
    return int((braking & ~before & (trajectory["speed_mps"] > 0.0)).sum())


def perform(task: LossTask, _progress: Callable[[float], None]) -> dict[str, object]:
    """
    Run the rush hour once.

    Parameters
    ----------
    task
        Controller, loss and seed.

    Returns
    -------
    dict[str, object]
        A row of ``losses.csv``.
    """
    scenario = load(SCENARIO)
    radio = replace(scenario.radio, loss_ratio=task.loss_percent / 100.0, burst_factor=1.0)
    spec = next(spec for spec in scenario.controllers if spec.name == task.controller)
    record = study.run_once(replace(scenario, radio=radio), spec, task.seed, scenario.step_s)
    tables = run_tables(record)
    indicators = summary_frame([tables]).iloc[0]
    return {
        **task._asdict(),
        "mean_arrival_delay_s": indicators["mean_arrival_delay_s"],
        "interstation_stop_time_s": indicators["interstation_stop_time_s"],
        "emergency_brakings": emergency_brakings(tables.trajectory),
        "trains_completed": indicators["trains_completed"],
        "violations": indicators["violations"],
    }


def main() -> None:
    """Run, print the means, and write ``out/losses/``: ``losses.csv`` and the figure."""
    first = load(SCENARIO).seed
    tasks = [
        LossTask(name, loss_percent, seed)
        for name in CONTROLLERS
        for loss_percent in LOSSES_PERCENT
        for seed in range(first, first + SEEDS)
    ]
    out = PROJECT / "out" / "losses"
    out.mkdir(parents=True, exist_ok=True)
    rows = [done.value() for done in performed(perform, tasks, JOBS)]
    losses = pd.DataFrame(rows).sort_values(list(LossTask._fields), ignore_index=True)
    losses.round(3).to_csv(out / "losses.csv", index=False)
    write_figure(loss_figure(losses), out / "losses")
    means = losses.drop(columns="seed").groupby(["controller", "loss_percent"]).mean()
    sys.stdout.write(means.round(2).to_string() + "\n")


if __name__ == "__main__":
    main()
