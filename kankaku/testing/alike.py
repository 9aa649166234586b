"""Copies and comparisons of whatever a state, an answer or a memory is made of."""

from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

import numpy as np

# Unions would be made anew in every comparison.
NUMBERS = (np.ndarray, float)
ROWS = (tuple, list)
_COPIES: dict[type, Callable[[Any], Any]] = {}
"""How values of each type are copied: a run asks for a million copies of a few types."""


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
    kind = type(value)
    copy_of = _COPIES.get(kind)
    if copy_of is None:
        copy_of = _COPIES[kind] = _copying(kind)
    return copy_of(value)


def _copying(kind: Any) -> Callable[[Any], Any]:  # noqa: ANN401 - any type
    """Return how a value of a type is copied."""
    if issubclass(kind, np.ndarray):
        return lambda value: value.copy()
    if issubclass(kind, tuple | list):
        if hasattr(kind, "_fields"):
            return lambda value: kind(*map(frozen, value))
        return lambda value: kind(map(frozen, value))
    if issubclass(kind, Mapping):
        return lambda value: {key: frozen(part) for key, part in value.items()}
    if is_dataclass(kind):
        return _twin
    return copy if issubclass(kind, set | bytearray) else lambda value: value


@cache
def _names(kind: Any) -> tuple[str, ...]:  # noqa: ANN401 - a dataclass
    return tuple(field.name for field in fields(kind))


def _twin(value: Any) -> Any:  # noqa: ANN401 - an object of a dataclass
    kind: Any = type(value)
    twin = copy(value)
    for name in _names(kind):
        object.__setattr__(twin, name, frozen(getattr(value, name)))
    return twin


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
    if isinstance(one, NUMBERS) and isinstance(other, NUMBERS):
        return _same_numbers(np.asarray(one), np.asarray(other))
    if isinstance(one, ROWS):
        alike = isinstance(other, ROWS) and len(one) == len(other)
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
    made: Any = type(value)
    if hasattr(made, "__dataclass_fields__"):
        return {name: getattr(value, name) for name in _names(made)}
    if made.__eq__ is object.__eq__ and hasattr(value, "__dict__"):
        return dict(vars(value))
    return None
