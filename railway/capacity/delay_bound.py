"""
The earliest arrivals that any control could reach over a protection: a bound of delay.

Given are the dwell delays and the order in which trains come to each platform. A train departs when
it is booked to and ready, never sooner; it runs as fast as its drivers do, in the style of a late
train or not as it did; and it does not arrive before the least interval after the train ahead may
have left the platform. Each event takes the latest of what it waits for, so that the events of a
day follow by a recursion in max-plus algebra [1]_. What else may keep trains apart is left out: the
bound may be lower than what can be reached, but no run is below it.

References
----------
.. [1] Goverde, *Railway timetable stability analysis using max-plus system theory*,
   Transportation Research B 41, 2007.
"""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.capacity.least_interval import LeastIntervals, Pair
from kankaku.railway.compiled import compiled
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight
from kankaku.railway.step.records import RunRecord

EDGE_STEPS = 1.5
"""Who departs so many steps before it counts as late may have hurried already. [-]"""


class PlatformOrder(NamedTuple):
    """Who comes to platforms in which order; arrays of shape (n_events,), first arrival first."""

    row: IntArray
    """The train."""
    call: IntArray
    """Its call."""
    before: IntArray
    """The train before it at the same platform track; -1 for none."""
    left: IntArray
    """The call of that one there; -1 for none."""


def platform_order(world: World, arrival_s: FloatArray) -> PlatformOrder:
    """
    Return who comes after whom at each platform track.

    Parameters
    ----------
    world
        Line, fleet and timetable.
    arrival_s
        Actual arrivals; a call that was not reached comes last, in the order of the timetable.
        [s], shape (n_trains, n_calls_max)

    Returns
    -------
    PlatformOrder
        All calls of all trains.
    """
    calls = arrival_s.shape[1]
    rows, columns = np.nonzero(np.arange(calls) < world.call_count[:, np.newaxis])
    times_s, booked_s = arrival_s[rows, columns], world.booked_arrival_s[rows, columns]
    never = np.isnan(times_s)
    # Stock that arrives comes before the train that goes on with it at the same moment.
    origin = columns == 0
    order = np.lexsort((origin, booked_s, np.where(never, booked_s, times_s), never))
    rows, columns = rows[order], columns[order]
    before, left = np.full(rows.size, -1), np.full(rows.size, -1)
    last: dict[str, int] = {}
    services = world.timetable.services
    for event, (row, column) in enumerate(zip(rows.tolist(), columns.tolist(), strict=True)):
        track = services[row].calls[column].track
        place = f"{services[row].calls[column].station} {world.line.track_by_id[track].physical}"
        if place in last:
            before[event], left[event] = rows[last[place]], columns[last[place]]
        last[place] = event
    return PlatformOrder(rows, columns, before, left)


def least_intervals_s(
    world: World, order: PlatformOrder, foresight: Foresight | None
) -> FloatArray:
    """
    Return how long after the train before may have departed each train can arrive.

    Parameters
    ----------
    world
        Line, fleet and timetable.
    order
        Who comes after whom.
    foresight
        What the protection permits; None where nobody knows.

    Returns
    -------
    FloatArray
        0 where nobody comes before, at origins, and without a protection that is known: no two
        trains stand at one place. [s], shape (n_events,)
    """
    found_s = np.zeros(order.row.size)
    if foresight is None:
        return found_s
    intervals = LeastIntervals(world, foresight)
    for event in np.flatnonzero((order.before >= 0) & (order.call > 0)).tolist():
        pair = Pair(*(int(field[event]) for field in (order.before, order.left, *order[:2])))
        found_s[event] = intervals.of(pair)
    return found_s


