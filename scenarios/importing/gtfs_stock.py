"""Which train of a feed the same stock runs next: by ``block_id``, else first in, first out."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from statistics import median_low

from kankaku.scenarios.drafts.circulation import joined, linked
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.sketch import DraftTrip, TripCall
from kankaku.scenarios.drafts.stays import LEAST_DWELL_S

MINIMUM_TURN_S = 120.0
"""From an arrival to a departure the other way, where the feed does not say who goes on. [s]"""
LONGEST_TURN_S = 1800.0
"""Whoever stands longer has gone to a depot. [s]"""


def with_stock(
    trips: Sequence[DraftTrip],
    block_of: Mapping[str, str],
    rises: Mapping[str, bool],
    notes: SourceNotes,
) -> tuple[tuple[DraftTrip, ...], float]:
    """
    Let stock go on as another train.

    Parameters
    ----------
    trips
        The trains.
    block_of
        Block by train; empty if the feed does not say.
    rises
        Which trains run towards higher chainage.
    notes
        Are told on what this rests.

    Returns
    -------
    tuple[tuple[DraftTrip, ...], float]
        The trains, and the least time from an arrival to a departure the other way. [s]
    """
    following, turns_s = _by_block(trips, block_of, rises, notes)
    minimum_s = min([MINIMUM_TURN_S, *turns_s])
    if turns_s and minimum_s < MINIMUM_TURN_S:
        why = f"the shortest turn of a block; usually {median_low(turns_s)} s"
        notes.assume("least turn-back", f"{minimum_s:g} s", why)
    else:
        notes.assume("least turn-back", f"{minimum_s:g} s", "the feed does not say it")
    free = [trip for trip in trips if not block_of.get(trip.id)]
    if free:
        found = _short({trip.id: trip for trip in linked(free, MINIMUM_TURN_S, rises)})
        what = f"first in, first out: {len(found)} of {len(free)} trains go on"
        why = (
            "the feed has no block_id for them; from "
            f"{MINIMUM_TURN_S / 60:g} to {LONGEST_TURN_S / 60:g} min at the same station"
        )
        notes.assume("circulation of stock", what, why)
        following |= found
    booked = [replace(trip, next_trip=following.get(trip.id, "")) for trip in trips]
    return joined(_leaving_time(booked)), minimum_s


def _by_block(
    trips: Sequence[DraftTrip],
    block_of: Mapping[str, str],
    rises: Mapping[str, bool],
    notes: SourceNotes,
) -> tuple[dict[str, str], list[int]]:
    """Return who goes on as whom by block, and how long the stock stands. [s]"""
    blocks: dict[str, list[DraftTrip]] = {}
    for trip in trips:
        if block_of.get(trip.id):
            blocks.setdefault(block_of[trip.id], []).append(trip)
    following: dict[str, str] = {}
    turns_s, apart = [], 0
    for own in blocks.values():
        own.sort(key=lambda trip: trip.calls[0].departure_s)
        for one, other in pairwise(own):
            last, first = one.calls[-1], other.calls[0]
            turn_s = first.departure_s - last.arrival_s
            if (
                first.station == last.station
                and rises[one.id] is not rises[other.id]
                and 2 * LEAST_DWELL_S <= turn_s <= LONGEST_TURN_S
            ):
                following[one.id] = other.id
                turns_s.append(turn_s)
            else:
                apart += 1
    if blocks:
        notes.take(f"circulation of stock, {len(following)} turns", "trips.txt: block_id")
    if apart:
        told = f"{apart} turns of blocks that are no turn-back of up to {LONGEST_TURN_S / 60:g} min"
        notes.miss(told, "the train leaves the line, and the next one of its block comes anew")
    return following, turns_s


def _short(trips: Mapping[str, DraftTrip]) -> dict[str, str]:
    """Return who goes on as whom, without those who would stand too long."""
    found = {}
    for name, trip in trips.items():
        if trip.next_trip:
            stands_s = trips[trip.next_trip].calls[0].departure_s - trip.calls[-1].arrival_s
            if stands_s <= LONGEST_TURN_S:
                found[name] = trip.next_trip
    return found


def _leaving_time(trips: Sequence[DraftTrip]) -> list[DraftTrip]:
    """Return trips whose last stay leaves half of the turn to the next one's first."""
    starts_s = {trip.id: trip.calls[0].departure_s for trip in trips}
    made = []
    for trip in trips:
        last = trip.calls[-1]
        if trip.next_trip:
            half_s = (starts_s[trip.next_trip] - last.arrival_s) // 2
            end = TripCall(
                last.station, last.arrival_s, min(last.departure_s, last.arrival_s + half_s)
            )
            trip = replace(trip, calls=(*trip.calls[:-1], end))  # noqa: PLW2901 - a changed copy
        made.append(trip)
    return made
