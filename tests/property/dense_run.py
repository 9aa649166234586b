"""The fastest run by plain backward and forward integration over five-centimetre cells."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, sqrt

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.rolling_stock import TrainType

GRAVITY = 9.80665
CELL_M = 0.05
LOOK_AHEAD_M = 1000.0
"""A limit beyond the end may be so near that it has to be braked for before the end. [m]"""


@dataclass(frozen=True)
class Radio:
    """The safety buffers of Sakai 2020, eqs. (1) to (3), written out place by place."""

    error_ratio: float = 0.0
    delay_s: float = 0.0
    resolution_m: float = 0.0
    balises_m: tuple[float, ...] = (0.0,)

    def drifts_m(self, front_m: FloatArray) -> FloatArray:
        """What has drifted since the last balise, looked up among all of them. shape (n,)"""
        balises_m = np.array(self.balises_m)[:, None]
        last_m = np.where(balises_m <= front_m, balises_m, -inf).max(axis=0)
        found: FloatArray = self.error_ratio * (front_m - last_m)
        return found

    def front_buffer_m(self, front_m: float, speed_mps: float) -> float:
        return speed_mps * self.delay_s + self.rear_buffer_m(front_m)

    def rear_buffer_m(self, front_m: float) -> float:
        return float(self.drifts_m(np.array([front_m]))[0]) + self.resolution_m

    def first_front_m(self, place_m: float, speed_mps: float) -> float:
        """Where a front is when its buffer first reaches a place."""
        for balise_m, next_m in zip(self.balises_m, (*self.balises_m[1:], inf), strict=True):
            own_m = speed_mps * self.delay_s + self.resolution_m - self.error_ratio * balise_m
            front_m = (place_m - own_m) / (1.0 + self.error_ratio)
            if front_m < next_m:
                return front_m
        raise AssertionError

    def first_clear_m(self, place_m: float, length_m: float) -> float:
        """Where a front is when the buffer behind the tail first leaves a place."""
        for balise_m, next_m in zip(self.balises_m, (*self.balises_m[1:], inf), strict=True):
            tail_m = place_m + self.resolution_m - self.error_ratio * balise_m
            front_m = max((tail_m + length_m) / (1.0 - self.error_ratio), balise_m)
            if front_m < next_m:
                return front_m
        raise AssertionError


NO_RADIO = Radio()


def restrictions(
    line: Line, length_m: float, radio: Radio = NO_RADIO, widened_m: float = 0.0
) -> Sequence[tuple[float, float, float]]:
    """Between which fronts each limit holds, and the limit."""
    return [
        (
            radio.first_front_m(limit.start_m, limit.limit_mps) - widened_m,
            radio.first_clear_m(limit.end_m, length_m) + widened_m,
            limit.limit_mps,
        )
        for limit in line.limits
    ]


def shares(start_m: float, end_m: float, front_m: FloatArray, length_m: float) -> FloatArray:
    """Part of a train that stands on a stretch, by its front."""
    on_it_m = np.minimum(front_m, end_m) - np.maximum(front_m - length_m, start_m)
    found: FloatArray = np.maximum(on_it_m, 0.0) / length_m
    return found


def slopes(line: Line, front_m: FloatArray, length_m: float) -> FloatArray:
    """Gradient averaged over a train."""
    found = np.zeros(front_m.size)
    for stretch in line.gradients:
        found += stretch.gradient * shares(stretch.start_m, stretch.end_m, front_m, length_m)
    return found


def curvatures(line: Line, front_m: FloatArray, length_m: float) -> FloatArray:
    """Curve resistance averaged over a train, 600 kgf m/t over the radius, per unit of weight."""
    found = np.zeros(front_m.size)
    for curve in line.curves:
        found += 0.6 / curve.radius_m * shares(curve.start_m, curve.end_m, front_m, length_m)
    return found


def inertial_kg(train: TrainType) -> float:
    return train.mass_kg * (1.0 + train.rotating_mass_ratio)


def pull_n(train: TrainType, speed_mps: float) -> float:
    """Greatest tractive force: constant, then of constant power, then as the inverse square."""
    traction, speed = train.traction, max(speed_mps, 0.01)
    power_mps, characteristic_mps = traction.bends_mps
    power = min(1.0, power_mps / speed)
    return traction.starting_force_n * power * min(1.0, characteristic_mps / speed)


def rolling_n(train: TrainType, speed_mps: float) -> float:
    """Running resistance."""
    figures = train.resistance
    return figures.a_n + figures.b_nspm * speed_mps + figures.c_ns2pm2 * speed_mps**2


@dataclass(frozen=True)
class DenseRun:
    """A run against chainage."""

    chainage_m: FloatArray
    speed_mps: FloatArray
    run_time_s: float
    greatest_start_mps: float


def dense_run(
    line: Line,
    train: TrainType,
    ends_m: tuple[float, float],
    speeds_mps: tuple[float, float] = (0.0, 0.0),
    radio: Radio = NO_RADIO,
    *,
    widened_m: float = 0.0,
    traction: bool = True,
) -> DenseRun:
    """
    Brake down to all limits and to the end, backwards; then speed up below that, forwards.

    Without traction it coasts from the start. The time is infinite if it comes to a stand.
    """
    cells = round((ends_m[1] - ends_m[0]) / CELL_M)
    cell_m = (ends_m[1] - ends_m[0]) / cells
    edges_m: FloatArray = ends_m[0] + cell_m * np.arange(
        cells + round(LOOK_AHEAD_M / cell_m) + 1, dtype=np.float64
    )
    middle_m = 0.5 * (edges_m[1:] + edges_m[:-1])
    weight_mps2 = GRAVITY * train.mass_kg / inertial_kg(train)
    slope_mps2 = weight_mps2 * slopes(line, middle_m, train.length_m)
    curve_mps2 = weight_mps2 * curvatures(line, middle_m, train.length_m)

    caps = np.full(edges_m.size, 0.5 * train.maximum_speed_mps**2)
    for start_m, end_m, limit_mps in restrictions(line, train.length_m, radio, widened_m):
        near = (edges_m > start_m - cell_m) & (edges_m < end_m + cell_m)
        caps[near] = np.minimum(caps[near], 0.5 * limit_mps**2)
    caps[cells] = min(caps[cells], 0.5 * speeds_mps[1] ** 2)
    energies = caps.tolist()
    gains = (cell_m * (train.service_brake_mps2 + slope_mps2)).tolist()
    for cell in range(len(gains) - 1, -1, -1):
        energies[cell] = min(energies[cell], energies[cell + 1] + gains[cell])

    greatest_mps = sqrt(2.0 * energies[0])
    energies[0] = energy = 0.5 * speeds_mps[0] ** 2
    for cell, drag_mps2 in enumerate((slope_mps2 + curve_mps2)[:cells].tolist()):
        speed_mps = sqrt(2.0 * energy)
        force_n = traction * pull_n(train, speed_mps) - rolling_n(train, speed_mps)
        energy += cell_m * (force_n / inertial_kg(train) - drag_mps2)
        if energy < 0.0:
            return DenseRun(edges_m[: cells + 1], np.zeros(cells + 1), inf, greatest_mps)
        energies[cell + 1] = energy = min(energies[cell + 1], energy)
    speeds = np.sqrt(2.0 * np.array(energies[: cells + 1]))
    run_time_s = float(np.sum(2.0 * cell_m / (speeds[1:] + speeds[:-1])))
    return DenseRun(edges_m[: cells + 1], speeds, run_time_s, greatest_mps)
