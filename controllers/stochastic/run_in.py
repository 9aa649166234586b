"""
Running in after the release: the follower behind a leader that departs, under a speed cap.

The run is stepped on as the drive does it: full traction within the jerk limit, the permitted
speed of the moment, the service brake where that is lower.
"""

import math
from typing import NamedTuple

from kankaku.controllers.stochastic.approach_site import (
    MOMENT_S,
    SPEED_CELLS_PER_MPS,
    PlatformSite,
    PlatformWay,
)
from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import Plain, compiled, formula, interpolated
from kankaku.railway.meters.standstill import CRAWLING_MPS
from kankaku.railway.motion.electric_brake import electric_brake_n

LONGEST_S = 400.0
"""A run that takes longer is as bad as one that never ends. [s]"""
NEARLY_M = 5.0
"""The last metres before the stop are braked evenly. [m]"""
GIVEN_BACK_S = 1.0
"""Braking into a stop gives back energy of less worth. [s]"""
LEAST_MPS = 0.05


class Costs(NamedTuple):
    """What things cost, in seconds of delay of one train."""

    standing: float
    """A second slower than 10 km/h between stations. [-]"""
    kwh_s: float
    """A kilowatt-hour at the contact wire. [s]"""


@compiled
def site_of(fields: Plain) -> PlatformSite:
    """
    Return a site with its names.

    Parameters
    ----------
    fields
        Of :class:`~kankaku.controllers.stochastic.approach_site.PlatformSite`, plain.

    Returns
    -------
    PlatformSite
        The same.
    """
    approach, stop_m, permitted_v2 = fields
    return PlatformSite(PlatformWay(*approach), stop_m, permitted_v2)


@formula
def permitted_v2_at(site: PlatformSite, moment: int, place: float) -> float:
    """
    Return the square of the speed permitted at a place.

    Parameters
    ----------
    site
        The site.
    moment
        Since the release, in steps.
    place
        Cells from the first place on.

    Returns
    -------
    float
        From the last place on that of the last but one. [m2/s2]
    """
    cell = min(max(int(place), 0), site.permitted_v2.shape[1] - 2)
    part = min(max(place - cell, 0.0), 1.0)
    row = site.permitted_v2[min(moment, site.permitted_v2.shape[0] - 1)]
    return float(row[cell] + part * (row[cell + 1] - row[cell]))


@formula
def drag_at_mps2(approach: PlatformWay, place: float) -> float:
    """
    Return what gradient and curves take at a place.

    Parameters
    ----------
    approach
        The way.
    place
        Cells from the first place on.

    Returns
    -------
    float
        Deceleration. [m/s2]
    """
    cell = min(max(int(place), 0), approach.drag_mps2.size - 1)
    return float(approach.drag_mps2[cell])


@formula
def by_speed(table: FloatArray, speed_mps: float) -> float:
    """
    Return an acceleration on the level by speed.

    Parameters
    ----------
    table
        Of a site.
    speed_mps
        The speed. [m/s]

    Returns
    -------
    float
        The acceleration. [m/s2]
    """
    place = min(speed_mps * SPEED_CELLS_PER_MPS, table.size - 1.001)
    return float(interpolated(table, place))


@formula
def energy_kwh(
    approach: PlatformWay, speeds_mps: tuple[float, float], drag_mps2: float, lasts_s: float
) -> float:
    """
    Return the net energy of a piece of a run.

    Parameters
    ----------
    approach
        The way.
    speeds_mps
        Speed before and after it. [m/s]
    drag_mps2
        What gradient and curves take. [m/s2]
    lasts_s
        How long it lasts. [s]

    Returns
    -------
    float
        At the contact wire; below 0 where more is given back. [kWh]
    """
    before, after = speeds_mps
    mean = 0.5 * (before + after)
    force = (after - before) / lasts_s + drag_mps2 - by_speed(approach.coast_mps2, mean)
    if force >= 0.0:
        return approach.traction_kwh * force * mean * lasts_s
    greatest, power = approach.electric_mps2, approach.electric_wpkg
    electric = float(electric_brake_n(mean, greatest, power, approach.cutoff_mps))
    return -approach.electric_kwh * min(-force, electric) * mean * lasts_s


