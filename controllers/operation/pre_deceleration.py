"""
Pre-deceleration: lose the time that must be lost anyway at a lower speed (Sato et al. 2025, 4.2).

The plan of a train is two numbers: a ceiling, and the moment at which it is lifted so that
the train, speeding up, meets the first stage of two-stage deceleration just when its leader
may depart. Both follow from monotone equations in one variable.
"""

from typing import NamedTuple

from kankaku.railway.motion.kinematics import braking_distance_m
from kankaku.railway.motion.run_up import RunUp
from kankaku.railway.roots import root_of


class Slowing(NamedTuple):
    """A pre-deceleration: run no faster than this for so long, then speed up."""

    ceiling_mps: float
    lasts_s: float


class Approach(NamedTuple):
    """A train on its way to the place where its leader stands or will stand."""

    distance_m: float
    """To the leader's rear there, margins taken off. [m]"""
    speed_mps: float
    fastest_mps: float
    """Speed at which the first stage should begin if there is room for it. [m/s]"""
    slowest_mps: float
    first_stage_mps2: float
    service_brake_mps2: float
    run_up: RunUp


def slow_down(approach: Approach, wait_s: float) -> Slowing | None:
    """
    Return the pre-deceleration that spends a given time on the way to the first stage.

    Parameters
    ----------
    approach
        The way and the train.
    wait_s
        Time until the leader may depart. [s]

    Returns
    -------
    Slowing | None
        The plan; None if the train gets to the first stage later than that anyway.

    References
    ----------
    .. [1] Sato et al. 2025, section 4.2.
    """
    slowest, fastest = approach.slowest_mps, approach.fastest_mps
    if fastest <= slowest or _duration_s(approach, fastest, fastest) >= wait_s:
        return None
    if _longest_s(approach, slowest) <= wait_s:
        return Slowing(slowest, wait_s)
    entry = fastest
    if _longest_s(approach, fastest) < wait_s:
        entry = root_of(
            lambda speed: _longest_s(approach, speed) - wait_s, slowest, fastest, xtol=0.01
        )
        cruise = _lowest_cruise_mps(approach, entry)
    else:
        cruise = root_of(
            lambda speed: _duration_s(approach, speed, entry) - wait_s,
            _lowest_cruise_mps(approach, entry),
            entry,
            xtol=0.01,
        )
    up_s, _ = approach.run_up.between(cruise, entry)
    return Slowing(cruise, max(wait_s - up_s, 0.0))


def _cruise_m(approach: Approach, cruise_mps: float, entry_mps: float) -> float:
    """Return the distance left for cruising; negative where there is no room for the rest."""
    speed = approach.speed_mps
    to_cruise_m = 0.5 * (speed**2 - cruise_mps**2) / approach.service_brake_mps2
    if speed < cruise_mps:
        _, to_cruise_m = approach.run_up.between(speed, cruise_mps)
    _, to_entry_m = approach.run_up.between(cruise_mps, entry_mps)
    first_stage_m = float(braking_distance_m(entry_mps, approach.first_stage_mps2))
    return approach.distance_m - first_stage_m - to_cruise_m - to_entry_m


def _duration_s(approach: Approach, cruise_mps: float, entry_mps: float) -> float:
    """Return the time to the first stage; 0 where there is no room for such a run."""
    cruise_m = _cruise_m(approach, cruise_mps, entry_mps)
    if cruise_m < 0.0:
        return 0.0
    speed = approach.speed_mps
    to_cruise_s = (speed - cruise_mps) / approach.service_brake_mps2
    if speed < cruise_mps:
        to_cruise_s, _ = approach.run_up.between(speed, cruise_mps)
    to_entry_s, _ = approach.run_up.between(cruise_mps, entry_mps)
    return to_cruise_s + cruise_m / cruise_mps + to_entry_s


def _lowest_cruise_mps(approach: Approach, entry_mps: float) -> float:
    """Return the lowest cruising speed for which there is room."""
    slowest = approach.slowest_mps
    if _cruise_m(approach, slowest, entry_mps) >= 0.0:
        return slowest
    if _cruise_m(approach, entry_mps, entry_mps) < 0.0:
        return entry_mps
    root: float = root_of(
        lambda speed: _cruise_m(approach, speed, entry_mps), slowest, entry_mps, xtol=1e-6
    )
    return root + 1e-6


def _longest_s(approach: Approach, entry_mps: float) -> float:
    return _duration_s(approach, _lowest_cruise_mps(approach, entry_mps), entry_mps)
