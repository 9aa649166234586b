"""How a run is opened: world, controller, engine and what happens, the same for whoever runs it."""

import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Lock
from typing import Any, cast

from kankaku.controllers import registry
from kankaku.railway.arrays import FloatArray
from kankaku.railway.failures.unit_failures import UnitFailure, Units, failing
from kankaku.railway.loop.plain_engine import PlainEngine
from kankaku.railway.motion.feasibility import assess
from kankaku.railway.places import temporary_folder
from kankaku.railway.plan.run import Run
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.plan.world import World, build_world
from kankaku.railway.step.control import Controller, Foresight
from kankaku.railway.step.engine_contract import Engine
from kankaku.railway.step.engine_ways import EVERY_STEP
from kankaku.studies.movers import mover_of
from kankaku.studies.outcomes import StudyError

NO_SUMO = "none"
"""Trains are moved and stops are kept here, and SUMO takes no part: to train, not to study."""

_HELD = Lock()
"""While SUMO runs inside this process."""


def world_of(scenario: Scenario, step_s: float) -> World:
    """
    Return what the controllers of a scenario know.

    Parameters
    ----------
    scenario
        The scenario.
    step_s
        Length of a step. [s]

    Returns
    -------
    World
        Its arrays.
    """
    return build_world(
        scenario.line,
        scenario.train_types,
        scenario.timetable,
        step_s,
        scenario.driving,
        scenario.planned_delays or scenario.dwell_delays,
    )


def foresight_of(controller: Controller) -> Foresight:
    """
    Return what a controller's protection says beforehand.

    Parameters
    ----------
    controller
        Built, so that its operation plans with the same foresight.

    Returns
    -------
    Foresight
        Its protection.
    """
    return cast("Foresight", controller.protection)


@dataclass(frozen=True, slots=True)
class Opened:
    """A run that has not begun: what happens, who controls, and what moves the trains."""

    run: Run
    bare: Controller
    """As it was built."""
    controller: Controller
    """As it is run, wrapped."""
    engine: Engine
    units: Units | None


class Opening:
    """
    Opens runs of one controller in one scenario.

    Parameters
    ----------
    scenario
        Line, fleet, timetable and delays.
    spec
        Which controller.
    step_s
        Length of a step. [s]
    engine
        How SUMO takes part, one of :data:`~kankaku.railway.step.engine_ways.ENGINES`, or
        :data:`NO_SUMO`.
    gui
        Show runs in sumo-gui.

    Raises
    ------
    StudyError
        If a train cannot start, climb, hold or stop wherever its service takes it, or there is no
        such engine.
    """

    def __init__(
        self,
        scenario: Scenario,
        spec: ControllerSpec,
        step_s: float,
        *,
        engine: str = EVERY_STEP,
        gui: bool = False,
    ) -> None:
        weak = assess(scenario.line, scenario.train_types, scenario.timetable).shortfalls
        if weak:
            raise StudyError("; ".join(f"{item.leg.train_type}: {item}" for item in weak))
        self.scenario, self.spec, self._gui = scenario, spec, gui
        self.world = world_of(scenario, step_s).driven_as(spec.driving)
        self._mover = None
        if engine != NO_SUMO:
            self._mover = mover_of(scenario, spec, engine, gui=gui)
        elif spec.peer:
            raise StudyError(spec.name, "drives its trains itself, on SUMO", "an engine on SUMO")

    @contextmanager
    def opened(
        self,
        seed: int,
        *,
        wrap: Callable[[str, Any], Any] = lambda _, layer: layer,
        unit_failures: Sequence[UnitFailure] | None = None,
    ) -> Iterator[Opened]:
        """
        Open a run.

        Parameters
        ----------
        seed
            Seed of the dwell delays.
        wrap
            Called with "engine", "protection", "supervision", "operation" or "drive" and that
            layer; returns what stands in for it.
        unit_failures
            What units and the centre do wrong; with any, even none, a protection sees what units
            measure, otherwise what is.

        Yields
        ------
        Opened
            Afterwards its engine is closed.
        """
        scenario, world = self.scenario, self.world
        delays_s = scenario.dwell_delays.draw(scenario.timetable, seed)
        bare = registry.build(self.spec, world, scenario.radio, delays_s)
        units, run = (
            None,
            Run(
                *(world, delays_s, seed),
                scenario.patience_s,
                scenario.disruptions,
                scenario.radio,
            ),
        )
        if unit_failures is not None:
            run, units = failing(run, unit_failures)
        controller = wrapped(bare, wrap)
        with self._engine(delays_s) as engine:
            yield Opened(run, bare, controller, wrap("engine", engine), units)

    @contextmanager
    def _engine(self, delays_s: FloatArray) -> Iterator[Engine]:
        if self._mover is None:
            yield PlainEngine(self.world, delays_s, self.world.step_s)
            return
        with tempfile.TemporaryDirectory(prefix="kankaku-", dir=temporary_folder()) as folder:
            files = self._mover.write(self.scenario, self.world, delays_s, Path(folder))
            with _alone(gui=self._gui), self._mover.engine(files, self.world, gui=self._gui) as one:
                yield one


@contextmanager
def _alone(*, gui: bool) -> Iterator[None]:
    """Refuse a second SUMO inside this process: it would end the first one without a word."""
    if gui:
        yield
        return
    if _HELD.locked():
        where, problem = "engine", "another simulation runs on SUMO in this process"
        raise StudyError(where, problem, "to close it first, engine 'none', or a process for each")
    with _HELD:
        yield


def wrapped(bare: Controller, wrap: Callable[[str, Any], Any]) -> Controller:
    """
    Return a controller with something in place of its layers.

    Parameters
    ----------
    bare
        As it was built.
    wrap
        As :meth:`Opening.opened` takes it.

    Returns
    -------
    Controller
        The same but for its layers.
    """
    return replace(
        bare,
        protection=wrap("protection", bare.protection),
        operation=wrap("operation", bare.operation),
        drive=wrap("drive", bare.drive),
        supervision=bare.supervision and wrap("supervision", bare.supervision),
    )
