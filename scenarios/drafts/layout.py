"""
Tracks, platforms and points for a sketch: the fewest that its timetable needs.

A double line has one track for each direction. Where trains begin or end there are points on both
sides of the platforms, and as many further tracks for both directions as trains stand there at a
time; at either end of the line all tracks are for both directions. A single line has a loop
wherever its timetable lets trains of both directions meet.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil
from statistics import median_low

from kankaku.scenarios.drafts.sketch import Sketch, Trip
from kankaku.scenarios.drafts.tables import Draft, DraftError
from kankaku.scenarios.reading.row_formats import (
    CallRow,
    DwellStationRow,
    LinkRow,
    NodeRow,
    PlatformRow,
    ServiceRow,
    StationRow,
)
from kankaku.scenarios.reading.units import clock_of

PLATFORM_MARGIN_M = 10.0
"""Platforms are longer than the longest train by so much. [m]"""
POINTS_AWAY_M = 110.0
"""From the end of a platform to the middle of its points. [m]"""
FOULING_M = 60.0
"""The points are fouled so far to either side. [m]"""
BEYOND_M = 50.0
"""From a platform to the buffer stop at the end of the line. [m]"""
THROW_S, PROOF_S = 5.0, 1.5
"""Time that points take to throw, and to be proved. [s]"""
CLEARING_S = 90
"""Booked time for which a platform track stays free between two trains. [s]"""
SHARE_OF_DWELL = 2 / 3
"""Minimum dwell over the usual booked one. [-]"""
LEAST_DWELL_S, MOST_DWELL_S = 15, 600
"""Between these lies what counts as a booked dwell; a longer stay is a wait. [s]"""


@dataclass(frozen=True, slots=True)
class _Stay:
    """A train, or one after the other of the same stock, at a platform track."""

    calls: tuple[tuple[str, bool], ...]
    """Train and whether it rises, in order."""
    start_s: int
    end_s: int
    passes: bool
    """It comes and goes on in one direction."""


@dataclass(frozen=True, slots=True)
class _Place:
    """A station with its tracks; through stations on a double line have none of their own."""

    low_km: float
    """Node on the side of low chainage; the platform's end for a through station."""
    high_km: float
    tracks: tuple[str, ...] = ()
    low: str = ""
    """Identifier of that node."""
    high: str = ""


def lay_out(sketch: Sketch) -> Draft:
    """
    Lay tracks for a sketch and bring its trains onto them.

    Parameters
    ----------
    sketch
        Stations, trips and train types.

    Returns
    -------
    Draft
        A network with all files but blocks and controllers. Every figure that the sketch does not
        have stands in the notes.

    Raises
    ------
    DraftError
        If there is no trip, a trip calls in both directions or at an unknown station, a linked
        trip does not go on from where the one before ends, or stations lie too near to each other
        for the points that they need.
    """
    _refuse(sketch)
    builder = _Builder(sketch)
    draft = Draft(sketch.title, sketch.notes, _settings(sketch), _stock(sketch))
    draft.rows = builder.rows()
    return draft


def _refuse(sketch: Sketch) -> None:
    at_km = sketch.at_km
    if not sketch.trips:
        where, allowed = sketch.title, "one trip or more with two calls or more"
        raise DraftError(where, "no trip is left", allowed)
    by_id = {trip.id: trip for trip in sketch.trips}
    for trip in sketch.trips:
        where = f"trip {trip.id}"
        for call in trip.calls:
            if call.station not in at_km:
                raise DraftError(
                    where, f"unknown station {call.station!r}", "a station of the line"
                )
        along = [at_km[call.station] for call in trip.calls]
        if len(along) < 2 or along not in (sorted(set(along)), sorted(set(along), reverse=True)):
            allowed = "two calls or more in one running direction"
            raise DraftError(where, "does not run along the line", allowed)
        follower = by_id.get(trip.next_trip)
        if trip.next_trip and (
            follower is None
            or follower.calls[0].station != trip.calls[-1].station
            or sketch.rises(follower) is sketch.rises(trip)
        ):
            problem = f"its stock cannot go on as {trip.next_trip!r}"
            allowed = f"a trip back from {trip.calls[-1].station!r}"
            raise DraftError(where, problem, allowed)


