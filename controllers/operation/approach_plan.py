"""
Where and when to run in behind a leader that departs (Sakai et al. 2020, section 2).

While the leader occupies the platform, the follower has to be able to stop short of it: its
*brake pattern*, to the *gate* where its authority ends. When the leader has gone, it may run on
to its own stop. The *approach point* is the place and speed on the pattern from which it arrives
soonest; the *optimal stop* is the place from which a standing train reaches the approach point
by full acceleration alone.
"""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.motion.driving import Driving, trace
from kankaku.railway.motion.run_curve import LONGEST_S, RunCurve, RunTimeError, StallError, fastest
from kankaku.railway.motion.timed_run import timed
from kankaku.railway.motion.way import Way, reaching_the_end, way_on
from kankaku.railway.plan.profile import Profile
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.roots import least_between, root_of

SPEED_GRID_MPS = 2.0
"""Spacing of the speeds among which the best is looked for first. [m/s]"""
STANDING_MPS = 0.05
NEARLY_M2PS2 = 0.1
"""What full acceleration gains in about a tenth of a metre. [m2/s2]"""
LEAST_WAY_M = 1.0
"""A point nearer than this is reached whatever the train does. [m]"""
CRAWL_MPS = 1.0
"""Rather than running slower than this, a train stops and waits. [m/s]"""
GATE_S = 1.0
"""An authority that stays for so long is worth running up to. [s]"""
LOOK_BACK_M = 1500.0
"""More than any acceleration to an approach point takes. [m]"""


class Site(NamedTuple):
    """One type of train behind another at one platform."""

    profile: Profile
    """The line with the ceilings that protection enforces."""
    row: int
    """Row of the follower's type in it."""
    train_type: TrainType
    stop_m: float
    """Where the follower stops. [m]"""
    delay_s: float
    """Delay of the authority. [s]"""
    eoa_m: FloatArray
    """End of authority once the leader goes, not falling. [m], shape (n_moments,)"""
    since_departure_s: FloatArray
    """When it gets there after the leader's departure. [s], shape (n_moments,)"""


class ApproachPoint(NamedTuple):
    """How to run in at a site."""

    front_m: float
    speed_mps: float
    passed_s: float
    """When to pass it, after the leader's departure. [s]"""
    interval_s: float
    """Leader's departure to own arrival, if it is passed then. [s]"""
    optimal_stop_m: float
    """Where best to stand until then. [m]"""
    gate_m: float
    """End of authority of the brake pattern. [m]"""
    pattern_m2ps2: FloatArray
    """Half the square of the speed on it. [m2/s2], shape (n_grid,)"""


class Passing(NamedTuple):
    """A plan to pass an approach point at a given moment."""

    wait_s: float
    """Until the run begins; until then stop at ``stop_m``. [s]"""
    stop_m: float
    curve: RunCurve


def approach_point(site: Site) -> ApproachPoint | None:
    """
    Return the approach point of a site: one variable, the speed there, decides.

    There has to be a gate: an authority that stays for a while although the leader has
    departed, as before a platform section for one train. Where authority follows the leader
    from its first movement on, running close up is as good as can be.

    Parameters
    ----------
    site
        The site.

    Returns
    -------
    ApproachPoint | None
        The point from which the follower arrives soonest; None without a gate.

    References
    ----------
    .. [1] Sakai et al. 2020, section 2.1 and fig. 3; optimal stop: section 2.2.
    """
    best = [_best_at(site, gate_m) for gate_m in _gates_m(site)]
    reached = [point for point in best if np.isfinite(point.interval_s)]
    return min(reached, key=lambda point: point.interval_s, default=None)


def _gates_m(site: Site) -> list[float]:
    """Return where authority ends for a while after the leader's departure."""
    starts = np.flatnonzero(np.diff(site.eoa_m, prepend=-np.inf) > 0.0)
    lasts_s = np.diff(np.append(site.since_departure_s[starts], site.since_departure_s[-1]))
    stays = (lasts_s >= GATE_S) & (site.eoa_m[starts] < site.stop_m)
    gates_m: list[float] = site.eoa_m[starts][stays].tolist()
    return gates_m


def _best_at(site: Site, gate_m: float) -> ApproachPoint:
    """Return the best speed on the brake pattern to a gate."""

    def interval_s(speed_mps: float) -> float:
        return _run_in_s(site, gate_m, speed_mps)[1]

    speeds_mps = np.arange(0.5 * SPEED_GRID_MPS, site.train_type.maximum_speed_mps, SPEED_GRID_MPS)
    intervals_s = [interval_s(speed) for speed in speeds_mps.tolist()]
    best = int(np.argmin(intervals_s))
    around = (max(speeds_mps[best] - SPEED_GRID_MPS, 0.0), speeds_mps[best] + SPEED_GRID_MPS)
    found_mps, least_s = least_between(interval_s, *around)
    speed_mps = float(found_mps if least_s <= intervals_s[best] else speeds_mps[best])
    passed_s, arrived_s = _run_in_s(site, gate_m, speed_mps)
    front_m = pattern_front_m(site, gate_m, speed_mps)
    pattern = pattern_m2ps2(site, gate_m)
    back_m = max(front_m - LOOK_BACK_M, site.profile.origin_m)
    _, stop_m = reaching_the_end(_way(site, (back_m, front_m), (0.0, speed_mps), pattern))
    return ApproachPoint(front_m, speed_mps, passed_s, arrived_s, stop_m, gate_m, pattern)


