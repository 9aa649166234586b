"""Reading of TOML and CSV files; faults are collected, not raised."""

import csv
import hashlib
import io
import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from scenarios.faults import Fault, meant, row_place
from scenarios.schema import Row, check, columns

R = TypeVar("R", bound=Row)
R_co = TypeVar("R_co", bound=Row, covariant=True)


@dataclass(frozen=True)
class Table(Generic[R_co]):
    """The good rows of a CSV file; ``complete`` says whether they are all of them."""

    file: str
    rows: tuple[R_co, ...] = ()
    complete: bool = True
    present: bool = True

    def __iter__(self) -> Iterator[R_co]:
        return iter(self.rows)

    def fault(self, row: Row, column: str, problem: str, allowed: str) -> Fault:
        """
        Return a fault of one row.

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
        Fault
            The fault.
        """
        return Fault(self.file, row_place(row.row, column), problem, allowed)


class Reader:
    """Reads files, collects every fault, and remembers the bytes of what it read."""

    def __init__(self) -> None:
        self.faults: list[Fault] = []
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

    def _text(self, path: Path, role: str, *, optional: bool) -> str | None:
        if not path.is_file():
            if not optional:
                self._fault(path, "", "the file is missing", "a readable file of that name")
            return None
        try:
            content = path.read_bytes()
        except OSError as error:
            self._fault(path, "", f"cannot be read: {error.strerror}", "a readable file")
            return None
        self._read[f"{role}/{path.name}"] = content
        try:
            return content.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            line = content.count(b"\n", 0, error.start) + 1
            self._fault(path, f"line {line}", "bytes that are not UTF-8", "text encoded as UTF-8")
            return None

    def _fault(self, path: Path, where: str, problem: str, allowed: str) -> None:
        self.faults.append(Fault(path.name, where, problem, allowed))

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
        text = self._text(path, role, optional=False)
        if text is None:
            return None
        try:
            return tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            found = re.search(r"line (\d+)", str(error))
            line = found.group(1) if found else str(text.count("\n") + 1)
            problem = re.sub(r" \(at .*\)$", "", str(error))
            self._fault(path, f"line {line}", problem, "valid TOML, every name only once")
            return None

    def csv(self, path: Path, role: str, model: type[R], *, optional: bool = False) -> Table[R]:
        """
        Read a CSV file.

        Parameters
        ----------
        path
            The file.
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
        known = len(self.faults)
        text = self._text(path, role, optional=optional)
        if text is None:
            missing = len(self.faults) > known
            return Table(path.name, complete=not missing, present=False)
        try:
            lines = list(enumerate(csv.reader(io.StringIO(text, newline="")), start=1))
        except csv.Error as error:
            self._fault(path, "", str(error), "comma-separated fields")
            return Table(path.name, complete=False)
        stripped = [(row, [cell.strip() for cell in line]) for row, line in lines]
        # Spreadsheets write rows of separators below a table.
        cells = [(row, line) for row, line in stripped if any(line)]
        if not cells:
            self._fault(path, "row 1", "the file is empty", ",".join(columns(model)))
        elif self._header_is_good(path, cells[0][1], model):
            rows = self._rows(path, model, cells, optional=optional)
            return Table(path.name, rows, complete=len(self.faults) == known)
        return Table(path.name, complete=False)

    def _header_is_good(self, path: Path, header: list[str], model: type[Row]) -> bool:
        known, wanted = len(self.faults), columns(model)
        for separator in (";", "\t"):
            if len(header) == 1 and separator in header[0]:
                problem = f"fields are separated by {separator!r}"
                self._fault(path, "row 1", problem, "commas, and points in decimals")
                return False
        for name in header:
            if name not in wanted:
                left = [column for column in wanted if column not in header]
                self._fault(
                    path,
                    row_place(1, name),
                    f"unknown column {name!r}",
                    meant(name, left or wanted),
                )
            elif header.count(name) > 1:
                self._fault(path, row_place(1, name), "occurs twice", ",".join(wanted))
        for name in columns(model, required=True):
            if name not in header:
                self._fault(path, row_place(1, name), "is missing", ",".join(wanted))
        return len(self.faults) == known

    def _rows(
        self, path: Path, model: type[R], cells: list[tuple[int, list[str]]], *, optional: bool
    ) -> tuple[R, ...]:
        header = cells[0][1]
        if len(cells) == 1 and not optional:
            self._fault(path, "row 2", "there is no row below the header", "one row or more")
        good = []
        for row, line in cells[1:]:
            if len(line) != len(header):
                allowed = f"{len(header)} fields: {','.join(header)}"
                self._fault(path, row_place(row), f"has {len(line)} fields", allowed)
                continue
            checked, faults = check(
                model, {"row": row, **dict(zip(header, line, strict=True))}, path.name, row
            )
            self.faults += faults
            if checked is not None:
                good.append(checked)
        return tuple(good)
