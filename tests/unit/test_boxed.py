"""Boxes hand tuples of arrays on without looking inside."""

import numpy as np

from kankaku.railway.boxed import boxed, boxed_with, unboxed
from kankaku.railway.compiled import Plain, compiled


@compiled
def _summed(box) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001 - numba has no types
    inner, beside = box.inside
    values, factor = inner.inside
    return float(factor * values.sum() + beside[0])


def test_what_is_put_in_comes_out() -> None:
    values = np.array([1.0, 2.0, 3.0])
    inside: Plain = (values, 2.5, (np.array([4]), True))
    found = unboxed(boxed(inside))
    assert found[0].tolist() == [1.0, 2.0, 3.0]
    assert found[1:2] == (2.5,)
    assert found[2][0].tolist() == [4]
    assert found[2][1]


def test_a_box_shares_its_arrays() -> None:
    values = np.zeros(2)
    box = boxed((values, 1.0))
    values[1] = 7.0
    assert unboxed(box)[0].tolist() == [0.0, 7.0]


def test_compiled_functions_look_into_boxes_within_boxes() -> None:
    inner = boxed((np.array([1.0, 2.0]), 3.0))
    assert _summed(boxed_with(inner, (0.5,))) == 9.5


def test_a_number_is_boxed_by_its_kind_and_not_by_its_value() -> None:
    one, two = boxed((np.zeros(1), 1)), boxed((np.zeros(1), 2))
    assert [unboxed(box)[1] for box in (one, two)] == [1, 2]
    assert type(one) is type(two)
