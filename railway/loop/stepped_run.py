"""The only loop: observe, protect, supervise, operate, drive, record, apply, advance."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.errors import sentence_of
from kankaku.railway.failures.unit_failures import Units
from kankaku.railway.loop.agreements import FirstStep
from kankaku.railway.loop.bundling import Bundling, nothing_happened
from kankaku.railway.loop.recorder import Recorder
from kankaku.railway.loop.supervising import Supervising
from kankaku.railway.loop.tracker import Tracker
from kankaku.railway.loop.unfinished import Ending, unfinished
from kankaku.railway.plan.run import Run
from kankaku.railway.radio.data_link import Radio
from kankaku.railway.safety.monitor import Monitor
from kankaku.railway.step.control import Command, Controller
from kankaku.railway.step.engine_contract import Engine, Observation
from kankaku.railway.step.records import HoldTimes, RunRecord, Unfinished
from kankaku.railway.step.state import Advice, Authority, LineState
from kankaku.railway.step.step_block import Meter
from kankaku.railway.wayside.signalling import Wayside

REPORT_EVERY_STEPS = 1000


class Moment(NamedTuple):
    """What is, and what is permitted, before anybody says how that is used."""

    state: LineState
    authority: Authority


class SteppedRun:
    """
    Whoever takes part in a run, and how far it has come.

    Parameters
    ----------
    run
        What happens whoever controls the trains.
    engine
        What moves the trains.
    controller
        Protection, operation and drive, with supervision where there is one.
    meters
        What measures the run; the monitor of safety is always there.
    units
        What units measure where they may be wrong; see
        :func:`~kankaku.railway.loop.simulate.simulate`.
    """

    def __init__(
        self,
        run: Run,
        engine: Engine,
        controller: Controller,
        meters: Sequence[Meter],
        units: Units | None = None,
    ) -> None:
        world = run.world
        self._run, self._engine, self._meters = run, engine, meters
        self._layers = _Layers(controller, run)
        self._wayside = Wayside(world, run.disruptions, run.seed)
        on_air = Radio(world, run.radio, run.seed) if controller.by_radio else None
        self._tracker = tracker = Tracker(world, self._wayside, on_air, units)
        self.monitor = Monitor(
            world,
            controller.separation,
            self._wayside.obstructions,
            by_radio=controller.by_radio,
            # What is promised holds as long as units do what they should; safety holds always.
            promises=controller.promises if units is None else None,
        )
        judges = () if controller.peer else (self.monitor,)
        self.recorder = Recorder(world, controller, (*judges, *meters), self._wayside.places)
        booked_s = world.booked_departure_s
        last_booked_s = float(np.max(booked_s, initial=0.0, where=np.isfinite(booked_s)))
        self._over_s = last_booked_s + run.patience_s
        self._bundling = Bundling(engine, controller, tracker, self.recorder, self._over_s)
        self._steps = self._told = 0
        self.state: LineState | None = None
        """As it was at the last step that was made in Python."""
        self.moment: Moment | None = None
        """The moment at which the run pauses; None between two steps."""
        self.last: Moment | None = None
        """The last moment that was decided in Python."""
        self.command: Command | None = None
        """What the drive made of the moment from which the run went on last."""
        self.over = False
        self._failure, self._left = "", tuple[Unfinished, ...]()
        self.now_s = float("nan")

    @property
    def departure_s(self) -> FloatArray:
        """Actual departures so far. [s], shape (n_trains, n_calls_max)"""
        return self._tracker.departure_s

    def go(
        self, pause_s: float = np.inf, progress: Callable[[float], None] = lambda _: None
    ) -> bool:
        """
        Run until all trains have left, patience is over, or a time has come.

        At that time the run pauses at :attr:`moment`, when protection has spoken and nobody else;
        the next call goes on from there. Where it pauses changes nothing of what happens.

        Parameters
        ----------
        pause_s
            It pauses before the first step that begins then or later. [s]
        progress
            Called with the simulated time now and then. [s]

        Returns
        -------
        bool
            The run is over; else it only pauses.

        Raises
        ------
        Exception
            What the engine or a controller raises while no safety invariant was violated.
        """
        try:
            ending = self._go(pause_s, progress)
        except Exception as error:
            self.recorder.flush()
            # An engine may do anything with trains that have met; that they met must be told.
            if not self.monitor.violations():
                raise
            self._failure, self.over = f"ended at {self.now_s:.1f} s: {sentence_of(error)}", True
        else:
            if ending:
                self.recorder.flush()
                self._left, self.over = unfinished(self._run.world, ending), True
        return self.over

    def end(self, why: str) -> None:
        """
        End the run where it pauses, before its end.

        Parameters
        ----------
        why
            The record says so as its failure.
        """
        if not self.over:
            if self.moment:
                self._decide(self.moment)
            self.recorder.flush()
            self._failure, self.over, self.moment = why, True, None

    def _go(self, pause_s: float, progress: Callable[[float], None]) -> Ending | None:
        bundling, engine, tracker = self._bundling, self._engine, self._tracker
        bundling.until_s = min(self._over_s, pause_s)
        moment, self.moment, self.command = self.moment, None, None
        while True:
            if moment is None:
                seen = engine.observe()
                self.now_s = seen.time_s
                self.monitor.note_collisions(seen.collided, self.now_s)
                taken = self._bundle(seen)
                if taken:
                    self._count(taken, progress)
                    continue
                self.state = tracker.update(seen)
                moment = Moment(self.state, self._layers.permit(self.state, self._wayside))
                # Nobody is left to whom anything could be said when all have finished.
                if self.now_s >= pause_s and not tracker.finished:
                    self.moment = moment
                    return None
            self.last, command = moment, self._decide(moment)
            self.command = self.command or command
            if tracker.finished or self.now_s > self._over_s:
                return Ending(*moment, tracker.completed, self._run.disruptions)
            bundling.asked_in_python()
            engine.apply(command.speed_mps)
            engine.advance()
            self._count(1, progress)
            moment = None

    def _bundle(self, seen: Observation) -> int:
        """Return how many steps could be taken in one go."""
        if not self._bundling.possible or self.state is None or not nothing_happened(seen):
            return 0
        return self._layers.take_bundle(self._bundling, seen, self.state)

    def _decide(self, moment: Moment) -> Command:
        state, authority = moment
        advice, command = self._layers.decide(state, authority, self._engine)
        self.recorder.write(state, authority, advice, command)
        return command

    def _count(self, steps: int, progress: Callable[[float], None]) -> None:
        self._steps += steps
        if self._steps // REPORT_EVERY_STEPS > self._told:
            self._told = self._steps // REPORT_EVERY_STEPS
            progress(self.now_s)

    def record(self) -> RunRecord:
        """
        Return everything that happened in a run that is over.

        Returns
        -------
        RunRecord
            Safety violations included. If the engine or a controller failed after a violation, or
            somebody ended the run, the record ends there and says so.
        """
        run, tracker = self._run, self._tracker
        measured: dict[str, Any] = {}
        for meter in self._meters:
            measured |= meter.measured()
        return RunRecord(
            controller=self._layers.controller.name,
            seed=run.seed,
            world=run.world,
            dwell_delay_s=run.dwell_delay_s,
            arrival_s=tracker.arrival_s,
            departure_s=tracker.departure_s,
            stop_error_m=tracker.stop_error_m,
            trajectory=self.recorder.trajectory(),
            violations=self.monitor.violations(),
            obstructions=self._wayside.obstructions(),
            completed=tracker.completed,
            train_steps=self.recorder.train_steps,
            failure=self._failure,
            unfinished=self._left,
            end_s=self.now_s,
            held=self._layers.held(tracker.arrival_s, self.now_s),
            **measured,
        )


class _Layers:
    """Protection, supervision, operation and drive, with what they remember."""

    def __init__(self, controller: Controller, run: Run) -> None:
        self.controller = controller
        self._permitted = controller.protection.initial()
        self._planned = controller.operation.initial()
        self._supervising = Supervising(controller, run) if controller.supervision else None
        self._first = True
        self._looks: FirstStep | None = None

    def permit(self, state: LineState, wayside: Wayside) -> Authority:
        """Return what protection makes of a state."""
        protection = self.controller.protection
        self._looks = FirstStep(self.controller.name, state) if self._first else None
        authority, self._permitted = protection.authorise(state, self._permitted)
        if self._looks:
            self._looks.look_at(protection, authority)
        if wayside.unsettled:
            wayside.settle(state, authority.permission.covered_m)
        return authority

    def decide(
        self, state: LineState, authority: Authority, engine: Engine
    ) -> tuple[Advice, Command]:
        """Return what the layers above protection make of a state."""
        operation, first = self.controller.operation, self._looks
        if self._supervising:
            state = self._supervising.decide(state, authority, engine, first)
        advice, self._planned = operation.advise(state, authority, self._planned)
        if first:
            first.look_at(operation, advice)
        if self._supervising:
            advice = self._supervising.lowered(advice)
        command = self.controller.drive.command(state, authority, advice)
        if first:
            first.look_at(self.controller.drive, command)
            self._first = False
        if self._supervising:
            command = self._supervising.told(command)
        return advice, command

    def take_bundle(self, bundling: Bundling, seen: Observation, state: LineState) -> int:
        """Return how many steps could be taken in one go from the last state on."""
        memories = self._permitted, self._planned
        taken, (self._permitted, self._planned) = bundling.take(
            seen, state, memories, self._supervising
        )
        return taken

    def held(self, arrival_s: FloatArray, end_s: float) -> HoldTimes | None:
        """Return how long supervision held every train; None where there is none."""
        return self._supervising.held(arrival_s, end_s) if self._supervising else None
