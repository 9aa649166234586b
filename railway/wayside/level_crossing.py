"""Level crossings: closed for trains that have struck in."""

from typing import TYPE_CHECKING

import numpy as np

from kankaku.railway.plan.disruptions import Cause, Disruptions
from kankaku.railway.plan.line import Crossing
from kankaku.railway.plan.world import World
from kankaku.railway.randomness import stream
from kankaku.railway.wayside.machine import Machine, Scene, come_to

if TYPE_CHECKING:
    from kankaku.railway.arrays import BoolArray


class LevelCrossing(Machine):
    """A level crossing: open, closing from the moment a train strikes in, closed, open again."""

    def __init__(
        self, world: World, crossing: Crossing, disruptions: Disruptions, seed: int
    ) -> None:
        line, services = world.line, world.timetable.services
        tracks = line.tracks_between(crossing.start_m, crossing.end_m)
        users = np.array([not set(tracks).isdisjoint(service.route) for service in services])
        users &= come_to(world, crossing.start_m)
        super().__init__(world, (crossing.start_m, crossing.end_m), tracks, users)
        self._crossing = crossing
        self._trains = world.timetable.trains
        self._struck: BoolArray = np.zeros(world.size, dtype=np.bool_)
        """Trains that it is or will be closed for."""
        self._closed_s = np.inf
        self._windows = [
            (w.from_s, w.until_s) for w in disruptions.obstacles if w.crossing == crossing.id
        ]
        self._obstacle_ratio = disruptions.obstacle_ratio
        self._obstacle_s = disruptions.obstacle_s
        self._obstructed = False
        self._on_it: BoolArray = np.zeros(world.size, dtype=np.bool_)
        """Trains that had come to it when it was obstructed."""
        self._seed = seed
        self.next_s = -np.inf

    def update(self, scene: Scene) -> None:
        """
        Close and open, and see whether it is free.

        Parameters
        ----------
        scene
            The trains.
        """
        passed = self._passed(scene)
        here = self._users & scene.present & ~passed
        struck = here & (scene.front_m >= self._crossing.strike_in_m)
        if struck.any() and not self._struck.any():
            self._close(scene.time_s, int(np.flatnonzero(struck)[0]))
        elif not struck.any():
            self._closed_s = np.inf
        self._struck = struck
        self._look_for_obstacles(scene)
        free = struck & scene.due(self._closed_s)
        if self._obstructed:
            free &= self._on_it
        self.concerns = self._users & ~passed & ~free
        closing = not np.isinf(self._closed_s) and not scene.due(self._closed_s)
        self.until_s = self._closed_s if closing and not self._obstructed else np.inf
        times_s = [self._closed_s, *(time_s for window in self._windows for time_s in window)]
        self.next_s = min((time_s for time_s in times_s if not scene.due(time_s)), default=np.inf)
        on_the_way = self._users & ~passed & ~struck
        self.front_watch_m = np.where(
            on_the_way & scene.present, self._crossing.strike_in_m, np.inf
        )
        self.tail_watch_m = np.where(struck, self.end_m, np.inf)

    def _close(self, time_s: float, row: int) -> None:
        self._closed_s = time_s + self._crossing.closing_s
        if not self._obstacle_ratio:
            return
        drawn = stream(self._seed, "crossing", self._crossing.id, self._trains[row]).random()
        if drawn < self._obstacle_ratio:
            self._windows.append((self._closed_s, self._closed_s + self._obstacle_s))

    def _look_for_obstacles(self, scene: Scene) -> None:
        obstructed = any(
            scene.due(from_s) and not scene.due(until_s) for from_s, until_s in self._windows
        )
        if obstructed and not self._obstructed:
            self._on_it = self._beyond(scene)
            self._obstruct(self._crossing.id, Cause.OBSTACLE, scene.time_s, scene.time_s)
        elif self._obstructed and not obstructed:
            self._lift(scene.time_s)
        self._obstructed = obstructed
