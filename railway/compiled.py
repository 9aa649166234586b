"""
Compilation of the functions that run in every step.

A step has some thirty operations on arrays of a few dozen trains. One compiled function
costs what two or three array operations cost, so the physics is written as formulas and
loops over trains and compiled by numba; results are cached beside the source.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

from railway.arrays import FloatArray

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """
    Compile a function of arrays and numbers at its first call.

    Parameters
    ----------
    function
        The function.

    Returns
    -------
    Function
        The same, compiled.
    """
    return cast("Function", numba.njit(cache=True, error_model="numpy")(function))


def elementwise(function: Callable[..., float]) -> Callable[..., FloatArray]:
    """
    Turn a formula of numbers into a numpy ufunc, which compiled functions may call too.

    Parameters
    ----------
    function
        A formula with float arguments only.

    Returns
    -------
    Callable[..., FloatArray]
        The ufunc: broadcasts its arguments.
    """
    arguments = ", ".join(["float64"] * function.__code__.co_argcount)
    vectorize: Callable[..., Any] = numba.vectorize
    made = vectorize([f"float64({arguments})"], cache=True)(function)
    return cast("Callable[..., FloatArray]", made)


@compiled
def count_up_to(rising: FloatArray, value: float) -> int:
    """
    Count the values of a rising array that are not above another.

    Parameters
    ----------
    rising
        Sorted values. shape (n,)
    value
        The other.

    Returns
    -------
    int
        How many; the place after the last of them.
    """
    low, high = 0, rising.size
    while low < high:
        middle = (low + high) // 2
        if rising[middle] <= value:
            low = middle + 1
        else:
            high = middle
    return low
