"""Excel workbooks in place of CSV files: a sheet as rows of texts, as a CSV file has them."""

import io
import warnings
import zipfile
import zlib
from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import date, datetime, time, timedelta
from typing import Any

from kankaku.scenarios.reading.raw import UnreadableError

ENDING = ".xlsx"
MOST_UNPACKED_BYTES = 1_000_000_000
MOST_CLOCK_S = 100 * 3600
"""Times of day have hours of two digits. [s]"""
DAY_S = 86400
MOST_OF_TITLE = 40
"""Characters of a sheet's name that are told; Excel itself allows 31. [-]"""
NEARLY_WHOLE_S = 0.001
"""Formulas leave so small a rest beside a whole second. [s]"""
NO_LIBRARY = "Excel files are read by openpyxl, which is not installed"
_NO_WORKBOOK = "is no Excel workbook, or has a password"
_BROKEN = (
    *(zipfile.BadZipFile, zlib.error, KeyError, ValueError, TypeError, IndexError),
    *(AttributeError, SyntaxError, OSError, EOFError, NotImplementedError, RuntimeError),
)
"""What the library raises about files that are none of its own."""


@dataclass
class SheetRows:
    """A sheet; cells are texts, a row for each row of the sheet from the first one on."""

    title: str
    rows: list[list[str]] = field(default_factory=list)
    troubles: list[tuple[int, str, str]] = field(default_factory=list)
    """Cells without a value that anybody could read: row, column, and what is wrong."""

    def pieces(self) -> Iterator[tuple[range, list[list[str]]]]:
        """
        Yield the rows as a CSV file does.

        Yields
        ------
        tuple[range, list[list[str]]]
            Numbers and cells: the header alone, and whatever stands above it, then all the rest.
        """
        head = _head(self.rows)
        for number in range(min(head + 1, len(self.rows))):
            yield range(number + 1, number + 2), [self.rows[number]]
        if rest := self.rows[head + 1 :]:
            yield range(head + 2, head + 2 + len(rest)), rest


def read_sheet(content: bytes, stem: str, clocks: Collection[str], csv_name: str) -> SheetRows:
    """
    Read the sheet of a workbook that stands for a CSV file.

    Parameters
    ----------
    content
        The workbook.
    stem
        Its name without ending; a sheet of that name is taken, else the only one.
    clocks
        Columns of times of day: there a fraction of a day is one.
    csv_name
        The file that may stand in its place.

    Returns
    -------
    SheetRows
        The sheet, without what is empty to the right of its header.

    Raises
    ------
    UnreadableError
        If the library is missing, the file is no workbook, or nobody knows which sheet is meant.
    """
    try:
        import openpyxl  # noqa: PLC0415 - an extra
    except ImportError as error:
        allowed = f"pip install 'kankaku[excel]', or {csv_name}"
        raise UnreadableError(NO_LIBRARY, allowed) from error
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            unpacked = sum(item.file_size for item in archive.infolist())
        if unpacked > MOST_UNPACKED_BYTES:
            msg, allowed = "is too long to be read", f"up to {MOST_UNPACKED_BYTES / 1e6:g} MB"
            raise UnreadableError(msg, allowed)
        with warnings.catch_warnings():
            # Of what a sheet has besides its cells.
            warnings.simplefilter("ignore")
            return _read(openpyxl, content, stem, clocks)
    except _BROKEN as error:
        raise UnreadableError(_NO_WORKBOOK, "an .xlsx file of Excel") from error


def _read(library: Any, content: bytes, stem: str, clocks: Collection[str]) -> SheetRows:  # noqa: ANN401
    book = library.load_workbook(io.BytesIO(content), read_only=True, data_only=True)
    try:
        sheet = _chosen(book.worksheets, stem)
        found = SheetRows("".join(sheet.title.split("/"))[:MOST_OF_TITLE])
        values: list[list[object]] = []
        errors: list[tuple[int, int, str]] = []
        for number, row in enumerate(_rows(sheet), 1):
            values.append([cell.value for cell in row])
            wrong = (at for at, cell in enumerate(row) if cell.data_type == "e")
            errors += [(number, at, str(row[at].value)) for at in wrong]
        epoch = book.epoch
    finally:
        book.close()
    header = [_text(value, epoch).strip() for value in values[_head(values)]] if values else []
    header = header[: _length(header)]
    timed = [name in clocks for name in header]
    found.rows = [_row(row, timed, epoch) for row in values]
    for number, at, told in errors:
        found.troubles.append((number, _named(header, at), f"the cell holds the error {told}"))
    if any(None in row[: len(header)] for row in values if any(map(_says, row))):
        found.troubles += _uncalculated(library, content, sheet.title, values, header)
    return found


