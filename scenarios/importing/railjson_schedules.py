"""Train schedules in RailJSON: those trains that run along a way from its first station."""

import re
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.runs import Runs
from kankaku.scenarios.drafts.sketch import DraftTrip, TripCall
from kankaku.scenarios.importing.one_way import DWELL_S, LATEST_S, OneWay
from kankaku.scenarios.importing.one_way_trips import ALLOWANCE
from kankaku.scenarios.importing.railjson_network import Spot
from kankaku.scenarios.importing.railjson_stock import railjson_stock
from kankaku.scenarios.importing.railjson_ways import RailjsonWay
from kankaku.scenarios.importing.source_keys import KeyPlace, SafeIds, read_json, whole_s

DURATION = re.compile(
    r"P(?:(\d{1,4})D)?(?:T(?:(\d{1,5})H)?(?:(\d{1,6})M)?(?:(\d{1,8}(?:\.\d{1,9})?)S)?)?"
)
"""ISO 8601, as far as it has no months and years."""
DAY_S = 86400
MOST_NAMED = 8


class NamedStock(NamedTuple):
    """Rolling stock of train schedules."""

    types: dict[str, dict[str, Any]]
    """Tables ``[train.NAME]`` by name."""
    called: dict[str, str]
    """Those names by what trains call them."""


class _Item(NamedTuple):
    """A place of a train's path."""

    station: str
    """Empty where it lies on the way, but at no station."""
    arrival_s: float | None
    """After the start. [s]"""
    stay_s: float | None


class _Train(NamedTuple):
    """A train before it has times."""

    name: str
    stock: str
    """What the source calls its rolling stock."""
    start: datetime
    items: tuple[_Item, ...]


def schedules_beside(source: Path) -> list[Path]:
    """
    Return the files of train schedules in the folder of an infrastructure.

    Parameters
    ----------
    source
        File of the infrastructure.

    Returns
    -------
    list[Path]
        In alphabetical order.
    """
    return sorted(path for path in source.parent.glob("train_schedules*.json") if path != source)


def stock_beside(source: Path, schedules: Sequence[Path], notes: SourceNotes) -> NamedStock | None:
    """
    Read the rolling stock of train schedules, each from the file that is called as it is.

    Parameters
    ----------
    source
        File of the infrastructure.
    schedules
        Files of trains.
    notes
        Of the scenario.

    Returns
    -------
    NamedStock | None
        Tables ``[train.NAME]`` by name, and those names by what trains call them; nothing unless
        there is a file for every train.

    Raises
    ------
    SourceError
        With everything that is wrong with the files.
    """
    names: dict[str, None] = {}
    for path in schedules:
        for place in read_json(path).items():
            names[_stock(place)] = None
    paths = {name: source.parent / f"{SafeIds().of(name)}.json" for name in names}
    if not names or not all(name and paths[name].is_file() for name in names):
        return None
    types: dict[str, dict[str, Any]] = {}
    called: dict[str, str] = {}
    ids = SafeIds()
    for name, path in paths.items():
        called[name] = ids.of(name)
        (types[called[name]],) = railjson_stock(path, notes).values()
    return NamedStock(types, called)


def _stock(place: KeyPlace) -> str:
    told = place.at("rolling_stock_name").value if place.has("rolling_stock_name") else ""
    return told[:200] if isinstance(told, str) else ""


def scheduled_trips(
    path: Path,
    line: OneWay,
    codes: Mapping[str, str],
    way: RailjsonWay,
    called: Mapping[str, str],
) -> tuple[DraftTrip, ...] | None:
    """
    Read the trains that run along a way.

    Parameters
    ----------
    path
        JSON file.
    line
        The line; what is taken, assumed and left out goes into its notes.
    codes
        Station by what trains call it.
    way
        The way of the line.
    called
        Train type by what the source calls rolling stock; the first type for all others.

    Returns
    -------
    tuple[DraftTrip, ...] | None
        As they are booked; nothing if none runs along the way from its first station.

    Raises
    ------
    SourceError
        With everything that is wrong with the file.
    """
    source = read_json(path)
    trains, away = [], []
    for place in source.items():
        train = _train(place, codes, way, line)
        if isinstance(train, str):
            away.append(train)
        else:
            trains.append(train)
    source.refuse()
    first = {line.stops[0].id}
    starting = [train for train in trains if train.items[0].station in first]
    away += [train.name for train in trains if train not in starting]
    if away:
        named = ", ".join(away[:MOST_NAMED]) + (" and so on" if len(away) > MOST_NAMED else "")
        what = f"{len(away)} trains of {path.name}: {named}"
        line.notes.miss(what, "their paths are not on the way, or begin behind its first station")
    if not starting:
        return None
    midnight = min(train.start for train in starting).replace(
        hour=0, minute=0, second=0, microsecond=0
    )
    ids, runs = SafeIds(), Runs(line.sketch, fronts=True)
    trips, usual = [], next(iter(line.train_types))
    for train in starting:
        kind = called.get(train.stock, usual)
        calls = _calls(train, (train.start - midnight).total_seconds(), runs, kind)
        if calls[-1].departure_s > LATEST_S:
            line.notes.miss(f"train {train.name}", "it ends after the fourth day")
            continue
        trips.append(DraftTrip(ids.of(train.name), kind, calls))
    notes = line.notes
    notes.take(f"{len(trips)} trains with start, stops and booked arrivals", path.name)
    value = f"{ALLOWANCE:g} times the least run times, in whole seconds"
    notes.assume("arrivals that are not booked", value, "the source leaves them to a calculation")
    notes.assume("stay at the first and last station", f"{DWELL_S} s", "the source has none")
    if not called:
        notes.assume("rolling stock", f"{usual!r} for all trains", "one train type was given")
    used = {trip.train_type for trip in trips} or {usual}
    line.train_types = {name: entry for name, entry in line.train_types.items() if name in used}
    notes.miss("margins, power restrictions and initial speeds of trains", "trains start at rest")
    return tuple(trips) or None


