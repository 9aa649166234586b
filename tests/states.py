"""States of a line that many tests share."""

from itertools import count

import numpy as np

from kankaku.railway.plan.world import World
from kankaku.railway.step.obstructions import unobstructed
from kankaku.railway.step.state import NOTHING, Events, LineState, beside

VERSIONS = count()
"""No two states are one of another."""


def behind(
    world: World,
    leader_m: float,
    follower_m: float,
    speed_mps: float = 0.0,
    *,
    leader_mps: float = 0.0,
    time_s: float = 25_300.0,
    clear_to_m: float = np.inf,
    follows: bool = True,
) -> LineState:
    """
    Return a leader in row 0 and a follower in row 1, both on the way to their second call.

    Parameters
    ----------
    world
        Two trains.
    leader_m, follower_m
        Their fronts. [m]
    speed_mps, leader_mps
        Speeds of follower and leader. [m/s]
    time_s
        Now. [s]
    clear_to_m
        Where points are not granted to the follower. [m]
    follows
        The leader is on the follower's own way.

    Returns
    -------
    LineState
        The state.
    """
    front_m = np.array([leader_m, follower_m])
    tail_m = front_m - world.length_m
    return LineState(
        time_s=time_s,
        front_m=front_m,
        tail_m=tail_m,
        speed_mps=np.array([leader_mps, speed_mps]),
        present=np.ones(2, dtype=np.bool_),
        running=np.ones(2, dtype=np.bool_),
        leader=np.array([-1, 0]),
        follows=np.array([False, follows]),
        clear_to_m=np.array([world.far_m, min(clear_to_m, tail_m[0]) if follows else clear_to_m]),
        granted_to_m=np.full(2, min(clear_to_m, world.far_m)),
        granted_by=np.full(2, beside(0) if clear_to_m < world.far_m else NOTHING),
        next_call=np.ones(2, dtype=np.intp),
        stop_m=world.stop_m[:, 1],
        arrival_s=np.full(2, 25_200.0),
        # Trains of such a state need not have run there from the one before.
        events=Events(cleared=(0,)),
        wayside=unobstructed(2, world.far_m),
        calls_version=next(VERSIONS),
        wayside_version=next(VERSIONS),
    )
