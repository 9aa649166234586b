"""Where a function of one number is zero, or least; scipy's, which take long to import."""

from collections.abc import Callable

LEAST_RELATIVE = 8.881784197001252e-16
"""Four times the spacing of floats, below which no search can come to an end. [-]"""


def root_of(
    function: Callable[[float], float],
    low: float,
    high: float,
    *,
    xtol: float,
    rtol: float = LEAST_RELATIVE,
) -> float:
    """
    Return where a function changes its sign, by Brent's method.

    Parameters
    ----------
    function
        Continuous, and of different signs at both ends.
    low
        One end.
    high
        The other.
    xtol
        How far the answer may be away from the root, in the unit of the ends.
    rtol
        The same as a share of the root. [-]

    Returns
    -------
    float
        Between both ends.

    Raises
    ------
    ValueError
        If the function has the same sign at both ends.
    """
    from scipy.optimize import brentq  # noqa: PLC0415 - nobody else waits for it

    root: float = brentq(function, low, high, xtol=xtol, rtol=rtol)
    return root


def least_between(
    function: Callable[[float], float], low: float, high: float
) -> tuple[float, float]:
    """
    Return where a function is least, and how much it is there.

    Parameters
    ----------
    function
        With one valley between both ends.
    low
        One end.
    high
        The other.

    Returns
    -------
    tuple[float, float]
        Place and value.
    """
    from scipy.optimize import minimize_scalar  # noqa: PLC0415 - nobody else waits for it

    found = minimize_scalar(function, bounds=(low, high), method="bounded")
    return float(found.x), float(found.fun)
