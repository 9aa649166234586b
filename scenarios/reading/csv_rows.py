"""Rows of CSV files: read in pieces, checked column by column, so that a million take seconds."""

import csv
import io
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, fields
from itertools import islice
from typing import Any, Generic, TypeVar, cast, get_type_hints

import numpy as np
from pydantic import TypeAdapter, ValidationError
from pydantic.fields import FieldInfo

from kankaku.scenarios.reading.cell_texts import NUMBER
from kankaku.scenarios.reading.explain import refused_cell
from kankaku.scenarios.reading.fields import CLOCK_TEXT
from kankaku.scenarios.reading.row_formats import Row

R = TypeVar("R", bound=Row)

PIECE = 1 << 15
"""Rows that are checked together. [-]"""
SMALL_PIECE = 1 << 8
"""Of rows that may be long. [-]"""
LONGEST_LINE = 100_000
"""Characters of a row. [-]"""
SHORT_LINE = 2_000
"""Bytes. [-]"""
MOST_CELLS = 20
"""Of a row, on average. [-]"""
_PLAIN_NUMBERS = re.compile(r"[0-9eE+.\-]*")
_REFUSED = object()


class LongLineError(ValueError):
    """A row is longer than any row of a table."""


class Records:
    """The rows of a CSV file as lists of cells, each with its number; none of them endless."""

    def __init__(self, content: bytes) -> None:
        self._stream = io.TextIOWrapper(io.BytesIO(content), encoding="utf-8-sig", newline="")
        self._length = 0
        self._plain = _is_plain(content)

    def pieces(self) -> Iterator[tuple[range, list[list[str]]]]:
        """
        Yield the rows.

        Yields
        ------
        tuple[range, list[list[str]]]
            Numbers and cells of some rows.
        """
        records = csv.reader(self._stream if self._plain else self._lines())
        short = records if self._plain else (self._begun(cells) for cells in records)
        first, count = 1, 1
        while piece := list(islice(short, count)):
            yield range(first, first + len(piece)), piece
            first += len(piece)
            # The header comes alone, whatever stands above it.
            if count > 1 or any(map(str.strip, piece[0])):
                count = PIECE if self._plain else SMALL_PIECE

    def _begun(self, cells: list[str]) -> list[str]:
        self._length = 0
        return cells

    def _lines(self) -> Iterator[str]:
        while line := self._stream.readline(LONGEST_LINE + 1):
            self._length += len(line)
            if self._length > LONGEST_LINE:
                raise LongLineError
            yield line


def _is_plain(content: bytes) -> bool:
    """Return whether every line is a short row of a few cells; they are read the faster for it."""
    if b'"' in content or content.count(b"\r") > content.count(b"\r\n"):
        return False
    ends = np.flatnonzero(np.frombuffer(content, np.uint8) == ord("\n"))
    edges = np.concatenate([[0], ends, [len(content)]])
    few = content.count(b",") <= MOST_CELLS * edges.size
    return few and int(np.diff(edges).max()) < SHORT_LINE


@dataclass(frozen=True)
class _Column:
    """What the cells of a column may hold."""

    name: str
    info: FieldInfo
    adapter: TypeAdapter[Any]
    known: dict[str, object] = field(default_factory=dict)
    """Texts that were checked before."""

    def checked(self, cells: Sequence[str]) -> tuple[list[Any], list[int]]:
        """Return the values of cells, and the places of those that are not allowed."""
        if self.info.annotation is float:
            return self._numbers(cells)
        known = self.known
        for text in set(cells).difference(known):
            known[text] = self._value(text.strip())
        values = [known[text] for text in cells]
        return values, [at for at, value in enumerate(values) if value is _REFUSED]

    def _value(self, text: str) -> object:
        try:
            return self.adapter.validate_python(text, strict=True)
        except ValidationError:
            return _REFUSED

    def _numbers(self, cells: Sequence[str]) -> tuple[list[float], list[int]]:
        values: list[float] = []
        if _PLAIN_NUMBERS.fullmatch("".join(cells)):
            try:
                values = list(map(float, cells))
            except ValueError:
                values = []
        if not values:
            stripped, is_number = map(str.strip, cells), NUMBER.fullmatch
            values = [float(text) if is_number(text) else np.nan for text in stripped]
        found = np.array(values)
        good = np.isfinite(found)
        for entry in self.info.metadata:
            good &= found >= getattr(entry, "ge", -np.inf)
            good &= found <= getattr(entry, "le", np.inf)
        return values, np.flatnonzero(~good).tolist()


