"""Where trains are by the turns of their wheels, and by how much that may be wrong."""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray
from kankaku.railway.compiled import Plain, compiled

RATIO = 0.02
"""The speed by wheels and the felt one agree if they differ by no more of it. [-]"""
TOLD_M = 0.2
"""A position that a balise corrects by more was wrong. [m]"""
ROUNDING_MPS = 1e-6


class Measured(NamedTuple):
    """What compiled functions read of :class:`~kankaku.railway.step.state.UnitState`."""

    odometer_m: FloatArray
    wheels_mps: FloatArray
    balise_m: FloatArray
    counted_m: FloatArray


class Before(NamedTuple):
    """What they read of :class:`Aboard`."""

    uncertain_m: FloatArray
    widened_m: FloatArray
    off_mps: FloatArray
    balise_m: FloatArray
    counted_m: FloatArray
    disagrees: BoolArray


class Located(NamedTuple):
    """Where trains are by their wheels; see :class:`Aboard`."""

    uncertain_m: FloatArray
    widened_m: FloatArray
    shift_m: FloatArray
    retreat_m: FloatArray
    off_mps: FloatArray
    disagrees: BoolArray
    wrong: BoolArray
    """A balise has corrected the position by too much."""
    news: bool
    """There is an alarm to be given."""


@compiled
def located(
    felt: tuple[FloatArray, FloatArray],
    measured_fields: Plain,
    before_fields: Plain,
    step_s: float,
    allowance_m: float,
) -> Plain:
    """
    Count wheels, and bound by how much they may be wrong.

    Parameters
    ----------
    felt
        Fronts and speeds, as they are felt. [m] and [m/s], shape (n_trains,) each
    measured_fields
        Of :class:`Measured`.
    before_fields
        Of :class:`Before`.
    step_s
        Length of a step. [s]
    allowance_m
        So wrong a position may be before the band is widened. [m]

    Returns
    -------
    Plain
        The fields of :class:`Located`.
    """
    (front_m, felt_mps), measured = felt, Measured(*measured_fields)
    before, size = Before(*before_fields), front_m.size
    uncertain_m, widened_m, shift_m, retreat_m, off_mps = np.zeros((5, size))
    disagrees, wrong = np.zeros((2, size), dtype=np.bool_)
    news = False
    for train in range(size):
        felt_here = felt_mps[train]
        off = abs(measured.wheels_mps[train] - felt_here)
        uncertain = before.uncertain_m[train]
        if measured.counted_m[train] != before.counted_m[train]:
            correction = measured.balise_m[train] - measured.counted_m[train]
            correction -= before.balise_m[train] - before.counted_m[train]
            retreat_m[train] = correction
            wrong[train] = abs(correction) > TOLD_M
            uncertain = 0.0
        uncertain += step_s * max(off, before.off_mps[train], RATIO * felt_here)
        widened = max(uncertain - allowance_m, 0.0)
        off_mps[train], uncertain_m[train], widened_m[train] = off, uncertain, widened
        retreat_m[train] += widened - before.widened_m[train]
        counted = measured.odometer_m[train] - measured.counted_m[train]
        place = measured.balise_m[train] + counted
        shift_m[train] = place + widened - front_m[train]
        disagrees[train] = off > RATIO * felt_here + ROUNDING_MPS
        found = disagrees[train] and not before.disagrees[train]
        news = news or found or wrong[train]
    return uncertain_m, widened_m, shift_m, retreat_m, off_mps, disagrees, wrong, news
