"""
The way of one train between two places, and the motion along it cell by cell.

Cells are those of :mod:`kankaku.railway.plan.profile`, a metre long, and shorter where limits
change. With the kinetic energy per unit of mass, ``e = v^2 / 2``, the motion is ``de/dx = (F(v) -
R(v)) / M
- r(x)`` with traction ``F`` between nothing and its greatest value, running resistance ``R`` and
the drag ``r`` of gradients and curves, bounded by the line ceiling and by the brake curve into the
end of the way. It is integrated by Heun's rule; the acceleration is constant within a cell.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import compiled
from kankaku.railway.plan.profile import Profile
from kankaku.railway.plan.rolling_stock import TrainType

SPEED_SPACING_MPS = 0.01
SPEEDING_UP, CRUISING, COASTING = 0, 1, 2
SLOW_MPS = 3.0
"""A train that speeds up from less than this does so within metres. [m/s]"""
NEAR_M = 0.01 * 1.5 ** np.arange(12)
"""How far behind the place where it does cells end. [m]"""
APART_M = 1e-6
"""Ends of cells that are nearer to each other are one. [m]"""


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """What a train meets between two places."""

    train_type: TrainType
    start_mps: float
    chainage_m: FloatArray
    """Ends of the cells. [m], shape (n_points,)"""
    cap_m2ps2: FloatArray
    """Greatest energy: ceiling and brake curve into the end. [m2/s2], shape (n_points,)"""
    floor_m2ps2: FloatArray
    """Least energy from which the speed at the end can be reached; else 0. (n_points,)"""
    potential_m2ps2: FloatArray
    """Brake potential. [m2/s2], shape (n_points,)"""
    drag_mps2: FloatArray
    """Deceleration by gradients and curves. [m/s2], shape (n_points,)"""
    section: IntArray
    """Section of constant limit of each cell. shape (n_points - 1,)"""
    limit_mps: FloatArray
    """Limit of each section. [m/s], shape (n_sections,)"""

    def no_faster(self, speed_mps: float) -> "Way":
        """
        Return the same way under a general limit, braked down to from the start.

        Parameters
        ----------
        speed_mps
            The limit. [m/s]

        Returns
        -------
        Way
            The way.
        """
        braked = 0.5 * self.start_mps**2 + self.potential_m2ps2[0] - self.potential_m2ps2
        cap = np.minimum(self.cap_m2ps2, np.maximum(0.5 * speed_mps**2, braked))
        return replace(
            self,
            cap_m2ps2=np.maximum(cap, self.floor_m2ps2),
            limit_mps=np.minimum(self.limit_mps, speed_mps),
        )


class Driving(NamedTuple):
    """How a train drives through the sections of a way; arrays of shape (n_sections,)."""

    target_mps: FloatArray
    """Speed up to this, and coast from it in the end. [m/s]"""
    cruise_m: FloatArray
    """Hold the target speed so far before coasting. [m]"""
    through: BoolArray
    """Coast all the way, from whatever speed the section is entered at."""

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
        return cls(way.limit_mps, np.full(sections, np.inf), np.zeros(sections, dtype=np.bool_))


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


def way_on(
    profile: Profile,
    row: int,
    train_type: TrainType,
    ends_m: tuple[float, float],
    speeds_mps: tuple[float, float] = (0.0, 0.0),
    *,
    ceiling_m2ps2: FloatArray | None = None,
    also_m: float | None = None,
) -> Way:
    """
    Cut a way out of a line.

    Parameters
    ----------
    profile
        The line.
    row
        Row of the train's type in it.
    train_type
        The train.
    ends_m
        Where the front starts and ends. [m]
    speeds_mps
        Its speed there; that at the end is not to be exceeded. [m/s]
    ceiling_m2ps2
        A further bound on half the square of the speed, on the grid of the profile.
        [m2/s2], shape (n_grid,)
    also_m
        Where else a cell is to end, for a train that may come near a stand there. [m]

    Returns
    -------
    Way
        The way.

    Raises
    ------
    ValueError
        If the end is not ahead of the start, or beyond the tables.
    """
    start_m, end_m = ends_m
    if not profile.origin_m <= start_m < end_m <= profile.end_m:
        message = (
            f"stop_m must be above start_m = {start_m:g} and within {profile.origin_m:g} "
            f"to {profile.end_m:g}, is {end_m:g}"
        )
        raise ValueError(message)
    chainage_m = _points_m(profile, row, ends_m, speeds_mps)
    if also_m is not None and start_m < also_m < end_m:
        chainage_m = np.union1d(chainage_m, also_m)
    places = chainage_m - profile.origin_m
    cell = np.minimum(places.astype(np.intp), profile.grid_m.size - 2)
    part = places - cell

    def along(table: FloatArray) -> FloatArray:
        values: FloatArray = table[cell] + part * (table[cell + 1] - table[cell])
        return values

    potential = along(profile.potential_m2ps2[row])
    into_end = 0.5 * speeds_mps[1] ** 2 + potential[-1] - potential
    cap = np.minimum(profile.ceiling_at_m2ps2(row, chainage_m), into_end)
    if ceiling_m2ps2 is not None:
        cap = np.minimum(cap, along(ceiling_m2ps2))
    if profile.permitted_m2ps2 is not None:
        cap = np.minimum(cap, along(profile.permitted_m2ps2[row]))
    limits = profile.limits[row]
    middle_m = 0.5 * (chainage_m[1:] + chainage_m[:-1])
    piece = np.searchsorted(limits.start_m, middle_m, side="right") - 1
    return Way(
        train_type=train_type,
        start_mps=speeds_mps[0],
        chainage_m=chainage_m,
        cap_m2ps2=np.maximum(cap, 0.0),
        floor_m2ps2=np.zeros(chainage_m.size),
        potential_m2ps2=potential,
        drag_mps2=along(profile.drag_mps2[row]),
        section=piece - piece[0],
        limit_mps=limits.limit_mps[piece[0] : piece[-1] + 1],
    )


def _points_m(
    profile: Profile, row: int, ends_m: tuple[float, float], speeds_mps: tuple[float, float]
) -> FloatArray:
    """
    Return the ends of the cells: a metre each, but shorter where a metre costs time.

    Cells end where limits change and where braking for them, or into the end, begins. Where a
    slow train speeds up they begin with a centimetre: there it may take seconds for a metre.
    """
    start_m, end_m = ends_m
    first = int(np.floor(start_m - profile.origin_m)) + 1
    last = int(np.ceil(end_m - profile.origin_m))
    limits, potential = profile.limits[row], profile.potential_m2ps2[row]
    energy = 0.5 * np.square(limits.limit_mps[:-1])
    into_end = 0.5 * speeds_mps[1] ** 2 + np.interp(end_m, profile.grid_m, potential)
    brakes_at = np.append(limits.lowest_m2ps2[1:-1] - energy[:-1], into_end - energy)
    slow = np.flatnonzero((np.diff(limits.limit_mps) > 0.0) & (limits.limit_mps[:-1] < SLOW_MPS))
    quickens_m = limits.start_m[slow + 1]
    if speeds_mps[0] < SLOW_MPS:
        quickens_m = np.append(quickens_m, start_m)
    points_m = np.concatenate(
        [
            profile.grid_m[first:last],
            limits.start_m,
            np.interp(brakes_at, potential, profile.grid_m),
            np.add.outer(quickens_m, NEAR_M).ravel(),
        ]
    )
    inside = points_m[(points_m > start_m + APART_M) & (points_m < end_m - APART_M)]
    inside.sort()
    apart = np.diff(inside, prepend=start_m) > APART_M
    return np.concatenate([[start_m], inside[apart], [end_m]])


def reaching_the_end(way: Way) -> tuple[Way, float]:
    """
    Return the same way with a floor: full acceleration that just reaches the end's speed.

    Parameters
    ----------
    way
        The way.

    Returns
    -------
    tuple[Way, float]
        The way, and where on it such an acceleration begins from rest; its start if it
        would begin before. [m]
    """
    pull, _ = accelerations(way.train_type)
    floor, from_m = _accelerate_back(way.chainage_m, float(way.cap_m2ps2[-1]), way.drag_mps2, pull)
    return replace(way, floor_m2ps2=np.minimum(floor, way.cap_m2ps2)), from_m


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
            0.5 * way.start_mps**2,
            pull,
            coast,
        )
    )


@lru_cache(maxsize=64)
def accelerations(train_type: TrainType) -> tuple[FloatArray, FloatArray]:
    """
    Tabulate the acceleration with full traction and without any, on the level.

    Parameters
    ----------
    train_type
        The train.

    Returns
    -------
    tuple[FloatArray, FloatArray]
        At multiples of ``SPEED_SPACING_MPS``. [m/s2], shape (n_speeds,)
    """
    speeds = np.arange(0.0, 1.5 * train_type.maximum_speed_mps + 1.0, SPEED_SPACING_MPS)
    coast = -train_type.resistance.force_n(speeds) / train_type.inertial_mass_kg
    return train_type.level_acceleration_mps2(speeds), coast


@compiled
def energy_gain(
    table: FloatArray, energy: float, step_m: float, drags: tuple[float, float]
) -> float:
    """
    Return the energy gained over a step by Heun's rule.

    Parameters
    ----------
    table
        Acceleration on the level, from :func:`accelerations`. [m/s2], shape (n_speeds,)
    energy
        Half the square of the speed before. [m2/s2]
    step_m
        Length of the step. [m]
    drags
        Deceleration by gradients and curves at its ends. [m/s2]

    Returns
    -------
    float
        The gain. [m2/s2]
    """
    slope = look_up(table, energy) - drags[0]
    ahead = max(energy + step_m * slope, 0.0)
    return 0.5 * step_m * (slope + look_up(table, ahead) - drags[1])


@compiled
def look_up(table: FloatArray, energy: float) -> float:
    """
    Interpolate an acceleration.

    Parameters
    ----------
    table
        From :func:`accelerations`. [m/s2], shape (n_speeds,)
    energy
        Half the square of the speed. [m2/s2]

    Returns
    -------
    float
        The acceleration. [m/s2]
    """
    place = np.sqrt(2.0 * energy) / SPEED_SPACING_MPS
    index = min(int(place), table.size - 2)
    value: float = table[index] + (place - index) * (table[index + 1] - table[index])
    return value


@compiled
def _accelerate_back(
    chainage_m: FloatArray, end_energy: float, drag: FloatArray, pull: FloatArray
) -> tuple[FloatArray, float]:
    floor = np.zeros(chainage_m.size)
    floor[-1] = end_energy
    for cell in range(chainage_m.size - 2, -1, -1):
        ahead = floor[cell + 1]
        step_m = chainage_m[cell + 1] - chainage_m[cell]
        slope_ahead = look_up(pull, ahead) - drag[cell + 1]
        guess = max(ahead - step_m * slope_ahead, 0.0)
        slope = 0.5 * (slope_ahead + look_up(pull, guess) - drag[cell])
        floor[cell] = ahead - step_m * slope
        if floor[cell] <= 0.0:
            floor[cell] = 0.0
            return floor, chainage_m[cell + 1] - ahead / slope
    return floor, chainage_m[0]


@compiled
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
