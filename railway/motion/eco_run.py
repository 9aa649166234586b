"""
The run between two places that takes a given time with the least net electrical energy.

Kawashima's form of driving gives every section of constant limit a target speed at or below the
limit and searches the combination that keeps the run time with the least energy. Here Pontryagin's
principle (:mod:`kankaku.railway.motion.extremal`) ties the targets, and the places where coasting
and braking begin, to one price of time, and the price is found that keeps the run time.
"""

from dataclasses import dataclass

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import compiled, formula
from kankaku.railway.motion.acceleration import accelerations, energy_gain
from kankaku.railway.motion.climbing import climbing_floor
from kankaku.railway.motion.electric_brake import electric_brake_n
from kankaku.railway.motion.extremal import (
    BRAKING,
    COASTING,
    HOLDING,
    SPEEDING_UP,
    Extremal,
    extremal,
)
from kankaku.railway.motion.run_curve import (
    LONGEST_S,
    SLOWEST_MPS,
    TIME_TOLERANCE_S,
    RunCurve,
    RunTimeError,
    curve_on,
    stall_on,
    way_between,
)
from kankaku.railway.motion.way import Way
from kankaku.railway.plan.buffers import Buffers
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.profile import NO_BUFFERS
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.roots import root_of

PRICES_WPKG = (1e-6, 1e7)
"""Prices of time at which nothing but energy, and nothing but time counts. [W/kg]"""
FIRST_PRICE_WPKG = 30.0
"""Price that makes an ordinary run a few per cent longer. [W/kg]"""
STEP = 0.3
"""How far beyond the expected price the other side is looked for, as a logarithm. [-]"""
PRICE_TOLERANCE = 1e-4
"""How exactly a price is found, as a logarithm. [-]"""
LEAST_ADDED_S = 1e-6
"""Stands for a run that is as fast as the fastest. [s]"""


@dataclass(frozen=True, slots=True, eq=False)
class EcoRun:
    """A run of least energy."""

    curve: RunCurve
    phase: IntArray
    """
    What the train does in each cell, from :mod:`kankaku.railway.motion.extremal`. shape (n_points -
    1,)
    """


def eco_run(  # noqa: PLR0913 - one argument per figure of a run
    line: Line,
    train_type: TrainType,
    start_m: float,
    stop_m: float,
    run_time_s: float,
    *,
    start_mps: float = 0.0,
    stop_mps: float = 0.0,
    buffers: Buffers = NO_BUFFERS,
) -> EcoRun:
    """
    Return the run of least energy between two places of a line.

    Parameters
    ----------
    line
        The line.
    train_type
        The train.
    start_m, stop_m
        Where the front starts and stops. [m]
    run_time_s
        The time, met within ``TIME_TOLERANCE_S``. [s]
    start_mps, stop_mps
        Speeds there; that at the stop is not exceeded. [m/s]
    buffers
        By how much the train counts as longer than it is where limits start and end.

    Returns
    -------
    EcoRun
        The run.

    Raises
    ------
    RunTimeError
        As :func:`eco`.
    StallError
        As :func:`eco`.
    ValueError
        As :func:`kankaku.railway.motion.run_curve.fastest_run`.
    """
    way = way_between(line, train_type, (start_m, stop_m), (start_mps, stop_mps), buffers)
    return eco(way, run_time_s)


def shortest_s(way: Way) -> float:
    """
    Return the time of the fastest run along a way, in the cells in which :func:`eco` counts.

    Parameters
    ----------
    way
        The way.

    Returns
    -------
    float
        The time. [s]

    Raises
    ------
    StallError
        If a gradient is too steep to climb.
    """
    run_time_s = extremal(way, PRICES_WPKG[1]).run_time_s
    if not np.isfinite(run_time_s):
        raise stall_on(way)
    return run_time_s


