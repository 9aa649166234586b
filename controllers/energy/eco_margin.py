"""
The energy layer: around any operation, runs of least energy where time is cheap.

The fastest run brakes harder than the electric brake can take, so its last hundredths of a second
cost the most energy of all. Each leg is planned for the fastest run time and a margin. Where the
timetable leaves recovery time the layer may also spend that: then the booked arrival is the aim.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from kankaku.controllers.energy.leg_runs import FREE_MPS, LegRuns, Table
from kankaku.controllers.operation.eco import CATCHING_UP_PS, Able, able_from, able_of, free_mps
from kankaku.controllers.options import require
from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, compiled, interpolated
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight, Operation
from kankaku.railway.step.state import NOTHING, Advice, Authority, LineState, Whereabouts

WORD = "eco_margin"
PATIENCE_S = 2.0
"""Who is later than its plan by this runs as quickly as planned, or plans anew. [s]"""
QUICKEST, SPARED = 0, 1
"""Rows of what trains have two of: the run with the margin only, and the one in time to spare."""


@dataclass(frozen=True, slots=True)
class EcoMarginOptions:
    """How much time the energy layer may spend."""

    eco_margin_s: float = 0.05
    """Beyond the fastest run, on every leg. [s]"""
    eco_reserve: bool = False
    """A train with time to spare arrives when it is booked."""

    def __post_init__(self) -> None:
        require("eco_margin_s", self.eco_margin_s, 0.001, 60.0)


class MarginPlans(NamedTuple):
    """What every train is about to do; arrays of shape (n_trains,) but where told."""

    inner: Any
    """What the operation remembers."""
    due_s: FloatArray
    """When the train is to arrive, if it can. [s]"""
    since_s: FloatArray
    """When the run in time to spare began. [s]"""
    from_m: FloatArray
    """Where both runs begin. [m], shape (2, n_trains)"""
    tables: tuple[tuple[Table | None, Table | None], ...]
    """Both runs by train."""
    starts: IntArray
    """Where these begin among the points. shape (2, n_trains)"""
    lengths: IntArray
    """Points of each. shape (2, n_trains)"""
    points: FloatArray
    """All different tables, one after the other. shape (2, n_points)"""


class Followed(NamedTuple):
    """What steps need of :class:`MarginPlans`."""

    since_s: FloatArray
    from_m: FloatArray
    starts: IntArray
    lengths: IntArray
    points: FloatArray


class EcoMargin:
    """
    Lowers what an operation advises to runs of least energy.

    Parameters
    ----------
    operation
        The operation.
    world
        The trains, as they are driven.
    usual
        The same in the style whose run times count as usual.
    options
        How much time may be spent.
    foresight
        What the protection says beforehand.
    """

    def __init__(
        self,
        operation: Operation[Any],
        world: World,
        usual: World,
        options: EcoMarginOptions,
        foresight: Foresight,
    ) -> None:
        self._operation, self._world = operation, world
        self._usual_driving, self._reserve = usual.driving, options.eco_reserve
        self._runs = LegRuns(world, usual, foresight, options.eco_margin_s)
        self._rise_s = world.departure_lag_s - world.reaction_s
        self._able = able_of(world, PATIENCE_S)
        self.reasons = tuple(dict.fromkeys((*operation.reasons, WORD)))
        self._word = self.reasons.index(WORD)

    def initial(self) -> MarginPlans:
        """Return the memory before the first step: no train has a plan."""
        size = self._world.size
        return MarginPlans(
            inner=self._operation.initial(),
            due_s=np.full(size, np.inf),
            since_s=np.full(size, np.inf),
            from_m=np.zeros((2, size)),
            tables=((None, None),) * size,
            starts=np.zeros((2, size), dtype=np.intp),
            lengths=np.zeros((2, size), dtype=np.intp),
            points=np.zeros((2, 0)),
        )

    def advise(
        self, state: LineState, authority: Authority, memory: MarginPlans
    ) -> tuple[Advice, MarginPlans]:
        """Return the advice of the operation, lowered where a plan says so."""
        advice, inner = self._operation.advise(state, authority, memory.inner)
        memory = self._with_events(state, memory._replace(inner=inner))
        if not memory.points.size:
            return advice, memory
        lowered, behind = self._follow(state, authority, advice, memory)
        if behind.any():
            memory = self._planned_anew(state, memory, np.flatnonzero(behind).tolist())
            lowered, _ = self._follow(state, authority, advice, memory)
        return lowered, memory

    def _follow(
        self, state: LineState, authority: Authority, advice: Advice, memory: MarginPlans
    ) -> tuple[Advice, BoolArray]:
        plans = memory.since_s, memory.from_m, memory.starts, memory.lengths, memory.points
        ends = authority.eoa_m, authority.delay_s, authority.ceiling_mps
        asked = advice.ceiling_mps, advice.reason, advice.cause
        now = state.time_s, self._word
        found = _follow(now, state.whereabouts, ends, asked, plans, self._able)
        return Advice(*found[:3]), found[3]

    def _with_events(self, state: LineState, memory: MarginPlans) -> MarginPlans:
        """Plan for those who depart, and forget the plans of those who have arrived."""
        events, world = state.events, self._world
        if not (events.arrived or events.departed or events.left):
            return memory
        tables = list(memory.tables)
        due_s, since_s, from_m = (
            values.copy() for values in (memory.due_s, memory.since_s, memory.from_m)
        )
        for row in (*events.arrived, *events.left):
            tables[row] = None, None
        for row in events.departed:
            call = int(state.next_call[row])
            if row in events.left or not 0 < call < world.call_count[row]:
                continue
            # Who moves now began to a step ago.
            began_s = state.time_s - world.step_s
            since_s[row], from_m[:, row] = began_s + self._rise_s[row], world.stop_m[row, call - 1]
            late_s = began_s - world.reaction_s - world.booked_departure_s[row, call - 1]
            hurries = bool(late_s > self._usual_driving.late_after_s)
            due_s[row] = self._due_s(row, call, since_s[row], hurries)
            tables[row] = self._planned(row, call, float(due_s[row] - since_s[row]), hurries)
        memory = memory._replace(due_s=due_s, since_s=since_s, from_m=from_m)
        return _laid(memory, tables)

    def _planned(
        self, row: int, call: int, left_s: float, hurries: bool
    ) -> tuple[Table | None, Table | None]:
        if not self._reserve:
            return self._runs.quickest(row, call, hurries or not self._usual_driving.hurries), None
        return self._runs.quickest(row, call, True), self._runs.in_time(row, call, left_s)

    def _due_s(self, row: int, call: int, since_s: float, hurries: bool) -> float:
        """
        Return when a train is to arrive that could be earlier: the one place where that is decided.

        Whoever knows better, as a supervisor of the line, gives its time here.
        """
        booked_s = float(self._world.booked_arrival_s[row, call])
        if hurries or not self._usual_driving.idles:
            return booked_s
        return max(booked_s, since_s + self._runs.usual_s(row, call))

    def _planned_anew(self, state: LineState, memory: MarginPlans, rows: list[int]) -> MarginPlans:
        """Plan for what is left of the time of trains that were held up and are free again."""
        tables = list(memory.tables)
        since_s, from_m = memory.since_s.copy(), memory.from_m.copy()
        for row in rows:
            front_m, speed_mps = float(state.front_m[row]), float(state.speed_mps[row])
            left_s = float(memory.due_s[row]) - state.time_s
            since_s[row], from_m[SPARED, row] = state.time_s, front_m
            spared = self._runs.from_here(
                row, (front_m, float(state.stop_m[row])), speed_mps, left_s
            )
            tables[row] = tables[row][QUICKEST], spared
        return _laid(memory._replace(since_s=since_s, from_m=from_m), tables)


def _laid(memory: MarginPlans, tables: list[tuple[Table | None, Table | None]]) -> MarginPlans:
    """Lay all different tables one after the other, as the steps want them."""
    starts = np.zeros((2, len(tables)), dtype=np.intp)
    lengths = np.zeros_like(starts)
    found: dict[int, int] = {}
    kept: list[Table] = []
    size = 0
    for row, pair in enumerate(tables):
        for which, table in enumerate(pair):
            if table is None:
                continue
            if id(table) not in found:
                found[id(table)] = size
                kept.append(table)
                size += table.shape[1]
            starts[which, row], lengths[which, row] = found[id(table)], table.shape[1]
    points = np.hstack(kept) if kept else np.zeros((2, 0))
    return memory._replace(tables=tuple(tables), starts=starts, lengths=lengths, points=points)


@compiled
def _follow(
    now: tuple[float, int],
    whereabouts: Plain,
    ends: tuple[FloatArray, FloatArray, FloatArray],
    asked: tuple[FloatArray, IntArray, IntArray],
    plan_fields: Plain,
    able_fields: Plain,
) -> tuple[FloatArray, IntArray, IntArray, BoolArray]:
    """Return ceilings, why, for what, and who is behind its plan although it could follow it."""
    trains, plans, able = Whereabouts(*whereabouts), Followed(*plan_fields), able_from(able_fields)
    now_s, word = now
    ceiling_mps, reason, cause = asked[0].copy(), asked[1].copy(), asked[2].copy()
    behind = np.zeros(ceiling_mps.size, dtype=np.bool_)
    for train in range(ceiling_mps.size):
        if not trains.running[train]:
            continue
        front_m, speed_mps = trains.front_m[train], trains.speed_mps[train]
        along_m = front_m - plans.from_m[QUICKEST, train]
        lowest_mps = FREE_MPS
        if 0.0 <= along_m < plans.lengths[QUICKEST, train] - 1:
            lowest_mps = interpolated(plans.points[0], along_m + plans.starts[QUICKEST, train])
        along_m = front_m - plans.from_m[SPARED, train]
        if 0.0 <= along_m < plans.lengths[SPARED, train] - 1:
            place = along_m + plans.starts[SPARED, train]
            late_s = now_s - plans.since_s[train] - interpolated(plans.points[1], place)
            if late_s <= able.patience_s:
                spared_mps = interpolated(plans.points[0], place)
                lowest_mps = min(lowest_mps, spared_mps + CATCHING_UP_PS * max(late_s, 0.0))
            else:
                free = _free_mps(train, (front_m, speed_mps), ends, ceiling_mps[train], able)
                behind[train] = free > speed_mps + 1.0
        if lowest_mps < ceiling_mps[train]:
            ceiling_mps[train], reason[train], cause[train] = lowest_mps, word, NOTHING
    return ceiling_mps, reason, cause, behind


@compiled
def _free_mps(
    train: int,
    motion: tuple[float, float],
    ends: tuple[FloatArray, FloatArray, FloatArray],
    asked_mps: float,
    able: Able,
) -> float:
    """Return the speed after a step that protection and operation allow."""
    (front_m, speed_mps), (eoa_m, delay_s, permitted_mps) = motion, ends
    free = free_mps(train, front_m, speed_mps, (eoa_m[train], delay_s[train]), able)
    return float(min(free, permitted_mps[train], asked_mps))
