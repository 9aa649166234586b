"""
Stochastic approach: run up to a platform whose leader may leave it at any moment.

Nobody knows when a leader that overstays departs; how likely that is is known. So a follower
chooses its acceleration, once a second, by the least cost to come: delay, standing and crawling
between stations, and energy. At the release it chooses the speed that it holds into the platform.
"""

from typing import NamedTuple

import numpy as np

from kankaku.controllers.forecast import (
    Booked,
    Called,
    DepartureForecast,
    waits_for_leader,
)
from kankaku.controllers.operation.close_up import NO_CEILING_MPS
from kankaku.controllers.stochastic.approach_options import StochasticApproachOptions
from kankaku.controllers.stochastic.approach_site import MeetingCalls, PlatformSite, approach_site
from kankaku.controllers.stochastic.belief import LEVELS, WORTH_CALLS, Belief
from kankaku.controllers.stochastic.choice import choose
from kankaku.controllers.stochastic.merging import NOWHERE_M, points_left_m, starting, stays
from kankaku.controllers.stochastic.run_in import Costs, run_in_cap_mps
from kankaku.controllers.stochastic.site_tables import NO_SITE, SiteTables, tables_of
from kankaku.controllers.stochastic.waiting import Tables, times_of
from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, formula, plain
from kankaku.railway.motion.kinematics import two_stage_speed_mps
from kankaku.railway.plan.world import World
from kankaku.railway.step.bundles import Lasting, LayerSteps
from kankaku.railway.step.control import Foresight
from kankaku.railway.step.state import (
    NO_REASON,
    NO_VERSION,
    Advice,
    Authority,
    LineState,
    Whereabouts,
)

APPROACH, RUN_IN, QUEUE, MERGE = 0, 1, 2, 3
DECIDE_S = 1.0
"""So often accelerations are chosen. [s]"""
CAPS_MPS = np.append(NO_CEILING_MPS, np.arange(26.0, 3.0, -2.0))
"""Speeds to be held into a platform; plans are made with every second one. [m/s]"""
ROUNDING_S = 1e-6


class ReleasePlans(NamedTuple):
    """What is remembered from step to step; arrays of shape (n_trains,)."""

    calls_version: int
    called: Plain
    """Of :class:`~kankaku.controllers.forecast.Called`, as of that version."""
    approaches: tuple[MeetingCalls | None, ...]
    """The platform that each train approaches, and behind whom."""
    cap_mps: FloatArray
    """Speed held after the leader's release, until the stop. [m/s]"""
    scale: FloatArray
    """Factor on the delays that the tables of its site are made for. [-]"""
    planned_mps: FloatArray
    """Speed when it was decided last [m/s] ..."""
    rate_mps2: FloatArray
    """... and the acceleration that was chosen; infinite for no plan. [m/s2]"""
    points_left_m: FloatArray
    """From :func:`~kankaku.controllers.stochastic.merging.points_left_m`. [m]"""
    stays: BoolArray
    """Who stays at its platform until another one has gone first."""
    decided_s: float
    score: FloatArray
    """Normal score of the last delay of each trip; 0 before the first. [-]"""
    seen_s: float
    """Sum of all delays that have been seen. [s]"""
    awaited_s: float
    """Sum of what was expected of them. [s]"""


