"""
The codes of a multi-step ATC for a layout of blocks, and the check that nobody overruns.

A code is the speed that a block shows. A train that enters a block which shows less than it
runs brakes after an idle time, down to the code, and it must be down before the block ends.
So the code that a block shows with ``n`` free blocks ahead is the highest one from which the
next block, with ``n - 1`` free blocks ahead, still brakes a train in time; without a free
block ahead it is 0.
"""

from typing import NamedTuple

import numpy as np

from kankaku.controllers.options import OptionError
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.profile import Profile
from kankaku.railway.plan.world import World
from kankaku.railway.wayside.detection import Detection
from kankaku.railway.wayside.tiling import Tiling


class Braking(NamedTuple):
    """How a train brakes into a block that shows a lower code."""

    idle_time_s: float
    """Until the brake takes effect. [s]"""
    overlap_m: float
    """Kept free before the end of a block in which a train stops. [m]"""
    step_s: float
    """Length of a step, by which a change is noticed late. [s]"""

    @property
    def unbraked_s(self) -> float:
        """Time that a train runs on after the boundary, at most. [s]"""
        # The boundary is noticed a step late, and the idle time ends within another one.
        steps = 2.0 if self.idle_time_s else 1.0
        return self.idle_time_s + steps * self.step_s


def code_table(
    world: World,
    detection: Detection,
    codes_mps: FloatArray,
    braking: Braking,
    counted_blocks: int,
) -> FloatArray:
    """
    Return the code of every block by train type and number of free blocks ahead.

    Parameters
    ----------
    world
        Line and trains.
    detection
        Its blocks.
    codes_mps
        The codes, falling to 0. [m/s], shape (n_codes,)
    braking
        How trains brake.
    counted_blocks
        Free blocks that are counted; more of them show the same. [-]

    Returns
    -------
    FloatArray
        Codes. [m/s], shape (n_types, n_places, counted_blocks + 1)

    Raises
    ------
    OptionError
        If a block shows 0 although all blocks that are counted are free, because a train
        would overrun the next ones at any code.
    """
    tables = []
    for kind in range(len(world.train_types)):
        room = _room(world.profile, kind, detection.blocks, codes_mps, braking)
        columns = [np.zeros(detection.blocks.piece.size)]
        for _ in range(counted_blocks):
            columns.append(_codes_before_mps(columns[-1], room, detection.blocks, codes_mps))
        _refuse_closed_blocks(detection, columns[-1])
        tables.append(np.column_stack(columns))
    return np.array(tables)


class _Room(NamedTuple):
    """What a train at each code finds in each block; shape (n_places, n_codes)."""

    entry_mps: FloatArray
    """Speed at which it enters: the code, or the line ceiling where that is lower. [m/s]"""
    to_end_m2ps2: FloatArray
    """Square of the speed that the brake takes as far as the block's end. [m2/s2]"""
    to_overlap_m2ps2: FloatArray
    """The same as far as the overlap before it. [m2/s2]"""


def _room(
    profile: Profile, kind: int, blocks: Tiling, codes_mps: FloatArray, braking: Braking
) -> _Room:
    entry_mps = entry_speeds_mps(profile, kind, blocks, codes_mps)
    from_m = blocks.start_m[:, np.newaxis] + entry_mps * braking.unbraked_s

    def taken(until_m: FloatArray) -> FloatArray:
        until_m = np.broadcast_to(until_m[:, np.newaxis], from_m.shape)
        here, there = (
            np.interp(place_m, profile.grid_m, profile.potential_m2ps2[kind])
            for place_m in (from_m, until_m)
        )
        square: FloatArray = np.where(from_m < until_m, 2.0 * (there - here), -np.inf)
        return square

    return _Room(entry_mps, taken(blocks.end_m), taken(blocks.end_m - braking.overlap_m))


def entry_speeds_mps(
    profile: Profile, kind: int, blocks: Tiling, codes_mps: FloatArray
) -> FloatArray:
    """
    Return how fast a train at some code enters a block.

    Parameters
    ----------
    profile
        The line.
    kind
        Row of the train's type in it.
    blocks
        The blocks.
    codes_mps
        The codes. [m/s], shape (n_codes,)

    Returns
    -------
    FloatArray
        The code, or the line ceiling where that is lower. [m/s], shape (n_places, n_codes)
    """
    ceiling_mps = profile.ceiling_mps[kind]
    first, last = np.searchsorted(profile.grid_m, [blocks.start_m, blocks.end_m])
    greatest_mps = np.array(
        [ceiling_mps[max(a - 1, 0) : b + 1].max() for a, b in zip(first, last, strict=True)]
    )
    entry_mps: FloatArray = np.minimum(codes_mps, greatest_mps[:, np.newaxis])
    return entry_mps


def _codes_before_mps(
    ahead_mps: FloatArray, room: _Room, blocks: Tiling, codes_mps: FloatArray
) -> FloatArray:
    """Return the highest codes from which the next block, with its code, brakes in time."""
    next_mps = ahead_mps[:, np.newaxis]
    taken = np.where(next_mps > 0.0, room.to_end_m2ps2, room.to_overlap_m2ps2)
    in_time = room.entry_mps**2 - next_mps**2 <= taken
    allowed = (room.entry_mps <= next_mps) | in_time
    before_mps = np.full(ahead_mps.size, codes_mps[0])
    before_mps[:-1] = codes_mps[allowed.argmax(axis=1)[1:]]
    # Behind the last block of a route the trains leave the line.
    before_mps[blocks.first[1:] - 1] = codes_mps[0]
    return before_mps


def _refuse_closed_blocks(detection: Detection, shown_mps: FloatArray) -> None:
    closed = np.flatnonzero(shown_mps <= 0.0)
    if closed.size:
        block = detection.line.blocks[detection.blocks.piece[int(closed[0]) + 1]]
        problem = (
            f"no train could enter block {block.id!r} of blocks.csv: at the lowest code it would "
            f"overrun its {block.end_m - block.start_m:.0f} m"
        )
        allowed = "a longer block, a lower lowest code, a shorter overlap or idle time"
        raise OptionError(problem, allowed)
