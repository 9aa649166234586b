"""What cannot be laid out, told before anything is."""

from itertools import pairwise

from kankaku.scenarios.drafts.draft import DraftError
from kankaku.scenarios.drafts.sketch import DraftTrip, Sketch


def refuse(sketch: Sketch) -> None:
    """
    Refuse a sketch that no line can be laid out for.

    Parameters
    ----------
    sketch
        Stations and trips.

    Raises
    ------
    DraftError
        With the first reason.
    """
    if not sketch.trips:
        where, allowed = sketch.title, "one trip or more with two calls or more"
        raise DraftError(where, "no trip is left", allowed)
    for one, other in pairwise(sketch.stops):
        if other.chainage_km <= one.chainage_km:
            where, problem = f"station {other.id!r}", f"does not lie after {one.id!r}"
            raise DraftError(where, problem, f"above km {one.chainage_km:g}")
    by_id = {trip.id: trip for trip in sketch.trips}
    for trip in sketch.trips:
        _refuse_trip(sketch, trip)
        follower = by_id.get(trip.next_trip)
        if trip.next_trip and (
            follower is None
            or follower.calls[0].station != trip.calls[-1].station
            or sketch.rises(follower) is sketch.rises(trip)
        ):
            where, problem = f"trip {trip.id}", f"its stock cannot go on as {trip.next_trip!r}"
            raise DraftError(where, problem, f"a trip back from {trip.calls[-1].station!r}")


def _refuse_trip(sketch: Sketch, trip: DraftTrip) -> None:
    at_km, where = sketch.at_km, f"trip {trip.id}"
    for call in trip.calls:
        if call.station not in at_km:
            raise DraftError(where, f"unknown station {call.station!r}", "a station of the line")
    times_s = [time_s for call in trip.calls for time_s in call[1:]]
    if times_s != sorted(times_s):
        allowed = "times of calls that rise"
        raise DraftError(where, "is somewhere earlier than it was before", allowed)
    along = [at_km[call.station] for call in trip.calls]
    if len(along) < 2 or along not in (sorted(set(along)), sorted(set(along), reverse=True)):
        allowed = "two calls or more in one running direction"
        raise DraftError(where, "does not run along the line", allowed)
    if trip.train_type not in sketch.train_types:
        allowed = ", ".join(sketch.train_types)
        raise DraftError(where, f"unknown train type {trip.train_type!r}", allowed)
