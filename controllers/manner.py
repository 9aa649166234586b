"""
How trains are driven, and how soon they answer: what the drive knows beside brakes and traction.

A train answers gradually: its jerk limit and the build-up of its brake bound by how much the
acceleration may change from step to step. Whoever has to keep a brake curve acts so much earlier.
"""

import math
from typing import NamedTuple

import numpy as np

from kankaku.controllers.ceiling import (
    CeilingFigures,
    ceiling_ahead_mps,
    ceiling_figures,
    figures_of,
)
from kankaku.railway.arrays import BoolArray, FloatArray
from kankaku.railway.compiled import Plain, formula, naming
from kankaku.railway.plan.limit_table import LimitTable
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Bound

ROUNDING_S = 1e-6
FASTER_MPS = 0.1
"""Drivers take no notice of less. [m/s]"""
LEAST_FADE = 0.1
"""Of what a gain may fade by; where the line bends more sharply, the train is too fast. [-]"""
CEILING, ADVICE = int(Bound.CEILING), int(Bound.ADVICE)


class Manner(NamedTuple):
    """How trains are driven, and how soon they answer; arrays of shape (n_trains,)."""

    ceiling: CeilingFigures
    """The line as it is driven on by trains that are late, and the traction in use."""
    unhurried: LimitTable
    """The limits of the line as it is driven on by trains that are not."""
    late_after_s: float
    """Who departs so much later than booked is late. [s]"""
    keeps_ceiling: bool
    """Whether that may be lower than the ceilings of the protection, or braked for earlier."""
    gentler_mps2: FloatArray
    """By how much the brake for stops is weaker than the service brake. [m/s2]"""
    band_mps: float
    """How much slower a train gets by coasting; 0 if it does not coast. [m/s]"""
    reaction_s: float
    """From when a train may depart until it moves. [s]"""
    jerk_mps: FloatArray
    """By how much the speed gained in a step may change from step to step. [m/s]"""
    rise_mps: FloatArray
    """The same of the speed lost with a rising service brake. [m/s]"""
    hard_mps: FloatArray
    """The same with a rising emergency brake. [m/s]"""
    safety_factor: FloatArray
    overspeed_mps: FloatArray


class Drivers(NamedTuple):
    """What drivers remember; arrays of shape (n_trains,)."""

    before_mps: FloatArray
    """Speed a step ago. [m/s]"""
    downhill_mps: FloatArray
    """What the descent alone gave it in that step. [m/s]"""
    coasts_from_mps: FloatArray
    """The speed that was to be held when a train began to coast; 0 for who does not. [m/s]"""
    hurries: BoolArray
    """Who departed late."""
    may_s: FloatArray
    """Since when a train at its stop may depart; infinite for all others. [s]"""


def manner_of(world: World) -> Manner:
    """
    Return how the trains of a world are driven.

    Parameters
    ----------
    world
        The trains.

    Returns
    -------
    Manner
        It stays for a whole run.
    """
    step_s, style = world.step_s, world.driving
    service_mps2, emergency_mps2, jerk_mps3, build_up_s = map(
        world.of_type,
        ("service_brake_mps2", "emergency_brake_mps2", "jerk_mps3", "brake_build_up_s"),
    )
    with np.errstate(divide="ignore"):
        rise_mps3 = np.minimum(jerk_mps3, service_mps2 / build_up_s)
        hard_mps3 = emergency_mps2 / build_up_s
    return Manner(
        ceiling_figures(world, world.driven_profile, step_s, world.driven_types),
        world.unhurried_profile.limit_table,
        style.late_after_s,
        bool(style.lowers or np.isfinite(rise_mps3).any()),
        world.gentler_mps2,
        style.coasting_band_mps,
        world.reaction_s,
        jerk_mps3 * step_s**2,
        rise_mps3 * step_s**2,
        hard_mps3 * step_s**2,
        world.of_type("safety_factor"),
        world.of_type("overspeed_mps"),
    )


@naming
def manner_from(fields: Plain) -> Manner:
    """
    Return the manner with its names.

    Parameters
    ----------
    fields
        Of :class:`Manner`, plain.

    Returns
    -------
    Manner
        The same.
    """
    ceiling, unhurried, late, keeps, gentler, band, reaction, jerk, rise, hard, factor, over = (
        fields
    )
    answers = late, keeps, gentler, band, reaction, jerk, rise, hard, factor, over
    return Manner(figures_of(ceiling), LimitTable(*unhurried), *answers)


@formula
def rising_least_mps(
    manner: Manner, train: int, speed_mps: float, gained_mps: float, unbraked_mps: float
) -> tuple[float, float]:
    """
    Return the least speeds after a step of a rising service and emergency brake.

    For the service brake traction is gone by the jerk limit at the latest, for the emergency brake
    at once; the brakes rise from nothing.

    Parameters
    ----------
    manner
        How trains are driven.
    train
        Row of the train.
    speed_mps
        Its speed. [m/s]
    gained_mps
        What it gained in the last step. [m/s]
    unbraked_mps
        What the gradient gives it in a step. [m/s]

    Returns
    -------
    tuple[float, float]
        With the service and the emergency brake. [m/s]
    """
    free = min(gained_mps, unbraked_mps)
    gained = max(gained_mps - manner.jerk_mps[train], free - manner.rise_mps[train])
    return speed_mps + gained, speed_mps + free - manner.hard_mps[train]


