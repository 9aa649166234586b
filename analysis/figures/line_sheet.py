"""A line without a network on one sheet: tracks and stations, limits and heights."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kankaku.railway.plan.line import Line

GRID_M = 10.0
TRACK, PLATFORM, LIMIT, HEIGHT = "#333333", "#9ecae1", "#D55E00", "#0072B2"


def line_sheet_figure(line: Line) -> Figure:
    """
    Draw a chain of sections with parallel tracks.

    Parameters
    ----------
    line
        No network.

    Returns
    -------
    Figure
        By chainage: tracks with platforms and stations, speed limits, and heights.
    """
    figure = Figure(figsize=(10.0, 5.0))
    tracks, limits, heights = figure.subplots(3, 1, sharex=True)
    _tracks(tracks, line)
    for limit in line.limits:
        ends_km = [limit.start_m / 1000.0, limit.end_m / 1000.0]
        limits.plot(ends_km, [3.6 * limit.limit_mps] * 2, color=LIMIT)
    limits.set_ylabel("limit [km/h]")
    places_m = np.arange(line.start_m, line.end_m + GRID_M, GRID_M)
    heights.plot(places_m / 1000.0, line.height_m(places_m), color=HEIGHT)
    heights.set_ylabel("height [m]")
    heights.set_xlabel("chainage [km]")
    figure.tight_layout()
    return figure


def _tracks(axes: Axes, line: Line) -> None:
    level = {}
    for section in line.sections:
        for number, track in enumerate(section.tracks):
            level[track.id] = -float(number)
            ends_km = [track.start_m / 1000.0, track.end_m / 1000.0]
            axes.plot(ends_km, [-number, -number], color=TRACK, linewidth=1.5)
    for platform in line.platforms:
        ends_km = [platform.start_m / 1000.0, platform.end_m / 1000.0]
        height = level.get(platform.track, 0.0) + 0.25
        axes.plot(ends_km, [height, height], color=PLATFORM, linewidth=5.0)
    for station in line.stations:
        axes.annotate(
            station.name, (station.chainage_m / 1000.0, 0.6), rotation=60, fontsize=7, ha="left"
        )
    axes.set_ylim(min(level.values(), default=0.0) - 0.5, 3.0)
    axes.set_yticks([])
