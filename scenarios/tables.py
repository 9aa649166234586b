"""Rows of CSV files: read in pieces, checked column by column, so that a million take seconds."""

import csv
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields
from functools import cache
from itertools import islice
from typing import Any, Generic, TypeVar, cast, get_type_hints

import numpy as np
from pydantic import TypeAdapter, ValidationError
from pydantic.fields import FieldInfo

from scenarios.explain import refused_cell
from scenarios.schema import Row
from scenarios.texts import number

R = TypeVar("R", bound=Row)

PIECE = 1 << 15
"""Rows that are checked together. [-]"""
LONGEST_LINE = 100_000
"""[-]"""
_PLAIN_NUMBERS = re.compile(r"[0-9eE+.\-]*")
_REFUSED = object()


class LongLineError(ValueError):
    """A row is longer than any row of a table."""


class Records:
    """The rows of a CSV file as lists of cells, each with its number; none of them endless."""

    def __init__(self, content: bytes) -> None:
        self._stream = io.TextIOWrapper(io.BytesIO(content), encoding="utf-8-sig", newline="")
        self._length = 0

    def __iter__(self) -> Iterator[tuple[int, list[str]]]:
        for row, cells in enumerate(csv.reader(self._lines()), start=1):
            self._length = 0
            # Spreadsheets write rows of separators below a table.
            if any(map(str.strip, cells)):
                yield row, cells

    def _lines(self) -> Iterator[str]:
        while line := self._stream.readline(LONGEST_LINE + 1):
            self._length += len(line)
            if self._length > LONGEST_LINE:
                raise LongLineError
            yield line


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
            known[text] = self._value(text)
        values = [known[text] for text in cells]
        bad = [at for at, value in enumerate(values) if value is _REFUSED]
        return values, bad

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
            found = map(number, cells)
            values = [np.nan if value is None else value for value in found]
        found_all = np.array(values)
        good = np.isfinite(found_all)
        for entry in self.info.metadata:
            good &= found_all >= getattr(entry, "ge", -np.inf)
            good &= found_all <= getattr(entry, "le", np.inf)
        return values, np.flatnonzero(~good).tolist()


@cache
def _field_infos(model: type[Row]) -> dict[str, FieldInfo]:
    hints = get_type_hints(model, include_extras=True)
    return {
        part.name: FieldInfo.from_annotation(hints[part.name])
        for part in fields(model)
        if part.name != "row"
    }


@dataclass
class RowReader(Generic[R]):
    """Turns cells into rows; remembers what was wrong where."""

    model: type[R]
    header: Sequence[str]
    good: list[R] = field(default_factory=list)
    refused: dict[str, list[tuple[int, str]]] = field(default_factory=dict)
    """Row and cell of all that are not allowed, by column."""
    uneven: list[int] = field(default_factory=list)
    """Rows with another number of cells than the header."""
    first_uneven: list[str] = field(default_factory=list)
    """Cells of the first of them."""

    def __post_init__(self) -> None:
        infos = _field_infos(self.model)
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
        return refused_cell(_field_infos(self.model)[column], self.refused[column][0][1])

    def read(self, records: Iterator[tuple[int, list[str]]]) -> None:
        """
        Read all rows.

        Parameters
        ----------
        records
            Numbers and cells.
        """
        even = self._even(records)
        while piece := list(islice(even, PIECE)):
            rows, cells = zip(*piece, strict=True)
            self._take(rows, tuple(zip(*cells, strict=True)))

    def _even(self, records: Iterator[tuple[int, list[str]]]) -> Iterator[tuple[int, list[str]]]:
        width = len(self.header)
        for row, cells in records:
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
            stripped = list(map(str.strip, cells))
            values[column.name], bad = column.checked(stripped)
            if bad:
                wrong.update(bad)
                told = self.refused.setdefault(column.name, [])
                told += [(rows[at], stripped[at] if not told else "") for at in bad]
        if wrong:
            kept = [at for at in range(len(rows)) if at not in wrong]
            values = {name: [own[at] for at in kept] for name, own in values.items()}
        self.good += self._made(values)

    def _made(self, values: dict[str, Sequence[Any]]) -> list[R]:
        count = len(values["row"])
        parts = fields(self.model)
        ordered = [values.get(part.name, [part.default] * count) for part in parts]
        return list(map(cast("Any", self.model), *ordered))
