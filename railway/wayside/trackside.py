"""
The machines beside the track: points, level crossings, closed stretches.

Each one is a column of :class:`~kankaku.railway.step.obstructions.WaysideState`. It knows the next
time, and the next place of every front and tail, at which it can change; in between nobody asks it.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray
from kankaku.railway.plan.disruptions import Cause, Closure, Disruptions
from kankaku.railway.plan.line import Crossing, Line, Turnout
from kankaku.railway.plan.world import World
from kankaku.railway.randomness import stream
from kankaku.railway.step.obstructions import Obstruction
from kankaku.railway.step.state import LineState

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


def _come_to(world: World, place_m: float) -> BoolArray:
    """Return the trains that do not leave the line at a stop before a place."""
    come: BoolArray = ~world.leaves_at_stop | (world.last_stop_m > place_m)
    return come


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


class LevelCrossing(Machine):
    """A level crossing: open, closing from the moment a train strikes in, closed, open again."""

    def __init__(
        self, world: World, crossing: Crossing, disruptions: Disruptions, seed: int
    ) -> None:
        line, services = world.line, world.timetable.services
        tracks = line.tracks_between(crossing.start_m, crossing.end_m)
        users = np.array([not set(tracks).isdisjoint(service.route) for service in services])
        users &= _come_to(world, crossing.start_m)
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


class ClosedStretch(Machine):
    """
    A work zone or failed equipment.

    A work zone is *requested* when its time comes: from then on trains that can still stop
    short of it are kept out, and it is *established* once no other train is on its way into or
    through it, and none can go by an earlier permission. A failure is established at once.
    """

    def __init__(self, world: World, closure: Closure) -> None:
        services = world.timetable.services
        users = np.array([not set(closure.tracks).isdisjoint(s.route) for s in services])
        users &= _come_to(world, closure.start_m)
        at_start = {
            track.id
            for track in world.line.track_by_id.values()
            if track.start_m <= closure.start_m < track.end_m
        }
        self._comes_by = [next((t for t in s.route if t in at_start), None) for s in services]
        """The track on which each train comes to it."""
        super().__init__(world, (closure.start_m, closure.end_m), closure.tracks, users)
        self._closure = closure
        self._waits = closure.cause is Cause.WORK
        self._let_through: BoolArray = np.zeros(world.size, dtype=np.bool_)
        self.next_s = -np.inf

    @property
    def unsettled(self) -> bool:
        """It is requested, but not established yet."""
        return (
            bool(self.log)
            and np.isnan(self.log[-1].established_s)
            and np.isnan(self.log[-1].lifted_s)
        )

    def update(self, scene: Scene) -> None:
        """
        Request the stretch and lift its closure when it is time.

        Parameters
        ----------
        scene
            The trains.
        """
        closure = self._closure
        lifted = scene.due(closure.released_s)
        if not self.log and scene.due(closure.from_s) and not lifted:
            self._request(scene)
        if lifted and self.log and np.isnan(self.log[-1].lifted_s):
            self._lift(scene.time_s)
        begun, ahead = bool(self.log), self._users & ~self._beyond(scene) & ~scene.gone
        if lifted:
            self.concerns = self._let_through = np.zeros_like(self._users)
        elif begun:
            passed = self._passed(scene)
            self.concerns &= ~passed
            self._let_through &= ~passed
        else:
            self.concerns = ahead if self._waits else np.zeros_like(self._users)
        self._tell(scene, begun=begun, lifted=lifted)

    def _tell(self, scene: Scene, *, begun: bool, lifted: bool) -> None:
        closure = self._closure
        known = not lifted and (begun or self._waits) and not scene.due(closure.until_s)
        self.from_s = closure.from_s if known and not begun else -np.inf
        self.until_s = closure.until_s if known else np.inf
        times_s = (closure.from_s, closure.until_s, closure.released_s)
        self.next_s = min((time_s for time_s in times_s if not scene.due(time_s)), default=np.inf)
        coming = self.concerns & (not begun)
        self.front_watch_m = np.where(coming, self.start_m + AT_START_M, np.inf)
        on_the_way = (self.concerns | self._let_through) & begun
        self.tail_watch_m = np.where(on_the_way, self.end_m, np.inf)

    def _request(self, scene: Scene) -> None:
        ahead = self._users & ~self._beyond(scene) & ~scene.gone
        self.concerns = self._kept_out(scene, ahead) if self._waits else ahead
        self._let_through = self._users & scene.present & ~self.concerns & self._waits
        established_s = np.nan if self._waits else scene.time_s
        self._obstruct(self._closure.id, self._closure.cause, scene.time_s, established_s)

    def _kept_out(self, scene: Scene, ahead: BoolArray) -> BoolArray:
        """Return the trains that can stop, and all that come after one of those."""
        stops = scene.standing | scene.stops_short_of(self.hold_m)
        kept = np.zeros_like(ahead)
        closed: set[str | None] = set()
        for row in np.flatnonzero(ahead).tolist():
            if stops[row] or self._comes_by[row] in closed:
                kept[row] = True
                closed.add(self._comes_by[row])
        return kept

    def settle(
        self,
        state: LineState,
        covered_m: FloatArray,
        stops_short_of: Callable[[float], BoolArray],
    ) -> None:
        """
        Establish the closure if no train is in it, runs into it or holds a permission into it.

        Parameters
        ----------
        state
            The line.
        covered_m
            The furthest place that each train may still go to. [m], shape (n_trains,)
        stops_short_of
            Which trains the service brake stops before a place, at once. shape (n_trains,)
        """
        furthest_m = np.maximum(covered_m, state.front_m)
        stays_out = furthest_m <= self.start_m + AT_START_M
        stays_out &= (state.speed_mps == 0.0) | stops_short_of(self.start_m)
        held = self.concerns & state.present
        if not self._let_through.any() and stays_out[held].all():
            self.log[-1] = self.log[-1]._replace(established_s=state.time_s)


def machines(world: World, disruptions: Disruptions, seed: int) -> Sequence[Machine]:
    """
    Return everything beside a line.

    Parameters
    ----------
    world
        The line.
    disruptions
        What goes wrong.
    seed
        Seed of what goes wrong at random.

    Returns
    -------
    Sequence[Machine]
        Turnouts, level crossings, closures.
    """
    return (
        *(PointMachine(world, place, disruptions, seed) for place in world.line.turnouts),
        *(LevelCrossing(world, place, disruptions, seed) for place in world.line.crossings),
        *(ClosedStretch(world, closure) for closure in disruptions.closures),
    )


def places_beside(line: Line, disruptions: Disruptions) -> tuple[str, ...]:
    """
    Return what the machines beside a line are called, in their order.

    Parameters
    ----------
    line
        The line.
    disruptions
        What goes wrong.

    Returns
    -------
    tuple[str, ...]
        Identifiers of turnouts, level crossings, closures.
    """
    return (
        *(turnout.id for turnout in line.turnouts),
        *(crossing.id for crossing in line.crossings),
        *(closure.id for closure in disruptions.closures),
    )
