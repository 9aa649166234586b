"""One compiled pass over trains and steps: each rule is worked out, and what breaks it is told."""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.compiled import compiled, formula
from kankaku.railway.safety.brakes import (
    TrainData,
    data_of,
    rising_m,
    strongest_mps2,
)
from kankaku.railway.safety.ground import Lie, lie_of, lowest_limit_mps, mean_height_m, slope, under
from kankaku.railway.safety.heights import Heights
from kankaku.railway.safety.numbers import greater, lesser, places_before
from kankaku.railway.safety.pull import Pull, level_acceleration_mps2
from kankaku.railway.safety.rules import (
    ACCELERATION,
    ACCELERATION_TOLERANCE_MPS2,
    AUTHORITY,
    BAND,
    BRAKING,
    GRANT,
    HANDLING_MPS2,
    IDLE,
    KINDS,
    LIMIT,
    MARGIN,
    PLATFORM,
    RELEASE,
    ROUNDING_S,
    SPACING,
    STOP,
    VALIDITY,
    TrainStep,
    acceleration_mps2,
    authority_m,
    band_m,
    beyond_m,
    braking_mps2,
    idle_m,
    in_need,
    limit_mps,
    reached_m,
    spacing_m,
    stop_m,
    validity_mps2,
)
from kankaku.railway.safety.survey import Survey
from kankaku.railway.safety.terms import Terms
from kankaku.railway.safety.train_steps import TrainSteps

NEAR_M = 1.0
"""Gradients are tabulated this closely. [m]"""
PLACES = 1000
"""So many breaches of a block are written down at first."""


class Clear(NamedTuple):
    """How far the way ahead of trains is clear; no places at all where nothing is in the way."""

    next_rear_m: FloatArray
    """The next rear ahead. [m], shape (n_columns, n_steps + 1)"""
    buffered_m: FloatArray
    """The same, with its buffer. [m], same shape"""
    granted_m: FloatArray
    """What is not granted. [m], shape (n_columns, n_steps)"""
    unreleased_m: FloatArray
    """What is not released. [m], same shape"""
    platform_m: FloatArray
    """Platform sections with another train in them. [m], same shape"""


class Breaches(NamedTuple):
    """What breaks rules, written in the order of trains and then steps."""

    written: IntArray
    """How many; they may be more than there are places. shape (1,)"""
    at: IntArray
    """Rule, column and step. shape (n_places, 3)"""
    excess: FloatArray
    """In the unit of the rule. shape (n_places,)"""
    closest: FloatArray
    """The greatest finite one of each rule, broken or not. shape (n_rules,)"""


class Looked(NamedTuple):
    """Places that are looked at in a step; arrays of shape (n_places,)."""

    front_m: FloatArray
    """Of the train, if it were there. [m]"""
    near: IntArray
    """Knots of heights near the train, the last time. shape (n_places, 2)"""
    slope: FloatArray
    """Mean gradient under it. [-]"""
    height_m: FloatArray
    """Mean height under it. [m]"""


BEFORE, MIDDLE, BEHIND, BEYOND, AFTER, EOA, REAR, AHEAD, IDLED, NEXT_EOA = range(10)
"""Places: gradients are looked up at those up to AFTER, heights at those from there on."""


def breaches(
    survey: Survey, terms: Terms, steps: TrainSteps, clear: Clear, closest: FloatArray
) -> list[tuple[str, int, int, float]]:
    """
    Return what breaks the rules for single trains.

    Parameters
    ----------
    survey
        Trains and line.
    terms
        Figures that the rules are kept by.
    steps
        The steps.
    clear
        How far the way is clear.
    closest
        Raised to the greatest finite excess of each rule. shape (n_rules,)

    Returns
    -------
    list[tuple[str, int, int, float]]
        Kind of the rule, step, column and excess; those of a train and kind in order of time.
    """
    places = PLACES
    while True:
        at, excess = np.empty((places, 3), dtype=np.intp), np.empty(places)
        found = Breaches(np.zeros(1, dtype=np.intp), at, excess, closest)
        _examine(survey, terms, steps, clear, found)
        count = int(found.written[0])
        if count <= places:
            break
        places = count
    return [
        (KINDS[rule], step, column, over)
        for (rule, column, step), over in zip(
            at[:count].tolist(), excess[:count].tolist(), strict=True
        )
    ]


