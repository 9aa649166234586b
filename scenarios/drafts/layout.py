"""
Tracks, platforms and points for a sketch: the fewest that its timetable needs.

A double line has one track for each direction. Where trains begin or end there are points on both
sides of the platforms, and as many further tracks for both directions as trains stand there at a
time; at either end of the line all tracks are for both directions. A single line has a loop
wherever its timetable lets trains of both directions meet.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, NamedTuple

from kankaku.scenarios.drafts.draft import Draft, DraftError
from kankaku.scenarios.drafts.layout_notes import (
    note_crowding,
    note_later,
    note_loops,
    note_tracks,
)
from kankaku.scenarios.drafts.meetings import NEAREST_THROAT, THROATS, Loops, Room, Throat, loops_of
from kankaku.scenarios.drafts.refusals import refuse
from kankaku.scenarios.drafts.single_line import later_than, with_sidings, without_clashes
from kankaku.scenarios.drafts.sketch import Sketch
from kankaku.scenarios.drafts.station_sizes import (
    BEYOND_M,
    PROOF_S,
    THROW_S,
    WAITING_BLOCK_M,
    platform_m,
)
from kankaku.scenarios.drafts.stays import CLEARING_S, dwell_at, shared, stays_of
from kankaku.scenarios.reading.row_formats import (
    CallRow,
    DwellStationRow,
    LinkRow,
    NodeRow,
    PlatformRow,
    Row,
    ServiceRow,
    StationRow,
)
from kankaku.scenarios.reading.units import clock_of


class _Site(NamedTuple):
    """A station, or a loop between two."""

    id: str
    km: float


@dataclass(frozen=True, slots=True)
class _Tracked:
    """A station with its tracks; through stations on a double line have none of their own."""

    low_km: float
    """Node on the side of low chainage; the platform's end for a through station."""
    high_km: float
    tracks: tuple[str, ...] = ()
    low: str = ""
    """Identifier of that node."""
    high: str = ""


@dataclass(frozen=True, slots=True)
class Roominess:
    """How much more than the fewest tracks a line gets."""

    clearing_s: int = CLEARING_S
    """Booked time for which a platform track stays free between two trains. [s]"""
    everywhere: bool = False
    """A single line has loops wherever there is room, not only where trains are booked to meet."""


