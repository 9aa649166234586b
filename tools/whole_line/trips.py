"""
The day's trains of the whole line: public minutes, circulation of the stock, platform tracks.

Stock goes over to the next train that begins in the other direction, first in, first out, if
one begins within reach; otherwise it is stabled, and a train that finds no stock comes out of the
siding.
"""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from tools.whole_line.layout import JUNCTION, Layout

PUBLIC_FILE = "public_timetable.csv"
FIRST_COLUMNS = 5
"""Columns of the public timetable before those of the stations."""
TURN_BACK_MIN = 3
"""Least public minutes from an arrival to the next departure of the same stock. [min]"""
LONGEST_WAIT_MIN = 25
"""Stock that waits longer is stabled. [min]"""
READY_MIN = 1.0
"""So long before its departure a train from the siding stands at its platform. [min]"""
CLEAR_MIN = 1.0
"""Least time between two trains at one platform track, in estimated times. [min]"""
CLOSE_MIN = 2.0
"""Movements that cross within this time, or follow at a track, count against it. [min]"""
TAKEN_PRICE = 1000.0
"""Price of a track that is not free."""
LOOK_BACK = 6
"""So many stays before are looked at."""
MOST_PLANS = 1000
"""So many plans are followed at a time."""
SOON_PRICE = 1.5
"""Price of a track that was left just before; a crossing costs 1."""


@dataclass(slots=True)
class Trip:
    """A train with its calls."""

    train: str
    direction: str
    through: bool
    """Goes over to the Yokohama line at its end, or comes from it."""
    stations: list[str]
    minutes: list[int]
    """Public departures; the last one is an arrival. [min]"""
    tracks: list[str] = field(default_factory=list)
    next_train: str = ""
    before: str = ""
    """The train that its stock worked before."""


@dataclass(slots=True)
class Stay:
    """Trains that hold a platform track one after the other without leaving it."""

    ending: Trip | None
    beginning: Trip | None

    @property
    def start_min(self) -> float:
        """When it begins, estimated. [min]"""
        if self.ending:
            return self.ending.minutes[-1] + 0.5
        return self.trip.minutes[0] + 0.5 - READY_MIN

    @property
    def end_min(self) -> float:
        """When it ends, estimated. [min]"""
        if self.beginning:
            return self.beginning.minutes[0] + 0.5
        return self.trip.minutes[-1] + 0.5 + READY_MIN

    @property
    def trip(self) -> Trip:
        """One of its trains."""
        trip = self.ending or self.beginning
        if trip is None:
            msg = "a stay has a train"
            raise ValueError(msg)
        return trip


Plan = tuple[float, tuple[tuple[Stay, str], ...]]
"""Price, and the track of every stay so far."""


def read_trips(folder: Path) -> list[Trip]:
    """
    Return the trains of the public timetable.

    Parameters
    ----------
    folder
        Folder of the scenario.

    Returns
    -------
    list[Trip]
        In the order of the file.
    """
    with (folder / PUBLIC_FILE).open(encoding="utf-8", newline="") as file:
        heading, *rows = csv.reader(file)
    trips = []
    for train, _, bound, destination, through_to, *cells in rows:
        found = [
            (station, 60 * int(clock[:2]) + int(clock[3:]))
            for station, clock in zip(heading[FIRST_COLUMNS:], cells, strict=True)
            if clock
        ]
        if bound == "northbound":
            found.reverse()
        stations, minutes = [name for name, _ in found], [minute for _, minute in found]
        if stations[-1] != destination:
            msg = f"{train} ends at {stations[-1]}, not at {destination}"
            raise ValueError(msg)
        direction = "rising" if bound == "southbound" else "falling"
        comes = bound == "southbound" and stations[0] == JUNCTION
        trips.append(Trip(train, direction, bool(through_to) or comes, stations, minutes))
    return trips


