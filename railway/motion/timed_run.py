"""A run that takes a given time: levels of the fastest one are cut until it does."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple, TypeAlias

import numpy as np

from kankaku.railway.motion.climbing import climbing_floor
from kankaku.railway.motion.driving import Driving, Trace, trace
from kankaku.railway.motion.run_curve import (
    LONGEST_S,
    ONE_LEVEL_MPS,
    SLOWEST_MPS,
    SPEED_TOLERANCE_MPS,
    TIME_TOLERANCE_S,
    RunCurve,
    RunTimeError,
    curve_of,
    fastest,
    way_between,
)
from kankaku.railway.motion.way import Way
from kankaku.railway.plan.buffers import Buffers
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.profile import NO_BUFFERS
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.roots import root_of

Cut: TypeAlias = Callable[[float], Driving]
"""One operation: 1 leaves the drive as it is, 0 carries the operation out to its end."""
LEAST_SHARE = 1e-3
"""Part of an operation that is left undone lest it bring the train to a stand. [-]"""


def timed(way: Way, run_time_s: float) -> RunCurve:
    """
    Return the run along a way that takes a given time.

    From the fastest run on, repeat: shorten the cruising of the section that cruises
    fastest (operation 1); or lower the highest speed from which a section coasts, not below
    the speeds of other sections (operation 2). Sections whose coasting has become one are
    joined. The last operation is a search in its one variable.

    Parameters
    ----------
    way
        The way.
    run_time_s
        The time. [s]

    Returns
    -------
    RunCurve
        The curve.

    Raises
    ------
    RunTimeError
        If the time is shorter than the fastest run, or longer than coasting can make it.
    StallError
        If a gradient is too steep to climb.
    """
    quickest = fastest(way)
    shortest_s = longest_s = quickest.run_time_s
    if run_time_s < shortest_s - TIME_TOLERANCE_S:
        message = f"a run of {run_time_s:.2f} s is not possible: the fastest takes {shortest_s:.2f}"
        raise RunTimeError(message)
    for under, cut, slower_s in _cuts(way):
        if slower_s >= run_time_s:
            found = trace(under, cut(_share(under, cut, run_time_s)))
            if abs(found.run_time_s - run_time_s) <= TIME_TOLERANCE_S:
                return curve_of(way, found)
            break
        longest_s = slower_s
    if run_time_s <= shortest_s + TIME_TOLERANCE_S:
        return quickest
    slowed = _slowed(way, quickest, run_time_s)
    if slowed is not None:
        return curve_of(way, slowed)
    message = (
        f"a run of {run_time_s:.2f} s is not possible: coasting makes it {longest_s:.2f} at most"
    )
    raise RunTimeError(message)


def _slowed(way: Way, quickest: RunCurve, run_time_s: float) -> Trace | None:
    """Return a slower run where coasting would bring the train to a stand before a summit."""
    floor = climbing_floor(way, 0.5 * np.square(quickest.speed_mps))
    if floor.max() <= 0.0:
        return None
    under = replace(way, floor_m2ps2=np.maximum(way.floor_m2ps2, floor))

    def below(top_mps: float) -> Trace:
        slower = under.no_faster(top_mps)
        return trace(slower, Driving.fastest(slower))

    def late_s(top_mps: float) -> float:
        return min(below(top_mps).run_time_s, LONGEST_S) - run_time_s

    fastest_mps = float(quickest.speed_mps.max())
    if late_s(SLOWEST_MPS) < 0.0 or late_s(fastest_mps) > 0.0:
        return None
    return below(root_of(late_s, SLOWEST_MPS, fastest_mps, xtol=1e-6))


def _share(way: Way, cut: Cut, run_time_s: float) -> float:
    """Return how much of an operation is left undone when the run takes a given time."""

    def late_s(share: float) -> float:
        return min(trace(way, cut(share)).run_time_s, LONGEST_S) - run_time_s

    if late_s(1.0) >= 0.0:
        return 1.0
    share: float = root_of(late_s, 0.0, 1.0, xtol=1e-9, rtol=1e-9)
    return share


class _Level(NamedTuple):
    """What keeps a section fast: a speed that it cruises at or coasts from."""

    speed_mps: float
    cruises: bool
    section: int


def _cuts(way: Way) -> Iterator[tuple[Way, Cut, float]]:
    """
    Yield one operation after the other, each from where the one before has ended.

    Each comes with the run time at its end, and with the way under the speeds of the one
    before, so that a section that has to speed up again coasts where it did, and nothing that
    makes a run slower makes it faster elsewhere.
    """
    drive = Driving.fastest(way)
    seen = trace(way, drive)
    done: set[int] = set()
    while True:
        way = replace(way, cap_m2ps2=seen.energy_m2ps2)
        drive = _join(drive, seen)
        levels = _levels(drive, seen, done)
        if not levels or not np.isfinite(seen.run_time_s):
            return
        tied_mps = max(level.speed_mps for level in levels) - ONE_LEVEL_MPS
        tied = [level for level in levels if level.speed_mps >= tied_mps]
        highest = max(tied, key=lambda level: (level.cruises, level.section))
        below_mps = highest.speed_mps - ONE_LEVEL_MPS
        lower = [level.speed_mps for level in levels if level.speed_mps < below_mps]
        least = max([*lower, float(seen.entry_mps[highest.section]), SLOWEST_MPS])
        cut = _shorten(drive, seen, highest) if highest.cruises else _lower(drive, highest, least)
        drive = cut(0.0)
        seen = trace(way, drive)
        if not np.isfinite(seen.run_time_s):
            cut = _without_standing(way, cut)
            done.add(highest.section)
            drive = cut(0.0)
            seen = trace(way, drive)
        yield way, cut, seen.run_time_s


def _without_standing(way: Way, cut: Cut) -> Cut:
    """Return an operation only as far as it does not bring the train to a stand."""
    stands, runs = 0.0, 1.0
    while runs - stands > LEAST_SHARE:
        middle = 0.5 * (stands + runs)
        if np.isfinite(trace(way, cut(middle)).run_time_s):
            runs = middle
        else:
            stands = middle
    return lambda share: cut(runs + share * (1.0 - runs))


def _levels(drive: Driving, seen: Trace, done: set[int]) -> list[_Level]:
    """Return what can be cut."""
    found = []
    for section in range(drive.target_mps.size):
        if drive.through[section] or section in done:
            continue
        if seen.cruised_m[section] > 0.0:
            found.append(_Level(float(drive.target_mps[section]), True, section))
        elif (
            seen.peak_mps[section] > max(seen.entry_mps[section], SLOWEST_MPS) + SPEED_TOLERANCE_MPS
        ):
            found.append(_Level(float(seen.peak_mps[section]), False, section))
    return found


def _join(drive: Driving, seen: Trace) -> Driving:
    """Join sections that coast from where they begin to those before: no more speeding up."""
    coasts_on = (drive.cruise_m <= 0.0) & (seen.peak_mps <= seen.entry_mps + SPEED_TOLERANCE_MPS)
    return drive._replace(through=drive.through | coasts_on)


def _shorten(drive: Driving, seen: Trace, level: _Level) -> Cut:
    """Operation 1: shorten the cruising of a section."""

    def cut(share: float) -> Driving:
        cruise_m = drive.cruise_m.copy()
        cruise_m[level.section] = share * seen.cruised_m[level.section]
        return drive._replace(cruise_m=cruise_m)

    return cut


def _lower(drive: Driving, level: _Level, least_mps: float) -> Cut:
    """Operation 2: lower the speed from which a section coasts."""

    def cut(share: float) -> Driving:
        target_mps, cruise_m = drive.target_mps.copy(), drive.cruise_m.copy()
        target_mps[level.section] = least_mps + share * (level.speed_mps - least_mps)
        cruise_m[level.section] = 0.0
        return drive._replace(target_mps=target_mps, cruise_m=cruise_m)

    return cut


def timed_run(  # noqa: PLR0913 - one argument per figure of a run
    line: Line,
    train_type: TrainType,
    start_m: float,
    stop_m: float,
    run_time_s: float,
    *,
    start_mps: float = 0.0,
    stop_mps: float = 0.0,
    buffers: Buffers = NO_BUFFERS,
) -> RunCurve:
    """
    Return the run between two places that takes a given time, coasting as much as it can.

    Parameters
    ----------
    line
        The line.
    train_type
        The train.
    start_m, stop_m
        Where the front starts and stops. [m]
    run_time_s
        The time, met within ``TIME_TOLERANCE_S``. [s]
    start_mps, stop_mps
        Speeds there; that at the stop is not exceeded. [m/s]
    buffers
        By how much the train counts as longer than it is where limits start and end.

    Returns
    -------
    RunCurve
        The curve.

    Raises
    ------
    RunTimeError
        If the fastest run takes longer, or the slowest run by coasting is faster. Where coasting
        would end before a summit, the train runs at a lower speed instead.
    ValueError
        As :func:`fastest_run`.

    References
    ----------
    .. [1] Sakai et al. 2020, section 3.2: operations 1 and 2.
    """
    way = way_between(line, train_type, (start_m, stop_m), (start_mps, stop_mps), buffers)
    return timed(way, run_time_s)