def field_infos(model: type[Row]) -> dict[str, FieldInfo]:
    """
    Return what the cells of a kind of row may hold.

    Parameters
    ----------
    model
        The kind of row.

    Returns
    -------
    dict[str, FieldInfo]
        By column.
    """
    hints = get_type_hints(model, include_extras=True)
    return {
        part.name: FieldInfo.from_annotation(hints[part.name])
        for part in fields(model)
        if part.name != "row"
    }


def clock_columns(model: type[Row]) -> frozenset[str]:
    """
    Return which columns hold times of day.

    Parameters
    ----------
    model
        A kind of row.

    Returns
    -------
    frozenset[str]
        Their names.
    """
    infos = field_infos(model).items()
    return frozenset(
        name for name, info in infos if (info.description or "").startswith(CLOCK_TEXT)
    )


@dataclass
class RowReader(Generic[R]):
    """Turns cells into rows; remembers what was wrong where."""

    model: type[R]
    header: Sequence[str]
    good: list[R] = field(default_factory=list)
    rows: int = 0
    """Rows below the header, wrong ones included. [-]"""
    refused: dict[str, list[int]] = field(default_factory=dict)
    """Rows with a cell that is not allowed, by column."""
    first_refused: dict[str, str] = field(default_factory=dict)
    """The first of these cells, by column."""
    uneven: list[int] = field(default_factory=list)
    """Rows with another number of cells than the header."""
    first_uneven: list[str] = field(default_factory=list)
    """Cells of the first of them."""

    def __post_init__(self) -> None:
        infos = field_infos(self.model)
        self._columns = [
            _Column(name, infos[name], TypeAdapter(infos[name].rebuild_annotation()))
            for name in self.header
        ]

    def explained(self, column: str) -> tuple[str, str]:
        """
        Return what is wrong with the first refused cell of a column.

        Parameters
        ----------
        column
            Its name.

        Returns
        -------
        tuple[str, str]
            Problem and what is allowed.
        """
        return refused_cell(field_infos(self.model)[column], self.first_refused[column])

    def read(self, pieces: Iterable[tuple[range, list[list[str]]]]) -> None:
        """
        Read all rows.

        Parameters
        ----------
        pieces
            Numbers and cells of some rows.
        """
        width = len(self.header)
        for numbers, piece in pieces:
            rows: Sequence[int] = numbers
            columns = list(zip(*piece, strict=True)) if {*map(len, piece)} == {width} else []
            # Spreadsheets write rows of separators below a table.
            if not columns or not all(map(str.strip, columns[0])):
                even = list(self._even(numbers, piece))
                rows = [row for row, _ in even]
                columns = list(zip(*(cells for _, cells in even), strict=True))
            self.rows += len(rows)
            if rows:
                self._take(rows, columns)

    def _even(self, rows: range, piece: list[list[str]]) -> Iterator[tuple[int, list[str]]]:
        width = len(self.header)
        for row, cells in zip(rows, piece, strict=True):
            if not any(map(str.strip, cells)):
                continue
            if len(cells) == width:
                yield row, cells
                continue
            if not self.uneven:
                self.first_uneven = cells
            self.uneven.append(row)

    def _take(self, rows: Sequence[int], columns: Sequence[Sequence[str]]) -> None:
        values: dict[str, Sequence[Any]] = {"row": rows}
        wrong: set[int] = set()
        for column, cells in zip(self._columns, columns, strict=True):
            values[column.name], bad = column.checked(cells)
            if bad:
                wrong.update(bad)
                self.first_refused.setdefault(column.name, cells[bad[0]].strip())
                self.refused.setdefault(column.name, []).extend(rows[at] for at in bad)
        if wrong:
            kept = [at for at in range(len(rows)) if at not in wrong]
            values = {name: [own[at] for at in kept] for name, own in values.items()}
        self.good += self._made(values)

    def _made(self, values: dict[str, Sequence[Any]]) -> list[R]:
        count = len(values["row"])
        parts = fields(self.model)
        ordered = [values.get(part.name, [part.default] * count) for part in parts]
        return list(map(cast("Any", self.model), *ordered))
