"""
Where trains of a single line meet, and where it needs loops.

Two trains meet where their booked ways through place and time cross. At a station that is a loop
of this station. Between two stations it is a loop on the open track, if trains would have to wait
for long otherwise, or one of the station at which they wait the least.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from statistics import median
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.scenarios.drafts.sketch import DraftTrip, Sketch, Stop

AT_STATION_KM = 1e-6
"""Who meets so near to a station meets there. [km]"""
LONG_WAIT_S = 45.0
"""Trains that would wait for longer get a loop where they meet, between the stations. [s]"""


class Meeting(NamedTuple):
    """Two trains of opposite directions where their ways cross."""

    rising: str
    falling: str
    km: float
    before: int
    """Number of the station there, or of the last one at a lower chainage."""
    at_station: bool
    waits_s: tuple[float, float] = (0.0, 0.0)
    """How long one waits if they meet at the station before, or at the one after. [s]"""


class Throat(NamedTuple):
    """Points beside a platform."""

    away_m: float
    """From the end of the platform to their middle. [m]"""
    fouling_m: float
    """They are fouled so far to either side. [m]"""


THROATS = (Throat(110.0, 60.0), Throat(70.0, 40.0), Throat(40.0, 25.0))
"""The first that the distances between stations leave room for."""
NEAREST_THROAT = Throat(27.0, 18.0)
"""On a double line, at last: a train that waits in a loop needs more room to clear the points."""


class Room(NamedTuple):
    """What stations need along the line."""

    half_km: float
    """Half of a platform."""
    reach_km: float
    """From the middle of a platform to where its points are no longer fouled."""
    between_km: float = 0.0
    """Between the points of one place and those of another."""

    def apart_km(self, *, points: bool) -> float:
        """
        Return how far a place with points is from another place at least.

        Parameters
        ----------
        points
            Whether that one has points, too.

        Returns
        -------
        float
            From middle to middle. [km]
        """
        return self.reach_km + (self.reach_km + self.between_km if points else self.half_km)


class Siding(NamedTuple):
    """A loop between two stations."""

    km: float
    before: int
    """Number of the last station at a lower chainage."""
    trips: tuple[str, ...]
    """Those that meet there."""


@dataclass
class Loops:
    """Where a single line has loops."""

    stations: set[str]
    """With tracks of their own."""
    sidings: dict[str, Siding] = field(default_factory=dict)
    """Loops between stations by identifier."""
    unplaced: int = 0
    """Meetings for which no place had room."""


class _Way:
    """A trip through place and time."""

    def __init__(self, trip: DraftTrip, at_km: dict[str, float]) -> None:
        self.id = trip.id
        times_s = [t for call in trip.calls for t in (call.arrival_s, call.departure_s)]
        places_km = [at_km[call.station] for call in trip.calls for _ in range(2)]
        self.times_s: FloatArray = np.array(times_s, dtype=float)
        self.places_km: FloatArray = np.array(places_km)

    def km(self, times_s: FloatArray) -> FloatArray:
        """Return where it is. [km]"""
        found: FloatArray = np.interp(times_s, self.times_s, self.places_km)
        return found

    def departs_s(self, km: float) -> float:
        """Return when it leaves a place. [s]"""
        return self._at_s(km, 1e-9)

    def arrives_s(self, km: float) -> float:
        """Return when it comes to a place. [s]"""
        return self._at_s(km, -1e-9)

    def _at_s(self, km: float, beyond_km: float) -> float:
        sign = 1.0 if self.places_km[-1] > self.places_km[0] else -1.0
        # Two places at every stop, one just behind the other.
        steps_km = np.tile([0.0, 1e-9], len(self.places_km) // 2)
        return float(
            np.interp(sign * km + beyond_km + 5e-10, sign * self.places_km + steps_km, self.times_s)
        )


def meetings_of(sketch: Sketch) -> list[Meeting]:
    """
    Return where trains of opposite directions meet.

    Parameters
    ----------
    sketch
        Stations and trips.

    Returns
    -------
    list[Meeting]
        One for every two trains that do.
    """
    ways = [(_Way(trip, sketch.at_km), sketch.rises(trip)) for trip in sketch.trips]
    rising = [way for way, rises in ways if rises]
    falling = [way for way, rises in ways if not rises]
    return [
        met
        for one in rising
        for other in falling
        if one.times_s[0] < other.times_s[-1] and other.times_s[0] < one.times_s[-1]
        for met in _crossing(sketch.stops, one, other)
    ]


def meeting_places(sketch: Sketch) -> Counter[tuple[int, bool]]:
    """
    Return how often trains meet where.

    Parameters
    ----------
    sketch
        Stations and trips.

    Returns
    -------
    Counter[tuple[int, bool]]
        By number of the station, and whether it is there or on the stretch behind it.
    """
    return Counter((one.before, one.at_station) for one in meetings_of(sketch))


def _crossing(stops: Sequence[Stop], one: _Way, other: _Way) -> Iterator[Meeting]:
    start_s = max(one.times_s[0], other.times_s[0])
    end_s = min(one.times_s[-1], other.times_s[-1])
    times_s = np.unique(np.concatenate([one.times_s, other.times_s, [start_s, end_s]]))
    times_s = times_s[(times_s >= start_s) & (times_s <= end_s)]
    ahead_km = one.km(times_s) - other.km(times_s)
    if not (ahead_km[0] < 0.0 < ahead_km[-1]):
        return
    after = int(np.argmax(ahead_km >= 0.0))
    share = ahead_km[after - 1] / (ahead_km[after - 1] - ahead_km[after])
    time_s = times_s[after - 1] + share * (times_s[after] - times_s[after - 1])
    km = float(one.km(np.array([time_s]))[0])
    stops_km = np.array([stop.chainage_km for stop in stops])
    before = int(np.searchsorted(stops_km, km + AT_STATION_KM)) - 1
    if abs(km - stops_km[before]) <= AT_STATION_KM:
        yield Meeting(one.id, other.id, km, before, at_station=True)
        return
    low_km, high_km = stops_km[before], stops_km[before + 1]
    waits_s = (
        other.arrives_s(low_km) - one.departs_s(low_km),
        one.arrives_s(high_km) - other.departs_s(high_km),
    )
    yield Meeting(one.id, other.id, km, before, at_station=False, waits_s=waits_s)


def loops_of(sketch: Sketch, kept: set[str], room: Room, *, everywhere: bool = False) -> Loops:
    """
    Return where a single line needs loops.

    Parameters
    ----------
    sketch
        Stations and trips.
    kept
        Stations with tracks of their own in any case.
    room
        What stations need along the line.
    everywhere
        Whether all stations get loops that have room for them.

    Returns
    -------
    Loops
        Stations and places between them.
    """
    found = Loops(set(kept))
    stops, met = sketch.stops, meetings_of(sketch)
    for number, count in Counter(one.before for one in met if one.at_station).most_common():
        if not _added(stops, found, room, number):
            found.unplaced += count
    between: dict[int, list[Meeting]] = {}
    for one in met:
        if not one.at_station:
            between.setdefault(one.before, []).append(one)
    for before, here in sorted(between.items()):
        _between(stops, found, room, (before, here))
    if everywhere:
        for number in range(len(stops)):
            _added(stops, found, room, number)
    return found


def _between(
    stops: Sequence[Stop], found: Loops, room: Room, at: tuple[int, list[Meeting]]
) -> None:
    """Add a loop for trains that are booked to meet between two stations."""
    before, here = at
    low, high = stops[before], stops[before + 1]
    waits_s = [min(one.waits_s) for one in here]
    if median(waits_s) > LONG_WAIT_S:
        low_km, high_km = (room.apart_km(points=stop.id in found.stations) for stop in (low, high))
        from_km, to_km = low.chainage_km + low_km, high.chainage_km - high_km
        if from_km + 0.001 < to_km - 0.001:
            middle_km = min(max(median(one.km for one in here), from_km + 0.001), to_km - 0.001)
            trips = sorted({trip for one in here for trip in (one.rising, one.falling)})
            siding = Siding(round(middle_km, 3), before, tuple(trips))
            found.sidings[f"loop-{before + 1}"] = siding
            return
    ways = sorted((0, 1), key=lambda way: sum(one.waits_s[way] for one in here))
    if not any(_added(stops, found, room, before + way) for way in ways):
        found.unplaced += len(here)


def _added(stops: Sequence[Stop], found: Loops, room: Room, number: int) -> bool:
    """Give a station a loop if it has room for one; return whether it has one now."""
    if stops[number].id not in found.stations and _fits(stops, found, room, number):
        found.stations.add(stops[number].id)
    return stops[number].id in found.stations


def _fits(stops: Sequence[Stop], found: Loops, room: Room, number: int) -> bool:
    """Return whether a station has room for points on both sides."""
    sites = sorted(
        [(stop.chainage_km, stop.id in found.stations) for stop in stops]
        + [(siding.km, True) for siding in found.sidings.values()]
    )
    at = [km for km, _ in sites].index(stops[number].chainage_km)
    return all(
        abs(km - sites[at][0]) > room.apart_km(points=own)
        for km, own in (sites[max(at - 1, 0) : at] + sites[at + 1 : at + 2])
    )