def pattern_front_m(site: Site, gate_m: float, speed_mps: float) -> float:
    """
    Return where a train on a brake pattern has a speed.

    Parameters
    ----------
    site
        The site.
    gate_m
        End of authority. [m]
    speed_mps
        Speed. [m/s]

    Returns
    -------
    float
        Its front. [m]
    """
    return float(_pattern_fronts_m(site, gate_m, np.array([speed_mps]))[0])


def pattern_m2ps2(site: Site, gate_m: float) -> FloatArray:
    """
    Return the brake pattern that stops short of an end of authority.

    Parameters
    ----------
    site
        The site.
    gate_m
        End of authority. [m]

    Returns
    -------
    FloatArray
        Half the square of the speed on the grid of the profile; beyond the greatest speed
        it stays at that. [m2/s2], shape (n_grid,)

    References
    ----------
    .. [1] Sakai et al. 2020, section 4.2: ``v = sqrt(2 d beta)``, d from the front with its
       buffer.
    """
    top_mps = 1.2 * site.train_type.maximum_speed_mps
    speeds_mps = np.linspace(0.0, top_mps, 1000)
    fronts_m = _pattern_fronts_m(site, gate_m, speeds_mps)
    speed = np.interp(site.profile.grid_m, fronts_m[::-1], speeds_mps[::-1], right=0.0)
    return 0.5 * np.square(speed)


def _pattern_fronts_m(site: Site, gate_m: float, speeds_mps: FloatArray) -> FloatArray:
    potential = site.profile.potential_m2ps2[site.row]
    grid_m = site.profile.grid_m
    at_limit = np.interp(gate_m, grid_m, potential)
    braking_from_m = np.interp(at_limit - 0.5 * np.square(speeds_mps), potential, grid_m)
    fronts_m: FloatArray = braking_from_m - speeds_mps * site.delay_s
    return fronts_m


def _run_in_s(site: Site, gate_m: float, speed_mps: float) -> tuple[float, float]:
    """Return when a train may pass its brake pattern at a speed, and when it then arrives."""
    front_m = pattern_front_m(site, gate_m, speed_mps)
    if 0.5 * speed_mps**2 > site.profile.ceiling_at_m2ps2(site.row, np.array(front_m)):
        return np.inf, np.inf
    try:
        curve = fastest(_way(site, (front_m, site.stop_m), (speed_mps, 0.0), None))
    except StallError:
        return np.inf, np.inf
    # Each point needs an authority as far as its own brake curve ends.
    potential, grid_m = site.profile.potential_m2ps2[site.row], site.profile.grid_m
    ahead_m = curve.chainage_m + curve.speed_mps * site.delay_s
    stopping = np.interp(ahead_m, grid_m, potential) + 0.5 * np.square(curve.speed_mps)
    need_m = np.interp(stopping, potential, grid_m)
    need_m[0] = gate_m
    moment = np.searchsorted(site.eoa_m, need_m - 1e-6)
    if moment.max() >= site.eoa_m.size:
        return np.inf, np.inf
    # What a cell needs at its end has to be there when it is entered.
    entered_s = np.append(curve.time_s[0], curve.time_s[:-1])
    passed_s = float((site.since_departure_s[moment] - entered_s).max())
    return passed_s, passed_s + curve.run_time_s


def _way(
    site: Site,
    ends_m: tuple[float, float],
    speeds_mps: tuple[float, float],
    pattern_m2ps2: FloatArray | None,
    also_m: float | None = None,
) -> Way:
    return way_on(
        site.profile,
        site.row,
        site.train_type,
        ends_m,
        speeds_mps,
        ceiling_m2ps2=pattern_m2ps2,
        also_m=also_m,
    )


def plan_passing(
    site: Site, point: ApproachPoint, front_m: float, speed_mps: float, left_s: float
) -> Passing | None:
    """
    Plan to pass an approach point after a given time.

    A train that is too near and too slow to reach the speed there passes the brake pattern
    where its full acceleration meets it. Run so as to coast where that is slow enough; else brake
    to a lower speed, hold it and speed up again; else stop and wait.

    Parameters
    ----------
    site
        The site.
    point
        Its approach point.
    front_m
        Where the train is. [m]
    speed_mps
        Its speed. [m/s]
    left_s
        Time until the point is to be passed. [s]

    Returns
    -------
    Passing | None
        The plan; None if the train cannot be there before anyway, or there too soon however
        hard it brakes.

    References
    ----------
    .. [1] Sakai et al. 2020, sections 2.1 and 3.2.
    """
    try:
        return _plan_passing(site, point, front_m, speed_mps, left_s)
    except StallError:
        return None


