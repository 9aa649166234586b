"""A run that somebody outside takes part in, step by step."""

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from kankaku.analysis.tables.run_tables import RunTables, run_tables
from kankaku.asking import SEED_MAX, STEP_RANGE_S
from kankaku.controllers.choosing import named
from kankaku.live.interval_report import IntervalReport, Tally
from kankaku.live.line_advice import OUTSIDE, LineAdvice, taken
from kankaku.live.line_view import LineView, departed_late_s, line_view
from kankaku.live.outside_layers import OutsideOperation, OutsideSupervision
from kankaku.live.policy_operation import ROUNDING_S
from kankaku.railway.errors import KankakuError
from kankaku.railway.loop.stepped_run import Moment, SteppedRun
from kankaku.railway.meters.all_meters import all_meters
from kankaku.railway.plan.scenario import ControllerSpec, Scenario
from kankaku.railway.plan.world import World
from kankaku.railway.step.engine_ways import WITNESS
from kankaku.railway.step.records import RunRecord
from kankaku.railway.wayside.trackside import places_beside
from kankaku.scenarios.loading.load import load
from kankaku.scenarios.shipped import folder_of
from kankaku.studies.opening import Opened, Opening, foresight_of

LONGEST_INTERVAL_S = 3600.0
DEFAULT_INTERVAL_S = 10.0
MEASURES = ("stops", "energy")
"""What reports tell beyond the shield, if it is asked for."""


class SimulationError(KankakuError):
    """A simulation that is asked for what it cannot do now, or at all."""


