"""
A site: one type of train behind another at one platform, laid out by place and by moment.

While the leader stands, the follower's authority ends at the *limit*. From the leader's release on
the authority moves on; what the protection permits then is tabulated by the time since the release
and by the place of the follower's front, so that whatever plans over it needs no protection.
"""

from typing import NamedTuple

import numpy as np

from kankaku.controllers.operation.approach_point import leaving
from kankaku.railway.arrays import FloatArray
from kankaku.railway.motion.way import way_on
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight

MOMENT_S = 0.5
"""Spacing of the moments, and the step in which the follower is run on. [s]"""
PLACES = 400
"""Places of a site, evenly from the first one to the stop."""
LONGEST_WAY_M = 1500.0
"""Nobody plans from further away. [m]"""
LEAST_WAY_M = 20.0
"""A limit nearer to the stop before than this leaves nothing to plan. [m]"""
JOULES_PER_KWH = 3.6e6
SPEED_CELLS_PER_MPS = 10.0
"""How finely accelerations are tabulated. [s/m]"""


class MeetingCalls(NamedTuple):
    """The calls of two trains at one platform."""

    call: int
    """The follower's next call."""
    leader: int
    """Row of its leader."""
    leaders_call: int
    """The leader's call there."""


class PlatformWay(NamedTuple):
    """A way to a platform and the train on it; plain numbers and arrays."""

    limit_m: float
    """Where authority ends while the leader stands. [m]"""
    from_m: float
    """Where the places begin. [m]"""
    place_m: float
    """Spacing of the places. [m]"""
    drag_mps2: FloatArray
    """What gradient and curves take. [m/s2], shape (PLACES,)"""
    pull_mps2: FloatArray
    """Greatest acceleration on the level, resistance taken off. [m/s2], shape (n_speeds,)"""
    coast_mps2: FloatArray
    """The same without traction: less than nothing. [m/s2], shape (n_speeds,)"""
    brake_mps2: float
    """Service brake. [m/s2]"""
    station_brake_mps2: float
    """The brake that drivers use for stops. [m/s2]"""
    jerk_mps3: float
    electric_mps2: float
    """Greatest force of the electric brake by mass. [m/s2]"""
    electric_wpkg: float
    """Its greatest power by mass. [W/kg]"""
    cutoff_mps: float
    """Up to this speed there is none. [m/s]"""
    traction_kwh: float
    """Energy that work of traction costs, by mass. [kWh per m2/s2]"""
    electric_kwh: float
    """What work of the electric brake gives back, by mass. [kWh per m2/s2]"""


class PlatformSite(NamedTuple):
    """What a follower may do on its approach to a platform, and behind its leader into it."""

    approach: PlatformWay
    stop_m: float
    """Where it stops in the platform. [m]"""
    permitted_v2: FloatArray
    """
    Square of the permitted speed by moment since the release and place.

    The last moment stands for all later ones. [m2/s2], shape (n_moments, PLACES)
    """


def approach_site(
    world: World, foresight: Foresight, row: int, calls: MeetingCalls
) -> PlatformSite | None:
    """
    Lay out the site of a train behind its leader.

    Parameters
    ----------
    world
        The trains.
    foresight
        What the protection will permit.
    row
        The follower.
    calls
        Its next call, its leader, and that one's call.

    Returns
    -------
    PlatformSite | None
        The site; None where the platform is nobody's to wait for: the limit is not ahead of the
        follower's stop before, or not short of its next one.
    """
    call, leader, leaders_call = calls
    stop_m = float(world.stop_m[row, call])
    before_m = float(world.stop_m[row, call - 1]) if call > 0 else world.profile.origin_m
    stands_m = world.stop_m[leader, [leaders_call]]
    limit_m = float(foresight.eoa_behind_m(row, call, leader, stands_m, np.zeros(1))[0])
    if not before_m + LEAST_WAY_M < limit_m < stop_m:
        return None
    from_m = max(before_m, limit_m - LONGEST_WAY_M)
    kind = int(world.type_index[row])
    train, profile = world.driven_types[kind], foresight.profile
    places_m = np.linspace(from_m, stop_m, PLACES)
    eoa_m = _eoas_m(world, foresight, row, calls)
    way = way_on(profile, kind, train, (from_m, stop_m))
    kept_v2 = 2.0 * np.interp(places_m, way.chainage_m, way.cap_m2ps2)
    permitted_v2 = np.array(
        [
            np.minimum(
                np.square(foresight.permitted_mps(row, places_m, np.full(places_m.size, end_m))),
                kept_v2,
            )
            for end_m in eoa_m.tolist()
        ]
    )
    drag_mps2 = np.interp(places_m, profile.grid_m, profile.drag_mps2[kind])
    return PlatformSite(
        _approach(world, kind, (limit_m, places_m), drag_mps2), stop_m, permitted_v2
    )


def _approach(
    world: World, kind: int, ways_m: tuple[float, FloatArray], drag_mps2: FloatArray
) -> PlatformWay:
    limit_m, places_m = ways_m
    train, supply = world.driven_types[kind], world.train_types[kind].supply
    mass_kg = train.inertial_mass_kg
    fastest_mps = max(other.maximum_speed_mps for other in world.train_types)
    speeds_mps = np.arange(0.0, fastest_mps + 2.0, 1.0 / SPEED_CELLS_PER_MPS)
    return PlatformWay(
        limit_m=limit_m,
        from_m=float(places_m[0]),
        place_m=float(places_m[1] - places_m[0]),
        drag_mps2=drag_mps2,
        pull_mps2=train.level_acceleration_mps2(speeds_mps),
        coast_mps2=-train.resistance.force_n(speeds_mps) / mass_kg,
        brake_mps2=world.train_types[kind].service_brake_mps2,
        station_brake_mps2=train.service_brake_mps2,
        jerk_mps3=train.jerk_mps3,
        electric_mps2=supply.regeneration_force_n / mass_kg,
        electric_wpkg=supply.regeneration_power_w / mass_kg,
        cutoff_mps=supply.regeneration_cutoff_mps,
        traction_kwh=mass_kg / JOULES_PER_KWH / supply.traction_efficiency,
        electric_kwh=mass_kg / JOULES_PER_KWH * supply.regeneration_efficiency,
    )


def _eoas_m(world: World, foresight: Foresight, row: int, calls: MeetingCalls) -> FloatArray:
    """Return ends of authority by moment since the release, until they are past the stop."""
    call, leader, leaders_call = calls
    stops_m = tuple(world.stop_m[leader, leaders_call : leaders_call + 2].tolist())
    away = leaving(world, foresight.profile, int(world.type_index[leader]), stops_m)
    seen_late_s = foresight.release_delay_s + float(world.departure_lag_s[leader])
    lasts_s = away.run_time_s + seen_late_s
    moments_s = MOMENT_S * np.arange(int(np.ceil(lasts_s / MOMENT_S)) + 1)
    fronts_m = np.interp(moments_s - seen_late_s, away.time_s, away.chainage_m)
    speeds_mps = np.interp(moments_s - seen_late_s, away.time_s, away.speed_mps)
    eoa_m = np.maximum.accumulate(foresight.eoa_behind_m(row, call, leader, fronts_m, speeds_mps))
    free = eoa_m >= world.stop_m[row, call]
    last = int(np.argmax(free)) if free.any() else eoa_m.size - 1
    kept: FloatArray = eoa_m[: last + 1]
    return kept
