"""A regular timetable for a line that is there already, on its own tracks."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil
from pathlib import Path
from typing import Any, NamedTuple

from kankaku.railway.errors import suggesting
from kankaku.railway.plan.scenario import MAIN_FILE
from kankaku.scenarios.checks.line_tables import LineTables
from kankaku.scenarios.drafts.draft import csv_text
from kankaku.scenarios.drafts.line_answers import figure_of, times_of, workings_of
from kankaku.scenarios.drafts.own_line import OwnLineError, throat_s, too_short
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.regular_times import (
    Regular,
    RegularTrips,
    Working,
    booked_of,
    regular_trips,
)
from kankaku.scenarios.drafts.runs import Runs, train_types_of
from kankaku.scenarios.drafts.single_line_times import least_single_headway, single_trips
from kankaku.scenarios.drafts.sketch import DraftTrip, Sketch, Stop
from kankaku.scenarios.drafts.stays import CLEARING_S, SHARE_OF_DWELL
from kankaku.scenarios.loading.load_line import read_line
from kankaku.scenarios.loading.load_stock import STOCK_FILE
from kankaku.scenarios.reading.files import Reader
from kankaku.scenarios.reading.mistakes import ScenarioError
from kankaku.scenarios.reading.row_formats import CallRow, DwellStationRow, ServiceRow
from kankaku.scenarios.reading.units import clock_of

SERVICES, CALLS, DWELLS = "services.csv", "calls.csv", "dwell_stations.csv"
USUAL_DWELL_S, USUAL_TURN_S, USUAL_HEADWAY_S = 30, 120, 300


@dataclass(frozen=True, slots=True)
class TimetableAnswers:
    """Texts as they were typed; an empty one was not said."""

    headway: str = ""
    from_time: str = ""
    until_time: str = ""
    pattern: str = ""
    turn_back: str = ""
    dwell: str = ""
    supplement: str = ""
    train_type: str = ""


class MadeTimetable(NamedTuple):
    """Files, and what the timetable takes."""

    files: Mapping[str, str]
    booked: RegularTrips
    asked: Regular
    tracks: Mapping[str, int]
    """Platform tracks where trains turn back, by station."""


class _Read(NamedTuple):
    line: LineTables
    dwells: Mapping[str, DwellStationRow]
    sketch: Sketch
    turn_back_s: int


def made_timetable(folder: Path, answers: TimetableAnswers) -> MadeTimetable:
    """
    Make services and calls for a scenario; nothing is written.

    Parameters
    ----------
    folder
        With line and rolling stock; what it has of a timetable is not read, but for its dwells.
    answers
        What was typed.

    Returns
    -------
    MadeTimetable
        Text by file; ``dwell_stations.csv`` only if it was missing.

    Raises
    ------
    ScenarioError
        With everything that is wrong with the files of line and stock.
    OwnLineError
        With everything that is wrong with what was typed, or the least headway.
    DraftError
        With what is wrong with a train type.
    """
    read = _read(folder)
    asked = _asked(read, answers)
    sketch, stations = read.sketch, [stop.id for stop in read.sketch.stops]
    runs = Runs(sketch)

    def run_s(start: str, end: str) -> float:
        return runs.between_s(start, end, asked.train_type)

    ends = {end for working in asked.workings for end in working}
    tracks = {end: len(_turning(read.line, end)) for end in ends} if asked.reversing else {}
    if sketch.single_track:
        least_s, (one, other) = least_single_headway(stations, run_s, asked)
        if asked.headway_s < least_s:
            told = f"--headway: {asked.headway_s} s is too short for a single track"
            why = f"{one!r} to {other!r} and back takes that"
            raise OwnLineError([f"{told}; allowed: {least_s} s or more, since {why}"])
        booked = single_trips(stations, run_s, asked)
    else:
        turns = any(tracks.values())
        if turns and (told := too_short(asked.headway_s, asked, asked.most_tracks)):
            raise OwnLineError([told])
        booked = regular_trips(stations, run_s, asked)
    booked = _where_stock_turns(booked, {end for end, count in tracks.items() if not count}, asked)
    calls = _calls(read, asked, booked)
    trips = sorted(booked.trips, key=lambda trip: trip.calls[-1].departure_s)
    services = [ServiceRow(0, trip.id, trip.train_type, trip.next_trip) for trip in trips]
    files = {SERVICES: csv_text(services), CALLS: csv_text(calls)}
    if not (folder / DWELLS).exists():
        files[DWELLS] = csv_text([*read.dwells.values()])
    return MadeTimetable(files, booked, asked, tracks)


def _read(folder: Path) -> _Read:
    reader = Reader()
    main = reader.toml(folder / MAIN_FILE, "scenario") or {}
    line = read_line(reader, folder)
    stock = _stock(folder, main)
    dwell_rows: Sequence[DwellStationRow] = ()
    if (folder / DWELLS).exists():
        dwell_rows = reader.csv(folder / DWELLS, "timetable", DwellStationRow).rows
    if reader.mistakes:
        raise ScenarioError(tuple(reader.mistakes))
    stops = tuple(Stop(row.id, row.name, row.chainage_km) for row in line.stations)
    turn_back = main.get("turn_back", {})
    turn_s = turn_back.get("minimum_s", USUAL_TURN_S) if isinstance(turn_back, Mapping) else 0
    sketch = Sketch(folder.resolve().name, SourceNotes(""), stops, (), stock)
    sketch.limits, sketch.gradients = list(line.limits), list(line.gradients)
    sketch.curves = list(line.curves)
    sketch.single_track = line.nodes.present and _is_single(line)
    usual: dict[str, DwellStationRow] = {}
    for row in dwell_rows:
        known = usual.get(row.station)
        # Long enough at any time of day.
        if known is None or row.booked_dwell_s > known.booked_dwell_s:
            usual[row.station] = row
    for stop in stops:
        least_s = round(SHARE_OF_DWELL * USUAL_DWELL_S)
        made = DwellStationRow(0, stop.id, float(least_s), float(USUAL_DWELL_S), 1.0)
        usual.setdefault(stop.id, made)
    return _Read(line, usual, sketch, ceil(turn_s) if isinstance(turn_s, int | float) else 0)


def _stock(folder: Path, main: Mapping[str, Any]) -> dict[str, Any]:
    named = main.get("rolling_stock", ".")
    place = folder / (named if isinstance(named, str) else ".") / STOCK_FILE
    try:
        data = tomllib.loads(place.read_text("utf-8"))
        types = data["train"]
    except (OSError, ValueError, KeyError) as error:
        told = f"{place}: cannot be read: {error}"
        raise OwnLineError([f"{told}; allowed: a file of train types"]) from error
    return dict(types) if isinstance(types, Mapping) else {}


def _is_single(line: LineTables) -> bool:
    """Return whether trains of both directions share a track between two stations."""
    at_km = {node.id: node.km for node in line.nodes}
    for one, other in pairwise(sorted(row.chainage_km for row in line.stations)):
        middle_km = 0.5 * (one + other)
        along = [
            link for link in line.links if at_km[link.from_node] <= middle_km < at_km[link.to_node]
        ]
        if len(along) == 1 and along[0].direction == "both":
            return True
    return False


def _asked(read: _Read, answers: TimetableAnswers) -> Regular:
    mistakes: list[str] = []
    sketch = read.sketch
    kinds = [*sketch.train_types]
    kind = answers.train_type or (kinds[0] if kinds else "")
    if kind not in kinds:
        told = suggesting(kind, kinds, ", ".join(kinds))
        mistakes.append(f"--train-type: {kind!r} is not in {STOCK_FILE}; allowed: {told}")
    begin_s, end_s = times_of(answers, mistakes)
    keys = ("headway", "turn_back", "dwell", "supplement")
    fields = {key: figure_of(answers, key, mistakes) for key in keys}
    turn_s = read.turn_back_s if fields["turn_back"] is None else int(fields["turn_back"])
    if turn_s < read.turn_back_s:
        told = f"--turn-back: {turn_s} s is below turn_back.minimum_s of {MAIN_FILE}"
        mistakes.append(f"{told}; allowed: {read.turn_back_s} s or more, or a change there")
    workings: tuple[Working, ...] = ()
    try:
        workings = workings_of(answers.pattern, sketch.stops)
    except OwnLineError as error:
        mistakes += error.sentences
    if sketch.single_track and len(workings) > 1:
        mistakes.append("--pattern: several workings; allowed: one on a single track")
    if mistakes:
        raise OwnLineError(mistakes)
    dwell_s = {
        name: round(row.booked_dwell_s if fields["dwell"] is None else fields["dwell"])
        for name, row in read.dwells.items()
    }
    reversing = read.line.nodes.present
    ends = {end for working in workings for end in working}
    turning = [len(_turning(read.line, end)) for end in ends] if reversing else []
    most = min((count for count in turning if count), default=99)
    return Regular(
        int(fields["headway"] or USUAL_HEADWAY_S),
        begin_s,
        end_s,
        workings,
        max(turn_s, 2 * max(dwell_s.values())),
        kind,
        dwell_s,
        (5.0 if fields["supplement"] is None else fields["supplement"]) / 100.0,
        throat_s(train_types_of(sketch)[kind]),
        most,
        reversing,
    )


def _where_stock_turns(booked: RegularTrips, nowhere: set[str], asked: Regular) -> RegularTrips:
    """Let stock come and go at ends where no track is for both directions."""
    lost = {trip.next_trip for trip in booked.trips if trip.calls[-1].station in nowhere}
    trips = []
    for trip in booked.trips:
        first = trip.calls[0]
        if trip.id in lost:
            begin_s = first.departure_s - asked.dwell_s[first.station]
            first = first._replace(arrival_s=begin_s)
        follower = "" if trip.calls[-1].station in nowhere else trip.next_trip
        trips.append(replace(trip, next_trip=follower, calls=(first, *trip.calls[1:])))
    return booked_of(trips, booked.stretched_s)


def _platforms(line: LineTables, station: str) -> dict[str, str]:
    """Return the platform tracks of a station, and the direction of each."""
    ways = {link.id: link.direction for link in line.links} if line.nodes.present else {}
    return {
        row.track: ways.get(row.track, "rising") for row in line.platforms if row.station == station
    }


def _turning(line: LineTables, station: str) -> list[str]:
    return [track for track, way in _platforms(line, station).items() if way == "both"]


def _calls(read: _Read, asked: Regular, booked: RegularTrips) -> list[CallRow]:
    """Bring trains onto platform tracks: in turn where trains of both directions use one."""
    before = {trip.next_trip: trip for trip in booked.trips if trip.next_trip}
    by_id = {trip.id: trip for trip in booked.trips}
    at_km = read.sketch.at_km
    track_of: dict[tuple[str, str], str] = {}
    free_s: dict[tuple[str, str], int] = {}
    stays = sorted(
        (call.arrival_s, call.departure_s, number, trip.id)
        for trip in booked.trips
        for number, call in enumerate(trip.calls)
        if number or trip.id not in before
    )
    for start_s, leaves_s, number, name in stays:
        trip = by_id[name]
        station = trip.calls[number].station
        rises = at_km[trip.calls[-1].station] > at_km[trip.calls[0].station]
        turning = number in {0, len(trip.calls) - 1} and asked.reversing
        tracks = _candidates(read.line, station, rises=rises, turning=turning)
        follower = by_id.get(trip.next_trip) if number == len(trip.calls) - 1 else None
        end_s = follower.calls[0].departure_s if follower else leaves_s
        if len(tracks) == 1:
            track = tracks[0]
        else:
            track = min(tracks, key=lambda one: free_s.get((station, one), 0))
        if turning and free_s.get((station, track), 0) > start_s:
            raise OwnLineError([_no_track(asked, station, len(tracks), end_s - start_s)])
        free_s[station, track] = end_s + CLEARING_S
        track_of[name, station] = track
        if follower:
            track_of[follower.id, station] = track
    return [_call(trip, at, track_of) for trip in booked.trips for at in range(len(trip.calls))]


def _no_track(asked: Regular, station: str, tracks: int, turn_s: int) -> str:
    least_s = ceil((turn_s + CLEARING_S) / tracks)
    return (
        f"--headway: {asked.headway_s} s is too short for the {tracks} tracks of {station!r}, "
        f"where trains stand for {turn_s} s; allowed: {least_s} s or more"
    )


def _candidates(line: LineTables, station: str, *, rises: bool, turning: bool) -> list[str]:
    ways = _platforms(line, station)
    own = [track for track, way in ways.items() if way == ("rising" if rises else "falling")]
    both = [track for track, way in ways.items() if way == "both"]
    found = (both or own) if turning else (own[:1] or both)
    if not found:
        way = "rising" if rises else "falling"
        told = f"platforms.csv: no platform of {station!r} for {way} trains"
        raise OwnLineError([f"{told}; allowed: one on a track of that direction"])
    return found


def _call(trip: DraftTrip, at: int, track_of: Mapping[tuple[str, str], str]) -> CallRow:
    call = trip.calls[at]
    times = clock_of(call.arrival_s), clock_of(call.departure_s)
    return CallRow(0, trip.id, call.station, track_of[trip.id, call.station], *times)