class StochasticApproach:
    """Stochastic approach over any protection."""

    reasons = ("approach", "run_in", "queue", "merge")

    def __init__(
        self, world: World, options: StochasticApproachOptions, foresight: Foresight
    ) -> None:
        self._world, self._foresight, self._learns = world, foresight, options.learns
        self._belief = Belief(options.told(world.expected_delays))
        self._costs = plain(Costs(options.standing_cost, options.energy_cost_s_per_kwh))
        forecast = DepartureForecast(world)
        self._rates = forecast.acceleration_mps2, forecast.brake_mps2, world.step_s
        self._certain = world.foretold_delay_s is not None
        booked = Booked(*forecast.booked)
        if world.foretold_delay_s is not None:
            dwell_s = world.minimum_dwell_s.copy()
            dwell_s[:, :-1] += world.foretold_delay_s
            booked = booked._replace(minimum_dwell_s=dwell_s)
        self._known = forecast.tables, plain(booked)
        self._factor = _delay_factors(world)
        self._times = times_of(self._belief, float(self._factor.max()))
        self._tables = SiteTables()
        self._starting, self._rows = plain(starting(world)), np.arange(world.size)
        nowhere: tuple[MeetingCalls | None, ...] = ()
        # Of the approaches that steps asked for last: the memory knows nothing of the stack.
        self._numbered = nowhere, np.zeros(0, dtype=np.intp)

    def initial(self) -> ReleasePlans:
        """Return the memory before the first step: no train approaches anything."""
        size = self._world.size
        return ReleasePlans(
            calls_version=NO_VERSION,
            called=(),
            approaches=(None,) * size,
            cap_mps=np.full(size, NO_CEILING_MPS),
            scale=np.ones(size),
            planned_mps=np.zeros(size),
            rate_mps2=np.full(size, np.inf),
            points_left_m=np.full(size, NOWHERE_M),
            stays=np.zeros(size, dtype=np.bool_),
            decided_s=-np.inf,
            score=np.zeros(size),
            seen_s=0.0,
            awaited_s=0.0,
        )

    def advise(
        self, state: LineState, authority: Authority, memory: ReleasePlans
    ) -> tuple[Advice, ReleasePlans]:
        """Return the advice for every train."""
        changed = state.calls_version != memory.calls_version or bool(state.events)
        if changed:
            memory = self._with_events(state, memory)
        if changed or state.time_s >= memory.decided_s + DECIDE_S - ROUNDING_S:
            memory = self._decide(state, authority, memory)
        told, followed = _untold(state), (memory.cap_mps, memory.stays, self._rates)
        _follow(state.instant, tuple(authority[:5]), followed, _followed(memory), told)
        return Advice(*told), memory

    def steps(self, state: LineState, memory: ReleasePlans) -> LayerSteps:
        """Return the compiled step, in which accelerations are chosen, too, as far as it can."""
        told, followed = _untold(state), (memory.cap_mps, memory.stays, self._rates)
        before = _followed(memory)
        sites, stack = self._site_numbers(memory.approaches), self._tables.stack
        if not stack or np.isfinite(memory.points_left_m).any() or memory.stays.any():
            until_s = memory.decided_s + DECIDE_S - ROUNDING_S
            return LayerSteps(_follow_on, followed, before, told, until_s)
        known = memory.called, self._known
        chosen = known, (sites, memory.scale, self._certain), (stack, self._costs)
        return LayerSteps(_choose_and_follow, (followed, chosen), before, told, np.inf)

    def resumed(self, memory: ReleasePlans, after: Plain) -> ReleasePlans:
        """Return the memory after a bundle of steps."""
        planned_mps, rate_mps2, decided_s = after
        return memory._replace(
            planned_mps=planned_mps, rate_mps2=rate_mps2, decided_s=float(decided_s[0])
        )

    def _decide(self, state: LineState, authority: Authority, memory: ReleasePlans) -> ReleasePlans:
        sites = self._site_numbers(memory.approaches)
        rate_mps2 = np.full(self._world.size, np.inf)
        if self._tables.stack:
            choose(
                state.time_s,
                state.whereabouts,
                (memory.called, self._known),
                (sites, memory.scale, self._certain),
                (self._tables.stack, self._costs),
                rate_mps2,
            )
        stay = memory.stays
        if np.isfinite(memory.points_left_m).any() or stay.any():
            last = np.maximum(state.next_call - 1, 0)
            from_m = self._world.stop_m[self._rows, last]
            ends_m = from_m, authority.eoa_m, memory.points_left_m
            known = memory.called, self._known
            stay = stays(state.whereabouts, known, ends_m, self._starting)
        return memory._replace(
            planned_mps=state.speed_mps, rate_mps2=rate_mps2, stays=stay, decided_s=state.time_s
        )

    def _with_events(self, state: LineState, memory: ReleasePlans) -> ReleasePlans:
        """Learn from releases, run in after them, and find who approaches what."""
        waits = waits_for_leader(self._world, state)
        called = plain(Called(state.leader, waits, state.next_call, state.stop_m, state.arrival_s))
        if self._learns and not self._certain:
            memory = self._learn(state, memory)
        cap_mps = self._caps_mps(state, memory)
        scale, factor = memory.scale.copy(), self._run_factor(memory)
        approaches: list[MeetingCalls | None] = [None] * self._world.size
        for row in np.flatnonzero(waits & state.running).tolist():
            leader = int(state.leader[row])
            calls = int(state.next_call[row]), leader, int(state.next_call[leader])
            approaches[row] = MeetingCalls(*calls)
            after = self._belief.after_score(float(memory.score[leader]))
            scale[row] = min(max(factor * after, LEVELS[0]), LEVELS[-1])
        return memory._replace(
            calls_version=state.calls_version,
            called=called,
            approaches=tuple(approaches),
            scale=scale,
            cap_mps=cap_mps,
            points_left_m=points_left_m(self._world, state),
        )

    def _caps_mps(self, state: LineState, memory: ReleasePlans) -> FloatArray:
        """Choose how fast to run in behind the trains that were released now."""
        gone = {*state.events.released, *state.events.left}
        cap_mps = np.where(state.running, memory.cap_mps, NO_CEILING_MPS)
        for row, approached in enumerate(memory.approaches) if gone else ():
            if approached is None or approached.leader not in gone or not state.running[row]:
                continue
            number = self._site_number(row, approached)
            front_m, speed_mps = float(state.front_m[row]), float(state.speed_mps[row])
            if number != NO_SITE and front_m >= self._tables.sites[number].approach.from_m:
                site, motion = plain(self._tables.sites[number]), (front_m, speed_mps)
                cap_mps[row] = run_in_cap_mps(site, motion, CAPS_MPS, self._costs)
        return cap_mps

    def _learn(self, state: LineState, memory: ReleasePlans) -> ReleasePlans:
        """Take note of the delays of trains that are released."""
        world, score = self._world, memory.score
        seen_s, awaited_s = memory.seen_s, memory.awaited_s
        for row in state.events.released:
            call = int(state.next_call[row]) - 1
            ready_s = float(state.arrival_s[row] + world.minimum_dwell_s[row, call])
            booked_s = float(world.booked_departure_s[row, call])
            factor = float(self._factor[row, call])
            # Who is ready before its booked departure hides how long it would have overstayed.
            if booked_s > ready_s:
                score = _with(score, row, 0.0)
                continue
            delay_s = round(max(state.time_s - ready_s, 0.0))
            score = _with(score, row, self._belief.score(delay_s, factor))
            seen_s, awaited_s = seen_s + delay_s, awaited_s + factor * self._belief.mean_s
        return memory._replace(score=score, seen_s=seen_s, awaited_s=awaited_s)

    def _run_factor(self, memory: ReleasePlans) -> float:
        """Return by what factor this run's delays are longer than expected, as far as seen."""
        known_s = WORTH_CALLS * self._belief.mean_s
        if known_s <= 0.0:
            return 1.0
        return (known_s + memory.seen_s) / (known_s + memory.awaited_s)

    def _site_numbers(self, approaches: tuple[MeetingCalls | None, ...]) -> IntArray:
        if approaches is not self._numbered[0]:
            numbers = [
                NO_SITE if calls is None else self._site_number(row, calls)
                for row, calls in enumerate(approaches)
            ]
            self._numbered = approaches, np.array(numbers, dtype=np.intp)
        return self._numbered[1]

    def _site_number(self, row: int, calls: MeetingCalls) -> int:
        world, (call, leader, leaders_call) = self._world, calls
        kinds = int(world.type_index[row]), int(world.type_index[leader])
        before_m = float(world.stop_m[row, call - 1]) if call > 0 else -np.inf
        places_m = before_m, float(world.stop_m[row, call])
        factor = float(self._factor[leader, leaders_call])
        next_m = float(world.stop_m[leader, leaders_call + 1])
        key = (*kinds, int(world.call_track[row, call]), *places_m, next_m, factor)
        return self._tables.number(key, lambda: self._made(row, calls, factor))

    def _made(
        self, row: int, calls: MeetingCalls, factor: float
    ) -> tuple[PlatformSite, Tables] | None:
        site = approach_site(self._world, self._foresight, row, calls)
        if site is None:
            return None
        sizes = CAPS_MPS[::2].copy(), self._times
        return site, tables_of(site, self._belief, factor, Costs(*self._costs), sizes)


