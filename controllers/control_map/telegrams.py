"""The telegrams of the control map: what the centre sends, and what of it may still be in force."""

from typing import NamedTuple

import numpy as np

from kankaku.controllers.control_map.planned_map import MapPlan
from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, compiled
from kankaku.railway.plan.brake_table import BrakeTable, braked_stop_m
from kankaku.railway.plan.radio_spec import FOREVER, NEVER
from kankaku.railway.step.state import NOTHING

COMMANDS = 10
"""Steps that a telegram commands. [-]"""
KEPT = 16
"""Telegrams that the centre remembers. [-]"""


class Sent(NamedTuple):
    """The telegrams of the last cycles; one slot each."""

    cycle: IntArray
    """In which it was sent; ``NEVER`` for an empty slot. shape (n_slots,)"""
    sent_s: FloatArray
    """When that was; -inf for an empty slot. [s], shape (n_slots,)"""
    eoa_m: FloatArray
    """Front of the band, margin taken off. [m], shape (n_slots, n_trains, n_moments)"""
    speed_mps: FloatArray
    """Planned speed. [m/s], shape (n_slots, n_trains, n_moments)"""
    free_m: FloatArray
    """How far the way was free, margin taken off. [m], shape (n_slots, n_trains)"""
    furthest_m: FloatArray
    """Furthest of the ends; -inf for whom there are no commands. [m], (n_slots, n_trains)"""
    known: IntArray
    """The centre knows that each train goes by commands of this cycle or later. (n_trains,)"""
    older: int
    """Cycle of the last one that is forgotten, but may not be replaced everywhere."""
    older_m: FloatArray
    """The furthest ends of all those. [m], shape (n_trains,)"""
    free_by: IntArray
    """What the way was free up to. shape (n_slots, n_trains)"""
    slowed_by: IntArray
    """What the run is slower for than the line allows. shape (n_slots, n_trains)"""


def nothing_sent(size: int) -> Sent:
    """
    Return the telegrams before the first one.

    Parameters
    ----------
    size
        Number of trains. [-]

    Returns
    -------
    Sent
        Empty slots.
    """
    eoa_m, speed_mps = np.zeros((2, KEPT, size, COMMANDS + 1))
    free_m, nowhere_m = np.zeros((KEPT, size)), np.full((KEPT, size), -np.inf)
    never, never_s = np.full(KEPT, NEVER), np.full(KEPT, -np.inf)
    no_train = np.full(size, NEVER)
    nothing = np.full((KEPT, size), NOTHING)
    kept = eoa_m, speed_mps, free_m, nowhere_m
    nowhere = np.full(size, -np.inf)
    return Sent(never, never_s, *kept, no_train, NEVER, nowhere, nothing, nothing)


class MapCommands(NamedTuple):
    """What a map commands; one telegram."""

    eoa_m: FloatArray
    """Where trains can stop, and a little further. [m], shape (n_trains, n_moments)"""
    speed_mps: FloatArray
    """shape (n_trains, n_moments)"""
    furthest_m: FloatArray
    """Furthest of the ends; -inf for whom there are no commands. [m], shape (n_trains,)"""


@compiled
def commands_of(plan_fields: Plain, brake_fields: Plain, tolerance_m: float) -> Plain:
    """
    Return where trains that go by their plan can stop, and a little further; never too far.

    Parameters
    ----------
    plan_fields
        Of :class:`~kankaku.controllers.control_map.planned_map.MapPlan`, plain.
    brake_fields
        Of :class:`~kankaku.railway.plan.brake_table.BrakeTable`, plain.
    tolerance_m
        The little. [m]

    Returns
    -------
    Plain
        The fields of :class:`MapCommands`.
    """
    plan, braking = MapPlan(*plan_fields), BrakeTable(*brake_fields)
    size = plan.place.size
    eoa_m, speed_mps = np.zeros((size, COMMANDS + 1)), np.zeros((size, COMMANDS + 1))
    furthest_m = np.full(size, -np.inf)
    for place in range(plan.rows.size):
        train = plan.rows[place]
        if not plan.planned[train]:
            continue
        for moment in range(COMMANDS + 1):
            front_m, speed = plan.front_m[place, moment], plan.speed_mps[place, moment]
            stop_m = braked_stop_m(braking, train, front_m, speed)
            end_m = min(stop_m + tolerance_m, plan.free_m[train])
            eoa_m[train, moment], speed_mps[train, moment] = end_m, speed
            furthest_m[train] = max(furthest_m[train], end_m)
    return eoa_m, speed_mps, furthest_m