def eco(
    way: Way,
    run_time_s: float,
    *,
    least_slack_s: float = 0.0,
    tolerance_s: float = TIME_TOLERANCE_S,
) -> EcoRun:
    """
    Return the run of least net electrical energy along a way.

    Parameters
    ----------
    way
        The way.
    run_time_s
        The time. [s]
    least_slack_s
        Time that has to be left over the fastest run. [s]
    tolerance_s
        How exactly the time is met. [s]

    Returns
    -------
    EcoRun
        The run, which takes that time within the tolerance.

    Raises
    ------
    RunTimeError
        If the fastest run takes longer, or the train cannot be so slow.
    StallError
        If a gradient is too steep to climb.

    References
    ----------
    .. [1] H. Kawashima, in Takaoka et al. 1991, section 3.3, fig. 4.
    """
    quickest = extremal(way, PRICES_WPKG[1])
    if not np.isfinite(quickest.run_time_s):
        raise stall_on(way)
    fastest_s = quickest.run_time_s
    if run_time_s < fastest_s + least_slack_s - tolerance_s:
        message = f"a run of {run_time_s:.2f} s is not possible: the fastest takes {fastest_s:.2f}"
        raise RunTimeError(message)
    if run_time_s <= fastest_s + tolerance_s:
        return _eco_run(way, quickest)
    floor = climbing_floor(way, quickest.energy_m2ps2)
    found = _priced(way, floor, quickest, run_time_s, tolerance_s)
    if found.run_time_s < run_time_s - tolerance_s:
        found = _held_back(way, floor, found, run_time_s)
    return _eco_run(way, found)


def _kept_climbing(way: Way, floor: FloatArray, run: Extremal) -> Extremal:
    """Return a run that nowhere gets too slow to climb, and is as it was where it can be."""
    if not np.isfinite(run.run_time_s) or np.all(run.energy_m2ps2 >= floor):
        return run
    pull, coast = accelerations(way.train_type)
    energy, phase = run.energy_m2ps2.copy(), run.phase.copy()
    time_s = _raise_to_climb(
        way.chainage_m, way.drag_mps2, way.cap_m2ps2, floor, (pull, coast), energy, phase
    )
    return Extremal(energy, phase, time_s)


@formula
def _raise_to_climb(  # noqa: PLR0917 - compiled functions take plain arrays
    chainage_m: FloatArray,
    drag: FloatArray,
    cap: FloatArray,
    floor: FloatArray,
    rates: tuple[FloatArray, FloatArray],
    energy: FloatArray,
    phase: IntArray,
) -> float:
    """Raise a run to a floor, coast from there back to the run, and return its time."""
    pull, coast = rates
    time_s = 0.0
    for cell in range(phase.size):
        step_m = chainage_m[cell + 1] - chainage_m[cell]
        drags = drag[cell], drag[cell + 1]
        now, wish = energy[cell], max(energy[cell + 1], floor[cell + 1])
        coasted = now + energy_gain(coast, now, step_m, drags)
        most = now + energy_gain(pull, now, step_m, drags)
        ahead = max(min(wish, cap[cell + 1]), 0.0)
        if wish > energy[cell + 1]:
            ahead, phase[cell] = min(ahead, most), SPEEDING_UP
        elif coasted > wish and phase[cell] != BRAKING:
            ahead, phase[cell] = min(coasted, cap[cell + 1]), COASTING
        elif most < wish:
            ahead, phase[cell] = most, SPEEDING_UP
        energy[cell + 1] = max(ahead, 0.0)
        both_mps = np.sqrt(2.0 * now) + np.sqrt(2.0 * energy[cell + 1])
        if both_mps <= 0.0:
            return float(np.inf)
        time_s += 2.0 * step_m / both_mps
    return time_s


