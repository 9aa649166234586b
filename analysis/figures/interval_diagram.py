"""The departure-to-arrival interval against the initial delay, all controllers on one diagram."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kankaku.analysis.figures.style import BOOKED, INK, colour, dashes, plain_frame, spread, style
from kankaku.analysis.tables.sweep import SweepTables, shortenings_s
from kankaku.analysis.words import label_of

_LABEL_GAP = 0.045
"""Smallest distance between two labels, of the height of the diagram. [-]"""


def interval_figure(swept: SweepTables, stations: pd.DataFrame) -> Figure:
    """
    Draw the intervals of a sweep.

    Parameters
    ----------
    swept
        What the sweep shows.
    stations
        The table ``stations``.

    Returns
    -------
    Figure
        Initial delay across, interval upwards, one line per controller; dotted the published
        shortest interval, and an arrow at the greatest shortening against the baseline.
    """
    names = dict(zip(stations["station"], stations["name"], strict=True))
    controllers = list(dict.fromkeys(swept.intervals["controller"]))
    own = [swept.intervals[swept.intervals["controller"] == name] for name in controllers]
    sweep = swept.sweep
    with style():
        figure = Figure(figsize=(7.6, 4.8), layout="constrained")
        axes = figure.subplots()
        for index, rows in enumerate(own):
            # Thinner on thicker, so that lines that coincide can all be seen.
            width = 1.3 + 1.6 * (len(own) - 1 - index) / max(len(own) - 1, 1)
            axes.plot(
                rows["initial_delay_s"],
                rows["interval_s"],
                color=colour(index),
                linestyle=dashes(index),
                linewidth=width,
                marker="o",
                markersize=width + 1.2,
                markeredgewidth=0.0,
            )
        axes.margins(x=0.015, y=0.09)
        _draw_published(axes, swept.indicators)
        _mark_shortening(axes, own)
        _name_lines(axes, controllers, own)
        place = names.get(sweep.station, sweep.station)
        axes.set_xlabel(f"initial delay of train {sweep.train} at {place} [s]")
        axes.set_ylabel(f"departure-to-arrival interval at {place} [s]")
        plain_frame(axes)
    return figure


def _draw_published(axes: Axes, indicators: pd.DataFrame) -> None:
    shortest = indicators["indicator"] == "shortest_interval_s"
    value_s = float(indicators.loc[shortest, "published"].max())
    if np.isnan(value_s):
        return
    axes.axhline(value_s, color=BOOKED, linewidth=1.0, linestyle=(0, (1, 2)), zorder=1.5)
    axes.annotate(
        f"published shortest interval, {value_s:.1f} s",
        (0.0, value_s),
        xycoords=axes.get_yaxis_transform(),
        xytext=(3.0, 3.0),
        textcoords="offset points",
        fontsize=7.0,
    )


def _mark_shortening(axes: Axes, own: Sequence[pd.DataFrame]) -> None:
    """Draw an arrow from the baseline to the line that lies furthest below it."""
    by_controller = [shortenings_s(own[0], rows) for rows in own[1:]]
    found = [(series.max(), index) for index, series in enumerate(by_controller, start=1)]
    greatest_s, index = max(
        ((value, index) for value, index in found if value > 0.0), default=(0.0, 0)
    )
    if not index:
        return
    shortenings = by_controller[index - 1]
    delay_s = float(shortenings.index[int(np.nanargmax(shortenings.to_numpy()))])
    rows = own[index]
    low_s = float(rows.loc[rows["initial_delay_s"] == delay_s, "interval_s"].iloc[0])
    axes.annotate(
        "",
        (delay_s, low_s),
        (delay_s, low_s + greatest_s),
        arrowprops={
            "arrowstyle": "<->",
            "color": INK,
            "linewidth": 0.9,
            "shrinkA": 0,
            "shrinkB": 0,
        },
        zorder=4.0,
    )
    axes.annotate(
        f"{greatest_s:.1f} s",
        (delay_s, low_s + 0.5 * greatest_s),
        xytext=(-5.0, 0.0),
        textcoords="offset points",
        ha="right",
        va="center",
        fontweight="bold",
    )


def _name_lines(axes: Axes, controllers: Sequence[str], own: Sequence[pd.DataFrame]) -> None:
    """Write the controllers at the right ends of their lines."""
    arrived = [rows.dropna(subset=["interval_s"]) for rows in own]
    ends = sorted(
        (float(rows["interval_s"].iloc[-1]), index)
        for index, rows in enumerate(arrived)
        if len(rows)
    )
    low_s, high_s = axes.get_ylim()
    places_s = spread(np.array([end_s for end_s, _ in ends]), _LABEL_GAP * (high_s - low_s))
    for (_, index), place_s in zip(ends, places_s.tolist(), strict=True):
        axes.annotate(
            label_of(controllers[index]),
            (1.0, place_s),
            xycoords=axes.get_yaxis_transform(),
            xytext=(5.0, 0.0),
            textcoords="offset points",
            va="center",
            color=colour(index),
            fontweight="bold",
        )
