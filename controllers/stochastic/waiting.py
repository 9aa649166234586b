r"""
Waiting for the release: stochastic dynamic programming backwards in time.

A state is the distance :math:`d` to the limit and the speed :math:`v`, told as a share of the
speed that is permitted there. The costs to come are, after the release,

.. math:: T(d, v) = \min_{cap} \text{interval} + w \cdot \text{slow time} + e \cdot \text{energy},

while the leader overstays for :math:`u` already, with the hazard :math:`h(u)` of its delay,

.. math:: V(d, v, u) = \min_a \bigl[ c(a) + h T(d', v') + (1 - h) V(d', v', u + \Delta) \bigr],

and before its earliest departure the same without a hazard (Bellman 1957; for an uncertain end
of a wait see Bertsekas 2017, section 3.4).
"""

import math
from typing import NamedTuple

import numpy as np

from kankaku.controllers.stochastic.approach_site import PlatformSite, PlatformWay
from kankaku.controllers.stochastic.belief import LEVELS, Belief
from kankaku.controllers.stochastic.run_in import (
    Costs,
    best_cap,
    by_speed,
    drag_at_mps2,
    energy_kwh,
    permitted_v2_at,
    site_of,
)
from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import Plain, compiled, formula, plain
from kankaku.railway.meters.standstill import CRAWLING_MPS

LOOK_S = 2.0
"""So long an acceleration is held. [s]"""
DISTANCES = 56
SHARES = 24
BRAKE_SHARES = (1.0, 0.6, 0.25)
"""Accelerations of the first actions: shares of the brake for stops. [-]"""
PULL_SHARES = (0.4, 1.0)
"""Accelerations of the last actions: shares of what traction gives. [-]"""
COAST = len(BRAKE_SHARES)
"""The action without brake and traction; the one of a constant speed comes next."""
HOLD = COAST + 1
ACTIONS = HOLD + 1 + len(PULL_SHARES)
PULL = ACTIONS - 1
"""The action of full traction."""
BEFORE_S = 128.0
"""So long before the earliest departure plans begin. [s]"""
LONGEST_DELAY_S = 260.0
"""Nobody plans for longer delays; a plan for this one is kept. [s]"""
SETTLED = 60
"""Looks ahead after which a plan for a delay without end changes no more."""
LEVEL_COUNT = len(LEVELS)
SLACKS = 300
"""Seconds between readiness and booked departure that are told apart."""
CERTAIN = 0
"""The first of the plans before the earliest departure: it will be kept."""


class Tables(NamedTuple):
    """Costs to come at a site; speeds are shares of what is permitted there."""

    top_mps: FloatArray
    """Permitted speed by distance. [m/s], shape (DISTANCES,)"""
    during: FloatArray
    """By level, time since readiness, distance and share. [s], (n_levels, n_times, ...)"""
    hazards: FloatArray
    """Of the leader's release within a look ahead. [-], (n_levels, n_times)"""
    before: FloatArray
    """By certainty and level, time to the earliest departure, distance and share. [s]"""
    excess_s: FloatArray
    """By level and seconds of slack: how much longer than that the leader stays in the mean. [s]"""


class Outcomes(NamedTuple):
    """Where an acceleration leads from every node, (DISTANCES, SHARES, ACTIONS)."""

    place: FloatArray
    """Distance cell. [-]"""
    share: FloatArray
    """Share cell. [-]"""
    cost_s: FloatArray


def make_tables(
    site: PlatformSite, belief: Belief, scale: float, costs: Costs, sizes: tuple[FloatArray, int]
) -> Tables:
    """
    Make the tables of a site.

    Parameters
    ----------
    site
        The site.
    belief
        What is expected of the leader's delay.
    scale
        Factor on that. [-]
    costs
        What things cost.
    sizes
        Speed caps for running in [m/s], falling, and from how many times of an overstay to plan.

    Returns
    -------
    Tables
        In single precision.
    """
    (caps_mps, times), fields = sizes, plain(site)
    top_mps = _tops_mps(fields)
    after = _after(fields, top_mps, caps_mps, plain(costs))
    outcomes = plain(Outcomes(*_outcomes(plain(site.approach), top_mps, plain(costs))))
    hazards = np.array([belief.hazards(scale * level, LOOK_S, times) for level in LEVELS])
    during = _during(outcomes, after, hazards)
    none = np.array([belief.none(scale * level) for level in LEVELS])[:, None, None]
    uncertain = none * after + (1.0 - none) * during[:, 0]
    before = _before(outcomes, np.concatenate([after[None], uncertain]), int(BEFORE_S / LOOK_S))
    excess_s = np.array([belief.excess_s(scale * level)[:SLACKS] for level in LEVELS])
    return Tables(top_mps, during.astype(np.float32), hazards, before.astype(np.float32), excess_s)