@compiled
def _examine(
    survey: Survey, terms: Terms, steps: TrainSteps, clear: Clear, found: Breaches
) -> None:
    """Look at each train in each step."""
    excess, places = np.empty(terms.tolerances.size), np.empty(NEXT_EOA + 1)
    near = np.empty((places.size, 2), dtype=np.intp)
    looked = Looked(places, near, np.empty(places.size), np.empty(places.size))
    for column in range(steps.rows.size):
        row = steps.rows[column]
        train = data_of(survey.fleet, row)
        lie = lie_of(survey.ground, row, survey.fleet.length_m[row])
        for place in range(places.size):
            places[place], near[place, 0], near[place, 1] = np.nan, lie.knots[0], lie.knots[0]
        for step in range(steps.present.shape[1]):
            if not steps.present[column, step]:
                continue
            now = _train_step(steps, terms.step_s, column, step)
            for rule in range(excess.size):
                excess[rule] = -np.inf
            if terms.promised:
                _permission(terms, now, _drift_m(terms, now), (clear, column, step), excess)
            if steps.moving[column, step]:
                next_rear_m = clear.next_rear_m[column, step + 1]
                _look(survey.ground.heights, lie, (terms, now, next_rear_m), looked)
                _spacing(terms, train, now, next_rear_m, looked, excess)
                stop = steps.next_call[column, step + 1]
                excess[STOP] = stop_m(now, survey.stop_m[row, stop])
                maximum_mps = train.maximum_mps
                lowest_mps = lowest_limit_mps(survey.ground.limits, lie, now.after_m, maximum_mps)
                excess[LIMIT] = limit_mps(now, lowest_mps)
                _effort(survey.pull, train, now, looked, excess)
                # Who brakes harder than in emergency is named once.
                if terms.promised and not excess[ACCELERATION] > ACCELERATION_TOLERANCE_MPS2:
                    _handling(survey.pull, terms, (train, row), now, looked, excess)
                    hard = excess[BRAKING] > HANDLING_MPS2
                    if hard and _needs(survey.ground.heights, lie, train, now, looked):
                        excess[BRAKING] = -np.inf
            _judge(terms.tolerances, excess, column, step, found)


@formula
def _train_step(steps: TrainSteps, step_s: float, column: int, step: int) -> TrainStep:
    return TrainStep(
        step_s,
        steps.time_s[step],
        steps.front_m[column, step],
        steps.front_m[column, step + 1],
        steps.speed_mps[column, step],
        steps.speed_mps[column, step + 1],
        steps.eoa_m[column, step],
        steps.eoa_m[column, step + 1],
        steps.delay_s[column, step],
        steps.heard_s[column, step],
        steps.surprised[column, step],
        steps.surprised[column, step + 1],
        steps.halting[column, step],
        steps.emergency[column, step],
    )


@formula
def _judge(
    tolerances: FloatArray, excess: FloatArray, column: int, step: int, found: Breaches
) -> None:
    """Write down which rules are broken; not-a-number breaks them all."""
    for rule in range(excess.size):
        over = excess[rule]
        if found.closest[rule] < over < np.inf:
            found.closest[rule] = over
        if over <= tolerances[rule]:
            continue
        place = found.written[0]
        found.written[0] = place + 1
        if place < found.excess.size:
            found.at[place, 0], found.at[place, 1], found.at[place, 2] = rule, column, step
            found.excess[place] = over


@formula
def _drift_m(terms: Terms, now: TrainStep) -> float:
    """Return how far the place that a train measures may have drifted since a balise. [m]"""
    if terms.error_ratio <= 0.0:
        return 0.0
    # Only a balise that the train has passed corrects its position.
    passed_m = lesser(now.eoa_m, now.before_m)
    last = places_before(terms.balises_m, passed_m)
    if last == terms.balises_m.size or (terms.balises_m[last] > passed_m and last > 0):
        last -= 1
    return terms.error_ratio * greater(now.eoa_m - terms.balises_m[last], 0.0)


@formula
def _permission(
    terms: Terms,
    now: TrainStep,
    drift_m: float,
    ahead: tuple[Clear, int, int],
    excess: FloatArray,
) -> None:
    """Look at what a train is permitted, which is judged of one that is held by a stop, too."""
    clear, column, step = ahead
    reach_m = reached_m(now, drift_m, terms.resolution_m, terms.margin_m)
    behind_m, granted_m = clear.buffered_m[column, step], np.inf
    if behind_m >= terms.far_m:
        behind_m = np.inf
    if clear.granted_m.size:
        granted_m = clear.granted_m[column, step]
    excess[MARGIN] = beyond_m(reach_m, behind_m)
    excess[GRANT] = beyond_m(reach_m, granted_m)
    if clear.unreleased_m.size:
        excess[RELEASE] = beyond_m(reach_m, clear.unreleased_m[column, step])
    if clear.platform_m.size:
        excess[PLATFORM] = beyond_m(reach_m, clear.platform_m[column, step])


