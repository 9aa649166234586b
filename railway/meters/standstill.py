"""Inter-station stops and crawling, found in every step that was recorded."""

from collections.abc import Mapping

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.plan.world import World
from kankaku.railway.step.records import Standstills
from kankaku.railway.step.step_block import StepBlock

STANDING_MPS = 0.05
CRAWLING_MPS = 10.0 / 3.6
AT_STOP_M = 1.0

Moments = tuple[IntArray, ...]
"""Steps and columns of a block. shapes (n_moments,)"""


class StandstillWatch:
    """
    Finds running trains that stand or crawl between stations.

    A train stands when its speed is 0.05 m/s or less and its front is not at a booked stop.
    It crawls below 10 km/h with no part of it in the platform that it leaves or the one that it
    serves next; standing counts as crawling, so that crawling is not mistaken for a cure of
    standing.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._since_s = np.full(world.size, np.nan)
        self._last: StepBlock | None = None
        self._found: list[tuple[int, float, float, float, int]] = []
        self.crawl_s: FloatArray = np.zeros(world.size)

    def add(self, block: StepBlock) -> None:
        """
        Look at a block of steps.

        Parameters
        ----------
        block
            The steps.
        """
        self._last = block
        slow = block.moving & (block.speed_mps[:-1] < CRAWLING_MPS)
        if not slow.any() and np.isnan(self._since_s[block.rows]).all():
            return
        # Few trains are slow at a time: what is looked at is told by moments, not by steps.
        moments = np.nonzero(slow)
        outside = ~self._at_platform(block, moments)
        crawls = np.bincount(moments[1][outside], minlength=block.rows.size)
        self.crawl_s[block.rows] += crawls * self._world.step_s
        standing = np.zeros(slow.shape, dtype=np.bool_)
        stands = block.speed_mps[:-1][moments] <= STANDING_MPS
        standing[moments] = stands & ~self._at_stop(block, moments)
        self._intervals(block, standing)

    def measured(self) -> Mapping[str, Standstills | FloatArray]:
        """
        Return what was measured.

        Returns
        -------
        Mapping[str, Standstills | FloatArray]
            By field of :class:`~kankaku.railway.step.records.RunRecord`.
        """
        return {"standstills": self.standstills(), "crawl_s": self.crawl_s}

    def standstills(self) -> Standstills:
        """
        Return the standstills, those not over counted until the last step.

        Returns
        -------
        Standstills
            In order of their start.
        """
        ordered = sorted(self._found + self._not_over(), key=lambda found: (found[1], found[0]))
        columns = list(zip(*ordered, strict=True)) or [(), (), (), (), ()]
        row, start_s, duration_s, front_m, next_call = columns
        return Standstills(
            np.array(row, dtype=np.intp),
            np.array(start_s, dtype=np.float64),
            np.array(duration_s, dtype=np.float64),
            np.array(front_m, dtype=np.float64),
            np.array(next_call, dtype=np.intp),
        )

    def _not_over(self) -> list[tuple[int, float, float, float, int]]:
        last = self._last
        if last is None:
            return []
        now_s = float(last.time_s[-1])
        return [
            (row, since_s, now_s - since_s, float(front_m), int(call))
            for row, front_m, call in zip(
                last.rows.tolist(), last.front_m[-1], last.next_call[-1], strict=True
            )
            if not np.isnan(since_s := float(self._since_s[row]))
        ]

    def _at_platform(self, block: StepBlock, moments: Moments) -> BoolArray:
        """Tell which trains are, with any part, in the platform that they leave or serve."""
        rows, front_m, call = self._there(block, moments)
        tail_m = front_m - self._world.length_m[rows]
        inside = np.zeros(front_m.shape, dtype=np.bool_)
        for served in (call, np.maximum(call - 1, 0)):
            start_m, end_m = self._world.platform_m[:, rows, served]
            inside |= (front_m > start_m) & (tail_m < end_m)
        return inside

    def _at_stop(self, block: StepBlock, moments: Moments) -> BoolArray:
        """Tell which trains are at a stop that they leave or serve."""
        rows, front_m, call = self._there(block, moments)
        stops_m = self._world.stop_m
        ahead = np.abs(front_m - stops_m[rows, call]) < AT_STOP_M
        behind = np.abs(front_m - stops_m[rows, np.maximum(call - 1, 0)]) < AT_STOP_M
        at_stop: BoolArray = ahead | behind
        return at_stop

    @staticmethod
    def _there(block: StepBlock, moments: Moments) -> tuple[IntArray, FloatArray, IntArray]:
        """Return the trains, their fronts and next calls at some moments."""
        rows = block.rows[moments[1]]
        return rows, block.front_m[:-1][moments], block.next_call[:-1][moments]

    def _intervals(self, block: StepBlock, standing: BoolArray) -> None:
        open_before = ~np.isnan(self._since_s[block.rows])
        edges = np.diff(np.vstack([open_before, standing]).astype(np.int8), axis=0)
        step, column = np.nonzero(edges)
        for at, which in zip(step.tolist(), column.tolist(), strict=True):
            row = int(block.rows[which])
            now_s = float(block.time_s[at])
            if edges[at, which] > 0:
                self._since_s[row] = now_s
            else:
                since_s = float(self._since_s[row])
                self._found.append(
                    (
                        row,
                        since_s,
                        now_s - since_s,
                        float(block.front_m[at, which]),
                        int(block.next_call[at, which]),
                    )
                )
                self._since_s[row] = np.nan
