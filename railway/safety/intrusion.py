"""
Who enters what is in the way: the monitor's part that looks beside the track.

Where trains are, what they could have stopped short of and how hard they brake is worked out
from the recorded steps; of the obstructions themselves only place and times are believed.
"""

from collections.abc import Callable

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray
from kankaku.railway.plan.disruptions import SUDDEN
from kankaku.railway.plan.world import World
from kankaku.railway.safety.survey import Survey, overruns_m, slopes_under
from kankaku.railway.step.obstructions import Obstruction
from kankaku.railway.step.step_block import StepBlock

BRAKE_TOLERANCE_MPS2 = 0.05
RADIO_REACTION_S = 6.0
"""Commands are valid for 5 s, and sent once a second (Sugiyama 2018, section 2.3). [s]"""


class Intrusions:
    """
    Finds trains in obstructions that they may not be in.

    A train may not enter what is established. Only one that a sudden obstruction comes too near
    to is excused, and only as long as it slows down by its service brake at least, until it
    stands. Trains that take their commands by radio have the time that these are valid.
    """

    def __init__(
        self,
        world: World,
        obstructions: Callable[[], tuple[Obstruction, ...]],
        survey: Survey,
        *,
        by_radio: bool,
    ) -> None:
        self._world = world
        self._obstructions = obstructions
        self._survey = survey
        self._reaction_s = RADIO_REACTION_S if by_radio else 0.0
        self._service_mps2 = world.of_type("service_brake_mps2")
        self._most_mps2 = world.greatest_acceleration_mps2
        self._top_mps = world.of_type("maximum_speed_mps")
        self._barred: dict[tuple[str, float], BoolArray] = {}
        self._excused: dict[tuple[str, float], BoolArray] = {}

    def inside_m(self, block: StepBlock, near_m: float) -> FloatArray:
        """
        Return how far each front is in an obstruction that it may not be in.

        Parameters
        ----------
        block
            The steps.
        near_m
            Fronts this little beyond its start have stopped at it. [m]

        Returns
        -------
        FloatArray
            Zero for all others. [m], shape (n_steps, n_columns)
        """
        inside_m = np.zeros(block.present.shape)
        for record in self._obstructions():
            lifted_s = np.inf if np.isnan(record.lifted_s) else record.lifted_s
            # Not-a-number, for what was never established, is never reached.
            begun = record.established_s <= block.time_s[-1]
            if not begun or lifted_s <= block.time_s[0]:
                continue
            in_force = (record.established_s <= block.time_s) & (block.time_s < lifted_s)
            if in_force.any():
                key = record.id, record.requested_s
                if key not in self._barred:
                    at = int(np.argmax(in_force))
                    self._barred[key], self._excused[key] = self._first_seen(
                        record, block, at, near_m
                    )
                depth_m = np.where(
                    in_force[:-1, np.newaxis]
                    & self._within(record, block, near_m)
                    & ~self._allowed(record, block, in_force[:-1, np.newaxis]),
                    block.front_m[1:] - record.start_m,
                    0.0,
                )
                np.maximum(inside_m, depth_m, out=inside_m)
        return inside_m

    def _first_seen(
        self, record: Obstruction, block: StepBlock, at: int, near_m: float
    ) -> tuple[BoolArray, BoolArray]:
        """Return who may not enter, and who of them cannot help it; shape (n_trains,)."""
        world, rows = self._world, block.rows
        front_m = world.stop_m[:, 0].copy()
        front_m[rows] = block.front_m[at]
        uses = [not set(record.tracks).isdisjoint(s.route) for s in world.timetable.services]
        barred = np.array(uses) & (front_m <= record.start_m + near_m)
        excused = np.zeros_like(barred)
        if record.cause in SUDDEN:
            reaction_s = self._reaction_s
            speed_mps = block.speed_mps[at] + reaction_s * self._most_mps2[rows]
            speed_mps = np.minimum(speed_mps, np.maximum(block.speed_mps[at], self._top_mps[rows]))
            reach_m = front_m[rows] + reaction_s * speed_mps
            over_m = overruns_m(self._survey, rows, reach_m, speed_mps, record.start_m)
            excused[rows] = barred[rows] & (over_m > 0.0)
        return barred, excused

    def _within(self, record: Obstruction, block: StepBlock, near_m: float) -> BoolArray:
        tail_m = block.front_m[:-1] - self._world.length_m[block.rows]
        entered = block.front_m[1:] > record.start_m + near_m
        within: BoolArray = entered & (tail_m < record.end_m) & (block.speed_mps[1:] > 0.0)
        return within

    def _allowed(self, record: Obstruction, block: StepBlock, in_force: BoolArray) -> BoolArray:
        key, rows = (record.id, record.requested_s), block.rows
        allowed: BoolArray = np.broadcast_to(~self._barred[key][rows], block.present.shape)
        excused = self._excused[key]
        if not excused[rows].any():
            return allowed
        reacting = block.time_s[:-1, np.newaxis] < record.established_s + self._reaction_s
        # A step without braking, or a standstill, and the excuse is gone for good.
        may: BoolArray = np.logical_and.accumulate(
            reacting | self._slow_down(block) | ~in_force, axis=0
        )
        may &= excused[rows]
        excused[rows] &= may[-1]
        return allowed | may

    def _slow_down(self, block: StepBlock) -> BoolArray:
        """Return in which steps trains brake by their service brake, or stand at the end."""
        rows = block.rows
        before, after = block.speed_mps[:-1], block.speed_mps[1:]
        slopes = slopes_under(self._survey, rows, np.ascontiguousarray(block.front_m[:-1].T)).T
        gravity_mps2 = self._survey.fleet.brake_gravity_mps2[rows]
        least_mps2 = self._service_mps2[rows] + gravity_mps2 * slopes
        least_mps2 -= BRAKE_TOLERANCE_MPS2
        brakes: BoolArray = before - after >= least_mps2 * self._world.step_s
        brakes |= after == 0.0
        return brakes
