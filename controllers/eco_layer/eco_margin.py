"""
The energy layer: around any operation, runs of least energy where time is cheap.

The fastest run brakes harder than the electric brake can take, so its last hundredths of a second
cost the most energy of all. Each leg is planned for the fastest run time and a margin. Where the
timetable leaves recovery time the layer may also spend that: then the booked arrival is the aim.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from kankaku.controllers.eco_layer.leg_runs import Leg, LegRun, LegRuns
from kankaku.controllers.layers import ControllerError
from kankaku.controllers.operation.close_up import NO_CEILING_MPS
from kankaku.controllers.operation.eco import CATCHING_UP_PS
from kankaku.controllers.options import OptionError, require
from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import Plain, formula, formula_with, interpolated
from kankaku.railway.plan.scenario import (
    GREATEST_ECO_MARGIN_S,
    LEAST_ECO_MARGIN_S,
    ControllerSpec,
)
from kankaku.railway.plan.world import World
from kankaku.railway.step.bundles import LayerSteps, offered
from kankaku.railway.step.control import Foresight, Operation
from kankaku.railway.step.state import NOTHING, Advice, Authority, LineState, Whereabouts

WORD = "eco_margin"
SUMMARY = "least energy for the fastest run time and a margin, or for the booked arrival"
PATIENCE_S = 2.0
"""Who is further behind the run in time to spare has the margin only. [s]"""
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
        require("eco_margin_s", self.eco_margin_s, LEAST_ECO_MARGIN_S, GREATEST_ECO_MARGIN_S)


def energy_of(spec: ControllerSpec, where: str) -> EcoMarginOptions | None:
    """
    Return the options of a controller's energy layer.

    Parameters
    ----------
    spec
        The controller.
    where
        Its key, for complaints.

    Returns
    -------
    EcoMarginOptions | None
        None without such a layer.

    Raises
    ------
    ControllerError
        If a value is not allowed.
    """
    reserve, margin = f"{where}.eco_reserve", f"{where}.eco_margin_s"
    if spec.eco_margin_s is None:
        if spec.eco_reserve:
            raise ControllerError(reserve, "stands without eco_margin_s", "both, or neither")
        return None
    try:
        return EcoMarginOptions(spec.eco_margin_s, spec.eco_reserve)
    except OptionError as error:
        raise ControllerError(margin, error.problem, error.allowed) from error


class MarginPlans(NamedTuple):
    """What every train is about to do; arrays of shape (n_trains,) but where told."""

    inner: Any
    """What the operation remembers."""
    since_s: FloatArray
    """When its runs begin. [s]"""
    from_m: FloatArray
    """Where they begin. [m]"""
    runs: tuple[tuple[LegRun | None, LegRun | None], ...]
    """Both runs by train."""
    starts: IntArray
    """Where these begin among the points. shape (2, n_trains)"""
    lengths: IntArray
    """Points of each. shape (2, n_trains)"""
    points: FloatArray
    """All different tables, one after the other. shape (2, n_points)"""


class FollowedLegs(NamedTuple):
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
        self.reasons = tuple(dict.fromkeys((*operation.reasons, WORD)))
        self._word = self.reasons.index(WORD)

    def initial(self) -> MarginPlans:
        """Return the memory before the first step: no train has a plan."""
        size = self._world.size
        return MarginPlans(
            inner=self._operation.initial(),
            since_s=np.full(size, np.inf),
            from_m=np.zeros(size),
            runs=((None, None),) * size,
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
        told = advice.ceiling_mps.copy(), advice.reason.copy(), advice.cause.copy()
        _lower(state.time_s, state.whereabouts, self._plans(memory), self._word, told)
        return Advice(*told), memory

    def _plans(self, memory: MarginPlans) -> Plain:
        return memory.since_s, memory.from_m, memory.starts, memory.lengths, memory.points

    @property
    def steps(self) -> Callable[[LineState, MarginPlans], LayerSteps]:
        """
        What returns the compiled step.

        Raises
        ------
        AttributeError
            If the operation below offers none.
        """
        if not offered(self._operation, "steps", "advise"):
            msg = f"{type(self._operation).__name__} offers no compiled step"
            raise AttributeError(msg)
        return self._steps

    def _steps(self, state: LineState, memory: MarginPlans) -> LayerSteps:
        operation: Any = self._operation
        inner: LayerSteps = operation.steps(state, memory.inner)
        fields = inner.fields, inner.told, self._plans(memory), self._word
        told = tuple(part.copy() for part in inner.told)
        return LayerSteps(_lowering(inner.function), fields, inner.memory, told, inner.until_s)

    def resumed(self, memory: MarginPlans, after: Plain) -> MarginPlans:
        """Return the memory after a bundle of steps."""
        operation: Any = self._operation
        return memory._replace(inner=operation.resumed(memory.inner, after))

    def _with_events(self, state: LineState, memory: MarginPlans) -> MarginPlans:
        """Plan for those who depart, and forget the plans of those who have arrived."""
        events, world = state.events, self._world
        if not (events.arrived or events.departed or events.left):
            return memory
        runs = list(memory.runs)
        since_s, from_m = memory.since_s.copy(), memory.from_m.copy()
        for row in (*events.arrived, *events.left):
            runs[row] = None, None
        for row in events.departed:
            call = int(state.next_call[row])
            if row in events.left or not 0 < call < world.call_count[row]:
                continue
            # Who moves now began to a step ago.
            began_s = state.time_s - world.step_s
            since_s[row], from_m[row] = began_s + self._rise_s[row], world.stop_m[row, call - 1]
            late_s = began_s - world.reaction_s - world.booked_departure_s[row, call - 1]
            hurries = bool(late_s > self._usual_driving.late_after_s)
            runs[row] = self._planned(row, call, float(since_s[row]), hurries)
        return _laid(memory._replace(since_s=since_s, from_m=from_m), runs)

    def _planned(
        self, row: int, call: int, since_s: float, hurries: bool
    ) -> tuple[LegRun | None, LegRun | None]:
        if not self._reserve:
            return self._runs.quickest(row, call, hurries or not self._usual_driving.hurries), None
        left_s = self._due_s(row, call, since_s, hurries) - since_s
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


def _laid(memory: MarginPlans, runs: list[tuple[LegRun | None, LegRun | None]]) -> MarginPlans:
    """Lay the tables of all different runs one after the other, as the steps want them."""
    starts = np.zeros((2, len(runs)), dtype=np.intp)
    lengths = np.zeros_like(starts)
    found: dict[tuple[Leg, bool, int], int] = {}
    kept: list[FloatArray] = []
    size = 0
    for row, pair in enumerate(runs):
        for which, run in enumerate(pair):
            if run is None:
                continue
            if run[:-1] not in found:
                found[run[:-1]] = size
                kept.append(run.table)
                size += run.table.shape[1]
            starts[which, row], lengths[which, row] = found[run[:-1]], run.table.shape[1]
    points = np.hstack(kept) if kept else np.zeros((2, 0))
    return memory._replace(runs=tuple(runs), starts=starts, lengths=lengths, points=points)


@formula
def _lower(
    now_s: float,
    whereabouts: Plain,
    plan_fields: Plain,
    word: int,
    told: tuple[FloatArray, IntArray, IntArray],
) -> None:
    """Lower ceilings, and write why and for what."""
    trains, plans = Whereabouts(*whereabouts), FollowedLegs(*plan_fields)
    ceiling_mps, reason, cause = told
    for train in trains.rows:
        along_m = trains.front_m[train] - plans.from_m[train]
        if along_m < 0.0 or not trains.running[train]:
            continue
        lowest_mps = NO_CEILING_MPS
        if along_m < plans.lengths[QUICKEST, train] - 1:
            lowest_mps = interpolated(plans.points[0], along_m + plans.starts[QUICKEST, train])
        if along_m < plans.lengths[SPARED, train] - 1:
            place = along_m + plans.starts[SPARED, train]
            late_s = now_s - plans.since_s[train] - interpolated(plans.points[1], place)
            if late_s <= PATIENCE_S:
                spared_mps = interpolated(plans.points[0], place)
                lowest_mps = min(lowest_mps, spared_mps + CATCHING_UP_PS * max(late_s, 0.0))
        if lowest_mps < ceiling_mps[train]:
            ceiling_mps[train], reason[train], cause[train] = lowest_mps, word, NOTHING


@cache
def _lowering(advise: Callable[..., Any]) -> Callable[..., Any]:
    """Return the compiled step of this layer over that of an operation."""

    def lowered(
        instant: Plain, authority: Plain, fields: Plain, memory: Plain, after: Plain, told: Plain
    ) -> bool:
        inner, asked, plans, word = fields
        asks: bool = advise(instant, authority, inner, memory, after, asked)
        now_s, whereabouts, _, _ = instant
        for train in whereabouts[5]:
            told[0][train], told[1][train] = asked[0][train], asked[1][train]
            told[2][train] = asked[2][train]
        _lower(now_s, whereabouts, plans, word, told)
        return asks

    return formula_with(lowered, advise)
