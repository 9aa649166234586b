"""
Run curves of one train alone on the line: the fastest, and those for a given run time.

The way is cut into sections of constant limit. In each the train speeds up, cruises, coasts
and brakes; how far it cruises and from which speed it coasts are the two parameters of the
section (Sakai et al. 2020, section 3.2).
"""

from dataclasses import dataclass

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.errors import KankakuError
from kankaku.railway.motion.driving import Driving, Trace, trace
from kankaku.railway.motion.way import Way, way_on
from kankaku.railway.plan.buffers import Buffers
from kankaku.railway.plan.driving_style import DrivingStyle
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.profile import NO_BUFFERS, build_profile
from kankaku.railway.plan.rolling_stock import TrainType

TIME_TOLERANCE_S = 0.01
"""How exactly a given run time is met. [s]"""
SPEED_TOLERANCE_MPS = 1e-3
ONE_LEVEL_MPS = 0.1
"""Sections whose speeds differ by less take turns, later ones first. [m/s]"""
SLOWEST_MPS = 0.3
"""No coasting begins below this speed. [m/s]"""
LONGEST_S = 1e6
"""Stands for a run that never ends. [s]"""


class RunTimeError(KankakuError):
    """A run time that the train cannot meet by coasting."""


class StallError(KankakuError):
    """A gradient that the train cannot climb."""


@dataclass(frozen=True, slots=True, eq=False)
class RunCurve:
    """A run against chainage; arrays have one entry per point of the curve, (n_points,)."""

    chainage_m: FloatArray
    """Where the front is. [m]"""
    speed_mps: FloatArray
    """Speed there; its square is linear between points. [m/s]"""
    time_s: FloatArray
    """Time since the start. [s]"""
    traction_work_j: FloatArray
    """Work of traction at the wheel since the start. [J]"""

    @property
    def run_time_s(self) -> float:
        """Time from start to end. [s]."""
        return float(self.time_s[-1])


def fastest_run(
    line: Line,
    train_type: TrainType,
    start_m: float,
    stop_m: float,
    *,
    start_mps: float = 0.0,
    stop_mps: float = 0.0,
    buffers: Buffers = NO_BUFFERS,
) -> RunCurve:
    """
    Return the fastest run between two places, by default from rest to rest.

    The train accelerates with full traction, holds every limit as long as possible and
    brakes with the service brake.

    Parameters
    ----------
    line
        The line.
    train_type
        The train.
    start_m, stop_m
        Where the front starts and stops. [m]
    start_mps, stop_mps
        Its speed there; that at the stop is not exceeded. [m/s]
    buffers
        By how much the train counts as longer than it is where limits start and end.

    Returns
    -------
    RunCurve
        The curve.

    Raises
    ------
    StallError
        If a gradient is too steep to climb.
    ValueError
        If the stop is not ahead of the start, or the train starts faster than it may.

    References
    ----------
    .. [1] Sakai et al. 2020, section 3.2; limits with buffers by eq. (3).
    """
    return fastest(way_between(line, train_type, (start_m, stop_m), (start_mps, stop_mps), buffers))


def way_between(
    line: Line,
    train_type: TrainType,
    ends_m: tuple[float, float],
    speeds_mps: tuple[float, float],
    buffers: Buffers,
) -> Way:
    """
    Return the way of a train alone on a line.

    Parameters
    ----------
    line
        The line.
    train_type
        The train.
    ends_m
        Where the front starts and ends. [m]
    speeds_mps
        Its speed there; that at the end is not to be exceeded. [m/s]
    buffers
        By how much the train counts as longer than it is where limits start and end.

    Returns
    -------
    Way
        The way.

    Raises
    ------
    ValueError
        If the end is not ahead of the start, or the train starts faster than it may.
    """
    profile = build_profile(line, [train_type], buffers)
    way = way_on(profile, 0, train_type, ends_m, speeds_mps)
    allowed_mps = float(np.sqrt(2.0 * way.cap_m2ps2[0]))
    if speeds_mps[0] > allowed_mps + SPEED_TOLERANCE_MPS:
        message = f"start_mps may be up to {allowed_mps:.2f} at {ends_m[0]:g} m: {speeds_mps[0]:g}"
        raise ValueError(message)
    return way


def fastest(way: Way) -> RunCurve:
    """
    Return the fastest run along a way.

    Parameters
    ----------
    way
        The way.

    Returns
    -------
    RunCurve
        The curve.

    Raises
    ------
    StallError
        If a gradient is too steep to climb.
    """
    return curve_of(way, trace(way, Driving.fastest(way)))


def driven_along(way: Way, band_mps: float) -> RunCurve:
    """
    Return a run along a way as its drivers run when nobody hinders them.

    Parameters
    ----------
    way
        The way, of a driven train on a driven line.
    band_mps
        By how much the train gets slower by coasting before it speeds up again. [m/s]

    Returns
    -------
    RunCurve
        The curve.

    Raises
    ------
    StallError
        If a gradient is too steep to climb.
    """
    return curve_of(way, trace(way, Driving.coasting(way, band_mps)))


def driven_run_s(
    line: Line, train_type: TrainType, style: DrivingStyle, ends_m: tuple[float, float]
) -> float:
    """
    Return how long a run takes in a driving style when nobody hinders it.

    Parameters
    ----------
    line
        The line.
    train_type
        The train.
    style
        How it is driven, late or not.
    ends_m
        Where the front starts and stops. [m]

    Returns
    -------
    float
        From when it may depart to its stop. [s]

    Raises
    ------
    StallError
        If a gradient is too steep to climb.
    """
    driven = style.line(line), style.train(train_type)
    way = way_between(*driven, ends_m, (0.0, 0.0), NO_BUFFERS)
    return style.lag_s(train_type) + driven_along(way, style.coasting_band_mps).run_time_s


def curve_of(way: Way, seen: Trace) -> RunCurve:
    """
    Return the run curve of a trace.

    Parameters
    ----------
    way
        The way.
    seen
        How a train went along it.

    Returns
    -------
    RunCurve
        The curve.

    Raises
    ------
    StallError
        If the train did not reach the end.
    """
    if not np.isfinite(seen.run_time_s):
        raise stall_on(way)
    return curve_on(way, seen.energy_m2ps2, seen.work_m2ps2)


def stall_on(way: Way) -> StallError:
    """
    Return what is said of a way that a train cannot climb.

    Parameters
    ----------
    way
        The way.

    Returns
    -------
    StallError
        To be raised.
    """
    ends = f"{way.chainage_m[0]:g} and {way.chainage_m[-1]:g}"
    message = f"the train {way.train_type.id} cannot climb the line between {ends}"
    return StallError(message)


def curve_on(way: Way, energy_m2ps2: FloatArray, work_m2ps2: FloatArray) -> RunCurve:
    """
    Return a run along a way as a curve.

    Parameters
    ----------
    way
        The way.
    energy_m2ps2
        Half the square of the speed. [m2/s2], shape (n_points,)
    work_m2ps2
        Work of traction per unit of inertial mass in each cell. [m2/s2], shape (n_points - 1,)

    Returns
    -------
    RunCurve
        The curve.
    """
    speed_mps = np.sqrt(2.0 * energy_m2ps2)
    steps_s = 2.0 * np.diff(way.chainage_m) / (speed_mps[1:] + speed_mps[:-1])
    work_j = way.train_type.inertial_mass_kg * np.cumsum(work_m2ps2)
    return RunCurve(
        way.chainage_m,
        speed_mps,
        np.concatenate([[0.0], np.cumsum(steps_s)]),
        np.concatenate([[0.0], work_j]),
    )