class _Builder:
    """Builds the rows of a network, station by station."""

    def __init__(self, sketch: Sketch) -> None:
        self._sketch = sketch
        self._trips = {trip.id: trip for trip in sketch.trips}
        self._rises = {trip.id: sketch.rises(trip) for trip in sketch.trips}
        lengths_m = [float(entry["length_m"]) for entry in sketch.train_types.values()]
        self._length_m = max(lengths_m)
        self._platform_m = 5.0 * ceil((self._length_m + PLATFORM_MARGIN_M) / 5.0)
        self._stays = _stays(sketch, self._rises)
        self._both = {True, False} <= set(self._rises.values())
        self._track_of: dict[tuple[str, str], str] = {}
        """Track by station and train."""
        self._places = {stop.id: self._place(stop.id) for stop in sketch.stops}

    def rows(self) -> dict[str, list]:  # type: ignore[type-arg]
        """Return the rows of all files by name."""
        self._note()
        sketch = self._sketch
        nodes, links = self._nodes(), self._links()
        platforms = self._platforms()
        return {
            "stations.csv": [
                StationRow(0, stop.id, stop.name, stop.chainage_km)
                if stop.lon_deg is None and not stop.name_local
                else StationRow(
                    *(0, stop.id, stop.name, stop.chainage_km),
                    *(stop.name_local, stop.lon_deg, stop.lat_deg),
                )
                for stop in sketch.stops
            ],
            "nodes.csv": nodes,
            "tracks.csv": links,
            "platforms.csv": platforms,
            "services.csv": [
                ServiceRow(0, trip.id, trip.train_type, trip.next_trip) for trip in sketch.trips
            ],
            "calls.csv": list(self._calls()),
            "dwell_stations.csv": self._dwells(),
            "limits.csv": list(sketch.limits),
            "gradients.csv": list(sketch.gradients),
            "curves.csv": list(sketch.curves),
            "geometry.csv": list(sketch.geometry),
        }

    def _place(self, station: str) -> _Place:
        """Give a station its tracks, and its trains theirs."""
        stops = self._sketch.stops
        km, half_km = self._sketch.at_km[station], self._platform_m / 2000.0
        first, last = station == stops[0].id, station == stops[-1].id
        stays = self._stays[station]
        turning = [stay for stay in stays if not stay.passes]
        meeting = self._sketch.single_track and self._met(stays)
        if not (first or last or turning or meeting):
            return _Place(km - half_km, km + half_km)
        away_km = half_km + POINTS_AWAY_M / 1000.0
        end_km = half_km + BEYOND_M / 1000.0
        ways = [] if first or last else [f"{station}-up", f"{station}-down"]
        further = [f"{station}-{number}" for number in _shared(turning, self._track_of, station)]
        if ways:
            for stay in stays:
                if stay.passes:
                    train, rises = stay.calls[0]
                    self._track_of[station, train] = ways[0] if rises else ways[1]
        tracks = [*ways[:1], *further, *ways[1:]] or [f"{station}-1"]
        if not self._sketch.left_hand:
            tracks.reverse()
        low = f"{station}-end" if first else f"{station}-low"
        high = f"{station}-end" if last else f"{station}-high"
        return _Place(
            km - (end_km if first else away_km),
            km + (end_km if last else away_km),
            tuple(tracks),
            low,
            high,
        )

    def _met(self, stays: Sequence[_Stay]) -> bool:
        """Return whether trains of both directions stand at a station at about the same time."""
        rising = [stay for stay in stays if stay.calls[0][1]]
        falling = [stay for stay in stays if not stay.calls[-1][1]]
        return any(
            one.start_s - CLEARING_S < other.end_s and other.start_s - CLEARING_S < one.end_s
            for one in rising
            for other in falling
        )

    def _nodes(self) -> list[NodeRow]:
        own = [place for place in self._places.values() if place.tracks]
        rows = []
        for number, place in enumerate(own):
            for name, km, is_end in (
                (place.low, place.low_km, number == 0),
                (place.high, place.high_km, number == len(own) - 1),
            ):
                fouling_km = 0.0 if is_end else FOULING_M / 1000.0
                times_s = (0.0, 0.0) if is_end else (THROW_S, PROOF_S)
                rows.append(
                    NodeRow(
                        *(0, name, _km(km), "buffer" if is_end else "points"),
                        *(_km(km - fouling_km), _km(km + fouling_km), *times_s),
                    )
                )
        self._refuse_near()
        return rows

    def _refuse_near(self) -> None:
        stops = self._sketch.stops
        for one, other in pairwise(stops):
            before, after = self._places[one.id], self._places[other.id]
            fouling_km = FOULING_M / 1000.0 * (bool(before.tracks) + bool(after.tracks))
            if before.high_km + fouling_km >= after.low_km:
                away_m = 1000.0 * (other.chainage_km - one.chainage_km)
                need_m = away_m + 1000.0 * (before.high_km + fouling_km - after.low_km)
                where = f"stations {one.id!r} and {other.id!r}"
                problem = f"lie {away_m:.0f} m apart, too near for platforms and points"
                raise DraftError(where, problem, f"more than {need_m:.0f} m with such trains")

    def _links(self) -> list[LinkRow]:
        own = [(name, place) for name, place in self._places.items() if place.tracks]
        rows: list[LinkRow] = []
        for number, (name, place) in enumerate(own):
            for across, track in enumerate(place.tracks, 1):
                way = {f"{name}-up": "rising", f"{name}-down": "falling"}.get(track, "both")
                rows.append(LinkRow(0, track, place.low, place.high, way, float(across)))  # type: ignore[arg-type]
            if number + 1 < len(own):
                ends = place.high, own[number + 1][1].low
                rows += self._between(name, own[number + 1][0], ends)
        return rows

    def _between(self, name: str, other: str, ends: tuple[str, str]) -> list[LinkRow]:
        if self._sketch.single_track:
            return [LinkRow(0, f"{name}-{other}", *ends, "both", 1.0)]
        up, down = (1.0, 2.0) if self._sketch.left_hand else (2.0, 1.0)
        rising = LinkRow(0, f"{name}-{other}-up", *ends, "rising", up)
        falling = LinkRow(0, f"{name}-{other}-down", *ends, "falling", down)
        present = set(self._rises.values())
        return [row for row, rises in ((rising, True), (falling, False)) if rises in present]

    def _platforms(self) -> list[PlatformRow]:
        rows = []
        half_km, ahead_km = self._platform_m / 2000.0, self._length_m / 2000.0
        for number, stop in enumerate(self._sketch.stops):
            km = stop.chainage_km
            ends_km = _km(km - half_km), _km(km + half_km)
            place = self._places[stop.id]
            tracks = place.tracks or tuple(row.id for row in self._passing(number))
            for track in tracks:
                falls = track.endswith("-down")
                stop_km = km - ahead_km if falls else km + ahead_km
                rows.append(PlatformRow(0, *ends_km, stop.id, track, _km(stop_km)))
        return rows

    def _passing(self, number: int) -> list[LinkRow]:
        """Return the tracks along a station that has none of its own, by its number."""
        stops = [stop.id for stop in self._sketch.stops]
        before = next(name for name in reversed(stops[:number]) if self._places[name].tracks)
        after = next(name for name in stops[number:] if self._places[name].tracks)
        return self._between(before, after, (self._places[before].high, self._places[after].low))

    def _calls(self) -> Iterable[CallRow]:
        order = {stop.id: number for number, stop in enumerate(self._sketch.stops)}
        passing: dict[tuple[str, str], str] = {
            (name, row.direction): row.id
            for name, number in order.items()
            if not self._places[name].tracks
            for row in self._passing(number)
        }
        for trip in self._sketch.trips:
            way = "rising" if self._rises[trip.id] else "falling"
            for call in trip.calls:
                name = call.station
                track = self._track_of.get((name, trip.id)) or passing.get((name, way))
                yield CallRow(
                    *(0, trip.id, name, track or passing[name, "both"]),
                    *(clock_of(call.arrival_s), clock_of(call.departure_s)),
                )

    def _dwells(self) -> list[DwellStationRow]:
        rows = []
        for stop in self._sketch.stops:
            booked_s = _usual_dwell_s(self._sketch.trips, stop.id)
            least_s = min(booked_s, max(LEAST_DWELL_S, round(SHARE_OF_DWELL * booked_s)))
            rows.append(DwellStationRow(0, stop.id, float(least_s), float(booked_s), 1.0))
        return rows

    def _note(self) -> None:
        notes = self._sketch.notes
        tracks = {name: len(place.tracks) for name, place in self._places.items() if place.tracks}
        notes.assume(
            "platform tracks",
            ", ".join(f"{name} {count}" for name, count in tracks.items()),
            "the fewest that the booked stays need; two at either end, or one where one suffices",
        )
        notes.assume(
            "platforms",
            f"{self._platform_m:g} m, the station's chainage in the middle",
            f"the longest train and {PLATFORM_MARGIN_M:g} m",
        )
        notes.assume(
            "points",
            f"{POINTS_AWAY_M:g} m from the platforms, fouled {FOULING_M:g} m to either side, "
            f"{THROW_S:g} s to throw and {PROOF_S:g} s to prove",
            "an ordinary throat",
        )
        notes.assume(
            "minimum dwell",
            f"two thirds of the station's usual booked dwell, {LEAST_DWELL_S} s or more",
            "what a train cannot do without is not public",
        )
        side = "left" if self._sketch.left_hand else "right"
        if not self._sketch.single_track:
            notes.assume("running side", side, "which side trains keep to; only drawings show it")


