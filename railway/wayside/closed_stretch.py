"""Closed stretches: work zones and failed equipment."""

from collections.abc import Callable

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray
from kankaku.railway.plan.disruptions import Cause, Closure
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import LineState
from kankaku.railway.wayside.machine import AT_START_M, Machine, Scene, come_to


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
        users &= come_to(world, closure.start_m)
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