@formula
def run_in(
    site: PlatformSite, motion: tuple[float, float], cap_mps: float, costs: Costs, bound_s: float
) -> tuple[float, float, float]:
    """
    Run a follower in after the release of its leader.

    Parameters
    ----------
    site
        The site.
    motion
        Front [m] and speed [m/s] of the follower at the release.
    cap_mps
        Speed that it does not exceed. [m/s]
    costs
        What things cost.
    bound_s
        A run that costs more need not be run to its end. [s]

    Returns
    -------
    tuple[float, float, float]
        From the release to its arrival [s], the cost of that [s], and the greatest speed [m/s].
    """
    way, (front_m, speed), gained = site.approach, motion, 0.0
    place, last = (front_m - way.from_m) / way.place_m, (site.stop_m - way.from_m) / way.place_m
    passed_s, cost, brakes, peak = 0.0, 0.0, way.brake_mps2 * MOMENT_S, speed
    while (last - place) * way.place_m > NEARLY_M:
        if passed_s > LONGEST_S or passed_s + cost > bound_s + GIVEN_BACK_S:
            return LONGEST_S, LONGEST_S * (1.0 + costs.standing), peak
        drag = drag_at_mps2(way, place)
        rate = min(by_speed(way.pull_mps2, speed) - drag, gained + way.jerk_mps3 * MOMENT_S)
        wish = min(speed + rate * MOMENT_S, max(cap_mps, speed - brakes))
        ahead = place + 0.5 * (speed + wish) * MOMENT_S / way.place_m
        kept = math.sqrt(permitted_v2_at(site, round(passed_s / MOMENT_S), ahead))
        after = max(min(wish, kept), speed - brakes, 0.0)
        mean, gained = 0.5 * (speed + after), (after - speed) / MOMENT_S
        cost += costs.kwh_s * energy_kwh(way, (speed, after), drag, MOMENT_S)
        if mean < CRAWLING_MPS:
            cost += costs.standing * MOMENT_S
        place += mean * MOMENT_S / way.place_m
        speed, peak = after, max(peak, after)
        passed_s += MOMENT_S
    passed_s += 2.0 * max(last - place, 0.0) * way.place_m / max(speed, LEAST_MPS)
    return passed_s, cost + passed_s, peak


@compiled
def best_cap(
    site: PlatformSite, motion: tuple[float, float], caps_mps: FloatArray, costs: Costs
) -> tuple[float, float]:
    """
    Return the cheapest of some speed caps to run in under.

    Parameters
    ----------
    site
        The site.
    motion
        Front [m] and speed [m/s] of the follower at the release.
    caps_mps
        The caps, falling; the first one for none. [m/s], shape (n_caps,)
    costs
        What things cost.

    Returns
    -------
    tuple[float, float]
        Its cost [s], and the cap [m/s].
    """
    chosen = caps_mps[0]
    _, least, peak = run_in(site, motion, chosen, costs, math.inf)
    for cap_mps in caps_mps[1:]:
        if cap_mps < peak:
            _, cost, _ = run_in(site, motion, cap_mps, costs, least)
            if cost < least:
                least, chosen = cost, cap_mps
    return least, chosen


@formula
def run_in_cap_mps(
    site_fields: Plain, motion: tuple[float, float], caps_mps: FloatArray, costs_fields: Plain
) -> float:
    """
    Return the cheapest speed cap to run in under; see :func:`best_cap`.

    Parameters
    ----------
    site_fields
        Of a site, plain.
    motion
        Front [m] and speed [m/s] of the follower at the release.
    caps_mps
        The caps, falling. [m/s], shape (n_caps,)
    costs_fields
        What things cost, plain.

    Returns
    -------
    float
        The cap. [m/s]
    """
    return best_cap(site_of(site_fields), motion, caps_mps, Costs(*costs_fields))[1]