def _says(value: object) -> bool:
    return value is not None


def _rows(sheet: Any) -> Iterator[Sequence[Any]]:  # noqa: ANN401 - the library has no types
    # Programs that write workbooks may be wrong about their size.
    sheet.reset_dimensions()
    yield from sheet.iter_rows()


def _chosen(sheets: Sequence[Any], stem: str) -> Any:  # noqa: ANN401 - the same
    named = [sheet for sheet in sheets if sheet.title.strip().casefold() == stem.casefold()]
    if named:
        return named[0]
    shown = [sheet for sheet in sheets if sheet.sheet_state == "visible"]
    if len(shown) == 1:
        return shown[0]
    titles = ", ".join(repr(sheet.title) for sheet in shown) or "none"
    msg = f"has the sheets {titles}" if shown else "has no visible sheet"
    raise UnreadableError(msg, f"one sheet, or one that is called {stem!r}")


def _head(rows: Sequence[Sequence[object]]) -> int:
    """Return the place of the first row that says anything."""
    return next((at for at, row in enumerate(rows) if any(str(v or "").strip() for v in row)), 0)


def _length(cells: Sequence[str]) -> int:
    return next((at for at in range(len(cells), 0, -1) if cells[at - 1].strip()), 0)


def _named(header: Sequence[str], at: int) -> str:
    from openpyxl.utils import get_column_letter  # noqa: PLC0415 - an extra

    return header[at] if at < len(header) and header[at] else str(get_column_letter(at + 1))


def _row(values: Sequence[object], timed: Sequence[bool], epoch: datetime) -> list[str]:
    """Return cells as texts, as many as the header has; more if they say anything."""
    cells = [
        _text(value, epoch, is_clock=at < len(timed) and timed[at])
        for at, value in enumerate(values)
    ]
    width = max(len(timed), _length(cells))
    return [*cells, *[""] * (width - len(cells))][:width]


def _text(value: object, epoch: datetime, *, is_clock: bool = False) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    day_part = _day_part_s(value, epoch, is_clock=is_clock)
    if day_part is not None:
        return _clock_text(day_part)
    if isinstance(value, float):
        # Excel keeps 15 digits; what its files have beyond them nobody has typed.
        return f"{value:.15g}"
    return value.isoformat(" ") if isinstance(value, datetime) else str(value)


def _day_part_s(value: object, epoch: datetime, *, is_clock: bool) -> float | None:
    """Return a time of day that Excel keeps in one of its ways; nothing if it is none. [s]"""
    found_s: float | None = None
    if isinstance(value, time):
        found_s = timedelta(
            hours=value.hour,
            minutes=value.minute,
            seconds=value.second,
            microseconds=value.microsecond,
        ).total_seconds()
    elif isinstance(value, timedelta):
        found_s = value.total_seconds()
    elif isinstance(value, date):
        from openpyxl.utils.datetime import to_excel  # noqa: PLC0415 - an extra

        # After midnight of the first day of its calendar: a time past 24 hours.
        found_s = DAY_S * float(to_excel(value, epoch))
    elif is_clock and isinstance(value, float):
        found_s = DAY_S * value
    in_range = found_s is not None and 0.0 <= found_s < MOST_CLOCK_S
    return found_s if in_range else None


def _clock_text(time_s: float) -> str:
    whole_s = round(time_s)
    rest = f"{time_s % 1.0:.3f}"[1:] if abs(time_s - whole_s) > NEARLY_WHOLE_S else ""
    shown_s = int(time_s) if rest else whole_s
    return f"{shown_s // 3600:02d}:{shown_s // 60 % 60:02d}:{shown_s % 60:02d}{rest}"


def _uncalculated(
    library: Any,  # noqa: ANN401 - the library has no types
    content: bytes,
    title: str,
    values: Sequence[Sequence[object]],
    header: Sequence[str],
) -> Iterator[tuple[int, str, str]]:
    """Yield formulas that no spreadsheet has worked out yet; they look like empty cells."""
    book = library.load_workbook(io.BytesIO(content), read_only=True)
    with suppress(KeyError):
        for number, row in enumerate(_rows(book[title]), 1):
            for at, cell in enumerate(row):
                known = number <= len(values) and at < len(values[number - 1])
                if cell.data_type == "f" and known and values[number - 1][at] is None:
                    told = "the formula has no value yet; open the file in Excel and save it"
                    yield number, _named(header, at), told
    book.close()
