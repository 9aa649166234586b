"""What a train does with its commands: which band it keeps, and how fast it is to go."""

from typing import NamedTuple

import numpy as np

from kankaku.controllers.ceiling import LineCeiling, ceiling_ahead_mps, figures_of
from kankaku.controllers.control_map.measuring import Aboard
from kankaku.controllers.control_map.telegrams import Sent
from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, compiled, formula, plain
from kankaku.railway.plan.brake_table import BrakeTable, braked_stop_m
from kankaku.railway.plan.radio_spec import NEVER
from kankaku.railway.step.state import NOTHING, LineState, Whereabouts

HEADROOM_MPS = 0.3
"""A train that is a little behind its plan may catch up. [m/s]"""
KEPT_M = 0.05
"""Rounding of stopping places. [m]"""
SPACING_M = 50.0
"""No line limit holds for less than a train's length: ceilings are looked up this often. [m]"""
CREEP_MPS = 1.0
"""Speed to a stop that a train has come near to. [m/s]"""
NEAR_M = 50.0
"""So near is near. [m]"""


class Held(NamedTuple):
    """What trains know beside their telegrams; arrays of shape (n_trains,)."""

    clock_s: FloatArray
    """Now, by the clocks of the trains. [s]"""
    to_stop_m: FloatArray
    """How far it is to their next stops, as platforms measure it. [m]"""
    heard: IntArray
    """Cycle of the last telegram that each train has."""
    held: IntArray
    """Cycle of the commands that each train has gone by."""
    held_m: FloatArray
    """The ends of authority kept so far. [m]"""


class Tempo(NamedTuple):
    """How time is cut."""

    step_s: float
    """Length of the simulator's step. [s]"""
    moment_s: float
    """Time between the moments of a telegram. [s]"""


@compiled
def keep_bands(
    whereabouts: Plain, held_fields: Plain, sent_fields: Plain, tempo_fields: Plain, brakes: Plain
) -> tuple[FloatArray, FloatArray, IntArray]:
    """
    Return the ends of authority that trains keep, and the speeds that they are commanded.

    A new command may ask for more braking than the service brake can do, because the train is not
    quite where the centre thought. It is kept with the service brake as far as the way is
    free: the command before it allows that.

    Parameters
    ----------
    whereabouts
        Of :class:`~kankaku.railway.step.state.Whereabouts`, plain.
    held_fields
        Of :class:`Held`, plain.
    sent_fields
        Of :class:`~kankaku.controllers.control_map.telegrams.Sent`, plain.
    tempo_fields
        Of :class:`Tempo`, plain.
    brakes
        Of :class:`~kankaku.railway.plan.brake_table.BrakeTable`, plain.

    Returns
    -------
    tuple[FloatArray, FloatArray, IntArray]
        Ends of authority [m], speeds at the end of the step [m/s], inf without commands, and the
        cycle of the commands that each train goes by; shape (n_trains,) each.
    """
    trains, held, sent = Whereabouts(*whereabouts), Held(*held_fields), Sent(*sent_fields)
    tempo, braking = Tempo(*tempo_fields), BrakeTable(*brakes)
    eoa_m, commanded_mps = trains.front_m.copy(), np.full(trains.front_m.size, np.inf)
    goes_by = held.held.copy()
    for train in trains.rows:
        slot = _slot(train, held.heard[train], goes_by, sent)
        front_m, speed_mps = trains.front_m[train], trains.speed_mps[train]
        if slot < 0 or goes_by[train] == NEVER:
            # Nothing yet, or nothing for so long that the train has braked in emergency.
            eoa_m[train] = max(held.held_m[train], front_m)
            continue
        since = (held.clock_s[train] - sent.sent_s[slot]) / tempo.moment_s
        bound_m = _at_moment(sent.eoa_m[slot, train], since)
        if bound_m < held.held_m[train]:
            own_m = braked_stop_m(braking, train, front_m, speed_mps)
            kept_m = min(own_m, held.held_m[train], sent.free_m[slot, train])
            bound_m = max(bound_m, kept_m)
        eoa_m[train] = bound_m
        since += tempo.step_s / tempo.moment_s
        wish = _at_moment(sent.speed_mps[slot, train], since)
        commanded_mps[train] = wish + HEADROOM_MPS if wish > 0.0 else 0.0
        if 0.0 < held.to_stop_m[train] < NEAR_M:
            # The platform measures the last metres, whatever the centre believes.
            commanded_mps[train] = max(commanded_mps[train], CREEP_MPS)
    return eoa_m, commanded_mps, goes_by


