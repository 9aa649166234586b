"""Stations as somebody types them, or keeps them in a table of names and kilometres."""

import csv
import io
import re
import unicodedata
from collections.abc import Iterable, Sequence
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import NamedTuple

from kankaku.scenarios.drafts.sketch import Stop
from kankaku.scenarios.drafts.unused_names import unused
from kankaku.scenarios.reading.cell_texts import text_trouble

OPTION = "--stations"
MOST_STATIONS = 200
"""Of a line. [-]"""
FARTHEST_KM = 1000.0
NEAREST_KM = 0.05
"""Between two stations; platforms need more. [km]"""
LONGEST_ID = 20
"""Names of tracks hold two of them. [-]"""
MOST_TOLD = 8
_WORDS = frozenset({"up", "down", "end", "low", "high"})
"""Names of tracks and nodes end with these."""


class StationsRead(NamedTuple):
    """Stations, or what is wrong with them."""

    stops: tuple[Stop, ...]
    mistakes: tuple[str, ...]


class _Named(NamedTuple):
    where: str
    name: str
    km: str


def stations_of(told: str) -> StationsRead:
    """
    Read stations from a text, or from a table that it names.

    Parameters
    ----------
    told
        ``Airport 0, Park 1.1``, or the path of a CSV file with a name and a chainage in each row,
        and a header if it likes.

    Returns
    -------
    StationsRead
        Stations by rising chainage, and every mistake as a sentence.
    """
    if told.strip().lower().endswith(".csv"):
        return _from_file(Path(told.strip()))
    parts = [part.strip() for part in re.split(r"[,;\n]", told) if part.strip()]
    named = []
    for number, part in enumerate(parts, 1):
        name, _, km = part.rpartition(" ")
        named.append(_Named(f"{OPTION}: station {number}, {part!r}", name.strip(), km))
    return _checked(named)


def _from_file(path: Path) -> StationsRead:
    try:
        text = path.read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        told = getattr(error, "strerror", None) or "is no text in UTF-8"
        return StationsRead((), (f"{OPTION}: {path}: {told}; allowed: a CSV file: name,km",))
    delimiter = ";" if text.partition("\n")[0].count(";") else ","
    try:
        rows = list(csv.reader(io.StringIO(text), delimiter=delimiter, strict=True))
    except csv.Error as error:
        return StationsRead((), (f"{OPTION}: {path}: {error}; allowed: a CSV file: name,km",))
    named, mistakes = [], []
    for number, row in enumerate(rows, 1):
        cells = [cell.strip() for cell in row]
        if not any(cells):
            continue
        where = f"{OPTION}: {path.name}: row {number}"
        if len(cells) < 2:
            mistakes.append(f"{where}: one cell; allowed: a name and a chainage in km")
        elif number > 1 or _number(cells[1]) is not None:
            named.append(_Named(where, cells[0], cells[1]))
    read = _checked(named)
    return StationsRead(read.stops, (*mistakes, *read.mistakes))


def _number(text: str) -> float | None:
    plain = text.strip().removesuffix("km").strip()
    try:
        number = float(plain)
    except ValueError:
        return None
    return number if isfinite(number) else None


def _checked(named: Sequence[_Named]) -> StationsRead:
    mistakes: list[str] = []
    if not 2 <= len(named) <= MOST_STATIONS:
        allowed = f'2 to {MOST_STATIONS}, e.g. "Airport 0, Park 1.1, City 2.3"'
        mistakes.append(f"{OPTION}: {len(named)} stations; allowed: {allowed}")
    places: list[tuple[_Named, float]] = []
    for station in named:
        km = _number(station.km)
        if not station.name:
            mistakes.append(f"{station.where}: no name; allowed: a name, a space and a chainage")
        elif trouble := text_trouble(station.name):
            mistakes.append(f"{station.where}: the name {trouble}; allowed: a name to read")
        elif km is None:
            allowed = "a name, a space and a chainage in km, with a point: Park 1.1"
            mistakes.append(f"{station.where}: {station.km!r} is no number; allowed: {allowed}")
        elif abs(km) > FARTHEST_KM:
            allowed = f"up to {FARTHEST_KM:g} km; metres are not asked for"
            mistakes.append(f"{station.where}: {km:g} km is too far; allowed: {allowed}")
        else:
            places.append((station, round(km, 3)))
    for (before, before_km), (station, km) in pairwise(places):
        if km < before_km + NEAREST_KM:
            allowed = f"from {before_km + NEAREST_KM:g} on: stations stand in order"
            problem = f"{km:g} km does not lie beyond {before.name!r} at {before_km:g} km"
            mistakes.append(f"{station.where}: {problem}; allowed: {allowed}")
    names = [station.name.casefold() for station, _ in places]
    mistakes += [
        f"{station.where}: there are two of that name; allowed: a name of its own"
        for at, (station, _) in enumerate(places)
        if names[at] in names[:at]
    ]
    if mistakes:
        return StationsRead((), tuple(mistakes))
    ids = identifiers(station.name for station, _ in places)
    stops = (Stop(own, station.name, km) for own, (station, km) in zip(ids, places, strict=True))
    return StationsRead(tuple(stops), ())


def identifiers(names: Iterable[str]) -> list[str]:
    """
    Return short identifiers for names.

    Parameters
    ----------
    names
        Names in any letters.

    Returns
    -------
    list[str]
        Small Latin letters, digits and ``_``, each one once.
    """
    found: list[str] = []
    for name in names:
        plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode().lower()
        stem = re.sub(r"[^a-z0-9]+", "_", plain).strip("_")[:LONGEST_ID].strip("_") or "station"
        if stem[0].isdigit() or stem in _WORDS:
            stem = f"s{stem}"
        found.append(unused(stem, found, "_"))
    return found
