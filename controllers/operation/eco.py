"""
Energy-saving driving (Kawashima): what the timetable leaves as slack is spent on coasting.

When a train is released from a stop, the run of least energy that arrives at the booked time
is planned to its next one: the target speed of every section, where coasting begins, and where
the electric brake. A train that is hindered follows its plan late; once its way is free again it
plans anew for what is left of the time. Without slack it runs as fast as it may.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kankaku.controllers.operation.close_up import NO_CEILING_MPS, no_advice
from kankaku.controllers.options import require
from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, formula, interpolated, plain
from kankaku.railway.motion.eco_run import EcoRun, eco
from kankaku.railway.motion.extremal import BRAKING, SPEEDING_UP
from kankaku.railway.motion.kinematics import next_speed_mps
from kankaku.railway.motion.run_curve import RunTimeError, StallError
from kankaku.railway.motion.way import way_on
from kankaku.railway.plan.brake_table import BrakeTable, braking_loss_mps, braking_v2_at
from kankaku.railway.plan.world import World
from kankaku.railway.step.bundles import LayerSteps
from kankaku.railway.step.control import Foresight
from kankaku.railway.step.state import NO_REASON, Advice, Authority, LineState, Whereabouts

ECO = 0
CATCHING_UP_PS = 0.5
"""A train is so much faster than its plan, for each second that it is late. [m/s per s]"""
LEAST_WAY_M = 50.0
"""Nearer than this to the stop nothing is planned. [m]"""


@dataclass(frozen=True, slots=True)
class EcoOptions:
    """Options of energy-saving driving."""

    least_slack_s: float = 1.0
    """Less time to spare than this is left as it is. [s]"""
    patience_s: float = 2.0
    """A train that is so far behind its plan, and free again, plans anew. [s]"""

    def __post_init__(self) -> None:
        require("least_slack_s", self.least_slack_s, 0.0, 600.0)
        require("patience_s", self.patience_s, 0.5, 600.0)


class EcoPlans(NamedTuple):
    """What every train is about to do; arrays of shape (n_trains,) but the last two."""

    since_s: FloatArray
    """When the plan begins; infinite without one. [s]"""
    from_m: FloatArray
    """Where it begins. [m]"""
    lengths: IntArray
    """Points of each table."""
    starts: IntArray
    """Where each table begins among the points."""
    tables: tuple[FloatArray | None, ...]
    """Ceiling [m/s] and time [s] by metres from there. shape (2, n_metres) each"""
    points: FloatArray
    """All tables, one after the other. shape (2, n_points)"""


class Tabled(NamedTuple):
    """What steps need of :class:`EcoPlans`."""

    since_s: FloatArray
    from_m: FloatArray
    lengths: IntArray
    starts: IntArray
    points: FloatArray


class Able(NamedTuple):
    """What trains can do and are to do; it stays for a whole run."""

    braking: BrakeTable
    near_m: float
    """Where the tables begin. [m]"""
    far_m: float
    """Where they end. [m]"""
    step_s: float
    patience_s: float


class Eco:
    """Energy-saving driving over any protection."""

    reasons = ("eco",)

    def __init__(self, world: World, options: EcoOptions, foresight: Foresight) -> None:
        self._world = world
        self._options = options
        self._profile = foresight.profile
        self._able = plain(
            Able(
                world.braking,
                self._profile.origin_m,
                world.far_m,
                world.step_s,
                options.patience_s,
            )
        )
        self._nothing = no_advice(world.size)

    def initial(self) -> EcoPlans:
        """Return the memory before the first step: no train has a plan."""
        size = self._world.size
        return EcoPlans(
            since_s=np.full(size, np.inf),
            from_m=np.zeros(size),
            lengths=np.zeros(size, dtype=np.intp),
            starts=np.zeros(size, dtype=np.intp),
            tables=(None,) * size,
            points=np.zeros((2, 0)),
        )

    def advise(
        self, state: LineState, authority: Authority, memory: EcoPlans
    ) -> tuple[Advice, EcoPlans]:
        """Return the advice for every train."""
        if state.events:
            memory = self._with_events(state, memory)
        told, behind = self._follow(state, authority, memory)
        if behind.any():
            rows = np.flatnonzero(behind).tolist()
            memory = _with_tables(memory, {row: self._plan(state, row) for row in rows}, state)
            told, _ = self._follow(state, authority, memory)
        return Advice(*told), memory

    def _with_events(self, state: LineState, memory: EcoPlans) -> EcoPlans:
        """Plan for those who are released, and forget the plans of those who have arrived."""
        changed: dict[int, FloatArray | None] = {}
        for row in (*state.events.arrived, *state.events.left):
            changed[row] = None
        for row in state.events.released:
            changed[row] = self._plan(state, row)
        return _with_tables(memory, changed, state) if changed else memory

    def _plan(self, state: LineState, row: int) -> FloatArray | None:
        """Return the table of the run of least energy from here; None without slack."""
        world, call = self._world, int(state.next_call[row])
        if call >= world.call_count[row]:
            return None
        front_m, stop_m = float(state.front_m[row]), float(state.stop_m[row])
        left_s = self._aimed_s(state, row, call) - state.time_s
        if stop_m - front_m < LEAST_WAY_M or left_s <= 0.0:
            return None
        kind = int(world.type_index[row])
        way = way_on(
            self._profile,
            kind,
            world.driven_types[kind],
            (front_m, stop_m),
            (float(state.speed_mps[row]), 0.0),
        )
        try:
            run = eco(way, left_s, least_slack_s=self._options.least_slack_s)
        except (RunTimeError, StallError):
            return None
        return _table(run, world.step_s)

    def _aimed_s(self, state: LineState, row: int, call: int) -> float:
        """Return when a train is to arrive: as supervision says, else as booked."""
        ordered_s = np.nan if state.orders is None else float(state.orders.arrive_by_s[row])
        return float(self._world.booked_arrival_s[row, call]) if np.isnan(ordered_s) else ordered_s

    def _follow(
        self, state: LineState, authority: Authority, memory: EcoPlans
    ) -> tuple[tuple[FloatArray, IntArray, IntArray], BoolArray]:
        ends, found = (authority.eoa_m, authority.delay_s), self._untold()
        _follow(state.time_s, state.whereabouts, ends, self._fields(memory), found)
        return found

    def _fields(self, memory: EcoPlans) -> Plain:
        plans = memory.since_s, memory.from_m, memory.lengths, memory.starts, memory.points
        return plans, self._able

    def _untold(self) -> tuple[tuple[FloatArray, IntArray, IntArray], BoolArray]:
        """Return the advice before any was told, and who is behind its plan: nobody."""
        size, (ceiling_mps, reason, cause) = self._world.size, self._nothing
        return (ceiling_mps.copy(), reason.copy(), cause), np.zeros(size, dtype=np.bool_)

    def steps(self, state: LineState, memory: EcoPlans) -> LayerSteps:
        """Return the compiled step."""
        del state
        told, behind = self._untold()
        return LayerSteps(_advise, (self._fields(memory), behind), (), told, np.inf)

    def resumed(self, memory: EcoPlans, after: Plain) -> EcoPlans:
        """Return the memory after a bundle of steps."""
        del after
        return memory


def _table(run: EcoRun, step_s: float) -> FloatArray:
    """
    Tabulate a run by metres: the ceiling, and when the front is there.

    Where the train speeds up or brakes with all it has, the ceiling is the target of that
    phase, or none: the drive does the same of its own accord.
    """
    curve = run.curve
    ceiling = np.interp(curve.time_s + step_s, curve.time_s, curve.speed_mps)
    speeds_up = run.phase == SPEEDING_UP
    # Uphill a train may lose speed with all that it has.
    for cell in np.flatnonzero(speeds_up)[::-1].tolist():
        ends = cell + 1 == speeds_up.size or not speeds_up[cell + 1]
        ahead_mps = curve.speed_mps[cell + 1] if ends else ceiling[cell + 1]
        ceiling[cell] = max(curve.speed_mps[cell], ahead_mps)
    ceiling[:-1][run.phase == BRAKING] = NO_CEILING_MPS
    ceiling[-1] = NO_CEILING_MPS
    metres = np.arange(np.floor(curve.chainage_m[-1] - curve.chainage_m[0]) + 1.0)
    along_m = curve.chainage_m - curve.chainage_m[0]
    return np.array([np.interp(metres, along_m, row) for row in (ceiling, curve.time_s)])


def _with_tables(
    memory: EcoPlans, changed: dict[int, FloatArray | None], state: LineState
) -> EcoPlans:
    """Lay all tables one after the other, as the steps want them."""
    tables = tuple(changed.get(row, table) for row, table in enumerate(memory.tables))
    kept = [table for table in tables if table is not None]
    lengths = np.array([0 if table is None else table.shape[1] for table in tables], dtype=np.intp)
    since_s, from_m = memory.since_s.copy(), memory.from_m.copy()
    for row, table in changed.items():
        since_s[row] = np.inf if table is None else state.time_s
        from_m[row] = state.front_m[row]
    return EcoPlans(
        since_s,
        from_m,
        lengths,
        np.cumsum(lengths) - lengths,
        tables,
        np.hstack(kept) if kept else np.zeros((2, 0)),
    )


@formula
def _follow(
    now_s: float,
    whereabouts: Plain,
    ends: tuple[FloatArray, FloatArray],
    fields: Plain,
    found: tuple[tuple[FloatArray, IntArray, IntArray], BoolArray],
) -> bool:
    """Write the advice, and who is behind its plan although its authority lets it follow."""
    plan_fields, able_fields = fields
    trains, plans = Whereabouts(*whereabouts), Tabled(*plan_fields)
    brake_fields, near_m, far_m, step_s, patience_s = able_fields
    able = Able(BrakeTable(*brake_fields), near_m, far_m, step_s, patience_s)
    eoa_m, delay_s = ends
    (eoa_m, delay_s), ((ceiling_mps, reason, _), behind) = ends, found
    asks = False
    for train in trains.rows:
        ceiling_mps[train], reason[train], behind[train] = NO_CEILING_MPS, NO_REASON, False
        front_m, speed_mps = trains.front_m[train], trains.speed_mps[train]
        along_m = front_m - plans.from_m[train]
        if along_m >= plans.lengths[train] - 1:
            continue
        place = along_m + plans.starts[train]
        late_s = now_s - plans.since_s[train] - interpolated(plans.points[1], place)
        ceiling_mps[train] = interpolated(plans.points[0], place)
        ceiling_mps[train] += CATCHING_UP_PS * min(max(late_s, 0.0), patience_s)
        reason[train] = ECO
        if late_s > patience_s:
            ends_m = eoa_m[train], delay_s[train]
            free_mps = _free_mps(train, front_m, speed_mps, ends_m, able)
            behind[train] = free_mps > min(ceiling_mps[train], speed_mps + 1.0)
            asks = asks or behind[train]
    return asks


@formula
def _advise(
    instant: Plain,
    authority: Plain,
    fields: Plain,
    _memory: Plain,
    _after: Plain,
    told: Plain,
) -> bool:
    (now_s, whereabouts, _, _), (followed, behind) = instant, fields
    return _follow(now_s, whereabouts, (authority[0], authority[2]), followed, (told, behind))


@formula
def _free_mps(
    train: int, front_m: float, speed_mps: float, end: tuple[float, float], able: Able
) -> float:
    """Return the speed after a step that the end of authority allows."""
    eoa_m, delay_s = end
    end_m = min(max(eoa_m, able.near_m), able.far_m)
    room = braking_v2_at(able.braking, train, end_m) - braking_v2_at(able.braking, train, front_m)
    loss = braking_loss_mps(able.braking, train, front_m, speed_mps, able.step_s)
    lag = braking_loss_mps(able.braking, train, front_m, speed_mps, delay_s)
    return float(next_speed_mps(speed_mps, room, loss, lag))
