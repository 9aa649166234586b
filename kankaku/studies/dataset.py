"""The dataset of an ensemble in one call: as a frame, or by a question in SQL."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.dataset as ds

from kankaku.store.dataset_store import (
    DATASET,
    MAIN,
    PARTS,
    EnsembleTask,
    files_of,
    parts_of,
    place_of,
)
from kankaku.store.ensemble_plan import EnsembleError

RUNS, COMPARED_RUNS = "runs", "runs_every_step"
"""Folders of the dataset, and of the runs that its engine is compared with."""
_HIVE = ds.partitioning(
    pa.schema([("scenario", pa.string()), ("controller", pa.string()), ("seed", pa.int64())]),
    flavor="hive",
)


def read(
    folder: str | Path, table: str = MAIN, columns: Sequence[str] | None = None
) -> pd.DataFrame:
    """
    Read a table of all runs of an ensemble.

    Parameters
    ----------
    folder
        Its results folder.
    table
        ``summary``, ``calls``, ``stops``, or ``trajectory`` if it was asked for.
    columns
        Which of its columns, if not all.

    Returns
    -------
    pd.DataFrame
        Columns ``scenario``, ``controller`` and ``seed``, then those of the table.

    Raises
    ------
    EnsembleError
        If there is no such table, or no run of it.
    """
    _refuse_unknown(table)
    files = _finished(Path(folder) / RUNS, table)
    if not files:
        raise EnsembleError(str(folder), f"holds no table {table}", "a folder of kankaku study")
    return read_files(table, files, columns)


def _finished(root: Path, table: str) -> list[Path]:
    """Return the files of finished runs, by scenario, controller and seed."""
    finished = {file.parent.relative_to(file.parents[3]) for file in files_of(root, MAIN)}
    files = [
        file
        for file in files_of(root, table)
        if file.parent.relative_to(file.parents[3]) in finished
    ]
    return sorted(files, key=parts_of)


def _refuse_unknown(table: str) -> None:
    if table not in DATASET:
        raise EnsembleError(table, "is no table of a dataset", ", ".join(DATASET))


def read_files(
    table: str, files: Sequence[Path], columns: Sequence[str] | None = None
) -> pd.DataFrame:
    """
    Read some files of a table.

    Parameters
    ----------
    table
        Name of the table.
    files
        Of finished runs, in the order of the rows.
    columns
        Which of its columns, if not all.

    Returns
    -------
    pd.DataFrame
        As :func:`read`.
    """
    wanted = [*PARTS, *(c for c in DATASET[table] if columns is None or c.name in columns)]
    found = ds.dataset([str(file) for file in files], format="parquet", partitioning=_HIVE)
    frame: pd.DataFrame = found.to_table([column.name for column in wanted]).to_pandas()
    return frame.astype({column.name: column.dtype for column in wanted})


def rows_of_runs(root: Path, tasks: Sequence[EnsembleTask]) -> pd.DataFrame:
    """
    Return the summary of some runs.

    Parameters
    ----------
    root
        Folder of the dataset.
    tasks
        Finished runs.

    Returns
    -------
    pd.DataFrame
        A row for each, in their order.
    """
    return read_files(MAIN, [place_of(root, MAIN, task) for task in tasks])


def query(folder: str | Path, sql: str) -> pd.DataFrame:
    """
    Ask the dataset of an ensemble a question, by DuckDB.

    Parameters
    ----------
    folder
        Its results folder.
    sql
        The question; tables are ``summary``, ``calls``, ``stops``, and ``trajectory`` if it was
        asked for, each with ``scenario``, ``controller`` and ``seed``.

    Returns
    -------
    pd.DataFrame
        The answer.

    Raises
    ------
    EnsembleError
        If there is no dataset, or DuckDB is not installed.
    """
    try:
        import duckdb  # noqa: PLC0415 - an optional part
    except ImportError as error:
        where = "query"
        allowed = "pip install 'kankaku[query]', or dataset.read and pandas"
        raise EnsembleError(where, "DuckDB is not installed", allowed) from error
    root = Path(folder) / RUNS
    found = {table: files for table in DATASET if (files := _finished(root, table))}
    if not found:
        raise EnsembleError(str(root), "holds no dataset", "a folder of kankaku study")
    with duckdb.connect() as connection:
        for table, files in found.items():
            connection.execute(_view(table, files))
        answer: pd.DataFrame = connection.execute(sql).df()
    return answer


def _view(table: str, files: Sequence[Path]) -> str:
    """Return what tells DuckDB of a table."""
    texts = ", ".join("'{}'".format(str(file).replace("'", "''")) for file in files)
    types = "{'scenario': VARCHAR, 'controller': VARCHAR, 'seed': BIGINT}"
    return (
        f"CREATE VIEW {table} AS SELECT * EXCLUDE ('table') FROM "  # noqa: S608 - own names
        f"read_parquet([{texts}], hive_partitioning = true, hive_types = {types})"
    )
