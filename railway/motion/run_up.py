"""Time and distance of full acceleration, tabulated so that forecasts need no integration."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.motion.kinematics import braking_distance_m
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
        to_peak_and_stop_m = self.distance_m + braking_distance_m(self.speed_mps, brake_mps2)
        peak = float(np.interp(distance_m + behind_m, to_peak_and_stop_m, self.speed_mps))
        peak = max(min(peak, top_mps), speed_mps, 0.1)
        up_s, up_m = self.between(speed_mps, peak)
        cruise_m = distance_m - up_m - float(braking_distance_m(peak, brake_mps2))
        return up_s + max(cruise_m, 0.0) / peak + peak / brake_mps2
