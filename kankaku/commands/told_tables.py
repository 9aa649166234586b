"""Tables as a command shows them: as wide as the screen allows, or for other programs to read."""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import typer
from rich.cells import cell_len
from rich.markup import escape
from rich.table import Table

from kankaku.analysis.tables.columns import clock_texts, csv_text, decimals, rows_of, with_clocks
from kankaku.commands.screen import answers
from kankaku.commands.shared_options import Format
from kankaku.railway.step.records import Column
from kankaku.scenarios.reading.cell_texts import printable

LONGEST_CELL = 60
"""Characters of a text in a table. [-]"""
_FRAME = 3
"""What a column takes beside its text. [characters]"""


def plain(text: object) -> str:
    """
    Return a text of a results folder as it may stand on a terminal.

    Parameters
    ----------
    text
        Anything; a stranger may have written it.

    Returns
    -------
    str
        Short, and without anything that moves a cursor.
    """
    told = printable(str(text))
    return told if len(told) <= LONGEST_CELL else f"{told[: LONGEST_CELL - 3]}..."


def echo(text: str) -> None:
    """
    Write a text for other programs, unwrapped.

    Parameters
    ----------
    text
        With its own line ends.
    """
    typer.echo(text, nl=not text.endswith("\n"))


def paragraph(text: str) -> None:
    """
    Write a paragraph, as wide as the screen.

    Parameters
    ----------
    text
        May hold what a stranger wrote.
    """
    answers.print(escape(printable(text)), highlight=False)


def path_line(what: str, path: Path) -> None:
    """
    Write where something lies; a path is never broken.

    Parameters
    ----------
    what
        Its name.
    path
        Where.
    """
    answers.print(escape(printable(f"{what}: {path}")), soft_wrap=True, highlight=False)


def width_of(header: Sequence[str], rows: Sequence[Sequence[str]], column: int) -> int:
    """
    Return how many characters a column of a table takes.

    Parameters
    ----------
    header
        Names; they wrap at spaces.
    rows
        Cells; they do not wrap.
    column
        Which one.

    Returns
    -------
    int
        With its part of the frame. [characters]
    """
    words = [cell_len(word) for word in header[column].split(" ")]
    cells = [cell_len(row[column]) for row in rows]
    return max([*words, *cells, 1]) + _FRAME


def fitting(
    header: Sequence[str], rows: Sequence[Sequence[str]], *, kept: int, width: int
) -> list[int]:
    """
    Return which columns of a table fit on a screen.

    Parameters
    ----------
    header
        Names of the columns, the most important first.
    rows
        Cells.
    kept
        The first columns, which are always shown. [-]
    width
        Of the screen. [characters]

    Returns
    -------
    list[int]
        The first ones, and of the others those that still fit, in order.
    """
    left = width - 1 - sum(width_of(header, rows, column) for column in range(kept))
    chosen = list(range(kept))
    for column in range(kept, len(header)):
        left -= width_of(header, rows, column)
        if left < 0:
            break
        chosen.append(column)
    return chosen


def show_fitting(
    header: Sequence[str], rows: Sequence[Sequence[str]], *, kept: int = 1, texts: int = 1
) -> int:
    """
    Write a table with as many columns as fit on the screen.

    Parameters
    ----------
    header
        Names of the columns, the most important first.
    rows
        Cells.
    kept
        The first columns, which are always shown. [-]
    texts
        The first columns, which hold texts and stand on the left. [-]

    Returns
    -------
    int
        How many columns did not fit. [-]
    """
    columns = fitting(header, rows, kept=kept, width=answers.width)
    table = Table(pad_edge=True)
    for column in columns:
        justify: Any = "left" if column < texts else "right"
        table.add_column(
            escape(header[column]),
            justify=justify,
            overflow="fold",
            max_width=width_of(header, rows, column) - _FRAME,
        )
    for row in rows:
        table.add_row(*(escape(row[column]) for column in columns))
    answers.print(table)
    return len(header) - len(columns)


def cell_text(value: object, column: Column) -> str:
    """
    Return a cell for people.

    Parameters
    ----------
    value
        Of the column's type.
    column
        A declared column.

    Returns
    -------
    str
        Numbers with a decimal and thousands, times of day as a clock, a dash for none.
    """
    if isinstance(value, float):
        if not np.isfinite(value):
            return "-"
        if column.clock:
            return clock_texts(np.array([value]))[0]
        return f"{value:,.{min(decimals(column), 1)}f}"
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    return plain(value)


def _json(value: object) -> object:
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    return value.item() if isinstance(value, np.generic) else value


def json_rows(rows: Iterable[Mapping[str, Any]]) -> list[dict[str, object]]:
    """
    Return rows as JSON can hold them.

    Parameters
    ----------
    rows
        Numbers, texts and truths by column.

    Returns
    -------
    list[dict[str, object]]
        The same; what is no number is null.
    """
    return [{name: _json(value) for name, value in row.items()} for row in rows]


def tell_frame(
    frame: pd.DataFrame,
    columns: Sequence[Column],
    form: Format,
    *,
    important: Sequence[str] = (),
    texts: int = 1,
) -> None:
    """
    Write a table for people or for other programs.

    Parameters
    ----------
    frame
        A frame of the declared columns.
    columns
        Declared columns.
    form
        How; for people as many columns as fit.
    important
        Names of the columns that people need first, the other ones after them; as declared if
        empty.
    texts
        How many of the first columns name what a row is about, and are always shown. [-]
    """
    if form is Format.CSV:
        echo(csv_text(frame, columns))
    elif form is Format.JSON:
        rows = json_rows(rows_of(with_clocks(frame, columns)))
        echo(json.dumps(rows, indent=2, ensure_ascii=False))
    else:
        of = {column.name: column for column in columns}
        names = [*important, *(name for name in of if name not in important)]
        header = [
            f"{name.replace('_', ' ')} [{of[name].unit}]"
            if of[name].unit
            else name.replace("_", " ")
            for name in names
        ]
        cells = [[cell_text(row[name], of[name]) for name in names] for row in rows_of(frame)]
        left = show_fitting(header, cells, kept=texts, texts=texts)
        if left:
            more = "1 more column" if left == 1 else f"{left} more columns"
            paragraph(f"{more} on a wider screen, or with --format csv.")
