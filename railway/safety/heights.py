"""The height of the track under trains, exactly: a polygon, and the area below it."""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import formula
from kankaku.railway.plan.line import Line

BEFORE_M = 1e5
"""Level track before the line, further than any train reaches. [m]"""


class Heights(NamedTuple):
    """Polygons of heights, one after the other; arrays of shape (n_knots,)."""

    knots_m: FloatArray
    heights_m: FloatArray
    slopes: FloatArray
    """Of the stretch behind each knot. [-]"""
    areas_m2: FloatArray
    """Below the polygon, up to each knot. [m2]"""


def heights_of(line: Line) -> Heights:
    """
    Return the polygon of a line's heights.

    Parameters
    ----------
    line
        The line.

    Returns
    -------
    Heights
        From its gradients.
    """
    edges = {line.start_m - BEFORE_M, line.start_m}
    for stretch in line.gradients:
        edges |= {stretch.start_m, stretch.end_m}
    knots_m = np.array(sorted(edges))
    heights_m = line.height_m(knots_m)
    slopes = np.append(np.diff(heights_m) / np.diff(knots_m), 0.0)
    steps = np.diff(knots_m) * 0.5 * (heights_m[1:] + heights_m[:-1])
    return Heights(knots_m, heights_m, slopes, np.append(0.0, np.cumsum(steps)))


@formula
def height_m(heights: Heights, knot: int, place_m: float) -> float:
    """Return the height at a place: ``h_k + i_k (x - x_k)``. [m]"""
    along_m = place_m - heights.knots_m[knot]
    height: float = heights.slopes[knot] * along_m + heights.heights_m[knot]
    return height


@formula
def area_m2(heights: Heights, knot: int, place_m: float) -> float:
    """Return the area below the polygon up to a place. [m2]"""
    along_m = place_m - heights.knots_m[knot]
    middle_m = heights.heights_m[knot] + 0.5 * heights.slopes[knot] * along_m
    area: float = heights.areas_m2[knot] + along_m * middle_m
    return area
