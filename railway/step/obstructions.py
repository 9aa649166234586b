"""Obstructions as signalling knows them in a step, and what is left of them afterwards."""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.plan.disruptions import Cause


class Obstruction(NamedTuple):
    """What was in the way, and when; nan for what never came."""

    id: str
    cause: Cause
    tracks: tuple[str, ...]
    start_m: float
    end_m: float
    requested_s: float
    """From now on no train is let in that can stop short of it. [s]"""
    established_s: float
    """From now on no train may enter it. [s]"""
    lifted_s: float
    """From now on trains may enter it. [s]"""


class WaysideState(NamedTuple):
    """
    Obstructions as signalling knows them; the arrays change with events only.

    Every turnout, level crossing and closure has one column for a whole run: turnouts first,
    then crossings, then closures, each in the order in which line and disruptions name them.
    A column is in force for a train that it concerns once ``from_s`` is not in the future.
    """

    start_m: FloatArray
    """Where trains have to stop short of it. [m], shape (n_obstructions,)"""
    end_m: FloatArray
    """Where the tail has passed it. [m], shape (n_obstructions,)"""
    from_s: FloatArray
    """When it begins, if announced; -inf once it is in force. [s], shape (n_obstructions,)"""
    until_s: FloatArray
    """
    When it is expected to end. [s], shape (n_obstructions,)

    Of points, when the throw under way will be proven for the next train through them and those
    that follow it the same way; of a level crossing, when it will be closed for the trains that
    have struck in. Infinite where nobody knows, or while it is only a train that is waited for:
    one that has not cleared the points, or not struck in.
    """
    concerns: BoolArray
    """
    Trains that may not enter it while it lasts. shape (n_trains, n_obstructions)

    What is announced only concerns the trains that have not come to it yet. Once a work zone is
    in force it no longer concerns the trains that are let through, nor any that has passed.
    """
    obstructed_m: FloatArray
    """Start of the first one in force that concerns each train, or far ahead. [m], (n_trains,)"""
    obstructed_by: IntArray
    """Its column; -1 where there is none. shape (n_trains,)"""
    surprised: BoolArray
    """
    Trains that a sudden obstruction may have come too near to. shape (n_trains,)

    Until they stand or have passed it, and ten seconds more: what they were told by radio may
    outlast it.
    """


def unobstructed(size: int, far_m: float) -> WaysideState:
    """
    Return a line without anything in the way.

    Parameters
    ----------
    size
        Number of trains. [-]
    far_m
        Chainage that stands for "nothing ahead". [m]

    Returns
    -------
    WaysideState
        Without columns.
    """
    nothing = np.zeros(0)
    return WaysideState(
        nothing,
        nothing,
        nothing,
        nothing,
        np.zeros((size, 0), dtype=np.bool_),
        np.full(size, far_m),
        np.full(size, -1, dtype=np.intp),
        np.zeros(size, dtype=np.bool_),
    )
