"""The rows of all files of a scenario, and how they are written."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path
from typing import Any

import tomlkit

from kankaku.railway.errors import KankakuError
from kankaku.railway.plan.scenario import MAIN_FILE
from kankaku.scenarios.drafts.provenance_notes import SOURCES_FILE, SourceNotes
from kankaku.scenarios.loading.load_stock import STOCK_FILE
from kankaku.scenarios.reading.row_formats import Row, columns


class DraftError(KankakuError):
    """A scenario that cannot be made of what was given."""

    verdict = "no scenario was written"


@dataclass
class Draft:
    """A scenario that is not written yet."""

    title: str
    notes: SourceNotes
    settings: dict[str, Any]
    """Of ``scenario.toml``."""
    stock: dict[str, Any]
    """Of ``rolling_stock.toml``."""
    rows: dict[str, Sequence[Row]] = field(default_factory=dict)
    """Of the CSV files, by name of the file."""
    beside: dict[str, str] = field(default_factory=dict)
    """Other files, such as a licence, by name."""

    def files(self) -> dict[str, str]:
        """
        Return the files as they are written.

        Returns
        -------
        dict[str, str]
            Text by name; a file of rows without any is left out.
        """
        tables = {name: csv_text(rows) for name, rows in self.rows.items() if rows}
        return {
            MAIN_FILE: tomlkit.dumps(self.settings),
            STOCK_FILE: tomlkit.dumps(self.stock),
            **tables,
            **self.beside,
            SOURCES_FILE: self.notes.markdown(self.title),
        }


def csv_text(rows: Sequence[Row]) -> str:
    """
    Return rows as a CSV file.

    Parameters
    ----------
    rows
        One or more, of one kind.

    Returns
    -------
    str
        With a header; columns that may be absent, and in which no row says anything, are left out.
    """
    kind = type(rows[0])
    defaults = {part.name: part.default for part in fields(kind)}
    named = [
        name
        for name in columns(kind)
        if defaults[name] is MISSING or any(getattr(row, name) != defaults[name] for row in rows)
    ]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(named)
    writer.writerows([_cell(getattr(row, name)) for name in named] for row in rows)
    return text.getvalue()


def _cell(value: object) -> object:
    return f"{value:.10g}" if isinstance(value, float) else value


def refuse_there(folder: Path, names: Iterable[str], allowed: str, *, force: bool) -> None:
    """
    Refuse to replace files without being told to.

    Parameters
    ----------
    folder
        Where they go.
    names
        Of files, or of a folder in it.
    allowed
        What is.
    force
        Whether they may be replaced.

    Raises
    ------
    DraftError
        If one is there.
    """
    there = [name for name in names if (folder / name).exists()]
    if there and not force:
        others = f", and so are {len(there) - 1} others" if len(there) > 1 else ""
        raise DraftError(str(folder / there[0]), f"is there already{others}", allowed)


def write_files(files: Mapping[str, str], folder: Path, *, force: bool = False) -> None:
    """
    Write files into a folder, and replace none without being told to.

    Parameters
    ----------
    files
        Text by name.
    folder
        Made if missing.
    force
        Whether files of these names may be replaced.

    Raises
    ------
    DraftError
        If a file is there already, and then nothing is written, or the folder cannot be written.
    """
    refuse_there(folder, sorted(files), "another folder, or --force", force=force)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise DraftError(str(folder), f"cannot be written: {error.strerror}") from error