@formula
def _look(
    heights: Heights, lie: Lie, about: tuple[Terms, TrainStep, float], looked: Looked
) -> None:
    """Look at the line under the train where it is, was, or may come to be."""
    terms, now, next_rear_m = about
    front_m, first, last = looked.front_m, BEFORE, REAR
    if front_m[AFTER] == now.before_m:
        # This place was looked at a step ago.
        looked.slope[BEFORE], first = looked.slope[AFTER], MIDDLE
    front_m[BEFORE] = now.before_m
    front_m[MIDDLE] = 0.5 * (now.before_m + now.after_m)
    front_m[BEHIND] = now.before_m - NEAR_M
    front_m[BEYOND] = now.after_m + NEAR_M
    front_m[AFTER] = now.after_m
    front_m[EOA] = now.eoa_m
    front_m[REAR] = next_rear_m
    front_m[AHEAD] = now.after_m + now.after_mps * now.delay_s
    if front_m[AHEAD] != now.after_m:
        last = AHEAD
    if terms.idle_time_s > 0.0:
        last = NEXT_EOA
        front_m[IDLED] = now.after_m + terms.idle_time_s * now.after_mps
        front_m[NEXT_EOA] = now.next_eoa_m
    for place in range(first, last + 1):
        near = looked.near[place, 0], looked.near[place, 1]
        at = under(heights, lie, front_m[place], near)
        looked.near[place, 0], looked.near[place, 1] = at.knots
        if place <= AFTER:
            looked.slope[place] = slope(heights, lie, at)
        if place >= AFTER:
            looked.height_m[place] = mean_height_m(heights, lie, at)
    if last < AHEAD:
        looked.height_m[AHEAD] = looked.height_m[AFTER]


@formula
def _needs(heights: Heights, lie: Lie, train: TrainData, now: TrainStep, looked: Looked) -> bool:
    """Tell whether a train needs more than its service brake."""
    front_m = now.before_m + now.before_mps * now.delay_s
    near = looked.near[BEFORE, 0], looked.near[BEFORE, 1]
    here_m = mean_height_m(heights, lie, under(heights, lie, front_m, near))
    return in_need(train, now, looked.height_m[EOA] - here_m)


@formula
def _spacing(
    terms: Terms,
    train: TrainData,
    now: TrainStep,
    next_rear_m: float,
    looked: Looked,
    excess: FloatArray,
) -> None:
    """Look at the way ahead of a train."""
    height_m, slope_here = looked.height_m, looked.slope[AFTER]
    gained_mps2 = (now.after_mps - now.before_mps) / now.step_s
    builds_m = rising_m(train, slope_here, now.after_mps, gained_mps2)
    unlike_m = 0.0
    if terms.delay_s > 0.0:
        # Brakes gain or lose because the gradient counts where a front is now.
        rise_m = height_m[AHEAD] - height_m[AFTER]
        unlike_m = abs(rise_m - slope_here * (looked.front_m[AHEAD] - now.after_m))
        unlike_m = unlike_m * train.brake_gravity_mps2 / train.service_mps2
    lift_m = height_m[EOA] - height_m[AHEAD]
    excess[AUTHORITY] = authority_m(train, now, lift_m, builds_m, unlike_m)
    if not terms.by_brakes:
        excess[BAND] = band_m(now, next_rear_m)
    lift_m = height_m[REAR] - height_m[AFTER]
    excess[SPACING] = spacing_m(train, now, next_rear_m, lift_m, builds_m)


@formula
def _effort(
    pull: Pull, train: TrainData, now: TrainStep, looked: Looked, excess: FloatArray
) -> None:
    """Look at what traction and brakes can have done."""
    before, during, after = looked.slope[BEFORE], looked.slope[MIDDLE], looked.slope[AFTER]
    least = lesser(before, lesser(during, after))
    most = greater(before, greater(during, after))
    slower_mps = lesser(now.before_mps, now.after_mps)
    faster_mps = greater(now.before_mps, now.after_mps)
    pull_mps2 = level_acceleration_mps2(pull, train.kind, slower_mps)
    hardest_mps2 = strongest_mps2(pull, train, train.emergency_mps2, most, faster_mps)
    excess[ACCELERATION] = acceleration_mps2(train, now, pull_mps2, hardest_mps2, least)


@formula
def _handling(
    pull: Pull,
    terms: Terms,
    of: tuple[TrainData, int],
    now: TrainStep,
    looked: Looked,
    excess: FloatArray,
) -> None:
    """Look at whether a train brakes as was promised; gradients are known within a metre."""
    (train, row), height_m = of, looked.height_m
    least = lesser(looked.slope[BEHIND], looked.slope[BEYOND])
    most = greater(looked.slope[BEHIND], looked.slope[BEYOND])
    faster_mps = greater(now.before_mps, now.after_mps)
    service_mps2 = strongest_mps2(pull, train, train.service_mps2, most, faster_mps)
    excess[BRAKING] = braking_mps2(now, service_mps2)
    if terms.validity_s < np.inf:
        since_s = now.time_s - terms.validity_s - ROUNDING_S - now.heard_s
        excess[VALIDITY] = validity_mps2(train, now, since_s, least)
    if terms.idle_time_s > 0.0:
        entered = places_before(terms.boundaries_m, now.before_m)
        passed = places_before(terms.boundaries_m, now.after_m)
        if passed > entered and terms.enters[row, entered]:
            lift_m = height_m[NEXT_EOA] - height_m[IDLED]
            excess[IDLE] = idle_m(train, now, lift_m, terms.idle_time_s)
