"""The only loop: observe, protect, operate, drive, record, apply, advance."""

from collections.abc import Callable

import numpy as np

from railway.arrays import FloatArray
from railway.control import Controller
from railway.energy import EnergyMeter
from railway.engine import Engine
from railway.monitor import Monitor
from railway.recorder import Recorder
from railway.records import RunRecord
from railway.standstill import StandstillWatch
from railway.tracker import Tracker
from railway.world import World

REPORT_EVERY_STEPS = 1000


def simulate(
    world: World,
    engine: Engine,
    controller: Controller,
    dwell_delay_s: FloatArray,
    *,
    seed: int,
    patience_s: float,
    progress: Callable[[float], None] = lambda _: None,
) -> RunRecord:
    """
    Run every train to the end of the line under one controller.

    Parameters
    ----------
    world
        Line, fleet and timetable.
    engine
        What moves the trains; it knows the dwell delays, controllers do not.
    controller
        Protection, operation and drive.
    dwell_delay_s
        The delays the engine injects, for the record. [s], shape (n_trains, n_calls_max)
    seed
        Seed of those delays, for the record.
    patience_s
        Trains that are not through this long after the last booked call are stalled. [s]
    progress
        Called with the simulated time now and then. [s]

    Returns
    -------
    RunRecord
        Everything that happened, safety violations included.
    """
    protection, operation, drive = controller.protection, controller.operation, controller.drive
    tracker = Tracker(world)
    monitor, energy, standing = (
        Monitor(world, controller.separation),
        EnergyMeter(world),
        StandstillWatch(world),
    )
    judges = () if controller.peer else (monitor,)
    recorder = Recorder(world, drive, (*judges, energy, standing))
    permitted, planned = protection.initial(), operation.initial()
    last_booked_s = float(
        np.max(world.booked_departure_s, initial=0.0, where=np.isfinite(world.booked_departure_s))
    )
    steps = 0
    while True:
        seen = engine.observe()
        state = tracker.update(seen)
        if seen.collided:
            monitor.note_collisions(seen.collided, seen.time_s)
        authority, permitted = protection.authorise(state, permitted)
        advice, planned = operation.advise(state, authority, planned)
        command = drive.command(state, authority, advice)
        recorder.write(state, authority, advice, command)
        if tracker.finished or seen.time_s > last_booked_s + patience_s:
            break
        engine.apply(command.speed_mps)
        engine.advance()
        steps += 1
        if steps % REPORT_EVERY_STEPS == 0:
            progress(seen.time_s)
    recorder.flush()
    progress(seen.time_s)
    monitor.note_stalled(np.flatnonzero(~tracker.completed), seen.time_s)
    return RunRecord(
        controller=controller.name,
        seed=seed,
        world=world,
        dwell_delay_s=dwell_delay_s,
        arrival_s=tracker.arrival_s,
        departure_s=tracker.departure_s,
        stop_error_m=tracker.stop_error_m,
        trajectory=recorder.trajectory(),
        standstills=standing.standstills(),
        crawl_s=standing.crawl_s,
        energy=energy.account(),
        violations=monitor.violations(),
        completed=tracker.completed,
        train_steps=recorder.train_steps,
    )
