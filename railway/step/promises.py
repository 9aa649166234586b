"""What a protection promises beyond bare safety: data that the monitor holds it to."""

from dataclasses import dataclass

import numpy as np

from kankaku.railway.plan.buffers import Buffers

NO_BUFFERS = Buffers()


@dataclass(frozen=True, slots=True)
class Promises:
    """
    What a protection promises; the monitor believes these figures and nothing else of it.

    An authority ends the margin before whatever the train may not run into: the rear of the train
    ahead, the start of the block or track circuit that is not released, points that do not
    lie, a level crossing that is not closed, and any other obstruction. Beside it a drive brakes
    harder than the service brake only where nothing less keeps the authority.
    """

    margin_m: float = 0.0
    """Between an end of authority and what is behind it. [m]"""
    buffers: Buffers = NO_BUFFERS
    """Around every train, before the margin counts (Sakai 2020, eqs. 1 and 2)."""
    exclusive_platform: bool = False
    """A train that calls somewhere finds nobody else in its platform section."""
    validity_s: float = np.inf
    """A train whose commands are older brakes in emergency. [s]"""
    idle_time_s: float = 0.0
    """Who enters a block can run on for so long before it brakes. [s]"""
