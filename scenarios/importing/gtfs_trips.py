"""The trains of a day of a GTFS feed: trips as they stand there, and those repeated by headway."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.importing.gtfs_files import FeedFiles
from kankaku.scenarios.importing.gtfs_tables import FeedCall, FeedFrequency, FeedTrip
from kankaku.scenarios.reading.mistakes import Mistake, row_place

MOST_TRAINS = 5000
"""Of a day. [-]"""


@dataclass(frozen=True, slots=True)
class DayTrip:
    """A train of the day."""

    id: str
    trip: str
    """The trip that it was made of."""
    direction: int
    block: str
    shape: str
    calls: tuple[FeedCall, ...]
    """Two or more, the first and the last of them with times."""

    @property
    def begins_s(self) -> int:
        """Departure from the first call. [s]"""
        return self.calls[0].departure_s or 0


def day_trips(
    files: FeedFiles,
    trips: Sequence[FeedTrip],
    calls: Mapping[str, Sequence[FeedCall]],
    frequencies: Sequence[FeedFrequency],
    notes: SourceNotes,
) -> list[DayTrip]:
    """
    Return the trains of a day.

    Parameters
    ----------
    files
        The feed; what is wrong is added to its mistakes.
    trips
        Those that run on the day.
    calls
        Their calls.
    frequencies
        How often some of them are repeated.
    notes
        Are told what was assumed and what is left out.

    Returns
    -------
    list[DayTrip]
        By departure.
    """
    made, single, cut = [], [], list[int]()
    for trip in trips:
        own = calls.get(trip.id, ())
        if len(own) < 2:
            single.append(trip.id)
            continue
        timed = _timed(files.mistakes, own, notes, cut)
        if timed:
            parts = trip.id, trip.id, trip.direction, trip.block, trip.shape
            made.append(DayTrip(*parts, timed))
    if single:
        told = _listed(single)
        notes.miss(f"{len(single)} trips with fewer than two calls: {told}", "they do not run")
    if cut:
        told = f"{len(cut)} trips, the first at row {min(cut)} of stop_times.txt"
        effect = "they run from the first to the last call with a time, if these are two"
        notes.miss(f"times at the first or last call of {told}", effect)
    trains = _repeated(files.mistakes, made, frequencies, notes)
    return sorted(trains, key=lambda trip: (trip.begins_s, trip.id))


def _timed(
    mistakes: list[Mistake], calls: Sequence[FeedCall], notes: SourceNotes, told: list[int]
) -> tuple[FeedCall, ...]:
    """Return calls whose times are both there or both not, and never go back."""
    made, clean = [], True
    for call in calls:
        if (call.arrival_s is None) is not (call.departure_s is None):
            at_s = call.departure_s if call.arrival_s is None else call.arrival_s
            call = replace_times(call, at_s, at_s)  # noqa: PLW2901 - a changed copy
            why = "a call has only one of the two times"
            notes.assume("arrivals without departure, or departures without arrival", "equal", why)
        made.append(call)
    at = [number for number, call in enumerate(made) if call.departure_s is not None]
    if len(at) < 2 or at[-1] + 1 - at[0] < len(made):
        made = made[at[0] : at[-1] + 1] if at else []
        told.append(calls[0].row)
    if len(made) < 2:
        return ()
    last_s = 0
    for call in made:
        if call.arrival_s is None or call.departure_s is None:
            continue
        columns = ("arrival_time", call.arrival_s), ("departure_time", call.departure_s)
        for column, time_s in columns:
            if time_s < last_s:
                place = row_place(call.row, column)
                allowed = "times that do not go back along a trip; after midnight from 24 on"
                mistakes.append(Mistake("stop_times.txt", place, "is earlier than before", allowed))
                clean = False
            last_s = max(last_s, time_s)
    if clean and made[-1].arrival_s == made[0].departure_s:
        place = row_place(made[-1].row, "arrival_time")
        allowed = "a later time at the last call than at the first"
        mistakes.append(Mistake("stop_times.txt", place, "is when the trip begins", allowed))
        clean = False
    return tuple(made) if clean else ()


def replace_times(call: FeedCall, arrival_s: int | None, departure_s: int | None) -> FeedCall:
    """Return a call with other times."""
    return call._replace(arrival_s=arrival_s, departure_s=departure_s)


def _repeated(
    mistakes: list[Mistake],
    trips: Iterable[DayTrip],
    frequencies: Sequence[FeedFrequency],
    notes: SourceNotes,
) -> list[DayTrip]:
    """Return trips, those with a headway as often as it says."""
    by_trip: dict[str, list[FeedFrequency]] = {}
    for frequency in frequencies:
        by_trip.setdefault(frequency.trip, []).append(frequency)
    trains: list[DayTrip] = []
    loose = set()
    for trip in trips:
        own = by_trip.get(trip.id, [])
        if not own:
            trains.append(trip)
            continue
        starts_s: set[int] = set()
        for frequency in own:
            times_s = range(frequency.start_s, frequency.end_s, frequency.headway_s)
            if len(times_s) + len(trains) > MOST_TRAINS:
                allowed = f"up to {MOST_TRAINS} trains a day"
                place = row_place(frequency.row, "headway_secs")
                mistakes.append(
                    Mistake("frequencies.txt", place, f"makes {len(times_s)} trains", allowed)
                )
                break
            starts_s.update(times_s)
            if not frequency.is_exact:
                loose.add(trip.id)
        for number, start_s in enumerate(sorted(starts_s), 1):
            later_s = start_s - trip.begins_s
            calls = tuple(_later(call, later_s) for call in trip.calls)
            # Nobody knows which of the repeated ones a block would mean.
            parts = replace(trip, id=f"{trip.id}-{number:03d}", calls=calls, block="")
            trains.append(parts)
    if loose:
        told = f"the first at the start of each period, then at its headway: {_listed(loose)}"
        why = "frequencies.txt gives headways without exact times"
        notes.assume("departures by headway", told, why)
    if by_trip:
        notes.take("trains repeated by headway", "frequencies.txt")
    return trains


def _later(call: FeedCall, later_s: int) -> FeedCall:
    if call.arrival_s is None or call.departure_s is None:
        return call
    return replace_times(call, call.arrival_s + later_s, call.departure_s + later_s)


def _listed(names: Iterable[str]) -> str:
    told = sorted(names)
    more = f" and {len(told) - 8} more" if len(told) > 8 else ""
    return ", ".join(told[:8]) + more
