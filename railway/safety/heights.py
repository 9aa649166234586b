"""The height of the track averaged over a train, exactly: by the area below a polygon."""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import compiled
from kankaku.railway.plan.line import Line

BEFORE_M = 1e5
"""Level track before the line, further than any train reaches. [m]"""


class Heights(NamedTuple):
    """The polygon of a line's heights; arrays of shape (n_knots,)."""

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


@compiled
def mean_height_m(
    front_m: FloatArray,
    length_m: FloatArray,
    knots_m: FloatArray,
    heights_m: FloatArray,
    slopes: FloatArray,
    areas_m2: FloatArray,
) -> FloatArray:
    """
    Return the height averaged over each train.

    Parameters
    ----------
    front_m
        Fronts. [m], shape (n_steps, n_trains)
    length_m
        Lengths. [m], shape (n_trains,)
    knots_m, heights_m, slopes, areas_m2
        Of :class:`Heights`.

    Returns
    -------
    FloatArray
        Heights. [m], shape (n_steps, n_trains)
    """
    mean_m = np.empty_like(front_m)
    for step in range(front_m.shape[0]):
        for column in range(front_m.shape[1]):
            area_m2 = 0.0
            for sign, place_m in (
                (1.0, front_m[step, column]),
                (-1.0, front_m[step, column] - length_m[column]),
            ):
                knot = max(np.searchsorted(knots_m, place_m, side="right") - 1, 0)
                along_m = place_m - knots_m[knot]
                middle_m = heights_m[knot] + 0.5 * slopes[knot] * along_m
                area_m2 += sign * (areas_m2[knot] + along_m * middle_m)
            mean_m[step, column] = area_m2 / length_m[column]
    return mean_m
