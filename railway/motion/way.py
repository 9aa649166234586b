"""
The way of one train between two places, and the motion along it cell by cell.

Cells are those of :mod:`kankaku.railway.plan.profile`, a metre long, and shorter where limits
change. With the kinetic energy per unit of mass, ``e = v^2 / 2``, the motion is ``de/dx = (F(v) -
R(v)) / M
- r(x)`` with traction ``F`` between nothing and its greatest value, running resistance ``R`` and
the drag ``r`` of gradients and curves, bounded by the line ceiling and by the brake curve into the
end of the way. It is integrated by Heun's rule; the acceleration is constant within a cell.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.motion.acceleration import SLOW_MPS, accelerate_back, accelerations
from kankaku.railway.plan.profile import Profile
from kankaku.railway.plan.rolling_stock import TrainType

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
    cap = _ceiling(profile, row, chainage_m, along)
    if ceiling_m2ps2 is not None:
        cap = np.minimum(cap, along(ceiling_m2ps2))
    cap = np.minimum(cap, 0.5 * speeds_mps[1] ** 2 + potential[-1] - potential)
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


def _ceiling(
    profile: Profile, row: int, chainage_m: FloatArray, along: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Return the energy that the line, and a protection where there is one, permits. [m2/s2]"""
    cap = profile.ceiling_at_m2ps2(row, chainage_m)
    if profile.permitted_m2ps2 is None:
        return cap
    return np.minimum(cap, along(profile.permitted_m2ps2[row]))


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
    floor, from_m = accelerate_back(way.chainage_m, float(way.cap_m2ps2[-1]), way.drag_mps2, pull)
    return replace(way, floor_m2ps2=np.minimum(floor, way.cap_m2ps2)), from_m
