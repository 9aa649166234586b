"""Which services of a GTFS feed run on which day."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date, timedelta

from kankaku.scenarios.importing.formats import SourceError
from kankaku.scenarios.importing.gtfs_files import CellReader, FeedFiles, FeedRow

_WEEKDAYS = ("monday", "tuesday", "wednesday", "thursday", "friday", "saturday", "sunday")
_WEEK = 7
_SATURDAY = 5
_DAY = re.compile(r"([0-9]{4})-?([0-9]{2})-?([0-9]{2})", re.ASCII)
_DAY_TEXT = "a day as YYYYMMDD"


@dataclass
class ServiceDays:
    """On which days a service runs."""

    ranges: list[tuple[date, date, tuple[bool, ...]]] = field(default_factory=list)
    """First and last day, and on which days of the week, Monday first."""
    added: set[date] = field(default_factory=set)
    removed: set[date] = field(default_factory=set)

    def runs_on(self, day: date) -> bool:
        """Return whether the service runs on a day."""
        if day in self.removed:
            return False
        return day in self.added or any(
            first <= day <= last and week[day.weekday()] for first, last, week in self.ranges
        )

    def edges(self) -> set[date]:
        """Return days from which on something changes, but for the day of the week."""
        days = self.added | self.removed
        for first, last, _ in self.ranges:
            days |= {first, last}
        after = {day + timedelta(days=1) for day in days if day < date.max - timedelta(days=9)}
        return {day for day in days | after if day < date.max - timedelta(days=9)}


def day_of(text: str) -> date | None:
    """
    Return a day.

    Parameters
    ----------
    text
        ``YYYYMMDD``.

    Returns
    -------
    date | None
        Nothing if the text is no day.
    """
    digits = _DAY.fullmatch(text.strip())
    try:
        return date(int(digits[1]), int(digits[2]), int(digits[3])) if digits else None
    except ValueError:
        return None


def digits_of(day: date) -> str:
    """Return a day as ``YYYYMMDD``."""
    return day.isoformat().replace("-", "")


def read_services(files: FeedFiles, wanted: set[str]) -> dict[str, ServiceDays]:
    """
    Read both calendars.

    Parameters
    ----------
    files
        The feed.
    wanted
        Identifiers of the services that matter.

    Returns
    -------
    dict[str, ServiceDays]
        By identifier; services that no calendar has are not there.
    """
    services: dict[str, ServiceDays] = {}
    cells = CellReader("calendar.txt", files.mistakes)
    week_columns = ("service_id", *_WEEKDAYS, "start_date", "end_date")
    for row in files.rows("calendar.txt", week_columns, ("service_id", wanted)):
        week = [cells.whole(row, name, 0, 1) for name in _WEEKDAYS]
        for name, runs in zip(_WEEKDAYS, week, strict=True):
            cells.needed(row, name, is_empty=runs is None)
        first, last = _day(cells, row, "start_date"), _day(cells, row, "end_date")
        if first and last and last < first:
            problem = f"{row.text('end_date')} is before the start"
            cells.wrong(row.row, "end_date", problem, f"from {row.text('start_date')} on")
        elif first and last:
            found = services.setdefault(row.text("service_id"), ServiceDays())
            found.ranges.append((first, last, tuple(map(bool, week))))
    cells = CellReader("calendar_dates.txt", files.mistakes)
    needed = ("service_id", "date", "exception_type")
    for row in files.rows("calendar_dates.txt", needed, ("service_id", wanted)):
        day, kind = _day(cells, row, "date"), cells.whole(row, "exception_type", 1, 2)
        cells.needed(row, "exception_type", is_empty=kind is None)
        if day and kind:
            found = services.setdefault(row.text("service_id"), ServiceDays())
            (found.added if kind == 1 else found.removed).add(day)
    return services


def _day(cells: CellReader, row: FeedRow, column: str) -> date | None:
    day = day_of(row.text(column))
    if day is None:
        cells.wrong(row.row, column, f"{row.text(column)[:60]!r} is no day", _DAY_TEXT)
    return day


def busiest_day(services: Mapping[str, ServiceDays], trains: Mapping[str, int]) -> date | None:
    """
    Return the first of the days with most trains, from Monday to Friday and ordinary if any.

    Parameters
    ----------
    services
        By identifier.
    trains
        How many trains each one has. [-]

    Returns
    -------
    date | None
        Nothing if no train ever runs.
    """
    edges = set().union(*(service.edges() for service in services.values()))
    # Between two changes every week is the same, so the first one stands for all.
    days = {edge + timedelta(days=number) for edge in edges for number in range(_WEEK)}
    counts = {
        day: sum(trains.get(name, 0) for name, own in services.items() if own.runs_on(day))
        for day in sorted(days)
    }
    running = {day: count for day, count in counts.items() if count}
    special = set().union(*(own.added | own.removed for own in services.values()))
    # On holidays feeds have services beside those that they stand for.
    running = {day: count for day, count in running.items() if day not in special} or running
    weekdays = {day: count for day, count in running.items() if day.weekday() < _SATURDAY}
    chosen = weekdays or running
    return max(chosen, key=lambda day: chosen[day]) if chosen else None


def asked_day(wish: str) -> date | None:
    """
    Return the day that is asked for.

    Parameters
    ----------
    wish
        ``YYYYMMDD``, or nothing.

    Returns
    -------
    date | None
        Nothing if nothing was asked for.

    Raises
    ------
    SourceError
        If that is no day.
    """
    day = day_of(wish)
    if wish and day is None:
        raise SourceError((f"--day: {wish[:60]!r} is no day; allowed: {_DAY_TEXT}",))
    return day
