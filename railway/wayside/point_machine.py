"""Points: thrown, locked and proven for one way at a time."""

from itertools import pairwise

import numpy as np

from kankaku.railway.plan.disruptions import Cause, Disruptions
from kankaku.railway.plan.line import Turnout
from kankaku.railway.plan.world import World
from kankaku.railway.randomness import stream
from kankaku.railway.wayside.machine import ROUNDING_S, Machine, Scene


class GrantedPoints(Machine):
    """
    Points of a network: they lie for whoever they are granted to.

    When they are granted, throw and proof included, is a matter of the order at them; see
    :class:`kankaku.railway.wayside.leaders.Leaders`.
    """

    def __init__(self, world: World, turnout: Turnout) -> None:
        ends_m = (turnout.fouling_start_m, turnout.fouling_end_m)
        super().__init__(world, ends_m, (), np.zeros(world.size, dtype=np.bool_))

    def update(self, scene: Scene) -> None:
        """Do nothing: who may pass is granted elsewhere."""


class PointMachine(Machine):
    """
    Points that lie for one way at a time; the fouling section is locked by detection.

    They lie for the next train in the order of the timetable, and begin to throw when the tail
    of the last one before it that goes another way has cleared them.
    """

    def __init__(self, world: World, turnout: Turnout, disruptions: Disruptions, seed: int) -> None:
        services = world.timetable.services
        section_of = world.line.section_of_track
        sections = world.line.sections
        way_of: dict[int, tuple[str, str]] = {
            row: (before, after)
            for row, service in enumerate(services)
            for before, after in pairwise(service.route)
            if sections[section_of[before]].end_m == turnout.position_m
        }
        users = np.zeros(world.size, dtype=np.bool_)
        users[list(way_of)] = True
        tracks = tuple(
            track.id
            for section in sections
            if turnout.position_m in {section.start_m, section.end_m}
            for track in section.tracks
        )
        place_m = turnout.fouling_start_m, turnout.fouling_end_m
        super().__init__(world, place_m, tracks, users)
        self._turnout = turnout
        self._trains = world.timetable.trains
        self._rows = list(way_of)
        self._ways = list(way_of.values())
        self._turn = 0
        """The first train, among those that use them, that has not cleared them."""
        self._lie = self._ways[0] if self._ways else None
        self._repaired_s = np.inf
        """When they can be thrown again; infinite while they do what they should. [s]"""
        self._windows = [w for w in disruptions.points_failures if w.turnout == turnout.id]
        self._failure_ratio = disruptions.points_failure_ratio
        self._repair_s = disruptions.points_repair_s
        self._seed = seed

    def update(self, scene: Scene) -> None:
        """
        Throw the points when it is time, and prove that they lie.

        Parameters
        ----------
        scene
            The trains.
        """
        passed = self._passed(scene)
        while self._turn < len(self._rows) and passed[self._rows[self._turn]]:
            self._turn += 1
        idle = np.isinf(self.next_s)
        if idle and self._turn < len(self._ways) and self._ways[self._turn] != self._lie:
            self._throw(scene.time_s, again=False)
        while scene.due(self.next_s):
            if np.isinf(self._repaired_s):
                self.next_s = self.until_s = np.inf
                self._lift(scene.time_s)
            elif scene.due(self._repaired_s):
                self._throw(scene.time_s, again=True)
            else:
                # The proof does not come: nobody knows when it will.
                self.next_s, self.until_s = self._repaired_s, np.inf
        self._tell()

    def _throw(self, time_s: float, *, again: bool) -> None:
        row, way = self._rows[self._turn], self._ways[self._turn]
        ready_s = time_s + self._turnout.throw_s + self._turnout.proof_s
        self._lie = way
        self.next_s = self.until_s = ready_s
        begun_s = time_s + ROUNDING_S
        stuck_s = [w.until_s for w in self._windows if w.from_s <= ready_s and begun_s < w.until_s]
        drawn = 1.0
        if self._failure_ratio and not again:
            key = "points", self._turnout.id, self._trains[row]
            drawn = stream(self._seed, *key).random()
        if drawn < self._failure_ratio:
            stuck_s.append(ready_s + self._repair_s)
        self._repaired_s = max(stuck_s, default=np.inf)
        if not again:
            self._obstruct(self._turnout.id, Cause.POINTS, time_s, time_s)

    def _tell(self) -> None:
        self.concerns = np.zeros_like(self._users)
        self.tail_watch_m = np.full(self._users.size, np.inf)
        waiting = self._rows[self._turn :]
        if not waiting:
            return
        self.tail_watch_m[waiting[0]] = self.end_m
        first = 0
        if np.isinf(self.next_s):
            ways = self._ways[self._turn :]
            first = next((n for n, way in enumerate(ways) if way != self._lie), len(ways))
        self.concerns[waiting[first:]] = True
