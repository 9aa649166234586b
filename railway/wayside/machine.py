"""What all machines beside the track share."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray
from kankaku.railway.plan.disruptions import Cause
from kankaku.railway.plan.world import World
from kankaku.railway.step.obstructions import Obstruction

AT_START_M = 0.5
"""A front that stopped at the start of an obstruction is before it, a stop error off. [m]"""


ROUNDING_S = 1e-6
"""Times of steps are sums: what is due is due this little earlier. [s]"""


class Scene(NamedTuple):
    """The trains at one moment; arrays of shape (n_trains,)."""

    time_s: float
    front_m: FloatArray
    tail_m: FloatArray
    present: BoolArray
    gone: BoolArray
    """The train has left the line."""
    standing: BoolArray
    stops_short_of: Callable[[float], BoolArray]
    """Says which trains surely could stop short of a place."""

    def due(self, when_s: float) -> bool:
        """Return whether a time has come."""
        return self.time_s >= when_s - ROUNDING_S


class Machine(ABC):
    """One column of the obstructions; of a train that is not present, the origin counts."""

    def __init__(
        self,
        world: World,
        place_m: tuple[float, float],
        tracks: tuple[str, ...],
        users: BoolArray,
    ) -> None:
        self.start_m, self.end_m = place_m
        starts_m = (
            piece.start_m
            for piece in world.line.track_circuits
            if piece.track in tracks and piece.start_m <= self.start_m < piece.end_m
        )
        self.hold_m = min(starts_m, default=self.start_m)
        """Where trains may be made to stop short of it, at the earliest. [m]"""
        self.from_s = -np.inf
        self.until_s = np.inf
        self.concerns: BoolArray = users.copy()
        self.next_s = np.inf
        """When it changes, if no train does anything. [s]"""
        self.front_watch_m: FloatArray = np.full(world.size, np.inf)
        """Where the front of each train changes it next. [m]"""
        self.tail_watch_m: FloatArray = np.full(world.size, np.inf)
        """Where the tail of each train changes it next. [m]"""
        self.log: list[Obstruction] = []
        self._tracks = tracks
        self._users = users

    @abstractmethod
    def update(self, scene: Scene) -> None:
        """Take note of the time and the trains."""

    def _passed(self, scene: Scene) -> BoolArray:
        return scene.gone | (scene.tail_m >= self.end_m)

    def _beyond(self, scene: Scene) -> BoolArray:
        return scene.front_m > self.start_m + AT_START_M

    def _obstruct(self, name: str, cause: Cause, requested_s: float, established_s: float) -> None:
        place_m, times_s = (self.start_m, self.end_m), (requested_s, established_s, np.nan)
        self.log.append(Obstruction(name, cause, self._tracks, *place_m, *times_s))

    def _lift(self, time_s: float) -> None:
        lifted = self.log.pop()._replace(lifted_s=time_s)
        # Points that move in no time are in nobody's way.
        if lifted.requested_s < time_s:
            self.log.append(lifted)


def come_to(world: World, place_m: float) -> BoolArray:
    """Return the trains that do not leave the line at a stop before a place."""
    come: BoolArray = ~world.leaves_at_stop | (world.last_stop_m > place_m)
    return come
