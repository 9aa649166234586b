"""
Control map: a centre plans the run of every train and commands them by radio.

Every half second the centre plans the run curves of all trains for the next minute from what
they last reported, first train first, so that their *bands* do not overlap: ahead of a train its
braking distance and a margin, behind it the place where its tail was before the longest delay of a
message that it brakes. Every second it sends each train the next five seconds of its plan in ten
steps. A train keeps within its band with the service brake, and in emergency if it must; when
its commands have run out it brakes in emergency.

A command never lets a train go beyond what was free when it was made: the tail of the train
ahead as last reported, and what was granted. So no loss or delay of messages, no clock and no
plan that the train ahead does not keep can make a command unsafe afterwards; only something that
is put in a train's way could, and nothing is before every train has acknowledged a map without it.

What of positions, clocks and time stamps is believed where units may be wrong is said in
:mod:`kankaku.controllers.control_map.measuring`.
"""

import math
from typing import NamedTuple

import numpy as np

from kankaku.controllers.centre.reports import (
    Reports,
    emergency,
    no_reports,
    radio_of,
    take_reports,
)
from kankaku.controllers.control_map.map_options import ControlMapOptions
from kankaku.controllers.control_map.measuring import (
    CENTRE_ROW,
    EARLY_S,
    Aboard,
    Alarm,
    Notice,
    all_right,
    measure,
)
from kankaku.controllers.control_map.onboard import (
    Tempo,
    behind_bands,
    ceilings_mps,
    keep_bands,
    may_leave,
)
from kankaku.controllers.control_map.planned_map import Horizon, Known, MapPlan
from kankaku.controllers.control_map.planned_run import Pace, trains_of
from kankaku.controllers.control_map.planner import MapScene, make_plan
from kankaku.controllers.control_map.telegrams import COMMANDS, Sent, eoas_m, nothing_sent
from kankaku.controllers.control_map.train_order import order_of
from kankaku.controllers.control_map.way_ahead import Grid, Obstructions
from kankaku.controllers.options import OptionError
from kankaku.controllers.protection.ceiling import LineCeiling, braked_to_mps
from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import plain
from kankaku.railway.plan.radio_spec import NEVER, TOLERANCE_S, RadioSpec
from kankaku.railway.plan.world import World
from kankaku.railway.safety.band_exclusion import (
    Bands,
    NetworkWays,
    free_in_network_m,
    free_to_m,
    layers_of,
    network_ways_of,
    overlaps_m,
    ways_of,
)
from kankaku.railway.step.control import Separation
from kankaku.railway.step.promises import Promises
from kankaku.railway.step.state import NOTHING, Authority, LineState, RadioPermission

__all__ = ["UPDATE_S", "ControlMap", "ControlMapOptions", "Memory"]

UPDATE_S = 0.5
"""Time between maps, and between the moments of a map (Sugiyama 2018, section 3.1.3). [s]"""
OVERLAP_M = 0.1
"""Runs are stepped, so bands may pass their ends by this much. [m]"""


class Memory(NamedTuple):
    """What centre and trains remember."""

    reports: Reports
    plan: MapPlan
    sent: Sent
    next_s: float
    """When the next map is made. [s]"""
    refused_s: float
    """When the last map was made whose bands overlapped: nothing of it was sent. [s]"""
    covered_m: FloatArray
    """See :attr:`kankaku.railway.step.state.RadioPermission.covered_m`. [m], shape (n_trains,)"""
    held: IntArray
    """Cycle of the commands that trains go by. shape (n_trains,)"""
    held_m: FloatArray
    """Ends of authority that trains keep. [m], shape (n_trains,)"""
    emergency: BoolArray
    """Who brakes in emergency. shape (n_trains,)"""
    aboard: Aboard
    """What is known of measurements; it changes only where they may be wrong."""


