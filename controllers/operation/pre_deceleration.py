"""
Pre-deceleration: lose the time that must be lost anyway at a lower speed (Sato et al. 2025, 4.2).

The plan of a train is two numbers: a ceiling, and the moment at which it is lifted so that
the train, speeding up, meets the first stage of two-stage deceleration just when its leader
may depart. Both follow from monotone equations in one variable.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from railway.arrays import FloatArray
from railway.rolling_stock import TrainType

SPEED_CELL_MPS = 0.05


@dataclass(frozen=True, slots=True)
class RunUp:
    """Time and distance of full acceleration from rest on the level, against speed."""

    speed_mps: FloatArray
    time_s: FloatArray
    distance_m: FloatArray

    @classmethod
    def of(cls, train: TrainType) -> "RunUp":
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

    def shortest_s(
        self, distance_m: float, speed_mps: float, top_mps: float, brake_mps2: float
    ) -> float:
        """
        Return the shortest time to a stop: accelerate, cruise, brake.

        Parameters
        ----------
        distance_m
            To the stop. [m]
        speed_mps
            Present speed. [m/s]
        top_mps
            Speed not to be exceeded. [m/s]
        brake_mps2
            Deceleration. [m/s2]

        Returns
        -------
        float
            Time. [s]
        """
        behind_m = float(np.interp(speed_mps, self.speed_mps, self.distance_m))
        to_peak_and_stop_m = self.distance_m + 0.5 * np.square(self.speed_mps) / brake_mps2
        peak = float(np.interp(distance_m + behind_m, to_peak_and_stop_m, self.speed_mps))
        peak = max(min(peak, top_mps), speed_mps, 0.1)
        up_s, up_m = self.between(speed_mps, peak)
        cruise_m = distance_m - up_m - 0.5 * peak**2 / brake_mps2
        return up_s + max(cruise_m, 0.0) / peak + peak / brake_mps2


class Slowing(NamedTuple):
    """A pre-deceleration: run no faster than this for so long, then speed up."""

    ceiling_mps: float
    lasts_s: float


class Approach(NamedTuple):
    """A train on its way to the place where its leader stands or will stand."""

    distance_m: float
    """To the leader's rear there, margins taken off. [m]"""
    speed_mps: float
    fastest_mps: float
    """Speed at which the first stage should begin if there is room for it. [m/s]"""
    slowest_mps: float
    first_stage_mps2: float
    service_brake_mps2: float
    run_up: RunUp


def slow_down(approach: Approach, wait_s: float) -> Slowing | None:
    """
    Return the pre-deceleration that spends a given time on the way to the first stage.

    Parameters
    ----------
    approach
        The way and the train.
    wait_s
        Time until the leader may depart. [s]

    Returns
    -------
    Slowing | None
        The plan; None if the train gets to the first stage later than that anyway.

    References
    ----------
    .. [1] Sato et al. 2025, section 4.2.
    """
    slowest, fastest = approach.slowest_mps, approach.fastest_mps
    if fastest <= slowest or _duration_s(approach, fastest, fastest) >= wait_s:
        return None
    if _longest_s(approach, slowest) <= wait_s:
        return Slowing(slowest, wait_s)
    entry = fastest
    if _longest_s(approach, fastest) < wait_s:
        entry = brentq(
            lambda speed: _longest_s(approach, speed) - wait_s, slowest, fastest, xtol=0.01
        )
        cruise = _lowest_cruise_mps(approach, entry)
    else:
        cruise = brentq(
            lambda speed: _duration_s(approach, speed, entry) - wait_s,
            _lowest_cruise_mps(approach, entry),
            entry,
            xtol=0.01,
        )
    up_s, _ = approach.run_up.between(cruise, entry)
    return Slowing(cruise, max(wait_s - up_s, 0.0))


def _cruise_m(approach: Approach, cruise_mps: float, entry_mps: float) -> float:
    """Return the distance left for cruising; negative where there is no room for the rest."""
    speed = approach.speed_mps
    to_cruise_m = 0.5 * (speed**2 - cruise_mps**2) / approach.service_brake_mps2
    if speed < cruise_mps:
        _, to_cruise_m = approach.run_up.between(speed, cruise_mps)
    _, to_entry_m = approach.run_up.between(cruise_mps, entry_mps)
    first_stage_m = 0.5 * entry_mps**2 / approach.first_stage_mps2
    return approach.distance_m - first_stage_m - to_cruise_m - to_entry_m


def _duration_s(approach: Approach, cruise_mps: float, entry_mps: float) -> float:
    """Return the time to the first stage; 0 where there is no room for such a run."""
    cruise_m = _cruise_m(approach, cruise_mps, entry_mps)
    if cruise_m < 0.0:
        return 0.0
    speed = approach.speed_mps
    to_cruise_s = (speed - cruise_mps) / approach.service_brake_mps2
    if speed < cruise_mps:
        to_cruise_s, _ = approach.run_up.between(speed, cruise_mps)
    to_entry_s, _ = approach.run_up.between(cruise_mps, entry_mps)
    return to_cruise_s + cruise_m / cruise_mps + to_entry_s


def _lowest_cruise_mps(approach: Approach, entry_mps: float) -> float:
    """Return the lowest cruising speed for which there is room."""
    slowest = approach.slowest_mps
    if _cruise_m(approach, slowest, entry_mps) >= 0.0:
        return slowest
    if _cruise_m(approach, entry_mps, entry_mps) < 0.0:
        return entry_mps
    root: float = brentq(
        lambda speed: _cruise_m(approach, speed, entry_mps), slowest, entry_mps, xtol=1e-6
    )
    return root + 1e-6


def _longest_s(approach: Approach, entry_mps: float) -> float:
    return _duration_s(approach, _lowest_cruise_mps(approach, entry_mps), entry_mps)
