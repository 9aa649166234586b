"""
Any centre's permissions over radio: worked out from reports, sent in telegrams, kept on board.

Once a cycle the centre asks a protection how far trains may go, of the line as it knows it: trains
by their last reports; points, who has left them, and obstructions by wire. Each train goes by the
telegram that it has heard last, and watches over line limits itself. Commands are valid for five
seconds, so that three telegrams in a row may be lost; a train that loses the fourth, too, brakes in
emergency until it stands and has commands again (Sugiyama 2018, section 3.1.3).

An end of authority that was sent once stays safe, whatever is lost or late after it. It counts on
no more than where the train ahead was when it last reported, and trains never go back; points that
are granted stay so until the train has passed. So an older end than the last one only lies nearer,
and a train needs no message to stay safe. Only an obstruction can take one back: what a train may
still go by is in :attr:`kankaku.railway.step.state.RadioPermission.covered_m`, until all trains
have acknowledged commands that were made with the obstruction (section 3.2.3 (2)).
"""

import math
from dataclasses import replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from kankaku.controllers.ceiling import LineCeiling
from kankaku.controllers.centre.reports import (
    Reports,
    emergency,
    no_reports,
    radio_of,
    take_reports,
)
from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, compiled, plain
from kankaku.railway.plan.brake_table import braking_v2_each
from kankaku.railway.plan.radio_spec import FOREVER, NEVER, TOLERANCE_S, RadioSpec
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight, Protection, Separation
from kankaku.railway.step.promises import Promises
from kankaku.railway.step.state import (
    NO_VERSION,
    NOTHING,
    Authority,
    LineState,
    RadioPermission,
    RadioState,
)

HORIZON_S = 5.0
"""For how long commands are valid after they are sent (Sugiyama 2018, section 3.1.3). [s]"""


class Centre(Protection[Any], Foresight, Protocol):
    """A protection whose permissions are a centre's matter, and whose ceilings are the line's."""

    ceiling: LineCeiling

    @property
    def separation(self) -> Separation:
        """What keeps its trains apart."""
        ...

    @property
    def promises(self) -> Promises:
        """What it promises beyond that."""
        ...


class Telegrams(NamedTuple):
    """Ends of authority of the last telegrams, in slots that are written in turn."""

    cycle: IntArray
    """In which it was sent; ``NEVER`` for an empty slot. shape (n_slots,)"""
    eoa_m: FloatArray
    """Shape (n_slots, n_trains). [m]"""
    eoa_by: IntArray
    """What is behind them. shape (n_slots, n_trains)"""
    older: int
    """Cycle of the last one that is forgotten, but may not be replaced everywhere."""
    older_m: FloatArray
    """The furthest ends of all those. [m], shape (n_trains,)"""


class OnAir(NamedTuple):
    """What centre and trains remember."""

    inner: Any
    """The memory of the centre's protection."""
    delay_s: FloatArray
    """The delays of its authorities. [s], shape (n_trains,)"""
    reports: Reports
    cleared_m: FloatArray
    """Tails are beyond this, as the last points that they have left know. [m], shape (n_trains,)"""
    telegrams: Telegrams
    next_s: float
    """When the next telegrams are sent. [s]"""
    made_of: tuple[int, int, int]
    """Versions of reports, telegrams and calls for which the rest was worked out."""
    eoa_m: FloatArray
    """The ends of authority that trains go by. [m], shape (n_trains,)"""
    eoa_by: IntArray
    """What is behind them. shape (n_trains,)"""
    covered_m: FloatArray
    """See :attr:`kankaku.railway.step.state.RadioPermission.covered_m`. [m], shape (n_trains,)"""
    emergency: BoolArray
    """Trains that brake in emergency. shape (n_trains,)"""