class Simulation:
    """
    A run of a scenario that pauses at chosen intervals and takes advice.

    Where it pauses changes nothing: without advice its tables are those of any other run. Advice
    goes on top of the operation of the controller and below its protection; it only ever lowers.

    Parameters
    ----------
    scenario
        A scenario, its folder, or the name of a shipped one.
    controller
        One of the scenario's, ``protection+operation`` or ``protection+operation+supervision``.
    seed
        Seed of the dwell delays; the scenario's own if None.
    interval_s
        From one decision to the next; a step or more. [s]
    step_s
        Length of a step; the scenario's own if None. [s]
    engine
        ``witness``, ``every_step``, or ``none`` for runs without SUMO.
    words
        Why trains may be slowed by advice, as tables tell it; plain identifiers.
    measures
        What reports tell beyond the shield, of :data:`MEASURES`.

    Raises
    ------
    KankakuError
        If scenario, controller, or a number cannot be used.
    """

    def __init__(  # noqa: PLR0913 - one argument per choice of the user
        self,
        scenario: str | Path | Scenario,
        controller: str | ControllerSpec = "moving_block+close_up",
        seed: int | None = None,
        *,
        interval_s: float = DEFAULT_INTERVAL_S,
        step_s: float | None = None,
        engine: str = WITNESS,
        words: tuple[str, ...] = (OUTSIDE,),
        measures: tuple[str, ...] = (),
    ) -> None:
        chosen = scenario if isinstance(scenario, Scenario) else load(folder_of(scenario))
        spec = controller
        if isinstance(spec, str):
            spec = named(chosen.controllers, spec)
        if spec.peer:
            allowed = "a protection and an operation"
            raise SimulationError(spec.name, "drives its trains itself: nobody advises it", allowed)
        step_s = chosen.step_s if step_s is None else step_s
        self._seed = chosen.seed if seed is None else seed
        _refuse_outside("seed", self._seed, (0, SEED_MAX))
        _refuse_outside("step_s", step_s, STEP_RANGE_S)
        _refuse_outside("interval_s", interval_s, (step_s, LONGEST_INTERVAL_S))
        if not words:
            where, problem = "words", "is empty"
            raise SimulationError(where, problem, "one word or more")
        for measure in measures:
            if measure not in MEASURES:
                where = "measures"
                raise SimulationError(where, f"{measure!r}", ", ".join(MEASURES))
        self._opening = Opening(chosen, spec, step_s, engine=engine)
        self._places = len(places_beside(chosen.line, chosen.disruptions))
        self._interval_s, self._words, self._measures = interval_s, words, measures
        self._stack = ExitStack()
        self._opened: Opened | None = None
        self._run: SteppedRun | None = None
        self._view: LineView | None = None
        self._report: IntervalReport | None = None

    @property
    def world(self) -> World:
        """Line, fleet and timetable: what every controller knows beforehand."""
        return self._opening.world

    @property
    def seed(self) -> int:
        """Seed of the present run."""
        return self._seed

    @property
    def interval_s(self) -> float:
        """From one decision to the next. [s]"""
        return self._interval_s

    @property
    def state(self) -> LineView:
        """
        The line at the present decision, or when the run was over.

        Raises
        ------
        SimulationError
            Before :meth:`reset`.
        """
        if self._view is None:
            where, problem = "simulation", "has not begun"
            raise SimulationError(where, problem, "reset() first")
        return self._view

    @property
    def report(self) -> IntervalReport | None:
        """What came of the last advice; None before the first step."""
        return self._report

    @property
    def over(self) -> bool:
        """Every train has left, patience is over, or the run has ended for another reason."""
        return self._run is not None and self._run.over

    @property
    def violations(self) -> int:
        """How many violations of safety are known; of all steps once the run is over. [-]"""
        return len(self._run.monitor.violations()) if self._run else 0

    def reset(self, seed: int | None = None) -> LineView:
        """
        Begin a run, whatever became of the one before.

        Parameters
        ----------
        seed
            Seed of its dwell delays; that of the last run if None.

        Returns
        -------
        LineView
            The first decision.

        Raises
        ------
        KankakuError
            If the seed is out of range, or another simulation runs on SUMO in this process.
        """
        if seed is not None:
            _refuse_outside("seed", seed, (0, SEED_MAX))
            self._seed = int(seed)
        self.close()
        self._run, self._view, self._report = None, None, None
        self._opened = opened = self._stack.enter_context(self._opening.opened(self._seed))
        self._operation = OutsideOperation(opened.controller.operation, self.world, self._words)
        self._supervision = OutsideSupervision(opened.controller.supervision, self.world)
        controller = replace(
            opened.controller, operation=self._operation, supervision=self._supervision
        )
        meters = all_meters(self.world)
        run = SteppedRun(opened.run, opened.engine, controller, meters, opened.units)
        self._tally = Tally(
            self.world,
            max(1, round(1.0 / self.world.step_s)) * self.world.step_s,
            stops="stops" in self._measures,
            energy="energy" in self._measures,
        )
        run.recorder.let_hear(self._tally)
        self._run, self._decisions = run, 0
        run.go(-np.inf)
        self._begin_s = run.now_s
        return self._look(run.moment)

    def step(self, advice: LineAdvice | None = None) -> LineView:
        """
        Follow advice until the next decision.

        Parameters
        ----------
        advice
            What is asked of the trains in this interval; None for nothing.

        Returns
        -------
        LineView
            The next decision; the last moment if the run is over.

        Raises
        ------
        AdviceError
            If the advice cannot be followed; then nothing has happened.
        SimulationError
            If the run is over or has not begun.
        Exception
            What the engine or a layer raises while no safety invariant was violated.
        """
        run, moment = self._run, self._run.moment if self._run else None
        if run is None or moment is None:
            where, problem = "simulation", "is over" if self.over else "has not begun"
            raise SimulationError(where, problem, "reset() first")
        asked = taken(advice, self.world, len(self._words), self._places)
        self._decisions += 1
        next_s = self._begin_s + self._decisions * self._interval_s - ROUNDING_S
        self._operation.ask(asked)
        self._supervision.ask(asked.hold_until_s, next_s)
        before_s = run.now_s
        try:
            run.go(next_s)
        except BaseException:
            self.close()
            raise
        run.recorder.tell()
        self._report = self._tally.report((before_s, run.now_s), asked, run.command, moment.state)
        return self._look(run.moment)

    def __iter__(self) -> Iterator[LineView]:
        """
        Yield decision after decision until the run is over; whoever iterates may give advice.

        Where no :meth:`step` was taken in between, one without advice is.
        """
        if self._run is None:
            self.reset()
        while not self.over:
            seen = self.state
            yield seen
            if self._view is seen and not self.over:
                self.step()

    def end(self, why: str) -> None:
        """
        End the run before its end.

        Parameters
        ----------
        why
            A sentence; the record tells it as its failure.
        """
        if self._run is not None:
            self._run.end(why)

    def record(self) -> RunRecord:
        """
        Return everything that happened.

        Returns
        -------
        RunRecord
            As of any other run.

        Raises
        ------
        SimulationError
            If the run is not over.
        """
        if self._run is None or self._opened is None or not self._run.over:
            where, problem = "simulation", "is not over"
            raise SimulationError(where, problem, "step() until over, or end(why)")
        return replace(self._run.record(), foresight=foresight_of(self._opened.bare))

    def tables(self) -> RunTables:
        """
        Return the raw tables of a run that is over.

        Returns
        -------
        RunTables
            As of any other run; :func:`kankaku.analysis.tables.run_tables.write_run` writes them.

        Raises
        ------
        SimulationError
            If the run is not over.
        """
        return run_tables(self.record())

    def close(self) -> None:
        """End the engine; a run that is over can still be told of."""
        try:
            self._stack.close()
        except Exception:
            # After a collision an engine may even fail to end.
            if self._run is None or not self._run.monitor.violations():
                raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _look(self, moment: Moment | None) -> LineView:
        """Return what is seen now; close the engine when the run is over."""
        run = self._run
        if run is not None and moment is None:
            moment = run.last
        if run is None or moment is None:
            where, problem = "simulation", "has nothing to show"
            raise SimulationError(where, problem)
        late_s = departed_late_s(self.world, moment.state.next_call, run.departure_s)
        self._view = line_view(self.world, *moment, late_s)
        if run.over:
            self.close()
        return self._view


def _refuse_outside(where: str, value: float, allowed: tuple[float, float]) -> None:
    least, most = allowed
    # Also what is not a number at all.
    if not least <= value <= most:
        raise SimulationError(where, f"{value}", f"from {least} to {most}")
