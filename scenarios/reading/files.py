"""Reading of TOML, CSV and Excel files; mistakes are collected, not raised."""

import csv
import hashlib
import os
import re
import tomllib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from kankaku.scenarios.reading.cell_texts import printable, shown
from kankaku.scenarios.reading.csv_rows import (
    LONGEST_LINE,
    LongLineError,
    Records,
    RowReader,
    clock_columns,
)
from kankaku.scenarios.reading.excel_sheets import ENDING, read_sheet
from kankaku.scenarios.reading.mistakes import Mistake, also_in, meant, row_place
from kankaku.scenarios.reading.raw import UnreadableError, read_whole
from kankaku.scenarios.reading.row_formats import Row, columns

R = TypeVar("R", bound=Row)
R_co = TypeVar("R_co", bound=Row, covariant=True)
MOST_TOML_BYTES = 1_000_000
MOST_CSV_BYTES = 100_000_000
MOST_ROWS = 2_000_000
"""Of a CSV file; more would not be read while somebody waits. [-]"""
_DEEPEST_KEY = 30
_PART = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*"""
_LONG_KEY = re.compile(rf"(?<![\w-]){_PART}(?:{_PART}){{{_DEEPEST_KEY}}}")
_LONG_NUMBER = re.compile(r"[0-9](?:_?[0-9]){4300}")
_MARKS = {b"\xff\xfe": "UTF-16", b"\xfe\xff": "UTF-16"}


@dataclass(frozen=True)
class Table(Generic[R_co]):
    """The good rows of a CSV file; ``complete`` says whether they are all of them."""

    file: str
    rows: tuple[R_co, ...] = ()
    complete: bool = True
    present: bool = True

    def __iter__(self) -> Iterator[R_co]:
        return iter(self.rows)

    def mistake(self, row: Row, column: str, problem: str, allowed: str) -> Mistake:
        """
        Return a mistake of one row.

        Parameters
        ----------
        row
            The row.
        column
            Name of the column, empty for the whole row.
        problem
            What is wrong.
        allowed
            What is allowed.

        Returns
        -------
        Mistake
            The mistake.
        """
        return Mistake(self.file, row_place(row.row, column), problem, allowed)


class Reader:
    """Reads files, collects every mistake, and remembers the bytes of what it read."""

    def __init__(self) -> None:
        self.mistakes: list[Mistake] = []
        self._read: dict[str, bytes] = {}

    @property
    def digest(self) -> str:
        """Hash over the names and bytes of all files read."""
        together = hashlib.sha256()
        for name, content in sorted(self._read.items()):
            for part in (name.encode(), content):
                together.update(len(part).to_bytes(8, "big"))
                together.update(part)
        return together.hexdigest()

    def _text(self, path: Path, role: str, most_bytes: int, *, optional: bool) -> bytes | None:
        """Return text in UTF-8; nothing, and a mistake, if there is none."""
        content = self._bytes(path, role, most_bytes, optional=optional)
        return content if content is not None and self._is_text(path, content) else None

    def _bytes(self, path: Path, role: str, most_bytes: int, *, optional: bool) -> bytes | None:
        try:
            content = read_whole(path, most_bytes)
        except UnreadableError as error:
            self._fault(path, "", error.problem, error.allowed)
            return None
        if content is None:
            if not optional:
                self._fault(path, "", "the file is missing", "a readable file of that name")
            return None
        self._read[f"{role}/{path.name}"] = content
        return content

    def _is_text(self, path: Path, content: bytes) -> bool:
        at, mark = content.find(b"\0"), _MARKS.get(content[:2])
        problem = f"the text is in {mark}, not UTF-8" if mark else "has a zero byte: it is no text"
        if not mark and at < 0:
            try:
                for start in range(0, len(content), 1 << 20):
                    self._decodes(content, start, start + (1 << 20))
            except UnicodeDecodeError as error:
                at, problem = error.start, "bytes that are not UTF-8"
            else:
                return True
        line = content.count(b"\n", 0, max(at, 0)) + 1
        self._fault(path, f"line {line}", problem, "text encoded as UTF-8")
        return False

    @staticmethod
    def _decodes(content: bytes, start: int, end: int) -> None:
        # A piece must not begin or end within a character.
        while end < len(content) and content[end] & 0xC0 == 0x80 and end > start:
            end -= 1
        while start > 0 and start < len(content) and content[start] & 0xC0 == 0x80:
            start -= 1
        try:
            content[start:end].decode()
        except UnicodeDecodeError as error:
            error.start += start
            raise

    def _fault(self, path: Path, where: str, problem: str, allowed: str) -> None:
        self.mistakes.append(Mistake(path.name, where, problem, allowed))

    def toml(self, path: Path, role: str) -> dict[str, Any] | None:
        """
        Read a TOML file.

        Parameters
        ----------
        path
            The file.
        role
            Under what name its folder enters the digest.

        Returns
        -------
        dict[str, Any] | None
            Its content; nothing if it cannot be read.
        """
        content = self._text(path, role, MOST_TOML_BYTES, optional=False)
        if content is None:
            return None
        text = content.decode("utf-8-sig")
        try:
            return self._parsed(path, text)
        except tomllib.TOMLDecodeError as error:
            found = re.search(r"line (\d+)", str(error))
            line = found.group(1) if found else str(text.count("\n") + 1)
            problem = re.sub(r" \(at .*\)$", "", str(error))
            self._fault(path, f"line {line}", problem, "valid TOML, every name only once")
        except RecursionError:
            self._fault(path, "", "tables or lists are nested too deeply", "tables as documented")
        except ValueError as error:
            # Of numbers and dates that have the right form.
            self._fault(path, "", f"has a value that nobody can read: {error}", "valid TOML")
        return None

    def _parsed(self, path: Path, text: str) -> dict[str, Any] | None:
        for pattern, problem, allowed in (
            (_LONG_KEY, f"a key of more than {_DEEPEST_KEY} parts", "keys as documented"),
            (_LONG_NUMBER, "a number of more than 4300 digits", "numbers as documented"),
        ):
            found = pattern.search(text)
            if found:
                line = text.count("\n", 0, found.start()) + 1
                self._fault(path, f"line {line}", problem, allowed)
                return None
        return tomllib.loads(text)

    def csv(self, path: Path, role: str, model: type[R], *, optional: bool = False) -> Table[R]:
        """
        Read a CSV file, or the Excel file of its name where there is one instead.

        Parameters
        ----------
        path
            The CSV file.
        role
            Under what name its folder enters the digest.
        model
            Its kind of row.
        optional
            Whether the file may be absent.

        Returns
        -------
        Table[R]
            Its good rows.
        """
        known = len(self.mistakes)
        workbook = path.with_suffix(ENDING)
        if os.path.lexists(workbook):
            if not os.path.lexists(path):
                return self._sheet(workbook, role, model, optional=optional)
            problem = f"{workbook.name} is there, too, and nobody knows which one holds"
            self._fault(path, "", problem, "one of the two")
            return Table(path.name, complete=False)
        content = self._text(path, role, MOST_CSV_BYTES, optional=optional)
        if content is None:
            missing = len(self.mistakes) > known
            return Table(path.name, complete=not missing, present=False)
        if content.count(b"\n") > MOST_ROWS:
            self._fault(path, "", "has too many rows", f"up to {MOST_ROWS:,}")
            return Table(path.name, complete=False)
        rows: tuple[R, ...] = ()
        try:
            rows = self._table(path, model, Records(content).pieces(), optional=optional)
        except csv.Error as error:
            self._fault(path, "", str(error), "comma-separated fields")
        except LongLineError:
            problem = f"a row of more than {LONGEST_LINE:,} characters"
            self._fault(path, "", problem, "a line for each row, quotation marks in pairs")
        return Table(path.name, rows, complete=len(self.mistakes) == known)

    def _sheet(self, path: Path, role: str, model: type[R], *, optional: bool) -> Table[R]:
        """Read an Excel file in place of a CSV file."""
        known = len(self.mistakes)
        try:
            content = self._bytes(path, role, MOST_CSV_BYTES, optional=False) or b""
            if len(self.mistakes) > known:
                return Table(path.name, complete=False)
            name = path.with_suffix(".csv").name
            sheet = read_sheet(content, path.stem, clock_columns(model), name)
        except UnreadableError as error:
            self._fault(path, "", error.problem, error.allowed)
            return Table(path.name, complete=False)
        # Whoever tells a mistake of a row names the file; so all of them name the sheet.
        place = path.with_name(f"{path.name}, sheet {printable(sheet.title)}")
        for row, column, problem in sheet.troubles:
            self._fault(place, row_place(row, printable(column[:40])), problem, "a value")
        if sheet.troubles:
            return Table(place.name, complete=False)
        rows = self._table(place, model, sheet.pieces(), optional=optional)
        return Table(place.name, rows, complete=len(self.mistakes) == known)

    def _table(
        self,
        path: Path,
        model: type[R],
        pieces: Iterator[tuple[range, list[list[str]]]],
        *,
        optional: bool,
    ) -> tuple[R, ...]:
        head = next((p[0] for _, p in pieces if any(map(str.strip, p[0]))), None)
        if head is None:
            self._fault(path, "row 1", "the file is empty", ",".join(columns(model)))
            return ()
        header = [name.strip() for name in head]
        if not self._header_is_good(path, header, model):
            return ()
        reader = RowReader(model, header)
        reader.read(pieces)
        self._tell(path, reader)
        if not (reader.rows or reader.uneven or optional):
            self._fault(path, "row 2", "there is no row below the header", "one row or more")
        return tuple(reader.good)

    def _tell(self, path: Path, reader: RowReader[Any]) -> None:
        """Tell what is wrong, once for each column."""
        if reader.uneven:
            header, cells = reader.header, reader.first_uneven
            problem = f"has {len(cells)} fields"
            if len(cells) == len(header) + 1 and not cells[-1].strip():
                problem += ", the last one empty after a comma"
            allowed = f"{len(header)} fields: {','.join(header)}"
            first, *others = reader.uneven
            self._fault(path, row_place(first), problem + also_in(others), allowed)
        for column, refused in reader.refused.items():
            problem, allowed = reader.explained(column)
            first, *others = refused
            problem += also_in(others)
            self._fault(path, row_place(first, column), problem, allowed)

    def _header_is_good(self, path: Path, header: list[str], model: type[Row]) -> bool:
        known, wanted = len(self.mistakes), columns(model)
        for separator in (";", "\t"):
            if len(header) == 1 and separator in header[0]:
                problem = f"fields are separated by {separator!r}"
                self._fault(path, "row 1", problem, "commas, and points in decimals")
                return False
        times = Counter(header)
        unknown = [name for name in times if name not in wanted]
        for name in unknown[:3]:
            left = [column for column in wanted if name and column not in header]
            problem = f"unknown column {shown(name)}" if name else "a column without a name"
            place = row_place(1, printable(name[:40]))
            self._fault(path, place, problem, meant(name, left or wanted))
        if len(unknown) > 3:
            problem = f"{len(unknown) - 3} more unknown columns"
            self._fault(path, "row 1", problem, ",".join(wanted))
        for name in wanted:
            if times[name] > 1:
                self._fault(path, row_place(1, name), "occurs twice", ",".join(wanted))
        for name in columns(model, required=True):
            if name not in times:
                self._fault(path, row_place(1, name), "is missing", ",".join(wanted))
        return len(self.mistakes) == known
