"""Frames with declared columns, and CSV files whose bytes can be reproduced."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from kankaku.railway.arrays import FloatArray
from kankaku.railway.step.records import Column

DECIMALS: Mapping[str, int] = {"s": 3, "m": 3, "m/s": 3, "km/h": 3, "kWh": 6}
"""Decimals kept by unit; a frame holds exactly what its file shows."""
DECIMALS_OTHERWISE = 6
_FORMULA = ("=", "+", "-", "@", "'")
_SHOWN = 60
"""Characters of a wrong value that are shown. [-]"""


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


def written_columns(columns: Sequence[Column]) -> tuple[Column, ...]:
    """
    Return the columns of a file: the declared ones, and a clock for each time of day behind them.

    Parameters
    ----------
    columns
        Declared columns.

    Returns
    -------
    tuple[Column, ...]
        Of ``arrival_s`` the clock is ``arrival_clock``.
    """
    clocks = (
        Column(_clock_name(column), "str", "", f"{column.name} as hh:mm:ss, to the nearest second")
        for column in columns
        if column.clock
    )
    return (*columns, *clocks)


def _clock_name(column: Column) -> str:
    return f"{column.name.removesuffix('_s')}_clock"


def with_clocks(frame: pd.DataFrame, columns: Sequence[Column]) -> pd.DataFrame:
    """
    Return a frame with a clock for each of its times of day.

    Parameters
    ----------
    frame
        A frame of the declared columns.
    columns
        Declared columns.

    Returns
    -------
    pd.DataFrame
        Columns :func:`written_columns`; hours go on after 24, and no time has an empty clock.
    """
    clocks = {
        _clock_name(column): pd.Series(
            clock_texts(frame[column.name].to_numpy()), index=frame.index, dtype="str"
        )
        for column in columns
        if column.clock
    }
    return frame.assign(**clocks) if clocks else frame


def clock_texts(times_s: FloatArray) -> list[str]:
    """
    Return times of day as a clock shows them.

    Parameters
    ----------
    times_s
        Seconds after midnight; not a number where there is none. [s], shape (n,)

    Returns
    -------
    list[str]
        ``hh:mm:ss``, hours from 24 on after midnight; empty where there is none.
    """
    known = np.isfinite(times_s)
    # Half a second rounds up, so that no two seconds of a run have one clock.
    whole = np.where(known, np.floor(times_s + 0.5), -1.0).astype(np.int64)
    # Trains share their seconds: there are far fewer than rows.
    which, seconds = pd.factorize(whole)
    clocks = [
        "" if second < 0 else f"{second // 3600:02d}:{second // 60 % 60:02d}:{second % 60:02d}"
        for second in seconds.tolist()
    ]
    return [clocks[at] for at in which.tolist()]


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
        The text of the file, with the columns :func:`written_columns`.
    """
    shown = with_clocks(frame, columns)
    texts = {c.name: _texts(shown[c.name], c) for c in written_columns(columns)}
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
    try:
        texts = pd.read_csv(file, dtype="str", keep_default_na=False)
    except ValueError as error:
        # Neither who reads tables nor who decodes texts names the file.
        msg = f"{file}: is no CSV file in UTF-8: {' '.join(str(error).split())}"
        raise ValueError(msg) from error
    found = list(texts.columns)
    # What earlier versions wrote has no clocks, which nobody needs to read back.
    if found not in (names, [column.name for column in written_columns(columns)]):
        msg = f"{file}: columns are {', '.join(found)}; expected {', '.join(names)}"
        raise ValueError(msg)
    values = {}
    for column in columns:
        read = _READERS[column.dtype]
        own = texts[column.name].tolist()
        try:
            values[column.name] = [read(text) for text in own]
        except ValueError as error:
            row = next(row for row, text in enumerate(own) if not _can(read, text))
            msg = (
                f"{file}: row {row + 2}, column {column.name}: {own[row][:_SHOWN]!r} is no "
                f"{_KINDS[column.dtype]}"
            )
            raise ValueError(msg) from error
    return typed_frame(values, columns)


def _can(read: Callable[[str], object], text: str) -> bool:
    with suppress(ValueError):
        read(text)
        return True
    return False


def _truth(text: str) -> bool:
    if text not in {"True", "False"}:
        raise ValueError(text)
    return text == "True"


def _real(text: str) -> float:
    return float(text) if text else np.nan


_READERS: Mapping[str, Callable[[str], object]] = {
    "float64": _real,
    "int64": int,
    "bool": _truth,
    "str": _unguarded,
}
_KINDS: Mapping[str, str] = {
    "float64": "number",
    "int64": "whole number",
    "bool": "True or False",
    "str": "text",
}


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
