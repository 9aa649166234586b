"""Observed events in a CSV or Excel file: a row for each train at each station."""

import csv
import io
from collections import Counter
from collections.abc import Mapping, Sequence
from datetime import tzinfo
from pathlib import Path

from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.observing.event_times import (
    TIME_TEXT,
    midnight_s,
    service_day_s,
    time_s,
    zone_of,
)
from kankaku.scenarios.observing.visits import EventsError, ObservedEvents, Visit
from kankaku.scenarios.reading.cell_texts import shown
from kankaku.scenarios.reading.excel_sheets import ENDING, read_sheet
from kankaku.scenarios.reading.mistakes import also_in, row_place
from kankaku.scenarios.reading.raw import UnreadableError, read_whole

MOST_BYTES = 200_000_000
SYNONYMS: Mapping[str, Sequence[str]] = {
    "train": ("train", "trip_id", "train_id", "trip"),
    "station": ("station", "station_id", "parent_station", "stop_id", "stop"),
    "arrival": ("arrival", "arrival_time", "observed_arrival", "actual_arrival"),
    "departure": ("departure", "departure_time", "observed_departure", "actual_departure"),
    "name": ("station_name", "stop_name", "name"),
    "place": ("platform", "track", "stop_id"),
    "direction": ("direction", "direction_id"),
    "line": ("line", "route_id", "route"),
    "date": ("date", "service_date", "start_date", "day"),
    "booked arrival": ("booked_arrival", "scheduled_arrival"),
    "booked departure": ("booked_departure", "scheduled_departure"),
}
"""Names of columns that are understood, the likeliest first."""
NEEDED = ("train", "station", "arrival", "departure")
_TIMES = ("arrival", "departure", "booked arrival", "booked departure")
_EMPTY = frozenset({"", "null", "none", "na", "nan", "-"})


def read_event_table(path: Path, line: str = "", timezone: str = "") -> ObservedEvents:
    """
    Read observed events from a CSV or Excel file.

    Parameters
    ----------
    path
        The file.
    line
        Only events of this line; of all where it is empty.
    timezone
        Of the line, for times with an offset and for seconds since 1970.

    Returns
    -------
    ObservedEvents
        Every row with a time.

    Raises
    ------
    EventsError
        With every row that cannot be read.
    """
    zone = zone_of(timezone)
    header, rows = _records(path)
    columns = _columns(path.name, header)
    reader = _EventRows(path.name, header, columns, zone)
    lines: Counter[str] = Counter()
    for number, cells in rows:
        of_line = reader.cell(cells, "line")
        lines[of_line] += 1
        if not line or of_line.casefold() == line.casefold():
            reader.take(number, cells)
    known = sorted(filter(None, lines))
    if line and line.casefold() not in map(str.casefold, known):
        allowed = ", ".join(known) or "no line, because there is no such column"
        raise EventsError((f"{path.name}: no events of line {shown(line)}; allowed: {allowed}",))
    if told := reader.told():
        raise EventsError(tuple(told))
    notes = SourceNotes(f"Dwells were worked out from the observed events of `{path.name}`.")
    for meaning, column in columns.items():
        notes.take(meaning, f"column {column}")
    if len(known) > 1 and not line:
        notes.assume("line", ", ".join(known), "all of the source together; --line chooses one")
    _note(notes, reader, timezone)
    return ObservedEvents(reader.visits, notes, reader.names)