def plan_platforms(trips: Sequence[Trip], layout: Layout) -> None:
    """
    Give every call its platform track and every train its next one.

    Parameters
    ----------
    trips
        The trains; tracks, next trains and trains before are set.
    layout
        The tracks.
    """
    for trip in trips:
        turning = trip.stations[0], trip.stations[-1]
        trip.tracks = [
            ""
            if station in turning and layout.turning_tracks(station)
            else layout.main_track(station, trip.direction)
            for station in trip.stations
        ]
        if trip.through and trip.direction == "rising":
            trip.tracks[0] = f"{JUNCTION}-2"
        elif trip.through:
            trip.tracks[-1] = f"{JUNCTION}-3"
    for station in layout.station_km:
        if layout.turning_tracks(station):
            ending = [trip for trip in trips if trip.stations[-1] == station]
            beginning = [trip for trip in trips if trip.stations[0] == station]
            tracks = layout.turning_tracks(station)
            waits_min = range(TURN_BACK_MIN, LONGEST_WAIT_MIN + 1)
            plans = [_circulate(ending, beginning, len(tracks), wait) for wait in waits_min]
            stays = min(plans, key=len)
            _assign(stays, tracks, layout)
            for stay in stays:
                if stay.ending and stay.beginning:
                    stay.ending.next_train = stay.beginning.train
                    stay.beginning.before = stay.ending.train


def _circulate(
    ending: Sequence[Trip], beginning: Sequence[Trip], tracks: int, wait_min: int
) -> list[Stay]:
    """Couple trains first in, first out, as long as all find a platform track."""
    free = sorted(ending, key=lambda trip: trip.minutes[-1])
    stays = []
    for trip in sorted(beginning, key=lambda trip: trip.minutes[0]):
        found = [
            one
            for one in free
            if one.direction != trip.direction
            and TURN_BACK_MIN <= trip.minutes[0] - one.minutes[-1] <= wait_min
        ]
        if found:
            free.remove(found[0])
        stays.append(Stay(found[0] if found else None, trip))
    stays += [Stay(trip, None) for trip in free]
    while crowd := _crowd(stays, tracks):
        longest = max(crowd, key=lambda stay: stay.end_min - stay.start_min)
        stays.remove(longest)
        stays += [Stay(longest.ending, None), Stay(None, longest.beginning)]
    return stays


def _crowd(stays: Sequence[Stay], tracks: int) -> list[Stay]:
    """Return stays at one time that are too many and can be parted."""
    for stay in stays:
        here = [one for one in stays if one.start_min <= stay.start_min < one.end_min + CLEAR_MIN]
        parted = [one for one in here if one.ending and one.beginning]
        if len(here) > tracks and parted:
            return parted
    return []


def _assign(stays: Sequence[Stay], tracks: Sequence[str], layout: Layout) -> None:
    """Give every stay a track: free, and with few crossing movements at the points."""
    plans: list[Plan] = [(0.0, ())]
    for stay in sorted(stays, key=lambda stay: stay.start_min):
        longer = [
            (cost + _price(stay, name, done, layout), (*done, (stay, name)))
            for cost, done in plans
            for name in tracks
        ]
        # Only what was given last matters for what comes; the cheapest of each is kept.
        best: dict[tuple[str, ...], Plan] = {}
        for plan in sorted(longer, key=lambda plan: plan[0]):
            best.setdefault(tuple(name for _, name in plan[1][-LOOK_BACK:]), plan)
        plans = list(best.values())[:MOST_PLANS]
    for stay, name in plans[0][1]:
        if stay.ending:
            stay.ending.tracks[-1] = name
        if stay.beginning:
            stay.beginning.tracks[0] = name


def _price(stay: Stay, name: str, done: Sequence[tuple[Stay, str]], layout: Layout) -> float:
    """Return what it costs that a stay has a track, after those before."""
    gone_min = [other.end_min for other, track in done[-LOOK_BACK:] if track == name]
    spare_min = stay.start_min - max(gone_min, default=0.0)
    taken = TAKEN_PRICE * (spare_min < CLEAR_MIN) + SOON_PRICE * (spare_min < CLOSE_MIN)
    return taken + _crossings(stay, name, done, layout)


def _crossings(stay: Stay, name: str, done: Sequence[tuple[Stay, str]], layout: Layout) -> int:
    """Count arrivals that cross a departure at nearly the same time, the track being given."""
    count = 0
    for other, track in done[-LOOK_BACK:]:
        pairs = ((stay, name, other, track), (other, track, stay, name))
        for coming, coming_track, going, going_track in pairs:
            if not (coming.ending and going.beginning):
                continue
            if abs(coming.start_min - going.end_min) >= CLOSE_MIN:
                continue
            apart = layout.tracks[coming_track].across - layout.tracks[going_track].across
            count += apart * (1 if coming.ending.direction == "falling" else -1) < 0
    return count


def by_id(trips: Sequence[Trip]) -> Mapping[str, Trip]:
    """
    Return trains by identifier.

    Parameters
    ----------
    trips
        The trains.

    Returns
    -------
    Mapping[str, Trip]
        The same.
    """
    return {trip.train: trip for trip in trips}
