"""Trials of whoever is checked: runs on small lines, where everything is asked twice."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.errors import sentence_of
from kankaku.railway.loop.simulate import simulate
from kankaku.railway.meters.all_meters import all_meters
from kankaku.railway.plan.run import Run
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Controller
from kankaku.railway.step.records import RunRecord
from kankaku.testing.alike import frozen, same
from kankaku.testing.asked_twice import AskedTwice
from kankaku.testing.example_lines import merge_scenario, two_station_scenario, world_of
from kankaku.testing.loop_station import loop_station_scenario
from kankaku.testing.toy_engine import ToyEngine

Candidate: TypeAlias = Callable[[World], Controller]
"""Builds the controller that is checked for a world."""
OVERSTAYS_S = (70.0, 40.0)
"""By how much the first trains overstay at their second call. [s]"""
WORLD = "world is left alone"
LINES: Mapping[str, Callable[[], Scenario]] = {
    "one track": lambda: two_station_scenario(4, 70.0, block_m=250.0),
    "merge": lambda: merge_scenario(4, 60.0, block_m=200.0),
    "loop station": lambda: loop_station_scenario(4, 70.0, one_starts_inside=True, block_m=250.0),
}
"""Where controllers are tried."""


@dataclass(frozen=True, slots=True)
class Trial:
    """A run of a candidate on one of the lines."""

    scenario: Scenario
    world: World
    controller: Controller
    asked: AskedTwice
    record: RunRecord | None
    error: str = ""


def overstays(scenario: Scenario, *seconds: float) -> FloatArray:
    """
    Return dwell delays of the first trains at their second call.

    Parameters
    ----------
    scenario
        What is run.
    seconds
        A delay for each of them. [s]

    Returns
    -------
    FloatArray
        Zero elsewhere. [s], shape (n_trains, n_calls_max)
    """
    services = scenario.timetable.services
    delay_s = np.zeros((len(services), max(len(service.calls) for service in services)))
    delay_s[: len(seconds), 1] = seconds
    return delay_s


def trial_of(scenario: Scenario, candidate: Candidate, delay_s: FloatArray) -> Trial:
    """
    Run a candidate that is asked everything twice.

    Parameters
    ----------
    scenario
        What to run.
    candidate
        Who is checked.
    delay_s
        Dwell delays. [s], shape (n_trains, n_calls_max)

    Returns
    -------
    Trial
        With what went wrong, where it could not be run to its end.
    """
    world = world_of(scenario)
    before = frozen(world)
    controller = candidate(world)
    asked = AskedTwice(controller, len(scenario.line.turnouts))
    record, error = None, ""
    try:
        supervision = asked if controller.supervision else None
        layers = replace(controller, protection=asked, operation=asked, supervision=supervision)
        run = Run(world, delay_s, scenario.seed, scenario.patience_s)
        engine = ToyEngine(world, delay_s, scenario.step_s)
        record = simulate(run, engine, layers, all_meters(world))
        asked.ask_again(candidate(world))
    except Exception as failed:  # noqa: BLE001 - whatever a stranger's controller does
        error = sentence_of(failed)
    if not same(before, world):
        asked.problems[WORLD] = "a layer writes into the world"
    return Trial(scenario, world, controller, asked, record, error)


def trial_on(line: str, candidate: Candidate) -> Trial:
    """
    Run a candidate on one of the lines, with the first trains late.

    Parameters
    ----------
    line
        Name in :data:`LINES`.
    candidate
        Builds a controller for a world.

    Returns
    -------
    Trial
        As :func:`trial_of`.
    """
    scenario = LINES[line]()
    return trial_of(scenario, candidate, overstays(scenario, *OVERSTAYS_S))


def trials_of(candidate: Candidate) -> dict[str, Trial]:
    """
    Run a candidate on every line.

    Parameters
    ----------
    candidate
        Builds a controller for a world.

    Returns
    -------
    dict[str, Trial]
        By the names of :data:`LINES`.
    """
    return {line: trial_on(line, candidate) for line in LINES}
