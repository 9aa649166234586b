"""Timetables of Mini Tokyo 3D as its files have them: trains, stations and lines as JSON."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from kankaku.railway.plan.earth import distance_m
from kankaku.scenarios.importing.formats import SourceError

_CLOCK = re.compile(r"([01]?\d|2[0-9]):([0-5]\d)")
DAY_BEGINS_MIN = 180
"""Earlier times belong to the day before. [min]"""


class TokyoStation(NamedTuple):
    """A station of a line."""

    key: str
    name: str
    name_local: str
    lon_deg: float
    lat_deg: float


class TokyoTrain(NamedTuple):
    """A train of the timetable file."""

    key: str
    number: str
    calendar: str
    calls: tuple[tuple[str, int | None, int | None], ...]
    """Station, arrival and departure. [min]"""
    before: tuple[str, ...]
    after: tuple[str, ...]
    kind: str


@dataclass
class TokyoLine:
    """A line with its trains."""

    key: str
    title: str
    stations: list[TokyoStation]
    trains: list[TokyoTrain]
    cars: int | None = None
    where: dict[str, str] = field(default_factory=dict)
    """Names of the files by what they hold."""


def read_line_files(source: Path, route: str) -> TokyoLine:
    """
    Read a timetable, and the stations and lines beside it.

    Parameters
    ----------
    source
        The timetable.
    route
        Identifier of the line, or its English title; needed if the file has several.

    Returns
    -------
    TokyoLine
        The line.

    Raises
    ------
    SourceError
        With everything that is wrong.
    """
    mistakes: list[str] = []
    trains = list(_entries(source, mistakes))
    stations_file, railways_file = (_beside(source, kind, mistakes) for kind in _KINDS)
    if mistakes:
        raise SourceError(tuple(mistakes))
    stations = list(_entries(stations_file, mistakes))
    railways = {str(entry.get("id")): entry for entry in _entries(railways_file, mistakes)}
    key = _line_key(source, trains, railways, route, mistakes)
    entry = railways.get(key, {})
    if key and not entry:
        mistakes.append(f"{railways_file.name}: no line {key!r}; allowed: a file that has it")
    if mistakes:
        raise SourceError(tuple(mistakes))
    order = _order(f"{railways_file.name}: line {key!r}", entry.get("stations"), mistakes)
    line = TokyoLine(
        key,
        _title(entry, "en") or key,
        list(_stations(stations_file.name, stations, order, mistakes)),
        [],
        entry.get("carComposition") if isinstance(entry.get("carComposition"), int) else None,
        {"trains": source.name, "stations": stations_file.name, "railways": railways_file.name},
    )
    for one, other in pairwise(line.stations):
        away_km = distance_m(one[3:], other[3:]) / 1000.0
        if away_km > MOST_APART_KM:
            place = f"{stations_file.name}: station {other.key!r}"
            problem = f"lies {away_km:.0f} km from {one.key!r}"
            mistakes.append(f"{place}: {problem}; allowed: up to {MOST_APART_KM:g} km")
    known = {station.key for station in line.stations}
    for number, train in enumerate(trains):
        if train.get("r") == key:
            place = f"{source.name}: train {train.get('id', number)}"
            line.trains += _trains(place, train, known, mistakes)
    if mistakes:
        raise SourceError(_fewer(mistakes))
    return line


_KINDS = ("stations", "railways")
MOST_APART_KM = 100.0
"""Two stations of a metropolitan line lie no further from each other. [km]"""
MOST_TOLD = 20
"""Mistakes. [-]"""


def _fewer(mistakes: Sequence[str]) -> tuple[str, ...]:
    told = tuple(dict.fromkeys(mistakes))
    if len(told) <= MOST_TOLD:
        return told
    return (*told[:MOST_TOLD], f"{len(told) - MOST_TOLD} more mistakes")


def _entries(path: Path, mistakes: list[str]) -> Iterator[Mapping[str, Any]]:
    """Yield the entries of a file, which is a list of objects."""
    try:
        data = json.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        mistakes.append(f"{path.name}: cannot be read: {error.strerror}; allowed: a JSON file")
        return
    except (ValueError, RecursionError) as error:
        told = " ".join(str(error).split())
        mistakes.append(f"{path.name}: is not JSON: {told}; allowed: a list of objects")
        return
    if not isinstance(data, list):
        mistakes.append(f"{path.name}: is not a list; allowed: a list of objects")
        return
    for number, entry in enumerate(data, 1):
        if isinstance(entry, dict):
            yield entry
        else:
            mistakes.append(f"{path.name}: entry {number}: not an object; allowed: an object")


def _beside(source: Path, kind: str, mistakes: list[str]) -> Path:
    """Return the file of stations or lines in the folder of a timetable."""
    found = sorted(path for path in source.parent.glob(f"{kind}*.json") if path != source)
    if len(found) != 1:
        problem = f"{len(found)} files {kind}*.json beside it" if found else f"no {kind}*.json"
        mistakes.append(f"{source.name}: {problem}; allowed: one of them in the same folder")
        return source
    return found[0]


def _line_key(
    source: Path,
    trains: Sequence[Mapping[str, Any]],
    railways: Mapping[str, Mapping[str, Any]],
    route: str,
    mistakes: list[str],
) -> str:
    keys = sorted({str(train.get("r")) for train in trains if train.get("r")})
    if route:
        matching = [key for key in keys if route in {key, _title(railways.get(key, {}), "en")}]
    else:
        matching = keys if len(keys) == 1 else []
    if len(matching) == 1:
        return matching[0]
    problem = f"no line {route!r}" if route else f"{len(keys)} lines"
    allowed = f"--route with one of {', '.join(keys)}" if keys else "trains with the key r"
    mistakes.append(f"{source.name}: {problem}; allowed: {allowed}")
    return ""


def _title(entry: Mapping[str, Any], language: str) -> str:
    title = entry.get("title")
    told = title.get(language) if isinstance(title, dict) else None
    return told if isinstance(told, str) else ""


def _order(place: str, told: object, mistakes: list[str]) -> list[str]:
    """Return the keys of a line's stations, in its order; none if there is no order."""
    keys = [key for key in told if isinstance(key, str)] if isinstance(told, list) else []
    if not isinstance(told, list) or len(keys) < 2 or len(keys) < len(told):
        mistakes.append(f"{place} has no order of stations; allowed: two or more")
        return []
    if len(set(keys)) < len(keys):
        mistakes.append(f"{place} calls twice at a station; allowed: lines that are no ring")
        return []
    return keys


