"""
Regular timetables of a single track: trains of both directions meet at stations.

Rising trains run as they like, one headway apart. Between two stations a falling train takes the
time that they leave free: it waits at the station before until the one that comes towards it is
in, and departs only if it is through before the next one leaves.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import ceil
from typing import NamedTuple

from kankaku.scenarios.drafts.circulation import linked
from kankaku.scenarios.drafts.regular_times import (
    FINEST_CHOICES,
    DirectionTimes,
    Regular,
    RegularTrips,
    RunTime,
    booked_of,
    profile,
)
from kankaku.scenarios.drafts.sketch import DraftTrip, TripCall
from kankaku.scenarios.drafts.stays import CLEARING_S

MEETING_S = 60
"""From an arrival until the next train may enter the track that became free; also before."""


class _Falling(NamedTuple):
    """A falling train, by its departure at the last station; the least wait is the best."""

    waits_s: int
    sets: int
    phase_s: int
    arrival_s: Mapping[str, int]
    departure_s: Mapping[str, int]


def least_single_headway(
    stations: Sequence[str], run_s: RunTime, asked: Regular
) -> tuple[int, tuple[str, str]]:
    """
    Return the least headway of a single track, and the two stations that decide.

    Parameters
    ----------
    stations
        By rising chainage.
    run_s
        Least run times.
    asked
        Dwells and supplement.

    Returns
    -------
    tuple[int, tuple[str, str]]
        Both directions have to run between them within one headway. [s]
    """
    up, down = profile(stations, run_s, asked), profile(stations[::-1], run_s, asked)
    needs = {
        (one, other): up.arrival_s[other]
        - up.departure_s[one]
        + down.arrival_s[one]
        - down.departure_s[other]
        + 2 * MEETING_S
        for one, other in pairwise(stations)
    }
    decides = max(needs, key=lambda leg: needs[leg])
    longest_stay_s = max(asked.dwell_s.values()) + CLEARING_S
    return max(needs[decides], longest_stay_s), decides


def single_trips(stations: Sequence[str], run_s: RunTime, asked: Regular) -> RegularTrips:
    """
    Return a regular timetable of a line with one track.

    Parameters
    ----------
    stations
        By rising chainage.
    run_s
        Least run times.
    asked
        One working; the headway is not below the least one.

    Returns
    -------
    RegularTrips
        Trains that begin from the first moment until the last one.
    """
    (working,) = asked.workings
    at = [stations.index(name) for name in working]
    served = list(stations[at[0] : at[1] + 1])
    up = profile(served, run_s, asked)
    runs_s = profile(served[::-1], run_s, asked)
    step_s = ceil(asked.headway_s / FINEST_CHOICES)
    best = min(
        (_fallen(asked, up, runs_s, first_s) for first_s in range(0, asked.headway_s, step_s)),
        key=lambda found: (found.sets, found.waits_s, found.phase_s),
    )
    trips = [*_trips(asked, up, asked.names[0])]
    rises = {trip.id: True for trip in trips}
    down = DirectionTimes(runs_s.stations, best.arrival_s, best.departure_s)
    falling = [*_trips(asked, down, asked.names[1])]
    rises |= {trip.id: False for trip in falling}
    trips = sorted([*trips, *falling], key=lambda trip: trip.calls[0].departure_s)
    return booked_of(linked(trips, asked.turn_back_s, rises), best.waits_s)


def _fallen(asked: Regular, up: DirectionTimes, runs: DirectionTimes, first_s: int) -> _Falling:
    """Bring a falling train down the line in the gaps of the rising ones."""
    headway_s, waits_s = asked.headway_s, 0
    start = runs.stations[0]
    arrival_s, departure_s = {start: first_s - asked.dwell_s[start]}, {start: first_s}
    for leg, (here, there) in enumerate(pairwise(runs.stations)):
        ready_s = departure_s[here]
        run_s = runs.arrival_s[there] - runs.departure_s[here]
        # The rising train is on this track from `there` to `here`.
        busy_s = up.departure_s[there] - MEETING_S, up.arrival_s[here] + MEETING_S
        free_s = headway_s - (busy_s[1] - busy_s[0])
        since_s = (ready_s - busy_s[1]) % headway_s
        departs_s = ready_s if since_s + run_s <= free_s else ready_s + headway_s - since_s
        if leg:
            waits_s += departs_s - ready_s
        else:
            arrival_s[here] = departs_s - asked.dwell_s[here]
        departure_s[here] = departs_s
        arrival_s[there] = departs_s + run_s
        departure_s[there] = arrival_s[there] + asked.dwell_s[there]
    far, near = up.stations[-1], up.stations[0]
    far_s = (departure_s[far] - up.arrival_s[far] - asked.turn_back_s) % headway_s
    near_s = (up.departure_s[near] - arrival_s[near] - asked.turn_back_s) % headway_s
    ran_s = up.arrival_s[far] + arrival_s[near] - departure_s[far]
    sets = round((ran_s + far_s + near_s + 2 * asked.turn_back_s) / headway_s)
    return _Falling(waits_s, sets, departure_s[start], arrival_s, departure_s)


def _trips(asked: Regular, runs: DirectionTimes, name: str) -> list[DraftTrip]:
    first, *rest = runs.stations
    leaves_s = asked.from_s + runs.departure_s[first] % asked.headway_s
    made: list[DraftTrip] = []
    while leaves_s <= asked.until_s:
        shift_s = leaves_s - runs.departure_s[first]
        calls = [TripCall(first, leaves_s - asked.dwell_s[first], leaves_s)]
        calls += [
            TripCall(
                station, shift_s + runs.arrival_s[station], shift_s + runs.departure_s[station]
            )
            for station in rest
        ]
        made.append(DraftTrip(f"{name}{len(made) + 1:03d}", asked.train_type, tuple(calls)))
        leaves_s += asked.headway_s
    return made
