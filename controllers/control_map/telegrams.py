"""The telegrams of the control map: what the centre sends, and what of it may still be in force."""

from typing import NamedTuple

import numpy as np

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

    def added(
        self,
        when: tuple[int, float],
        commands: tuple[FloatArray, FloatArray],
        free_m: FloatArray,
        furthest_m: FloatArray,
        behind: tuple[IntArray, IntArray],
    ) -> "Sent":
        """
        Return the telegrams with another one in the place of the oldest.

        Parameters
        ----------
        when
            In which cycle, and when it is sent. [-] and [s]
        commands
            Ends and speeds. [m] and [m/s], shape (n_trains, n_moments)
        free_m
            How far the way is free. [m], shape (n_trains,)
        furthest_m
            Furthest of the ends; -inf for whom there are no commands. [m], shape (n_trains,)
        behind
            What the way is free up to, and what the run is slowed by. shape (n_trains,) each

        Returns
        -------
        Sent
            New arrays.
        """
        slot = int(self.cycle.argmin())
        sent = Sent(
            self.cycle.copy(),
            self.sent_s.copy(),
            self.eoa_m.copy(),
            self.speed_mps.copy(),
            self.free_m.copy(),
            self.furthest_m.copy(),
            self.known,
            int(self.cycle[slot]),
            np.maximum(self.older_m, self.furthest_m[slot]),
            self.free_by.copy(),
            self.slowed_by.copy(),
        )
        sent.cycle[slot], sent.sent_s[slot] = when
        sent.eoa_m[slot], sent.speed_mps[slot] = commands
        sent.free_m[slot] = free_m
        sent.furthest_m[slot] = furthest_m
        sent.free_by[slot], sent.slowed_by[slot] = behind
        return sent

    def acknowledged(self, acknowledged: IntArray) -> "Sent":
        """
        Return the same with what trains are known to go by.

        A telegram without commands says nothing about those before it: they may be lost.

        Parameters
        ----------
        acknowledged
            Each train is known to have the telegram of this cycle. shape (n_trains,)

        Returns
        -------
        Sent
            New cycles.
        """
        same = self.cycle[:, np.newaxis] == acknowledged
        has_commands = (same & (self.furthest_m > -np.inf)).any(axis=0)
        return self._replace(known=np.where(has_commands, acknowledged, self.known))

    def covered_m(self, present: BoolArray) -> FloatArray:
        """
        Return the furthest ends of the maps that are not replaced for everybody yet.

        A train that was sent nothing, or took nothing, goes on by what it has.

        Parameters
        ----------
        present
            Trains on the line. shape (n_trains,)

        Returns
        -------
        FloatArray
            [m], shape (n_trains,)
        """
        effective = self.known.min(initial=FOREVER, where=present)
        may_hold = (self.cycle >= effective)[:, np.newaxis]
        furthest_m: FloatArray = np.where(may_hold, self.furthest_m, -np.inf).max(axis=0)
        if self.older >= effective:
            furthest_m = np.maximum(furthest_m, self.older_m)
        return furthest_m


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


@compiled
def eoas_m(
    front_m: FloatArray,
    speed_mps: FloatArray,
    free_m: FloatArray,
    brake_fields: Plain,
    tolerance_m: float,
) -> FloatArray:
    """
    Return where trains that go by their plan can stop, and a little further; never too far.

    Parameters
    ----------
    front_m, speed_mps
        The plan. [m] and [m/s], shape (n_trains, n_moments)
    free_m
        How far the way is free. [m], shape (n_trains,)
    brake_fields
        Of :class:`~kankaku.railway.plan.brake_table.BrakeTable`, plain.
    tolerance_m
        The little. [m]

    Returns
    -------
    FloatArray
        [m], shape (n_trains, n_moments)
    """
    braking = BrakeTable(*brake_fields)
    eoa_m = np.empty_like(front_m)
    for train in range(front_m.shape[0]):
        for moment in range(front_m.shape[1]):
            stop_m = braked_stop_m(braking, train, front_m[train, moment], speed_mps[train, moment])
            eoa_m[train, moment] = min(stop_m + tolerance_m, free_m[train])
    return eoa_m
