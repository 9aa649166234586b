"""The files of a GTFS feed as rows of cells, from a folder or an archive."""

import csv
import io
import lzma
import re
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import IO, NamedTuple, NoReturn

from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.importing.formats import SourceError
from kankaku.scenarios.reading.cell_texts import shown
from kankaku.scenarios.reading.mistakes import Mistake, ScenarioError, row_place

MOST_BYTES = 4_000_000_000
"""Of one file of a feed, unpacked. [-]"""
MOST_FILES = 10_000
"""In an archive. [-]"""
REQUIRED = ("stops.txt", "routes.txt", "trips.txt", "stop_times.txt")
_FIRST_BYTES = 64
_UTF16 = (b"\xff\xfe", b"\xfe\xff")
_NOT_UTF8 = re.compile("[\ud800-\udfff]")
_BROKEN = (
    *(OSError, EOFError, RuntimeError, NotImplementedError, ValueError),
    *(zipfile.BadZipFile, zlib.error, lzma.LZMAError),
)
"""What reading a damaged archive or file may raise."""


class FeedRow(NamedTuple):
    """A row of a file of a feed."""

    row: int
    """As a spreadsheet counts; the header is row 1."""
    cells: Mapping[str, str]
    """Stripped, by column; columns that the file does not have are not there."""

    def text(self, column: str) -> str:
        """Return a cell; empty if the file has no such column."""
        return self.cells.get(column, "")


def refuse(mistakes: Sequence[Mistake]) -> NoReturn:
    """
    Refuse a feed, what is wrong in the same way in many rows told once.

    Parameters
    ----------
    mistakes
        One or more.

    Raises
    ------
    SourceError
        Always.
    """
    raise SourceError(ScenarioError(tuple(mistakes)).sentences)


