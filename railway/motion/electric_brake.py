"""The electric brake: how much of a braking force can be given back."""

from kankaku.railway.compiled import elementwise

SLOWEST_MPS = 1e-3
"""Compiled for many trains at once, a formula divides even where the result is not used. [m/s]"""


@elementwise
def electric_brake_n(speed_mps: float, force_n: float, power_w: float, cutoff_mps: float) -> float:
    """
    Return the greatest force of the electric brake.

    Parameters
    ----------
    speed_mps
        Speed. [m/s], broadcastable
    force_n
        Greatest force at any speed. [N], broadcastable
    power_w
        Greatest power at the wheel. [W], broadcastable
    cutoff_mps
        Up to this speed there is none. [m/s], broadcastable

    Returns
    -------
    FloatArray
        Force at the wheel. [N], broadcast shape
    """
    if speed_mps <= cutoff_mps:
        return 0.0
    return min(force_n, power_w / max(speed_mps, SLOWEST_MPS))
