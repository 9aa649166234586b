"""Where the tracks are drawn: local metres from the geometry of the line."""

from dataclasses import dataclass

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.earth import EARTH_RADIUS_M
from kankaku.railway.plan.line import Line

TRACK_SPACING_M = 5.0
"""Drawn distance of parallel tracks. [m]"""
RAMP_M = 60.0
"""Length over which parallel tracks spread from the node they share. [m]"""


@dataclass(frozen=True, slots=True)
class CentreLine:
    """Drawn points along the line, chainage strictly rising, shape (n_points,)."""

    chainage_m: FloatArray
    x_m: FloatArray
    y_m: FloatArray

    def at(self, chainage_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """
        Return where a chainage is drawn.

        Parameters
        ----------
        chainage_m
            Where. [m], shape (n,)

        Returns
        -------
        tuple[FloatArray, FloatArray]
            East and north of the middle of the geometry. [m], shape (n,)
        """
        x_m = np.interp(chainage_m, self.chainage_m, self.x_m)
        y_m = np.interp(chainage_m, self.chainage_m, self.y_m)
        return x_m, y_m


def centre_line(line: Line) -> CentreLine:
    """
    Project the geometry of a line; without geometry it is drawn straight.

    Parameters
    ----------
    line
        The line.

    Returns
    -------
    CentreLine
        Points that cover the whole line and a little more. The projection is
        equirectangular about the middle latitude, which distorts the length of a
        metropolitan line by far less than can be seen.
    """
    if len(line.geometry_lon_lat_deg) < 2:
        ends_m = np.array([line.start_m - 10.0, line.end_m + 10.0])
        return CentreLine(ends_m, ends_m, np.zeros(2))
    chainage_m, longitude_deg, latitude_deg = np.array(line.geometry_lon_lat_deg).T
    middle_deg = 0.5 * (latitude_deg.min() + latitude_deg.max())
    metres_per_deg = np.radians(EARTH_RADIUS_M)
    east_m = (
        metres_per_deg * np.cos(np.radians(middle_deg)) * (longitude_deg - longitude_deg.mean())
    )
    north_m = metres_per_deg * (latitude_deg - latitude_deg.mean())
    points = np.stack([chainage_m, east_m, north_m])
    before = _continued(points[:, 0], points[:, 1], line.start_m - 10.0)
    after = _continued(points[:, -1], points[:, -2], line.end_m + 10.0)
    return CentreLine(*np.hstack([before, points, after]))


def _continued(end: FloatArray, inner: FloatArray, chainage_m: float) -> FloatArray:
    outward = np.sign(end[0] - inner[0])
    if outward * (chainage_m - end[0]) <= 0.0:
        return np.empty((3, 0))
    share = (chainage_m - end[0]) / (end[0] - inner[0])
    beyond: FloatArray = end + share * (end - inner)
    return beyond.reshape(3, 1)


def track_points(
    line: Line, drawn: CentreLine, section: int, track: int, span_m: tuple[float, float]
) -> FloatArray:
    """
    Return the drawn shape of a stretch of track.

    Parameters
    ----------
    line
        The line.
    drawn
        Its centre line.
    section, track
        Index of the section, and of the track within it. [-]
    span_m
        Chainage of both ends of the stretch. [m]

    Returns
    -------
    FloatArray
        East, north and height. [m], shape (n_points, 3)
    """
    stretch = line.sections[section]
    ramp_m = min(RAMP_M, 0.25 * (stretch.end_m - stretch.start_m))
    knots_m = np.concatenate(
        [
            drawn.chainage_m,
            [gradient.start_m for gradient in line.gradients],
            [gradient.end_m for gradient in line.gradients],
            [stretch.start_m + ramp_m, stretch.end_m - ramp_m],
        ]
    )
    inside = (knots_m > span_m[0] + 1.0) & (knots_m < span_m[1] - 1.0)
    where_m = np.unique(np.concatenate([span_m, knots_m[inside]]))
    from_end_m = np.minimum(where_m - stretch.start_m, stretch.end_m - where_m)
    spread = np.clip(from_end_m / ramp_m, 0.0, 1.0)
    offset_m = TRACK_SPACING_M * (0.5 * (len(stretch.tracks) - 1) - track) * spread
    return beside(line, drawn, where_m, offset_m)


def beside(
    line: Line, drawn: CentreLine, where_m: FloatArray, offset_m: FloatArray | float
) -> FloatArray:
    """
    Return points beside the centre line.

    Parameters
    ----------
    line
        The line, for heights.
    drawn
        Its centre line.
    where_m
        Chainage of the points. [m], shape (n_points,)
    offset_m
        How far to the left of the centre line, looking along rising chainage. [m]

    Returns
    -------
    FloatArray
        East, north and height. [m], shape (n_points, 3)
    """
    x_m, y_m = drawn.at(where_m)
    ahead_x_m, ahead_y_m = drawn.at(where_m + 1.0)
    behind_x_m, behind_y_m = drawn.at(where_m - 1.0)
    east, north = ahead_x_m - behind_x_m, ahead_y_m - behind_y_m
    length = np.maximum(np.hypot(east, north), 1e-9)
    height_m = line.height_m(where_m)
    return np.column_stack(
        [x_m - offset_m * north / length, y_m + offset_m * east / length, height_m]
    )