class FeedFiles:
    """
    The files of a feed.

    Parameters
    ----------
    source
        A folder or a zip archive; in an archive they may lie in one folder.
    notes
        Are told of what the files need to be read.

    Raises
    ------
    SourceError
        If there is nothing that can be read, or a required file is missing.
    """

    def __init__(self, source: Path, notes: SourceNotes) -> None:
        self._source = source
        self.notes = notes
        """Are told what was assumed where rows say nothing."""
        self.mistakes: list[Mistake] = []
        """What was wrong in rows read so far."""
        self._row_read = 1
        try:
            self._places = self._found()
        except _BROKEN as error:
            refuse([Mistake(str(source), "", _told(error), "a GTFS feed: a folder or a zip file")])
        missing = [name for name in REQUIRED if name not in self._places]
        if not {"calendar.txt", "calendar_dates.txt"} & {*self._places}:
            missing.append("calendar.txt or calendar_dates.txt")
        if missing:
            allowed = f"a GTFS feed, which has {', '.join(REQUIRED)} and a calendar"
            refuse([Mistake(str(source), "", f"has no {name}", allowed) for name in missing])

    @property
    def licences(self) -> list[str]:
        """Files beside the tables that look like a licence."""
        words = ("licence", "license", "terms")
        return sorted(name for name in self._places if name.casefold().startswith(words))

    def __contains__(self, name: str) -> bool:
        return name in self._places

    def _found(self) -> dict[str, str]:
        """Return where the files lie, by name."""
        if self._source.is_dir():
            return {place.name: str(place) for place in self._source.iterdir() if place.is_file()}
        with zipfile.ZipFile(self._source) as archive:
            names = [info.filename for info in archive.infolist() if not info.is_dir()]
        if len(names) > MOST_FILES:
            msg = f"an archive of {len(names)} files"
            raise ValueError(msg)
        folders = {
            PurePosixPath(name).parent for name in names if PurePosixPath(name).name == "stops.txt"
        }
        if len(folders) > 1:
            msg = "several folders with a stops.txt"
            raise ValueError(msg)
        return {
            PurePosixPath(name).name: name
            for name in names
            if PurePosixPath(name).parent in folders
        }

    @contextmanager
    def _opened(self, name: str) -> Iterator[IO[bytes]]:
        if self._source.is_dir():
            with Path(self._places[name]).open("rb") as stream:
                yield stream
            return
        with zipfile.ZipFile(self._source) as archive:
            info = archive.getinfo(self._places[name])
            if info.file_size > MOST_BYTES:
                msg = f"{info.file_size / 1e9:.1f} thousand million bytes"
                raise ValueError(msg)
            with archive.open(info) as stream:
                yield stream

    def rows(
        self, name: str, columns: Iterable[str], wanted: tuple[str, set[str]] | None = None
    ) -> Iterator[FeedRow]:
        """
        Yield the rows of a file; what is wrong with them is added to ``mistakes``.

        Parameters
        ----------
        name
            Of the file; nothing is yielded if the feed does not have it.
        columns
            Those that it must have.
        wanted
            A column, and the texts of it that matter: other rows are passed over.

        Yields
        ------
        FeedRow
            Rows with at least one cell that is not empty.

        Raises
        ------
        SourceError
            If the file cannot be read on: its bytes are no UTF-8 text, or its quotation marks
            are not closed.
        """
        if name not in self._places:
            return
        head: list[str] = []
        try:
            for row, cells in self._records(name):
                if not head:
                    head = self._head(name, row, cells, columns)
                else:
                    yield from self._row(name, head, row, cells, wanted)
            if not head:
                self._refuse(name, 1, "has no header", f"columns {', '.join(columns)}")
        except _UnreadableLineError as error:
            self._refuse(name, self._row_read, error.problem, "text in UTF-8")
        except csv.Error as error:
            allowed = 'cells as they are, or in closed quotation marks with "" for one within'
            self._refuse(name, self._row_read, f"cannot be read: {error}", allowed)
        except SourceError:
            raise
        except _BROKEN as error:
            self._refuse(name, self._row_read, _told(error), "a readable file")

    def _records(self, name: str) -> Iterator[tuple[int, list[str]]]:
        """Yield numbers and cells of rows that are not empty."""
        self._row_read = 1
        with self._opened(name) as stream:
            start = stream.read(_FIRST_BYTES)
        if start[:2] in _UTF16 or b"\0" in start:
            self._refuse(name, 1, "is UTF-16 or no text", "text in UTF-8")
        with self._opened(name) as stream:
            text = io.TextIOWrapper(stream, "utf-8-sig", "surrogateescape", newline="")
            for row, cells in enumerate(csv.reader(_readable(text), strict=True), 1):
                if any(map(str.strip, cells)):
                    yield row, cells
                # Another file may have been read meanwhile.
                self._row_read = row + 1

    def _refuse(self, name: str, row: int, problem: str, allowed: str) -> NoReturn:
        refuse([*self.mistakes, Mistake(name, row_place(row), problem, allowed)])

    def _head(self, name: str, row: int, cells: Sequence[str], columns: Iterable[str]) -> list[str]:
        head = [cell.strip() for cell in cells]
        twice = sorted({cell for cell in head if cell and head.count(cell) > 1})
        faults = [
            Mistake(name, row_place(row, cell), "stands in the header twice", "every column once")
            for cell in twice
        ]
        faults += [
            Mistake(
                *(name, row_place(row, column), "is not in the header"),
                f"a column {column}; the file has {', '.join(filter(None, head))}",
            )
            for column in columns
            if column not in head
        ]
        if faults:
            refuse([*self.mistakes, *faults])
        return head

    def _row(
        self,
        name: str,
        head: Sequence[str],
        row: int,
        cells: Sequence[str],
        wanted: tuple[str, set[str]] | None,
    ) -> Iterator[FeedRow]:
        if len(cells) > len(head) and any(map(str.strip, cells[len(head) :])):
            problem = f"has {len(cells)} cells"
            self.mistakes.append(Mistake(name, row_place(row), problem, f"{len(head)}"))
            return
        if len(cells) < len(head):
            why = "rows are shorter than the header; the last cells count as empty"
            self.notes.assume(f"cells that {name} does not have", "empty", why)
        found = FeedRow(row, dict(zip(head, map(str.strip, cells), strict=False)))
        if wanted is None or found.text(wanted[0]) in wanted[1]:
            yield found


