"""How a train moves along its way, cell by cell."""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import compiled, formula
from kankaku.railway.motion.acceleration import accelerations, energy_gain
from kankaku.railway.motion.way import Way

SPEEDING_UP, CRUISING, COASTING = 0, 1, 2


class Driving(NamedTuple):
    """How a train drives through the sections of a way; arrays of shape (n_sections,)."""

    target_mps: FloatArray
    """Speed up to this, and coast from it in the end. [m/s]"""
    cruise_m: FloatArray
    """Hold the target speed so far before coasting. [m]"""
    through: BoolArray
    """Coast all the way, from whatever speed the section is entered at."""
    again_mps: FloatArray
    """Speed up again where coasting has made it slower than this. [m/s]"""

    @classmethod
    def fastest(cls, way: Way) -> "Driving":
        """
        Return how to drive fastest.

        Parameters
        ----------
        way
            The way.

        Returns
        -------
        Driving
            Cruise at every limit as far as it goes.
        """
        sections = way.limit_mps.size
        never = np.zeros(sections)
        return cls(way.limit_mps, np.full(sections, np.inf), never > 0.0, never)

    @classmethod
    def coasting(cls, way: Way, band_mps: float) -> "Driving":
        """
        Return how to drive to the limits, coasting from each of them again and again.

        Parameters
        ----------
        way
            The way.
        band_mps
            By how much a train gets slower before it speeds up again. [m/s]

        Returns
        -------
        Driving
            The fastest one where it does not coast.
        """
        fastest = cls.fastest(way)
        if band_mps <= 0.0:
            return fastest
        again_mps = np.maximum(way.limit_mps - band_mps, 0.0)
        return fastest._replace(cruise_m=np.zeros(way.limit_mps.size), again_mps=again_mps)


class Trace(NamedTuple):
    """What came of a drive."""

    energy_m2ps2: FloatArray
    """Half the square of the speed. [m2/s2], shape (n_points,)"""
    work_m2ps2: FloatArray
    """Work of traction per unit of inertial mass in each cell. shape (n_points - 1,)"""
    run_time_s: float
    """Infinite if the train came to a stand on the way. [s]"""
    entry_mps: FloatArray
    """Speed at the start of each section. [m/s], shape (n_sections,)"""
    peak_mps: FloatArray
    """Speed up to which it sped up in each section; 0 if it did not. (n_sections,)"""
    cruised_m: FloatArray
    """How far it cruised in each section. [m], shape (n_sections,)"""


def trace(way: Way, drive: Driving) -> Trace:
    """
    Driving along a way.

    Parameters
    ----------
    way
        The way.
    drive
        How.

    Returns
    -------
    Trace
        What comes of it.
    """
    pull, coast = accelerations(way.train_type)
    return Trace(
        *_drive(
            way.chainage_m,
            way.cap_m2ps2,
            way.floor_m2ps2,
            way.drag_mps2,
            way.section,
            drive.target_mps,
            drive.cruise_m,
            drive.through,
            0.5 * np.square(drive.again_mps),
            0.5 * way.start_mps**2,
            pull,
            coast,
        )
    )


@formula
def _drive_cell(  # noqa: PLR0913, PLR0917 - compiled functions take plain arrays
    mode: int,
    energy: float,
    target: float,
    left_m: float,
    step_m: float,
    drags: tuple[float, float],
    pull: FloatArray,
    coast: FloatArray,
) -> tuple[float, int, float]:
    """Return the energy at the end of a cell, the mode there, and how far was cruised."""
    ahead, rest_m, run_m = energy, step_m, 0.0
    if mode == SPEEDING_UP:
        gain = energy_gain(pull, energy, step_m, drags)
        if energy + gain < target:
            return energy + gain, SPEEDING_UP, 0.0
        mode = CRUISING
        if energy < target:
            ahead, rest_m = target, step_m * (1.0 - (target - energy) / gain)
    if mode == CRUISING:
        run_m = min(rest_m, left_m)
        held = ahead + energy_gain(pull, ahead, run_m, drags)
        ahead = min(held, max(target, ahead))
        if run_m >= left_m:
            mode = COASTING
    if mode == COASTING:
        ahead += energy_gain(coast, ahead, rest_m - run_m, drags)
    return ahead, mode, run_m


@compiled
def _drive(  # noqa: PLR0913, PLR0917 - compiled functions take plain arrays
    chainage_m: FloatArray,
    cap: FloatArray,
    floor: FloatArray,
    drag: FloatArray,
    section: IntArray,
    target_mps: FloatArray,
    cruise_m: FloatArray,
    through: BoolArray,
    again: FloatArray,
    start_energy: float,
    pull: FloatArray,
    coast: FloatArray,
) -> tuple[FloatArray, FloatArray, float, FloatArray, FloatArray, FloatArray]:
    points, sections = chainage_m.size, target_mps.size
    energies, works = np.empty(points), np.empty(points - 1)
    entry, peak, cruised = np.zeros(sections), np.zeros(sections), np.zeros(sections)
    energies[0] = energy = start_energy
    now, mode, left_m, target, time_s = -1, SPEEDING_UP, 0.0, 0.0, 0.0
    for cell in range(points - 1):
        place, step_m = section[cell], chainage_m[cell + 1] - chainage_m[cell]
        drags = drag[cell], drag[cell + 1]
        if place != now:
            now = place
            entry[now] = np.sqrt(2.0 * energy)
            mode = COASTING if through[now] else SPEEDING_UP
            left_m = cruise_m[now]
            target = 0.5 * target_mps[now] * target_mps[now]
        if mode == COASTING and energy < again[now]:
            mode = SPEEDING_UP
        speeds_up = mode == SPEEDING_UP and energy < target
        ahead, mode, run_m = _drive_cell(mode, energy, target, left_m, step_m, drags, pull, coast)
        cruised[now] += run_m
        left_m -= run_m
        if speeds_up:
            reached = min(ahead if mode == SPEEDING_UP else target, cap[cell + 1])
            peak[now] = max(peak[now], np.sqrt(2.0 * max(reached, 0.0)))
        ahead = max(min(ahead, cap[cell + 1]), floor[cell + 1], 0.0)
        without = energy + energy_gain(coast, energy, step_m, drags)
        works[cell] = max(ahead - without, 0.0)
        both_mps = np.sqrt(2.0 * energy) + np.sqrt(2.0 * ahead)
        if both_mps <= 0.0 or (ahead <= 0.0 and cell < points - 2):
            time_s = np.inf
            energies[cell + 1 :] = 0.0
            works[cell:] = 0.0
            break
        time_s += 2.0 * step_m / both_mps
        energies[cell + 1] = energy = ahead
    return energies, works, time_s, entry, peak, cruised