class ControlMap:
    """The centre, and the trains that go by its commands."""

    separation = Separation.STANDING
    delay_s = 0.0
    idle_time_s = 0.0
    sighting_time_s = 0.0

    def __init__(self, world: World, options: ControlMapOptions, radio: RadioSpec) -> None:
        self._world, self._options, self._radio = world, options, radio
        self.profile = world.driven_profile
        self.promises = Promises(options.margin_m, validity_s=UPDATE_S * COMMANDS)
        self.release_delay_s = radio.oldest_knowledge_s
        self._ceiling = LineCeiling(world, world.profile)
        if world.line.first_come:
            problem = "the control map plans by the order of the timetable"
            raise OptionError(problem, 'interlocking.order = "timetable"')
        self._order, self._layers = order_of(world), layers_of(world)
        self._ways = network_ways_of(world) if world.line.network else ways_of(world)
        self._no_delay_s = np.zeros(world.size)
        self._nothing = np.full(world.size, NOTHING, dtype=np.intp)
        self._trains = trains_of(
            world,
            Pace(UPDATE_S, options.smooth_brake_kmhps / 3.6, options.early_s, options.margin_m),
        )
        self._horizon = Horizon(
            round(options.horizon_s / UPDATE_S) + 1,
            round(options.delay_s / UPDATE_S),
            round(options.reserve_s / UPDATE_S),
        )
        self._tempo = plain(Tempo(world.step_s, UPDATE_S))

    def initial(self) -> Memory:
        """Return the memory before the first step: nobody has said anything."""
        size = self._world.size
        curves = np.zeros((4, size, self._horizon.moments))
        nobody, nowhere = np.zeros(size, dtype=np.bool_), np.full(size, -np.inf)
        return Memory(
            no_reports(self._world),
            MapPlan(
                -np.inf,
                curves[0],
                curves[1],
                curves[2],
                curves[3],
                nowhere,
                nobody,
                self._nothing,
                self._nothing,
            ),
            nothing_sent(size),
            -np.inf,
            -np.inf,
            nowhere,
            np.full(size, NEVER),
            nowhere,
            nobody,
            all_right(self._world),
        )

    def authorise(self, state: LineState, memory: Memory) -> tuple[Authority, Memory]:
        """Return the authority of every train."""
        seen, aboard = state, memory.aboard
        if state.units is not None:
            allowance_m = 0.5 * self._options.margin_m
            known = (memory.sent.cycle, self._world, self._radio, allowance_m)
            seen, aboard = measure(state, aboard, *known)
        radio = radio_of(seen)
        reports = take_reports(memory.reports, seen, radio, self._radio)
        memory = memory._replace(reports=reports, aboard=aboard)
        if state.time_s + TOLERANCE_S >= memory.next_s:
            memory = self._update(seen, memory)
            sent = memory.sent.acknowledged(radio.acknowledged)
            memory = memory._replace(sent=sent, covered_m=sent.covered_m(state.present))
        return self._keep(state, seen, memory)

    def _update(self, state: LineState, memory: Memory) -> Memory:
        """Let the centre make a map, and send it if it may."""
        next_s = UPDATE_S * (math.floor((state.time_s + TOLERANCE_S) / UPDATE_S) + 1)
        aboard, reports, sent = memory.aboard, memory.reports, memory.sent
        if state.units is not None:
            in_time = abs(state.units.centre_clock_error_s) <= EARLY_S
            aboard = self._watch(state, aboard, reports, in_time=in_time)
            if not in_time:
                return memory._replace(next_s=next_s, aboard=aboard)
            stamped_s = np.minimum(reports.known_s + aboard.stamped_s, state.time_s)
            reports = reports._replace(known_s=stamped_s)
        plan = self.plan(state, reports, memory.plan, aboard.longer_m)
        eoa_m = eoas_m(
            plan.front_m[:, : COMMANDS + 1],
            plan.speed_mps[:, : COMMANDS + 1],
            plan.free_m,
            plain(self._trains.braking),
            self._options.tolerance_m,
        )
        furthest_m = np.where(plan.planned, eoa_m.max(axis=1), -np.inf)
        if not self._excludes(plan, furthest_m, state, memory):
            if memory.refused_s < state.time_s - 1.5 * UPDATE_S:
                alarm = Alarm(state.time_s, Notice.EXCLUSION, CENTRE_ROW)
                aboard = aboard._replace(alarms=(*aboard.alarms, alarm))
            return memory._replace(next_s=next_s, refused_s=state.time_s, aboard=aboard)
        cycle = self._radio.telegram_cycle(state.time_s)
        if cycle > sent.cycle.max():
            when = cycle, self._radio.telegram_s(cycle)
            commands = eoa_m, plan.speed_mps[:, : COMMANDS + 1]
            behind = plan.free_by, plan.slowed_by
            sent = sent.added(when, commands, plan.free_m, furthest_m, behind)
            if state.units is not None:
                aboard = aboard._replace(stamp_error_s=state.units.centre_clock_error_s)
        return memory._replace(next_s=next_s, plan=plan, sent=sent, aboard=aboard)

    def _watch(
        self, state: LineState, aboard: Aboard, reports: Reports, *, in_time: bool
    ) -> Aboard:
        """Note what the centre finds to be wrong but maps."""
        if aboard.in_time and not in_time:
            alarm = Alarm(state.time_s, Notice.CENTRE_CLOCK, CENTRE_ROW)
            aboard = aboard._replace(alarms=(*aboard.alarms, alarm))
        unheard = state.present & (reports.known_s < state.time_s - self._options.delay_s)
        unheard &= np.isfinite(reports.known_s)
        aboard = aboard.alarm(state.time_s, Notice.NO_REPORT, unheard & ~aboard.unheard)
        return aboard._replace(unheard=unheard, in_time=in_time)

    def _keep(self, state: LineState, seen: LineState, memory: Memory) -> tuple[Authority, Memory]:
        """Let trains keep the bands that they have heard of."""
        aboard, held_m = memory.aboard, memory.held_m + memory.aboard.shift_m
        knows = (
            state.time_s + aboard.clock_error_s - aboard.stamp_error_s,
            state.stop_m - state.front_m,
            radio_of(seen).heard,
            memory.held,
            held_m,
        )
        brakes = plain(self._trains.braking)
        eoa_m, commanded_mps, held = keep_bands(
            seen.whereabouts, knows, plain(memory.sent), self._tempo, brakes
        )
        sent = memory.sent
        behind = sent.free_by, sent.slowed_by
        eoa_by = behind_bands(eoa_m, sent.cycle, sent.free_m, behind, held)
        held_s = runs_out_s = self._radio.telegrams_s(held)
        if state.units is not None:
            runs_out_s = held_s + aboard.stamp_error_s - aboard.clock_error_s
            runs_out_s = np.where(aboard.slow, -np.inf, runs_out_s)
        braking = emergency(memory.emergency, state, runs_out_s, UPDATE_S * COMMANDS)
        ceiling_mps = self._ceiling.ahead_mps(state)
        if state.units is not None:
            aboard = aboard.alarm(state.time_s, Notice.NO_COMMANDS, braking & ~memory.emergency)
            ceiling_mps = ceilings_mps(self._ceiling, seen, aboard)
            leaving = may_leave(seen, aboard, eoa_m, self._trains.braking)
            aboard = aboard._replace(leaving=leaving)
            # What was permitted stays so: only where the train is has become uncertain.
            eoa_m = np.where(leaving, np.maximum(eoa_m, held_m), eoa_m) - aboard.shift_m
        permission = RadioPermission(braking | aboard.leaving, commanded_mps, memory.covered_m)
        bounds = eoa_m, ceiling_mps, self._no_delay_s
        authority = Authority(*bounds, eoa_by, self._nothing, permission)
        return authority, memory._replace(held=held, held_m=eoa_m, emergency=braking, aboard=aboard)

    def eoa_behind_m(
        self,
        row: int,  # noqa: ARG002 - the same for all
        call: int,  # noqa: ARG002
        leader: int,
        leader_front_m: FloatArray,
        leader_speed_mps: FloatArray,  # noqa: ARG002 - the leader is taken as standing
    ) -> FloatArray:
        """Return the end of authority of a train behind its leader."""
        behind_m: FloatArray = leader_front_m - self._world.length_m[leader]
        return behind_m - self._options.margin_m

    def permitted_mps(self, row: int, front_m: FloatArray, eoa_m: FloatArray) -> FloatArray:
        """Return the speed from which the service brake keeps an end of authority that stays."""
        braked_mps = braked_to_mps(self._world, row, (front_m, eoa_m))
        return np.minimum(braked_mps, self._ceiling.at_mps(row, front_m))

    def plan(
        self,
        state: LineState,
        reports: Reports,
        earlier: MapPlan,
        longer_m: FloatArray | None = None,
    ) -> MapPlan:
        """
        Make a map.

        Parameters
        ----------
        state
            The line, of which only what is known by wire is read: points, obstructions, and who
            is on it.
        reports
            What trains have reported.
        earlier
            The map that they have gone by since.
        longer_m
            By so much bands are longer, because it is uncertain where trains are; None for not
            at all. [m], shape (n_trains,)

        Returns
        -------
        MapPlan
            Run curves and bands.
        """
        world, call, trains, beside = self._world, reports.call, self._trains, state.wayside
        if longer_m is not None and longer_m.any():
            # The front that counts is the furthest: at a stop when the train surely is.
            trains = trains._replace(
                length_m=trains.length_m + longer_m,
                stop_m=trains.stop_m + longer_m[:, np.newaxis],
            )
        rows = np.arange(world.size)
        ready_s = reports.stopped_s + world.minimum_dwell_s[rows, call]
        known = Known(
            reports.known_s,
            reports.front_m,
            reports.speed_mps,
            call,
            np.where(
                np.isfinite(reports.stopped_s),
                np.maximum(world.booked_departure_s[rows, call], ready_s),
                np.inf,
            ),
            state.present,
            self._gone(state),
            state.granted_to_m,
            state.granted_by,
        )
        now_s = UPDATE_S * round(state.time_s / UPDATE_S)
        scene = MapScene(
            Grid(now_s, UPDATE_S, self._horizon.moments),
            known,
            trains,
            self._order,
            Obstructions(beside.start_m, beside.from_s, beside.until_s, beside.concerns),
            self._horizon,
        )
        return make_plan(scene, earlier)

    def _gone(self, state: LineState) -> BoolArray:
        """Return who has left the line: detection at both ends of it is by wire."""
        return ~state.present & (state.front_m > self._world.stop_m[:, 0])

    def _excludes(
        self, plan: MapPlan, furthest_m: FloatArray, state: LineState, memory: Memory
    ) -> bool:
        """Return whether no band overlaps another one, and no end lies beyond what is free."""
        reports, margin_m = memory.reports, self._options.margin_m
        tail_m = reports.front_m - self._world.length_m - memory.aboard.longer_m
        gone, granted_to_m = self._gone(state), state.granted_to_m
        if isinstance(self._ways, NetworkWays):
            free_m = free_in_network_m(tail_m, gone, granted_to_m, self._ways)
        else:
            free_m = free_to_m(reports.front_m, tail_m, gone, granted_to_m, self._ways)
        over_m = furthest_m + margin_m - free_m
        if over_m.max(initial=0.0, where=state.present) > OVERLAP_M:
            return False
        bands = Bands(plan.rear_m, plan.ahead_m - OVERLAP_M)
        # Who has not been planned for is sent nothing, and stays or stops by what it has.
        inside_m = overlaps_m(bands, state.present, self._there_m(state, reports), self._layers)
        return not (inside_m[plan.planned] > 0.0).any()

    def _there_m(self, state: LineState, reports: Reports) -> FloatArray:
        """Return what bands reach whatever is planned: trains have run on since their reports."""
        age_s = np.clip(state.time_s - reports.known_s, 0.0, UPDATE_S * COMMANDS)
        now_m = reports.front_m + age_s * reports.speed_mps
        anywhere_m, now = np.full_like(now_m, np.inf), np.newaxis
        braking = plain(self._trains.braking)
        own_m = eoas_m(now_m[:, now], reports.speed_mps[:, now], anywhere_m, braking, 0.0)
        return own_m[:, 0] + self._options.margin_m
