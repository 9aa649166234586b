"""Copies and comparisons of whatever a state, an answer or a memory is made of."""

from collections.abc import Mapping
from copy import copy
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np


def frozen(value: Any) -> Any:  # noqa: ANN401 - whatever a state is made of
    """
    Return a copy that nobody else can write to.

    Parameters
    ----------
    value
        Arrays, numbers, texts, and collections or objects of them.

    Returns
    -------
    Any
        The same where it is made of nothing that is known here.
    """
    if isinstance(value, np.ndarray):
        return value.copy()
    if isinstance(value, tuple | list):
        parts = [frozen(part) for part in value]
        return type(value)(*parts) if hasattr(value, "_fields") else type(value)(parts)
    if isinstance(value, Mapping):
        return {key: frozen(part) for key, part in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        twin = copy(value)
        for field in fields(value):
            object.__setattr__(twin, field.name, frozen(getattr(value, field.name)))
        return twin
    return copy(value) if isinstance(value, set | bytearray) else value


def same(one: Any, other: Any) -> bool:  # noqa: ANN401 - whatever a memory is made of
    """
    Return whether two answers, states or memories hold the same.

    Parameters
    ----------
    one
        Arrays, numbers, texts, and collections or objects of them.
    other
        The like.

    Returns
    -------
    bool
        What is not a number is the same as itself.
    """
    if one is other:
        return True
    if isinstance(one, np.ndarray | float) and isinstance(other, np.ndarray | float):
        return _same_numbers(np.asarray(one), np.asarray(other))
    if isinstance(one, tuple | list):
        alike = isinstance(other, tuple | list) and len(one) == len(other)
        return alike and all(map(same, one, other))
    if isinstance(one, Mapping):
        alike = isinstance(other, Mapping) and one.keys() == other.keys()
        return alike and all(same(one[key], other[key]) for key in one)
    parts = _parts(one)
    if parts is None:
        return type(one) is type(other) and bool(one == other)
    return type(one) is type(other) and same(parts, _parts(other))


def _same_numbers(one: np.ndarray[Any, Any], other: np.ndarray[Any, Any]) -> bool:
    alike = one.shape == other.shape and one.dtype == other.dtype
    # Mostly the same bytes, which is sooner seen; zeros have two signs.
    if alike and one.tobytes() == other.tobytes():
        return True
    return bool(np.array_equal(one, other, equal_nan=one.dtype.kind == "f"))


def _parts(value: Any) -> Mapping[str, Any] | None:  # noqa: ANN401 - whatever a memory is
    """Return what an object is made of; None of what is compared as a whole."""
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: getattr(value, field.name) for field in fields(value)}
    made: Any = type(value)
    if made.__eq__ is object.__eq__ and hasattr(value, "__dict__"):
        return dict(vars(value))
    return None
