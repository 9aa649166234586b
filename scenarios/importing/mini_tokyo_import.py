"""A train timetable of Mini Tokyo 3D, with stations and lines beside it, to a drafted scenario."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path

from kankaku.railway.errors import suggesting
from kankaku.scenarios.drafts.circulation import LONGEST_STAY_S, linked
from kankaku.scenarios.drafts.completing import completed
from kankaku.scenarios.drafts.draft import Draft
from kankaku.scenarios.drafts.meetings import meeting_places
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.runs import Runs
from kankaku.scenarios.drafts.sketch import DraftTrip, Sketch, Stop, TripCall
from kankaku.scenarios.drafts.stock_library import library_train
from kankaku.scenarios.drafts.whole_minutes import (
    DWELL_S,
    LEAST_DWELL_S,
    MinuteCall,
    MinuteTrip,
    in_seconds,
)
from kankaku.scenarios.importing.earth_places import along_km, identifiers
from kankaku.scenarios.importing.formats import SourceError, Wish
from kankaku.scenarios.importing.mini_tokyo_files import (
    DAY_BEGINS_MIN,
    TokyoLine,
    TokyoTrain,
    read_line_files,
)
from kankaku.scenarios.reading.cell_texts import clock
from kankaku.scenarios.reading.units import clock_of, whole_seconds

DEFAULT_TRAIN, DEFAULT_DAY = "metro", "Weekday"
SINGLE_SHARE = 0.4
"""Trains that meet at no more of all places than that run on a single line. [-]"""
ENOUGH_MEETINGS = 50
"""Fewer say nothing about the track. [-]"""
TERMS = (
    "MIT licence, Copyright (c) 2019-2026 Akihiko Kusanagi (Mini Tokyo 3D, "
    "github.com/nagix/mini-tokyo-3d); the times come from the operators"
)


def read(source: Path, wish: Wish) -> Draft:
    """
    Read a timetable.

    Parameters
    ----------
    source
        A timetable such as ``twr-rinkai.json``; ``stations*.json`` and ``railways*.json`` stand
        in the same folder.
    wish
        ``route`` where the file has several lines; ``day``, the name of a calendar such as
        ``weekday`` or ``holiday``, or a date; ``from_time``, ``until_time``, ``train``,
        ``single_track``.

    Returns
    -------
    Draft
        The scenario.

    Raises
    ------
    SourceError
        With everything that is wrong with the files or the wishes.
    DraftError
        If no line can be laid out.
    """
    window_s = _window_s(wish)
    line = read_line_files(source, wish.route)
    calendar = _calendar(line, wish.day)
    trains = [train for train in line.trains if train.calendar == calendar]
    notes = SourceNotes(f"Mini Tokyo 3D, {source.name}: {line.title}, calendar {calendar}.", TERMS)
    _note_taken(notes, line, wish)
    stops = _stops(line)
    whole_day = _minute_trips(
        trains, {s.key: stop.id for s, stop in zip(line.stations, stops, strict=True)}, stops
    )
    kept = [
        trip for trip in whole_day if window_s[0] <= 60 * trip.calls[0].first_min <= window_s[1]
    ]
    title = f"{line.title}, {calendar.lower()}"
    entry = library_train(wish.train or DEFAULT_TRAIN)
    types = {"train": entry.entry}
    single = _is_single(notes, stops, whole_day, wish)
    sketch = Sketch(title, notes, stops, (), types, single_track=single)
    timed = in_seconds(kept, Runs(sketch), single_track=single) if kept else None
    sketch.trips = timed.trips if timed else ()
    _note_train(notes, line, entry.title, trains, wish)
    _note_times(notes, timed.hurried if timed else ())
    _circulate(sketch, _by_id(trains), whole_day)
    return completed(sketch)


def _window_s(wish: Wish) -> tuple[int, int]:
    """Return the times between which trains may begin. [s]"""
    mistakes, found = [], []
    for option, told, default in (
        ("--from", wish.from_time, "00:00:00"),
        ("--until", wish.until_time, "99:59:59"),
    ):
        time = clock(told or default)
        if time is None:
            mistakes.append(f"{option}: {told!r} is not a time; allowed: HH:MM:SS")
        found.append(whole_seconds(time or default))
    if mistakes:
        raise SourceError(tuple(mistakes))
    return found[0], found[1]


def _calendar(line: TokyoLine, day: str) -> str:
    """Return the calendar that is asked for; a working day where nobody asks."""
    known = sorted({train.calendar for train in line.trains})
    asked = day or DEFAULT_DAY
    if asked.isdigit() and len(asked) == 8:
        try:
            weekday = datetime.strptime(asked, "%Y%m%d").weekday()  # noqa: DTZ007 - a day, no time
        except ValueError:
            raise SourceError((f"--day: {day!r} is no date; allowed: YYYYMMDD",)) from None
        asked = "Saturday" if weekday == 5 else "Holiday" if weekday == 6 else "Weekday"
    matching = [name for name in known if name.lower() == asked.lower()]
    matching = matching or [name for name in known if asked.lower() in name.lower()]
    if not matching and not day and len(known) == 1:
        return known[0]
    if len(matching) != 1:
        allowed = suggesting(asked, known, ", ".join(known) or "a timetable with trains")
        where = line.where["trains"]
        raise SourceError((f"{where}: no calendar {asked!r}; allowed: --day with {allowed}",))
    return matching[0]


def _stops(line: TokyoLine) -> tuple[Stop, ...]:
    names = identifiers(station.key.rpartition(".")[2] for station in line.stations)
    places_km = along_km([(station.lon_deg, station.lat_deg) for station in line.stations])
    return tuple(
        Stop(name, one.name, km, one.name_local, one.lon_deg, one.lat_deg)
        for name, one, km in zip(names, line.stations, places_km, strict=True)
    )


def _by_id(trains: Sequence[TokyoTrain]) -> dict[str, TokyoTrain]:
    return dict(
        zip(identifiers((train.number for train in trains), small=False), trains, strict=True)
    )


def _minute_trips(
    trains: Sequence[TokyoTrain], id_of: Mapping[str, str], stops: Sequence[Stop]
) -> list[MinuteTrip]:
    order = {stop.id: number for number, stop in enumerate(stops)}
    made = []
    for name, train in _by_id(trains).items():
        calls = tuple(MinuteCall(id_of[station], *times) for station, *times in train.calls)
        rises = order[calls[-1].station] > order[calls[0].station]
        made.append(MinuteTrip(name, "train", calls, rises))
    return sorted(made, key=lambda trip: (trip.calls[0].first_min, trip.id))


def _is_single(
    notes: SourceNotes, stops: tuple[Stop, ...], trips: Sequence[MinuteTrip], wish: Wish
) -> bool:
    """Return whether trains meet at few places only, all day long; or what was asked for."""
    if wish.single_track is not None:
        asked = "single" if wish.single_track else "double"
        notes.assume("track", asked, "asked for with the command")
        return wish.single_track
    rough = tuple(
        DraftTrip(
            trip.id,
            trip.train_type,
            tuple(TripCall(c.station, 60 * c.first_min, 60 * c.last_min) for c in trip.calls),
        )
        for trip in trips
    )
    met = meeting_places(Sketch("", notes, stops, rough, {}))
    places = 2 * len(stops) - 1
    most = sorted(met.values(), reverse=True)
    needed = next((n for n in range(len(most)) if sum(most[:n]) >= 0.95 * sum(most)), len(most))
    single = sum(most) >= ENOUGH_MEETINGS and needed <= SINGLE_SHARE * places
    notes.assume(
        "track",
        "single, with loops" if single else "double",
        f"95 % of {sum(most)} meetings of the day lie at {needed} of {places} places "
        f"(stations, and stretches between); up to {SINGLE_SHARE:.0%} of them count as single",
    )
    return single


def _circulate(
    sketch: Sketch, train_of: Mapping[str, TokyoTrain], whole_day: Sequence[MinuteTrip]
) -> None:
    """Join stock: first as the file says, then first in, first out; note who comes and goes."""
    notes, trips = sketch.notes, {trip.id: trip for trip in sketch.trips}
    id_of = {train_of[trip.id].key: trip.id for trip in whole_day}
    coming = {name for name in trips if _elsewhere(train_of[name].before, id_of)}
    going = {name for name in trips if _elsewhere(train_of[name].after, id_of)}
    told = {}
    for name, trip in trips.items():
        for key in train_of[name].after:
            follower = trips.get(id_of.get(key, ""))
            if follower and _turns(sketch, trip, follower):
                told[name] = follower.id
    named = tuple(
        DraftTrip(trip.id, trip.train_type, trip.calls, told.get(trip.id, ""))
        for trip in sketch.trips
    )
    rises = {trip.id: sketch.rises(trip) for trip in named}
    sketch.trips = linked(named, sketch.minimum_turn_back_s, rises, coming=coming, going=going)
    if told:
        notes.take(f"circulation of {len(told)} trains", "key nt of trains")
    joined = sum(1 for trip in sketch.trips if trip.next_trip) - len(told)
    notes.assume(
        "circulation",
        f"{joined} trains go on with the stock of the one that came first, after "
        f"{sketch.minimum_turn_back_s:g} s or more and within {LONGEST_STAY_S:g} s; other stock "
        "leaves the line, or comes onto it",
        "the timetable does not tell the stock of trains that turn back",
    )
    if coming or going:
        notes.miss(
            f"other lines, from which {len(coming)} trains come and to which {len(going)} go on",
            "they begin and end at the last station of this line, and stand at its platforms",
        )


def _elsewhere(keys: Sequence[str], own: Mapping[str, str]) -> bool:
    return bool(keys) and not any(key in own for key in keys)


def _turns(sketch: Sketch, trip: DraftTrip, follower: DraftTrip) -> bool:
    """Return whether stock can go on as another trip, the other way."""
    ends, begins = trip.calls[-1], follower.calls[0]
    return (
        ends.station == begins.station
        and sketch.rises(trip) is not sketch.rises(follower)
        and begins.departure_s >= ends.arrival_s + sketch.minimum_turn_back_s
    )


def _note_taken(notes: SourceNotes, line: TokyoLine, wish: Wish) -> None:
    where = line.where
    notes.take("order of stations, name of the line", f"{where['railways']}, line {line.key}")
    notes.take("names, local names and coordinates of stations", where["stations"])
    notes.take("trains, their numbers and times in whole minutes", where["trains"])
    if wish.from_time or wish.until_time:
        begin, end = (clock_of(time_s) for time_s in _window_s(wish))
        notes.miss(f"trains that begin before {begin} or after {end}", "they were not asked for")
    notes.assume(
        "chainage",
        "great circles from station to station, the first one at km 0",
        "the files have no track; curves make real lines longer",
    )
    notes.assume(
        "day",
        f"times before {DAY_BEGINS_MIN // 60}:00 belong to the day before",
        "the files count hours anew at midnight",
    )
    notes.miss("limits, gradients, curves", "the line is level and straight")


def _note_train(
    notes: SourceNotes, line: TokyoLine, title: str, trains: Sequence[TokyoTrain], wish: Wish
) -> None:
    why = "asked for with the command" if wish.train else "the files have no trains"
    notes.assume("train", f"{wish.train or DEFAULT_TRAIN} of the library: {title}", why)
    if line.cars is not None:
        notes.miss(f"trains of {line.cars} cars", "all trains are as long as that of the library")
    kinds = sorted({train.kind for train in trains if train.kind})
    if len(kinds) > 1:
        notes.miss(f"kinds of trains ({', '.join(kinds)})", "all are of one train type")


def _note_times(notes: SourceNotes, hurried: Sequence[str]) -> None:
    notes.assume(
        "seconds",
        "every published time stays within its minute; runs and dwells as near as can be to their "
        f"means over the day, dwells to {DWELL_S} s, {LEAST_DWELL_S} s or more",
        "the files have whole minutes",
    )
    if hurried:
        notes.miss(
            f"enough time for the train on {len(hurried)} legs ({', '.join(hurried[:6])}"
            f"{', ...' if len(hurried) > 6 else ''})",
            "their published minutes are fewer than this train needs, which is late there",
        )