@formula
def eased_mps(
    bounds_mps: FloatArray,
    train: int,
    speeds_mps: tuple[float, float, float, float, float],
    manner: Manner,
) -> float:
    """
    Return the speed after a step that a driver makes of all bounds but those of safety.

    Parameters
    ----------
    bounds_mps
        The bounds of the train. [m/s], shape (n_bounds,)
    train
        Its row.
    speeds_mps
        Its speed, what it gains with traction or brake as in the last step, the least speed
        after this one by its service brake, what the descent alone gives it in one, and by how
        much that grows from step to step where the line gets steeper. [m/s]
    manner
        How trains are driven.

    Returns
    -------
    float
        The speed. [m/s]
    """
    speed, gained, least, downhill, steeper = speeds_mps
    wish, rise = np.inf, manner.rise_mps[train]
    for bound in range(bounds_mps.size):
        wish = min(wish, bounds_mps[bound])
    if rise < np.inf:
        wish = min(wish, speed + gained + manner.jerk_mps[train])
        left = min(bounds_mps[CEILING], bounds_mps[ADVICE]) - speed
        # What the descent gives more and more of does not fade.
        fades = max(manner.jerk_mps[train] - steeper, LEAST_FADE * manner.jerk_mps[train])
        braked = max(rise - steeper, LEAST_FADE * rise)
        wish = min(wish, speed + fading_mps(left, fades, braked, downhill))
    return float(max(wish, least))


@formula
def fading_mps(left_mps: float, jerk_mps: float, rise_mps: float, downhill_mps: float) -> float:
    r"""
    Return the greatest speed to gain in a step that is gone before a train is too fast.

    From a gain :math:`g` on the next ones are less by the jerk limit, but on a descent none is
    further below what the descent alone gives than the brake has risen by then. So in
    :math:`n + 1` steps a gain that fades by :math:`r` from step to step adds up to
    :math:`(n + 1) (g - n r / 2)`.

    Parameters
    ----------
    left_mps
        How much faster the train may get in all. [m/s]
    jerk_mps
        By how much the speed gained in a step may change from step to step. [m/s]
    rise_mps
        The same of the speed lost by the brake. [m/s]
    downhill_mps
        Speed gained in a step on the descent without brake; 0 or less on others. [m/s]

    Returns
    -------
    float
        Speed gained in the step. [m/s]
    """
    if left_mps <= 0.0 or downhill_mps <= 0.0 or rise_mps >= jerk_mps:
        return _even_mps(left_mps, jerk_mps)
    steps = math.floor(downhill_mps / rise_mps)
    braked_mps = steps * (downhill_mps - 0.5 * (steps + 1) * rise_mps)
    left = left_mps - braked_mps
    if left <= downhill_mps:
        return _even_mps(left_mps, rise_mps)
    # The last step before the brake rises counts as whole.
    left -= downhill_mps
    steps = 0
    while left > (steps + 2) * (downhill_mps + 0.5 * (steps + 1) * jerk_mps):
        steps += 1
    return max(left / (steps + 1) + 0.5 * steps * min(jerk_mps, left), downhill_mps)


@formula
def _even_mps(left_mps: float, change_mps: float) -> float:
    """Return the gain of a step from which it fades by the same from step to step. [m/s]"""
    if left_mps <= change_mps:
        return left_mps
    steps = math.floor(0.5 * (math.sqrt(1.0 + 8.0 * left_mps / change_mps) - 1.0))
    return left_mps / (steps + 1) + 0.5 * steps * change_mps


@formula
def own_ceiling_mps(
    manner: Manner, drivers: Drivers, train: int, motion: tuple[float, float]
) -> float:
    """
    Return how fast a driver wants to be at the end of a step.

    Parameters
    ----------
    manner
        How trains are driven.
    drivers
        What drivers remember.
    train
        Row of the train.
    motion
        Its front and speed. [m], [m/s]

    Returns
    -------
    float
        By limits and driven speeds, braked for in time. [m/s]
    """
    (front_m, speed), line, rise_mps = motion, manner.ceiling, manner.rise_mps[train]
    if drivers.hurries[train]:
        return ceiling_ahead_mps(line, train, front_m, speed, rise_mps)
    kept = CeilingFigures(line.braking, manner.unhurried, line.traction, line.reach_m)
    return ceiling_ahead_mps(kept, train, front_m, speed, rise_mps)


@formula
def coasts(
    manner: Manner, drivers: Drivers, train: int, speeds_mps: tuple[float, float], held_mps: float
) -> bool:
    """
    Return whether a train coasts, and write down whether it goes on to.

    Parameters
    ----------
    manner
        How trains are driven.
    drivers
        What drivers remember.
    train
        Row of the train.
    speeds_mps
        Its speed, and the one after a step of full traction. [m/s]
    held_mps
        The speed from which it coasts. [m/s]

    Returns
    -------
    bool
        Whether the train is without traction in this step.
    """
    speed, pulled = speeds_mps
    from_mps = drivers.coasts_from_mps[train]
    if from_mps > 0.0:
        # Where a train may run faster it speeds up.
        if speed < held_mps - manner.band_mps or held_mps > from_mps + FASTER_MPS:
            drivers.coasts_from_mps[train] = 0.0
            return False
        drivers.coasts_from_mps[train] = min(from_mps, held_mps)
        return True
    drivers.coasts_from_mps[train] = held_mps if pulled >= held_mps else 0.0
    return False


@formula
def has_reacted(now_s: float, train: int, may: bool, manner: Manner, drivers: Drivers) -> bool:
    """
    Return whether a train at its stop sets off, and write down since when it may.

    Parameters
    ----------
    now_s
        The time. [s]
    train
        Row of the train.
    may
        Whether it stands at its stop and may depart.
    manner
        How trains are driven.
    drivers
        What drivers remember.

    Returns
    -------
    bool
        False for a train that may depart and has not reacted yet.
    """
    if not may:
        drivers.may_s[train] = np.inf
        return True
    drivers.may_s[train] = min(drivers.may_s[train], now_s)
    return bool(now_s >= drivers.may_s[train] + manner.reaction_s - ROUNDING_S)
