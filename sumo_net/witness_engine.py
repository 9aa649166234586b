"""The engine that keeps all stops itself: trains move as commanded, and SUMO is a witness."""

from collections.abc import Iterable
from types import TracebackType
from typing import Self

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.loop.plain_engine import PlainEngine
from kankaku.railway.plan.world import World
from kankaku.railway.step.bundles import Span
from kankaku.railway.step.engine_contract import Observation
from kankaku.sumo_net import names
from kankaku.sumo_net.build import SumoFiles, steps_per_look, witnessed
from kankaku.sumo_net.door import bare, close, disarm, start
from kankaku.sumo_net.engine import AGREEMENT_M, ALL_CHECKS_OFF, EngineDisagreementError
from kankaku.sumo_net.network_xml import edge_of, twins
from kankaku.sumo_net.witness_xml import route_names, route_starts_m

COMPARED_LOOKS = 10
"""Looks from one comparison of places to the next; one also follows when trains come or go. [-]"""


class WitnessEngine(PlainEngine):
    """
    Runs trains on any line, with SUMO as an independent witness of places and collisions.

    Commands are integrated and stops are kept here. Once a second, or in every step where a second
    is no multiple of it, and in a run that is watched, SUMO moves its trains in one step of its own
    to where ours are. A ballistic step moves a train by the mean of two speeds, and both are chosen
    for it: the speed before the step is the one that gives the distance gone together with our
    present speed. Where that would be negative, which SUMO refuses, it is zero, and SUMO's train is
    slower than ours at the end of the step; places agree all the same, however often a train has
    stopped and started in between. SUMO says afterwards how far each train has gone, and the run
    ends if that is not what we say.

    A train that has entered since SUMO looked last is put where it is now, on the edge of its
    origin; one that has left is taken off before SUMO's step, so that a train that takes over the
    stock of another one is never there together with it. SUMO itself takes off a train whose front
    passes the end of its route; from then on it does not see it. Trains that have met are not
    compared any more: what SUMO does with them is its own affair.

    SUMO's clock is behind ours by less than a step where steps do not divide a second.

    SUMO sees trains that overlap on a track, in either direction, when it looks; see
    :mod:`kankaku.sumo_net.network_xml` for what it does not see.

    Parameters
    ----------
    files
        What SUMO reads.
    world
        Network, fleet and timetable.
    gui
        Show the run in sumo-gui.
    """

    def __init__(self, files: SumoFiles, world: World, *, gui: bool = False) -> None:
        super().__init__(world, np.zeros_like(files.dwell_s), world.step_s)
        self._dwell_s = files.dwell_s
        self._files = files
        self._gui = gui
        self._steps_per_look = 1 if gui else steps_per_look(world.step_s)
        self._period_s = self._steps_per_look * world.step_s
        services = world.timetable.services
        self._vehicles = [names.vehicle(service.train) for service in services]
        self._row_of = {vehicle: row for row, vehicle in enumerate(self._vehicles)}
        route_of = route_names(services)
        self._routes = [route_of[service.route] for service in services]
        self._types = [names.vehicle_type(service.train_type) for service in services]
        self._route_start_m = route_starts_m(witnessed(world.line), services)
        self._waits_for_sumo: set[int] = set()
        """Trains that have entered since SUMO looked last."""
        self._leaves_sumo: set[int] = set()
        """Trains that have left since then."""
        self._shown: IntArray = np.zeros(0, dtype=np.intp)
        self._vehicles_shown: list[str] = []
        self._seen_m: FloatArray = np.zeros(world.size)
        """Where each front was when SUMO looked last. [m]"""
        self._inserted_m = np.zeros(world.size)
        """Where each front was when SUMO saw it first. [m]"""
        self._colliding: frozenset[int] = frozenset()
        self._met: set[int] = set()
        self._looks = 0
        self._fresh: set[int] = set()
        """Who has collided within the steps that were taken in one go last."""

    def __enter__(self) -> Self:
        """Start SUMO."""
        # Where SUMO does not begin at a multiple of its step, vehicles appear a step late.
        period_ms = round(1000.0 * self._period_s)
        begin_ms = round(1000.0 * self._files.begin_s) // period_ms * period_ms
        options = {"step-length": f"{period_ms / 1000.0:.3f}", "begin": f"{begin_ms / 1000.0:.3f}"}
        self._sumo = sumo = start(self._files, options, gui=self._gui)
        vehicle = sumo.vehicle
        self._set_before = bare(vehicle, "setPreviousSpeed")
        self._set_after = bare(vehicle, "setSpeed")
        self._get_distance = bare(vehicle, "getDistance")
        for train_type in set(self._types):
            disarm(sumo, train_type)
        for rising, falling in twins(self._world.line).items():
            if sumo.edge.getBidiEdge(edge_of(rising)) != edge_of(falling):
                sumo.close()
                msg = f"SUMO does not know that {rising} and {falling} are one track"
                raise EngineDisagreementError(msg)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End SUMO; a window that the user closed interrupts the run like Ctrl-C."""
        close(self._sumo, error)

    def observe(self) -> Observation:
        """
        Return what is, once per step.

        Returns
        -------
        Observation
            The present moment; its arrays are not written to afterwards.
        """
        seen = super().observe()
        self._waits_for_sumo |= set(seen.entered)
        self._leaves_sumo |= set(seen.left)
        if self._steps and not self._steps % self._steps_per_look:
            self._look(seen.time_s, seen.front_m, seen.speed_mps)
        if self._fresh:
            seen = seen._replace(collided=tuple(sorted(self._fresh)))
            self._fresh = set()
        return seen

    def span(self) -> Span | None:
        """
        Return the steps up to the next entry or release; SUMO looks back at them.

        Returns
        -------
        Span | None
            None while a train waits to enter, and in a window, which shows every step.
        """
        return None if self._gui else super().span()

    def moved(self, commands_mps: FloatArray, front_m: FloatArray, speed_mps: FloatArray) -> None:
        """
        Take over where trains are after some steps of a span, and let SUMO look in between.

        Parameters
        ----------
        commands_mps
            What was commanded in each step to those who run. [m/s], shape (n_steps, n_running)
        front_m, speed_mps
            Fronts and speeds after the last one. [m], [m/s], shape (n_trains,)
        """
        first, steps, rows = self._steps, len(commands_mps), self._rows
        to_look = self._steps_per_look - first % self._steps_per_look
        if to_look < steps:
            speeds_mps = np.vstack([self._speed_mps[rows], commands_mps])
            gone_m = 0.5 * self._step_s * np.cumsum(speeds_mps[:-1] + speeds_mps[1:], axis=0)
            for after in range(to_look, steps, self._steps_per_look):
                there_m, then_mps = self._front_m.copy(), self._speed_mps.copy()
                there_m[rows] += gone_m[after - 1]
                then_mps[rows] = speeds_mps[after]
                time_s = self._begin_s + (first + after) * self._step_s
                self._look(time_s, there_m, then_mps)
        super().moved(commands_mps, front_m, speed_mps)

    def _look(self, time_s: float, front_m: FloatArray, speed_mps: FloatArray) -> None:
        """Let SUMO follow, compare, and take note of who has collided."""
        if self._leaves_sumo:
            self._take_off_in_sumo()
        rows = self._shown
        self._move_in_sumo(front_m.take(rows) - self._seen_m.take(rows), speed_mps.take(rows))
        added = sorted(self._waits_for_sumo)
        for row in added:
            self._add_to_sumo(row, float(front_m[row]), float(speed_mps[row]))
        self._waits_for_sumo.clear()
        self._sumo.simulationStep()
        ended = [self._row_of[vehicle] for vehicle in self._sumo.simulation.getArrivedIDList()]
        if added or ended:
            self._show({*rows.tolist(), *added} - {*ended})
        self._seen_m = front_m
        self._fresh |= self._new_collisions()
        self._looks += 1
        # Distances add up: what is off once stays off.
        if added or ended or self._looks % COMPARED_LOOKS == 0:
            self._compare(time_s, front_m)

    def _show(self, rows: Iterable[int]) -> None:
        """Take note of who is in SUMO."""
        self._shown = np.array(sorted(rows), dtype=np.intp)
        self._vehicles_shown = [self._vehicles[row] for row in self._shown.tolist()]

    def _take_off_in_sumo(self) -> None:
        # Whoever enters and leaves between two looks was never there.
        self._waits_for_sumo -= self._leaves_sumo
        shown = set(self._shown.tolist())
        for row in shown & self._leaves_sumo:
            self._sumo.vehicle.remove(self._vehicles[row])
        self._show(shown - self._leaves_sumo)
        self._leaves_sumo.clear()

    def _move_in_sumo(self, gone_m: FloatArray, speed_mps: FloatArray) -> None:
        twice_mean_mps = 2.0 * gone_m / self._period_s
        before_mps = np.maximum(twice_mean_mps - speed_mps, 0.0)
        after_mps = twice_mean_mps - before_mps
        # Whoever has not moved had no speed either, and SUMO lets it stand.
        moved = np.flatnonzero(gone_m)
        vehicles = [self._vehicles_shown[place] for place in moved.tolist()]
        speeds_mps = before_mps[moved].tolist(), after_mps[moved].tolist()
        for vehicle, before, after in zip(vehicles, *speeds_mps, strict=True):
            self._set_before(vehicle, before)
            self._set_after(vehicle, after)

    def _add_to_sumo(self, row: int, front_m: float, speed_mps: float) -> None:
        vehicle = self._vehicles[row]
        self._inserted_m[row] = front_m
        self._sumo.vehicle.add(
            vehicle,
            self._routes[row],
            self._types[row],
            departPos=repr(front_m - float(self._route_start_m[row])),
            departSpeed=repr(speed_mps),
        )
        self._sumo.vehicle.setSpeedMode(vehicle, ALL_CHECKS_OFF)

    def _new_collisions(self) -> frozenset[int]:
        met = self._sumo.simulation.getCollisions()
        colliding = frozenset(
            self._row_of[train] for one in met for train in (one.collider, one.victim)
        )
        fresh = colliding - self._colliding
        self._colliding = colliding
        self._met |= fresh
        return fresh

    def _compare(self, time_s: float, front_m: FloatArray) -> None:
        rows = self._shown
        gone_m = list(map(self._get_distance, self._vehicles_shown))
        apart_m = np.abs(front_m.take(rows) - self._inserted_m.take(rows) - gone_m)
        if self._met:
            apart_m[np.isin(rows, list(self._met))] = 0.0
        if apart_m.max(initial=0.0) > AGREEMENT_M:
            train = self._vehicles_shown[int(apart_m.argmax())]
            msg = f"{train} is {apart_m.max():.3f} m off its commands at {time_s:.1f} s"
            raise EngineDisagreementError(msg)