def times_of(belief: Belief, greatest_scale: float) -> int:
    """
    Return from how many times of an overstay to plan.

    Parameters
    ----------
    belief
        What is expected.
    greatest_scale
        The greatest factor on that. [-]

    Returns
    -------
    int
        Up to the longest delay that is expected.
    """
    expected = belief.expected
    longest_s = LEVELS[-1] * greatest_scale * expected.scale * max(expected.delays_s)
    longest_s = min(longest_s, expected.cap_s, LONGEST_DELAY_S)
    return int(np.ceil(longest_s / LOOK_S)) + 2


@formula
def distance_cell(approach: PlatformWay, distance_m: float) -> float:
    """
    Return the cell of a distance to the limit: the nearer, the finer.

    Parameters
    ----------
    approach
        The way.
    distance_m
        To the limit. [m]

    Returns
    -------
    float
        From 0 to the last but a little.
    """
    share = min(max(distance_m / (approach.limit_m - approach.from_m), 0.0), 1.0)
    return min(math.sqrt(share) * (DISTANCES - 1), DISTANCES - 1.001)


@formula
def between(table: FloatArray, place: float, share: float) -> float:
    """
    Interpolate between distances and shares.

    Parameters
    ----------
    table
        Costs. shape (DISTANCES, SHARES)
    place, share
        Cells.

    Returns
    -------
    float
        The cost there. [s]
    """
    row, column = int(place), int(share)
    down, right = place - row, share - column
    near = table[row, column] + right * (table[row, column + 1] - table[row, column])
    far = table[row + 1, column] + right * (table[row + 1, column + 1] - table[row + 1, column])
    return float(near + down * (far - near))


@formula
def top_at_mps(top_mps: FloatArray, place: float) -> float:
    """
    Return the permitted speed at a distance.

    Parameters
    ----------
    top_mps
        By distance. [m/s], shape (DISTANCES,)
    place
        Cell.

    Returns
    -------
    float
        The speed. [m/s]
    """
    cell = int(place)
    return float(top_mps[cell] + (place - cell) * (top_mps[cell + 1] - top_mps[cell]))


@formula
def rate_mps2(approach: PlatformWay, action: int, speed_mps: float, drag_mps2: float) -> float:
    """
    Return the acceleration that an action stands for.

    Parameters
    ----------
    approach
        The way.
    action
        Its number: brakes first, then coasting, holding the speed, and traction.
    speed_mps
        Speed. [m/s]
    drag_mps2
        What gradient and curves take. [m/s2]

    Returns
    -------
    float
        The acceleration. [m/s2]
    """
    if action < COAST:
        return -BRAKE_SHARES[action] * approach.station_brake_mps2
    if action == COAST:
        return by_speed(approach.coast_mps2, speed_mps) - drag_mps2
    if action == HOLD:
        return 0.0
    pull = by_speed(approach.pull_mps2, speed_mps) - drag_mps2
    return PULL_SHARES[action - HOLD - 1] * pull


@formula
def look_ahead(
    approach: PlatformWay,
    top_mps: FloatArray,
    motion: tuple[float, float],
    action: int,
    costs: Costs,
) -> tuple[float, float, float, float]:
    """
    Return where an action leads in a look ahead, and what that costs.

    Parameters
    ----------
    approach
        The way.
    top_mps
        Permitted speeds by distance. [m/s]
    motion
        Distance to the limit [m] and speed [m/s].
    action
        The action.
    costs
        What things cost.

    Returns
    -------
    tuple[float, float, float, float]
        Distance cell, share cell, cost [s], and the speed at the end [m/s].
    """
    distance_m, speed = motion
    place = (approach.limit_m - distance_m - approach.from_m) / approach.place_m
    drag = drag_at_mps2(approach, place)
    after = max(speed + rate_mps2(approach, action, speed, drag) * LOOK_S, 0.0)
    left_m = distance_m - 0.5 * (speed + after) * LOOK_S
    top = top_at_mps(top_mps, distance_cell(approach, left_m))
    if after > top:
        # Who gets to the curve of the permitted speed is braked along it.
        after = max(top, speed - approach.brake_mps2 * LOOK_S, 0.0)
        left_m = distance_m - 0.5 * (speed + after) * LOOK_S
        top = top_at_mps(top_mps, distance_cell(approach, left_m))
    cost = costs.kwh_s * energy_kwh(approach, (speed, after), drag, LOOK_S)
    if 0.5 * (speed + after) < CRAWLING_MPS:
        cost += costs.standing * LOOK_S
    share = min(after / max(top, 1e-3), 1.0) * (SHARES - 1)
    return distance_cell(approach, left_m), min(share, SHARES - 1.001), cost, after


