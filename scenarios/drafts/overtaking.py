"""Trains that are booked to overtake each other where there is one track for their direction."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from kankaku.scenarios.drafts.sketch import DraftTrip, Sketch, TripCall

LEAST_GAP_S = 15
"""From a departure to the next arrival at the same platform. [s]"""


@dataclass
class _Run:
    """A train with its times at all stations from its first to its last, by place on the line."""

    trip: DraftTrip
    first: int
    last: int
    times_s: dict[int, tuple[int, int]]
    later_s: dict[int, int]
    """How much later it comes to a station than it was booked."""
    shift_s: int = 0

    def at_s(self, place: int) -> tuple[int, int]:
        """Return arrival and departure with what it is later already. [s]"""
        arrival_s, departure_s = self.times_s[place]
        return arrival_s + self.shift_s, departure_s + self.shift_s


def kept_in_order(sketch: Sketch) -> tuple[DraftTrip, ...]:
    """
    Let nobody overtake: whoever is booked to is booked behind the train before from there on.

    Trains that wait for others whom they were booked to pass would wait for ever, where their
    stock has to go on as booked. Hence this has to be done before stock is linked.

    Parameters
    ----------
    sketch
        Stations, and trips without links. Its notes are told.

    Returns
    -------
    tuple[DraftTrip, ...]
        In the same order, at every platform at least ``LEAST_GAP_S`` apart.
    """
    place_of = {stop.id: number for number, stop in enumerate(sketch.stops)}
    changed: dict[str, DraftTrip] = {}
    worst_s = 0
    for rises in (True, False):
        sign = 1 if rises else -1
        at_m = [sign * 1000.0 * stop.chainage_km for stop in sketch.stops]
        runs = [_run(trip, place_of, at_m) for trip in sketch.trips if sketch.rises(trip) is rises]
        _put_behind(runs, range(len(at_m))[::sign])
        for run in runs:
            if run.shift_s:
                worst_s = max(worst_s, run.shift_s)
                changed[run.trip.id] = _later(run, place_of)
    if changed:
        names = ", ".join(list(changed)[:8]) + (
            f" and {len(changed) - 8} more" * (len(changed) > 8)
        )
        sketch.notes.assume(
            f"later times of {len(changed)} trains: {names}",
            f"behind the train before, up to {worst_s} s later",
            "they are booked to overtake, or to arrive where another train still stands",
        )
    return tuple(changed.get(trip.id, trip) for trip in sketch.trips)


def _run(trip: DraftTrip, place_of: Mapping[str, int], at_m: Sequence[float]) -> _Run:
    """Return a train; where it does not call its time lies even between its calls."""
    calls = {place_of[call.station]: (call.arrival_s, call.departure_s) for call in trip.calls}
    first, last = place_of[trip.calls[0].station], place_of[trip.calls[-1].station]
    points_m = [at_m[place] + off for place in calls for off in (0.0, 1e-3)]
    points_s = [time_s for times_s in calls.values() for time_s in times_s]
    between = range(first, last, 1 if last > first else -1)
    times_s = {
        place: calls.get(place) or (int(np.interp(at_m[place], points_m, points_s)),) * 2
        for place in (*between, last)
    }
    return _Run(trip, first, last, times_s, {})


def _put_behind(runs: Sequence[_Run], places: Sequence[int]) -> None:
    """Go along the line with all trains of a direction, and shift those that come too early."""
    starting: dict[int, list[_Run]] = {}
    for run in runs:
        starting.setdefault(run.first, []).append(run)
    queue: list[_Run] = []
    for place in places:
        free_s = -LEAST_GAP_S
        for run in queue:
            _shift(run, place, free_s + LEAST_GAP_S - run.at_s(place)[0])
            # Who ends here makes way for the next one.
            free_s = run.at_s(place)[0 if run.last == place else 1]
        queue = [run for run in queue if run.last != place]
        through = {id(run) for run in queue}
        queue += starting.get(place, [])
        queue.sort(key=lambda run: (run.at_s(place)[1], id(run) not in through))
        for before, run in pairwise(queue):
            if id(run) not in through or id(before) not in through:
                gap_s = run.at_s(place)[1] - before.at_s(place)[1]
                _shift(run, place, LEAST_GAP_S - gap_s)


def _shift(run: _Run, place: int, by_s: int) -> None:
    if by_s > 0:
        run.shift_s += by_s
        run.later_s[place] = run.shift_s


def _later(run: _Run, place_of: Mapping[str, int]) -> DraftTrip:
    """Return a train with the times that it has got."""
    shift_s, made = 0, {}
    for place in run.times_s:
        shift_s = run.later_s.get(place, shift_s)
        made[place] = shift_s
    calls = []
    for call in run.trip.calls:
        by_s = made[place_of[call.station]]
        calls.append(TripCall(call.station, call.arrival_s + by_s, call.departure_s + by_s))
    return replace(run.trip, calls=tuple(calls))
