"""
What is beside the track, and what signalling knows of it.

Permissions are given only for what is proven to be out of the way, and taken back only by what
comes suddenly: an obstacle on a closed level crossing, or a failure.
"""

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray
from kankaku.railway.plan.brake_table import braking_v2_each
from kankaku.railway.plan.disruptions import UNDISTURBED, Disruptions
from kankaku.railway.plan.world import World
from kankaku.railway.step.obstructions import Obstruction, WaysideState, unobstructed
from kankaku.railway.step.state import Events, LineState
from kankaku.railway.wayside.closed_stretch import ClosedStretch
from kankaku.railway.wayside.machine import ROUNDING_S, Scene
from kankaku.railway.wayside.point_machine import PointMachine
from kankaku.railway.wayside.trackside import machines, places_beside

RESERVE_S = 10.0
"""Who is let through counts as this much time of running further on. [s]"""
RESERVE_M = 100.0
"""And a train that is kept out may be made to stop this much earlier. [m]"""


class Wayside:
    """Points, level crossings, work zones and failed equipment along a line."""

    def __init__(self, world: World, disruptions: Disruptions = UNDISTURBED, seed: int = 0) -> None:
        self._world = world
        self._machines = machines(world, disruptions, seed)
        self.places = places_beside(world.line, disruptions)
        """What each column is called."""
        self._sudden = [
            (column, machine)
            for column, machine in enumerate(self._machines)
            if not isinstance(machine, PointMachine)
        ]
        self._closures = [item for item in self._machines if isinstance(item, ClosedStretch)]
        self._rows = np.arange(world.size)
        self._tables_m = world.profile.origin_m, world.far_m
        self._fastest_mps = max(kind.maximum_speed_mps for kind in world.train_types)
        self._watch_m: tuple[FloatArray, FloatArray] = (np.zeros(0), np.zeros(0))
        self._next_s = self._quiet_s = -np.inf
        self._gone: BoolArray = np.zeros(world.size, dtype=np.bool_)
        self._surprise: tuple[FloatArray, FloatArray] = (
            np.full(world.size, -np.inf),
            np.full(world.size, -np.inf),
        )
        """Until when trains stay surprised, and where they have passed what did it."""
        self.unsettled = False
        """A work zone is requested that is not established yet."""
        self.state: WaysideState = unobstructed(world.size, world.far_m)
        """What signalling knows now."""
        self.version = 0
        """Another one when that is another."""

    def update(
        self,
        time_s: float,
        trains: tuple[FloatArray, FloatArray, FloatArray],
        present: BoolArray,
        events: Events,
    ) -> tuple[int, ...]:
        """
        Take note of the time and the trains.

        Parameters
        ----------
        time_s
            Now. [s]
        trains
            Fronts, tails and speeds. [m], [m] and [m/s], shape (n_trains,) each
        present
            Trains on the line. shape (n_trains,)
        events
            What has happened to them.

        Returns
        -------
        tuple[int, ...]
            Trains for which another place is obstructed than before.
        """
        # Of all events only these change who may be in the way; places are watched.
        changed = bool(events.entered or events.left)
        if (time_s < self._quiet_s and not changed) or not self._machines:
            return ()
        front_m, tail_m, speed_mps = trains
        if not changed and time_s < self._next_s and self._nobody_near(time_s, front_m, tail_m):
            return ()
        for row in events.left:
            self._gone[row] = True

        def stops_short_of(place_m: float) -> BoolArray:
            here_m = front_m + RESERVE_S * speed_mps
            return self._stops_short_of(place_m - RESERVE_M, here_m, speed_mps)

        standing = speed_mps == 0.0
        scene = Scene(time_s, front_m, tail_m, present, self._gone, standing, stops_short_of)
        before = self.state
        for machine in self._machines:
            machine.update(scene)
        self.unsettled = any(closure.unsettled for closure in self._closures)
        self._look(self._surprised(scene))
        self._watch_m = (
            np.min([machine.front_watch_m for machine in self._machines], axis=0),
            np.min([machine.tail_watch_m for machine in self._machines], axis=0),
        )
        self._next_s = min(machine.next_s for machine in self._machines) - ROUNDING_S
        if self.state.surprised.any():
            self._next_s = -np.inf
        self._nobody_near(time_s, front_m, tail_m)
        moved = self.state.obstructed_m != before.obstructed_m
        return tuple(np.flatnonzero(moved).tolist())

    @property
    def quiet_until_s(self) -> float:
        """Before this time nothing changes without an event. [s]"""
        if self.unsettled:
            return -np.inf
        return self._quiet_s if self._machines else np.inf

    def settle(self, state: LineState, covered_m: FloatArray) -> None:
        """
        Establish the work zones that nobody is in, or holds a permission into.

        Parameters
        ----------
        state
            The line.
        covered_m
            The furthest place that each train may still go to. [m], shape (n_trains,)
        """

        def stops_short_of(place_m: float) -> BoolArray:
            return self._stops_short_of(place_m, state.front_m, state.speed_mps)

        for closure in self._closures:
            if closure.unsettled:
                closure.settle(state, covered_m, stops_short_of)
        self.unsettled = any(closure.unsettled for closure in self._closures)

    def obstructions(self) -> tuple[Obstruction, ...]:
        """
        Return what was in the way until now: throws of points, obstacles, closures.

        Returns
        -------
        tuple[Obstruction, ...]
            In order of time.
        """
        found = (record for machine in self._machines for record in machine.log)
        return tuple(sorted(found, key=lambda record: (record.requested_s, record.id)))

    def _nobody_near(self, time_s: float, front_m: FloatArray, tail_m: FloatArray) -> bool:
        """Return whether no train changes anything, and work out how long that stays so."""
        front_watch_m, tail_watch_m = self._watch_m
        to_go_m = min(float((front_watch_m - front_m).min()), float((tail_watch_m - tail_m).min()))
        # Twice the highest speed of all: nobody can get there any sooner.
        still_s = time_s + max(0.5 * to_go_m / self._fastest_mps, 0.0)
        self._quiet_s = min(self._next_s, still_s)
        return to_go_m > 0.0

    def _stops_short_of(
        self, place_m: float, front_m: FloatArray, speed_mps: FloatArray
    ) -> BoolArray:
        braking = self._world.braking
        here_m = np.clip(front_m, *self._tables_m)
        there_m = np.full_like(here_m, np.clip(place_m, *self._tables_m))
        taken_m2ps2 = braking_v2_each(braking, self._rows, there_m)
        taken_m2ps2 -= braking_v2_each(braking, self._rows, here_m)
        stops: BoolArray = taken_m2ps2 >= np.square(speed_mps)
        return stops

    def _surprised(self, scene: Scene) -> BoolArray:
        """Return the trains that a sudden obstruction has come too near to."""
        until_s, past_m = self._surprise
        for column, machine in self._sudden:
            known = machine.concerns
            if self.state.start_m.size:
                # What was only announced may be new to a train that is about to start.
                known = self.state.concerns[:, column] & (self.state.from_s[column] == -np.inf)
            sprung = machine.concerns & ~known & scene.present
            if sprung.any():
                near = sprung & ~scene.stops_short_of(machine.hold_m)
                until_s[near] = np.inf
                past_m[near] = np.maximum(past_m[near], machine.end_m)
        calm = np.isinf(until_s) & (scene.standing | (scene.tail_m >= past_m))
        until_s[calm] = scene.time_s + RESERVE_S
        over = scene.gone | (scene.time_s >= until_s)
        until_s[over] = past_m[over] = -np.inf
        return past_m > -np.inf

    def _look(self, surprised: BoolArray) -> None:
        """Renew the state where it has changed; what was handed out stays as it was."""
        kept = self._machines
        concerns = np.stack([machine.concerns for machine in kept], axis=1)
        start_m, end_m, from_s, until_s = np.array(
            [(machine.start_m, machine.end_m, machine.from_s, machine.until_s) for machine in kept]
        ).T.copy()
        reach_m = np.where(concerns & (from_s == -np.inf), start_m, self._world.far_m)
        obstructed_m = reach_m.min(axis=1)
        first = np.where(obstructed_m < self._world.far_m, reach_m.argmin(axis=1), -1)
        renewed = WaysideState(
            start_m, end_m, from_s, until_s, concerns, obstructed_m, first, surprised
        )
        if not all(map(np.array_equal, renewed, self.state)):
            self.state = renewed
            self.version += 1