class OverRadio:
    """A protection whose permissions reach the trains by radio."""

    def __init__(self, inner: Centre, world: World, radio: RadioSpec) -> None:
        self._inner, self._world, self._radio = inner, world, radio
        self.separation = inner.separation
        self.promises = replace(inner.promises, validity_s=HORIZON_S)
        self.profile = inner.profile
        self.delay_s = inner.delay_s
        self.idle_time_s = inner.idle_time_s
        self.sighting_time_s = inner.sighting_time_s
        self.release_delay_s = inner.release_delay_s + radio.oldest_knowledge_s
        self._clears_m = [
            np.array([-np.inf, *(passage.clear_m for passage in way)]) for way in world.passages
        ]
        brakes = map(world.of_type, ("emergency_brake_mps2", "service_brake_mps2"))
        self._harder_mps2 = np.subtract(*brakes)
        self._nothing_commanded = np.full(world.size, np.inf)
        self._nothing = np.full(world.size, NOTHING, dtype=np.intp)
        # Whatever a train may still hear, or go by when it hears it, is remembered.
        self._slots = math.ceil((HORIZON_S + radio.delay_most_s) / radio.cycle_s) + 2

    def initial(self) -> OnAir:
        """Return the memory before the first step."""
        size, slots = self._world.size, self._slots
        nowhere = np.full(size, -np.inf)
        slots_m = np.full((slots, size), -np.inf)
        telegrams = Telegrams(
            np.full(slots, NEVER), slots_m, np.full((slots, size), NOTHING), NEVER, nowhere
        )
        return OnAir(
            self._inner.initial(),
            np.full(size, self.delay_s),
            no_reports(self._world, self._radio),
            nowhere,
            telegrams,
            -np.inf,
            (NO_VERSION, NO_VERSION, NO_VERSION),
            self._world.stop_m[:, 0].copy(),
            self._nothing,
            nowhere,
            np.zeros(size, dtype=np.bool_),
        )

    def authorise(self, state: LineState, memory: OnAir) -> tuple[Authority, OnAir]:
        """Return the authority of every train."""
        radio, present = radio_of(state), state.present
        reports = take_reports(memory.reports, state, radio, self._radio)
        if state.events.cleared:
            memory = memory._replace(cleared_m=self._cleared_m(state, memory.cleared_m))
        sends = state.time_s + TOLERANCE_S >= memory.next_s
        if sends:
            memory = self._send(state, memory._replace(reports=reports), radio)
        eoa_m, eoa_by, covered_m = memory.eoa_m, memory.eoa_by, memory.covered_m
        versions = radio.reports_version, radio.telegrams_version, state.calls_version
        if sends or versions != memory.made_of:
            held = eoa_m, eoa_by
            eoa_m, eoa_by, covered_m = _hear(
                radio.heard, radio.acknowledged, present, plain(memory.telegrams), held
            )
        brakes = emergency(memory.emergency, state, radio.heard_s, HORIZON_S)
        authority = Authority(
            eoa_m,
            self._inner.ceiling.ahead_mps(state),
            memory.delay_s,
            eoa_by,
            self._nothing,
            RadioPermission(brakes, self._nothing_commanded, covered_m),
        )
        return authority, OnAir(
            memory.inner,
            memory.delay_s,
            reports,
            memory.cleared_m,
            memory.telegrams,
            memory.next_s,
            versions,
            eoa_m,
            eoa_by,
            covered_m,
            brakes,
        )

    def _cleared_m(self, state: LineState, before_m: FloatArray) -> FloatArray:
        cleared_m = before_m.copy()
        for row in state.events.cleared:
            clears_m = self._clears_m[row]
            cleared_m[row] = clears_m[clears_m.searchsorted(state.tail_m[row], "right") - 1]
        return cleared_m

    def _send(self, state: LineState, memory: OnAir, radio: RadioState) -> OnAir:
        """Let the centre work out permissions from what it knows, and send them."""
        # A report may be older than the news that its train has left the points.
        reported_m = memory.reports.front_m - self._world.length_m
        reports, older = memory.reports, reported_m < memory.cleared_m
        tail_m, front_m, speed_mps = reported_m, reports.front_m, reports.speed_mps
        if older.any():
            tail_m = np.where(older, memory.cleared_m, reported_m)
            front_m = np.where(older, tail_m + self._world.length_m, front_m)
            slowed_mps = self._slowed_mps(reports.front_m, front_m, speed_mps)
            speed_mps = np.where(older, slowed_mps, speed_mps)
        rear_m = np.where(state.follows, tail_m[state.leader], np.inf)
        known = state._replace(
            front_m=front_m,
            tail_m=tail_m,
            speed_mps=speed_mps,
            clear_to_m=np.minimum(state.granted_to_m, rear_m),
        )
        authority, inner = self._inner.authorise(known, memory.inner)
        # Nothing is sent to a train that is not on the line.
        eoa_m = np.where(state.present, authority.eoa_m, -np.inf)
        cycle = self._radio.telegram_cycle(state.time_s)
        telegrams = _replaced(memory.telegrams, radio, state.present)
        return memory._replace(
            inner=inner,
            delay_s=authority.delay_s,
            telegrams=_added(telegrams, cycle, eoa_m, authority.eoa_by),
            next_s=self._radio.telegram_s(cycle) + self._radio.cycle_s,
        )

    def _slowed_mps(
        self, from_m: FloatArray, to_m: FloatArray, speed_mps: FloatArray
    ) -> FloatArray:
        """Return the least speeds at some places, after emergency braking from others."""
        braking, rows = self._world.braking, np.arange(self._world.size)
        taken = braking_v2_each(braking, rows, to_m) - braking_v2_each(braking, rows, from_m)
        taken += 2.0 * self._harder_mps2 * (to_m - from_m)
        slowed_mps: FloatArray = np.sqrt(np.maximum(np.square(speed_mps) - taken, 0.0))
        return slowed_mps

    def eoa_behind_m(
        self,
        row: int,
        call: int,
        leader: int,
        leader_front_m: FloatArray,
        leader_speed_mps: FloatArray,
    ) -> FloatArray:
        """Return the ends of authority of a train behind its leader, once it has heard of them."""
        return self._inner.eoa_behind_m(row, call, leader, leader_front_m, leader_speed_mps)

    def permitted_mps(self, row: int, front_m: FloatArray, eoa_m: FloatArray) -> FloatArray:
        """Return the speed that is permitted to a front before an end of authority that stays."""
        return self._inner.permitted_mps(row, front_m, eoa_m)