def _stations(
    file: str, entries: Sequence[Mapping[str, Any]], order: Sequence[str], mistakes: list[str]
) -> Iterator[TokyoStation]:
    """Yield the stations of a line, in its order."""
    by_key = {entry.get("id"): entry for entry in entries if isinstance(entry.get("id"), str)}
    for key in order:
        entry = by_key.get(key, {})
        place = entry.get("coord")
        if not (isinstance(place, list) and len(place) == 2 and all(map(_is_number, place))):
            problem = "has no coordinates" if entry else "is not there"
            mistakes.append(f"{file}: station {key!r} {problem}; allowed: coord with two degrees")
            continue
        name = _title(entry, "en") or str(key).rpartition(".")[2]
        local = _title(entry, "ja")
        yield TokyoStation(str(key), name, local, float(place[0]), float(place[1]))


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= 180.0


def _trains(
    place: str, train: Mapping[str, Any], known: set[str], mistakes: list[str]
) -> Iterator[TokyoTrain]:
    """Yield a train if nothing is wrong with it."""
    rows, key, without_day = train.get("tt"), train.get("id"), train.get("t")
    if not isinstance(key, str) or not isinstance(rows, list) or len(rows) < 2:
        mistakes.append(f"{place}: no id, or fewer than two calls; allowed: id, and tt with calls")
        return
    calls: list[tuple[str, int | None, int | None]] = []
    before_min = -1
    for row in rows:
        station = row.get("s") if isinstance(row, dict) else None
        if not isinstance(station, str) or station not in known:
            mistakes.append(f"{place}: calls at {station!r}; allowed: a station of the line")
            return
        arrival, departure = (_minute(place, row.get(column), mistakes) for column in ("a", "d"))
        told = [time for time in (arrival, departure) if time is not None]
        if not told:
            mistakes.append(f"{place}: no time at {station!r}; allowed: a or d as HH:MM")
            return
        if told != sorted(told) or told[0] < before_min:
            mistakes.append(f"{place}: is earlier at {station!r}; allowed: times that rise")
            return
        before_min = told[-1]
        calls.append((station, arrival, departure))
    stem = without_day if isinstance(without_day, str) and key.startswith(without_day) else key
    number = train.get("n") if isinstance(train.get("n"), str) else stem.rpartition(".")[2]
    yield TokyoTrain(
        key,
        str(number),
        key[len(stem) :].strip(".") or "Weekday",
        tuple(calls),
        _names(train.get("pt")),
        _names(train.get("nt")),
        str(train.get("y", "")).rpartition(".")[2],
    )


def _names(value: object) -> tuple[str, ...]:
    return tuple(map(str, value)) if isinstance(value, list) else ()


def _minute(place: str, value: object, mistakes: list[str]) -> int | None:
    """Return a time in minutes after the midnight of the day of service."""
    if value is None:
        return None
    found = _CLOCK.fullmatch(value) if isinstance(value, str) else None
    if found is None:
        mistakes.append(f"{place}: {value!r} is not a time; allowed: HH:MM")
        return None
    minute = 60 * int(found[1]) + int(found[2])
    return minute + 1440 if minute < DAY_BEGINS_MIN else minute