def _stays(sketch: Sketch, rises: Mapping[str, bool]) -> dict[str, list[_Stay]]:
    """Return who stands where from when to when; linked trips stand there together."""
    found: dict[str, list[_Stay]] = {stop.id: [] for stop in sketch.stops}
    before = {trip.next_trip: trip for trip in sketch.trips if trip.next_trip}
    by_id = {trip.id: trip for trip in sketch.trips}
    for trip in sketch.trips:
        way = trip.id, rises[trip.id]
        for number, call in enumerate(trip.calls):
            if number == 0:
                if trip.id not in before:
                    stay = _Stay((way,), call.arrival_s, call.departure_s, passes=False)
                    found[call.station].append(stay)
            elif number < len(trip.calls) - 1:
                stay = _Stay((way,), call.arrival_s, call.departure_s, passes=True)
                found[call.station].append(stay)
            else:
                ways, end_s = [way], call.departure_s
                if trip.next_trip:
                    follower = by_id[trip.next_trip]
                    ways.append((follower.id, rises[follower.id]))
                    end_s = max(end_s, follower.calls[0].departure_s)
                stay = _Stay(tuple(ways), call.arrival_s, end_s, passes=False)
                found[call.station].append(stay)
    return {name: sorted(stays, key=lambda stay: stay.start_s) for name, stays in found.items()}


