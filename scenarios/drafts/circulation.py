"""Circulation: which train the same stock runs next."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from kankaku.scenarios.drafts.sketch import DraftTrip, TripCall

LONGEST_STAY_S = 1200.0
"""Stock that would stand for longer until its next train leaves the line instead. [s]"""


def linked(
    trips: Sequence[DraftTrip],
    minimum_s: float,
    rises: Mapping[str, bool],
    *,
    coming: Collection[str] = (),
    going: Collection[str] = (),
) -> tuple[DraftTrip, ...]:
    """
    Let stock go on as another train where it ends: first in, first out.

    Stock for which there is no train within ``LONGEST_STAY_S`` leaves the line, as to a depot.

    Parameters
    ----------
    trips
        Trips, of which some are linked already.
    minimum_s
        From an arrival to the departure of the same stock the other way. [s]
    rises
        Which trips run towards higher chainage, by identifier.
    coming, going
        Trips whose stock comes from another line, or goes on to one; these are not linked there.

    Returns
    -------
    tuple[DraftTrip, ...]
        The same, in order. A trip that goes on begins when the one before has ended.
    """
    taken = {trip.next_trip for trip in trips}
    starts = sorted(
        (trip for trip in trips if trip.id not in taken and trip.id not in coming),
        key=lambda trip: trip.calls[0].departure_s,
    )
    following: dict[str, str] = {}
    for trip in sorted(trips, key=lambda trip: trip.calls[-1].arrival_s):
        if trip.next_trip or trip.id in going:
            continue
        last = trip.calls[-1]
        for start in starts:
            first = start.calls[0]
            if (
                first.station == last.station
                and rises[start.id] is not rises[trip.id]
                and start.train_type == trip.train_type
                and first.departure_s >= max(last.arrival_s + minimum_s, last.departure_s)
                and first.departure_s <= last.arrival_s + LONGEST_STAY_S
            ):
                following[trip.id] = start.id
                starts.remove(start)
                break
    return joined(
        [replace(trip, next_trip=following.get(trip.id, trip.next_trip)) for trip in trips]
    )


def joined(trips: Sequence[DraftTrip]) -> tuple[DraftTrip, ...]:
    """
    Let linked trips begin when, and where, the ones before end.

    Parameters
    ----------
    trips
        Trips with links.

    Returns
    -------
    tuple[DraftTrip, ...]
        The same; the first arrival of a trip that goes on from another is that one's last
        departure.
    """
    ends_s = {trip.next_trip: trip.calls[-1].departure_s for trip in trips if trip.next_trip}
    made = []
    for trip in trips:
        first = trip.calls[0]
        if trip.id in ends_s:
            start = TripCall(first.station, ends_s[trip.id], first.departure_s)
            trip = replace(trip, calls=(start, *trip.calls[1:]))  # noqa: PLW2901 - a changed copy
        made.append(trip)
    return tuple(made)
