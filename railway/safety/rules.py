"""
The rules for a train in a step: of each its number, its tolerance and its formula.

A formula says by how much a train breaks its rule, and minus infinity where the rule does not bind
it. Not-a-number breaks every rule.
"""

from typing import NamedTuple

import numpy as np

from kankaku.railway.compiled import formula
from kankaku.railway.safety.brakes import TrainData, overrun_m
from kankaku.railway.safety.numbers import greater, lesser, share

POSITION_TOLERANCE_M = 0.05
"""Beside b dt^2 / 8, by which a train that stops within a step may pass its aim. [m]"""
STOP_TOLERANCE_M = 0.5
"""A front further beyond its stop than this has missed it. [m]"""
SPEED_TOLERANCE_MPS = 0.01
ACCELERATION_TOLERANCE_MPS2 = 0.02
HANDLING_MPS2 = 0.02
"""Brake forces are known this well, beside the gradient within a metre. [m/s2]"""
UNBRAKED_M = 0.05
"""Brake curves from tables come this near to exact ones. [m]"""
PERMITTED_M = 0.05
"""Brake curves from tables come this near to exact ones. [m]"""

AUTHORITY, BAND, SPACING, STOP, LIMIT, ACCELERATION, BRAKING, VALIDITY, IDLE = range(9)
MARGIN, GRANT, RELEASE, PLATFORM = range(9, 13)
TOLERANCES = {
    "authority": POSITION_TOLERANCE_M,
    "band": POSITION_TOLERANCE_M,
    "spacing": POSITION_TOLERANCE_M,
    "stop": STOP_TOLERANCE_M,
    "limit": SPEED_TOLERANCE_MPS,
    "acceleration": ACCELERATION_TOLERANCE_MPS2,
    "braking": HANDLING_MPS2,
    "validity": HANDLING_MPS2,
    "idle": UNBRAKED_M,
    "margin": PERMITTED_M,
    "grant": PERMITTED_M,
    "release": PERMITTED_M,
    "platform": PERMITTED_M,
}
"""Of the rules in the order of their numbers; b dt^2 / 8 is added to the first and the third."""
KINDS = tuple(TOLERANCES)

HALTING_MPS = 0.1
"""An engine may take this last bit of speed away when a stop begins. [m/s]"""
NEED_M = 1.0
"""A train this near to its brake curve may need more than the service brake. [m]"""
ROUNDING_S = 1e-3


class TrainStep(NamedTuple):
    """A train in a step, from one moment to the next."""

    step_s: float
    time_s: float
    """Of the first moment."""
    before_m: float
    """Its front at the first moment. [m]"""
    after_m: float
    """Its front at the second moment. [m]"""
    before_mps: float
    after_mps: float
    eoa_m: float
    """End of authority at the first moment. [m]"""
    next_eoa_m: float
    """End of authority at the second moment. [m]"""
    delay_s: float
    """By how much running the front counts as further ahead of it."""
    heard_s: float
    """When the commands were sent that it has by radio."""
    surprised: bool
    """A sudden obstruction may have come too near, at the first moment."""
    next_surprised: bool
    """The same, at the second moment."""
    halting: bool
    """A stop begins at the second moment."""
    emergency: bool
    """Protection lets it brake in emergency."""


@formula
def authority_m(
    train: TrainData, now: TrainStep, lift_m: float, rising_m: float, unlike_m: float
) -> float:
    """
    Rule ``authority``: a train could stop before its end of authority. [m]

    By its service brake, ``lift_m`` up; it runs on for ``rising_m`` while the brake builds up, and
    may take the gradient where its front is for that where it counts as being (``unlike_m``).
    """
    # Nothing holds a train that a sudden obstruction comes too near to but this very thing,
    # and nobody who stands overruns anything.
    if now.surprised or (now.before_mps == 0.0 and now.after_mps == 0.0):
        return -np.inf
    room_m = now.eoa_m - (now.after_m + now.after_mps * now.delay_s)
    return overrun_m(train, now.after_mps, room_m, lift_m) + rising_m - unlike_m


@formula
def band_m(now: TrainStep, next_rear_m: float) -> float:
    """Rule ``band``: no end of authority is beyond the rear of the train ahead. [m]"""
    return now.eoa_m - greater(next_rear_m, now.before_m)