def _shared(
    stays: Sequence[_Stay], track_of: dict[tuple[str, str], str], station: str
) -> list[int]:
    """Give tracks for both directions to stays; return their numbers, the fewest."""
    free_s: list[int] = []
    for stay in stays:
        free = [at for at, time_s in enumerate(free_s) if time_s + CLEARING_S <= stay.start_s]
        # Used in turn: the one that has been free for the longest.
        at = min(free, key=lambda at: free_s[at]) if free else len(free_s)
        if not free:
            free_s.append(0)
        free_s[at] = stay.end_s
        for train, _ in stay.calls:
            track_of[station, train] = f"{station}-{at + 1}"
    return list(range(1, len(free_s) + 1))


def _usual_dwell_s(trips: Sequence[Trip], station: str) -> int:
    """Return the usual booked dwell where trains go on; at an end what is least."""
    stays_s = [
        call.departure_s - call.arrival_s
        for trip in trips
        for call in trip.calls[1:-1] or trip.calls
        if call.station == station and call.departure_s - call.arrival_s <= MOST_DWELL_S
    ]
    return max(median_low(stays_s), LEAST_DWELL_S) if stays_s else 2 * LEAST_DWELL_S


def _settings(sketch: Sketch) -> dict[str, object]:
    return {
        "schema_version": 1,
        "title": sketch.title,
        "seed": 1,
        "step_s": 0.1,
        "patience_min": 60.0,
        **sketch.driving,
        "turn_back": {"minimum_s": float(sketch.minimum_turn_back_s)},
    }


def _stock(sketch: Sketch) -> dict[str, object]:
    return {"schema_version": 1, "train": {k: dict(v) for k, v in sketch.train_types.items()}}


def _km(value: float) -> float:
    return round(value, 6)
