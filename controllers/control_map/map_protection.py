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

from typing import Any, NamedTuple

import numpy as np

from kankaku.controllers.ceiling import LineCeiling, braked_to_mps
from kankaku.controllers.centre.reports import (
    Reports,
    Spoken,
    emergency,
    no_reports,
    radio_of,
    take_reports,
)
from kankaku.controllers.control_map.map_options import ControlMapOptions
from kankaku.controllers.control_map.map_steps import UPDATE_S, next_map_s, protect
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
from kankaku.controllers.control_map.planned_map import Horizon, MapPlan
from kankaku.controllers.control_map.planned_run import Pace, PlannedTrains, trains_of
from kankaku.controllers.control_map.planner import make_map
from kankaku.controllers.control_map.telegrams import (
    COMMANDS,
    Sent,
    acknowledged_in,
    added,
    commands_of,
    covered_of,
    nothing_sent,
)
from kankaku.controllers.control_map.train_order import order_of
from kankaku.controllers.options import OptionError
from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.boxed import boxed, boxed_with, unboxed
from kankaku.railway.compiled import Plain, plain
from kankaku.railway.plan.radio_spec import NEVER, TOLERANCE_S, RadioSpec
from kankaku.railway.plan.world import World
from kankaku.railway.safety.second_channel import checked, excludes
from kankaku.railway.step.bundles import LayerSteps, offered
from kankaku.railway.step.control import Separation
from kankaku.railway.step.promises import Promises
from kankaku.railway.step.state import (
    NO_VERSION,
    NOTHING,
    Authority,
    LineState,
    RadioPermission,
    authority_of,
)

