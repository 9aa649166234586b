"""Tables become few bytes and come back as they were."""

import gzip
import json
import struct
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from kankaku.analysis.page.packing import Packed, Packer, compressed


def unpacked(content: bytes, told: dict[str, Any], rows: int) -> list[float]:
    """Read a column as the browser does, by another way: number by number."""
    if "raw" in told:
        scaled = [float(value) for value in np.frombuffer(content, "<f8", rows, told["raw"])]
    else:
        scaled = [value / told.get("scale", 1) for value in whole(content, told, rows)]
    if "missing" in told:
        gaps = whole(content, told["missing"], rows)
        scaled = [float("nan") if gap else v for v, gap in zip(scaled, gaps, strict=True)]
    return scaled


def whole(content: bytes, told: dict[str, Any], rows: int) -> list[int]:
    if "constant" in told:
        return [told["constant"]] * rows
    values = []
    for row in range(rows):
        folded = sum(
            content[told["at"] + plane * rows + row] << 8 * plane for plane in range(told["planes"])
        )
        values.append(folded // 2 if folded % 2 == 0 else -(folded + 1) // 2)
    for _ in range(told["order"]):
        total, summed = 0, []
        for value in values:
            total += value
            summed.append(total)
        values = summed
    return values


@given(
    st.lists(
        st.one_of(
            st.decimals(-1_000_000, 1_000_000, places=3).map(float),
            st.floats(allow_infinity=False),
        ),
        max_size=30,
    )
)
@example(values=[2.0**52, float("nan")])
def test_numbers_come_back_exactly(values: list[float]) -> None:
    packer = Packer()
    told = packer.column(pd.Series(values, dtype="float64"))
    found = unpacked(packer.content(), told, len(values))
    assert np.array_equal(found, np.array(values, dtype=np.float64), equal_nan=True)


@pytest.mark.parametrize("values", [[3, 3, 3], [-5, 0, 7, 2**40], []])
def test_whole_numbers_come_back(values: list[int]) -> None:
    packer = Packer()
    told = packer.column(pd.Series(values, dtype="int64"))
    assert unpacked(packer.content(), told, len(values)) == values


def test_texts_and_truth_values_come_back() -> None:
    packer = Packer()
    told = packer.column(pd.Series(["b", "a", "b", ""], dtype="str"))
    codes = whole(packer.content(), told, 4)
    assert [told["texts"][code] for code in codes] == ["b", "a", "b", ""]
    flags = packer.column(pd.Series([True, False, True]))
    assert unpacked(packer.content(), flags, 3) == [1, 0, 1]


def test_equal_columns_are_kept_once() -> None:
    packer = Packer()
    column = pd.Series([1.5, 2.25, 9.0])
    first = packer.column(column)
    size = len(packer.content())
    assert packer.column(column.copy()) == first
    assert len(packer.content()) == size


def test_a_smooth_run_takes_less_than_a_byte_a_sample() -> None:
    time_s = np.arange(5000.0)
    place_m = np.round(20.0 * time_s + 300.0 * np.sin(time_s / 40.0), 3)
    packer = Packer()
    told = {"place": packer.column(pd.Series(place_m))}
    assert len(compressed(Packed(told, packer.content()))) < 8 * 5000 / 3


def test_the_data_are_the_same_bytes_every_time_and_say_how_long_the_text_is() -> None:
    packed = Packed({"name": "駅"}, b"abc")
    assert compressed(packed) == compressed(packed)
    plain = gzip.decompress(compressed(packed))
    (length,) = struct.unpack("<I", plain[:4])
    assert json.loads(plain[4 : 4 + length]) == {"name": "駅"}
    assert plain[4 + length :] == b"abc"


def test_what_json_cannot_hold_is_refused() -> None:
    with pytest.raises(ValueError, match="JSON"):
        compressed(Packed({"value": float("nan")}, b""))
