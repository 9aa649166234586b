"""Heat maps of delay, train by station: secondary delay of each controller."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from kankaku.analysis.figures.style import style
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.analysis.words import label_of
from kankaku.railway.arrays import FloatArray

SHADES = "YlGnBu"
"""Falls in lightness: also on grey paper, also for whoever sees fewer colours."""
NO_CALL = "#DDDDDD"
PANEL_IN = 4.4


def delay_figure(runs: Sequence[RunTables], stations: pd.DataFrame, *, title: str) -> Figure:
    """
    Draw what every train owed to others at every station.

    Parameters
    ----------
    runs
        One run per controller, baseline first.
    stations
        The table ``stations``.
    title
        Title of the figure.

    Returns
    -------
    Figure
        A panel for each controller, all of the same scale; trains across in the order of their
        first call, stations upwards.
    """
    columns = min(len(runs), 3)
    lines = -(-len(runs) // columns)
    served = stations[stations["station"].isin(runs[0].calls["station"])]
    order = list(dict.fromkeys(runs[0].calls["train"]))
    with style():
        size = (1.6 + PANEL_IN * columns, 1.0 + (0.9 + 0.19 * len(served)) * lines)
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
        maps = [_owed_s(run, order, served["station"].tolist()) for run in runs]
        top_s = max([float(np.nanmax(one)) for one in maps if np.isfinite(one).any()] + [1.0])
        shown = None
        for index, (run, owed_s, axes) in enumerate(zip(runs, maps, panels.flat, strict=False)):
            shown = axes.pcolormesh(
                np.arange(len(order) + 1) - 0.5,
                np.arange(len(served) + 1) - 0.5,
                owed_s,
                cmap=SHADES,
                vmin=0.0,
                vmax=top_s,
                rasterized=True,
            )
            axes.set_facecolor(NO_CALL)
            axes.set_title(label_of(run.controller), loc="left", fontweight="bold")
            axes.set_xticks(range(len(order)), order, rotation=90, fontsize=4.5)
            axes.set_yticks(range(len(served)), served["name"], fontsize=6.0)
            axes.tick_params(labelbottom=index + columns >= len(runs), length=0)
        for axes in list(panels.flat)[len(runs) :]:
            axes.set_axis_off()
        figure.suptitle(title, fontsize=12.0)
        if shown is not None:
            figure.colorbar(shown, ax=panels, label="secondary delay [s]", shrink=0.6)
    return figure


def _owed_s(run: RunTables, trains: Sequence[str], stations: Sequence[str]) -> FloatArray:
    table = run.calls.pivot_table(
        index="station", columns="train", values="secondary_delay_s", aggfunc="max"
    )
    table = table.reindex(index=pd.Index(stations), columns=pd.Index(trains))
    owed_s: FloatArray = np.maximum(table.to_numpy(dtype=np.float64), 0.0)
    return owed_s