def lay_out(sketch: Sketch, roominess: Roominess = Roominess()) -> Draft:
    """
    Lay tracks for a sketch and bring its trains onto them.

    Parameters
    ----------
    sketch
        Stations, trips and train types.
    roominess
        How many tracks it gets.

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
    refuse(sketch)
    builder = _fitting(sketch, roominess)
    draft = Draft(sketch.title, sketch.notes, _settings(sketch), _stock(sketch))
    draft.rows = builder.rows()
    builder.note()
    return draft


def _fitting(sketch: Sketch, roominess: Roominess) -> "_Builder":
    """Return the lines and points that stations have room for."""
    throats = THROATS if sketch.single_track else (*THROATS, NEAREST_THROAT)
    for throat, roomy in (*((throat, True) for throat in throats), (throats[-1], False)):
        builder = _Builder(sketch, throat, roominess, roomy=roomy)
        near = builder.near()
        if near is None and not builder.loops.unplaced:
            break
    if near is not None:
        raise near
    return builder


class _Builder:
    """Builds the rows of a network, station by station."""

    def __init__(
        self, sketch: Sketch, throat: Throat, roominess: Roominess, *, roomy: bool
    ) -> None:
        self._throat, self._roomy, self._clearing_s = throat, roomy, roominess.clearing_s
        self._length_m = max(float(entry["length_m"]) for entry in sketch.train_types.values())
        self._platform_m = platform_m(self._length_m)
        self._waiting_km = (self._length_m + WAITING_BLOCK_M) / 1000.0 if roomy else 0.0
        self._kept = _turned_at(sketch)
        self.loops = Loops(set(self._kept))
        self._asked = self._sketch = sketch
        if sketch.single_track:
            half_km = self._platform_m / 2000.0
            room = Room(half_km, half_km + sum(throat) / 1000.0, self._waiting_km)
            self.loops = loops_of(sketch, self._kept, room, everywhere=roominess.everywhere)
            self._asked = with_sidings(sketch, self.loops)
            own = [
                s.id
                for s in self._asked.stops
                if s.id in {*self.loops.stations, *self.loops.sidings}
            ]
            self._sketch = without_clashes(self._asked, own)
        self._rises = {trip.id: sketch.rises(trip) for trip in sketch.trips}
        self._stays = stays_of(self._sketch, self._rises)
        self._track_of: dict[tuple[str, str], str] = {}
        """Track by station and train."""
        self._sites = [_Site(stop.id, stop.chainage_km) for stop in self._sketch.stops]
        self._places = {site.id: self._place(site) for site in self._sites}

    def rows(self) -> dict[str, Sequence[Row]]:
        """Return the rows of all files by name."""
        sketch = self._sketch
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
            "nodes.csv": self._nodes(),
            "tracks.csv": self._links(),
            "platforms.csv": self._platforms(),
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

    def _place(self, site: _Site) -> _Tracked:
        """Give a station its tracks, and its trains theirs."""
        name, km, half_km = site.id, site.km, self._platform_m / 2000.0
        if name not in self.loops.stations and name not in self.loops.sidings:
            return _Tracked(km - half_km, km + half_km)
        first, last = name == self._sites[0].id, name == self._sites[-1].id
        stays = self._stays[name]
        reach_m = self._platform_m + sum(self._throat)
        number_of, count = shared(
            [stay for stay in stays if not stay.passes], reach_m, self._clearing_s
        )
        further = [f"{name}-{number + 1}" for number in range(count)]
        for train, number in number_of.items():
            self._track_of[name, train] = further[number - 1]
        ways = [] if first or last else [f"{name}-up", f"{name}-down"]
        for stay in stays:
            if stay.passes:
                train, rises = stay.calls[0]
                self._track_of[name, train] = ways[0] if rises else ways[1]
        away_km = half_km + self._throat.away_m / 1000.0
        end_km = half_km + BEYOND_M / 1000.0
        return _Tracked(
            km - (end_km if first else away_km),
            km + (end_km if last else away_km),
            (*ways, *further) or (f"{name}-1",),
            f"{name}-end" if first else f"{name}-low",
            f"{name}-end" if last else f"{name}-high",
        )

    def _own(self) -> list[tuple[str, _Tracked]]:
        """Return the places with tracks of their own."""
        return [(name, place) for name, place in self._places.items() if place.tracks]

    def _nodes(self) -> list[NodeRow]:
        own = self._own()
        rows = []
        for number, (_, place) in enumerate(own):
            for name, km, is_end in (
                (place.low, place.low_km, number == 0),
                (place.high, place.high_km, number == len(own) - 1),
            ):
                fouling_km = 0.0 if is_end else self._throat.fouling_m / 1000.0
                times_s = (0.0, 0.0) if is_end else (THROW_S, PROOF_S)
                rows.append(
                    NodeRow(
                        *(0, name, _km(km), "buffer" if is_end else "points"),
                        *(_km(km - fouling_km), _km(km + fouling_km), *times_s),
                    )
                )
        return rows

    def near(self) -> DraftError | None:
        """Return what is to be said of places too near to each other, if there are any."""
        fouling_km = self._throat.fouling_m / 1000.0
        for one, other in pairwise(self._sites):
            before, after = self._places[one.id], self._places[other.id]
            between_km = fouling_km * (bool(before.tracks) + bool(after.tracks))
            if before.tracks and after.tracks:
                # A train that stands between two points fouls neither.
                between_km += self._waiting_km
            if before.high_km + between_km >= after.low_km:
                away_m = 1000.0 * (other.km - one.km)
                need_m = away_m + 1000.0 * (before.high_km + between_km - after.low_km)
                where = f"stations {one.id!r} and {other.id!r}"
                problem = f"lie {away_m:.0f} m apart, too near for platforms and points"
                return DraftError(where, problem, f"more than {need_m:.0f} m with such trains")
        return None

    def _links(self) -> list[LinkRow]:
        own = self._own()
        rows: list[LinkRow] = []
        for number, (name, place) in enumerate(own):
            rows += self._at_place(name, place)
            if number + 1 < len(own):
                ends = place.high, own[number + 1][1].low
                rows += self._between(name, own[number + 1][0], ends)
        return rows

    def _at_place(self, name: str, place: _Tracked) -> list[LinkRow]:
        """Return the tracks of a place; trains that pass it keep to their own side."""
        up, down = self._sides()
        across = {f"{name}-up": up, f"{name}-down": down}
        ways: dict[str, Literal["rising", "falling", "both"]]
        ways = {f"{name}-up": "rising", f"{name}-down": "falling"}
        further = [track for track in place.tracks if track not in across]
        for number, track in enumerate(further, 1):
            # Between the two of a double line, and beside those of a loop.
            inner = 1.0 + number / (len(further) + 1.0)
            across[track] = number + 2.0 if self._sketch.single_track else inner
        if len(further) == len(place.tracks):
            across = {track: float(number) for number, track in enumerate(further, 1)}
        rows = [
            LinkRow(0, track, place.low, place.high, ways.get(track, "both"), across[track])
            for track in place.tracks
        ]
        return sorted(rows, key=lambda row: row.across)

    def _sides(self) -> tuple[float, float]:
        """Return the places across of rising and falling trains."""
        return (1.0, 2.0) if self._sketch.left_hand else (2.0, 1.0)

    def _between(self, name: str, other: str, ends: tuple[str, str]) -> list[LinkRow]:
        if self._sketch.single_track:
            return [LinkRow(0, f"{name}-{other}", *ends, "both", 1.5)]
        up, down = self._sides()
        rising = LinkRow(0, f"{name}-{other}-up", *ends, "rising", up)
        falling = LinkRow(0, f"{name}-{other}-down", *ends, "falling", down)
        present = set(self._rises.values())
        return [row for row, rises in ((rising, True), (falling, False)) if rises in present]

    def _platforms(self) -> list[PlatformRow]:
        rows = []
        half_km, ahead_km = self._platform_m / 2000.0, self._length_m / 2000.0
        for name, km in self._sites:
            place = self._places[name]
            own = self._at_place(name, place) if place.tracks else self._passing(name)
            for link in own:
                stop_km = km - ahead_km if link.direction == "falling" else km + ahead_km
                ends_km = _km(km - half_km), _km(km + half_km)
                rows.append(PlatformRow(0, *ends_km, name, link.id, _km(stop_km)))
        return rows

    def _passing(self, station: str) -> list[LinkRow]:
        """Return the tracks along a station that has none of its own."""
        names = [site.id for site in self._sites]
        number = names.index(station)
        before = next(name for name in reversed(names[:number]) if self._places[name].tracks)
        after = next(name for name in names[number:] if self._places[name].tracks)
        return self._between(before, after, (self._places[before].high, self._places[after].low))

    def _calls(self) -> Iterable[CallRow]:
        passing: dict[tuple[str, str], str] = {
            (name, row.direction): row.id
            for name, _ in self._sites
            if not self._places[name].tracks
            for row in self._passing(name)
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
        found = [(name, dwell_at(self._sketch.trips, name)) for name, _ in self._sites]
        return [
            DwellStationRow(
                *(0, name, float(dwell.least_s), float(dwell.usual_s)),
                0.0 if name in self.loops.sidings else 1.0,
            )
            for name, dwell in found
        ]

    def note(self) -> None:
        """Note what the layout assumes."""
        sketch = self._sketch
        tracks = {name: len(place.tracks) for name, place in self._own()}
        note_tracks(sketch, tracks, self._platform_m, self._throat)
        if not self._roomy:
            note_crowding(sketch.notes)
        if sketch.single_track:
            own = {site.id: site.km for site in self._sites if self._places[site.id].tracks}
            looped = {name: km for name, km in own.items() if name not in self._kept}
            note_loops(sketch.notes, self.loops, looped)
            later = later_than(self._asked, sketch)
            if later:
                note_later(sketch.notes, later, len(self._rises))


def _turned_at(sketch: Sketch) -> set[str]:
    """Return the stations with points in any case: ends of the line and of trips."""
    ends = {call.station for trip in sketch.trips for call in (trip.calls[0], trip.calls[-1])}
    return ends | {sketch.stops[0].id, sketch.stops[-1].id}


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
