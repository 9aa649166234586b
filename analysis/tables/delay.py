"""
Delay of every call, and how it splits into primary and secondary.

The *unhindered* run of a train is its trip with its own injected dwell delays and its own
booked slack, but no other train on the line: from its origin it departs at
``max(booked departure, arrival + minimum dwell + injected delay)`` and reaches the next
call after the run time of its driving style, which may be shorter if it departs late. *Lateness*
is a delay where positive, else 0. One that takes over the stock of another train begins when the
unhindered run of that one ends.
The lateness of an arrival is then, exactly,

    lateness = unhindered lateness + secondary delay.

A train alone on the line therefore has no secondary delay however late it makes itself,
and a train that uses its running-time supplement without getting late has none either.

A call that was not reached when the run ended is late at least by the time since its booking:
a train that never arrives makes no indicator lower.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd

from kankaku.analysis.tables.interstation import SHORTEST_STOP_S
from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.motion.run_times import run_times_s
from kankaku.railway.plan.world import World

AFFECTED_S = 10.0
"""A train is affected when others made it later than this at any call. [s]"""
RECOVERED_S = 60.0
"""The line is disturbed while arrivals or departures are later than this. [s]"""


class Propagation(NamedTuple):
    """How far delay spread from the trains that caused it."""

    primary_delay_s: float
    """Sum over all calls. [s]"""
    secondary_delay_s: float
    """Sum over trains, each at its last call. [s]"""
    ratio: float
    """Secondary over primary delay; nan without primary delay. [-]"""
    trains_affected: int
    """Trains with a secondary delay above ``AFFECTED_S`` at any call. [-]"""
    recovery_time_s: float
    """From the first to the last event later than ``RECOVERED_S``. [s]"""


def technical_run_times_s(world: World) -> FloatArray:
    """
    Return the run time to each call from the one before, by the line and how trains are driven.

    Parameters
    ----------
    world
        Line, fleet and timetable.

    Returns
    -------
    FloatArray
        From when the train may depart to its standstill, nobody in its way; nan at origins and
        past the last call. First if it is not late, then if it is.
        [s], shape (2, n_trains, n_calls_max)
    """
    unhurried_s = run_times_s(world, world.unhurried_profile)
    if not world.driving.hurries:
        return np.array([unhurried_s, unhurried_s])
    return np.array([unhurried_s, run_times_s(world, world.driven_profile)])


def unhindered_arrivals_s(
    world: World, dwell_delay_s: FloatArray, run_times_s: FloatArray
) -> FloatArray:
    """
    Return when each train would arrive with its own dwell delays but no other train.

    Parameters
    ----------
    world
        Line, fleet and timetable.
    dwell_delay_s
        Injected delay beyond the minimum dwell. [s], shape (n_trains, n_calls_max)
    run_times_s
        Run times to each call from the one before, as :func:`technical_run_times_s` gives them.
        [s], broadcastable to (2, n_trains, n_calls_max)

    Returns
    -------
    FloatArray
        Arrivals, nan past a train's last call. [s], shape (n_trains, n_calls_max)
    """
    calls = dwell_delay_s.shape[1]
    run_times_s = np.broadcast_to(run_times_s, (2, *dwell_delay_s.shape))
    arrival_s = np.full(dwell_delay_s.shape, np.nan)
    dwell_s = world.minimum_dwell_s[:, :calls] + dwell_delay_s
    last, stock_from = world.call_count - 1, world.stock_from
    # Whoever takes over stock comes after the train that brings it.
    turn = _turns(stock_from)
    for number in range(int(turn.max()) + 1):
        rows = np.flatnonzero(turn == number)
        arrival_s[rows, 0] = world.booked_arrival_s[rows, 0]
        if number:
            stock = stock_from[rows]
            ready_s = arrival_s[stock, last[stock]] + dwell_s[stock, last[stock]]
            arrival_s[rows, 0] = np.maximum(world.booked_departure_s[stock, last[stock]], ready_s)
        for column in range(1, calls):
            ready_s = arrival_s[rows, column - 1] + dwell_s[rows, column - 1]
            departure_s = np.maximum(world.booked_departure_s[rows, column - 1], ready_s)
            late_s = departure_s - world.booked_departure_s[rows, column - 1]
            late = (late_s > world.driving.late_after_s).astype(np.intp)
            arrival_s[rows, column] = departure_s + run_times_s[late, rows, column]
    booked = np.arange(calls) < world.call_count[:, np.newaxis]
    return np.where(booked, arrival_s, np.nan)


def _turns(stock_from: IntArray) -> IntArray:
    """Return how many trains the stock of each train has worked before. shape (n_trains,)"""
    turn = np.zeros(stock_from.size, dtype=np.intp)
    stock = stock_from.copy()
    while (stock >= 0).any():
        turn += stock >= 0
        stock = np.where(stock >= 0, stock_from[stock], -1)
    return turn


def primary_delay_s(
    booked_arrival_s: FloatArray,
    booked_departure_s: FloatArray,
    minimum_dwell_s: FloatArray,
    dwell_delay_s: FloatArray,
) -> FloatArray:
    """
    Return the injected dwell delay that the booked dwell does not absorb.

    Parameters
    ----------
    booked_arrival_s, booked_departure_s
        Booked times. [s], any shape
    minimum_dwell_s
        Minimum dwell. [s], same shape
    dwell_delay_s
        Injected delay beyond the minimum dwell. [s], same shape

    Returns
    -------
    FloatArray
        ``max(0, minimum + injected - booked dwell)``, but never more than was injected:
        a minimum above the booked dwell is the timetable's, not the input's. [s], same shape
    """
    slack_s = booked_departure_s - booked_arrival_s - minimum_dwell_s
    return np.clip(dwell_delay_s - np.maximum(slack_s, 0.0), 0.0, None)


def closed_doors_s(over_s: FloatArray, departure_s: FloatArray) -> FloatArray:
    """
    Return how long trains stood at their platforms after their stops were over.

    Parameters
    ----------
    over_s
        When the stops were over. [s], any shape
    departure_s
        When the trains departed, the drivers' reaction taken off; not a number where they never
        did. [s], same shape

    Returns
    -------
    FloatArray
        Whoever kept them there; 0 where it is shorter than a stop between stations has to be.
        [s], same shape
    """
    waited_s = np.nan_to_num(departure_s - over_s, nan=0.0)
    return np.where(waited_s >= SHORTEST_STOP_S, waited_s, 0.0)


def delay_s(actual_s: FloatArray, booked_s: FloatArray, end_s: float) -> FloatArray:
    """
    Return delays; of what had not happened when the run ended, at least what it was then.

    Parameters
    ----------
    actual_s
        Actual times, nan if never. [s], any shape
    booked_s
        Booked times. [s], same shape
    end_s
        When the run ended; nan where nobody knows. [s]

    Returns
    -------
    FloatArray
        Actual minus booked; nan where it never happened and was not due yet. [s], same shape
    """
    overdue_s = end_s - booked_s
    never = np.isnan(actual_s)
    delays_s: FloatArray = np.where(never, overdue_s, actual_s - booked_s)
    return np.where(never & ~(overdue_s > 0.0), np.nan, delays_s)


def secondary_delay_s(
    arrival_s: FloatArray, unhindered_s: FloatArray, booked_s: FloatArray, end_s: float = np.nan
) -> FloatArray:
    """
    Return the lateness that a train owes to others.

    Parameters
    ----------
    arrival_s
        Actual arrival, nan if never. [s], any shape
    unhindered_s
        Arrival of the unhindered run. [s], same shape
    booked_s
        Booked arrival. [s], same shape
    end_s
        When the run ended; nan where nobody knows. [s]

    Returns
    -------
    FloatArray
        Lateness beyond that of the unhindered run. If never arrived, what of it there was when
        the run ended; nan if it was not due then. [s], same shape
    """
    late_s = np.maximum(delay_s(arrival_s, booked_s, end_s), 0.0)
    others_s = late_s - np.maximum(unhindered_s - booked_s, 0.0)
    return np.where(np.isnan(arrival_s), np.maximum(others_s, 0.0), others_s)


def propagation(calls: pd.DataFrame) -> Propagation:
    """
    Return how far delay spread.

    Parameters
    ----------
    calls
        The table ``calls`` of one run.

    Returns
    -------
    Propagation
        Sums over the run. A line still late when the run ends counts up to then.
    """
    reached = calls.dropna(subset=["secondary_delay_s"])
    by_train = reached.groupby("train", sort=False)["secondary_delay_s"]
    primary_s = float(calls["primary_delay_s"].sum())
    secondary_s = float(by_train.last().sum())
    return Propagation(
        primary_delay_s=primary_s,
        secondary_delay_s=secondary_s,
        ratio=secondary_s / primary_s if primary_s > 0.0 else np.nan,
        trains_affected=int((by_train.max() > AFFECTED_S).sum()),
        recovery_time_s=_recovery_time_s(calls),
    )


def _recovery_time_s(calls: pd.DataFrame) -> float:
    booked_s = calls[["booked_arrival_s", "booked_departure_s"]].to_numpy()
    delays_s = calls[["arrival_delay_s", "departure_delay_s"]].to_numpy()
    # Of what never happened this is the end of the run.
    events_s = np.round(booked_s + delays_s, 3)
    late_s = events_s[delays_s > RECOVERED_S]
    return float(np.ptp(late_s)) if late_s.size else 0.0
