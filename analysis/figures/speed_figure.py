"""Speed of chosen trains over the line, a panel for each train, a line for each controller."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kankaku.analysis.figures.style import colour, dashes, plain_frame, style
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.analysis.words import KMH_PER_MPS, label_of

MOST_PANELS = 12
"""More trains than this are no figure any more. [-]"""


def speed_figure(
    runs: Sequence[RunTables],
    stations: pd.DataFrame,
    stretch_m: tuple[float, float] | None,
    *,
    title: str,
) -> Figure:
    """
    Draw how fast trains ran along the line.

    Parameters
    ----------
    runs
        One run per controller, of the trains to be shown.
    stations
        The table ``stations``.
    stretch_m
        From where to where; everything if None. [m]
    title
        Title of the figure.

    Returns
    -------
    Figure
        A panel for each train.

    Raises
    ------
    ValueError
        If there are more trains than panels.
    """
    trains = list(dict.fromkeys(name for run in runs for name in run.trajectory["train"]))
    if len(trains) > MOST_PANELS:
        msg = f"{len(trains)} trains are too many for a figure of speeds ({MOST_PANELS} at most)"
        raise ValueError(msg)
    with style():
        figure = Figure(figsize=(9.5, 1.2 + 2.3 * len(trains)), layout="constrained")
        panels = figure.subplots(len(trains), 1, sharex=True, squeeze=False)[:, 0]
        for axes, train in zip(panels, trains, strict=True):
            for index, run in enumerate(runs):
                own = run.trajectory[run.trajectory["train"] == train]
                axes.plot(
                    own["front_m"] / 1000.0,
                    KMH_PER_MPS * own["speed_mps"],
                    color=colour(index),
                    linestyle=dashes(index),
                    linewidth=1.1,
                    label=label_of(run.controller),
                )
            plain_frame(axes)
            axes.set_title(f"train {train}", loc="left")
            axes.set_ylabel("km/h")
            axes.set_ylim(bottom=0.0)
            if stretch_m is not None:
                axes.set_xlim(stretch_m[0] / 1000.0, stretch_m[1] / 1000.0)
        _name_stations(panels[0], stations)
        panels[-1].set_xlabel("km")
        figure.suptitle(title, fontsize=12.0)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=min(len(runs), 5))
    return figure


def _name_stations(axes: Axes, stations: pd.DataFrame) -> None:
    low_km, high_km = axes.get_xlim()
    over = axes.secondary_xaxis("top")
    places_km = stations["chainage_m"].to_numpy() / 1000.0
    seen = (places_km >= low_km) & (places_km <= high_km)
    over.set_xticks(places_km[seen], stations["name"].to_numpy()[seen], rotation=90, fontsize=6.0)
    axes.set_xlim(low_km, high_km)
    for place_km in places_km[np.asarray(seen)]:
        axes.axvline(place_km, color="#DDDDDD", linewidth=0.5, zorder=0.5)
