"""What detection sees ahead of every train, compiled."""

import math
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, compiled, formula
from kankaku.railway.step.state import NOTHING
from kankaku.railway.wayside.tiling import Tiling, place_of, place_of_front

ROUNDING_S = 1e-6
"""Times that differ by less are the same: sums of steps are not exact. [s]"""


class DetectedTrains(NamedTuple):
    """Where trains are, and what is granted to them; arrays of shape (n_trains,)."""

    front_m: FloatArray
    tail_m: FloatArray
    present: BoolArray
    granted_to_m: FloatArray
    """Where the first points that are not granted, or the first obstruction, begin. [m]"""
    granted_by: IntArray
    """Which of them, as in :class:`~kankaku.railway.step.state.LineState`."""
    route: IntArray
    """Route of each train, as the tilings count them."""
    rows: IntArray
    """Rows of the trains that are present. shape (n_present,)"""


class CircuitsShown(NamedTuple):
    """What circuits show; arrays of shape (n_circuits,)."""

    occupied: BoolArray
    foremost: IntArray
    """Foremost train that touches it now; -1 for none."""


class Points(NamedTuple):
    """All turnouts."""

    fouling_m: FloatArray
    """Start and end of the fouling section of each. [m], shape (n_turnouts, 2)"""
    way: IntArray
    """
    Which of the parallel tracks each train takes there; -1 where it never passes.

    Shape (n_turnouts, n_trains).
    """


@formula
def touch(
    time_s: float,
    trains: DetectedTrains,
    circuits: Tiling,
    touched_s: FloatArray,
    foremost: IntArray,
) -> None:
    """
    Note which circuits trains touch now.

    Parameters
    ----------
    time_s
        Now. [s]
    trains
        The trains.
    circuits
        The circuits.
    touched_s
        When each was touched last; written to. [s], shape (n_circuits,)
    foremost
        Foremost train that touches each; written to. shape (n_circuits,)
    """
    for train in trains.rows:
        route = trains.route[train]
        place = place_of_front(circuits, route, trains.front_m[train])
        while place >= circuits.first[route] and circuits.end_m[place] > trains.tail_m[train]:
            circuit = circuits.piece[place]
            touched_s[circuit] = time_s
            if foremost[circuit] < 0 or (trains.front_m[foremost[circuit]] < trains.front_m[train]):
                foremost[circuit] = train
            place -= 1


@compiled
def dangers_m(trains: DetectedTrains, circuits: Tiling, shown: CircuitsShown) -> FloatArray:
    """
    Return how far the circuits ahead of each train are free, locked points left aside.

    Parameters
    ----------
    trains
        The trains.
    circuits
        The circuits.
    shown
        What they show.

    Returns
    -------
    FloatArray
        Start of the first circuit that is not; infinite where all are. [m], shape (n_trains,)
    """
    danger_m = np.full(trains.front_m.size, np.inf)
    for train in trains.rows:
        route = trains.route[train]
        place = place_of_front(circuits, route, trains.front_m[train])
        last = circuits.first[route + 1]
        if shown.foremost[circuits.piece[place]] == train:
            place += 1
            while place < last and not shown.occupied[circuits.piece[place]]:
                place += 1
        if place < last:
            danger_m[train] = circuits.start_m[place]
        if trains.granted_to_m[train] < circuits.end_m[last - 1]:
            ungranted = place_of(circuits, route, trains.granted_to_m[train])
            danger_m[train] = min(danger_m[train], circuits.start_m[ungranted])
    return danger_m


@formula
def lower_to_locked_points(
    danger_m: FloatArray, trains: DetectedTrains, circuits: Tiling, points: Points
) -> None:
    """
    End the way of trains before points that others have locked for another way.

    Parameters
    ----------
    danger_m
        How far the way of each train is free; written to. [m], shape (n_trains,)
    trains
        The trains.
    circuits
        The circuits.
    points
        The points.
    """
    for turnout in range(points.way.shape[0]):
        start_m, end_m = points.fouling_m[turnout]
        locked = -1
        for train in trains.rows:
            way = points.way[turnout, train]
            within = trains.front_m[train] > start_m and trains.tail_m[train] < end_m
            if way >= 0 and within:
                # DetectedTrains on two ways at once should not be; then nobody else may come.
                free = locked == -1 or locked == way  # noqa: PLR1714 - a set is made anew each time
                locked = way if free else -2
        if locked == -1:
            continue
        for train in trains.rows:
            way = points.way[turnout, train]
            comes = way >= 0 and way != locked and trains.front_m[train] <= start_m
            if comes:
                place = place_of(circuits, trains.route[train], start_m)
                danger_m[train] = min(danger_m[train], circuits.start_m[place])


@compiled
def _touched_by(trains: DetectedTrains, circuits: Tiling, before: IntArray) -> IntArray:
    """Return the rearmost train that touches each circuit; the last one where none does now."""
    touched_by = before.copy()
    rearmost_m = np.full(before.size, np.inf)
    for train in trains.rows:
        route = trains.route[train]
        place = place_of_front(circuits, route, trains.front_m[train])
        while place >= circuits.first[route] and circuits.end_m[place] > trains.tail_m[train]:
            circuit = circuits.piece[place]
            if trains.front_m[train] < rearmost_m[circuit]:
                rearmost_m[circuit], touched_by[circuit] = trains.front_m[train], train
            place -= 1
    return touched_by


