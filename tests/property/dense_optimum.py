"""
The run of least energy for a given time by dynamic programming over distance and speed.

Nothing is assumed of the shape of the run: at every place any force between the service brake
and full traction may act. Time has a price, found by bisection so that the run takes its time.
It shares no code with what it judges; of the line it knows limits, gradients and curves.
"""

from dataclasses import dataclass
from math import inf, log, sqrt
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import compiled
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.rolling_stock import TrainType
from tests.property.dense_run import (
    GRAVITY,
    curvatures,
    inertial_kg,
    pull_n,
    restrictions,
    rolling_n,
    slopes,
)

CELL_M = 5.0
SPEEDS = 400
CHOICES = 16
"""Speeds at the end of a cell that are tried from each speed at its start."""
FINE_M = 0.05
TABLE_MPS = 0.02
LOOK_AHEAD_M = 1000.0
LAST_M = 20.0
LAST_SHARE = 0.1
"""Cells over the last metres are finer by this. [-]"""
CHEAPEST, DEAREST = 0.01, 1e4
"""Prices of time between which the right one lies. [W/kg]"""


class Train(NamedTuple):
    """Per unit of inertial mass, by multiples of ``TABLE_MPS``."""

    pull: FloatArray
    roll: FloatArray
    electric: FloatArray
    brake: float
    bought: float
    sold: float


class Cells(NamedTuple):
    """Cells of a line."""

    step_m: FloatArray
    slope: FloatArray
    curve: FloatArray
    cap_mps: FloatArray


@dataclass(frozen=True)
class Optimum:
    """A run of least energy."""

    chainage_m: FloatArray
    speed_mps: FloatArray
    run_time_s: float
    net_j: float
    """From the wire less what is brought back, without auxiliaries. [J]"""
    bound_j: float
    """No run of the same time takes less, says the price of time. [J]"""


def _train(train: TrainType) -> Train:
    mass, supply = inertial_kg(train), train.supply
    speeds = np.arange(0.0, train.maximum_speed_mps + 2.0, TABLE_MPS)
    electric = [
        min(supply.regeneration_force_n, supply.regeneration_power_w / speed)
        if speed > supply.regeneration_cutoff_mps
        else 0.0
        for speed in speeds.tolist()
    ]
    return Train(
        np.array([pull_n(train, speed) for speed in speeds.tolist()]) / mass,
        np.array([rolling_n(train, speed) for speed in speeds.tolist()]) / mass,
        np.array(electric) / mass,
        train.service_brake_mps2,
        1.0 / supply.traction_efficiency,
        supply.regeneration_efficiency,
    )


def _cells(line: Line, train: TrainType, ends_m: tuple[float, float], cell_m: float) -> FloatArray:
    """Edges of cells; limits begin and end at edges."""
    places = {*ends_m}
    for enters_m, leaves_m, _ in restrictions(line, train.length_m):
        places |= {place for place in (enters_m, leaves_m) if ends_m[0] < place < ends_m[1]}
    marks = sorted(places)
    # The electric brake fades out just before the stop.
    marks = sorted({*marks, max(ends_m[1] - LAST_M, marks[-2])})
    sizes_m = [cell_m] * (len(marks) - 2) + [cell_m * LAST_SHARE]
    parts = [
        np.linspace(start, end, max(round((end - start) / size_m), 1) + 1)[:-1]
        for start, end, size_m in zip(marks[:-1], marks[1:], sizes_m, strict=True)
    ]
    edges: FloatArray = np.concatenate([*parts, [ends_m[1]]])
    return edges


def _caps_mps(line: Line, train: TrainType, edges_m: FloatArray) -> FloatArray:
    """Greatest speed from which all limits ahead, and the stop, can be kept."""
    end_m = float(edges_m[-1])
    fine_m = np.arange(float(edges_m[0]), end_m + LOOK_AHEAD_M, FINE_M)
    cap = np.full(fine_m.size, 0.5 * train.maximum_speed_mps**2)
    for enters_m, leaves_m, limit_mps in restrictions(line, train.length_m):
        inside = (fine_m > enters_m - FINE_M) & (fine_m < leaves_m + 1e-9)
        cap[inside] = np.minimum(cap[inside], 0.5 * limit_mps**2)
    cap[fine_m >= end_m] = 0.0
    weight = GRAVITY * train.mass_kg / inertial_kg(train)
    rise = weight * slopes(line, fine_m + 0.5 * FINE_M, train.length_m)
    height = np.concatenate([[0.0], np.cumsum(FINE_M * (train.service_brake_mps2 + rise))[:-1]])
    cap = np.minimum.accumulate((cap + height)[::-1])[::-1] - height
    found = np.interp(edges_m, fine_m, cap)
    # Just past the end of a limit the cap may jump up: an edge there keeps the limit.
    for _, leaves_m, limit_mps in restrictions(line, train.length_m):
        at = np.abs(edges_m - leaves_m) < 1e-6
        found[at] = np.minimum(found[at], 0.5 * limit_mps**2)
    found[-1] = 0.0
    speeds: FloatArray = np.sqrt(2.0 * np.maximum(found, 0.0))
    return speeds


