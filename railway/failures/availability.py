"""Availability of a train-control system from the failures and repairs of its devices."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.randomness import stream

YEAR_S = 365.0 * 24.0 * 3600.0
"""8760 hours, as published availabilities count. [s]"""
CONFIDENCE = 0.99
_WHOLE = 1.0 - 1e-9
"""Effects that add up to the whole line, rounding of thirds included. [-]"""


@dataclass(frozen=True, slots=True)
class DeviceGroup:
    """Devices of one kind in a system."""

    device: str
    count: float
    """May be a fraction, for a device with less in it than the usual one. [-]"""
    effect: float
    """Share of the line that the failure of one of them stops. [-]"""
    failure_rate_per_s: float
    """Of one device. [1/s]"""
    repair_s: float
    """Mean time to repair one device. [s]"""


@dataclass(frozen=True, slots=True)
class Configuration:
    """A system: what devices it is made of."""

    name: str
    title: str
    groups: tuple[DeviceGroup, ...]
    published: Mapping[str, float]
    """Published results by column of the table ``availability``, as printed; may be empty."""


class Availability(NamedTuple):
    """What failures cost in the mean."""

    failures_per_year: float
    stopped_s_per_year: float
    """Hours of repair, each weighted with the share of the line that stops. [s]"""
    mean_repair_s: float
    """Stopped time per failure. [s]"""
    availability: float
    """Share of the year in which the line is not stopped. [-]"""


def availability(configuration: Configuration) -> Availability:
    """
    Return failures, stopped time and availability of a system.

    Parameters
    ----------
    configuration
        Its devices.

    Returns
    -------
    Availability
        Per year; failures are rare enough not to fall into each other's repair.

    References
    ----------
    .. [1] Sugiyama et al. 2018, section 3.3.2 and tables 4 to 6.
    """
    failures = [group.count * group.failure_rate_per_s * YEAR_S for group in configuration.groups]
    stopped_s = sum(
        number * group.repair_s * group.effect
        for number, group in zip(failures, configuration.groups, strict=True)
    )
    together = sum(failures)
    return Availability(
        failures_per_year=together,
        stopped_s_per_year=stopped_s,
        mean_repair_s=stopped_s / together if together else math.nan,
        availability=1.0 - stopped_s / YEAR_S,
    )


class Estimate(NamedTuple):
    """A mean over simulated years with the half width of its 99 % interval."""

    mean: float
    half_width: float


class Outages(NamedTuple):
    """Simulated years, one entry each. shape (n_years,)"""

    failures: FloatArray
    """Failures of any device. [-]"""
    stopped_s: FloatArray
    """Time of repair weighted with the effect, in the year of the failure. [s]"""
    whole_stops: FloatArray
    """How often the line came to stop as a whole. [-]"""
    whole_stopped_s: FloatArray
    """How long it was stopped as a whole, in the year when that began. [s]"""


def estimate(values: FloatArray) -> Estimate:
    """
    Return the mean of independent years and how far to trust it.

    Parameters
    ----------
    values
        One per year, two or more. shape (n_years,)

    Returns
    -------
    Estimate
        Mean and half width of the 99 % interval, normal approximation. Same unit
    """
    width = NormalDist().inv_cdf(0.5 + 0.5 * CONFIDENCE)
    spread = float(values.std(ddof=1)) / math.sqrt(values.size)
    return Estimate(float(values.mean()), width * spread)


def simulate_outages(configuration: Configuration, years: int, seed: int) -> Outages:
    """
    Let the devices of a system fail and be repaired.

    Times to failure and times of repair are exponential; a device under repair cannot fail. A
    group of a fractional count is so many whole devices that fail less often. The line is stopped
    as a whole while the effects of all devices under repair add up to 1.

    Parameters
    ----------
    configuration
        Its devices.
    years
        How many years in a row. [-]
    seed
        Seed of the draws. [-]

    Returns
    -------
    Outages
        Year by year.
    """
    begins, ends, effects = [np.zeros(0)], [np.zeros(0)], [np.zeros(0)]
    for group in configuration.groups:
        whole = math.ceil(group.count)
        for number in range(whole):
            random = stream(seed, "outage", configuration.name, group.device, number)
            rate_per_s = group.failure_rate_per_s * group.count / whole
            begin_s, end_s = _repairs_s(random, rate_per_s, group.repair_s, years * YEAR_S)
            begins.append(begin_s)
            ends.append(end_s)
            effects.append(np.full(begin_s.size, group.effect))
    begin_s, end_s, effect = map(np.concatenate, (begins, ends, effects))
    whole_begin_s, whole_end_s = _whole_line_s(begin_s, end_s, effect)
    return Outages(
        failures=_by_year(begin_s, np.ones(begin_s.size), years),
        stopped_s=_by_year(begin_s, effect * (end_s - begin_s), years),
        whole_stops=_by_year(whole_begin_s, np.ones(whole_begin_s.size), years),
        whole_stopped_s=_by_year(whole_begin_s, whole_end_s - whole_begin_s, years),
    )


def _repairs_s(
    random: np.random.Generator, rate_per_s: float, repair_s: float, horizon_s: float
) -> tuple[FloatArray, FloatArray]:
    """Return when the repairs of one device begin and end, until the horizon. [s]"""
    if rate_per_s <= 0.0:
        return np.zeros(0), np.zeros(0)
    begins_s, ends_s, now_s = [], [], 0.0
    chunk = 1 + int(1.2 * horizon_s * rate_per_s)
    while now_s < horizon_s:
        up_s = random.exponential(1.0 / rate_per_s, chunk)
        down_s = random.exponential(repair_s, chunk)
        end_s = now_s + np.cumsum(up_s + down_s)
        begins_s.append(end_s - down_s)
        ends_s.append(end_s)
        now_s = float(end_s[-1])
    begin_s = np.concatenate(begins_s)
    within = begin_s < horizon_s
    return begin_s[within], np.concatenate(ends_s)[within]


def _whole_line_s(
    begin_s: FloatArray, end_s: FloatArray, effect: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return when the line is stopped as a whole: begins and ends. [s]"""
    times_s = np.concatenate([begin_s, end_s])
    order = np.argsort(times_s, kind="stable")
    times_s = times_s[order]
    stopped = np.cumsum(np.concatenate([effect, -effect])[order]) >= _WHOLE
    before = np.concatenate([[False], stopped[:-1]])
    return times_s[stopped & ~before], times_s[before & ~stopped]


def _by_year(begin_s: FloatArray, weight: FloatArray, years: int) -> FloatArray:
    year = (begin_s / YEAR_S).astype(np.intp)
    # A stop of the whole line may begin in a repair that outlasts the last year.
    inside = year < years
    sums = np.zeros(years)
    np.add.at(sums, year[inside], weight[inside])
    return sums
