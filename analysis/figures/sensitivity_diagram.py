"""Which assumption decides a conclusion, and how far the conclusion moves within all ranges."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from kankaku.analysis.figures.style import BOOKED, INK, colour, plain_frame, style

NOISE = "#DDDDDD"
BAR_HEIGHT = 0.5
_LANES = ("all assumptions moved", "as assumed, other seeds", "as assumed")


class Moved(NamedTuple):
    """A change that the conclusion is told in, and what moves it."""

    title: str
    """With its unit."""
    effects: pd.DataFrame
    """
    A row per assumption: ``assumption``, ``mu_star``, ``confidence_95``, ``sigma``, and ``noise``,
    what ``mu_star`` would be if the assumption did nothing in the mean of all seeds.
    """
    design: Sequence[float]
    """The change at the points of the design. In the unit"""
    repeats: Sequence[float]
    """The change as assumed, with other seeds."""
    centre: float
    """The change as assumed, with the seeds of the design."""


def sensitivity_figure(moved: Sequence[Moved], titles: Mapping[str, str]) -> Figure:
    """
    Draw the effects of assumptions on some changes, and the range of each change.

    Parameters
    ----------
    moved
        A column of the figure each; the first one orders the assumptions.
    titles
        What a reader calls each assumption.

    Returns
    -------
    Figure
        Above, mean absolute effect (bar, with its 95 % confidence interval) and standard
        deviation of the effects (ring); what lies on grey may be noise. Below, the
        change at the points of the design, as assumed with other seeds, and as assumed.
    """
    order = moved[0].effects.sort_values("mu_star")["assumption"].tolist()
    with style():
        figure = Figure(figsize=(2.6 * len(moved) + 1.8, 5.6), layout="constrained")
        rows = figure.subplots(2, len(moved), sharey="row", height_ratios=(3.0, 1.0), squeeze=False)
        for axes, one in zip(rows[0], moved, strict=True):
            _draw_effects(axes, one, order)
        for axes, one in zip(rows[1], moved, strict=True):
            _draw_range(axes, one)
        rows[0, 0].set_yticks(range(len(order)), [titles[name] for name in order])
        rows[1, 0].set_yticks(range(len(_LANES)), _LANES)
        handles, labels = rows[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return figure


def _draw_effects(axes: Axes, one: Moved, order: Sequence[str]) -> None:
    own = one.effects.set_index("assumption").loc[list(order)]
    places = np.arange(len(order))
    plain_frame(axes)
    axes.barh(places, own["noise"], height=0.95, color=NOISE, label="may be noise of the seeds")
    axes.barh(
        places,
        own["mu_star"],
        xerr=own["confidence_95"],
        height=BAR_HEIGHT,
        color=colour(0),
        error_kw={"elinewidth": 0.8, "ecolor": INK},
        label="mean absolute effect (mu*)",
    )
    axes.plot(
        own["sigma"],
        places,
        linestyle="none",
        marker="o",
        markersize=4.5,
        markerfacecolor="none",
        color=colour(1),
        label="spread of the effects (sigma)",
    )
    axes.set_xlim(left=0.0)
    axes.set_title(one.title, fontsize=8.5)
    axes.tick_params(axis="y", length=0)


def _draw_range(axes: Axes, one: Moved) -> None:
    plain_frame(axes)
    axes.axvline(0.0, color=INK, linewidth=0.8)
    lanes = ((one.design, colour(0), 0.4), (one.repeats, BOOKED, 0.9), ([one.centre], INK, 1.0))
    for lane, (values, ink, alpha) in enumerate(lanes):
        axes.plot(
            values,
            np.full(len(values), lane),
            linestyle="none",
            marker="|",
            markersize=11.0,
            color=ink,
            alpha=alpha,
        )
    axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.set_ylim(-0.6, len(_LANES) - 0.4)
    axes.set_xlabel("change: " + one.title, fontsize=7.5)
    axes.tick_params(axis="y", length=0)
