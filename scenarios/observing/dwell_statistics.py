"""What dwells are like: quantiles, correlation along a trip, and dependence on the headway."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import atanh, ceil, floor, sqrt, tanh
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.scenarios.observing.observed_dwells import Dwell, DwellSample, clock_hour
from kankaku.scenarios.observing.visits import EventsError

LEAST_OF_STATION, LEAST_OF_HOUR = 10, 20
"""Dwells without which a station, or an hour at it, has no row of its own. [-]"""
MINIMUM_LEVEL = 0.1
"""Share of dwells that are shorter than what counts as the minimum dwell. [-]"""
SHOWN_LEVELS = (0.1, 0.25, 0.5, 0.75, 0.9)
_LEVELS = (*(step / 20 for step in range(20)), 0.98, 0.99, 1.0)
LEAST_BEYOND = 5
"""Dwells beyond a level without which that level says nothing. [-]"""
MOST_CORRELATION = 0.99
NORMAL_95 = 1.959964
"""Of a normal distribution, so many standard deviations to either side hold 95 %. [-]"""


class DwellGroup(NamedTuple):
    """Dwells of a station, at any time or in one hour."""

    station: str
    hour: int | None
    dwells: int
    quantiles_s: tuple[float, ...]
    """At ``SHOWN_LEVELS``. [s]"""
    minimum_s: float
    """What counts as the minimum dwell, whole seconds. [s]"""
    booked_s: float
    """What counts as booked, whole seconds. [s]"""
    delay_scale: float
    """Mean delay over that of all dwells. [-]"""


class Correlated(NamedTuple):
    """A coefficient with its interval of 95 %."""

    value: float
    low: float
    high: float
    pairs: int


class HeadwayDependence(NamedTuple):
    """How dwells grow with the interval to the train before."""

    station: str
    """Empty for all stations."""
    dwells: int
    slope: float
    """Seconds of dwell for a second of headway; stations differ by their medians only. [-]"""
    slope_error: float
    """Its standard error. [-]"""
    rank_correlation: float
    """Spearman's. [-]"""


@dataclass(frozen=True, slots=True)
class DwellStatistics:
    """Everything that a scenario needs of observed dwells, and what people want to know."""

    sample: DwellSample
    groups: tuple[DwellGroup, ...]
    """By station, all times first."""
    levels: tuple[float, ...]
    delays_s: tuple[float, ...]
    """Delays over the station's scale at each level, not falling. [s]"""
    cap_s: float
    """Longest delay that was seen. [s]"""
    correlation: Correlated
    headways: tuple[HeadwayDependence, ...]
    """All stations first; none if no headway is known."""


def dwell_statistics(sample: DwellSample) -> DwellStatistics:
    """
    Return what dwells are like.

    Parameters
    ----------
    sample
        The dwells.

    Returns
    -------
    DwellStatistics
        The statistics.

    Raises
    ------
    EventsError
        If no station has enough dwells.
    """
    grouped = _grouped(sample.dwells)
    if not grouped:
        told = f"no station has {LEAST_OF_STATION} dwells that were seen from beginning to end"
        raise EventsError((f"{told}; allowed: events of more trains",))
    own = _own_groups(sample.dwells, grouped)
    minima_s = {key: _minimum_s(sample.dwells, places) for key, places in grouped.items()}
    delays_s = {at: max(sample.dwells[at].dwell_s - minima_s[key], 0.0) for at, key in own.items()}
    mean_s = float(np.mean([*delays_s.values()]))
    scales = {
        key: _scale(sample.dwells, places, minima_s[key], mean_s) for key, places in grouped.items()
    }
    levels, quantiles_s = _quantiles(
        np.array([delay_s / scales[own[at]] for at, delay_s in delays_s.items() if scales[own[at]]])
    )
    groups = [
        _group(sample.dwells, key, places, minima_s[key], scales[key])
        for key, places in grouped.items()
    ]
    return DwellStatistics(
        sample,
        tuple(groups),
        levels,
        quantiles_s,
        float(ceil(max(delays_s.values()))),
        _correlation(sample.dwells, own),
        tuple(_headways(sample.dwells, own)),
    )


_Key = tuple[str, int | None]


def _grouped(dwells: Sequence[Dwell]) -> dict[_Key, list[int]]:
    """Return places of dwells by station, and by station and hour where there are enough."""
    found: dict[_Key, list[int]] = {}
    for station in dict.fromkeys(dwell.station for dwell in dwells):
        places = [at for at, dwell in enumerate(dwells) if dwell.station == station]
        if len(places) < LEAST_OF_STATION:
            continue
        found[station, None] = places
        for hour in sorted({clock_hour(dwells[at]) for at in places}):
            of_hour = [at for at in places if clock_hour(dwells[at]) == hour]
            if LEAST_OF_HOUR <= len(of_hour) < len(places):
                found[station, hour] = of_hour
    return found


def _own_groups(dwells: Sequence[Dwell], grouped: Mapping[_Key, Sequence[int]]) -> dict[int, _Key]:
    """Return the group whose row holds for each dwell."""
    own: dict[int, _Key] = {}
    for at, dwell in enumerate(dwells):
        of_hour = dwell.station, clock_hour(dwell)
        key: _Key = of_hour if of_hour in grouped else (dwell.station, None)
        if key in grouped:
            own[at] = key
    return own


