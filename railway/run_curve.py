"""Run curves of one train alone on the line."""

from dataclasses import dataclass

import numpy as np

from railway.arrays import FloatArray
from railway.line import Line
from railway.profile import Profile, build_profile
from railway.rolling_stock import TrainType

SPEED_SPACING_MPS = 0.01


@dataclass(frozen=True, slots=True)
class RunCurve:
    """Speed and time of a front against chainage, one entry per point of the curve."""

    chainage_m: FloatArray
    speed_mps: FloatArray
    time_s: FloatArray
    """Time since the start. [s]"""

    @property
    def run_time_s(self) -> float:
        """Time from start to stop. [s]."""
        return float(self.time_s[-1])


def fastest_run(line: Line, train_type: TrainType, start_m: float, stop_m: float) -> RunCurve:
    r"""
    Return the fastest run from rest to rest.

    The train accelerates with full traction against running resistance, gradient and
    curves, holds the line ceiling and brakes with the service brake. With the kinetic energy
    per unit of mass :math:`e = v^2 / 2` the motion is

    .. math:: \frac{de}{dx} = \frac{F(v) - R(v)}{M} - r(x), \qquad e \le e_{ceiling}(x),
              \qquad e \le P(x_{stop}) - P(x)

    integrated by Heun's rule over the cells of :mod:`railway.profile`; the acceleration is
    constant within a cell.

    Parameters
    ----------
    line
        The line.
    train_type
        The train.
    start_m
        Where the front stands at first. [m]
    stop_m
        Where the front comes to rest. [m]

    Returns
    -------
    RunCurve
        The curve, start and stop included.

    Raises
    ------
    ValueError
        If the stop is not ahead of the start, or a gradient is too steep to climb.
    """
    if not stop_m > start_m:
        message = f"stop_m must be above start_m = {start_m}, is {stop_m}"
        raise ValueError(message)
    profile = build_profile(line, [train_type], step_s=0.0)
    inner_m = profile.grid_m[(profile.grid_m > start_m) & (profile.grid_m < stop_m)]
    chainage_m = np.concatenate([[start_m], inner_m, [stop_m]])
    energy = _accelerate(profile, train_type, chainage_m, _energy_cap(profile, chainage_m))
    speed_mps = np.sqrt(2.0 * energy)
    if np.any(speed_mps[1:-1] <= 0.0):
        message = f"the train {train_type.id} cannot climb the line between {start_m} and {stop_m}"
        raise ValueError(message)
    steps_s = 2.0 * np.diff(chainage_m) / (speed_mps[1:] + speed_mps[:-1])
    return RunCurve(chainage_m, speed_mps, np.concatenate([[0.0], np.cumsum(steps_s)]))


def _energy_cap(profile: Profile, chainage_m: FloatArray) -> FloatArray:
    """Return the lower of line ceiling and brake curve into the last point. [m2/s2]."""
    grid_m = profile.grid_m
    potential = np.interp(chainage_m, grid_m, profile.potential_m2ps2[0])
    ceiling = np.interp(chainage_m, grid_m, profile.ceiling_m2ps2[0])
    cap: FloatArray = np.minimum(ceiling, np.maximum(potential[-1] - potential, 0.0))
    cap[0] = cap[-1] = 0.0
    return cap


def _accelerate(
    profile: Profile, train_type: TrainType, chainage_m: FloatArray, cap: FloatArray
) -> FloatArray:
    speeds_mps = np.arange(0.0, train_type.maximum_speed_mps + 1.0, SPEED_SPACING_MPS)
    level: list[float] = train_type.level_acceleration_mps2(speeds_mps).tolist()
    drag: list[float] = np.interp(chainage_m, profile.grid_m, profile.drag_mps2[0]).tolist()
    steps_m: list[float] = np.diff(chainage_m).tolist()

    def pull(energy: float) -> float:
        place = float((2.0 * energy) ** 0.5) / SPEED_SPACING_MPS
        index = min(int(place), len(level) - 2)
        return level[index] + (place - index) * (level[index + 1] - level[index])

    energies = [0.0]
    for index, (step_m, limit) in enumerate(zip(steps_m, cap[1:].tolist(), strict=True)):
        energy = energies[-1]
        slope = pull(energy) - drag[index]
        ahead = max(energy + step_m * slope, 0.0)
        mean_slope = 0.5 * (slope + pull(ahead) - drag[index + 1])
        energies.append(max(min(energy + step_m * mean_slope, limit), 0.0))
    return np.array(energies)
