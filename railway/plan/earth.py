"""Distances on the earth."""

from collections.abc import Sequence
from math import asin, cos, radians, sin, sqrt

EARTH_RADIUS_M = 6_371_008.8
"""Mean radius [1]_. [m]

References
----------
.. [1] H. Moritz, "Geodetic Reference System 1980", Journal of Geodesy 74 (2000), R1.
"""


def distance_m(one: Sequence[float], other: Sequence[float]) -> float:
    """
    Return how far two places are from each other.

    Parameters
    ----------
    one, other
        Longitude and latitude. [deg]

    Returns
    -------
    float
        Along a great circle, by the haversine formula. [m]
    """
    lon, lat, to_lon, to_lat = map(radians, (*one, *other))
    half = sin((to_lat - lat) / 2.0) ** 2 + cos(lat) * cos(to_lat) * sin((to_lon - lon) / 2.0) ** 2
    return 2.0 * EARTH_RADIUS_M * asin(sqrt(min(half, 1.0)))
