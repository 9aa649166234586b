"""A line of a GTFS feed as a scenario."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import date
from itertools import pairwise
from pathlib import Path

from kankaku.scenarios.drafts.completing import completed
from kankaku.scenarios.drafts.draft import Draft, DraftError
from kankaku.scenarios.drafts.overtaking import kept_in_order
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.runs import Runs
from kankaku.scenarios.drafts.sketch import DraftTrip, Sketch, Stop
from kankaku.scenarios.drafts.station_sizes import least_apart_m
from kankaku.scenarios.drafts.stock_library import LibraryTrain, library_train
from kankaku.scenarios.importing.formats import SourceError, Wish
from kankaku.scenarios.importing.gtfs_days import (
    ServiceDays,
    asked_day,
    busiest_day,
    digits_of,
    read_services,
)
from kankaku.scenarios.importing.gtfs_distances import chainages_km
from kankaku.scenarios.importing.gtfs_files import FeedFiles, refuse
from kankaku.scenarios.importing.gtfs_order import along, line_order
from kankaku.scenarios.importing.gtfs_stations import identifiers, stations_of
from kankaku.scenarios.importing.gtfs_stock import with_stock
from kankaku.scenarios.importing.gtfs_tables import (
    FeedRoute,
    FeedStop,
    FeedTrip,
    chosen_route,
    origin_of,
    read_calls,
    read_frequencies,
    read_routes,
    read_shapes,
    read_stops,
    read_trips,
)
from kankaku.scenarios.importing.gtfs_times import TimesTold, booked_calls
from kankaku.scenarios.importing.gtfs_trips import DayTrip, day_trips
from kankaku.scenarios.reading.cell_texts import clock
from kankaku.scenarios.reading.mistakes import Mistake, row_place
from kankaku.scenarios.reading.units import clock_of, whole_seconds

DEFAULT_TRAIN = "metro"
LONGEST_TRAIN_ID = 48
"""Characters. [-]"""
_NEVER_S = 360_000


def read(source: Path, wish: Wish) -> Draft:
    """
    Read a line of a feed.

    Parameters
    ----------
    source
        A folder or a zip archive.
    wish
        Route, day, times and train.

    Returns
    -------
    Draft
        A scenario of one day of the route.

    Raises
    ------
    SourceError
        With everything that is wrong with the feed, or if what is asked for is not in it.
    DraftError
        If no scenario can be made of it.
    """
    window_s = _window_s(wish)
    asked = asked_day(wish.day)
    train = library_train(wish.train or DEFAULT_TRAIN)
    notes = SourceNotes("")
    files = FeedFiles(source, notes)
    publisher, attributed = origin_of(files)
    notes.origin = f"GTFS feed {source.name}" + (f": {publisher}." if publisher else ".")
    told = [f"see {name} of the feed" for name in files.licences]
    told = told or ["the feed does not name a licence"]
    notes.terms = "; ".join([*told, *([f"it attributes {attributed}"] if attributed else [])]) + "."
    routes = read_routes(files)
    _refuse_any(files)
    route = chosen_route(routes, wish.route)
    notes.take(f"route {route.told}", "routes.txt")
    trips = _trips_of_day(files, route, asked, notes)
    trains, stops = _trains(files, trips, notes)
    _note_train(train, wish, route, notes)
    return _drawn(files, route, (trains, stops), train, window_s, notes)


def _window_s(wish: Wish) -> tuple[int, int]:
    """Return between which times trains begin. [s]"""
    found, faults = [], []
    for option, text, default_s in (
        ("--from", wish.from_time, 0),
        ("--until", wish.until_time, _NEVER_S),
    ):
        told = clock(text.strip()) if text else None
        if text and told is None:
            faults.append(f"{option}: {text[:60]!r} is no time; allowed: HH:MM:SS, hours 0 to 99")
        found.append(whole_seconds(told) if told else default_s)
    if not faults and found[1] < found[0]:
        faults.append(f"--until: {wish.until_time} is before --from; allowed: a later time")
    if faults:
        raise SourceError(tuple(faults))
    return found[0], found[1]


def _refuse_any(files: FeedFiles) -> None:
    if files.mistakes:
        refuse(files.mistakes)


def _trips_of_day(
    files: FeedFiles, route: FeedRoute, asked: date | None, notes: SourceNotes
) -> list[FeedTrip]:
    """Return the trips of a route on the day that is asked for, or on the busiest one."""
    trips = read_trips(files, route)
    _refuse_any(files)
    if not trips:
        raise SourceError(
            (f"trips.txt: route {route.told} has no trips; allowed: another --route",)
        )
    services = read_services(files, {trip.service for trip in trips})
    _refuse_any(files)
    lost = {trip.service for trip in trips} - {*services}
    if lost:
        what = f"services {', '.join(sorted(lost)[:8])}, which no calendar has"
        notes.miss(what, "their trips run on no day")
    day = asked or _busiest(files, trips, services, notes)
    running = [
        trip for trip in trips if trip.service in services and services[trip.service].runs_on(day)
    ]
    if not running:
        best = _busiest(files, trips, services, None)
        problem = f"no trip of route {route.told} runs on {digits_of(day)}"
        raise SourceError((f"--day: {problem}; allowed: for example {digits_of(best)}",))
    named = sorted({trip.service for trip in running})
    source = "calendar.txt, calendar_dates.txt"
    notes.take(f"trips of {day:%A} {day.isoformat()}: services {', '.join(named[:8])}", source)
    return running


def _busiest(
    files: FeedFiles,
    trips: Sequence[FeedTrip],
    services: dict[str, ServiceDays],
    notes: SourceNotes | None,
) -> date:
    """Return the day with most trips, repeated ones counted as often as they run."""
    counts: dict[str, int] = {}
    times = dict.fromkeys((trip.id for trip in trips), 1)
    for item in read_frequencies(files, {trip.id for trip in trips}):
        times[item.trip] += (item.end_s - item.start_s) // item.headway_s
    for trip in trips:
        counts[trip.service] = counts.get(trip.service, 0) + times[trip.id]
    day = busiest_day(services, counts)
    if day is None:
        names = ", ".join(sorted(counts)[:8])
        allowed = "a calendar with days for them"
        raise SourceError((f"calendar.txt: services {names} run on no day; allowed: {allowed}",))
    if notes:
        notes.assume(
            "day", digits_of(day), "the first ordinary weekday with most trains; --day chooses"
        )
    return day


def _trains(
    files: FeedFiles, trips: Sequence[FeedTrip], notes: SourceNotes
) -> tuple[list[DayTrip], dict[str, FeedStop]]:
    """Return the trains of the day and the stops of all their calls."""
    names = {trip.id for trip in trips}
    calls = read_calls(files, names)
    trains = day_trips(files, trips, calls, read_frequencies(files, names), notes)
    used = {call.stop: call.row for trip in trips for call in calls.get(trip.id, ())}
    stops = read_stops(files, {*used})
    files.mistakes += [
        Mistake(
            *("stop_times.txt", row_place(row, "stop_id"), f"there is no stop {name!r}"),
            "a stop_id of stops.txt",
        )
        for name, row in used.items()
        if name not in stops
    ]
    _refuse_any(files)
    if not trains:
        row = min(used.values(), default=1)
        problem = "no trip of the day has two calls with times, the first of them"
        allowed = "two or more in a trip; another --day, or another --route"
        raise SourceError((f"stop_times.txt: row {row}: {problem}; allowed: {allowed}",))
    notes.take("booked times", "stop_times.txt")
    notes.take("stations", "stops.txt")
    return trains, stops


def _note_train(train: LibraryTrain, wish: Wish, route: FeedRoute, notes: SourceNotes) -> None:
    if wish.train:
        notes.take(f"train {train.title}: {train.source}", f"library: {train.name}")
    else:
        why = "a feed does not say what runs; --train chooses another one"
        notes.assume("train", f"{train.title}, of the library: {train.name}", why)
    if train.assumed:
        notes.assume(f"figures of the train {train.name}", train.assumed, "its source has no more")
    if not route.on_rails:
        value = "trains on a railway with two tracks"
        notes.assume("vehicles", value, f"route_type {route.kind} is not on rails")
    notes.assume("tracks between stations", "two, one for each direction", "a feed has no tracks")
    notes.assume(
        "limits, gradients, curves", "none", "a feed has none; the train's own speed holds"
    )


def _drawn(
    files: FeedFiles,
    route: FeedRoute,
    found: tuple[list[DayTrip], dict[str, FeedStop]],
    train: LibraryTrain,
    window_s: tuple[int, int],
    notes: SourceNotes,
) -> Draft:
    """Return the scenario of the trains of a day."""
    whole_day, stops = found
    stations, station_of = stations_of(stops, whole_day, notes)
    order = line_order(whole_day, station_of)
    if len(order) < 2:
        raise SourceError(
            ("stop_times.txt: every trip has one station only; allowed: two or more",)
        )
    trains = along(whole_day, station_of, order, notes)
    shapes = read_shapes(files, {trip.shape for trip in trains if trip.shape})
    _refuse_any(files)
    line = [stations[name] for name in order]
    at_km = chainages_km(line, trains, stops, station_of, shapes, notes)
    length_m = float(train.entry["length_m"])
    placed = [
        Stop(one.id, one.name, km, "", one.lon_deg, one.lat_deg)
        for one, km in zip(line, at_km, strict=True)
    ]
    kept = _far_enough(placed, trains, station_of, least_apart_m(length_m), notes)
    title = " ".join(filter(None, (route.short_name, route.long_name))) or route.id
    sketch = Sketch(title, notes, kept, (), {train.name: train.entry})
    running = _in_window(_calling_at(trains, station_of, kept, notes), window_s, notes)
    ids = identifiers([trip.id for trip in running], LONGEST_TRAIN_ID)
    told, least = TimesTold(), Runs(sketch)

    def least_run_s(one: str, other: str) -> float:
        return least.between_s(one, other, train.name)

    booked = [
        DraftTrip(ids[trip.id], train.name, booked_calls(trip, station_of, least_run_s, told))
        for trip in running
    ]
    trips = kept_in_order(replace(sketch, trips=tuple(booked)))
    told.note(notes)
    rises = {trip.id: sketch.rises(trip) for trip in trips}
    blocks = {ids[trip.id]: trip.block for trip in running}
    linked, minimum_s = with_stock(trips, blocks, rises, notes)
    return completed(replace(sketch, trips=linked, minimum_turn_back_s=minimum_s))


def _far_enough(
    stops: Sequence[Stop],
    trains: Sequence[DayTrip],
    station_of: dict[str, str],
    least_m: float,
    notes: SourceNotes,
) -> tuple[Stop, ...]:
    """Return stations without those that lie too near to another one for such trains."""
    calls = dict.fromkeys((stop.id for stop in stops), 0)
    for trip in trains:
        for call in trip.calls:
            calls[station_of[call.stop]] += 1
    kept, out = [*stops], []
    while len(kept) > 2:
        gaps_m = [1000.0 * (b.chainage_km - a.chainage_km) for a, b in pairwise(kept)]
        near = min(range(len(gaps_m)), key=gaps_m.__getitem__)
        if gaps_m[near] > least_m:
            break
        pair = [number for number in (near, near + 1) if 0 < number < len(kept) - 1]
        leaving = min(pair, key=lambda number: calls[kept[number].id])
        out.append(f"{kept[leaving].id} ({gaps_m[near]:.0f} m)")
        del kept[leaving]
    apart_m = 1000.0 * (kept[-1].chainage_km - kept[0].chainage_km)
    if apart_m <= least_m:
        where = f"stations {kept[0].id!r} and {kept[-1].id!r}"
        problem = f"the line is {apart_m:.0f} m long"
        raise DraftError(where, problem, f"more than {least_m:.0f} m with such trains")
    if out:
        effect = f"trains do not call there: such trains need {least_m:.0f} m between stations"
        notes.miss(f"stations too near to the next one: {', '.join(out)}", effect)
    return tuple(kept)


def _calling_at(
    trains: Sequence[DayTrip], station_of: dict[str, str], stops: Sequence[Stop], notes: SourceNotes
) -> list[DayTrip]:
    """Return trains with their calls at stations that are left, if two or more."""
    known = {stop.id for stop in stops}
    made, short = [], []
    for trip in trains:
        calls = tuple(call for call in trip.calls if station_of[call.stop] in known)
        if len(calls) < 2:
            short.append(trip.id)
        else:
            made.append(replace(trip, calls=calls))
    if short:
        told = f"{len(short)} trains that call at one such station only: {', '.join(short[:8])}"
        notes.miss(told, "they do not run")
    return made


def _in_window(
    trains: Sequence[DayTrip], window_s: tuple[int, int], notes: SourceNotes
) -> list[DayTrip]:
    """Return trains that begin between two times."""
    kept = [trip for trip in trains if window_s[0] <= trip.begins_s <= window_s[1]]
    if not kept:
        times = ", ".join(clock_of(time_s) for time_s in window_s)
        first, last = (clock_of(trip.begins_s) for trip in (trains[0], trains[-1]))
        problem = f"no train begins between {times}"
        raise SourceError((f"--from, --until: {problem}; allowed: between {first} and {last}",))
    if len(kept) < len(trains):
        what = f"{len(trains) - len(kept)} trains that begin before or after the times asked for"
        notes.miss(what, "they do not run, and nothing of them is on the line")
    return kept
