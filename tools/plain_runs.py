"""Runs without SUMO, for studies that need many of them."""

from collections.abc import Callable

from kankaku.controllers import registry
from kankaku.railway.arrays import FloatArray
from kankaku.railway.loop.plain_engine import PlainEngine
from kankaku.railway.loop.simulate import simulate
from kankaku.railway.meters.all_meters import all_meters
from kankaku.railway.plan.run import Run
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.plan.world import World
from kankaku.railway.step.records import RunRecord


def run_plain(
    scenario: Scenario,
    world: World,
    spec: ControllerSpec,
    delays_s: FloatArray,
    seed: int = 0,
    progress: Callable[[float], None] = lambda _: None,
) -> RunRecord:
    """
    Run one controller with an engine that moves trains exactly as commanded.

    Parameters
    ----------
    scenario
        Patience, disruptions and radio.
    world
        Line, fleet and timetable, in the driving style of the controller.
    spec
        The controller.
    delays_s
        Dwell delay of every call. [s], shape (n_trains, n_calls_max)
    seed
        Of these delays.
    progress
        Called with the simulated time now and then. [s]

    Returns
    -------
    RunRecord
        Everything that happened.
    """
    run = Run(world, delays_s, seed, scenario.patience_s, scenario.disruptions, scenario.radio)
    return simulate(
        run,
        PlainEngine(world, delays_s, world.step_s),
        registry.build(spec, world, scenario.radio, delays_s),
        all_meters(world),
        progress=progress,
    )
