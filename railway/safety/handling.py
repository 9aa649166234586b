"""
How trains are handled: the monitor's part that looks at brakes, commands and idle times.

A drive keeps to the service brake unless nothing less keeps its authority or its commands have
run out, and then it does brake in emergency. How hard a train brakes is worked out from recorded
speeds and the gradients of the line.
"""

from collections.abc import Callable, Iterator

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.plan.line import Block
from kankaku.railway.plan.world import World
from kankaku.railway.safety.brakes import Brakes
from kankaku.railway.safety.ground import Ground
from kankaku.railway.step.promises import Promises
from kankaku.railway.step.step_block import StepBlock

HANDLING_MPS2 = 0.02
"""Brake forces are known this well, beside the gradient within a metre. [m/s2]"""
UNBRAKED_M = 0.05
"""Brake curves from tables come this near to exact ones. [m]"""
NEED_M = 1.0
"""A train this near to its brake curve may need more than the service brake. [m]"""
ROUNDING_S = 1e-3
NEAR_M = 1.0
"""Gradients are tabulated this closely. [m]"""

Bound = tuple[str, FloatArray, float]
Overrun = Callable[[FloatArray, FloatArray, FloatArray, IntArray], FloatArray]
"""By how much fronts at some speeds cannot stop short of some places. [m]"""


class Handling:
    """Finds trains that brake harder or later than was promised."""

    def __init__(
        self,
        world: World,
        promises: Promises,
        blocks: tuple[Block, ...],
        overrun_m: Overrun,
        ground: Ground,
        brakes: Brakes,
    ) -> None:
        self._ground, self._brakes = ground, brakes
        self._world, self._promises, self._overrun_m = world, promises, overrun_m
        self._service_mps2 = world.of_type("service_brake_mps2")
        self._emergency_mps2 = world.of_type("emergency_brake_mps2")
        self._build_up_s = world.of_type("brake_build_up_s")
        self._boundaries_m = np.array(sorted({block.start_m for block in blocks}))
        starts_m: dict[str, set[float]] = {}
        for block in blocks:
            starts_m.setdefault(block.track, set()).add(block.start_m)
        begins = [
            set[float]().union(*(starts_m.get(track, ()) for track in service.route))
            for service in world.timetable.services
        ]
        self._enters = np.array(
            [[at_m in own for at_m in self._boundaries_m.tolist()] for own in begins]
        )

    def beyond(self, block: StepBlock) -> Iterator[Bound]:
        """
        Yield by how much trains are handled otherwise than was promised.

        Parameters
        ----------
        block
            The steps.

        Yields
        ------
        Bound
            Kind of the rule, by how much it is broken, shape (n_steps, n_columns), and its
            tolerance.
        """
        rows, step_s = block.rows, self._world.step_s
        lost_mps2 = (block.speed_mps[:-1] - block.speed_mps[1:]) / step_s
        least, most = self._slopes(block)
        faster_mps = np.maximum(block.speed_mps[:-1], block.speed_mps[1:])
        service_mps2 = self._service_mps2[rows]
        harder_mps2 = lost_mps2 - self._brakes.strongest_mps2(service_mps2, most, faster_mps, rows)
        harder_mps2[block.emergency[:-1] | block.halting] = -np.inf
        hard = harder_mps2 > HANDLING_MPS2
        if hard.any():
            harder_mps2[hard & self._in_need(block)] = -np.inf
        yield "braking", harder_mps2, HANDLING_MPS2
        if np.isfinite(self._promises.validity_s):
            oldest_s = block.time_s[:-1, np.newaxis] - self._promises.validity_s - ROUNDING_S
            since_s = oldest_s - block.heard_s[:-1]
            stops = (block.speed_mps[1:] == 0.0) | block.halting
            built_mps2 = self._emergency_mps2[rows] * self._built_up(since_s, rows)
            weaker_mps2 = built_mps2 + self._brakes.gravity_mps2(rows) * least - lost_mps2
            weaker_mps2[stops | (since_s <= 0.0)] = -np.inf
            yield "validity", weaker_mps2, HANDLING_MPS2
        if self._promises.idle_time_s and self._boundaries_m.size:
            yield "idle", self._unbraked_m(block), UNBRAKED_M

    def _built_up(self, since_s: FloatArray, rows: IntArray) -> FloatArray:
        """Return which share of a brake is there, by how long it has been rising."""
        build_up_s = np.maximum(self._build_up_s[rows], ROUNDING_S)
        return np.clip(since_s / build_up_s, 0.0, 1.0)

    def _slopes(self, block: StepBlock) -> tuple[FloatArray, FloatArray]:
        """Return the least and the greatest gradient under each train, within a metre."""
        slopes = [
            self._ground.rises_m(place_m, block.rows) / self._world.length_m[block.rows]
            for place_m in (block.front_m[:-1] - NEAR_M, block.front_m[1:] + NEAR_M)
        ]
        return np.minimum(*slopes), np.maximum(*slopes)

    def _in_need(self, block: StepBlock) -> BoolArray:
        """Return who could not keep its authority by the service brake alone."""
        ahead_m = block.front_m[:-1] + block.speed_mps[:-1] * block.delay_s[:-1]
        over_m = self._overrun_m(ahead_m, block.speed_mps[:-1], block.eoa_m[:-1], block.rows)
        needs: BoolArray = ~(over_m < -NEED_M)
        return needs

    def _unbraked_m(self, block: StepBlock) -> FloatArray:
        """Return by how much who enters a block overruns if it first runs on for the idle time."""
        before = np.searchsorted(self._boundaries_m, block.front_m[:-1], side="left")
        after = np.searchsorted(self._boundaries_m, block.front_m[1:], side="left")
        entered = np.minimum(before, self._boundaries_m.size - 1)
        # Whoever a sudden obstruction came too near to is braking already.
        enters = (after > before) & self._enters[block.rows, entered] & ~block.surprised[1:]
        over_m = np.full(block.present.shape, -np.inf)
        if enters.any():
            speed_mps = block.speed_mps[1:]
            ahead_m = block.front_m[1:] + self._promises.idle_time_s * speed_mps
            all_m = self._overrun_m(ahead_m, speed_mps, block.eoa_m[1:], block.rows)
            over_m[enters] = all_m[enters]
        return over_m
