"""
Public timetables: whole departure minutes by train and station, and the files beside them.

``kankaku.scenarios.loading.reconstruct`` finds the seconds.
"""

import csv
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from kankaku.railway.plan.driving_style import FASTEST, DrivingStyle
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.scenarios.checks.check_dwells import dwell_station_mistakes, unheld_mistakes
from kankaku.scenarios.checks.check_line import line_mistakes
from kankaku.scenarios.checks.line_tables import LineTables
from kankaku.scenarios.loading.load_driving import read_driving
from kankaku.scenarios.loading.load_line import read_line, to_line
from kankaku.scenarios.loading.load_stock import read_stock, to_train_types
from kankaku.scenarios.reading.dwell_rows import DwellRows
from kankaku.scenarios.reading.files import Reader, Table
from kankaku.scenarios.reading.mistakes import Mistake, ScenarioError, meant, row_place
from kankaku.scenarios.reading.row_formats import DwellStationRow, ServiceRow

PUBLIC_FILE = "public_timetable.csv"
_TRAIN = "train"
_MINUTE = re.compile(r"([0-2]?\d):([0-5]\d)")
_MINUTE_TEXT = "HH:MM, hours 00 to 29, or nothing"


@dataclass(frozen=True, slots=True)
class Source:
    """All that the reconstruction starts from."""

    line: Line
    train_types: Mapping[str, TrainType]
    type_of_train: Mapping[str, str]
    departures: Mapping[str, Mapping[str, int]]
    """Public departure minute by train and station. [min after midnight]"""
    dwell: DwellRows
    driving: DrivingStyle = FASTEST

    def dwell_of(self, train: str, station: str) -> DwellStationRow:
        """
        Return the dwell that holds for a call at its public departure.

        Parameters
        ----------
        train
            The train.
        station
            Where it calls.

        Returns
        -------
        DwellStationRow
            The row.
        """
        departure_s = 60.0 * self.departures[train][station]
        return self.dwell.held(station, self.type_of_train[train], departure_s)


def read_source(folder: Path) -> Source:
    """
    Read what a timetable is reconstructed from.

    Parameters
    ----------
    folder
        Scenario folder with line, rolling stock, ``services.csv``, ``dwell_stations.csv``
        and ``public_timetable.csv``, whose columns are the train and the stations.

    Returns
    -------
    Source
        What they hold.

    Raises
    ------
    ScenarioError
        With every mistake of the files.
    """
    reader = Reader()
    line = read_line(reader, folder)
    stock = read_stock(reader, folder)
    services = reader.csv(folder / "services.csv", "timetable", ServiceRow)
    dwell = reader.csv(folder / "dwell_stations.csv", "timetable", DwellStationRow)
    reader.mistakes += line_mistakes(line)
    reader.mistakes += dwell_station_mistakes(dwell, line, list(stock.train) if stock else None)
    driving = read_driving(reader, folder)
    public = _read_public(folder / PUBLIC_FILE, line, reader.mistakes)
    if stock is not None:
        reader.mistakes += _service_mistakes(services, dwell, public, list(stock.train))
    if reader.mistakes or stock is None:
        raise ScenarioError(tuple(dict.fromkeys(reader.mistakes)))
    return Source(
        line=to_line(line, folder.name),
        train_types=to_train_types(stock),
        type_of_train={row.train: row.train_type for row in services},
        departures={row.train: public[row.train] for row in services},
        dwell=DwellRows(dwell),
        driving=driving,
    )


def _service_mistakes(
    services: Table[ServiceRow],
    dwell: Table[DwellStationRow],
    public: Mapping[str, Mapping[str, int]],
    types: Sequence[str],
) -> Iterator[Mistake]:
    for row in services:
        if row.train_type not in types:
            problem = f"unknown train type {row.train_type!r}"
            yield services.mistake(row, "train_type", problem, meant(row.train_type, types))
        if public and row.train not in public:
            problem = f"train {row.train!r} is not in {PUBLIC_FILE}"
            yield services.mistake(row, _TRAIN, problem, "trains with public minutes")
    if dwell.present:
        kinds = {row.train: row.train_type for row in services}
        calls = [
            ((station, kinds[train], f"{minute // 60:02d}:{minute % 60:02d}"), 60.0 * minute)
            for train, minutes in public.items()
            if train in kinds
            for station, minute in minutes.items()
        ]
        yield from unheld_mistakes(dwell, DwellRows(dwell), calls)


def _read_public(
    path: Path, line: LineTables, mistakes: list[Mistake]
) -> dict[str, dict[str, int]]:
    """Return the public minutes by train and station; append what is wrong with them."""
    allowed = "a readable file of departure minutes, encoded as UTF-8"
    try:
        text = path.read_text(encoding="utf-8-sig")
        header, *rows = csv.reader(io.StringIO(text, newline="")) if text.strip() else [[]]
    except UnicodeDecodeError:
        mistakes.append(Mistake(path.name, "", "bytes that are not UTF-8", allowed))
        return {}
    except (OSError, csv.Error) as error:
        told = getattr(error, "strerror", None) or str(error)
        mistakes.append(Mistake(path.name, "", f"cannot be read: {told}", allowed))
        return {}
    known = len(mistakes)
    mistakes += _header_mistakes(path.name, header, line)
    if len(mistakes) > known:
        return {}
    public: dict[str, dict[str, int]] = {}
    for number, cells in enumerate(rows, start=2):
        if any(cells):
            mistakes += _add_row(public, path.name, number, dict(zip(header, cells, strict=False)))
    return public


def _header_mistakes(file: str, header: Sequence[str], line: LineTables) -> Iterator[Mistake]:
    if _TRAIN not in header:
        yield Mistake(file, row_place(1, _TRAIN), "is missing", "train, and stations on the way")
    stops = {row.station: row.stop_km for row in line.platforms}
    stations = [name for name in header if name != _TRAIN]
    for name in stations:
        if name not in stops:
            problem = f"{name!r} is no station with a platform"
            yield Mistake(file, row_place(1, name), problem, meant(name, list(stops)))
    if len(set(header)) < len(header):
        yield Mistake(file, "row 1", "a column occurs twice", "every station once")
    places_km = [stops[name] for name in stations if name in stops]
    if places_km != sorted(places_km):
        yield Mistake(file, "row 1", "stations are out of order", "their order on the way")


def _add_row(
    public: dict[str, dict[str, int]], file: str, number: int, cells: Mapping[str, str]
) -> Iterator[Mistake]:
    train = cells.get(_TRAIN, "")
    if not train or train in public:
        problem = f"train {train!r} occurs twice" if train else "no train"
        yield Mistake(file, row_place(number, _TRAIN), problem, "every train once")
        return
    minutes = public[train] = {}
    for station, clock in cells.items():
        if station == _TRAIN or not clock:
            continue
        found = _MINUTE.fullmatch(clock)
        if found and int(found[1]) < 30:
            minutes[station] = 60 * int(found[1]) + int(found[2])
        else:
            yield Mistake(file, row_place(number, station), f"{clock!r}", _MINUTE_TEXT)
    if not minutes:
        problem = f"train {train!r} departs nowhere"
        yield Mistake(file, row_place(number), problem, "one departure or more")
