"""What a centre knows of its trains by their reports, and what a train does without commands."""

import math
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, compiled
from kankaku.railway.plan.radio_spec import NEVER, TOLERANCE_S, RadioSpec, cycle_at
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import NO_VERSION, LineState, RadioState


class Spoken(NamedTuple):
    """What trains said in the last cycles, whether it has arrived or not; a slot for each."""

    cycle: IntArray
    """``NEVER`` for an empty slot. shape (n_slots,)"""
    front_m: FloatArray
    """shape (n_slots, n_trains), as those that follow"""
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
    said: Spoken
    """What may still arrive."""


def no_reports(world: World, spec: RadioSpec) -> Reports:
    """
    Return what a centre knows before the first step.

    Parameters
    ----------
    world
        The trains.
    spec
        The radio.

    Returns
    -------
    Reports
        Every train stands at its origin until it reports.
    """
    size = world.size
    # A report's slot is taken again when it has long arrived.
    slots = math.ceil(spec.delay_most_s / spec.cycle_s) + 3
    shape = slots, size
    return Reports(
        NO_VERSION,
        np.full(size, -np.inf),
        world.stop_m[:, 0].copy(),
        np.zeros(size),
        np.zeros(size, dtype=np.intp),
        np.full(size, np.inf),
        -np.inf,
        Spoken(
            np.full(slots, NEVER),
            np.zeros(shape),
            np.zeros(shape),
            np.zeros(shape, dtype=np.intp),
            np.zeros(shape),
        ),
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
    known = reports
    if state.time_s + TOLERANCE_S >= reports.next_s:
        trains = state.front_m, state.speed_mps, state.running
        calls = state.next_call, state.arrival_s
        next_s, said = spoken(state.time_s, trains, calls, tuple(known.said), spec.cycle_s)
        known = known._replace(next_s=next_s, said=Spoken(*said))
    if radio.reports_version != reports.version:
        before = known.known_s, known.front_m, known.speed_mps, known.call, known.stopped_s
        after = arrived(radio.reported, before, tuple(known.said), spec.cycle_s)
        known = Reports(radio.reports_version, *after, known.next_s, known.said)
    return known


@compiled
def spoken(
    time_s: float,
    trains: tuple[FloatArray, FloatArray, BoolArray],
    calls: tuple[IntArray, FloatArray],
    said_fields: Plain,
    cycle_s: float,
) -> tuple[float, Plain]:
    """
    Let all trains report what they are now.

    Parameters
    ----------
    time_s
        Now. [s]
    trains
        Fronts and speeds, and who runs. [m] and [m/s], shape (n_trains,) each
    calls
        Calls ahead, and when the last ones began. [-] and [s], shape (n_trains,) each
    said_fields
        Of :class:`Spoken`, of the cycles before.
    cycle_s
        Length of a cycle. [s]

    Returns
    -------
    tuple[float, Plain]
        When they report next [s], and the fields of :class:`Spoken`.
    """
    (front_m, speed_mps, running), (next_call, arrival_s), before = (
        trains,
        calls,
        Spoken(*said_fields),
    )
    said = Spoken(
        before.cycle.copy(),
        before.front_m.copy(),
        before.speed_mps.copy(),
        before.call.copy(),
        before.stopped_s.copy(),
    )
    cycle = cycle_at(time_s, cycle_s)
    slot = cycle % said.cycle.size
    said.cycle[slot] = cycle
    for train in range(front_m.size):
        said.front_m[slot, train], said.speed_mps[slot, train] = front_m[train], speed_mps[train]
        said.call[slot, train] = next_call[train]
        said.stopped_s[slot, train] = np.inf if running[train] else arrival_s[train]
    told = said.cycle, said.front_m, said.speed_mps, said.call, said.stopped_s
    return cycle * cycle_s + cycle_s, told


@compiled
def arrived(
    reported: IntArray, before: Plain, said_fields: Plain, cycle_s: float
) -> tuple[FloatArray, FloatArray, FloatArray, IntArray, FloatArray]:
    """
    Return what is known by the reports that have arrived.

    Parameters
    ----------
    reported
        Cycle of the last report of each train that has arrived. shape (n_trains,)
    before
        When reports were made [s], fronts, speeds, calls and since when trains stand there, before.
    said_fields
        Of :class:`Spoken`.
    cycle_s
        Length of a cycle. [s]

    Returns
    -------
    tuple[FloatArray, FloatArray, FloatArray, IntArray, FloatArray]
        The same now.
    """
    said, known_s = Spoken(*said_fields), np.full(reported.size, -np.inf)
    _, front_m, speed_mps, call, stopped_s = before
    front_m, speed_mps = front_m.copy(), speed_mps.copy()
    call, stopped_s = call.copy(), stopped_s.copy()
    for train in range(reported.size):
        cycle = reported[train]
        slot = cycle % said.cycle.size
        if cycle == NEVER:
            continue
        known_s[train] = cycle * cycle_s
        if said.cycle[slot] == cycle:
            front_m[train], speed_mps[train] = (
                said.front_m[slot, train],
                said.speed_mps[slot, train],
            )
            call[train], stopped_s[train] = said.call[slot, train], said.stopped_s[slot, train]
    return known_s, front_m, speed_mps, call, stopped_s


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
