"""
How many decisions a second an environment takes, on one core and without SUMO.

``python -m tools.agent_rate`` prints a table. An agent step is one action of one train that was an
agent; most trains of a timetable are not on the line at any one time, so those that are stand
beside it.
"""

import sys
import time
from typing import NamedTuple

import numpy as np

import kankaku

CASES = (
    ("branch", 0.1, 10.0),
    ("branch", 0.5, 10.0),
    ("rush_hour", 0.1, 10.0),
    ("rush_hour", 0.5, 10.0),
    ("rush_hour", 0.5, 30.0),
    ("terminal", 0.5, 10.0),
)
"""Scenario, step and interval. [s], [s]"""


class Rate(NamedTuple):
    """What an episode came to."""

    decisions: int
    agent_steps: int
    present: int
    took_s: float


def episode(scenario: str, step_s: float, interval_s: float, *, wild: bool) -> Rate:
    """
    Play two episodes, and measure the second one.

    Parameters
    ----------
    scenario
        Its name.
    step_s, interval_s
        Length of a step, and from one decision to the next. [s]
    wild
        Actions are drawn at random for each decision; else nothing is asked for.

    Returns
    -------
    Rate
        Without the reset.
    """
    trains = kankaku.parallel_env(scenario, step_s=step_s, interval_s=interval_s)
    rng, took_s = np.random.default_rng(1), 0.0
    for seed in (0, 1):
        trains.reset(seed=seed)
        decisions = agent_steps = present = 0
        took_s = 0.0
        while trains.agents:
            actions = {
                agent: trains.action_space(agent).high * (rng.random(2) if wild else (1.0, 0.0))
                for agent in trains.agents
            }
            decisions, agent_steps = decisions + 1, agent_steps + len(actions)
            present += int(trains.link.simulation.state.present.sum())
            began = time.perf_counter()
            trains.step(actions)
            took_s += time.perf_counter() - began
    return Rate(decisions, agent_steps, present, took_s)


def main() -> None:
    """Print the table."""
    head = ("scenario", "step [s]", "interval [s]", "actions", "decisions/s", "agent steps/s")
    lines = [" | ".join((*head, "on line/s")), "|".join(["---"] * 7)]
    for scenario, step_s, interval_s in CASES:
        for wild in (False, True):
            rate = episode(scenario, step_s, interval_s, wild=wild)
            each = (rate.decisions, rate.agent_steps, rate.present)
            told = " | ".join(f"{count / rate.took_s:,.0f}" for count in each)
            kind = "random" if wild else "none"
            lines.append(f"{scenario} | {step_s:g} | {interval_s:g} | {kind} | {told}")
    sys.stdout.write("".join(f"| {line} |\n" for line in lines))


if __name__ == "__main__":
    main()
