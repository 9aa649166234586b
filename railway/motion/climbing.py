"""How slow a train may get before a summit that it has to climb with what its traction has."""

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import compiled
from kankaku.railway.motion.acceleration import accelerations, look_up
from kankaku.railway.motion.way import Way

SUMMIT_MPS = 2.0
"""Full traction passes every summit at this speed at least, where the fastest run does. [m/s]"""
CLIMBING_SHARE = 0.97
"""Share of the traction that has to be enough to climb; the rest is a reserve. [-]"""


def climbing_floor(way: Way, quickest_m2ps2: FloatArray) -> FloatArray:
    """
    Return the least energy from which full traction alone climbs what lies ahead.

    It keeps a reserve, ``CLIMBING_SHARE`` and ``SUMMIT_MPS``, but asks for no more than the
    fastest run has.

    Parameters
    ----------
    way
        The way.
    quickest_m2ps2
        Half the square of the speed of the fastest run. [m2/s2], shape (n_points,)

    Returns
    -------
    FloatArray
        Half the square of a speed; 0 where any speed is enough. [m2/s2], shape (n_points,)
    """
    pull, coast = accelerations(way.train_type)
    weak = coast + CLIMBING_SHARE * (pull - coast)
    summit = 0.5 * SUMMIT_MPS**2
    return _climb_back(way.chainage_m, way.drag_mps2, weak, summit, quickest_m2ps2)


@compiled
def _climb_back(
    chainage_m: FloatArray, drag: FloatArray, pull: FloatArray, summit: float, most: FloatArray
) -> FloatArray:
    floor = np.zeros(chainage_m.size)
    for cell in range(chainage_m.size - 2, -1, -1):
        step_m = chainage_m[cell + 1] - chainage_m[cell]
        ahead = floor[cell + 1]
        slope_ahead = look_up(pull, max(ahead, summit)) - drag[cell + 1]
        guess = max(ahead - step_m * slope_ahead, summit)
        slope = 0.5 * (slope_ahead + look_up(pull, guess) - drag[cell])
        # A summit ends a stretch on which traction is the weaker one.
        needed = max(ahead, summit) if slope < 0.0 else ahead
        floor[cell] = min(max(needed - step_m * slope, 0.0), most[cell])
    return floor