def _delay_factors(world: World) -> FloatArray:
    """Return the factor on the delays of every call. shape (n_trains, n_calls_max)"""
    factors = np.ones_like(world.minimum_dwell_s)
    for row, service in enumerate(world.timetable.services):
        factors[row, : len(service.calls)] = [call.delay_scale for call in service.calls]
    return factors


def _with(values: FloatArray, row: int, value: float) -> FloatArray:
    changed = values.copy()
    changed[row] = value
    return changed


def _untold(state: LineState) -> Plain:
    """Return the advice before any was told."""
    size = state.leader.size
    reason = np.full(size, NO_REASON, dtype=np.intp)
    return np.full(size, NO_CEILING_MPS), reason, state.leader.copy()


def _followed(memory: ReleasePlans) -> Plain:
    """Return what changes while accelerations are followed."""
    return memory.planned_mps, memory.rate_mps2, np.array([memory.decided_s])


@formula
def _ceilings(
    whereabouts: Plain,
    ends: tuple[FloatArray, IntArray],
    ahead: tuple[FloatArray, IntArray, BoolArray, BoolArray],
    plans: tuple[FloatArray, FloatArray, FloatArray, BoolArray],
    rates: tuple[float, float, float, float],
    told: tuple[FloatArray, IntArray, IntArray],
) -> None:
    """Write ceilings, why, and for what."""
    trains, (eoa_m, eoa_by) = Whereabouts(*whereabouts), ends
    stop_m, leader, follows, running = ahead
    cap_mps, planned_mps, rate_mps2, stay = plans
    acceleration_mps2, brake_mps2, step_s, since_s = rates
    ceiling_mps, reason, cause = told
    for train in trains.rows:
        ceiling_mps[train], reason[train] = NO_CEILING_MPS, NO_REASON
        cause[train] = leader[train]
        if not running[train]:
            continue
        if stay[train]:
            ceiling_mps[train], reason[train] = 0.0, MERGE
            continue
        if cap_mps[train] < NO_CEILING_MPS:
            ceiling_mps[train], reason[train] = cap_mps[train], RUN_IN
            continue
        if rate_mps2[train] < np.inf:
            planned = planned_mps[train] + rate_mps2[train] * (since_s + step_s)
            ceiling_mps[train], reason[train] = max(planned, 0.0), APPROACH
        # A leader that stands or crawls between stations will not be gone all at once.
        if eoa_m[train] >= stop_m[train] or not follows[train] or not running[leader[train]]:
            continue
        speed = trains.speed_mps[train]
        gap_m = eoa_m[train] - trains.front_m[train] - speed * step_s
        leader_mps = trains.speed_mps[leader[train]]
        held = two_stage_speed_mps(gap_m, leader_mps, acceleration_mps2, brake_mps2)
        if held <= ceiling_mps[train]:
            ceiling_mps[train], reason[train], cause[train] = held, QUEUE, eoa_by[train]


