"""
The line as a protection permits it to a train that nobody hinders.

Line limits are not all that bounds such a train: a layout of blocks may never show the highest
code. A line limit is known beforehand and met where it begins; a lower code is seen where its
block begins, so that the train runs on for the idle time and only then brakes.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.motion.journey import Journey, technical_journey
from kankaku.railway.plan.profile import Profile
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight

HARDLY_MPS = 1e-4
"""Who is permitted so much less than it runs is not hindered. [m/s]"""


AFTER_M = 1e-6
PASSES = 4
"""A train that brakes earlier at one place is slower at the next; so often that is looked at."""


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
        That of the protection, in the row of the train's type with what is permitted on its
        own tracks with a whole line free ahead.
    """
    profile, kind = foresight.profile, int(world.type_index[row])
    grid_m = profile.grid_m
    inside = np.flatnonzero((grid_m >= world.line.start_m) & (grid_m <= world.line.end_m))
    front_m = grid_m[inside]
    ceiling_m2ps2 = profile.ceiling_m2ps2[kind, inside]
    ceiling_mps = np.sqrt(2.0 * ceiling_m2ps2)
    free_mps = foresight.permitted_mps(row, front_m, np.full(front_m.size, world.far_m))
    binds = free_mps < ceiling_mps - HARDLY_MPS
    if not binds.any():
        return profile
    bound_mps = np.where(binds, free_mps, np.inf)
    potential_m2ps2 = world.profile.potential_m2ps2[kind, inside]

    def with_braking(braking: Sequence[_Braking]) -> Profile:
        met_mps = _met_mps(front_m, bound_mps, potential_m2ps2, braking)
        permitted_m2ps2 = profile.ceiling_m2ps2.copy()
        permitted_m2ps2[kind, inside] = np.minimum(ceiling_m2ps2, 0.5 * met_mps**2)
        return replace(profile, permitted_m2ps2=permitted_m2ps2)

    falls = _falls(bound_mps, ceiling_mps)
    # At first as if every train entered as fast as it may: nobody brakes later than that.
    found = with_braking([_latest(front_m, fall, foresight.idle_time_s) for fall in falls])
    for _ in range(PASSES):
        journey = technical_journey(world, found, row)
        found = with_braking([_seen(journey, front_m, fall, foresight) for fall in falls])
    return found


class _Fall(NamedTuple):
    """Where a bound begins that is lower than what a train may run before it."""

    start: int
    end: int
    """Points of the grid, the last one not included."""
    entry_mps: float
    """What it may run before. [m/s]"""


class _Braking(NamedTuple):
    """Where a train begins to brake to a bound, and how fast it is then."""

    fall: _Fall
    place_m: float
    speed_mps: float


def _falls(bound_mps: FloatArray, ceiling_mps: FloatArray) -> list[_Fall]:
    starts = np.flatnonzero(bound_mps[1:] != bound_mps[:-1]) + 1
    ends = np.append(starts[1:], bound_mps.size)
    before_mps = np.minimum(bound_mps[starts - 1], ceiling_mps[starts])
    return [
        _Fall(start, end, entry_mps)
        for start, end, entry_mps in zip(
            starts.tolist(), ends.tolist(), before_mps.tolist(), strict=False
        )
        if entry_mps > bound_mps[start]
    ]


def _latest(front_m: FloatArray, fall: _Fall, idle_time_s: float) -> _Braking:
    return _Braking(fall, front_m[fall.start] + fall.entry_mps * idle_time_s, fall.entry_mps)


def _seen(journey: Journey, front_m: FloatArray, fall: _Fall, foresight: Foresight) -> _Braking:
    """Return where a train on a journey would begin to brake, if nothing else made it."""
    # A little further on, because a train may stand just where a block begins.
    begins_s = np.interp(front_m[fall.start] + AFTER_M, journey.chainage_m, journey.time_s)
    place_m, speed_mps = journey.at(np.array([begins_s + foresight.idle_time_s]))
    return _Braking(fall, float(place_m[0]), float(speed_mps[0]))


def _met_mps(
    front_m: FloatArray,
    bound_mps: FloatArray,
    potential_m2ps2: FloatArray,
    braking: Sequence[_Braking],
) -> FloatArray:
    """Return how fast a train may be that brakes to each bound after it has begun."""
    met_mps = bound_mps.copy()
    for fall, place_m, speed_mps in braking:
        here = slice(fall.start, fall.end)
        from_m2ps2 = np.interp(place_m, front_m, potential_m2ps2)
        taken = 2.0 * np.maximum(potential_m2ps2[here] - from_m2ps2, 0.0)
        slowed_mps = np.sqrt(np.maximum(speed_mps**2 - taken, 0.0))
        before = front_m[here] < place_m
        met_mps[here] = np.where(before, fall.entry_mps, np.maximum(slowed_mps, bound_mps[here]))
    return met_mps
