"""Small formulas of the monitor: numbers that may not be one, and places in order."""

from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import formula


@formula
def greater(one: float, other: float) -> float:
    """Return the greater of two numbers; not-a-number if either is."""
    return one if one > other or one != one else other  # noqa: PLR0124


@formula
def lesser(one: float, other: float) -> float:
    """Return the lesser of two numbers; not-a-number if either is."""
    return one if one < other or one != one else other  # noqa: PLR0124


@formula
def share(part: float) -> float:
    """Return a number between 0 and 1; not-a-number if it is."""
    return 0.0 if part < 0.0 else lesser(part, 1.0)


@formula
def knot_before(knots_m: FloatArray, ends: tuple[int, int], place_m: float, near: int) -> int:
    """Return the last knot at or before a place, or the first one; ``near`` is a guess."""
    first, last = ends
    knot = near
    while knot > first and place_m < knots_m[knot]:
        knot -= 1
    while knot < last and knots_m[knot + 1] <= place_m:
        knot += 1
    return knot


@formula
def places_before(places_m: FloatArray, place_m: float) -> int:
    """Return how many of some rising places are before another one; all, if it is no number."""
    low, high = 0, places_m.size
    while low < high:
        middle = (low + high) // 2
        if places_m[middle] >= place_m:
            high = middle
        else:
            low = middle + 1
    return low
