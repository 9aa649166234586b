"""Time and distance of full acceleration, tabulated so that forecasts need no integration."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import compiled, count_up_to, formula, interpolated
from kankaku.railway.plan.rolling_stock import TrainType

SPEED_CELL_MPS = 0.05


@dataclass(frozen=True, slots=True)
class RunUp:
    """Time and distance of full acceleration from rest on the level, against speed."""

    speed_mps: FloatArray
    time_s: FloatArray
    distance_m: FloatArray

    @classmethod
    def of(cls, train: TrainType) -> Self:
        """
        Tabulate the run-up of a train.

        Parameters
        ----------
        train
            Its type.

        Returns
        -------
        RunUp
            Arrays of shape (n_speeds,).
        """
        cells = int(np.ceil(train.maximum_speed_mps / SPEED_CELL_MPS))
        speed = SPEED_CELL_MPS * np.arange(cells + 1, dtype=np.float64)
        middle = 0.5 * (speed[1:] + speed[:-1])
        steps_s = SPEED_CELL_MPS / np.maximum(train.level_acceleration_mps2(middle), 0.01)
        time_s = np.concatenate([[0.0], np.cumsum(steps_s)])
        distance_m = np.concatenate([[0.0], np.cumsum(steps_s * middle)])
        return cls(speed, time_s, distance_m)

    def between(self, low_mps: float, high_mps: float) -> tuple[float, float]:
        """
        Return time and distance from one speed to a higher one.

        Parameters
        ----------
        low_mps
            From. [m/s]
        high_mps
            To; not below ``low_mps``. [m/s]

        Returns
        -------
        tuple[float, float]
            Time [s] and distance [m].
        """
        ends = (low_mps, high_mps)
        times = np.interp(ends, self.speed_mps, self.time_s)
        distances = np.interp(ends, self.speed_mps, self.distance_m)
        return float(times[1] - times[0]), float(distances[1] - distances[0])


class RunUpTable(NamedTuple):
    """The run-ups of some train types, one after the other."""

    time_s: FloatArray
    distance_m: FloatArray
    starts: IntArray
    """Where each of them begins, and where the last one ends. shape (n_types + 1,)"""

    @classmethod
    def of(cls, run_ups: Sequence[RunUp]) -> Self:
        """
        Lay run-ups out for compiled functions.

        Parameters
        ----------
        run_ups
            By train type.

        Returns
        -------
        RunUpTable
            For :func:`shortest_s`.
        """
        return cls(
            np.concatenate([one.time_s for one in run_ups]),
            np.concatenate([one.distance_m for one in run_ups]),
            np.cumsum([0, *(one.speed_mps.size for one in run_ups)]),
        )


@formula
def shortest_s(
    table: RunUpTable, kind: int, run: tuple[float, float, float], brake_mps2: float
) -> float:
    """
    Return the shortest time to a stop: accelerate, cruise, brake.

    Parameters
    ----------
    table
        The run-ups.
    kind
        Which of them.
    run
        Distance to the stop [m], present speed [m/s], and the speed not to be exceeded [m/s].
    brake_mps2
        Deceleration. [m/s2]

    Returns
    -------
    float
        Time. [s]
    """
    distance_m, speed, top_mps = run
    first, last = table.starts[kind], table.starts[kind + 1] - 1
    here = _cell(speed, first, last)
    wanted_m = distance_m + interpolated(table.distance_m, here)
    low, high = first, last
    while high - low > 1:
        middle = (low + high) // 2
        mps = SPEED_CELL_MPS * (middle - first)
        if table.distance_m[middle] + 0.5 * mps * mps / brake_mps2 <= wanted_m:
            low = middle
        else:
            high = middle
    low_mps, high_mps = SPEED_CELL_MPS * (low - first), SPEED_CELL_MPS * (high - first)
    low_m = table.distance_m[low] + 0.5 * low_mps**2 / brake_mps2
    high_m = table.distance_m[high] + 0.5 * high_mps**2 / brake_mps2
    part = min(max((wanted_m - low_m) / (high_m - low_m), 0.0), 1.0)
    peak = max(min(low_mps + part * SPEED_CELL_MPS, top_mps), speed, 0.1)
    there = _cell(peak, first, last)
    up_m = interpolated(table.distance_m, there) - interpolated(table.distance_m, here)
    up_s = interpolated(table.time_s, there) - interpolated(table.time_s, here)
    cruise_m = distance_m - up_m - 0.5 * peak * peak / brake_mps2
    return float(up_s + max(cruise_m, 0.0) / peak + peak / brake_mps2)


@compiled
def covers_s(table: RunUpTable, kind: int, run: tuple[float, float, float]) -> float:
    """
    Return the shortest time to cover a distance.

    Parameters
    ----------
    table
        The run-ups.
    kind
        Which of them.
    run
        The distance [m], present speed [m/s], and the speed not to be exceeded [m/s].

    Returns
    -------
    float
        Time. [s]
    """
    distance_m, speed, top_mps = run
    first, last = table.starts[kind], table.starts[kind + 1] - 1
    here, top = _cell(speed, first, last), _cell(max(top_mps, speed), first, last)
    from_m, from_s = interpolated(table.distance_m, here), interpolated(table.time_s, here)
    up_m = interpolated(table.distance_m, top) - from_m
    if distance_m >= up_m:
        up_s = interpolated(table.time_s, top) - from_s
        return float(up_s + (distance_m - up_m) / max(top_mps, speed))
    low = first + count_up_to(table.distance_m[first : last + 1], from_m + distance_m) - 1
    cell_m = table.distance_m[low + 1] - table.distance_m[low]
    cell_s = table.time_s[low + 1] - table.time_s[low]
    part = (from_m + distance_m - table.distance_m[low]) / cell_m
    return float(table.time_s[low] + part * cell_s - from_s)


@formula
def _cell(speed_mps: float, first: int, last: int) -> float:
    return min(first + speed_mps / SPEED_CELL_MPS, last - 1e-6)
