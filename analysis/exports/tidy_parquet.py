"""Tables of all runs together, one observation a row, with unit and meaning of every column."""

import io
from collections.abc import Sequence

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from kankaku.analysis.tables.columns import with_clocks, written_columns
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.railway.step.records import RAW_TABLES, Column

OF_RUN = (
    Column("controller", "str", "", "name of the controller"),
    Column("seed", "int64", "", "seed of the run"),
    Column("initial_delay_s", "float64", "s", "by how much the train of a sweep overstays"),
)


def tidy_columns(table: str) -> tuple[Column, ...]:
    """
    Return the columns of a tidy table.

    Parameters
    ----------
    table
        Name of a raw table.

    Returns
    -------
    tuple[Column, ...]
        Which run a row is of, the columns of the raw table, and a clock for each time of day.
    """
    return (*OF_RUN, *written_columns(RAW_TABLES[table]))


def tidy_frame(runs: Sequence[RunTables], table: str) -> pd.DataFrame:
    """
    Return a raw table of all runs together.

    Parameters
    ----------
    runs
        In the order in which they are to appear.
    table
        Name of the table.

    Returns
    -------
    pd.DataFrame
        Columns :func:`tidy_columns`.
    """
    names = [column.name for column in tidy_columns(table)]
    parts = [
        with_clocks(run.frames[table], RAW_TABLES[table]).assign(
            controller=run.controller, seed=run.seed, initial_delay_s=run.initial_delay_s
        )
        for run in runs
    ]
    return pd.concat(parts, ignore_index=True)[names]


def tidy_parquet(runs: Sequence[RunTables], table: str) -> bytes:
    """
    Return a raw table of all runs together as a Parquet file.

    Parameters
    ----------
    runs
        In the order in which they are to appear.
    table
        Name of the table.

    Returns
    -------
    bytes
        The file. Every column has ``unit`` and ``meaning`` as metadata; texts are kept as
        dictionaries, so that a name takes room once.
    """
    content = pa.Table.from_pandas(tidy_frame(runs, table), preserve_index=False)
    fields, arrays = [], []
    for column in tidy_columns(table):
        values = content.column(column.name)
        if column.dtype == "str":
            values = values.cast(pa.string()).dictionary_encode()
        told = {"unit": column.unit, "meaning": column.meaning}
        fields.append(pa.field(column.name, values.type, metadata=told))
        arrays.append(values)
    whole = pa.table(arrays, schema=pa.schema(fields))
    buffer = io.BytesIO()
    pq.write_table(whole, buffer, compression="zstd")
    return buffer.getvalue()
