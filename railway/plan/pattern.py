"""
The busiest hour of a timetable, and the pattern that most of its trains have.

Capacity is asked for at the peak: what a line carries is what it carries when most trains run,
with the dwells that are booked then.

References
----------
.. [1] UIC Code 406, *Capacity*, 2nd edition, 2013: occupation is told for the peak hour, too.
"""

from collections import Counter
from typing import NamedTuple, TypeAlias

from kankaku.railway.plan.timetable import Service, Timetable

BUSIEST_S = 3600.0
"""Length of the busiest time. [s]"""

Pattern: TypeAlias = tuple[str, tuple[str, ...], tuple[tuple[str, str], ...]]
"""Type of train, tracks, and stations with platform tracks of the calls."""


class BusiestHour(NamedTuple):
    """The 60 minutes in which most trains reach the end of their journeys."""

    begin_s: float
    """Last arrival of its first train; the hour ends just before the same an hour later. [s]"""
    rows: tuple[int, ...]
    """Its trains, in the order of the timetable."""


class PeakPattern(NamedTuple):
    """The most frequent pattern of the busiest hour, and the train that stands for it."""

    hour: BusiestHour
    row: int
    """The train with the median of the booked dwells."""
    rows: tuple[int, ...]
    """The trains of the hour that have the pattern, in the order of the timetable."""


def pattern_of(service: Service) -> Pattern:
    """
    Return what two trains must share so that a headway is the same for both but for dwells.

    Parameters
    ----------
    service
        A train.

    Returns
    -------
    Pattern
        Its pattern.
    """
    calls = tuple((call.station, call.track) for call in service.calls)
    return service.train_type, service.route, calls


def total_dwell_s(service: Service) -> float:
    """
    Return the booked dwells of a train together.

    Parameters
    ----------
    service
        The train.

    Returns
    -------
    float
        Of all calls but the first, where it only gets ready. [s]
    """
    return sum(call.departure_s - call.arrival_s for call in service.calls[1:])


def busiest_hour(timetable: Timetable) -> BusiestHour | None:
    """
    Return the busiest hour of a timetable.

    Every train runs to the end of the line, so that all of them count there.

    Parameters
    ----------
    timetable
        The timetable.

    Returns
    -------
    BusiestHour | None
        From the booked arrival at a last call on that most others follow within the hour; of
        equals the first. Only hours count in which a train calls twice; None if there are none.
    """
    services = timetable.services
    ends = sorted((service.calls[-1].arrival_s, row) for row, service in enumerate(services))
    best, last = (0, 0), 0
    for first, (begin_s, _) in enumerate(ends):
        while last < len(ends) and ends[last][0] < begin_s + BUSIEST_S:
            last += 1
        runs = any(_calls_twice(services[row]) for _, row in ends[first:last])
        if runs and last - first > best[1] - best[0]:
            best = first, last
    inside = ends[slice(*best)]
    return BusiestHour(inside[0][0], tuple(sorted(row for _, row in inside))) if inside else None


def peak_pattern(timetable: Timetable) -> PeakPattern | None:
    """
    Return the pattern that both trains of a headway have.

    Parameters
    ----------
    timetable
        The timetable.

    Returns
    -------
    PeakPattern | None
        The most frequent one of the busiest hour, of equals the one with more calls, then that
        of the first train. The train that stands for it has the median of the booked dwells of
        all calls but the first, the lower one of two, of equals the first train. None if no
        train calls twice.
    """
    hour = busiest_hour(timetable)
    if hour is None:
        return None
    services = timetable.services
    counts = Counter(pattern_of(services[row]) for row in hour.rows if _calls_twice(services[row]))
    most = max(counts, key=lambda pattern: (counts[pattern], len(pattern[2])))
    rows = tuple(row for row in hour.rows if pattern_of(services[row]) == most)
    by_dwell = sorted(rows, key=lambda row: total_dwell_s(services[row]))
    return PeakPattern(hour, by_dwell[(len(rows) - 1) // 2], rows)


def _calls_twice(service: Service) -> bool:
    return len(service.calls) > 1
