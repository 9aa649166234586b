"""The choice of an acceleration: one look ahead over the costs to come."""

import numpy as np

from kankaku.controllers.forecast import Booked, Called, departures_s
from kankaku.controllers.stochastic.approach_site import PlatformWay
from kankaku.controllers.stochastic.belief import LEVELS
from kankaku.controllers.stochastic.run_in import Costs, drag_at_mps2
from kankaku.controllers.stochastic.site_tables import NO_SITE, Stack, approach_of
from kankaku.controllers.stochastic.waiting import (
    ACTIONS,
    CERTAIN,
    LEVEL_COUNT,
    LOOK_S,
    PULL,
    SLACKS,
    between,
    look_ahead,
    rate_mps2,
)
from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import Plain, compiled, formula
from kankaku.railway.step.state import Whereabouts

LEAVING_M = 30.0
"""So far on the places of a site a train speeds up in any case: it leaves a platform there. [m]"""
LEVEL_SCALES = np.array(LEVELS)


@compiled
def choose(
    now_s: float,
    whereabouts: Plain,
    known: tuple[Plain, tuple[Plain, Plain]],
    approaching: tuple[IntArray, FloatArray, bool],
    tables: tuple[Plain, Plain],
    chosen_mps2: FloatArray,
) -> None:
    """
    Choose the acceleration of every train that approaches a platform.

    Parameters
    ----------
    now_s
        The time. [s]
    whereabouts
        See :class:`~kankaku.railway.step.state.Whereabouts`.
    known
        Of :class:`~kankaku.controllers.forecast.Called`, and what forecasts need.
    approaching
        Number of each train's site, factor on its leader's delays, shape (n_trains,), and whether
        what is forecast is certain.
    tables
        Of :class:`~kankaku.controllers.stochastic.site_tables.Stack`, and of the costs.
    chosen_mps2
        Written to; infinite for trains that need not hold back. [m/s2], shape (n_trains,)
    """
    trains, called = Whereabouts(*whereabouts), Called(*known[0])
    booked = Booked(*known[1][1])
    stack, costs = Stack(*tables[0]), Costs(*tables[1])
    sites, scales, certain = approaching
    chosen_mps2[:] = np.inf
    ready_s, earliest_s = departures_s(now_s, whereabouts, known[0], known[1])
    for train in trains.rows:
        if sites[train] == NO_SITE or not trains.running[train]:
            continue
        approach = approach_of(stack, sites[train])
        to_limit_m = approach.limit_m - trains.front_m[train]
        from_m = trains.front_m[train] - approach.from_m
        if to_limit_m < 0.0 or from_m < LEAVING_M:
            continue
        leader = called.leader[train]
        booked_s = booked.departure_s[leader, called.next_call[leader]]
        stands = trains.present[leader] and not trains.running[leader]
        overstays_s = now_s - max(ready_s[leader], booked_s) if stands else -1.0
        site, motion = (approach, sites[train], stack), (to_limit_m, trains.speed_mps[train])
        if overstays_s > 0.0 and not certain:
            action = _during(site, motion, (now_s - ready_s[leader], scales[train]), costs)
        else:
            slack_s = max(booked_s - ready_s[leader], 0.0)
            wait = earliest_s[leader] - now_s, slack_s, scales[train], certain
            action = _before(site, motion, wait, costs)
        if action < PULL:
            place = from_m / approach.place_m
            drag = drag_at_mps2(approach, place)
            chosen_mps2[train] = rate_mps2(approach, action, motion[1], drag)


@formula
def _level(scale: float) -> tuple[int, float]:
    """Return the lower of two levels, and the weight of the upper one."""
    low = 0
    while low < LEVEL_COUNT - 2 and scale > LEVEL_SCALES[low + 1]:
        low += 1
    ratio = np.log(scale / LEVEL_SCALES[low]) / np.log(LEVEL_SCALES[low + 1] / LEVEL_SCALES[low])
    return low, min(max(ratio, 0.0), 1.0)


@formula
def _during(
    site: tuple[PlatformWay, int, Stack],
    motion: tuple[float, float],
    stay: tuple[float, float],
    costs: Costs,
) -> int:
    """Return the action of least cost while the leader overstays."""
    stayed_s, scale = stay
    _, number, stack = site
    low, weight = _level(scale)
    tables = stack.during[number]
    now = min(int(stayed_s / LOOK_S), tables.shape[1] - 1)
    hazards = stack.hazards[number, low, now], stack.hazards[number, low + 1, now]
    return _cheapest(site, motion, costs, (tables, stayed_s / LOOK_S + 1.0), (low, weight), hazards)


@formula
def _before(
    site: tuple[PlatformWay, int, Stack],
    motion: tuple[float, float],
    wait: tuple[float, float, float, bool],
    costs: Costs,
) -> int:
    """Return the action of least cost before the leader's earliest departure."""
    to_departure_s, slack_s, scale, certain = wait
    _, number, stack = site
    plan = _plan(stack, number, slack_s, scale, certain)
    to_come = stack.before[number], max(to_departure_s / LOOK_S - 1.0, 0.0)
    return _cheapest(site, motion, costs, to_come, plan, (0.0, 0.0))


@formula
def _cheapest(
    site: tuple[PlatformWay, int, Stack],
    motion: tuple[float, float],
    costs: Costs,
    to_come: tuple[FloatArray, float],
    mixed: tuple[int, float],
    hazards: tuple[float, float],
) -> int:
    """
    Return the action of least cost, by costs to come after a look ahead.

    These are mixed from two tables that follow each other: the lower one, and the weight of the
    upper one. A hazard of each says how likely the leader is released within the look ahead.
    """
    (approach, number, stack), (tables, time), (low, weight) = site, to_come, mixed
    then = min(time, tables.shape[1] - 1.001)
    first, part = int(then), then - int(then)
    after, weights = stack.before[number, CERTAIN, 0], (1.0 - weight, weight)
    least, chosen = np.inf, PULL
    for action in range(ACTIONS - 1, -1, -1):
        place, share, cost, _ = look_ahead(approach, stack.top_mps[number], motion, action, costs)
        gone = between(after, place, share)
        for upper in range(2):
            table = tables[low + upper]
            later = (1.0 - part) * between(table[first], place, share)
            later += part * between(table[first + 1], place, share)
            cost += weights[upper] * (hazards[upper] * gone + (1.0 - hazards[upper]) * later)
        if cost < least:
            least, chosen = cost, action
    return chosen


@formula
def _plan(
    stack: Stack, number: int, slack_s: float, scale: float, certain: bool
) -> tuple[int, float]:
    """
    Return the lower of two plans, and the weight of the upper one.

    The longer a leader is ready before its booked departure, the less is it likely to leave later:
    what counts is by how much in the mean.
    """
    if certain:
        return CERTAIN, 0.0
    excess_s = stack.excess_s[number]
    low, part = _level(scale)
    second = min(int(slack_s), SLACKS - 1)
    wanted_s = (1.0 - part) * excess_s[low, second] + part * excess_s[low + 1, second]
    below_s, plan = 0.0, CERTAIN
    while plan < LEVEL_COUNT - 1 and wanted_s > excess_s[plan, 0]:
        below_s = excess_s[plan, 0]
        plan += 1
    width_s = excess_s[plan, 0] - below_s
    weight = 1.0 if width_s <= 0.0 else (wanted_s - below_s) / width_s
    return plan, min(max(weight, 0.0), 1.0)
