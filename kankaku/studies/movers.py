"""Which engine moves the trains of a run, and what writes its files."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeAlias

from kankaku.controllers import registry
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.plan.world import World
from kankaku.railway.step.engine_ways import WITNESS
from kankaku.studies.outcomes import refuse_unknown_engine
from kankaku.sumo_net.build import SumoFiles, build, build_native, build_witness
from kankaku.sumo_net.engine import SumoEngine
from kankaku.sumo_net.native import NativeEngine
from kankaku.sumo_net.witness_engine import WitnessEngine

OnSumo: TypeAlias = NativeEngine | WitnessEngine | SumoEngine


class Mover(NamedTuple):
    """What moves the trains of a run, and what writes its files."""

    write: Callable[[Scenario, World, FloatArray, Path], SumoFiles]
    engine: type[OnSumo]


def mover_of(scenario: Scenario, spec: ControllerSpec, engine: str, *, gui: bool = False) -> Mover:
    """
    Return what moves the trains of a run.

    Parameters
    ----------
    scenario
        Whose trains they are.
    spec
        The controller; a peer drives its trains itself, whatever the engine.
    engine
        How SUMO takes part, one of :data:`~kankaku.railway.step.engine_ways.ENGINES`.

    Returns
    -------
    Mover
        The engine, and the function that writes what it reads.

    Raises
    ------
    StudyError
        If there is no such engine.
    """
    refuse_unknown_engine(engine)
    if spec.peer:
        moving_block = registry.PEERS[spec.peer].moving_block
        return Mover(partial(build_native, moving_block=moving_block), NativeEngine)
    # On a network SUMO would keep no stop of a train that takes over the stock of another one.
    if engine == WITNESS or scenario.line.network:
        return Mover(build_witness, WitnessEngine)
    return Mover(partial(build, signals=gui), SumoEngine)
