"""What a train does with its commands: which band it keeps, and how fast it is to go."""

import numpy as np

from kankaku.controllers.control_map.measuring import Aboard
from kankaku.controllers.control_map.planned_run import stopping_place_m
from kankaku.controllers.protection.ceiling import (
    CeilingFields,
    CeilingFigures,
    LineCeiling,
    ceiling_ahead_mps,
)
from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import compiled, plain
from kankaku.railway.step.state import NOTHING, LineState

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


@compiled
def keep_bands(  # noqa: PLR0913, PLR0917 - compiled functions take plain arrays
    clock_s: FloatArray,
    step_s: float,
    moment_s: float,
    front_m: FloatArray,
    speed_mps: FloatArray,
    to_stop_m: FloatArray,
    present: BoolArray,
    heard_s: FloatArray,
    sent: tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray],
    held_s: FloatArray,
    held_m: FloatArray,
    figures: tuple[FloatArray, FloatArray, FloatArray],
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return the limits that trains keep, and the speeds that they are commanded.

    A new command may ask for more braking than the service brake can do, because the train is not
    quite where the centre thought. It is kept with the service brake as far as the way is
    free: the command before it allows that.

    Parameters
    ----------
    clock_s
        Now, by the clocks of the trains. [s], shape (n_trains,)
    step_s
        Length of the simulator's step. [s]
    moment_s
        Time between the moments of a telegram. [s]
    front_m, speed_mps
        Where trains are. [m] and [m/s], shape (n_trains,)
    to_stop_m
        How far it is to their next stops, as platforms measure it. [m], shape (n_trains,)
    present
        Trains on the line. shape (n_trains,)
    heard_s
        When the last telegram that each train has was sent. [s], shape (n_trains,)
    sent
        The first five fields of :class:`~kankaku.controllers.control_map.telegrams.Sent`.
    held_s
        When the commands were sent that each train has gone by. [s], shape (n_trains,)
    held_m
        The limits kept so far. [m], shape (n_trains,)
    figures
        Twice the brake potential, row starts and service brakes.

    Returns
    -------
    tuple[FloatArray, FloatArray, FloatArray]
        Limits [m], speeds at the end of the step [m/s], inf without commands, and when the
        commands were sent that each train goes by [s]; shape (n_trains,) each.
    """
    sent_s, eoas_m, speeds_mps, free_m, furthest_m = sent
    square, row_start, brake_mps2 = figures
    eoa_m, commanded_mps = front_m.copy(), np.full(front_m.size, np.inf)
    goes_by_s = held_s.copy()
    last = eoas_m.shape[2] - 1
    for train in range(front_m.size):
        if not present[train]:
            continue
        slot = -1
        for number in range(sent_s.size):
            has_commands = furthest_m[number, train] > -np.inf
            if sent_s[number] == heard_s[train] and has_commands:
                goes_by_s[train] = heard_s[train]
        for number in range(sent_s.size):
            if sent_s[number] == goes_by_s[train]:
                slot = number
        if slot < 0 or goes_by_s[train] == -np.inf:
            # Nothing yet, or nothing for so long that the train has braked in emergency.
            eoa_m[train] = max(held_m[train], front_m[train])
            continue
        since = (clock_s[train] - sent_s[slot]) / moment_s
        moment = min(max(int(since), 0), last)
        after = min(moment + 1, last)
        part = min(max(since - moment, 0.0), 1.0)
        points_m, planned_mps = eoas_m[slot, train], speeds_mps[slot, train]
        bound_m = points_m[moment] + part * (points_m[after] - points_m[moment])
        if bound_m < held_m[train]:
            own_m = stopping_place_m(
                square, row_start[train], front_m[train], speed_mps[train], brake_mps2[train]
            )
            kept_m = min(own_m, held_m[train], free_m[slot, train])
            bound_m = max(bound_m, kept_m)
        eoa_m[train] = bound_m
        since += step_s / moment_s
        moment = min(max(int(since), 0), last)
        after = min(moment + 1, last)
        part = min(max(since - moment, 0.0), 1.0)
        wish = planned_mps[moment] + part * (planned_mps[after] - planned_mps[moment])
        commanded_mps[train] = wish + HEADROOM_MPS if wish > 0.0 else 0.0
        if 0.0 < to_stop_m[train] < NEAR_M:
            # The platform measures the last metres, whatever the centre believes.
            commanded_mps[train] = max(commanded_mps[train], CREEP_MPS)
    return eoa_m, commanded_mps, goes_by_s


@compiled
def behind_bands(
    eoa_m: FloatArray,
    sent_s: FloatArray,
    free_m: FloatArray,
    behind: tuple[IntArray, IntArray],
    held_s: FloatArray,
) -> IntArray:
    """
    Return what is behind the limits and the speeds that trains keep.

    Parameters
    ----------
    eoa_m
        The limits. [m], shape (n_trains,)
    sent_s, free_m
        As in :class:`~kankaku.controllers.control_map.telegrams.Sent`.
    behind
        What the way was free up to, and what runs were slowed by. shape (n_slots, n_trains) each
    held_s
        When the commands were sent that each train goes by. [s], shape (n_trains,)

    Returns
    -------
    IntArray
        As :attr:`kankaku.railway.step.state.Authority.eoa_by`. shape (n_trains,)
    """
    free_by, slowed_by = behind
    found = np.full(eoa_m.size, NOTHING)
    for train in range(eoa_m.size):
        for slot in range(sent_s.size):
            if sent_s[slot] == held_s[train] and held_s[train] > -np.inf:
                ends = eoa_m[train] >= free_m[slot, train]
                found[train] = free_by[slot, train] if ends else slowed_by[slot, train]
    return found


def may_leave(
    seen: LineState,
    aboard: Aboard,
    eoa_m: FloatArray,
    figures: tuple[FloatArray, FloatArray, FloatArray],
) -> BoolArray:
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
        The limits of the bands. [m], shape (n_trains,)
    figures
        Twice the brake potential, row starts and service brakes.

    Returns
    -------
    BoolArray
        Until they stand. shape (n_trains,)
    """
    leaving = aboard.leaving & seen.running & (seen.speed_mps > 0.0)
    learnt = aboard.retreat_m > 0.0
    if not learnt.any():
        return leaving
    square, row_start, brake_mps2 = figures
    for row in np.flatnonzero(seen.running & learnt & ~leaving).tolist():
        front_m, speed_mps = float(seen.front_m[row]), float(seen.speed_mps[row])
        start, brake = float(row_start[row]), float(brake_mps2[row])
        stop_m = stopping_place_m(square, start, front_m, speed_mps, brake)
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
    return _lowest_mps(plain(ceiling.figures), *places_m, seen.speed_mps, seen.present)


@compiled
def _lowest_mps(
    fields: CeilingFields,
    measured_m: FloatArray,
    uncertain_m: FloatArray,
    speed_mps: FloatArray,
    present: BoolArray,
) -> FloatArray:
    line = CeilingFigures(*fields)
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