def _records(path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Return the names of the columns, and the rows that say anything with their numbers."""
    try:
        content = read_whole(path, MOST_BYTES)
        if content is not None and path.suffix.casefold() == ENDING:
            return _sheet_records(path, content)
        text = content.decode("utf-8-sig") if content is not None else ""
    except UnreadableError as error:
        told = f"{path.name}: {error.problem}; allowed: {error.allowed}"
        raise EventsError((told,)) from error
    except UnicodeDecodeError as error:
        told = f"{path.name}: bytes that are not UTF-8; allowed: text encoded as UTF-8"
        raise EventsError((told,)) from error
    if content is None:
        raise EventsError((f"{path}: the file is missing; allowed: a readable file",))
    separator = max(",;\t", key=text.partition("\n")[0].count)
    records = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    try:
        header = [name.strip().casefold() for name in next(records, [])]
        return header, [(number, cells) for number, cells in enumerate(records, 2) if any(cells)]
    except csv.Error as error:
        raise EventsError((f"{path.name}: {error}; allowed: fields with commas",)) from error


def _sheet_records(path: Path, content: bytes) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Return the same of an Excel file."""
    clocks = {name for meaning in _TIMES for name in SYNONYMS[meaning]}
    sheet = read_sheet(content, path.stem, clocks, path.with_suffix(".csv").name)
    if sheet.troubles:
        raise EventsError(
            tuple(
                f"{path.name}: {row_place(row, column)}: {problem}; allowed: a value"
                for row, column, problem in sheet.troubles
            )
        )
    found = [
        (number, cells)
        for numbers, piece in sheet.pieces()
        for number, cells in zip(numbers, piece, strict=True)
        if any(cells)
    ]
    header = [name.strip().casefold() for name in found[0][1]] if found else []
    return header, found[1:]


def _columns(file: str, header: Sequence[str]) -> dict[str, str]:
    found: dict[str, str] = {}
    for meaning, names in SYNONYMS.items():
        taken = next((name for name in names if name in header), None)
        # A platform is told beside the station only.
        if taken and taken not in found.values():
            found[meaning] = taken
    lost = [name for name in NEEDED if name not in found]
    if lost:
        allowed = (f"{name}: {' or '.join(SYNONYMS[name])}" for name in lost)
        place = row_place(1)
        raise EventsError(
            tuple(
                f"{file}: {place}: no column for {name}; allowed: {told}"
                for name, told in zip(lost, allowed, strict=True)
            )
        )
    return found


class _EventRows:
    """Turns rows into visits; remembers what was wrong where."""

    def __init__(
        self, file: str, header: Sequence[str], columns: Mapping[str, str], zone: tzinfo | None
    ) -> None:
        self._file, self._zone, self._columns = file, zone, columns
        self._at = {meaning: header.index(column) for meaning, column in columns.items()}
        self.visits: list[Visit] = []
        self.names: dict[str, str] = {}
        self.empty = 0
        self.dated = "date" in columns
        self._wrong: dict[tuple[str, str], list[int]] = {}
        """Rows by column and what is wrong, as the first of them has it."""
        self._first: dict[str, str] = {}

    def cell(self, cells: Sequence[str], meaning: str) -> str:
        """Return a cell; empty where there is none, or a word for nothing."""
        at = self._at.get(meaning, len(cells))
        text = cells[at].strip() if at < len(cells) else ""
        return "" if text.casefold() in _EMPTY else text

    def take(self, number: int, cells: Sequence[str]) -> None:
        """Take a row."""
        train, station = self.cell(cells, "train"), self.cell(cells, "station")
        for meaning, text in (("train", train), ("station", station)):
            if not text:
                self._refuse(meaning, number, "is empty")
                return
        date = self.cell(cells, "date")
        day_s = midnight_s(date) if date else None
        if date and day_s is None:
            self._refuse("date", number, f"{shown(date)} is no date")
            return
        arrival_s = self._time(cells, "arrival", number, day_s)
        departure_s = self._time(cells, "departure", number, day_s)
        known = [moment for moment in (arrival_s, departure_s) if moment is not None]
        if not known:
            self.empty += 1
            return
        if day_s is None:
            # Times of day without a date are all of one day.
            day_s = service_day_s(known[0]) if known[0] >= 100 * 3600 else 0.0
        self.names.setdefault(station, self.cell(cells, "name") or station)
        self.visits.append(
            Visit(
                f"{day_s:.0f} {train}",
                station,
                self._place(cells, station),
                day_s,
                arrival_s,
                departure_s,
                self._booked_s(cells, number, day_s),
            )
        )

    def _place(self, cells: Sequence[str], station: str) -> str:
        place = self.cell(cells, "place") or self.cell(cells, "direction")
        return f"{station} {self.cell(cells, 'line')} {place}" if place else ""

    def _booked_s(self, cells: Sequence[str], number: int, day_s: float) -> float | None:
        came_s = self._time(cells, "booked arrival", number, day_s)
        went_s = self._time(cells, "booked departure", number, day_s)
        return went_s - came_s if came_s is not None and went_s is not None else None

    def _time(
        self, cells: Sequence[str], meaning: str, number: int, day_s: float | None
    ) -> float | None:
        text = self.cell(cells, meaning)
        try:
            return time_s(text, day_s, self._zone) if text else None
        except ValueError as error:
            self._refuse(meaning, number, str(error))
            return None

    def _refuse(self, meaning: str, number: int, problem: str) -> None:
        first = self._first.setdefault(meaning, problem)
        self._wrong.setdefault((meaning, first), []).append(number)

    def told(self) -> list[str]:
        """Return what is wrong, once for each column."""
        allowed = {"train": "a name", "station": "a name", "date": "YYYY-MM-DD or YYYYMMDD"}
        return [
            f"{self._file}: {row_place(rows[0], self._columns[meaning])}: "
            f"{problem}{also_in(rows[1:])}; allowed: {allowed.get(meaning, TIME_TEXT)}"
            for (meaning, problem), rows in self._wrong.items()
        ]


def _note(notes: SourceNotes, reader: _EventRows, timezone: str) -> None:
    if reader.empty:
        told = f"{reader.empty} rows without arrival and departure"
        notes.miss(told, "left out")
    if not reader.dated:
        value = "the date of the time, until 04:00 of the next one; one day where there is none"
        notes.assume("day of service", value, "the source has no column for it")
    if timezone:
        notes.assume("time zone", timezone, "asked for; times with an offset are turned into it")
    else:
        value = "as written; seconds since 1970 as universal time"
        notes.assume("time zone", value, "--timezone names another one")
