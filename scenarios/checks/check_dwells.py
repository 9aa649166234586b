"""Checks of the dwell times of stations, by train type and time of day."""

from collections.abc import Iterable, Iterator, Sequence
from math import inf

from kankaku.scenarios.checks.line_tables import LineTables
from kankaku.scenarios.reading.dwell_rows import DwellRows, period_s
from kankaku.scenarios.reading.files import Table
from kankaku.scenarios.reading.mistakes import Mistake, meant
from kankaku.scenarios.reading.row_formats import DwellStationRow
from kankaku.scenarios.reading.units import next_day

Asked = tuple[str, str, str]
"""Station, train type and booked departure of a call."""


def dwell_station_mistakes(
    table: Table[DwellStationRow], line: LineTables, train_types: Sequence[str] | None
) -> list[Mistake]:
    """
    Return what is wrong with the dwell times of stations.

    Parameters
    ----------
    table
        The file.
    line
        The files of the line.
    train_types
        Known train types; nothing if they have mistakes of their own.

    Returns
    -------
    list[Mistake]
        The mistakes.
    """
    mistakes: list[Mistake] = []
    stations = [station.id for station in line.stations]
    alike: dict[tuple[str, str], list[DwellStationRow]] = {}
    for row in table:
        if row.station not in stations and line.stations.complete:
            problem = f"unknown station {row.station!r}"
            mistakes.append(table.mistake(row, "station", problem, meant(row.station, stations)))
        mistakes += _row_mistakes(table, row, train_types)
        alike.setdefault((row.station, row.train_type), []).append(row)
    for rows in alike.values():
        mistakes += _overlap_mistakes(table, rows)
    return mistakes


def _row_mistakes(
    table: Table[DwellStationRow], row: DwellStationRow, train_types: Sequence[str] | None
) -> Iterator[Mistake]:
    if row.train_type and train_types is not None and row.train_type not in train_types:
        problem = f"unknown train type {row.train_type!r}"
        yield table.mistake(row, "train_type", problem, meant(row.train_type, train_types))
    from_s, until_s = period_s(row)
    if until_s <= from_s:
        problem = f"{row.until_time} is not after {row.from_time}"
        allowed = f"after {row.from_time}{next_day(row.from_time, row.until_time)}"
        yield table.mistake(row, "until_time", problem, allowed)
    if row.booked_dwell_s < row.minimum_dwell_s:
        problem = f"{row.booked_dwell_s:g} is shorter than the minimum dwell"
        yield table.mistake(row, "booked_dwell_s", problem, f"from {row.minimum_dwell_s:g}")


def _overlap_mistakes(
    table: Table[DwellStationRow], rows: Iterable[DwellStationRow]
) -> Iterator[Mistake]:
    """Yield rows of one station and train type of which more than one holds at a time."""
    always: DwellStationRow | None = None
    timed: list[DwellStationRow] = []
    for row in rows:
        if row.from_time or row.until_time:
            timed.append(row)
        elif always is None:
            always = row
        else:
            problem = f"{row.station!r} stands in row {always.row} already"
            allowed = "every station once, or again with other times of day or another train type"
            yield table.mistake(row, "station", problem, allowed)
    timed.sort(key=period_s)
    latest: DwellStationRow | None = None
    for row in timed:
        ended_s = period_s(latest)[1] if latest else -inf
        if latest and period_s(row)[0] < ended_s:
            problem = f"begins before the period of row {latest.row} ends"
            allowed = f"from {latest.until_time}" if latest.until_time else "no period after that"
            yield table.mistake(row, "from_time", problem, allowed)
        if latest is None or period_s(row)[1] > ended_s:
            latest = row


def unheld_mistakes(
    table: Table[DwellStationRow], dwells: DwellRows, calls: Iterable[tuple[Asked, float]]
) -> list[Mistake]:
    """
    Return stations without a row for some call.

    Parameters
    ----------
    table
        The file.
    dwells
        Its rows.
    calls
        Station, train type and booked departure of calls, the latter as a time of day and in
        seconds. [s]

    Returns
    -------
    list[Mistake]
        One for each such station and train type.
    """
    if not table.complete:
        return []
    found: dict[tuple[str, str], Mistake] = {}
    for (station, train_type, departure), departure_s in calls:
        if (station, train_type) in found or dwells.find(station, train_type, departure_s):
            continue
        if station in dwells:
            problem = f"no row of {station!r} holds for {train_type!r} at {departure}"
            allowed = "a row for every time of day called at, or one without times"
            mistake = Mistake(table.file, "column from_time", problem, allowed)
        else:
            problem = f"{station!r}, where trains call, is missing"
            allowed = "a row for every station called at"
            mistake = Mistake(table.file, "column station", problem, allowed)
        found[station, train_type] = mistake
    return list(dict.fromkeys(found.values()))
