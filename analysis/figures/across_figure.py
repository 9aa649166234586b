"""Changes against the baseline: a panel per indicator, scenarios side by side."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kankaku.analysis.figures.style import INK, colour, plain_frame, style
from kankaku.analysis.tables.across_tables import CRAWL, DELAY, ENERGY, STOPS, cell_of
from kankaku.analysis.tables.columns import rows_of
from kankaku.analysis.tables.indicators import INDICATOR_OF
from kankaku.analysis.words import label_of

PANELS = (STOPS, CRAWL, DELAY, ENERGY)
SPREAD = 0.7
"""Height that the controllers of a scenario share, of the distance between scenarios. [-]"""


def across_figure(table: pd.DataFrame) -> Figure:
    """
    Draw the changes of every controller in every scenario.

    Parameters
    ----------
    table
        The table ``across``.

    Returns
    -------
    Figure
        A dot per scenario and controller with its 95 % interval, the baseline as a line at 0. A
        panel is in per cent where every scenario has one, else in the indicator's unit.
    """
    scenarios = list(dict.fromkeys(table["scenario"]))
    controllers = list(dict.fromkeys(table["controller"]))
    rows = rows_of(table[table["controller"] != controllers[0]])
    with style():
        height = 1.5 + len(scenarios) * max(0.35, 0.16 * len(controllers))
        figure = Figure(figsize=(9.6, height), layout="constrained")
        panels = figure.subplots(1, len(PANELS), sharey=True)
        for axes, indicator in zip(panels, PANELS, strict=True):
            unit = _draw(axes, indicator, rows, (scenarios, controllers[1:]))
            told = INDICATOR_OF[indicator]
            axes.set_xlabel(f"{told.label}\n[{unit}]")
            axes.axvline(0.0, color=INK, linewidth=0.8, zorder=1.5)
            plain_frame(axes)
            axes.grid(visible=False, axis="y")
        panels[0].set_yticks(range(len(scenarios)), map(label_of, scenarios))
        panels[0].set_ylim(len(scenarios) - 0.5, -0.5)
        handles, labels = panels[0].get_legend_handles_labels()
        if handles:
            columns = min(len(labels), 5)
            figure.legend(handles, labels, loc="outside upper right", ncols=columns)
        figure.suptitle(
            f"Change against {label_of(controllers[0])}", x=0.01, ha="left", fontsize=10.0
        )
    return figure


def _draw(
    axes: Axes,
    indicator: str,
    rows: list[dict[str, Any]],
    names: tuple[list[str], list[str]],
) -> str:
    """Draw a panel; return its unit."""
    scenarios, controllers = names
    # A mean delay is too near zero for per cents in many scenarios.
    cells = [(row, cell_of(row, indicator, per_cent=indicator != DELAY)) for row in rows]
    known = [cell for _, cell in cells if not np.isnan(cell["difference"])]
    per_cent = bool(known) and not any(np.isnan(cell["change_pct"]) for cell in known)
    keys = ("change_pct", "change_confidence_95_pct")
    value, half = keys if per_cent else ("difference", "confidence_95")
    gap = SPREAD / max(len(controllers), 1)
    for index, controller in enumerate(controllers):
        own = [(row, cell) for row, cell in cells if row["controller"] == controller]
        offset = (index - 0.5 * (len(controllers) - 1)) * gap
        places = [scenarios.index(row["scenario"]) + offset for row, _ in own]
        axes.errorbar(
            [cell[value] for _, cell in own],
            places,
            xerr=np.nan_to_num([cell[half] for _, cell in own]),
            # The baseline keeps the first colour, as in every other figure.
            color=colour(index + 1),
            fmt="o",
            markersize=4.0,
            elinewidth=1.1,
            capsize=2.0,
            label=label_of(controller),
        )
    return "%" if per_cent else INDICATOR_OF[indicator].column.unit
