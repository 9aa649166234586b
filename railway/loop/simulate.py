"""The only loop: observe, protect, supervise, operate, drive, record, apply, advance."""

from collections.abc import Callable, Sequence
from typing import Any

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
    loop = _Loop(run, controller, meters, units)
    failure, left = "", tuple[Unfinished, ...]()
    try:
        ending = loop.to_the_end(engine, progress)
    except Exception as error:
        loop.recorder.flush()
        # An engine may do anything with trains that have met; that they met must be told.
        if not loop.monitor.violations():
            raise
        failure = f"ended at {loop.now_s:.1f} s: {sentence_of(error)}"
    else:
        loop.recorder.flush()
        left = unfinished(run.world, ending)
    finally:
        progress(loop.now_s)
    return loop.record(failure, left)


class _Loop:
    """Whoever takes part in a run, and how far it has come."""

    def __init__(
        self, run: Run, controller: Controller, meters: Sequence[Meter], units: Units | None
    ) -> None:
        world = run.world
        self._run, self._meters = run, meters
        self._layers = _Layers(controller, run)
        self._wayside = Wayside(world, run.disruptions, run.seed)
        on_air = Radio(world, run.radio, run.seed) if controller.by_radio else None
        self._tracker = Tracker(world, self._wayside, on_air, units)
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
        self.now_s = float("nan")

    def to_the_end(self, engine: Engine, progress: Callable[[float], None]) -> Ending:
        """Run until all trains have left, or patience is over; return the last moment."""
        booked_s = self._run.world.booked_departure_s
        last_booked_s = float(np.max(booked_s, initial=0.0, where=np.isfinite(booked_s)))
        over_s = last_booked_s + self._run.patience_s
        tracker, steps, told, state = self._tracker, 0, 0, None
        layers = self._layers
        bundling = Bundling(engine, layers.controller, tracker, self.recorder, over_s)
        while True:
            seen = engine.observe()
            self.now_s = seen.time_s
            self.monitor.note_collisions(seen.collided, self.now_s)
            taken = 0
            if bundling.possible and state is not None and nothing_happened(seen):
                taken = layers.take_bundle(bundling, seen, state)
            if not taken:
                state = tracker.update(seen)
                authority, advice, command = layers.decide(state, self._wayside, engine)
                self.recorder.write(state, authority, advice, command)
                if tracker.finished or self.now_s > over_s:
                    return Ending(state, authority, tracker.completed, self._run.disruptions)
                bundling.asked_in_python()
                engine.apply(command.speed_mps)
                engine.advance()
                taken = 1
            steps += taken
            if steps // REPORT_EVERY_STEPS > told:
                told = steps // REPORT_EVERY_STEPS
                progress(self.now_s)

    def record(self, failure: str, left: tuple[Unfinished, ...]) -> RunRecord:
        """Return everything that happened."""
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
            failure=failure,
            unfinished=left,
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

    def decide(
        self, state: LineState, wayside: Wayside, engine: Engine
    ) -> tuple[Authority, Advice, Command]:
        """Return what the layers make of a state."""
        protection, operation = self.controller.protection, self.controller.operation
        first = FirstStep(self.controller.name, state) if self._first else None
        authority, self._permitted = protection.authorise(state, self._permitted)
        if first:
            first.look_at(protection, authority)
        if wayside.unsettled:
            wayside.settle(state, authority.permission.covered_m)
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
        return authority, advice, command

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
