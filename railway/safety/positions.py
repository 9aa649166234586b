"""Compiled loops of the monitor: who is ahead of whom, who is inside what, step by step."""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import compiled


class Trains(NamedTuple):
    """Trains of a block of steps; arrays of shape (n_columns, n_steps)."""

    front_m: FloatArray
    length_m: FloatArray
    """Shape (n_columns,). [m]"""
    present: BoolArray


class Circuits(NamedTuple):
    """Track circuits; arrays of shape (n_circuits,)."""

    ends_m: FloatArray
    """Start and end. [m], shape (n_circuits, 2)"""
    hold_m: FloatArray
    """Where trains are held that may not enter. [m]"""
    uses: BoolArray
    """The train's route passes the circuit. shape (n_columns, n_circuits)"""
    release_s: float
    """So long after the last touch a circuit is released. [s]"""
    touched_s: FloatArray
    """Written: when each circuit was touched last. [s]"""


@compiled
def nearest_on_track(
    trains: Trains,
    rear_m: FloatArray,
    columns: IntArray,
    ends_m: tuple[float, float],
    nearest_m: FloatArray,
) -> None:
    """Lower ``nearest_m`` to the nearest rear ahead on one track, step by step."""
    front_m, length_m, present = trains
    start_m, end_m = ends_m
    order = columns.copy()
    for step in range(front_m.shape[1]):
        # Trains hardly ever change their order, so sorting by insertion is one pass.
        for unsorted in range(1, order.size):
            column, place = order[unsorted], unsorted
            while place > 0 and front_m[order[place - 1], step] < front_m[column, step]:
                order[place] = order[place - 1]
                place -= 1
            order[place] = column
        lowest_m = np.inf
        for column in order:
            tail_m = front_m[column, step] - length_m[column]
            if not present[column, step] or tail_m >= end_m:
                continue
            nearest_m[column, step] = min(nearest_m[column, step], lowest_m)
            if front_m[column, step] > start_m:
                lowest_m = min(lowest_m, max(rear_m[column, step], start_m))


@compiled
def raise_to_entered(
    front_m: FloatArray,
    length_m: FloatArray,
    present: BoolArray,
    enters: BoolArray,
    ends_m: FloatArray,
    inside_m: FloatArray,
) -> None:
    """Raise ``inside_m`` to the depth of fronts in pieces that others are in at their entry."""
    for column in range(length_m.size):
        passed = 0
        while passed < ends_m.shape[0] and ends_m[passed, 0] < front_m[0, column]:
            passed += 1
        for step in range(present.shape[0]):
            ahead_m = front_m[step + 1, column]
            while passed < ends_m.shape[0] and ends_m[passed, 0] < ahead_m:
                start_m, end_m = ends_m[passed]
                for other in range(length_m.size):
                    within = (
                        other != column
                        and present[step, other]
                        and front_m[step + 1, other] > start_m
                        and front_m[step + 1, other] - length_m[other] < end_m
                    )
                    both = enters[column, passed] and enters[other, passed]
                    if within and both and present[step, column]:
                        inside_m[step, column] = max(inside_m[step, column], ahead_m - start_m)
                passed += 1


@compiled
def raise_to_depth(
    front_m: FloatArray,
    tail_m: FloatArray,
    present: BoolArray,
    track: IntArray,
    ends_m: tuple[float, float],
    inside_m: FloatArray,
) -> None:
    """Raise ``inside_m`` to the depth of fronts behind the first one on another track."""
    start_m, end_m = ends_m
    within = np.empty(track.size, dtype=np.bool_)
    for step in range(front_m.shape[0]):
        first = -1
        shared = False
        for column in range(track.size):
            within[column] = (
                present[step, column]
                and track[column] >= 0
                and front_m[step, column] > start_m
                and tail_m[step, column] < end_m
            )
            if not within[column]:
                continue
            shared = shared or (first >= 0 and track[column] != track[first])
            if first < 0 or front_m[step, column] > front_m[step, first]:
                first = column
        if shared:
            for column in range(track.size):
                if within[column] and front_m[step, column] < front_m[step, first]:
                    depth_m = front_m[step, column] - start_m
                    inside_m[step, column] = max(inside_m[step, column], depth_m)


@compiled
def nearest_unreleased(
    time_s: FloatArray, trains: Trains, circuits: Circuits, nearest_m: FloatArray
) -> None:
    """
    Lower ``nearest_m`` to the first track circuit ahead that is occupied or not released yet.

    A front counts as before the circuit that it stands in if another train is further on in it.
    """
    front_m, length_m, present = trains
    ends_m, hold_m, uses, release_s, touched_s = circuits
    between_m = _between_m(trains)
    for circuit in range(ends_m.shape[0]):
        start_m, end_m = ends_m[circuit]
        coming = _coming(uses[:, circuit], between_m, (start_m, end_m))
        for step in range(present.shape[1]):
            foremost_m = -np.inf
            for column in coming:
                here_m = front_m[column, step]
                within = here_m > start_m and here_m - length_m[column] < end_m
                if present[column, step] and within:
                    touched_s[circuit] = time_s[step]
                    foremost_m = max(foremost_m, here_m)
            if time_s[step] - touched_s[circuit] > release_s:
                if coming.size == 0:
                    break
                continue
            for column in range(length_m.size):
                here_m = front_m[column, step]
                ahead = here_m <= start_m or (here_m <= end_m and here_m < foremost_m)
                if ahead and uses[column, circuit]:
                    nearest_m[column, step] = min(nearest_m[column, step], hold_m[circuit])


@compiled
def _between_m(trains: Trains) -> tuple[FloatArray, FloatArray]:
    """Return the lowest tail and the highest front of every train while it is there. [m]"""
    front_m, length_m, present = trains
    lowest_m, highest_m = np.full(length_m.size, np.inf), np.full(length_m.size, -np.inf)
    for column in range(length_m.size):
        for step in range(present.shape[1]):
            if present[column, step]:
                here_m = front_m[column, step]
                lowest_m[column] = min(lowest_m[column], here_m - length_m[column])
                highest_m[column] = max(highest_m[column], here_m)
    return lowest_m, highest_m


@compiled
def _coming(
    uses: BoolArray, between_m: tuple[FloatArray, FloatArray], ends_m: tuple[float, float]
) -> IntArray:
    """Return the columns of the trains that come to a place which they use."""
    lowest_m, highest_m = between_m
    return np.flatnonzero(uses & (highest_m > ends_m[0]) & (lowest_m < ends_m[1]))


@compiled
def lower_to_platforms(
    front_m: FloatArray,
    rear_m: FloatArray,
    present: BoolArray,
    platform_m: FloatArray,
    comes_by: BoolArray,
    nearest_m: FloatArray,
) -> None:
    """
    Lower ``nearest_m`` to the starts of platform sections that another train's rear is in.

    ``platform_m`` has shape (2, n_columns, n_steps): the section that each train calls in next, or
    an empty one for a train that has entered its own. ``comes_by`` says whether the train of the
    last axis uses the track of the section of the train before it.
    """
    for step in range(present.shape[1]):
        for column in range(present.shape[0]):
            start_m, end_m = platform_m[0, column, step], platform_m[1, column, step]
            for other in range(present.shape[0]):
                if (
                    present[other, step]
                    and comes_by[step, column, other]
                    and front_m[other, step] > front_m[column, step]
                    and start_m < rear_m[other, step] < end_m
                ):
                    nearest_m[column, step] = min(nearest_m[column, step], start_m)
