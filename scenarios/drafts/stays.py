"""Who stands at which station from when to when, and on how few tracks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf
from statistics import median_low
from typing import NamedTuple

from kankaku.scenarios.drafts.sketch import DraftTrip, Sketch, TripCall

CLEARING_S = 90
"""Booked time for which a platform track stays free between two trains. [s]"""
SHARE_OF_DWELL = 2 / 3
"""Minimum dwell over the usual booked one. [-]"""
LEAST_DWELL_S, MOST_DWELL_S = 15, 600
"""Between these lies what counts as a booked dwell; a longer stay is a wait. [s]"""


@dataclass(frozen=True, slots=True)
class PlatformStay:
    """A train, or one after the other of the same stock, at a platform track."""

    calls: tuple[tuple[str, bool], ...]
    """Train and whether it rises, in order."""
    start_s: int
    end_s: int
    passes: bool
    """It comes and goes on in one direction."""
    speeds_mps: tuple[float, float] = (inf, inf)
    """Booked on the way before and after; infinite for who comes from nowhere, or goes there."""

    def taken_s(self, reach_m: float) -> tuple[float, float]:
        """
        Return from when to when its track is taken.

        Parameters
        ----------
        reach_m
            From where trains stand to the far end of the points. [m]

        Returns
        -------
        tuple[float, float]
            As booked, at even speed. [s]
        """
        before_mps, after_mps = self.speeds_mps
        return self.start_s - reach_m / before_mps, self.end_s + reach_m / after_mps


class StationDwell(NamedTuple):
    """The dwell of a station."""

    least_s: int
    usual_s: int


def stays_of(sketch: Sketch, rises: Mapping[str, bool]) -> dict[str, list[PlatformStay]]:
    """
    Return who stands where from when to when.

    Parameters
    ----------
    sketch
        Stations and trips.
    rises
        Which trips run towards higher chainage, by identifier.

    Returns
    -------
    dict[str, list[PlatformStay]]
        By station, in order of their beginning; linked trips stand there together.
    """
    found: dict[str, list[PlatformStay]] = {stop.id: [] for stop in sketch.stops}
    before = {trip.next_trip: trip for trip in sketch.trips if trip.next_trip}
    by_id = {trip.id: trip for trip in sketch.trips}
    for trip in sketch.trips:
        way, calls = (trip.id, rises[trip.id]), trip.calls
        speeds_mps = [inf, *(_speed_mps(sketch, *ends) for ends in pairwise(calls)), inf]
        for number, call in enumerate(calls):
            last = number == len(calls) - 1
            if number == 0 and trip.id in before:
                continue
            ways, end_s, passes = [way], call.departure_s, number > 0 and not last
            after_mps = speeds_mps[number + 1]
            if last and trip.next_trip:
                follower = by_id[trip.next_trip]
                ways.append((follower.id, rises[follower.id]))
                end_s = max(end_s, follower.calls[0].departure_s)
                after_mps = _speed_mps(sketch, *follower.calls[:2])
            speeds = speeds_mps[number], after_mps
            stay = PlatformStay(tuple(ways), call.arrival_s, end_s, passes, speeds)
            found[call.station].append(stay)
    return {name: sorted(stays, key=lambda stay: stay.start_s) for name, stays in found.items()}


def _speed_mps(sketch: Sketch, one: TripCall, other: TripCall) -> float:
    run_s = max(other.arrival_s - one.departure_s, 1)
    return 1000.0 * abs(sketch.at_km[other.station] - sketch.at_km[one.station]) / run_s


def shared(
    stays: Sequence[PlatformStay], reach_m: float, clearing_s: int = CLEARING_S
) -> tuple[dict[str, int], int]:
    """
    Share out tracks among stays, the fewest that they need.

    Parameters
    ----------
    stays
        In order of their beginning.
    reach_m
        From where trains stand to the far end of the points. [m]
    clearing_s
        For so long a track is booked free between two trains. [s]

    Returns
    -------
    tuple[dict[str, int], int]
        Number of the track by train, from 1 on, and how many there are.
    """
    tracks: list[PlatformStay] = []
    number_of: dict[str, int] = {}
    for stay in stays:
        free = [at for at, last in enumerate(tracks) if _after(last, stay, reach_m, clearing_s)]
        # Used in turn: the one that has been free for the longest.
        at = min(free, key=lambda at: tracks[at].end_s) if free else len(tracks)
        tracks[at : at + 1] = [stay]
        number_of |= {train: at + 1 for train, _ in stay.calls}
    return number_of, len(tracks)


def _after(one: PlatformStay, other: PlatformStay, reach_m: float, clearing_s: int) -> bool:
    """Return whether a track is free again for another stay."""
    if other.start_s < one.end_s + clearing_s:
        return False
    return other.taken_s(reach_m)[0] >= one.taken_s(reach_m)[1]


def dwell_at(trips: Sequence[DraftTrip], station: str) -> StationDwell:
    """
    Return the dwell of a station, as its trips are booked.

    Parameters
    ----------
    trips
        All of them.
    station
        Its identifier.

    Returns
    -------
    StationDwell
        The usual one where trains go on, at an end what is least; and two thirds of it, but never
        more than the shortest booked one.
    """
    booked_s = [
        (call.departure_s - call.arrival_s, 0 < number < len(trip.calls) - 1)
        for trip in trips
        for number, call in enumerate(trip.calls)
        if call.station == station
    ]
    going_on_s = [stay_s for stay_s, on in booked_s if on and stay_s <= MOST_DWELL_S]
    stays_s = going_on_s or [stay_s for stay_s, _ in booked_s if stay_s <= MOST_DWELL_S]
    usual_s = max(median_low(stays_s), LEAST_DWELL_S) if stays_s else 2 * LEAST_DWELL_S
    least_s = max(LEAST_DWELL_S, round(SHARE_OF_DWELL * usual_s))
    shortest_s = min((stay_s for stay_s, _ in booked_s), default=usual_s)
    return StationDwell(max(min(usual_s, least_s, shortest_s), 0), usual_s)
