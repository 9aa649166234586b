"""Runs of one point: both controllers with the same delays, without SUMO."""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

from kankaku.analysis.tables.run_tables import run_tables
from kankaku.analysis.tables.summary import summary_frame
from kankaku.railway.plan.scenario import Scenario
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.shipped import folder_of
from kankaku.store.fingerprint import content_sha256, sources_sha256
from kankaku.studies.study import world_of
from tools.plain_runs import run_plain
from tools.sensitivity.assumptions import changed
from tools.sensitivity.journal import Measured

STEP_S = 0.5
ROOMS = ("analysis.tables", "controllers", "railway")
"""What decides what a run finds, once its scenario is loaded."""
MEASURED = (
    "interstation_stop_time_s",
    "mean_arrival_delay_s",
    "energy_net_kwh",
    "trains",
    "trains_completed",
    "violations",
)
"""Columns of the table ``summary`` that are kept."""


class Task(NamedTuple):
    """A place in the ranges of all assumptions, and a seed."""

    places: tuple[float, ...]
    """From 0 to 1, one per assumption; none for the centre."""
    seed: int


@cache
def centre() -> Scenario:
    """Return the rush hour as its files say."""
    return load(folder_of("rush_hour"))


def keys(tasks: list[Task]) -> dict[Task, str]:
    """
    Return what the result of each task depends on.

    Parameters
    ----------
    tasks
        The tasks.

    Returns
    -------
    dict[Task, str]
        Digests of the scenario as the task has it, the step, the seed and the program.
    """
    scenarios = {task.places: "" for task in tasks}
    for places in scenarios:
        scenarios[places] = content_sha256(changed(centre(), places))
    program = sources_sha256(ROOMS, ())
    return {
        task: content_sha256((scenarios[task.places], STEP_S, task.seed, program)) for task in tasks
    }


def perform(task: Task, progress: Callable[[float], None]) -> Measured:
    """
    Run both controllers.

    Parameters
    ----------
    task
        Where, and the seed of the dwell delays.
    progress
        Called with the simulated time now and then. [s]

    Returns
    -------
    Measured
        ``MEASURED`` of each controller.
    """
    return measured(changed(centre(), task.places), task.seed, progress)


def measured(
    scenario: Scenario, seed: int, progress: Callable[[float], None] = lambda _: None
) -> Measured:
    """
    Run every controller of a scenario on the same delays.

    Parameters
    ----------
    scenario
        The scenario.
    seed
        Seed of the dwell delays.
    progress
        Called with the simulated time now and then. [s]

    Returns
    -------
    Measured
        ``MEASURED`` of each controller.
    """
    world = world_of(scenario, STEP_S)
    delays_s = scenario.dwell_delays.draw(scenario.timetable, seed)
    found = {}
    for spec in scenario.controllers:
        own = world.driven_as(spec.driving)
        record = run_plain(scenario, own, spec, delays_s, seed, progress)
        row = summary_frame([run_tables(record)]).iloc[0]
        found[spec.name] = {name: float(row[name]) for name in MEASURED}
    return found