def _plan_passing(
    site: Site, point: ApproachPoint, front_m: float, speed_mps: float, left_s: float
) -> Passing | None:
    if front_m >= (point.gate_m if speed_mps <= STANDING_MPS else point.front_m):
        return None
    missing = np.inf
    if front_m < point.front_m:
        way = _way_to(site, point, front_m, speed_mps)
        reaching, _ = reaching_the_end(way)
        missing = float(reaching.floor_m2ps2[0]) - 0.5 * speed_mps**2
        way = reaching if missing <= 0.0 else way
    if missing > NEARLY_M2PS2:
        point = _further_on(site, point, front_m, speed_mps)
        if point.front_m - front_m < LEAST_WAY_M:
            return None
        way = _way_to(site, point, front_m, speed_mps)
    quickest = fastest(way)
    if quickest.run_time_s >= left_s:
        return None
    if speed_mps <= STANDING_MPS:
        return Passing(left_s - quickest.run_time_s, front_m, quickest)
    try:
        return Passing(0.0, front_m, timed(way, left_s))
    except RunTimeError:
        return _hold_back(site, point, way, left_s)


def _way_to(site: Site, point: ApproachPoint, front_m: float, speed_mps: float) -> Way:
    ends_m, speeds_mps = (front_m, point.front_m), (speed_mps, point.speed_mps)
    return _way(site, ends_m, speeds_mps, point.pattern_m2ps2, point.optimal_stop_m)


def _further_on(
    site: Site, point: ApproachPoint, front_m: float, speed_mps: float
) -> ApproachPoint:
    """Return the point at which full acceleration meets the brake pattern."""
    way = _way(site, (front_m, point.gate_m), (speed_mps, 0.0), point.pattern_m2ps2)
    energy = trace(way, Driving.fastest(way)).energy_m2ps2
    meets = 1 + int(np.argmax(energy[1:] >= way.cap_m2ps2[1:] - 1e-9))
    speed_there_mps = float(np.sqrt(2.0 * energy[meets]))
    return point._replace(front_m=float(way.chainage_m[meets]), speed_mps=speed_there_mps)


def _hold_back(site: Site, point: ApproachPoint, way: Way, left_s: float) -> Passing | None:
    """Lose more time than by coasting: run at a lower speed, or stop and wait."""

    def early_s(top_mps: float) -> float:
        slower = way.no_faster(top_mps)
        return left_s - min(trace(slower, Driving.fastest(slower)).run_time_s, LONGEST_S)

    front_m, top_mps = float(way.chainage_m[0]), float(way.limit_mps.max())
    waiting, late_s = None, np.inf
    if early_s(CRAWL_MPS) > 0.0:
        waiting, late_s = _stop_and_wait(site, point, way, left_s)
        if waiting is not None and late_s <= 0.0:
            return waiting
    if early_s(STANDING_MPS) > 0.0:
        # Neither slow enough nor stopped in time: wait too long, or be too soon, whichever is less.
        return waiting if late_s < _lost_s(site, point, early_s(top_mps)) else None
    held_mps = root_of(early_s, STANDING_MPS, top_mps, xtol=1e-4)
    return Passing(0.0, front_m, fastest(way.no_faster(held_mps)))


def _lost_s(site: Site, point: ApproachPoint, too_soon_s: float) -> float:
    """Return how much later a train arrives that passes too soon and brakes on until it may go."""
    then_mps = max(point.speed_mps - site.train_type.service_brake_mps2 * too_soon_s, 0.0)
    return _run_in_s(site, point.gate_m, then_mps)[1] - point.interval_s


def _stop_and_wait(
    site: Site, point: ApproachPoint, way: Way, left_s: float
) -> tuple[Passing | None, float]:
    """Stop at the optimal place, or as soon as possible behind it; say how late that makes."""
    front_m = float(way.chainage_m[0])
    soonest = way.potential_m2ps2[0] + 0.5 * way.start_mps**2
    soonest_m = float(np.interp(soonest, way.potential_m2ps2, way.chainage_m))
    stop_m = max(point.optimal_stop_m, soonest_m)
    if not front_m < stop_m < point.front_m:
        return None, np.inf
    pattern = point.pattern_m2ps2
    to_stop = fastest(_way(site, (front_m, stop_m), (way.start_mps, 0.0), pattern))
    start = fastest(_way(site, (stop_m, point.front_m), (0.0, point.speed_mps), pattern))
    wait_s = max(left_s - start.run_time_s, to_stop.run_time_s)
    return Passing(wait_s, stop_m, start), wait_s + start.run_time_s - left_s
