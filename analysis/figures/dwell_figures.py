"""Observed dwells: their quantiles by station, and how they depend on the headway."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from kankaku.analysis.figures.style import BOOKED, PALETTE, plain_frame, style
from kankaku.railway.arrays import FloatArray

LINE_IN = 0.24
"""Height of a station. [inch]"""
BINS = 8
"""Of headways, with as many dwells each. [-]"""
LEAST_IN_BIN = 5


class StationSample(NamedTuple):
    """Dwells of a station."""

    name: str
    dwells_s: FloatArray
    """[s], shape (n,)"""


def station_dwell_figure(stations: Sequence[StationSample], *, title: str) -> Figure:
    """
    Draw the quantiles of dwells by station.

    Parameters
    ----------
    stations
        Stations with one dwell or more, in the order in which they are drawn downwards.
    title
        Title of the figure.

    Returns
    -------
    Figure
        For each station a line from 10 % to 90 %, a bar from 25 % to 75 %, and the median.
    """
    with style():
        figure = Figure(figsize=(7.2, 1.3 + LINE_IN * len(stations)), layout="constrained")
        axes = figure.subplots()
        at = np.arange(len(stations))[::-1]
        cut = (0.1, 0.25, 0.5, 0.75, 0.9)
        found_s = np.array([np.quantile(one.dwells_s, cut) for one in stations]).reshape(-1, 5)
        low_s, quarter_s, median_s, upper_s, high_s = found_s.T
        axes.hlines(at, low_s, high_s, color=BOOKED, linewidth=1.4, label="10 to 90 %")
        axes.barh(
            at,
            upper_s - quarter_s,
            left=quarter_s,
            height=0.5,
            color=PALETTE[4],
            label="25 to 75 %",
        )
        axes.plot(median_s, at, "o", color=PALETTE[0], markersize=4.0, label="median")
        names = [f"{one.name} ({one.dwells_s.size})" for one in stations]
        axes.set_yticks(at.tolist(), names, fontsize=7.0)
        axes.set_xlim(left=0.0)
        axes.set_xlabel("dwell [s]; in brackets how many")
        axes.legend(loc="lower right", fontsize=7.0)
        plain_frame(axes)
        axes.tick_params(axis="y", length=0)
        figure.suptitle(title, fontsize=11.0)
    return figure


def dwell_headway_figure(
    headways_s: FloatArray, beyond_s: FloatArray, *, slope: float, title: str
) -> Figure:
    """
    Draw dwells against the interval to the train before.

    Parameters
    ----------
    headways_s
        From the departure of the train before to the arrival. [s], shape (n,)
    beyond_s
        Dwell less the median of its station. [s], shape (n,)
    slope
        Of the straight line of least squares. [-]
    title
        Title of the figure.

    Returns
    -------
    Figure
        A dot for each dwell, the straight line, and medians with quartiles by headway.
    """
    with style():
        figure = Figure(figsize=(7.2, 4.2), layout="constrained")
        axes = figure.subplots()
        axes.plot(headways_s / 60.0, beyond_s, ".", color=BOOKED, markersize=3.0, label="one dwell")
        ends_s = np.array([headways_s.min(), headways_s.max()])
        line_s = beyond_s.mean() + slope * (ends_s - headways_s.mean())
        told = f"least squares: {60.0 * slope:+.1f} s for each minute"
        axes.plot(ends_s / 60.0, line_s, color=PALETTE[1], linewidth=1.2, label=told)
        count = min(BINS, headways_s.size // LEAST_IN_BIN)
        if count > 1:
            order = np.argsort(headways_s, kind="stable")
            for number, places in enumerate(np.array_split(order, count)):
                quarter_s, median_s, upper_s = np.quantile(beyond_s[places], (0.25, 0.5, 0.75))
                axes.errorbar(
                    np.median(headways_s[places]) / 60.0,
                    median_s,
                    yerr=[[median_s - quarter_s], [upper_s - median_s]],
                    fmt="o",
                    color=PALETTE[0],
                    markersize=4.0,
                    linewidth=1.0,
                    label="_" if number else "median, 25 to 75 %",
                )
        axes.set_xlabel("from the departure of the train before to the arrival [min]")
        axes.set_ylabel("dwell less the station's median [s]")
        axes.legend(loc="upper right", fontsize=7.0)
        plain_frame(axes)
        figure.suptitle(title, fontsize=11.0)
    return figure
