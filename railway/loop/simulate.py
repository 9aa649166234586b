"""The only loop: observe, protect, operate, drive, record, apply, advance."""

from collections.abc import Callable, Sequence

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.errors import sentence_of
from kankaku.railway.failures.unit_failures import UnitFailure, Units, disturbed, silenced
from kankaku.railway.loop.recorder import Recorder
from kankaku.railway.loop.tracker import Tracker
from kankaku.railway.loop.unfinished import Ending, unfinished
from kankaku.railway.meters.energy_meter import EnergyMeter
from kankaku.railway.meters.standstill import StandstillWatch
from kankaku.railway.plan.disruptions import UNDISTURBED, Disruptions
from kankaku.railway.plan.radio_spec import LOSSLESS, RadioSpec
from kankaku.railway.plan.world import World
from kankaku.railway.radio.data_link import Radio
from kankaku.railway.safety.monitor import Monitor
from kankaku.railway.step.control import Controller
from kankaku.railway.step.engine_contract import Engine
from kankaku.railway.step.records import RunRecord, Unfinished
from kankaku.railway.wayside.signalling import Wayside

REPORT_EVERY_STEPS = 1000


def simulate(  # noqa: PLR0913 - one argument per part of a run
    world: World,
    engine: Engine,
    controller: Controller,
    dwell_delay_s: FloatArray,
    *,
    seed: int,
    patience_s: float,
    disruptions: Disruptions = UNDISTURBED,
    radio: RadioSpec = LOSSLESS,
    unit_failures: Sequence[UnitFailure] | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> RunRecord:
    """
    Run every train to the end of its service under one controller.

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
        Seed of those delays, for the record, of what fails at random and of what radio loses.
    patience_s
        The run ends this long after the last booked call, whoever is still under way. [s]
    disruptions
        What goes wrong beside the track.
    radio
        What a controller's commands go by if they go by radio.
    unit_failures
        What units and the centre do wrong. Only where there are any, even none, does a protection
        see what units measure; otherwise it sees what is.
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
    protection, operation, drive = controller.protection, controller.operation, controller.drive
    units = None
    if unit_failures is not None:
        radio, disruptions = (
            silenced(radio, unit_failures),
            disturbed(disruptions, world.line, unit_failures),
        )
        units = Units(world, unit_failures)
    wayside = Wayside(world, disruptions, seed)
    on_air = Radio(world, radio, seed) if controller.by_radio else None
    tracker = Tracker(world, wayside, on_air, units)
    monitor, energy, standing = (
        Monitor(
            world,
            controller.separation,
            wayside.obstructions,
            by_radio=controller.by_radio,
            # What is promised holds as long as units do what they should; safety holds always.
            promises=controller.promises if unit_failures is None else None,
        ),
        EnergyMeter(world),
        StandstillWatch(world),
    )
    judges = () if controller.peer else (monitor,)
    recorder = Recorder(world, controller, (*judges, energy, standing), wayside.places)
    permitted, planned = protection.initial(), operation.initial()
    last_booked_s = float(
        np.max(world.booked_departure_s, initial=0.0, where=np.isfinite(world.booked_departure_s))
    )
    steps, now_s, failure = 0, float("nan"), ""
    left: tuple[Unfinished, ...] = ()
    try:
        while True:
            seen = engine.observe()
            now_s = seen.time_s
            state = tracker.update(seen)
            monitor.note_collisions(seen.collided, now_s)
            authority, permitted = protection.authorise(state, permitted)
            if wayside.unsettled:
                link = authority.link
                wayside.settle(state, link.covered_m if link else authority.eoa_m)
            advice, planned = operation.advise(state, authority, planned)
            command = drive.command(state, authority, advice)
            recorder.write(state, authority, advice, command)
            if tracker.finished or now_s > last_booked_s + patience_s:
                break
            engine.apply(command.speed_mps)
            engine.advance()
            steps += 1
            if steps % REPORT_EVERY_STEPS == 0:
                progress(now_s)
    except Exception as error:
        if steps:
            progress(now_s)
        recorder.flush()
        # An engine may do anything with trains that have met; that they met must be told.
        if not monitor.violations():
            raise
        failure = f"ended at {now_s:.1f} s: {sentence_of(error)}"
    else:
        recorder.flush()
        progress(now_s)
        left = unfinished(world, Ending(state, authority, tracker.completed, disruptions))
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
        obstructions=wayside.obstructions(),
        completed=tracker.completed,
        train_steps=recorder.train_steps,
        failure=failure,
        unfinished=left,
        end_s=now_s,
    )
