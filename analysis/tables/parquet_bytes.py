"""Tables as Parquet whose bytes depend on nothing but what they hold, each with a note inside."""

import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from kankaku.railway.step.records import Column

NOTE = b"kankaku"
"""Key of the note in the file."""
TYPES: Mapping[str, pa.DataType] = {
    "float64": pa.float64(),
    "int64": pa.int64(),
    "bool": pa.bool_(),
    "str": pa.string(),
}
WRITER: Mapping[str, Any] = {
    "version": "2.6",
    "data_page_version": "1.0",
    "compression": "zstd",
    "compression_level": 3,
    "write_statistics": False,
    "store_schema": False,
}
"""Said in full, so that another default of another version changes no bytes."""
MOST_ROWS = 1 << 20
"""Of a row group. [-]"""


def parquet_bytes(frame: pd.DataFrame, columns: Sequence[Column], note: Mapping[str, Any]) -> bytes:
    """
    Return a table as a Parquet file.

    Parameters
    ----------
    frame
        A frame that has the declared columns.
    columns
        Which of them are written, in order.
    note
        What else there is to tell of the table; anything that JSON can hold.

    Returns
    -------
    bytes
        The same for the same table and note. Numbers that are missing (nan) are null.
    """
    schema = pa.schema([(column.name, TYPES[column.dtype]) for column in columns])
    arrays = [
        pa.array(frame[field.name].to_numpy(dtype=_plain(field.type)), field.type, from_pandas=True)
        for field in schema
    ]
    told = json.dumps(note, sort_keys=True, ensure_ascii=False, separators=(",", ":"))
    buffer = io.BytesIO()
    with pq.ParquetWriter(buffer, schema, **WRITER) as writer:
        writer.write_table(pa.Table.from_arrays(arrays, schema=schema), MOST_ROWS)
        writer.add_key_value_metadata({NOTE: told})
    return buffer.getvalue()


def _plain(kind: pa.DataType) -> Any:  # noqa: ANN401 - whatever numpy calls it
    return object if pa.types.is_string(kind) else kind.to_pandas_dtype()


def note_of(source: Path | bytes) -> dict[str, Any]:
    """
    Return the note in a Parquet file; its table is not read.

    Parameters
    ----------
    source
        The file, or its bytes.

    Returns
    -------
    dict[str, Any]
        What :func:`parquet_bytes` was given.

    Raises
    ------
    ValueError
        If it is no such file, or has no note.
    """
    where = io.BytesIO(source) if isinstance(source, bytes) else source
    found = (pq.read_metadata(where).metadata or {}).get(NOTE)
    note = json.loads(found) if found else None
    if not isinstance(note, dict):
        msg = f"{source if isinstance(source, Path) else 'table'}: has no note of this program"
        raise ValueError(msg)  # noqa: TRY004 - a file is wrong, not an argument
    return note
