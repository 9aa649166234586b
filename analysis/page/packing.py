"""
Tables as few bytes that a browser reads quickly, and that give back every number exactly.

A column of numbers is a column of whole numbers over a power of ten. Neighbours differ little, so
their differences (or the differences of those) are stored, signs folded in, low bytes first and
all bytes of one significance together. So place, speed and end of authority of a train in a second
take half a byte.
"""

import gzip
import json
import struct
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from kankaku.railway.arrays import FloatArray, IntArray

MOST_DECIMALS = 6
MOST_ORDER = 3
"""Differences of differences of differences are as far as it goes. [-]"""
_EXACT = 2.0**52
"""Whole numbers up to this are exact in a browser. [-]"""
_TRIED = 60_000
"""Of a long column so many values from its middle choose the order of differences. [-]"""


class Packer:
    """Collects columns of bytes, equal ones once; a table only says where its columns lie."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._length = 0
        self._known: dict[bytes, int] = {}
        self.samples = 0
        """Samples of trajectories in it, as its user counts them. [-]"""

    def table(self, frame: pd.DataFrame, columns: Sequence[str] = ()) -> dict[str, Any]:
        """
        Pack a table.

        Parameters
        ----------
        frame
            Any table of numbers, texts and truth values.
        columns
            Which columns; all if empty. Those that the table lacks are left out.

        Returns
        -------
        dict[str, Any]
            ``rows``, and ``columns``: a description of each.
        """
        names = [name for name in columns or frame.columns if name in frame]
        packed = {str(name): self.column(frame[name]) for name in names}
        return {"rows": len(frame), "columns": packed}

    def column(self, values: pd.Series) -> dict[str, Any]:
        """
        Pack a column.

        Parameters
        ----------
        values
            Numbers, texts or truth values.

        Returns
        -------
        dict[str, Any]
            What the browser needs to read it; numbers come back exactly.
        """
        if values.dtype == bool:
            return {"type": "bool", **self._whole(values.to_numpy().astype(np.int64))}
        if pd.api.types.is_numeric_dtype(values):
            return self._numbers(values.to_numpy(dtype=np.float64, na_value=np.nan))
        codes, texts = pd.factorize(values.astype("str"))
        return {"type": "text", "texts": list(map(str, texts)), **self._whole(codes)}

    def content(self) -> bytes:
        """Return everything that was packed."""
        return b"".join(self._parts)

    def _numbers(self, values: FloatArray) -> dict[str, Any]:
        missing = np.isnan(values)
        filled = np.where(missing, 0.0, values)
        told: dict[str, Any] = {"type": "number"}
        if missing.any():
            # The last value known: a gap then costs nothing.
            last = np.maximum.accumulate(np.where(missing, 0, np.arange(values.size)))
            filled = filled[last]
            told["missing"] = self._whole(missing.astype(np.int64))
        most = np.abs(filled).max(initial=0.0)
        for decimals in range(MOST_DECIMALS + 1):
            scale = 10.0**decimals
            if most >= _EXACT / scale:
                break
            scaled = np.round(filled * scale)
            if np.array_equal(scaled / scale, filled):
                return {**told, "scale": int(scale), **self._whole(scaled.astype(np.int64))}
        return {**told, "raw": self._put(filled.astype("<f8").tobytes())}

    def _whole(self, values: IntArray) -> dict[str, Any]:
        if not values.size or (values == values[0]).all():
            return {"constant": int(values[0]) if values.size else 0}
        order = _best_order(values)
        planes = _planes(_differences(values, order))
        return {"order": order, "planes": len(planes), "at": self._put(b"".join(planes))}

    def _put(self, content: bytes) -> int:
        # All runs have the same booked times, and many other columns in common.
        at = self._known.setdefault(content, self._length)
        if at < self._length:
            return at
        self._parts.append(content)
        self._length += len(content)
        return at


class Packed(NamedTuple):
    """What a page holds, before it is compressed."""

    told: Mapping[str, Any]
    """What says where everything is; anything that JSON can hold, numbers finite."""
    content: bytes
    """The columns."""


def compressed(packed: Packed) -> bytes:
    """
    Return a page's data as the browser takes it.

    Parameters
    ----------
    packed
        The data.

    Returns
    -------
    bytes
        By gzip, the same bytes every time: length of the JSON text in four bytes, least
        significant first, the text, the columns.

    Raises
    ------
    ValueError
        If a number is not finite.
    """
    text = json.dumps(packed.told, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    told = text.encode("utf-8", "replace")
    return gzip.compress(struct.pack("<I", len(told)) + told + packed.content, 9, mtime=0)


def _differences(values: IntArray, order: int) -> IntArray:
    for _ in range(order):
        values = np.diff(values, prepend=0)
    return values


def _planes(values: IntArray) -> list[bytes]:
    folded = np.where(values >= 0, 2 * values, -2 * values - 1)
    planes = []
    while True:
        planes.append((folded & 0xFF).astype(np.uint8).tobytes())
        folded >>= 8
        if not folded.any():
            return planes


def _best_order(values: IntArray) -> int:
    """Return which differences compress best."""
    middle = max(values.size - _TRIED, 0) // 2
    tried = values[middle : middle + _TRIED]
    sizes = [
        len(gzip.compress(b"".join(_planes(_differences(tried, order))), 1))
        for order in range(MOST_ORDER + 1)
    ]
    return int(np.argmin(sizes))