@formula
def _slot(train: int, heard: int, goes_by: IntArray, sent: Sent) -> int:
    """Return the telegram that a train goes by, -1 for none, and write its cycle."""
    slot = -1
    for number in range(sent.cycle.size):
        has_commands = sent.furthest_m[number, train] > -np.inf
        if sent.cycle[number] == heard and has_commands:
            goes_by[train] = heard
    for number in range(sent.cycle.size):
        if sent.cycle[number] == goes_by[train]:
            slot = number
    return slot


@formula
def _at_moment(values: FloatArray, since: float) -> float:
    """Return a value of a telegram so many moments after it was sent; the last one stays."""
    last = values.size - 1
    moment = min(max(int(since), 0), last)
    after = min(moment + 1, last)
    part = min(max(since - moment, 0.0), 1.0)
    return float(values[moment] + part * (values[after] - values[moment]))


@compiled
def behind_bands(
    rows: IntArray,
    eoa_m: FloatArray,
    cycle: IntArray,
    free_m: FloatArray,
    behind: tuple[IntArray, IntArray],
    held: IntArray,
) -> IntArray:
    """
    Return what is behind the ends and the speeds that trains keep.

    Parameters
    ----------
    rows
        The trains. shape (n_present,)
    eoa_m
        The ends of authority. [m], shape (n_trains,)
    cycle, free_m
        As in :class:`~kankaku.controllers.control_map.telegrams.Sent`.
    behind
        What the way was free up to, and what runs were slowed by. shape (n_slots, n_trains) each
    held
        Cycle of the commands that each train goes by. shape (n_trains,)

    Returns
    -------
    IntArray
        As :attr:`kankaku.railway.step.state.Authority.eoa_by`. shape (n_trains,)
    """
    free_by, slowed_by = behind
    found = np.full(eoa_m.size, NOTHING)
    for train in rows:
        for slot in range(cycle.size):
            if cycle[slot] == held[train] and held[train] != NEVER:
                ends = eoa_m[train] >= free_m[slot, train]
                found[train] = free_by[slot, train] if ends else slowed_by[slot, train]
    return found


def may_leave(seen: LineState, aboard: Aboard, eoa_m: FloatArray, braking: BrakeTable) -> BoolArray:
    """
    Return which trains brake in emergency, because they might leave their bands.

    Only what a train has learnt of its own place counts: where the band itself has become
    shorter, the train brakes as hard as it takes anyhow.

    Parameters
    ----------
    seen
        The line as it is measured.
    aboard
        What is known of measurements.
    eoa_m
        Where the bands end. [m], shape (n_trains,)
    braking
        How trains brake.

    Returns
    -------
    BoolArray
        Until they stand. shape (n_trains,)
    """
    leaving = aboard.leaving & seen.running & (seen.speed_mps > 0.0)
    learnt = aboard.retreat_m > 0.0
    if not learnt.any():
        return leaving
    for row in np.flatnonzero(seen.running & learnt & ~leaving).tolist():
        front_m, speed_mps = float(seen.front_m[row]), float(seen.speed_mps[row])
        stop_m = braked_stop_m(braking, row, front_m, speed_mps)
        leaving[row] = speed_mps > 0.0 and stop_m > eoa_m[row] + KEPT_M
    return leaving


def ceilings_mps(ceiling: LineCeiling, seen: LineState, aboard: Aboard) -> FloatArray:
    """
    Return the line ceilings that hold wherever trains may be.

    Parameters
    ----------
    ceiling
        The line ceiling.
    seen
        The line as it is measured.
    aboard
        What is known of measurements.

    Returns
    -------
    FloatArray
        [m/s], shape (n_trains,)
    """
    places_m = seen.front_m - aboard.widened_m, aboard.uncertain_m
    return _lowest_mps(plain(ceiling.figures), places_m, seen.speed_mps, seen.present)


@compiled
def _lowest_mps(
    fields: Plain,
    places_m: tuple[FloatArray, FloatArray],
    speed_mps: FloatArray,
    present: BoolArray,
) -> FloatArray:
    line, (measured_m, uncertain_m) = figures_of(fields), places_m
    lowest_mps = np.zeros_like(measured_m)
    for train in range(measured_m.size):
        if not present[train]:
            continue
        parts = 1 + int(2.0 * uncertain_m[train] / SPACING_M)
        lowest = np.inf
        for part in range(parts + 1):
            place_m = measured_m[train] + uncertain_m[train] * (2.0 * part / parts - 1.0)
            lowest = min(lowest, ceiling_ahead_mps(line, train, place_m, speed_mps[train]))
        lowest_mps[train] = lowest
    return lowest_mps
