"""
Many arrays in one box, for compiled functions that hand them on without looking inside.

A compiled function hands on every array of a tuple one by one, and takes the longer to compile the
more there are. A box is one thing, whatever is in it.
"""

from typing import Any

from numba.core import types
from numba.experimental import structref

from kankaku.railway.compiled import Plain, compiled


class BoxType(types.StructRef):
    """The type of boxes, as compiled functions know it."""

    def preprocess_fields(self, fields: Any) -> Any:  # noqa: ANN401 - numba has no types
        """Take numbers as numbers, not as the values that they have."""
        return tuple((name, types.unliteral(kind)) for name, kind in fields)  # type: ignore[no-untyped-call]


class Box(structref.StructRefProxy):
    """Holds a tuple of arrays and numbers; compiled functions find it as ``box.inside``."""


_register: Any = structref.register
_register(BoxType)
_define_boxing: Any = structref.define_boxing
_define_boxing(BoxType, Box)
_define_constructor: Any = structref.define_constructor
_define_constructor(Box, BoxType, ["inside"])


@compiled
def boxed(inside: Plain) -> Any:  # noqa: ANN401 - numba has no types
    """
    Put a tuple into a box.

    Parameters
    ----------
    inside
        Arrays, numbers and tuples of them.

    Returns
    -------
    Any
        The box; in compiled functions ``box.inside`` is the tuple.
    """
    return Box(inside)  # type: ignore[no-untyped-call]


@compiled
def boxed_with(box: Any, beside: Plain) -> Any:  # noqa: ANN401 - numba has no types
    """
    Put a box and a tuple into a box.

    Whoever calls compiled functions from Python gives them boxes by themselves: numba takes
    thousands of times as long to find out what a tuple is that has a box in it.

    Parameters
    ----------
    box
        From :func:`boxed`.
    beside
        The tuple.

    Returns
    -------
    Any
        The outer box.
    """
    return Box((box, beside))  # type: ignore[no-untyped-call]


@compiled
def unboxed(box: Any) -> Plain:  # noqa: ANN401 - numba has no types
    """
    Take a tuple out of its box.

    Parameters
    ----------
    box
        From :func:`boxed`, or from a compiled function.

    Returns
    -------
    Plain
        What is in it.
    """
    inside: Plain = box.inside
    return inside