def _train(
    place: KeyPlace, codes: Mapping[str, str], way: RailjsonWay, line: OneWay
) -> _Train | str:
    """Return a train, or its name where it does not run along the way."""
    name = place.at("train_name").text()
    start = _start(place.at("start_time"))
    told = {
        item.at("at").text(): (
            _seconds(item, "arrival"),
            _seconds(item, "stop_for"),
        )
        for item in place.parts("schedule")
    }
    items, along_m, on = [], -1.0, True
    at_m = {stop.id: 1000.0 * stop.chainage_km for stop in line.stops}
    for item in place.at("path").items():
        if item.has("deleted") and item.at("deleted").value is True:
            on = False
            continue
        station = _station(item, codes)
        if station:
            here_m: float | None = at_m[station]
        elif item.has("track"):
            offset_m = item.at("offset").number(0.0, 1e9)
            here_m = way.place_m(Spot(item.at("track").text(), offset_m))
        else:
            here_m = None
        if here_m is None or here_m <= along_m:
            on = False
            continue
        along_m = here_m
        arrival_s, stay_s = told.get(item.at("id").text(), (None, None))
        items.append(_Item(station, arrival_s, stay_s))
    calls = [item for item in items if item.station]
    ends = bool(items) and bool(items[0].station) and bool(items[-1].station)
    stops_off = any(item.stay_s is not None and not item.station for item in items)
    if not on or len(calls) < 2 or not ends or stops_off:
        return name
    return _Train(name, _stock(place), start, tuple(calls))


def _station(item: KeyPlace, codes: Mapping[str, str]) -> str:
    for key in ("operational_point", "uic", "trigram"):
        if item.has(key):
            told = item.at(key).value
            return codes.get(str(told)[:200], "") if isinstance(told, str | int) else ""
    return ""


def _start(place: KeyPlace) -> datetime:
    """Return the clock of a start as it is written; time zones are left out."""
    try:
        return datetime.fromisoformat(place.text()).replace(tzinfo=None)
    except ValueError:
        place.wrong("is no time", "a date and a time of ISO 8601")
        return datetime(2000, 1, 1)  # noqa: DTZ001 - clocks without zones


def _seconds(item: KeyPlace, key: str) -> float | None:
    if not item.has(key):
        return None
    found = DURATION.fullmatch(item.at(key).text())
    if not found or not any(found.groups()):
        item.at(key).wrong("is no duration", "days to seconds as in ISO 8601, e.g. PT5M30S")
        return None
    parts = (DAY_S, 3600.0, 60.0, 1.0)
    return sum(float(told) * unit for told, unit in zip(found.groups(), parts, strict=True) if told)


def _calls(train: _Train, start_s: float, runs: Runs, kind: str) -> tuple[TripCall, ...]:
    """Return the calls at stations where a train stops, the first and the last ones included."""
    stopping: Sequence[_Item] = [
        item
        for number, item in enumerate(train.items)
        if number in {0, len(train.items) - 1} or item.stay_s is not None
    ]
    leaves_s = whole_s(start_s)
    calls = [TripCall(stopping[0].station, leaves_s - DWELL_S, leaves_s)]
    if leaves_s < DWELL_S:
        calls = [TripCall(stopping[0].station, 0, leaves_s)]
    for item in stopping[1:]:
        before = calls[-1]
        arrival_s = before.departure_s + whole_s(
            ALLOWANCE * runs.between_s(before.station, item.station, kind)
        )
        if item.arrival_s is not None:
            arrival_s = max(whole_s(start_s + item.arrival_s), before.departure_s)
        stay_s = DWELL_S if item.stay_s is None else whole_s(item.stay_s)
        calls.append(TripCall(item.station, arrival_s, arrival_s + stay_s))
    return tuple(calls)
