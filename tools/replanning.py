"""How long the centre of the control map takes to plan for a line full of trains."""

from time import perf_counter
from typing import Any

import numpy as np

from kankaku.controllers.centre.reports import Reports, no_reports
from kankaku.controllers.registry import build
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.world import World
from kankaku.railway.step.obstructions import unobstructed
from kankaku.railway.step.state import NOTHING, Events, LineState
from kankaku.studies import study

CONTROLLER = "control_map"
ROUNDS = 400
SPEED_MPS = 10.0
OUTSIDE_M = 500.0
"""The first train is so far before the end of the line, and the last one from its start. [m]"""


def replanning_ms(scenario: Scenario) -> dict[str, float]:
    """
    Return how long a map takes on which all trains of a scenario are at once, evenly spaced.

    Every train runs, each but the first behind another one that it catches up with.

    Parameters
    ----------
    scenario
        One with a controller named ``control_map``.

    Returns
    -------
    dict[str, float]
        Median, 99th percentile and greatest time. [ms]
    """
    spec = next(spec for spec in scenario.controllers if spec.name == CONTROLLER)
    world = study.world_of(scenario, scenario.step_s)
    protection: Any = build(spec, world, scenario.radio).protection
    random = np.random.default_rng(scenario.seed)
    plan = protection.initial().plan
    spent_ms = []
    for _ in range(ROUNDS):
        state = crowded(world, random.uniform(-0.5, 0.5, world.size))
        reports = _reports(state, no_reports(world, scenario.radio))
        started = perf_counter()
        plan = protection.plan(state, reports, plan)
        spent_ms.append(1000.0 * (perf_counter() - started))
    # The first one may have to be compiled.
    median, late, most = np.percentile(spent_ms[1:], [50.0, 99.0, 100.0])
    return {
        "median": round(float(median), 3),
        "p99": round(float(late), 3),
        "greatest": round(float(most), 3),
    }


def crowded(world: World, jitter: FloatArray) -> LineState:
    """
    Return a line with all its trains at once.

    Parameters
    ----------
    world
        The trains.
    jitter
        By how much each is off its place, as a share of their distance. [-], shape (n_trains,)

    Returns
    -------
    LineState
        They run at 10 m/s.
    """
    line, rows = world.line, np.arange(world.size)
    ends_m = line.end_m - OUTSIDE_M, line.start_m + OUTSIDE_M
    spacing_m = (ends_m[0] - ends_m[1]) / world.size
    room_m = spacing_m - world.length_m.max()
    front_m = ends_m[0] - spacing_m * rows + room_m * jitter
    everybody = np.ones(world.size, dtype=np.bool_)
    call = np.argmax(world.stop_m > front_m[:, np.newaxis], axis=1)
    return LineState(
        time_s=float(world.booked_arrival_s[:, 0].max()),
        front_m=front_m,
        tail_m=front_m - world.length_m,
        speed_mps=np.full(world.size, SPEED_MPS),
        present=everybody,
        running=everybody,
        leader=rows - 1,
        follows=rows > 0,
        clear_to_m=np.append(world.far_m, (front_m - world.length_m)[:-1]),
        granted_to_m=np.full(world.size, world.far_m),
        granted_by=np.full(world.size, NOTHING),
        next_call=call,
        stop_m=world.stop_m[rows, call],
        arrival_s=np.full(world.size, np.nan),
        events=Events(),
        wayside=unobstructed(world.size, world.far_m),
        calls_version=0,
        wayside_version=0,
    )


def _reports(state: LineState, before: Reports) -> Reports:
    return before._replace(
        known_s=np.full(state.front_m.size, state.time_s - 1.0),
        front_m=state.front_m,
        speed_mps=state.speed_mps,
        call=state.next_call,
    )
