"""One publisher for all kinds of results: tables, figures, columns, texts and provenance."""

import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import pandas as pd

from kankaku.analysis.results import COLUMNS, columns_frame
from kankaku.analysis.tables.columns import csv_text, json_text, with_clocks, write_whole
from kankaku.railway.step.records import Column

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Draw: TypeAlias = "Callable[[], Figure]"
"""Draws a figure when it is asked to: who needs no figure need not wait for matplotlib."""


EXPLAINED, MADE_FROM = "columns.csv", "provenance.json"
"""Every folder has what its columns mean, and what it was made from."""
FORMATS = ("png", "svg")
"""Of figures, if nobody says which."""
EVERY_FORMAT = (*FORMATS, "pdf")
"""Of figures, that can be asked for."""


def image_names(figures: Iterable[str], formats: Sequence[str]) -> list[str]:
    """
    Return the files that a report shows.

    Parameters
    ----------
    figures
        Names of the figures.
    formats
        What they are written as; PNG is shown if it is among them.

    Returns
    -------
    list[str]
        One file for each figure; none without formats that a text can show.
    """
    shown = next((kind for kind in FORMATS if kind in formats), None)
    return [f"{figure}.{shown}" for figure in figures] if shown else []


def _images(figures: Iterable[str], formats: Sequence[str] = EVERY_FORMAT) -> set[str]:
    return {f"{figure}.{ending}" for figure in figures for ending in formats}


class Kind(NamedTuple):
    """A kind of results folder: another one is one more of these."""

    main: str
    """The table that a reader opens first; a folder counts as results once it has it."""
    tables: Mapping[str, tuple[Column, ...]]
    """Columns of every table that it may have."""
    figures: tuple[str, ...] = ()
    """Every figure that it may have."""
    texts: tuple[str, ...] = ()
    """Files of other text."""
    large: frozenset[str] = frozenset()
    """Tables that are written as Parquet."""
    elsewhere: frozenset[str] = frozenset()
    """Tables that lie in folders below it and are written before."""
    made_from: str = MADE_FROM
    """The file that says what it was made from."""

    @property
    def marks(self) -> tuple[str, ...]:
        """The files by which a folder of this kind is known."""
        return self.file_of(self.main), EXPLAINED

    @property
    def files(self) -> frozenset[str]:
        """Every file that a folder of this kind may have itself."""
        own = [self.file_of(table) for table in self.tables if table not in self.elsewhere]
        return frozenset({*own, *_images(self.figures), *self.texts, EXPLAINED, self.made_from})

    def file_of(self, table: str) -> str:
        """Return the name of a table's file."""
        return f"{table}.parquet" if table in self.large else f"{table}.csv"


def publish_folder(
    folder: Path,
    kind: Kind,
    frames: Mapping[str, pd.DataFrame],
    figures: Mapping[str, Draw],
    provenance: Mapping[str, Any],
    *,
    texts: Mapping[str, str] | None = None,
    formats: Sequence[str] = FORMATS,
) -> None:
    """
    Write a results folder; files of an earlier one that are not written again are removed.

    Parameters
    ----------
    folder
        Results folder; made if missing.
    kind
        What it may hold.
    frames
        Its own tables by name, the main one among them.
    figures
        What draws its figures, by name; a name may have a folder in front.
    provenance
        What was done; anything that JSON can hold.
    texts
        Other files by name.
    formats
        Of the figures.
    """
    files = {kind.file_of(name): _content(kind, name, frame) for name, frame in frames.items()}
    main = files.pop(kind.file_of(kind.main))
    explained = {
        name: columns
        for name, columns in kind.tables.items()
        if name in frames or name in kind.elsewhere
    }
    files |= texts or {}
    files[kind.made_from] = json_text(provenance)
    files[EXPLAINED] = csv_text(columns_frame(explained), COLUMNS)
    folder.mkdir(parents=True, exist_ok=True)
    for name in kind.files - files.keys() - _images(figures, formats) - {kind.file_of(kind.main)}:
        (folder / name).unlink(missing_ok=True)
    _draw(folder, figures, formats)
    for name, content in files.items():
        write_whole(folder / name, content)
    # Last, because a folder counts as results once it has it.
    write_whole(folder / kind.file_of(kind.main), main)


def _content(kind: Kind, table: str, frame: pd.DataFrame) -> str | bytes:
    if table not in kind.large:
        return csv_text(frame, kind.tables[table])
    buffer = io.BytesIO()
    shown = with_clocks(frame, kind.tables[table])
    shown.to_parquet(buffer, engine="pyarrow", compression="zstd", index=False)
    return buffer.getvalue()


def _draw(folder: Path, figures: Mapping[str, Draw], formats: Sequence[str]) -> None:
    if not figures:
        return
    # Here, because it takes half a second that not every command needs.
    from kankaku.analysis.figures.style import write_figure  # noqa: PLC0415

    for name, draw in figures.items():
        (folder / name).parent.mkdir(exist_ok=True)
        write_figure(draw(), folder / name, formats)