@compiled
def _danger_by(
    danger_m: FloatArray,
    trains: DetectedTrains,
    circuits: Tiling,
    shown: CircuitsShown,
    rearmost: IntArray,
    points: Points,
) -> IntArray:
    """Return what is in the circuit before which the way of each train ends; a train first."""
    danger_by = np.full(danger_m.size, NOTHING)
    for train in trains.rows:
        if danger_m[train] == np.inf:
            continue
        place = place_of(circuits, trains.route[train], danger_m[train])
        circuit = circuits.piece[place]
        own = place <= place_of_front(circuits, trains.route[train], trains.front_m[train])
        ahead = shown.foremost[circuit] if own else rearmost[circuit]
        if shown.occupied[circuit] and ahead != train:
            danger_by[train] = ahead
        elif trains.granted_to_m[train] < circuits.end_m[place]:
            danger_by[train] = trains.granted_by[train]
        else:
            for turnout in range(points.way.shape[0]):
                start_m = points.fouling_m[turnout, 0]
                if points.way[turnout, train] >= 0 and (
                    circuits.start_m[place] <= start_m < circuits.end_m[place]
                ):
                    danger_by[train] = NOTHING - 1 - turnout
    return danger_by


@formula
def _to_go_m(front_m: float, tail_m: float, place: int, circuits: Tiling, points: Points) -> float:
    """Return how far a train goes before a circuit or points behind or ahead of it change. [m]"""
    to_go_m: float = max(circuits.end_m[place] - tail_m, 0.0)
    if circuits.start_m[place] > tail_m:
        to_go_m = circuits.start_m[place] - tail_m
    for turnout in range(points.way.shape[0]):
        start_m, end_m = points.fouling_m[turnout]
        if front_m <= start_m:
            to_go_m = min(to_go_m, start_m - front_m)
        if tail_m <= end_m:
            to_go_m = min(to_go_m, end_m - tail_m)
    return to_go_m


@compiled
def look_ahead(
    time_s: float,
    train_fields: Plain,
    moving: tuple[FloatArray, BoolArray],
    line_fields: tuple[
        tuple[IntArray, IntArray, FloatArray, FloatArray], tuple[FloatArray, IntArray]
    ],
    before: tuple[float, FloatArray, IntArray],
    figures: tuple[float, float, float],
) -> tuple[FloatArray, IntArray, FloatArray, IntArray, float]:
    """
    Return what the circuits show, how far ways are free, and until when that holds.

    Parameters
    ----------
    time_s
        Now. [s]
    train_fields
        :class:`DetectedTrains` as a plain tuple.
    moving
        Speed of each train [m/s], and whether it runs; shape (n_trains,)
    line_fields
        Circuits as a plain :class:`Tiling`, and plain :class:`Points`.
    before
        When was looked last [s], when each circuit had been touched [s], and by whom.
    figures
        Release delay [s], length of a step [s], greatest acceleration of any train [m/s2].

    Returns
    -------
    tuple[FloatArray, IntArray, FloatArray, IntArray, float]
        Times and trains of the last touch of each circuit, where the way of each train ends and
        by what, and until when nothing of that changes. [s], [m]
    """
    trains = DetectedTrains(*train_fields)
    circuits, points = Tiling(*line_fields[0]), Points(*line_fields[1])
    looked_s, before_s, before_by = before
    release_s, step_s, most_mps2 = figures
    # What was touched then was touched until now, or until a step ago at least.
    touched_s = np.where(before_s == looked_s, time_s - step_s, before_s)
    foremost = np.full(touched_s.size, -1, dtype=np.intp)
    touch(time_s, trains, circuits, touched_s, foremost)
    shown = CircuitsShown(time_s - touched_s <= release_s, foremost)
    danger_m = dangers_m(trains, circuits, shown)
    lower_to_locked_points(danger_m, trains, circuits, points)
    touched_by = _touched_by(trains, circuits, before_by)
    danger_by = _danger_by(danger_m, trains, circuits, shown, touched_by, points)
    until_s = np.inf
    for circuit in range(touched_s.size):
        if shown.occupied[circuit] and touched_s[circuit] < time_s:
            until_s = min(until_s, touched_s[circuit] + release_s)
    for train in trains.rows:
        if moving[1][train]:
            front_m, tail_m = trains.front_m[train], trains.tail_m[train]
            place = place_of(circuits, trains.route[train], tail_m)
            to_go_m = _to_go_m(front_m, tail_m, place, circuits, points)
            speed = moving[0][train]
            run_s = math.sqrt(speed * speed + 2.0 * most_mps2 * to_go_m) - speed
            until_s = min(until_s, time_s + run_s / most_mps2)
    return touched_s, touched_by, danger_m, danger_by, until_s - ROUNDING_S
