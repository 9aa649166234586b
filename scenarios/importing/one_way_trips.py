"""Trains of a line in one direction: evenly spaced ones, or those of a source kept apart."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from math import ceil

from kankaku.scenarios.drafts.runs import Runs
from kankaku.scenarios.drafts.sketch import DraftTrip, TripCall
from kankaku.scenarios.importing.formats import SourceError, Wish
from kankaku.scenarios.importing.one_way import DWELL_S, LEAST_DWELL_S, OneWay
from kankaku.scenarios.importing.source_keys import whole_s
from kankaku.scenarios.reading.mistakes import Mistake
from kankaku.scenarios.reading.units import clock_of

TRAINS = 10
"""Where nobody says how many. [-]"""
FIRST_S = 7 * 3600
"""When the first train departs. [s after midnight]"""
ALLOWANCE = 1.05
"""Booked over least run time. [-]"""
APART_S = 60
"""Between two trains at a stop where a source books them too near to each other. [s]"""


def spaced_trips(way: OneWay, wish: Wish, usual_s: float) -> tuple[DraftTrip, ...]:
    """
    Book trains where a source has none: all alike, at even intervals, calling everywhere.

    Parameters
    ----------
    way
        The line; what is assumed goes into its notes.
    wish
        Headway and number of trains; where it has no headway the usual one holds, or a longer one
        that blocks of the source allow for.
    usual_s
        From departure to departure. [s]

    Returns
    -------
    tuple[DraftTrip, ...]
        In the order in which they run.

    Raises
    ------
    SourceError
        If trains would stand in one place.
    """
    headway_s = usual_s if wish.headway_s is None else wish.headway_s
    if headway_s < DWELL_S:
        problem = f"{headway_s:g} s is shorter than a stay at a station"
        sentence = str(Mistake(way.title, "--headway", problem, f"{DWELL_S} s or more"))
        raise SourceError((sentence,))
    train_type, runs = next(iter(way.train_types)), Runs(way.sketch, fronts=True)
    legs_s = [
        whole_s(ALLOWANCE * runs.between_s(start.id, end.id, train_type))
        for start, end in pairwise(way.stops)
    ]
    if wish.headway_s is None:
        headway_s = max(usual_s, _blocks_headway_s(way, sum(legs_s)))
    count = TRAINS if wish.trains is None else wish.trains
    made = []
    for number in range(count):
        leaves_s = FIRST_S + round(number * headway_s)
        calls = [TripCall(way.stops[0].id, leaves_s - DWELL_S, leaves_s)]
        for leg_s, stop in zip(legs_s, way.stops[1:], strict=True):
            arrival_s = calls[-1].departure_s + leg_s
            calls.append(TripCall(stop.id, arrival_s, arrival_s + DWELL_S))
        made.append(DraftTrip(f"T{number + 1:02d}", train_type, tuple(calls)))
    notes = way.notes
    notes.assume(
        "timetable",
        f"{count} trains of type {train_type!r}, one every {headway_s:g} s from "
        f"{clock_of(FIRST_S)}, calling everywhere",
        "the source has none",
    )
    notes.assume(
        "booked run times",
        f"{ALLOWANCE:g} times the least ones, in whole seconds",
        "the source has none; the least ones are worked out from limits, gradients and the train",
    )
    notes.assume("booked dwells", f"{DWELL_S} s everywhere", "the source has none")
    return tuple(made)


def _blocks_headway_s(way: OneWay, run_s: float) -> float:
    """Return how long two blocks and a train take at the mean speed, in whole minutes. [s]"""
    ends_km = way.stops[0].chainage_km, way.stops[-1].chainage_km
    inner_km = [km for km in way.block_edges_km if way.extent_km[0] < km < way.extent_km[1]]
    if not inner_km:
        return 0.0
    edges_km = [way.extent_km[0], *inner_km, way.extent_km[1]]
    lengths_km = [high_km - low_km for low_km, high_km in pairwise(edges_km)]
    longest_km = max(one_km + other_km for one_km, other_km in pairwise(lengths_km))
    mean_kmps = (ends_km[1] - ends_km[0]) / run_s
    return 60.0 * ceil((longest_km + way.longest_m / 1000.0) / mean_kmps / 60.0)


def kept_apart(way: OneWay, trips: Sequence[DraftTrip]) -> tuple[DraftTrip, ...]:
    """
    Let trains of a source follow each other on one track, later where they would meet.

    Parameters
    ----------
    way
        The line; what is changed goes into its notes.
    trips
        Trains that all begin at the same station, as they are booked.

    Returns
    -------
    tuple[DraftTrip, ...]
        By their first departure. Nobody calls anywhere earlier than booked.
    """
    runs = Runs(way.sketch, fronts=True)
    left_s: dict[str, int] = {}
    made, later, hurried = [], [], []
    for trip in sorted(trips, key=lambda trip: trip.calls[0].departure_s):
        shift_s, calls = 0, list[TripCall]()
        for call in trip.calls:
            arrival_s = call.arrival_s + shift_s
            if calls:
                least_s = runs.between_s(calls[-1].station, call.station, trip.train_type)
                earliest_s = calls[-1].departure_s + whole_s(least_s)
                if earliest_s > arrival_s:
                    hurried.append(trip.id)
                    arrival_s = earliest_s
            arrival_s = max(arrival_s, left_s.get(call.station, arrival_s))
            stay_s = call.departure_s - call.arrival_s
            if not calls:
                stay_s = max(stay_s, LEAST_DWELL_S)
            shift_s = arrival_s - call.arrival_s
            calls.append(TripCall(call.station, arrival_s, arrival_s + stay_s))
        if calls[0].departure_s > trip.calls[0].departure_s + LEAST_DWELL_S:
            later.append(trip.id)
        _leave(way, calls, left_s)
        made.append(replace(trip, calls=tuple(calls)))
    if later:
        value = f"{', '.join(later)}: so that {APART_S} s lie between two trains"
        way.notes.assume("later departures", value, "booked at once or too near on one track")
    if hurried:
        value = f"{', '.join(dict.fromkeys(hurried))}: as early as the train can"
        way.notes.assume("later arrivals", value, "booked earlier than any train could arrive")
    return tuple(made)


def _leave(way: OneWay, calls: Sequence[TripCall], left_s: dict[str, int]) -> None:
    """Note from when on another train may stand at each station; also where this one passes."""
    at_km = {stop.id: stop.chainage_km for stop in way.stops}
    for before, after in pairwise(calls):
        left_s[before.station] = before.departure_s + APART_S
        span_km = at_km[after.station] - at_km[before.station]
        for stop in way.stops:
            if at_km[before.station] < stop.chainage_km < at_km[after.station]:
                share = (stop.chainage_km - at_km[before.station]) / span_km
                run_s = after.arrival_s - before.departure_s
                left_s[stop.id] = before.departure_s + round(share * run_s) + APART_S
    left_s[calls[-1].station] = calls[-1].departure_s + APART_S
