"""A run from its beginning to its end."""

from collections.abc import Callable, Sequence

from kankaku.railway.failures.unit_failures import Units
from kankaku.railway.loop.garbage import seldom_collected
from kankaku.railway.loop.stepped_run import SteppedRun
from kankaku.railway.plan.run import Run
from kankaku.railway.step.control import Controller
from kankaku.railway.step.engine_contract import Engine
from kankaku.railway.step.records import RunRecord
from kankaku.railway.step.step_block import Meter


def simulate(
    run: Run,
    engine: Engine,
    controller: Controller,
    meters: Sequence[Meter],
    *,
    units: Units | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> RunRecord:
    """
    Run every train to the end of its service under one controller.

    Parameters
    ----------
    run
        What happens whoever controls the trains.
    engine
        What moves the trains; it knows the dwell delays, controllers do not.
    controller
        Protection, operation and drive, with supervision where there is one.
    meters
        What measures the run; the monitor of safety is always there.
    units
        What units measure where they may be wrong. Only with them, even if nothing is wrong, does a
        protection see what units measure; otherwise it sees what is.
    progress
        Called with the simulated time now and then. [s]

    Returns
    -------
    RunRecord
        Everything that happened, safety violations included. If the engine or a controller
        fails after a violation, the record ends there and says so.

    Raises
    ------
    Exception
        What the engine or a controller raises while no safety invariant was violated.
    """
    loop = SteppedRun(run, engine, controller, meters, units)
    try:
        with seldom_collected():
            loop.go(progress=progress)
    finally:
        progress(loop.now_s)
    return loop.record()
