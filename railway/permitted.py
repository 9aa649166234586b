"""
The line as a protection permits it to a train that nobody hinders.

Line limits are not all that bounds such a train: a layout of blocks may never show the highest
code. A line limit is known beforehand and met where it begins; a lower code is seen where its
block begins, so that the train runs on for the idle time and only then brakes.
"""

from dataclasses import replace

import numpy as np

from railway.arrays import FloatArray
from railway.control import Foresight
from railway.profile import Profile
from railway.world import World

HARDLY_MPS = 1e-4
"""Who is permitted so much less than it runs is not hindered. [m/s]"""


def permitted_profile(world: World, foresight: Foresight, row: int) -> Profile:
    """
    Return the profile of a train that nobody hinders.

    Parameters
    ----------
    world
        Line and trains.
    foresight
        Protection.
    row
        The train.

    Returns
    -------
    Profile
        That of the protection, in the row of the train's type with the ceiling that is
        permitted on its own tracks with a whole line free ahead.
    """
    profile, kind = foresight.profile, int(world.type_index[row])
    grid_m = profile.grid_m
    inside = np.flatnonzero((grid_m >= world.line.start_m) & (grid_m <= world.line.end_m))
    front_m = grid_m[inside]
    ceiling_mps = np.sqrt(2.0 * profile.ceiling_m2ps2[kind, inside])
    free_mps = foresight.permitted_mps(row, front_m, np.full(front_m.size, world.far_m))
    binds = free_mps < ceiling_mps - HARDLY_MPS
    if not binds.any():
        return profile
    bound_mps = _met_late_mps(
        front_m,
        np.where(binds, free_mps, np.inf),
        ceiling_mps,
        profile.potential_m2ps2[kind, inside],
        foresight.idle_time_s,
    )
    ceiling_m2ps2 = profile.ceiling_m2ps2.copy()
    ceiling_m2ps2[kind, inside] = np.minimum(ceiling_m2ps2[kind, inside], 0.5 * bound_mps**2)
    return replace(profile, ceiling_m2ps2=ceiling_m2ps2)


def _met_late_mps(
    front_m: FloatArray,
    bound_mps: FloatArray,
    ceiling_mps: FloatArray,
    potential_m2ps2: FloatArray,
    idle_time_s: float,
) -> FloatArray:
    """Return how fast a train may still be that brakes once a lower bound has begun."""
    met_mps = bound_mps.copy()
    changes = np.flatnonzero(bound_mps[1:] != bound_mps[:-1]) + 1
    ends = np.append(changes[1:], bound_mps.size)
    for start, end in zip(changes.tolist(), ends.tolist(), strict=False):
        entry_mps = min(met_mps[start - 1], ceiling_mps[start])
        if entry_mps <= bound_mps[start]:
            continue
        here = slice(start, end)
        brakes_m = front_m[start] + entry_mps * idle_time_s
        from_m2ps2 = np.interp(brakes_m, front_m, potential_m2ps2)
        taken = 2.0 * np.maximum(potential_m2ps2[here] - from_m2ps2, 0.0)
        slowed_mps = np.sqrt(np.maximum(entry_mps**2 - taken, 0.0))
        met_mps[here] = np.maximum(slowed_mps, bound_mps[here])
    return met_mps