def run_times_as_driven_s(
    world: World,
    times_s: tuple[FloatArray, FloatArray],
    dwell_delay_s: FloatArray,
    run_times_s: FloatArray,
) -> FloatArray:
    """
    Return the least run time to each call, every leg driven as it was: hurried or not.

    Theory and engine differ by a tenth of a second a leg or so. Where the fastest train of the
    run needed less than the theory says, so much counts.

    Parameters
    ----------
    world
        Line, fleet and timetable.
    times_s
        Actual arrivals and departures. [s], shape (n_trains, n_calls_max) each
    dwell_delay_s
        Injected delay beyond the minimum dwell. [s], shape (n_trains, n_calls_max)
    run_times_s
        Run times to each call from the one before, of trains that are not late and of those that
        are. [s], broadcastable to (2, n_trains, n_calls_max)

    Returns
    -------
    FloatArray
        From when the train may depart; of a leg that was not run, that of a late train; nan at
        origins. [s], shape (n_trains, n_calls_max)
    """
    shape = dwell_delay_s.shape
    booked_s = world.booked_departure_s[:, : shape[1]]
    arrival_s, departure_s = times_s
    # Departures are known to a step, and who is on the edge counts as the faster.
    late_s = world.driving.late_after_s - EDGE_STEPS * world.step_s
    late = np.ones(shape, dtype=np.intp)
    late[:, 1:] = ~(departure_s - booked_s <= late_s)[:, :-1]
    unhurried_s, hurried_s = np.broadcast_to(run_times_s, (2, *shape))
    driven_s = np.where(late > 0, hurried_s, unhurried_s)
    ready_s = np.maximum(booked_s, arrival_s + world.minimum_dwell_s[:, : shape[1]] + dwell_delay_s)
    rows, calls = np.nonzero(np.isfinite(arrival_s[:, 1:] - ready_s[:, :-1]))
    took_s = arrival_s[rows, calls + 1] - ready_s[rows, calls]
    legs = np.column_stack(
        [
            world.type_index[rows],
            world.stop_m[rows, calls],
            world.stop_m[rows, calls + 1],
            late[rows, calls + 1],
        ]
    )
    which = np.unique(legs, axis=0, return_inverse=True)[1].ravel()
    fastest_s = np.full(rows.size, np.inf)
    np.minimum.at(fastest_s, which, took_s)
    least_s: FloatArray = driven_s.copy()
    least_s[rows, calls + 1] = np.minimum(driven_s[rows, calls + 1], fastest_s[which])
    return least_s


def earliest_arrivals_s(
    world: World,
    dwell_delay_s: FloatArray,
    run_times_s: FloatArray,
    order: PlatformOrder,
    interval_s: FloatArray,
) -> FloatArray:
    """
    Return when each train can arrive at the earliest.

    Parameters
    ----------
    world
        Line, fleet and timetable.
    dwell_delay_s
        Injected delay beyond the minimum dwell. [s], shape (n_trains, n_calls_max)
    run_times_s
        Run times to each call from the one before. [s], shape (n_trains, n_calls_max)
    order
        Who comes after whom at platforms.
    interval_s
        From when the train before may depart to the arrival, at least. [s], shape (n_events,)

    Returns
    -------
    FloatArray
        Arrivals, nan past a train's last call. [s], shape (n_trains, n_calls_max)
    """
    calls = dwell_delay_s.shape[1]
    return _propagated(
        (order.row, order.call, order.before, order.left),
        interval_s,
        (world.booked_arrival_s[:, :calls], world.booked_departure_s[:, :calls]),
        world.minimum_dwell_s[:, :calls] + dwell_delay_s,
        run_times_s,
        (world.stock_from, world.call_count),
    )


@compiled
def _propagated(
    order: tuple[IntArray, IntArray, IntArray, IntArray],
    interval_s: FloatArray,
    booked_s: tuple[FloatArray, FloatArray],
    dwell_s: FloatArray,
    run_times_s: FloatArray,
    stock: tuple[IntArray, IntArray],
) -> FloatArray:
    (rows, calls, before, left), (booked_arrival_s, booked_departure_s) = order, booked_s
    stock_from, call_count = stock
    arrival_s, departure_s = np.full_like(dwell_s, np.nan), np.full_like(dwell_s, np.nan)
    for event in range(rows.size):
        row, call = rows[event], calls[event]
        bringer = stock_from[row]
        if call > 0:
            earliest_s = departure_s[row, call - 1] + run_times_s[row, call]
        elif bringer >= 0:
            earliest_s = departure_s[bringer, call_count[bringer] - 1]
        else:
            earliest_s = booked_arrival_s[row, 0]
        if before[event] >= 0:
            clear_s = departure_s[before[event], left[event]] + interval_s[event]
            earliest_s = max(earliest_s, clear_s)
        arrival_s[row, call] = earliest_s
        ready_s = earliest_s + dwell_s[row, call]
        departure_s[row, call] = max(ready_s, booked_departure_s[row, call])
    return arrival_s


def arrival_bounds_s(record: RunRecord, run_times_s: FloatArray) -> FloatArray:
    """
    Return before when no control over the protection of a run could have let its trains arrive.

    Parameters
    ----------
    record
        The run; without its foresight only one train at a time stands at a platform.
    run_times_s
        Run times to each call from the one before, of trains that are not late and of those that
        are. [s], broadcastable to (2, n_trains, n_calls_max)

    Returns
    -------
    FloatArray
        With its dwell delays, trains in its order at every platform, each leg driven as hurried
        as it was; nan past a train's last call. [s], shape (n_trains, n_calls_max)
    """
    world, delays_s = record.world, record.dwell_delay_s
    times_s = record.arrival_s, record.departure_s
    driven_s = run_times_as_driven_s(world, times_s, delays_s, run_times_s)
    order = platform_order(world, record.arrival_s)
    interval_s = least_intervals_s(world, order, record.foresight)
    return earliest_arrivals_s(world, delays_s, driven_s, order, interval_s)