@formula
def spacing_m(
    train: TrainData, now: TrainStep, next_rear_m: float, lift_m: float, rising_m: float
) -> float:
    """Rule ``spacing``: a train could stop before the rear of the train ahead. [m]"""
    room_m = next_rear_m - now.after_m
    return overrun_m(train, now.after_mps, room_m, lift_m) + rising_m


@formula
def stop_m(now: TrainStep, place_m: float) -> float:
    """Rule ``stop``: a front does not pass its next stop. [m]"""
    return now.after_m - place_m


@formula
def limit_mps(now: TrainStep, lowest_mps: float) -> float:
    """Rule ``limit``: a train keeps the limits under all of its length, and its own. [m/s]"""
    return now.after_mps - lowest_mps


@formula
def acceleration_mps2(
    train: TrainData, now: TrainStep, pull_mps2: float, hardest_mps2: float, least_slope: float
) -> float:
    """
    Rule ``acceleration``: no train outdoes its traction or its emergency brake. [m/s2]

    ``pull_mps2`` is what traction gives on the level at the lower of both speeds, ``hardest_mps2``
    what the brake takes at most; the least gradient of the step counts against traction.
    """
    halted_mps = lesser(now.before_mps, HALTING_MPS) if now.halting else 0.0
    gained_mps2 = (now.after_mps + halted_mps - now.before_mps) / now.step_s
    too_strong = gained_mps2 - (pull_mps2 - train.weight_mps2 * least_slope)
    too_hard = -hardest_mps2 - gained_mps2
    # The brake holds whoever stands, on any gradient.
    if now.after_mps == 0.0:
        too_strong = -np.inf
        if now.before_mps == 0.0:
            too_hard = -np.inf
    return greater(too_strong, too_hard)


@formula
def braking_mps2(now: TrainStep, strongest_mps2: float) -> float:
    """Rule ``braking``: only in need, or if let, a train brakes harder than in service. [m/s2]"""
    if now.emergency or now.halting:
        return -np.inf
    return (now.before_mps - now.after_mps) / now.step_s - strongest_mps2


@formula
def in_need(train: TrainData, now: TrainStep, lift_m: float) -> bool:
    """
    Tell whether a train could not keep its authority by the service brake alone.

    It excuses whoever breaks the rule ``braking``.
    """
    room_m = now.eoa_m - (now.before_m + now.before_mps * now.delay_s)
    return not overrun_m(train, now.before_mps, room_m, lift_m) < -NEED_M


@formula
def validity_mps2(train: TrainData, now: TrainStep, since_s: float, least_slope: float) -> float:
    """Rule ``validity``: who has had too old commands for some time brakes in emergency. [m/s2]"""
    if now.after_mps == 0.0 or now.halting or since_s <= 0.0:
        return -np.inf
    built_mps2 = train.emergency_mps2 * share(since_s / greater(train.build_up_s, ROUNDING_S))
    lost_mps2 = (now.before_mps - now.after_mps) / now.step_s
    return built_mps2 + train.brake_gravity_mps2 * least_slope - lost_mps2


@formula
def idle_m(train: TrainData, now: TrainStep, lift_m: float, idle_s: float) -> float:
    """Rule ``idle``: who enters a block can run on for the idle time before it brakes. [m]"""
    # Whoever a sudden obstruction came too near to is braking already.
    if now.next_surprised:
        return -np.inf
    room_m = now.next_eoa_m - (now.after_m + idle_s * now.after_mps)
    return overrun_m(train, now.after_mps, room_m, lift_m)


@formula
def reached_m(now: TrainStep, drift_m: float, resolution_m: float, margin_m: float) -> float:
    """
    Return how far a permission reaches: end of authority, buffer and margin. [m]

    A train that stands where it may not go any further is permitted nothing.
    """
    if now.eoa_m <= now.before_m:
        return -np.inf
    return now.eoa_m + drift_m + resolution_m + margin_m


@formula
def beyond_m(reached_m: float, free_to_m: float) -> float:
    """
    Return by how much a permission reaches into what is not free. [m]

    ``margin``: the rear of the train ahead, with its buffer. ``grant``: what is not proven for
    the train, or in its way. ``release``: the circuits that are not released.
    ``platform``: a platform section with another train in it.
    """
    return reached_m - free_to_m
