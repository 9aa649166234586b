"""What maps are made from, and what they hold."""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import compiled
from kankaku.railway.step.state import NOTHING

MOST_OLD = 10
"""Steps for which a report is run on to the present; nobody plans with an older one. [-]"""


class Known(NamedTuple):
    """What the centre knows of trains; arrays of shape (n_trains,)."""

    since_s: FloatArray
    """When the last report was made. [s]"""
    front_m: FloatArray
    speed_mps: FloatArray
    call: IntArray
    leaves_s: FloatArray
    """When a train that stands at its stop leaves at the earliest; inf for others. [s]"""
    gone: BoolArray
    """Trains that have left the line."""
    granted_to_m: FloatArray
    """Where the first thing begins that is not granted to the train. [m]"""
    granted_by: IntArray
    """What that is."""


class Horizon(NamedTuple):
    """How far maps reach, and what they keep in reserve."""

    moments: int
    old_steps: int
    """Longest delay of a message that a train brakes, in steps. [-]"""
    reserve_steps: int
    """How much longer than it has to a train stands at its stop. [-]"""


class Scratch(NamedTuple):
    """Arrays that are written again for every train; shape (n_moments,) unless said."""

    eoa_m: FloatArray
    eoa_by: IntArray
    """What is at each end."""
    end_v2_m2ps2: FloatArray
    """Twice the brake potential at the ends of authority, margin taken off. [m2/s2]"""
    kept_v2_m2ps2: FloatArray
    """The same of the end that a train has kept since its report. [m2/s2], as path_m"""
    cap_mps: FloatArray
    trial_front_m: FloatArray
    trial_speed_mps: FloatArray
    path_m: FloatArray
    """A run from the train's report on. [m], shape (MOST_OLD + n_moments,)"""
    path_mps: FloatArray


class Aims(NamedTuple):
    """What a slower run is chosen by."""

    call: int
    """The call that it runs to."""
    due_s: float
    """When it is to be there at the earliest. [s]"""
    end_s: float
    """When the map ends. [s]"""
    fastest_mps: float
    """The line ceiling. [m/s]"""


class MapPlan(NamedTuple):
    """Run curves and bands on the grid of the map, of the trains that were on the line."""

    made_s: float
    rows: IntArray
    """The trains. shape (n_on_line,)"""
    place: IntArray
    """Where each train is among them; -1 for one that is not. shape (n_trains,)"""
    front_m: FloatArray
    """Run curves. [m], shape (n_on_line, n_moments)"""
    speed_mps: FloatArray
    """[m/s], shape (n_on_line, n_moments)"""
    rear_m: FloatArray
    """Rear of the bands. [m], shape (n_on_line, n_moments)"""
    ahead_m: FloatArray
    """Front of the bands: where trains can stop, and the margin. [m], (n_on_line, n_moments)"""
    free_m: FloatArray
    """Up to here the way was free when the map was made, margin taken off. [m], (n_trains,)"""
    planned: BoolArray
    """The train has been heard of lately and has a run. shape (n_trains,)"""
    free_by: IntArray
    """
    What the way was free up to, as :attr:`kankaku.railway.step.state.Authority.eoa_by`.
    (n_trains,)
    """
    slowed_by: IntArray
    """What the run is slower for than the line allows; ``NOTHING`` if it is not. (n_trains,)"""


@compiled
def blank_map(now_s: float, rows: IntArray, size: int, moments: int) -> MapPlan:
    """
    Return a map before anybody is planned for.

    Parameters
    ----------
    now_s
        When it is made. [s]
    rows
        The trains on the line. shape (n_on_line,)
    size
        Number of trains. [-]
    moments
        Its moments. [-]

    Returns
    -------
    MapPlan
        To be written to.
    """
    shape, place = (rows.size, moments), np.full(size, -1)
    for number in range(rows.size):
        place[rows[number]] = number
    return MapPlan(
        now_s,
        rows.copy(),
        place,
        np.zeros(shape),
        np.zeros(shape),
        np.zeros(shape),
        np.zeros(shape),
        np.zeros(size),
        np.zeros(size, dtype=np.bool_),
        np.full(size, NOTHING),
        np.full(size, NOTHING),
    )


@compiled
def scratch_for(moments: int) -> Scratch:
    """
    Return arrays to be written to.

    Parameters
    ----------
    moments
        Moments of a map. [-]

    Returns
    -------
    Scratch
        Of any values.
    """
    path = MOST_OLD + moments
    return Scratch(
        np.empty(moments),
        np.empty(moments, dtype=np.intp),
        np.empty(moments),
        np.empty(path),
        np.empty(path),
        np.empty(moments),
        np.empty(moments),
        np.empty(path),
        np.empty(path),
    )
