"""Files that only grow, a line of JSON for each finished run: whoever is killed loses none."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def json_line(values: Mapping[str, Any]) -> bytes:
    """
    Return the line for some values.

    Parameters
    ----------
    values
        What JSON can hold.

    Returns
    -------
    bytes
        With a line feed at the end.
    """
    return json.dumps(values).encode() + b"\n"


def whole_lines(file: Path) -> list[bytes]:
    """
    Return the lines of a file, without the half one of who was killed while writing.

    Parameters
    ----------
    file
        The file; it need not exist.

    Returns
    -------
    list[bytes]
        Lines with their line feeds.
    """
    lines = file.read_bytes().splitlines(keepends=True) if file.exists() else []
    return [line for line in lines if line.endswith(b"\n")]


def append_line(file: Path, values: Mapping[str, Any]) -> None:
    """
    Add a line to a file of whole lines; it is on the disk when this returns.

    Parameters
    ----------
    file
        The file.
    values
        What JSON can hold.
    """
    with file.open("ab") as growing:
        growing.write(json_line(values))
        growing.flush()
        os.fsync(growing.fileno())
