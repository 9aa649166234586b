"""Frames with declared columns, and CSV files whose bytes can be reproduced."""

import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from kankaku.railway.step.records import Column

DECIMALS: Mapping[str, int] = {"s": 3, "m": 3, "m/s": 3, "km/h": 3, "kWh": 6}
"""Decimals kept by unit; a frame holds exactly what its file shows."""
DECIMALS_OTHERWISE = 6
_FORMULA = ("=", "+", "-", "@", "'")


def decimals(column: Column) -> int:
    """
    Return how many decimals a column of numbers keeps.

    Parameters
    ----------
    column
        A declared column.

    Returns
    -------
    int
        Decimals. [-]
    """
    return DECIMALS.get(column.unit, DECIMALS_OTHERWISE)


def typed_frame(values: Mapping[str, object], columns: Sequence[Column]) -> pd.DataFrame:
    """
    Build a frame with exactly the declared columns, types and decimals.

    Numbers are rounded here and not when written, so that whoever computes with the frame
    and whoever computes with the file get the same result.

    Parameters
    ----------
    values
        Values by column, one sequence of the same length each.
    columns
        Declared columns.

    Returns
    -------
    pd.DataFrame
        The frame, rows numbered from 0.

    Raises
    ------
    ValueError
        If a declared column is missing or another one is given.
    """
    names = [column.name for column in columns]
    odd = set(names).symmetric_difference(values)
    if odd:
        msg = f"columns missing or not declared: {', '.join(sorted(odd))}"
        raise ValueError(msg)
    return pd.DataFrame({column.name: _series(values[column.name], column) for column in columns})


def _series(values: object, column: Column) -> pd.Series:
    if column.dtype == "float64":
        # Adding zero turns -0.0 into 0.0.
        rounded = np.round(np.asarray(values, dtype=np.float64), decimals(column)) + 0.0
        return pd.Series(rounded, dtype="float64")
    return pd.Series(values, dtype=column.dtype)


def rows_frame(rows: Iterable[Mapping[str, object]], columns: Sequence[Column]) -> pd.DataFrame:
    """
    Build a frame with declared columns from rows.

    Parameters
    ----------
    rows
        One mapping from column to value each.
    columns
        Declared columns.

    Returns
    -------
    pd.DataFrame
        The frame, rows numbered from 0.
    """
    kept = list(rows)
    return typed_frame({c.name: [row[c.name] for row in kept] for c in columns}, columns)


def rows_of(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """
    Return the rows of a frame.

    Parameters
    ----------
    frame
        Any frame.

    Returns
    -------
    list[dict[str, Any]]
        One mapping from column to value each.
    """
    return [{str(name): value for name, value in row.items()} for row in frame.to_dict("records")]


def _texts(series: pd.Series, column: Column) -> list[str]:
    if column.dtype == "str":
        return [_guarded(str(value)) for value in series]
    if column.dtype != "float64":
        return [str(value) for value in series]
    places = decimals(column)
    return ["" if np.isnan(value) else f"{value:.{places}f}" for value in series]


def _guarded(text: str) -> str:
    """Return a text that no spreadsheet takes for a formula."""
    return f"'{text}" if text.startswith(_FORMULA) else text


def _unguarded(text: str) -> str:
    return text[1:] if text.startswith("'") and text[1:].startswith(_FORMULA) else text


def json_text(values: Mapping[str, Any]) -> str:
    """
    Return values as JSON that people can read, too.

    Parameters
    ----------
    values
        Anything that JSON can hold.

    Returns
    -------
    str
        The text.
    """
    return json.dumps(dict(values), indent=2, ensure_ascii=False) + "\n"


def csv_text(frame: pd.DataFrame, columns: Sequence[Column]) -> str:
    r"""
    Return a frame as CSV with fixed decimals, no index and ``\n`` at line ends.

    A spreadsheet would compute texts that begin with ``= + - @``: an apostrophe stands before
    them, and before another apostrophe. :func:`read_csv` takes it away again.

    Parameters
    ----------
    frame
        A frame of the declared columns.
    columns
        Declared columns.

    Returns
    -------
    str
        The text of the file.
    """
    texts = {column.name: _texts(frame[column.name], column) for column in columns}
    return pd.DataFrame(texts, dtype="str").to_csv(index=False, lineterminator="\n")


def read_csv(file: Path, columns: Sequence[Column]) -> pd.DataFrame:
    """
    Read a CSV of declared columns.

    Parameters
    ----------
    file
        The file.
    columns
        Declared columns.

    Returns
    -------
    pd.DataFrame
        The frame as :func:`typed_frame` built it.

    Raises
    ------
    ValueError
        If the file's columns are not the declared ones.
    """
    if file.exists() and not file.is_file():
        msg = f"{file}: is no file"
        raise ValueError(msg)
    names = [column.name for column in columns]
    found = list(pd.read_csv(file, nrows=0).columns)
    if found != names:
        msg = f"{file}: columns are {', '.join(found)}; expected {', '.join(names)}"
        raise ValueError(msg)
    texts = pd.read_csv(file, dtype="str", keep_default_na=False)
    return typed_frame({c.name: _values(texts[c.name].tolist(), c) for c in columns}, columns)


def _values(texts: Sequence[str], column: Column) -> Sequence[object]:
    if column.dtype == "float64":
        return [float(text) if text else np.nan for text in texts]
    if column.dtype == "int64":
        return [int(text) for text in texts]
    if column.dtype == "bool":
        return [text == "True" for text in texts]
    return [_unguarded(text) for text in texts]


def write_whole(file: Path, content: str | bytes) -> None:
    """
    Write a file so that nobody ever sees half of it.

    Parameters
    ----------
    file
        Where; its folder exists.
    content
        Text (written as UTF-8) or bytes.
    """
    partial = file.with_name(f".{file.name}.partial")
    try:
        partial.write_bytes(content.encode() if isinstance(content, str) else content)
        partial.replace(file)
    except OSError as error:
        with suppress(OSError):
            partial.unlink(missing_ok=True)
        # A full disk does not say which one it is.
        raise OSError(error.errno, error.strerror, str(file)) from error


def by_train(frame: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    """
    Split a table by train.

    Parameters
    ----------
    frame
        A table with a column ``train``.

    Returns
    -------
    list[tuple[str, pd.DataFrame]]
        Trains in order of appearance with their rows.
    """
    return [(str(train), rows) for train, rows in frame.groupby("train", sort=False)]


def columns_by_train(
    frame: pd.DataFrame, *names: str
) -> list[tuple[str, tuple[np.ndarray[tuple[int], np.dtype[Any]], ...]]]:
    """
    Split columns of a table by train, much faster than the table.

    Parameters
    ----------
    frame
        A table with a column ``train``.
    *names
        Columns.

    Returns
    -------
    list[tuple[str, tuple[numpy.ndarray, ...]]]
        Trains in order of appearance with their values of each column. shape (n_rows,) of a train
    """
    numbers, trains = pd.factorize(frame["train"])
    order = np.argsort(numbers, kind="stable")
    firsts = np.searchsorted(numbers[order], np.arange(1, len(trains)))
    columns = [np.split(frame[name].to_numpy()[order], firsts) for name in names]
    return [(str(train), tuple(parts)) for train, *parts in zip(trains, *columns, strict=True)]
