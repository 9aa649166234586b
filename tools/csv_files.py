"""CSV files that tools write."""

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path


def write_rows(file: Path, rows: Iterable[Sequence[object]]) -> None:
    """
    Write a CSV file.

    Parameters
    ----------
    file
        Where.
    rows
        Rows, header first.
    """
    with file.open("w", encoding="utf-8", newline="") as target:
        csv.writer(target, lineterminator="\n").writerows(rows)