def dense_optimum(
    line: Line,
    train: TrainType,
    ends_m: tuple[float, float],
    added_s: float,
    start_mps: float = 0.0,
    *,
    cell_m: float = CELL_M,
    speeds: int = SPEEDS,
) -> Optimum:
    """
    Return the best run from a speed to rest that takes so much longer than the fastest one.

    The fastest one is its own, at a very high price of time: a per mil of the run time, by which
    two ways of tabulating a line differ, is a tenth of a supplement of one per cent.
    """
    edges_m = _cells(line, train, ends_m, cell_m)
    middle_m = 0.5 * (edges_m[1:] + edges_m[:-1])
    weight = GRAVITY * train.mass_kg / inertial_kg(train)
    way = Cells(
        np.diff(edges_m),
        weight * slopes(line, middle_m, train.length_m),
        weight * curvatures(line, middle_m, train.length_m),
        _caps_mps(line, train, edges_m),
    )
    figures, mass = _train(train), inertial_kg(train)

    def at(logarithm: float) -> tuple[FloatArray, float, float, float]:
        """Speeds, time, net energy and the part of it that is left without the price of time."""
        price = float(np.exp(logarithm))
        value = _value(way, figures, price, speeds)
        speed_mps, time_s, net = _roll_out(way, figures, price, value, start_mps)
        node = start_mps / max(float(way.cap_mps[0]), 1e-9) * speeds
        at_start = float(np.interp(node, np.arange(speeds + 1.0), value[0]))
        return speed_mps, time_s, net, at_start

    shortest_s = at(log(DEAREST))[1]
    run_time_s = shortest_s + added_s

    def too_long(logarithm: float) -> float:
        return log(max(at(logarithm)[1] - shortest_s, 1e-4) / added_s)

    found = brentq(too_long, log(CHEAPEST), log(DEAREST), xtol=0.02)
    speed_mps, time_s, net, at_start = at(found)
    price = float(np.exp(found))
    # At a price of time the energy for a little more time follows from it.
    net_j = mass * (net + price * (time_s - run_time_s))
    return Optimum(edges_m, speed_mps, time_s, net_j, mass * (at_start - price * run_time_s))


@compiled
def _look(table: FloatArray, speed: float) -> float:
    place = speed / TABLE_MPS
    index = min(int(place), table.size - 2)
    value: float = table[index] + (place - index) * (table[index + 1] - table[index])
    return value


@compiled
def _cost(
    train: Train, price: float, before: float, after: float, step_m: float, drag: float
) -> float:
    """Energy and price of time of a cell between two speeds, infinite if no force does it."""
    if before + after <= 0.0:
        return inf
    speed = sqrt(0.5 * (before * before + after * after))
    force = 0.5 * (after * after - before * before) / step_m + _look(train.roll, speed) + drag
    time_s = 2.0 * step_m / (before + after)
    if force >= 0.0:
        return force * step_m * train.bought + price * time_s
    back = min(-force, _look(train.electric, speed))
    return -back * step_m * train.sold + price * time_s


@compiled
def _best(
    train: Train,
    price: float,
    before: float,
    way: tuple[float, float, float, float],
    value: FloatArray,
    choices: int,
) -> tuple[float, float]:
    """Return the least cost from a speed on, and the speed at the end of the cell."""
    step_m, slope, curve, cap = way
    e, drag = 0.5 * before * before, slope + curve
    roll = _look(train.roll, before)
    top = e + step_m * (_look(train.pull, before) - roll - drag)
    middle = sqrt(max(e + top, 0.0))
    top = e + step_m * (_look(train.pull, middle) - _look(train.roll, middle) - drag)
    coast = e - step_m * (roll + drag)
    middle = sqrt(max(e + coast, 0.0))
    coast = e - step_m * (_look(train.roll, middle) + drag)
    electric = coast - step_m * _look(train.electric, middle)
    bottom = e - step_m * (train.brake + slope)
    limit = 0.5 * cap * cap
    bottom, top = max(min(bottom, limit), 0.0), min(top, limit)
    least, chosen = inf, 0.0
    size = value.size - 1
    for choice in range(choices + 3):
        after = bottom + (top - bottom) * choice / (choices - 1)
        if choice == choices:
            after = coast
        elif choice == choices + 1:
            after = electric
        elif choice == choices + 2:
            after = e
        after = min(after, limit)
        if after < bottom - 1e-9 or after > top + 1e-9:
            continue
        speed = sqrt(2.0 * max(after, 0.0))
        place = size * speed / cap if cap > 0.0 else 0.0
        index = min(int(place), size - 1)
        ahead = value[index] + (place - index) * (value[index + 1] - value[index])
        total = _cost(train, price, before, speed, step_m, drag) + ahead
        if total < least:
            least, chosen = total, speed
    return least, chosen


@compiled
def _value(way: Cells, train: Train, price: float, speeds: int) -> FloatArray:
    points = way.cap_mps.size
    value = np.zeros((points, speeds + 1))
    for point in range(points - 2, -1, -1):
        cell = way.step_m[point], way.slope[point], way.curve[point], way.cap_mps[point + 1]
        for node in range(speeds + 1):
            before = way.cap_mps[point] * node / speeds
            value[point, node], _ = _best(train, price, before, cell, value[point + 1], CHOICES)
    return value


@compiled
def _roll_out(
    way: Cells, train: Train, price: float, value: FloatArray, start_mps: float
) -> tuple[FloatArray, float, float]:
    points = way.cap_mps.size
    speed = np.zeros(points)
    speed[0] = start_mps
    time_s, net = 0.0, 0.0
    for point in range(points - 1):
        cell = way.step_m[point], way.slope[point], way.curve[point], way.cap_mps[point + 1]
        _, after = _best(train, price, speed[point], cell, value[point + 1], 20 * CHOICES)
        speed[point + 1] = after
        took_s = 2.0 * way.step_m[point] / (speed[point] + after)
        drag = way.slope[point] + way.curve[point]
        cost = _cost(train, price, speed[point], after, way.step_m[point], drag)
        time_s += took_s
        net += cost - price * took_s
    return speed, time_s, net