class _UnreadableLineError(Exception):
    def __init__(self, problem: str) -> None:
        super().__init__(problem)
        self.problem = problem


def _readable(lines: Iterable[str]) -> Iterator[str]:
    """Yield lines of text; those with other bytes are refused where they stand."""
    for line in lines:
        if "\0" in line:
            msg = "has a NUL character"
            raise _UnreadableLineError(msg)
        odd = None if line.isascii() else _NOT_UTF8.search(line)
        if odd:
            msg = f"has the byte 0x{ord(odd[0]) - 0xDC00:02X}, which is not UTF-8"
            raise _UnreadableLineError(msg)
        yield line


def _told(error: BaseException) -> str:
    said = getattr(error, "strerror", None) or " ".join(str(error).split()) or type(error).__name__
    return f"cannot be read: {said}"


class CellReader:
    """
    Cells as what they mean; remembers what is wrong.

    Parameters
    ----------
    file
        Name of the file.
    mistakes
        Where mistakes are added.
    """

    def __init__(self, file: str, mistakes: list[Mistake]) -> None:
        self._file = file
        self._mistakes = mistakes

    def wrong(self, row: int, column: str, problem: str, allowed: str) -> None:
        """Remember a mistake."""
        self._mistakes.append(Mistake(self._file, row_place(row, column), problem, allowed))

    def name(self, row: FeedRow, column: str) -> str:
        """Return an identifier, which must be there."""
        text = row.text(column)
        if not text:
            self.wrong(row.row, column, "is empty", "an identifier")
        return text

    def time_s(self, row: FeedRow, column: str) -> int | None:
        """Return seconds after midnight; nothing if the cell is empty. [s]"""
        text = row.text(column)
        found = _TIME.fullmatch(text)
        if found:
            return 3600 * int(found[1]) + 60 * int(found[2]) + int(found[3])
        if text:
            allowed = "H:MM:SS or HH:MM:SS, hours 0 to 99, from 24 on after midnight"
            self.wrong(row.row, column, f"{shown(text)} is no time", allowed)
        return None

    def whole(self, row: FeedRow, column: str, least: int, most: int) -> int | None:
        """Return a whole number; nothing if the cell is empty or wrong."""
        text = row.text(column)
        if not text:
            return None
        if _WHOLE.fullmatch(text) and least <= int(text) <= most:
            return int(text)
        allowed = f"a whole number from {least} up to {most}"
        self.wrong(row.row, column, f"{shown(text)} is not allowed", allowed)
        return None

    def number(self, row: FeedRow, column: str, least: float, most: float) -> float | None:
        """Return a number; nothing if the cell is empty or wrong."""
        text = row.text(column)
        if not text:
            return None
        if _NUMBER.fullmatch(text) and least <= float(text) <= most:
            return float(text)
        allowed = f"a number from {least:g} up to {most:g}"
        self.wrong(row.row, column, f"{shown(text)} is not allowed", allowed)
        return None

    def needed(self, row: FeedRow, column: str, *, is_empty: bool) -> None:
        """Remember that a cell which must be there is empty."""
        if is_empty and not row.text(column):
            self.wrong(row.row, column, "is empty", "a value")


_TIME = re.compile(r"([0-9]{1,2}):([0-5][0-9]):([0-5][0-9])", re.ASCII)
_WHOLE = re.compile(r"[+-]?[0-9]{1,12}", re.ASCII)
_NUMBER = re.compile(r"[+-]?(?:[0-9]{1,30}\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?", re.ASCII)