def _minimum_s(dwells: Sequence[Dwell], places: Sequence[int]) -> float:
    return float(floor(np.quantile([dwells[at].dwell_s for at in places], MINIMUM_LEVEL)))


def _scale(
    dwells: Sequence[Dwell], places: Sequence[int], minimum_s: float, mean_s: float
) -> float:
    delays_s = [max(dwells[at].dwell_s - minimum_s, 0.0) for at in places]
    return round(float(np.mean(delays_s)) / mean_s, 3) if mean_s else 0.0


def _quantiles(delays_s: FloatArray) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return levels, rising from 0 to 1, and the delay at each, in tenths of a second."""
    if not delays_s.size:
        return (0.0, 1.0), (0.0, 0.0)
    levels = tuple(
        level
        for level in _LEVELS
        if level in {0.0, 1.0} or min(level, 1.0 - level) * delays_s.size >= LEAST_BEYOND
    )
    return levels, tuple(round(float(delay_s), 1) for delay_s in np.quantile(delays_s, levels))


def _group(
    dwells: Sequence[Dwell], key: _Key, places: Sequence[int], minimum_s: float, scale: float
) -> DwellGroup:
    lengths_s = [dwells[at].dwell_s for at in places]
    booked_s = [known for at in places if (known := dwells[at].booked_s) is not None]
    usual_s = float(round(float(np.median(booked_s or lengths_s))))
    quantiles_s = tuple(map(float, np.quantile(lengths_s, SHOWN_LEVELS)))
    booked = max(usual_s, minimum_s)
    return DwellGroup(*key, len(places), quantiles_s, minimum_s, booked, scale)


def _ranks(values: FloatArray) -> FloatArray:
    """Return ranks from 1; equal values share the mean of theirs."""
    _, inverse, counts = np.unique(values, return_inverse=True, return_counts=True)
    ends = np.cumsum(counts)
    ranks: FloatArray = (ends - (counts - 1) / 2.0)[inverse]
    return ranks


def _correlation(dwells: Sequence[Dwell], own: Mapping[int, _Key]) -> Correlated:
    """
    Return the correlation of normal scores between successive stations of a train.

    That is what ``trip_correlation`` of a scenario means. Scores are worked out within each group,
    so that a station or an hour of long dwells does not count as correlation.
    """
    from scipy.special import ndtri  # noqa: PLC0415 - takes long to import

    scores = np.full(len(dwells), np.nan)
    for key in dict.fromkeys(own.values()):
        places = [at for at, group in own.items() if group == key]
        if len(places) >= LEAST_OF_STATION:
            ranks = _ranks(np.array([dwells[at].dwell_s for at in places]))
            scores[places] = ndtri((ranks - 0.5) / len(places))
    pairs = [(dwell.before, at) for at, dwell in enumerate(dwells) if dwell.before >= 0]
    found = np.array([(scores[one], scores[other]) for one, other in pairs]).reshape(-1, 2)
    found = found[np.isfinite(found).all(axis=1)]
    count = len(found)
    if count < LEAST_OF_STATION or np.ptp(found, axis=0).min() <= 0.0:
        return Correlated(0.0, -1.0, 1.0, count)
    value = float(np.corrcoef(found.T)[0, 1])
    value = min(max(value, -MOST_CORRELATION), MOST_CORRELATION)
    away = NORMAL_95 / sqrt(count - 3)
    return Correlated(value, tanh(atanh(value) - away), tanh(atanh(value) + away), count)


def _headways(dwells: Sequence[Dwell], own: Mapping[int, _Key]) -> list[HeadwayDependence]:
    by_group: dict[_Key, list[float]] = {}
    for at, key in own.items():
        by_group.setdefault(key, []).append(dwells[at].dwell_s)
    medians_s = {key: float(np.median(lengths_s)) for key, lengths_s in by_group.items()}
    points: dict[str, list[tuple[float, float]]] = {"": []}
    for at, key in own.items():
        headway_s = dwells[at].headway_s
        if headway_s is not None:
            point = headway_s, dwells[at].dwell_s - medians_s[key]
            points[""].append(point)
            points.setdefault(dwells[at].station, []).append(point)
    return [
        _dependence(station, np.array(own_points))
        for station, own_points in points.items()
        if len(own_points) >= LEAST_OF_HOUR
    ]


def _dependence(station: str, points: FloatArray) -> HeadwayDependence:
    headway_s, beyond_s = points.T
    from_mean_s = headway_s - headway_s.mean()
    spread = float(from_mean_s @ from_mean_s)
    if spread <= 0.0 or np.ptp(beyond_s) <= 0.0:
        return HeadwayDependence(station, len(points), 0.0, 0.0, 0.0)
    slope = float(from_mean_s @ beyond_s) / spread
    rest = beyond_s - beyond_s.mean() - slope * from_mean_s
    error = sqrt(float(rest @ rest) / (len(points) - 2) / spread)
    ranked = np.corrcoef(_ranks(headway_s), _ranks(beyond_s))[0, 1]
    return HeadwayDependence(station, len(points), slope, error, float(ranked))
