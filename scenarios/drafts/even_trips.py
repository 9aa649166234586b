"""Trips at even intervals, for a line of which no timetable is known."""

from collections.abc import Sequence
from itertools import pairwise
from math import ceil

from kankaku.scenarios.drafts.runs import Runs
from kankaku.scenarios.drafts.sketch import DraftTrip, Stop, TripCall

STEP_S = 5
"""Booked times are multiples of this. [s]"""
RUN_ALLOWANCE = 1.05
"""Booked run time over the fastest one. [-]"""
DWELL_S = 30
"""Booked dwell. [s]"""


def every(
    headway_s: float,
    count: int,
    stops: Sequence[Stop],
    runs: Runs,
    *,
    train_type: str,
    first_s: int,
) -> tuple[DraftTrip, ...]:
    """
    Return trips in both directions that call everywhere.

    Parameters
    ----------
    headway_s
        Between two departures in one direction. [s]
    count
        Trips in each direction.
    stops
        By rising chainage, two or more.
    runs
        Least run times.
    train_type
        Of all trips.
    first_s
        When the first of each direction departs, after midnight. [s]

    Returns
    -------
    tuple[DraftTrip, ...]
        Odd numbers rise, even ones fall.
    """
    made = []
    for number in range(count):
        start_s = first_s + STEP_S * round(number * headway_s / STEP_S)
        for parity, way in ((1, stops), (2, stops[::-1])):
            calls = _calls([stop.id for stop in way], runs, train_type, start_s)
            made.append(DraftTrip(f"{2 * number + parity:03d}", train_type, calls))
    return tuple(made)


def _calls(names: Sequence[str], runs: Runs, train_type: str, start_s: int) -> tuple[TripCall, ...]:
    calls = [TripCall(names[0], start_s - DWELL_S, start_s)]
    for one, other in pairwise(names):
        run_s = RUN_ALLOWANCE * runs.between_s(one, other, train_type)
        arrival_s = calls[-1].departure_s + STEP_S * ceil(run_s / STEP_S)
        calls.append(TripCall(other, arrival_s, arrival_s + DWELL_S))
    return tuple(calls)
