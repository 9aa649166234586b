"""An ensemble in figures: box plots, distribution functions, and means of more and more runs."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kankaku.analysis.figures.style import INK, colour, dashes, plain_frame, style
from kankaku.analysis.tables.ensemble_tables import running_means
from kankaku.analysis.tables.indicators import INDICATOR_OF
from kankaku.analysis.words import label_of
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.seed_design import EACH_FOR_ITSELF, SeedDesign

Draw: TypeAlias = Callable[[Axes, str, list[FloatArray]], None]
"""Draws an indicator of a scenario: the values of each controller in order of the seeds."""
PANEL_IN, ROW_IN = 4.2, 2.2
"""Width of a scenario and height of an indicator. [in]"""
SETTLED = 4
"""Bands of fewer runs are so wide that nothing else could be seen; they are cut off. [-]"""
BOX_IN = 0.26
"""Height of a box with its room. [in]"""


def box_figure(
    summary: pd.DataFrame, controllers: Sequence[str], indicators: Sequence[str]
) -> Figure:
    """
    Draw how the runs of each controller lie: quartiles, 5 % and 95 %, and the mean as a dot.

    Parameters
    ----------
    summary
        The table ``summary`` with a column ``scenario``.
    controllers
        Baseline first.
    indicators
        Columns of it, a row of panels each.

    Returns
    -------
    Figure
        A column of panels per scenario, a box per controller.
    """

    def draw(axes: Axes, indicator: str, values: list[FloatArray]) -> None:
        boxes = axes.boxplot(
            values,
            orientation="horizontal",
            whis=(5.0, 95.0),
            widths=0.6,
            patch_artist=True,
            showmeans=True,
            medianprops={"color": INK, "linewidth": 1.0},
            flierprops={"marker": ".", "markersize": 2.0, "markeredgecolor": "#999999"},
            meanprops={
                "marker": "o",
                "markersize": 3.0,
                "markerfacecolor": "white",
                "markeredgecolor": INK,
            },
        )
        for index, box in enumerate(boxes["boxes"]):
            box.set(facecolor=colour(index), alpha=0.55, linewidth=0.6)
        axes.set_yticks(range(1, len(values) + 1), map(label_of, controllers))
        axes.invert_yaxis()
        _name(axes, indicator, "x")

    height_in = 0.7 + BOX_IN * len(controllers)
    return _panels(summary, controllers, indicators, draw, height_in)


def ecdf_figure(
    summary: pd.DataFrame, controllers: Sequence[str], indicators: Sequence[str]
) -> Figure:
    """
    Draw in which share of the runs an indicator is at most so much.

    Parameters
    ----------
    summary, controllers, indicators
        As of :func:`box_figure`.

    Returns
    -------
    Figure
        The empirical distribution functions.
    """

    def draw(axes: Axes, indicator: str, values: list[FloatArray]) -> None:
        for index, own in enumerate(values):
            if own.size:
                line: dict[str, Any] = {
                    "color": colour(index),
                    "linestyle": dashes(index),
                    "linewidth": 1.2,
                }
                axes.ecdf(own, label=label_of(controllers[index]), **line)
        axes.set_ylabel("share of runs [-]")
        _name(axes, indicator, "x")

    return _with_legend(_panels(summary, controllers, indicators, draw, ROW_IN))


def running_mean_figure(
    summary: pd.DataFrame,
    controllers: Sequence[str],
    indicators: Sequence[str],
    designs: Mapping[str, SeedDesign] | None = None,
) -> Figure:
    """
    Draw the mean of the first runs, of more and more of them, with its 95 % interval.

    Parameters
    ----------
    summary, controllers, indicators
        As of :func:`box_figure`.
    designs
        How the seeds of each scenario share their draws; each for itself if None. A mean is drawn
        after each whole replicate.

    Returns
    -------
    Figure
        A line with a band per controller.
    """
    found = designs or {}
    # One design for all scenarios: only where their replicates begin may differ.
    size = max((design.size for design in found.values()), default=1)

    def draw(axes: Axes, indicator: str, values: list[FloatArray]) -> None:
        ends: list[FloatArray] = []
        for index, own in enumerate(values):
            means, halves = running_means(own)
            runs = np.arange(1, own.size + 1) * size
            line: dict[str, Any] = {
                "color": colour(index),
                "linestyle": dashes(index),
                "linewidth": 1.2,
            }
            axes.plot(runs, means, label=label_of(controllers[index]), **line)
            axes.fill_between(
                runs, means - halves, means + halves, color=colour(index), alpha=0.18, linewidth=0.0
            )
            ends += [(means - halves)[SETTLED:], (means + halves)[SETTLED:]]
        seen = np.concatenate(ends) if ends else np.zeros(0)
        if seen.size and np.ptp(seen) > 0.0:
            axes.set_ylim(seen.min() - 0.05 * np.ptp(seen), seen.max() + 0.05 * np.ptp(seen))
        axes.set_xlabel("runs")
        _name(axes, indicator, "y")

    return _with_legend(_panels(summary, controllers, indicators, draw, ROW_IN, found))


def _panels(
    summary: pd.DataFrame,
    controllers: Sequence[str],
    indicators: Sequence[str],
    draw: Draw,
    height_in: float,
    designs: Mapping[str, SeedDesign] | None = None,
) -> Figure:
    scenarios = list(dict.fromkeys(summary["scenario"]))
    with style():
        size = (1.2 + PANEL_IN * len(scenarios), 0.8 + height_in * len(indicators))
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(len(indicators), len(scenarios), squeeze=False)
        for row, indicator in zip(panels, indicators, strict=True):
            for axes, scenario in zip(row, scenarios, strict=True):
                own = summary[summary["scenario"] == scenario]
                design = (designs or {}).get(scenario, EACH_FOR_ITSELF)
                values = [_values(own, name, indicator, design) for name in controllers]
                draw(axes, indicator, values)
                plain_frame(axes)
        for axes, scenario in zip(panels[0], scenarios, strict=True):
            axes.set_title(label_of(scenario), loc="left", color=INK)
    return figure


def _values(
    summary: pd.DataFrame, controller: str, indicator: str, design: SeedDesign
) -> FloatArray:
    own = summary[summary["controller"] == controller].sort_values("seed", kind="stable")
    values = design.replicate_means(
        own[indicator].to_numpy(dtype=np.float64), own["seed"].to_numpy()
    )
    known: FloatArray = values[~np.isnan(values)]
    return known


def _name(axes: Axes, indicator: str, which: str) -> None:
    told = INDICATOR_OF[indicator]
    unit = f" [{told.column.unit}]" if told.column.unit else ""
    set_label = axes.set_xlabel if which == "x" else axes.set_ylabel
    set_label(f"{told.label}{unit}")


def _with_legend(figure: Figure) -> Figure:
    handles, labels = figure.axes[0].get_legend_handles_labels()
    if handles:
        with style():
            figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 4))
    return figure