@compiled
def added(
    sent_fields: Plain, when: tuple[int, float], command_fields: Plain, plan_fields: Plain
) -> Plain:
    """
    Return the telegrams with another one in the place of the oldest.

    Parameters
    ----------
    sent_fields
        Of :class:`Sent`, plain.
    when
        In which cycle, and when it is sent. [-] and [s]
    command_fields
        Of :class:`MapCommands`, plain.
    plan_fields
        Of the :class:`~kankaku.controllers.control_map.planned_map.MapPlan` behind it, plain.

    Returns
    -------
    Plain
        The fields of :class:`Sent`, in new arrays.
    """
    before, commands, plan = Sent(*sent_fields), MapCommands(*command_fields), MapPlan(*plan_fields)
    cycle, sent_s = before.cycle.copy(), before.sent_s.copy()
    eoa_m, speed_mps = before.eoa_m.copy(), before.speed_mps.copy()
    free_m, furthest_m = before.free_m.copy(), before.furthest_m.copy()
    free_by, slowed_by = before.free_by.copy(), before.slowed_by.copy()
    slot, older_m = int(cycle.argmin()), before.older_m.copy()
    older = cycle[slot]
    cycle[slot], sent_s[slot] = when
    for train in range(older_m.size):
        older_m[train] = max(older_m[train], before.furthest_m[slot, train])
        furthest_m[slot, train] = commands.furthest_m[train]
        free_m[slot, train] = plan.free_m[train]
        free_by[slot, train], slowed_by[slot, train] = plan.free_by[train], plan.slowed_by[train]
        for moment in range(COMMANDS + 1):
            eoa_m[slot, train, moment] = commands.eoa_m[train, moment]
            speed_mps[slot, train, moment] = commands.speed_mps[train, moment]
    return (
        cycle,
        sent_s,
        eoa_m,
        speed_mps,
        free_m,
        furthest_m,
        before.known,
        older,
        older_m,
        free_by,
        slowed_by,
    )


@compiled
def acknowledged_in(sent_fields: Plain, acknowledged: IntArray) -> Plain:
    """
    Return the telegrams with what trains are known to go by.

    A telegram without commands says nothing about those before it: they may be lost.

    Parameters
    ----------
    sent_fields
        Of :class:`Sent`, plain.
    acknowledged
        Each train is known to have the telegram of this cycle. shape (n_trains,)

    Returns
    -------
    Plain
        The fields of :class:`Sent`.
    """
    sent = Sent(*sent_fields)
    known = sent.known.copy()
    for slot in range(sent.cycle.size):
        for train in range(known.size):
            same = sent.cycle[slot] == acknowledged[train]
            if same and sent.furthest_m[slot, train] > -np.inf:
                known[train] = acknowledged[train]
    return (
        sent.cycle,
        sent.sent_s,
        sent.eoa_m,
        sent.speed_mps,
        sent.free_m,
        sent.furthest_m,
        known,
        sent.older,
        sent.older_m,
        sent.free_by,
        sent.slowed_by,
    )


@compiled
def covered_of(sent_fields: Plain, present: BoolArray) -> FloatArray:
    """
    Return the furthest ends of the maps that are not replaced for everybody yet.

    A train that was sent nothing, or took nothing, goes on by what it has.

    Parameters
    ----------
    sent_fields
        Of :class:`Sent`, plain.
    present
        Trains on the line. shape (n_trains,)

    Returns
    -------
    FloatArray
        [m], shape (n_trains,)
    """
    sent, effective = Sent(*sent_fields), FOREVER
    size = present.size
    for train in range(size):
        if present[train]:
            effective = min(effective, sent.known[train])
    furthest_m = np.full(size, -np.inf)
    for slot in range(sent.cycle.size):
        if sent.cycle[slot] >= effective:
            for train in range(size):
                furthest_m[train] = max(furthest_m[train], sent.furthest_m[slot, train])
    if sent.older >= effective:
        for train in range(size):
            furthest_m[train] = max(furthest_m[train], sent.older_m[train])
    return furthest_m
