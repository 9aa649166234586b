"""Workbooks of Excel for tests."""

import io
from collections.abc import Sequence


def workbook(rows: Sequence[Sequence[object]], *, title: str = "Sheet", others: int = 0) -> bytes:
    """Return a workbook with these cells."""
    import openpyxl  # noqa: PLC0415 - an extra

    book = openpyxl.Workbook()
    book.active.title = title
    for row in rows:
        book.active.append(list(row))
    for number in range(others):
        book.create_sheet(f"Other {number}")
    buffer = io.BytesIO()
    book.save(buffer)
    return buffer.getvalue()
