"""What a centre knows of its trains by their reports, and what a train does without commands."""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import compiled
from kankaku.railway.plan.radio_spec import TOLERANCE_S, RadioSpec
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import NO_VERSION, LineState, RadioState


class Snapshot(NamedTuple):
    """What all trains said in one cycle, whether it has arrived or not."""

    cycle: int
    front_m: FloatArray
    speed_mps: FloatArray
    call: IntArray
    stopped_s: FloatArray


class Reports(NamedTuple):
    """The last report that has arrived of each train; arrays of shape (n_trains,)."""

    version: int
    """Of :attr:`kankaku.railway.step.state.RadioState.reported`, which this is made from."""
    known_s: FloatArray
    """When it was made; -inf for a train that has never reported. [s]"""
    front_m: FloatArray
    """The front then; the origin of a train that has never reported. [m]"""
    speed_mps: FloatArray
    """The speed then. [m/s]"""
    call: IntArray
    """The call ahead then, or the one at which it stood."""
    stopped_s: FloatArray
    """Since when it stood at that call; inf if it was on its way. [s]"""
    next_s: float
    """When the next reports are made. [s]"""
    snapshots: tuple[Snapshot, ...]
    """What may still arrive, oldest first."""


def no_reports(world: World) -> Reports:
    """
    Return what a centre knows before the first step.

    Parameters
    ----------
    world
        The trains.

    Returns
    -------
    Reports
        Every train stands at its origin until it reports.
    """
    size = world.size
    return Reports(
        NO_VERSION,
        np.full(size, -np.inf),
        world.stop_m[:, 0],
        np.zeros(size),
        np.zeros(size, dtype=np.intp),
        np.full(size, np.inf),
        -np.inf,
        (),
    )


def take_reports(reports: Reports, state: LineState, radio: RadioState, spec: RadioSpec) -> Reports:
    """
    Return what a centre knows now; called in every step.

    Parameters
    ----------
    reports
        What it knew.
    state
        The line, from which trains report what they are in a report's own moment.
    radio
        What has arrived.
    spec
        The radio.

    Returns
    -------
    Reports
        The same object when nothing was said and nothing has arrived.
    """
    speaking = state.time_s + TOLERANCE_S >= reports.next_s
    arrived = radio.reports_version != reports.version
    if not (speaking or arrived):
        return reports
    snapshots, next_s = reports.snapshots, reports.next_s
    if speaking:
        cycle = spec.report_cycle(state.time_s)
        next_s = spec.report_s(cycle) + spec.cycle_s
        oldest_s = spec.report_s(cycle) - spec.cycle_s - spec.delay_most_s
        kept = tuple(said for said in snapshots if spec.report_s(said.cycle) >= oldest_s)
        stopped_s = np.where(state.running, np.inf, state.arrival_s)
        said = Snapshot(cycle, state.front_m, state.speed_mps, state.next_call, stopped_s)
        snapshots = (*kept, said)
    if not arrived:
        return reports._replace(next_s=next_s, snapshots=snapshots)
    front_m, speed_mps = reports.front_m.copy(), reports.speed_mps.copy()
    call, stopped_s = reports.call.copy(), reports.stopped_s.copy()
    for said in snapshots:
        arrived_now = radio.reported == said.cycle
        np.copyto(front_m, said.front_m, where=arrived_now)
        np.copyto(speed_mps, said.speed_mps, where=arrived_now)
        np.copyto(call, said.call, where=arrived_now)
        np.copyto(stopped_s, said.stopped_s, where=arrived_now)
    return Reports(
        radio.reports_version,
        radio.reported_s,
        front_m,
        speed_mps,
        call,
        stopped_s,
        next_s,
        snapshots,
    )


def radio_of(state: LineState) -> RadioState:
    """
    Return what has arrived by radio.

    Parameters
    ----------
    state
        The line.

    Returns
    -------
    RadioState
        Never nothing.

    Raises
    ------
    ValueError
        If the run has no radio.
    """
    if state.radio is None:
        msg = "a controller that takes its commands by radio was run without one"
        raise ValueError(msg)
    return state.radio


def emergency(
    latched: BoolArray, state: LineState, heard_s: FloatArray, horizon_s: float
) -> BoolArray:
    """
    Return which trains brake in emergency, because their commands have run out.

    Such a train brakes until it stands *and* has commands again. One that is held by a stop
    does not brake; if it still has no commands when it is released, it stays.

    Parameters
    ----------
    latched
        Who did so in the step before. shape (n_trains,)
    state
        The line.
    heard_s
        When the last commands that each train has were sent. [s], shape (n_trains,)
    horizon_s
        For how long commands are valid after they are sent. [s]

    Returns
    -------
    BoolArray
        Who does so now. shape (n_trains,)
    """
    oldest_s = state.time_s - horizon_s - TOLERANCE_S
    return _emergency(latched, heard_s, oldest_s, state.speed_mps, state.running)


@compiled
def _emergency(
    latched: BoolArray,
    heard_s: FloatArray,
    oldest_s: float,
    speed_mps: FloatArray,
    running: BoolArray,
) -> BoolArray:
    brakes = np.zeros_like(latched)
    for train in range(latched.size):
        still = latched[train] and speed_mps[train] > 0.0
        brakes[train] = running[train] and (still or heard_s[train] < oldest_s)
    return brakes