@formula
def _follow(instant: Plain, authority: Plain, fields: Plain, memory: Plain, told: Plain) -> None:
    """Write the advice by the accelerations that were chosen last."""
    now_s, whereabouts, _, lasting = instant
    eoa_m, eoa_by, known = authority[0], authority[3], Lasting(*lasting)
    (cap_mps, stay, rates), (planned_mps, rate_mps2, decided_s) = fields, memory
    running = Whereabouts(*whereabouts).running
    ahead = known.stop_m, known.leader, known.follows, running
    plans, since = (cap_mps, planned_mps, rate_mps2, stay), now_s - decided_s[0]
    figures = rates[0], rates[1], rates[2], since
    _ceilings(whereabouts, (eoa_m, eoa_by), ahead, plans, figures, told)


@formula
def _remember(memory: Plain, after: Plain) -> None:
    for train in range(memory[0].size):
        after[0][train], after[1][train] = memory[0][train], memory[1][train]
    after[2][0] = memory[2][0]


@formula
def _follow_on(
    instant: Plain, authority: Plain, fields: Plain, memory: Plain, after: Plain, told: Plain
) -> bool:
    _remember(memory, after)
    _follow(instant, authority, fields, after, told)
    return False


@formula
def _choose_and_follow(
    instant: Plain, authority: Plain, fields: Plain, memory: Plain, after: Plain, told: Plain
) -> bool:
    now_s, whereabouts, _, _ = instant
    followed, (known, approaching, tables) = fields
    _remember(memory, after)
    if now_s >= memory[2][0] + DECIDE_S - ROUNDING_S:
        choose(now_s, whereabouts, known, approaching, tables, after[1])
        # The speeds themselves go on changing.
        speed_mps = Whereabouts(*whereabouts).speed_mps
        for train in range(speed_mps.size):
            after[0][train] = speed_mps[train]
        after[2][0] = now_s
    _follow(instant, authority, followed, after, told)
    return False
