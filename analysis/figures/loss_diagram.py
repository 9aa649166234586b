"""What lost telegrams cost: delay and emergency brakings against the share that is lost."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from kankaku.analysis.figures.style import colour, plain_frame, style
from kankaku.analysis.words import label_of


def loss_figure(losses: pd.DataFrame) -> Figure:
    """
    Draw delay and emergency brakings against the loss of telegrams.

    Parameters
    ----------
    losses
        A row per run: ``controller``, ``loss_percent``, ``seed``, ``mean_arrival_delay_s``
        and ``emergency_brakings``.

    Returns
    -------
    Figure
        Two panels; thick lines are means, thin ones the seeds.
    """
    with style():
        figure = Figure(figsize=(9.6, 3.9), layout="constrained")
        delays, brakings = figure.subplots(1, 2)
        _draw(delays, losses, "mean_arrival_delay_s")
        delays.set_ylabel("mean arrival delay [s]")
        _draw(brakings, losses, "emergency_brakings")
        brakings.set_ylabel("emergency brakings per run")
        for axes in (delays, brakings):
            axes.set_xlabel("telegrams lost [%]")
            axes.set_ylim(bottom=0.0)
            axes.margins(x=0.02)
            axes.xaxis.set_major_locator(MultipleLocator(5.0))
            plain_frame(axes)
        handles, labels = delays.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return figure


def _draw(axes: Axes, losses: pd.DataFrame, column: str) -> None:
    for index, (name, own) in enumerate(losses.groupby("controller", sort=False)):
        for _, rows in own.groupby("seed", sort=False):
            shown = rows["loss_percent"], rows[column]
            axes.plot(*shown, color=colour(index), linewidth=0.7, alpha=0.45)
        mean = own.groupby("loss_percent")[column].mean()
        axes.plot(
            mean.index,
            mean,
            color=colour(index),
            linewidth=1.8,
            marker="o",
            markersize=3.5,
            label=label_of(str(name)),
        )
