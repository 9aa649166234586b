"""
A fuzzy controller of the brake: how fast the deceleration is to change.

Rules read "if the brake is much too weak and much of it is needed, apply it fast". Every
input has triangular membership functions that are given by their peaks, next to each
other, so that each value belongs to two of them at most and the degrees add up to 1. A
rule's weight is the product of its degrees, and the output is the weighted mean of what
the rules say (zero-order Takagi and Sugeno).
"""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import count_up_to, formula


class RuleBase(NamedTuple):
    """Membership functions of two inputs, and a rule for every pair of them."""

    first: FloatArray
    """Peaks of the first input, rising. shape (n_first,)"""
    second: FloatArray
    """Peaks of the second input, rising. shape (n_second,)"""
    output: FloatArray
    """What each rule says. shape (n_first, n_second)"""


@formula
def degrees(peaks: FloatArray, value: float) -> tuple[int, float]:
    """
    Return how far a value belongs to the triangular sets around it.

    Parameters
    ----------
    peaks
        Where each set is fully met, rising; the outer sets reach on without end. (n_sets,)
    value
        The value.

    Returns
    -------
    tuple[int, float]
        The upper set that it belongs to, and to which degree; the rest to the one below.
    """
    upper = min(max(count_up_to(peaks, value), 1), peaks.size - 1)
    share = (value - peaks[upper - 1]) / (peaks[upper] - peaks[upper - 1])
    return upper, min(max(share, 0.0), 1.0)


@formula
def infer(rules: RuleBase, first: float, second: float) -> float:
    """
    Return the weighted mean of what the rules say.

    Parameters
    ----------
    rules
        The rule base.
    first, second
        Values of the inputs.

    Returns
    -------
    float
        The output.

    References
    ----------
    .. [1] Takagi and Sugeno, *Fuzzy identification of systems*, IEEE Trans. SMC 15, 1985.
    """
    row, right = degrees(rules.first, first)
    column, high = degrees(rules.second, second)
    below = (1.0 - high) * rules.output[row - 1, column - 1] + high * rules.output[row - 1, column]
    above = (1.0 - high) * rules.output[row, column - 1] + high * rules.output[row, column]
    mean: float = (1.0 - right) * below + right * above
    return mean


def rule_base(
    first: tuple[float, ...], second: tuple[float, ...], output: tuple[float, ...]
) -> RuleBase:
    """
    Return a rule base.

    Parameters
    ----------
    first, second
        Peaks of the inputs.
    output
        What the rules say, row by row of the first input.

    Returns
    -------
    RuleBase
        As arrays.
    """
    table = np.array(output).reshape(len(first), len(second))
    return RuleBase(np.array(first), np.array(second), table)
