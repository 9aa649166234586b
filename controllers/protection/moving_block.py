"""
Moving block: every train may go up to its leader's rear, taken as standing.

The end of authority is the leader's tail (or the fouling point of a turnout that is not
granted) less a safety margin; the ceiling is the lowest line limit over the whole train,
the braking curves to lower limits ahead included.
"""

import math
from dataclasses import dataclass

import numpy as np

from controllers.options import require
from railway.arrays import FloatArray
from railway.compiled import compiled
from railway.profile import at
from railway.state import Authority, LineState
from railway.world import World


@dataclass(frozen=True, slots=True)
class MovingBlockOptions:
    """Options of the moving block."""

    margin_m: float = 25.0
    """Safety margin between the end of authority and the obstacle. [m]"""

    def __post_init__(self) -> None:
        require("margin_m", self.margin_m, 0.0, 1000.0)


class LineCeiling:
    """The line ceiling of every train at the end of a step."""

    def __init__(self, world: World) -> None:
        self._row_start = world.row_start
        self._square = 2.0 * world.profile.ceiling_m2ps2.ravel()
        self._step_s = world.step_s
        # Nobody is further ahead after a step than with its starting acceleration throughout.
        steepest = -np.minimum(world.profile.drag_mps2.min(axis=1), 0.0)[world.type_index]
        most_mps2 = world.of_type("starting_acceleration_mps2") + steepest
        self._reach_m = 0.5 * world.step_s**2 * most_mps2

    def at_step_end_mps(self, state: LineState) -> FloatArray:
        """
        Return the speed not to be exceeded where the train will be after the step.

        Parameters
        ----------
        state
            The line.

        Returns
        -------
        FloatArray
            Ceiling. [m/s], shape (n_trains,)
        """
        return _ceiling_mps(
            state.front_m,
            state.speed_mps,
            self._row_start,
            self._square,
            self._reach_m,
            self._step_s,
        )


@compiled
def _ceiling_mps(
    front_m: FloatArray,
    speed_mps: FloatArray,
    row_start: FloatArray,
    square: FloatArray,
    reach_m: FloatArray,
    step_s: float,
) -> FloatArray:
    ceiling_mps = np.empty_like(speed_mps)
    for train in range(speed_mps.size):
        ahead_m = front_m[train] + speed_mps[train] * step_s + reach_m[train]
        ceiling_mps[train] = math.sqrt(at(square, ahead_m + row_start[train]))
    return ceiling_mps


class MovingBlock:
    """Moving block with a constant safety margin."""

    def __init__(self, world: World, options: MovingBlockOptions) -> None:
        self._ceiling = LineCeiling(world)
        self._margin_m = options.margin_m

    def initial(self) -> None:
        """Return the memory before the first step: none is needed."""

    def authorise(self, state: LineState, memory: None) -> tuple[Authority, None]:
        """
        Return the authority of every train.

        Parameters
        ----------
        state
            The line.
        memory
            None.

        Returns
        -------
        tuple[Authority, None]
            Limits and ceilings.
        """
        limit_m = state.clear_to_m - self._margin_m
        return Authority(limit_m, self._ceiling.at_step_end_mps(state)), memory