def _priced(
    way: Way, floor: FloatArray, quickest: Extremal, run_time_s: float, tolerance_s: float
) -> Extremal:
    """Return the run at the price that gives a run time, or the slowest one that is faster."""
    best, slack_s = quickest, run_time_s - quickest.run_time_s

    def too_long(logarithm: float) -> float:
        nonlocal best
        run = _kept_climbing(way, floor, extremal(way, float(np.exp(logarithm))))
        late_s = run.run_time_s - run_time_s
        if best.run_time_s < run.run_time_s <= run_time_s + tolerance_s:
            best = run
        if abs(late_s) <= tolerance_s:
            return 0.0
        # What is added to the shortest time falls about like the inverse of the price.
        return float(np.log(min(max(late_s + slack_s, LEAST_ADDED_S), LONGEST_S) / slack_s))

    lowest, highest = np.log(PRICES_WPKG)
    here = np.log(FIRST_PRICE_WPKG)
    value = too_long(here)
    while value != 0.0 and lowest < here < highest:
        there = here + value + np.copysign(STEP, value)
        ahead = too_long(there)
        if ahead * value < 0.0:
            root_of(too_long, here, there, xtol=PRICE_TOLERANCE)
            break
        here, value = there, ahead
    return best


def _held_back(way: Way, floor: FloatArray, run: Extremal, run_time_s: float) -> Extremal:
    """Hold a run below a speed: its time jumps at a price, or is longer than energy asks for."""

    def below(top_mps: float) -> Extremal:
        energy = np.minimum(run.energy_m2ps2, way.no_faster(top_mps).cap_m2ps2)
        phase = np.where(energy[1:] < run.energy_m2ps2[1:], HOLDING, run.phase)
        speed_mps = np.sqrt(2.0 * energy)
        steps_s = 2.0 * np.diff(way.chainage_m) / (speed_mps[1:] + speed_mps[:-1])
        return _kept_climbing(way, floor, Extremal(energy, phase, float(steps_s.sum())))

    def late_s(top_mps: float) -> float:
        return below(top_mps).run_time_s - run_time_s

    if late_s(SLOWEST_MPS) < 0.0:
        message = f"a run of {run_time_s:.2f} s is not possible: {run.run_time_s:.2f} at most"
        raise RunTimeError(message)
    fastest_mps = float(np.sqrt(2.0 * run.energy_m2ps2.max()))
    return below(root_of(late_s, SLOWEST_MPS, fastest_mps, xtol=1e-6))


def _eco_run(way: Way, seen: Extremal) -> EcoRun:
    works = np.maximum(_works(way, np.sqrt(2.0 * seen.energy_m2ps2)), 0.0)
    return EcoRun(curve_on(way, seen.energy_m2ps2, works), seen.phase)


def net_energy_j(way: Way, curve: RunCurve) -> float:
    """
    Return what a run takes from the wire less what it brings back, without auxiliaries.

    Parameters
    ----------
    way
        The way.
    curve
        A run along it, of least energy or any other.

    Returns
    -------
    float
        Work of traction over its efficiency, less that of the electric brake times its own. [J]
    """
    train, supply = way.train_type, way.train_type.supply
    work_j = train.inertial_mass_kg * _works(way, curve.speed_mps)
    squares = np.square(curve.speed_mps)
    electric_n = electric_brake_n(
        np.sqrt(0.5 * (squares[1:] + squares[:-1])),
        supply.regeneration_force_n,
        supply.regeneration_power_w,
        supply.regeneration_cutoff_mps,
    )
    sold_j = np.minimum(np.maximum(-work_j, 0.0), electric_n * np.diff(way.chainage_m)).sum()
    bought_j = np.maximum(work_j, 0.0).sum()
    return float(bought_j / supply.traction_efficiency - sold_j * supply.regeneration_efficiency)


def _works(way: Way, speed_mps: FloatArray) -> FloatArray:
    """Return the work of traction, or of the brake if negative, per unit of mass in each cell."""
    energy = 0.5 * np.square(speed_mps)
    _, coast = accelerations(way.train_type)
    works: FloatArray = np.diff(energy) - _coasted(way.chainage_m, way.drag_mps2, coast, energy)
    return works


@compiled
def _coasted(
    chainage_m: FloatArray, drag: FloatArray, coast: FloatArray, energy: FloatArray
) -> FloatArray:
    gains = np.empty(energy.size - 1)
    for cell in range(gains.size):
        step_m = chainage_m[cell + 1] - chainage_m[cell]
        gains[cell] = energy_gain(coast, energy[cell], step_m, (drag[cell], drag[cell + 1]))
    return gains
