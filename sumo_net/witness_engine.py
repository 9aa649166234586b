"""The engine that keeps all stops itself: trains move as commanded, and SUMO is a witness."""

from types import TracebackType
from typing import Self

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.loop.plain_engine import PlainEngine
from kankaku.railway.plan.world import World
from kankaku.railway.step.bundles import Span
from kankaku.railway.step.engine_contract import Observation
from kankaku.sumo_net import names
from kankaku.sumo_net.agreement import Agreement, EngineDisagreementError
from kankaku.sumo_net.build import SumoFiles, steps_per_look, witnessed
from kankaku.sumo_net.door import bare, close, disarm, start
from kankaku.sumo_net.engine import ALL_CHECKS_OFF
from kankaku.sumo_net.network_xml import edge_of, twins
from kankaku.sumo_net.witness_moves import places_then, speeds_between
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
        self._shown: list[int] = []
        """Who is in SUMO, rising."""
        self._seen_m: FloatArray = np.zeros(world.size)
        """Where each front was when SUMO looked last. [m]"""
        self._inserted_m = np.zeros(world.size)
        """Where each front was when SUMO saw it first. [m]"""
        self._agreement = Agreement(self._row_of)
        self._looks = 0

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
        self._advance = bare(sumo.simulation, "step")
        self._arrived = bare(sumo.simulation, "getArrivedIDList")
        self._agreement.ask(bare(sumo.simulation, "getCollisions"))
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
            rows = self._looked_at()
            self._look([seen.time_s], rows, seen.front_m[rows][None], seen.speed_mps[rows][None])
        return self._agreement.told_in(seen)

    def span(self) -> Span | None:
        """
        Return the steps up to the next entry or release; SUMO looks back at them.

        Returns
        -------
        Span | None
            None where a train may enter now, and in a window, which shows every step.
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
        every, steps = self._steps_per_look, len(commands_mps)
        first = every - self._steps % every
        looks = max(0, (steps - 1 - first) // every + 1)
        if looks:
            rows = self._looked_at()
            there_m = np.empty((looks, rows.size))
            then_mps = np.empty((looks, rows.size))
            trains = rows, self._rows, self._front_m, self._speed_mps
            places_then(trains, commands_mps, (first, every, self._step_s), there_m, then_mps)
            moments = self._steps + first + every * np.arange(looks)
            times_s = self._begin_s + moments * self._step_s
            self._look(times_s.tolist(), rows, there_m, then_mps)
        super().moved(commands_mps, front_m, speed_mps)

    def _looked_at(self) -> IntArray:
        """Return who is in SUMO, or is to be."""
        return np.array(sorted({*self._shown, *self._waits_for_sumo}), dtype=np.intp)

    def _look(
        self, times_s: list[float], rows: IntArray, front_m: FloatArray, speed_mps: FloatArray
    ) -> None:
        """
        Let SUMO follow from moment to moment, compare, and take note of who has collided.

        Fronts and speeds of the rows at these moments have shape (n_moments, n_rows).
        """
        if self._leaves_sumo:
            self._take_off_in_sumo()
        told_m_mps = np.empty((3, *front_m.shape))
        speeds_between(rows, (self._seen_m, front_m, speed_mps), self._period_s, told_m_mps)
        told = told_m_mps.tolist()
        vehicles = self._told_in(rows)
        for at, time_s in enumerate(times_s):
            self._move_in_sumo(vehicles, told[0][at], told[1][at], told[2][at])
            added = sorted(self._waits_for_sumo)
            for row in added:
                column = int(np.searchsorted(rows, row))
                self._add_to_sumo(row, float(front_m[at, column]), float(speed_mps[at, column]))
            self._waits_for_sumo.clear()
            self._advance()
            ended = [self._row_of[vehicle] for vehicle in self._arrived()]
            if added or ended:
                self._shown = sorted({*self._shown, *added} - {*ended})
                vehicles = self._told_in(rows)
            self._agreement.look()
            self._looks += 1
            # Distances add up: what is off once stays off.
            if added or ended or self._looks % COMPARED_LOOKS == 0:
                self._compare(time_s, rows, front_m[at])

    def _told_in(self, rows: IntArray) -> list[str]:
        """Return the vehicles of some rows; nothing for those that SUMO does not have."""
        shown = set(self._shown)
        return [self._vehicles[row] if row in shown else "" for row in rows.tolist()]

    def _take_off_in_sumo(self) -> None:
        # Whoever enters and leaves between two looks was never there.
        self._waits_for_sumo -= self._leaves_sumo
        for row in self._leaves_sumo.intersection(self._shown):
            self._sumo.vehicle.remove(self._vehicles[row])
        self._shown = [row for row in self._shown if row not in self._leaves_sumo]
        self._leaves_sumo.clear()

    def _move_in_sumo(
        self,
        vehicles: list[str],
        gone_m: list[float],
        before_mps: list[float],
        after_mps: list[float],
    ) -> None:
        for vehicle, gone, before, after in zip(
            vehicles, gone_m, before_mps, after_mps, strict=True
        ):
            # Whoever has not moved had no speed either, and SUMO lets it stand.
            if gone and vehicle:
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

    def _compare(self, time_s: float, rows: IntArray, front_m: FloatArray) -> None:
        columns = np.searchsorted(rows, self._shown)
        vehicles = [self._vehicles[row] for row in self._shown]
        gone_m = list(map(self._get_distance, vehicles))
        apart_m = np.abs(front_m[columns] - self._inserted_m[self._shown] - gone_m)
        self._agreement.refuse_apart(self._shown, vehicles, apart_m, time_s)