@formula
def distance_m_at(approach: PlatformWay, row: int) -> float:
    """
    Return the distance to the limit of a cell.

    Parameters
    ----------
    approach
        The way.
    row
        The cell.

    Returns
    -------
    float
        The distance. [m]
    """
    return float((approach.limit_m - approach.from_m) * (row / (DISTANCES - 1)) ** 2)


@compiled
def _tops_mps(site_fields: Plain) -> FloatArray:
    site, top_mps = site_of(site_fields), np.zeros(DISTANCES)
    for row in range(DISTANCES):
        to_limit_m = distance_m_at(site.approach, row)
        place = (site.approach.limit_m - to_limit_m - site.approach.from_m) / site.approach.place_m
        top_mps[row] = np.sqrt(max(permitted_v2_at(site, 0, place), 0.0))
    return top_mps


@compiled
def _after(
    site_fields: Plain, top_mps: FloatArray, caps_mps: FloatArray, costs_fields: Plain
) -> FloatArray:
    site, costs, after = site_of(site_fields), Costs(*costs_fields), np.zeros((DISTANCES, SHARES))
    for row in range(DISTANCES):
        front_m = site.approach.limit_m - distance_m_at(site.approach, row)
        for column in range(SHARES):
            speed = top_mps[row] * column / (SHARES - 1)
            after[row, column] = best_cap(site, (front_m, speed), caps_mps, costs)[0]
    return after


@compiled
def _outcomes(
    approach_fields: Plain, top_mps: FloatArray, costs_fields: Plain
) -> tuple[FloatArray, FloatArray, FloatArray]:
    approach, costs = PlatformWay(*approach_fields), Costs(*costs_fields)
    place = np.zeros((DISTANCES, SHARES, ACTIONS))
    share, cost_s = np.zeros_like(place), np.zeros_like(place)
    for row in range(DISTANCES):
        to_limit_m = distance_m_at(approach, row)
        for column in range(SHARES):
            motion = to_limit_m, top_mps[row] * column / (SHARES - 1)
            for action in range(ACTIONS):
                to = look_ahead(approach, top_mps, motion, action, costs)
                place[row, column, action], share[row, column, action] = to[0], to[1]
                cost_s[row, column, action] = to[2]
    return place, share, cost_s


@compiled
def _step_back(outcomes: Outcomes, to_come: FloatArray) -> FloatArray:
    """Return the least costs a look ahead earlier, by those to come then."""
    now = np.empty_like(to_come)
    for row in range(DISTANCES):
        for column in range(SHARES):
            least = np.inf
            for action in range(ACTIONS):
                place, share = (
                    outcomes.place[row, column, action],
                    outcomes.share[row, column, action],
                )
                cost = outcomes.cost_s[row, column, action] + between(to_come, place, share)
                least = min(least, cost)
            now[row, column] = least
    return now


@compiled
def _during(outcome_fields: Plain, after: FloatArray, hazards: FloatArray) -> FloatArray:
    """Costs by level and time; the last time stands for all later ones."""
    outcomes, (levels, times) = Outcomes(*outcome_fields), hazards.shape
    costs = np.zeros((levels, times, DISTANCES, SHARES))
    for level in range(levels):
        later, last = after, hazards[level, times - 1]
        for _ in range(SETTLED):
            later = _step_back(outcomes, last * after + (1.0 - last) * later)
        for time in range(times - 1, -1, -1):
            hazard = hazards[level, time]
            later = _step_back(outcomes, hazard * after + (1.0 - hazard) * later)
            costs[level, time] = later
    return costs


@compiled
def _before(outcome_fields: Plain, ends: FloatArray, times: int) -> FloatArray:
    """Costs by what comes at the earliest departure, and time to it."""
    outcomes = Outcomes(*outcome_fields)
    costs = np.zeros((ends.shape[0], times + 1, DISTANCES, SHARES))
    for end in range(ends.shape[0]):
        later = ends[end]
        costs[end, 0] = later
        for time in range(1, times + 1):
            later = _step_back(outcomes, later)
            costs[end, time] = later
    return costs