__all__ = ["UPDATE_S", "ControlMap", "ControlMapOptions", "Memory"]

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
        self._order = plain(order_of(world))
        validity_s = UPDATE_S * COMMANDS
        self._checks = plain(checked(world, options.margin_m, OVERLAP_M, validity_s))
        self._line_ceiling = plain(self._ceiling.figures)
        self._no_delay_s, self._nobody = np.zeros(world.size), np.zeros(world.size, dtype=np.bool_)
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
        # Who plans or tests otherwise is asked in Python, where that can be seen.
        self._whole = offered(self, "steps", "authorise", "plan", "_excludes")
        self._boxed: tuple[tuple[Any, Any], Any] = (None, None), None
        self._plain_trains: tuple[PlannedTrains, Plain] = self._trains, plain(self._trains)

    def initial(self) -> Memory:
        """Return the memory before the first step: nobody has said anything."""
        size = self._world.size
        curves = np.zeros((4, 0, self._horizon.moments))
        nobody, nowhere = np.zeros(size, dtype=np.bool_), np.full(size, -np.inf)
        return Memory(
            no_reports(self._world, self._radio),
            MapPlan(
                -np.inf,
                np.zeros(0, dtype=np.intp),
                self._nothing,
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
        if state.units is None and self._whole:
            radio = radio_of(state)
            air = radio.reported, radio.heard, radio.acknowledged
            fields = self._fields(state)
            told, after, asks = protect(state.instant, air, fields, _remembered(memory))
            if not asks:
                memory = self.resumed(memory, after)
                permission = RadioPermission(self._nobody, told[5], memory.covered_m)
                return authority_of(told[:5], permission), memory
        return self._authorise(state, memory)

    def steps(self, state: LineState, memory: Memory) -> LayerSteps:
        """Return the compiled step."""
        until_s = np.inf if self._whole else -np.inf
        fields = self._fields(state)
        return LayerSteps(protect, fields, _remembered(memory), (), until_s, by_radio=True)

    def resumed(self, memory: Memory, after: Any) -> Memory:  # noqa: ANN401 - a box
        """Return the memory after a bundle of steps."""
        box, (next_report_s, next_s, held, held_m, _) = unboxed(after)
        (known_s, front_m, speed_mps, call, stopped_s), said, plan, sent, covered_m = unboxed(box)
        told = front_m, speed_mps, call, stopped_s
        return Memory(
            # What has arrived in between was not looked at before the next map.
            Reports(NO_VERSION, known_s, *told, next_report_s, Spoken(*said)),
            MapPlan(*plan),
            Sent(*sent),
            next_s,
            memory.refused_s,
            covered_m,
            held,
            held_m,
            self._nobody,
            memory.aboard,
        )

    def _fields(self, state: LineState) -> Any:  # noqa: ANN401 - a box
        """Return what a step works on until something happens, in a box."""
        beside, brakes = state.wayside, plain(self._trains.braking)
        made_of, box = self._boxed
        if made_of[0] is beside and made_of[1] is self._trains:
            return box
        obstructions = beside.start_m, beside.from_s, beside.until_s, beside.concerns
        sending = self._radio.cycle_s, self._options.tolerance_m
        keeping = self._line_ceiling, self._tempo, brakes
        always = self._no_delay_s, self._nothing, self._nobody
        box = boxed_with(self._mapping(), (obstructions, sending, keeping + always))
        self._boxed = (beside, self._trains), box
        return box

    def _mapping(self) -> Any:  # noqa: ANN401 - a box
        """Return what maps are planned and tested with, in a box."""
        trains, brakes = self._planned_trains(), plain(self._trains.braking)
        fixed = trains, self._order, tuple(self._horizon)
        return boxed((fixed, self._checks, brakes))

    def _planned_trains(self) -> Plain:
        if self._plain_trains[0] is not self._trains:
            self._plain_trains = self._trains, plain(self._trains)
        return self._plain_trains[1]

    def _authorise(self, state: LineState, memory: Memory) -> tuple[Authority, Memory]:
        """Return the same where something is wrong or may be."""
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
            sent = acknowledged_in(tuple(memory.sent), radio.acknowledged)
            covered_m = covered_of(sent, state.present)
            memory = memory._replace(sent=Sent(*sent), covered_m=covered_m)
        return self._keep(state, seen, memory)

    def _update(self, state: LineState, memory: Memory) -> Memory:
        """Let the centre make a map, and send it if it may."""
        next_s = next_map_s(state.time_s)
        aboard, reports, sent = memory.aboard, memory.reports, memory.sent
        if state.units is not None:
            in_time = abs(state.units.centre_clock_error_s) <= EARLY_S
            aboard = self._watch(state, aboard, reports, in_time=in_time)
            if not in_time:
                return memory._replace(next_s=next_s, aboard=aboard)
            stamped_s = np.minimum(reports.known_s + aboard.stamped_s, state.time_s)
            reports = reports._replace(known_s=stamped_s)
        plan = self.plan(state, reports, memory.plan, aboard.longer_m)
        brakes = plain(self._trains.braking)
        commands = commands_of(tuple(plan), brakes, self._options.tolerance_m)
        if not self._excludes(plan, commands[2], state, memory):
            if memory.refused_s < state.time_s - 1.5 * UPDATE_S:
                alarm = Alarm(state.time_s, Notice.EXCLUSION, CENTRE_ROW)
                aboard = aboard._replace(alarms=(*aboard.alarms, alarm))
            return memory._replace(next_s=next_s, refused_s=state.time_s, aboard=aboard)
        cycle = self._radio.telegram_cycle(state.time_s)
        if cycle > sent.cycle.max():
            when = cycle, self._radio.telegram_s(cycle)
            sent = Sent(*added(tuple(sent), when, commands, tuple(plan)))
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
        rows = np.flatnonzero(seen.present)
        eoa_by = behind_bands(rows, eoa_m, sent.cycle, sent.free_m, behind, held)
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
        trains, beside = self._planned_trains(), state.wayside
        if longer_m is not None and longer_m.any():
            # The front that counts is the furthest: at a stop when the train surely is.
            trains = plain(
                self._trains._replace(
                    length_m=self._trains.length_m + longer_m,
                    stop_m=self._trains.stop_m + longer_m[:, np.newaxis],
                )
            )
        obstructions = beside.start_m, beside.from_s, beside.until_s, beside.concerns
        now_s = UPDATE_S * round(state.time_s / UPDATE_S)
        line = state.whereabouts, state.granted_to_m, state.granted_by
        fixed = trains, self._order, obstructions, tuple(self._horizon)
        return MapPlan(*make_map(now_s, tuple(reports[1:6]), line, fixed, tuple(earlier)))

    def _excludes(
        self, plan: MapPlan, furthest_m: FloatArray, state: LineState, memory: Memory
    ) -> bool:
        """Return whether no band overlaps another one, and no end lies beyond what is free."""
        reports, longer_m = memory.reports, memory.aboard.longer_m
        told = state.time_s, reports.known_s, reports.front_m, reports.speed_mps, longer_m
        line = state.front_m, state.present, state.granted_to_m
        mapped = plan.rows, plan.planned, plan.rear_m, plan.ahead_m, furthest_m
        return excludes(told, line, mapped, self._checks)


def _remembered(memory: Memory) -> Any:  # noqa: ANN401 - a box
    """Return what a compiled step remembers, in a box."""
    reports, plan, sent, next_s, _, covered_m, held, held_m, emergency, _ = memory
    told = tuple(reports[1:6])
    box = boxed((told, tuple(reports.said), tuple(plan), tuple(sent), covered_m))
    return boxed_with(box, (reports.next_s, next_s, held, held_m, emergency))