def _added(telegrams: Telegrams, cycle: int, eoa_m: FloatArray, eoa_by: IntArray) -> Telegrams:
    """Return the last telegrams and a new one."""
    slot = int(telegrams.cycle.argmin())
    cycles, eoas_m = telegrams.cycle.copy(), telegrams.eoa_m.copy()
    older, older_m = int(cycles[slot]), np.maximum(telegrams.older_m, eoas_m[slot])
    cycles[slot], eoas_m[slot] = cycle, eoa_m
    behind = telegrams.eoa_by.copy()
    behind[slot] = eoa_by
    return Telegrams(cycles, eoas_m, behind, older, older_m)


def _replaced(telegrams: Telegrams, radio: RadioState, present: BoolArray) -> Telegrams:
    """Return telegrams without those older ones that nobody goes by any more."""
    if telegrams.older >= radio.acknowledged.min(initial=FOREVER, where=present):
        return telegrams
    return telegrams._replace(older_m=np.full_like(telegrams.older_m, -np.inf))


@compiled
def _hear(
    heard: IntArray,
    acknowledged: IntArray,
    present: BoolArray,
    fields: Plain,
    held: tuple[FloatArray, IntArray],
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return how far trains go, what is there, and how far they may still go by old telegrams."""
    telegrams, size = Telegrams(*fields), heard.size
    effective = FOREVER
    for train in range(size):
        if present[train]:
            effective = min(effective, acknowledged[train])
    eoa_m, eoa_by = held[0].copy(), held[1].copy()
    covered_m = np.full(size, -np.inf)
    if telegrams.older >= effective:
        covered_m[:] = telegrams.older_m
    for slot in range(telegrams.cycle.size):
        cycle = telegrams.cycle[slot]
        for train in range(size):
            if cycle == heard[train] and cycle != NEVER:
                eoa_m[train] = telegrams.eoa_m[slot, train]
                eoa_by[train] = telegrams.eoa_by[slot, train]
            if cycle >= effective:
                covered_m[train] = max(covered_m[train], telegrams.eoa_m[slot, train])
    return eoa_m, eoa_by, covered_m
