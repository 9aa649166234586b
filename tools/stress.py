"""
Stochastic approach where it is told the wrong thing: ``make stress``.

Runs the rush hour under close-up running and under the stochastic approach while delays are not
distributed as the planner is told, or while the radio loses telegrams, and compares both morning by
morning. A stop that is planned for a leader that behaves otherwise may cost time; here is how much.
"""

import argparse
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from kankaku.analysis.tables.run_tables import run_tables
from kankaku.analysis.tables.summary import summary_frame
from kankaku.railway.plan.scenario import ControllerSpec, Option, Scenario
from kankaku.scenarios.loading.load import load
from kankaku.studies import study
from kankaku.workers import performed

PROJECT = Path(__file__).parents[1]
SCENARIO = PROJECT / "scenarios" / "rush_hour"
EARLIER_DAYS = range(1001, 1021)
"""Seeds of the days that a distribution is learned from; no result is told of them."""
LEVELS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)
JOBS = 2
KEPT = (
    "interstation_stop_time_s",
    "interstation_crawl_time_s",
    "mean_arrival_delay_s",
    "energy_net_kwh",
    "trains_completed",
    "violations",
)


class Trial(NamedTuple):
    """What is otherwise than the planner is told."""

    title: str
    scale: float = 1.0
    """Factor on all delays. [-]"""
    cap_s: float | None = None
    told: Mapping[str, Option] = {}
    """Options of the planner."""
    loss_ratio: float | None = None
    """Telegrams that a radio loses; None without a radio. [-]"""


class StressTask(NamedTuple):
    """One run."""

    trial: int
    operation: str
    seed: int
    step_s: float


def learned(scenario: Scenario) -> dict[str, Option]:
    """
    Return what twenty earlier days tell of dwell delays, all stations and trains together.

    Parameters
    ----------
    scenario
        The scenario.

    Returns
    -------
    dict[str, Option]
        Options of the stochastic approach; the factors of stations are known and taken off.
    """
    seen: list[float] = []
    for seed in EARLIER_DAYS:
        drawn_s = scenario.dwell_delays.draw(scenario.timetable, seed)
        for row, service in enumerate(scenario.timetable.services):
            seen += [
                float(drawn_s[row, column]) / call.delay_scale
                for column, call in enumerate(service.calls)
            ]
    quantiles = np.quantile(seen, LEVELS).round(1).tolist()
    return {"told_levels": LEVELS, "told_delays_s": tuple(quantiles)}


def trials(scenario: Scenario) -> tuple[Trial, ...]:
    """
    Return what is tried.

    Parameters
    ----------
    scenario
        The scenario as the planner knows it.

    Returns
    -------
    tuple[Trial, ...]
        The first one is the scenario itself.
    """
    told_cap = {"told_cap_s": scenario.dwell_delays.cap_s}
    return (
        Trial("as told"),
        Trial("delays up to 240 s", cap_s=240.0, told=told_cap),
        Trial("delays 2.5 times as long", 2.5, told={"told_scale": 0.4}),
        Trial("twice as long, up to 240 s", 2.0, 240.0, told={"told_scale": 0.5, **told_cap}),
        Trial("half as long", 0.5, told={"told_scale": 2.0}),
        Trial("learned from 20 earlier days", told=learned(scenario)),
        Trial("by radio, nothing lost", loss_ratio=0.0),
        Trial("by radio, 10 % of telegrams lost", loss_ratio=0.1),
    )


def perform(task: StressTask, _progress: Callable[[float], None]) -> dict[str, object]:
    """
    Run the rush hour once.

    Parameters
    ----------
    task
        Trial, operation and seed.

    Returns
    -------
    dict[str, object]
        Indicators of the run.
    """
    scenario = load(SCENARIO)
    trial = trials(scenario)[task.trial]
    delays = scenario.dwell_delays
    cap_s = delays.cap_s if trial.cap_s is None else trial.cap_s
    met = replace(delays, scale=delays.scale * trial.scale, cap_s=cap_s)
    radio = replace(scenario.radio, loss_ratio=trial.loss_ratio or 0.0, burst_factor=1.0)
    options = trial.told if task.operation == "stochastic_approach" else {}
    spec = ControllerSpec(
        task.operation,
        "moving_block",
        task.operation,
        {},
        options,
        radio=trial.loss_ratio is not None,
    )
    met_scenario = replace(scenario, dwell_delays=met, radio=radio)
    record = study.run_once(met_scenario, spec, task.seed, task.step_s)
    indicators = summary_frame([run_tables(record)]).iloc[0]
    return {**task._asdict(), **{name: indicators[name] for name in KEPT}}


def table_of(runs: pd.DataFrame, titles: Mapping[int, str]) -> list[str]:
    """
    Return the comparison as a table.

    Parameters
    ----------
    runs
        One row per run.
    titles
        Of the trials.

    Returns
    -------
    list[str]
        Lines of Markdown.
    """
    lines = [
        "| what is met | stop time | crawl | mean delay | worst morning | net energy | unsafe |",
        "|---|---|---|---|---|---|---|",
    ]
    for trial, of_it in runs.groupby("trial"):
        by_seed = of_it.pivot_table(index="seed", columns="operation", values=list(KEPT))
        mean = by_seed.mean()

        def change(name: str, mean: pd.Series = mean) -> float:
            return float(100.0 * (mean[name, "stochastic_approach"] / mean[name, "close_up"] - 1.0))

        delay = by_seed["mean_arrival_delay_s"]
        worst = 100.0 * (delay["stochastic_approach"] / delay["close_up"] - 1.0).max()
        lines.append(
            f"| {titles[int(str(trial))]} "
            f"| {mean['interstation_stop_time_s', 'close_up']:.0f} s, "
            f"{change('interstation_stop_time_s'):+.0f} % "
            f"| {change('interstation_crawl_time_s'):+.0f} % "
            f"| {mean['mean_arrival_delay_s', 'close_up']:.1f} s, "
            f"{change('mean_arrival_delay_s'):+.1f} % | {worst:+.1f} % "
            f"| {change('energy_net_kwh'):+.1f} % | {of_it['violations'].sum():.0f} |"
        )
    return lines


def main() -> None:
    """Run, print the table, and write ``out/stress/``: ``stress.csv`` and ``stress.md``."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=101, help="first seed")
    parser.add_argument("--seeds", type=int, default=10, help="how many")
    parser.add_argument("--step", type=float, default=0.5, help="in s")
    asked = parser.parse_args()
    every = trials(load(SCENARIO))
    tasks = [
        StressTask(trial, operation, seed, asked.step)
        for trial in range(len(every))
        for operation in ("close_up", "stochastic_approach")
        for seed in range(asked.first, asked.first + asked.seeds)
    ]
    out = PROJECT / "out" / "stress"
    out.mkdir(parents=True, exist_ok=True)
    runs = pd.DataFrame([done.value() for done in performed(perform, tasks, JOBS)])
    runs = runs.sort_values(list(StressTask._fields), ignore_index=True)
    runs.round(3).to_csv(out / "stress.csv", index=False)
    lines = table_of(runs, {number: trial.title for number, trial in enumerate(every)})
    (out / "stress.md").write_text("\n".join(lines) + "\n")
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
