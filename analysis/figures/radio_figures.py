"""Figures of the radio load: cells over time, round trips, and what a cell carries."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from kankaku.analysis.figures.style import INK, STOP, clock_axis, colour, plain_frame, style
from kankaku.analysis.saved_run import SavedRun
from kankaku.analysis.tables.radio_tables import MINUTE_S, LoadCase, carried, cell_minutes, grouped
from kankaku.analysis.tables.radio_tables import CellPoint as Point
from kankaku.analysis.words import label_of
from kankaku.railway.radio.cells import Link, RadioPlan

HEAT = "YlOrRd"


def radio_load_figure(case: LoadCase, run: SavedRun, plan: RadioPlan, *, title: str) -> Figure:
    """
    Draw how the load follows the trains from cell to cell.

    Parameters
    ----------
    case
        The simulation of the saved run.
    run
        That run.
    plan
        What was asked.
    title
        Title of the figure.

    Returns
    -------
    Figure
        Cells over time with the ways of the trains; below, mean and greatest load.
    """
    minutes = 100.0 * cell_minutes(case.traffic, Link.ANTENNA_TRAIN)
    start_s = case.start_s or 0.0
    edges_s = start_s + MINUTE_S * np.arange(minutes.shape[1] + 1)
    with style():
        figure = Figure(figsize=(8.6, 6.4), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.6, 1.0))
        edges_km = plan.cells.edges_m / 1000.0
        image = above.pcolormesh(edges_s, edges_km, minutes, cmap=HEAT)
        for trip in run.trips:
            above.plot(trip.time_s, trip.front_m / 1000.0, color=INK, linewidth=0.35, alpha=0.7)
        above.hlines(edges_km[1:-1], edges_s[0], edges_s[-1], color="white", linewidth=0.7)
        above.set_ylim(edges_km[0], edges_km[-1])
        above.set_ylabel("chainage [km]; a cell between white lines")
        above.set_title(title, loc="left", fontsize=11.0)
        bar = figure.colorbar(image, ax=above, pad=0.01)
        bar.set_label("antenna to train, mean of a minute [%]")
        middle_s = 0.5 * (edges_s[:-1] + edges_s[1:])
        kinds = ((Link.ANTENNA_TRAIN, "antenna to train"), (Link.TRAIN_ANTENNA, "train to antenna"))
        for index, (kind, name) in enumerate(kinds):
            shares = 100.0 * cell_minutes(case.traffic, kind)
            own = {"color": colour(index), "linewidth": 1.1}
            below.plot(middle_s, shares.max(axis=0), label=f"{name}, busiest cell", **own)
            own |= {"linestyle": (0, (4, 1.5))}
            below.plot(middle_s, shares.mean(axis=0), label=f"{name}, mean of cells", **own)
        below.set_ylabel("utilisation [%]")
        below.set_ylim(bottom=0.0)
        plain_frame(below)
        below.legend(ncols=2, fontsize=7.0, loc="lower center")
        clock_axis(below, float(edges_s[0]), float(edges_s[-1]))
    return figure


def round_trip_figure(cases: Sequence[LoadCase], *, title: str) -> Figure:
    """
    Draw how long a round trip takes.

    Parameters
    ----------
    cases
        All simulations.
    title
        Title of the figure.

    Returns
    -------
    Figure
        Share of round trips that take no longer, by case, and the published mean and longest.
    """
    with style():
        figure = Figure(figsize=(7.4, 4.2), layout="constrained")
        axes = figure.subplots()
        plain_frame(axes)
        systems = list(dict.fromkeys(case.system.name for case in cases))
        names = list(dict.fromkeys(case.name for case in cases))
        for case in cases:
            taken_s = np.sort(case.traffic.round_trips_s)
            if not taken_s.size:
                continue
            # Some thousand points show the curve; a million would only fill the file.
            share = np.linspace(0.0, 1.0, 2001)
            axes.plot(
                np.quantile(taken_s, share),
                100.0 * share,
                color=colour(names.index(case.name)),
                linestyle=("solid", (0, (4, 1.5)), (0, (1, 1)))[
                    systems.index(case.system.name) % 3
                ],
                # Curves that are alike lie inside each other.
                linewidth=max(1.0, 3.4 - 1.2 * names.index(case.name)),
                label=f"{case.system.title}, {label_of(case.name)}",
            )
        _draw_published(axes, cases)
        axes.set_xlim(left=0.0)
        axes.set_ylim(0.0, 101.0)
        axes.set_xlabel("from making a command until its answer is back [s]")
        axes.set_ylabel("share of round trips [%]")
        axes.legend(fontsize=7.5)
        axes.set_title(title, loc="left", fontsize=11.0)
    return figure


def _draw_published(axes: Axes, cases: Sequence[LoadCase]) -> None:
    told = {
        (name, value)
        for case in cases
        if case.published
        for name, value in (
            ("mean", case.published.round_trip_mean_s),
            ("longest", case.published.round_trip_max_s),
        )
        if value is not None
    }
    for name, value in sorted(told):
        axes.axvline(value, color=STOP, linewidth=0.8, linestyle=(0, (2, 2)), zorder=1.5)
        axes.annotate(
            f"published {name}\n{value:g} s",
            (value, 4.0),
            xytext=(4.0, 0.0),
            textcoords="offset points",
            fontsize=7.0,
        )


def cell_capacity_figure(points: Sequence[Point], plan: RadioPlan, *, title: str) -> Figure:
    """
    Draw how full a cell is, and how many commands come late, against its trains.

    Parameters
    ----------
    points
        All simulations of a cell.
    plan
        What was asked.
    title
        Title of the figure.

    Returns
    -------
    Figure
        Two panels with one curve per system and number of trackside devices.
    """
    with style():
        figure = Figure(figsize=(8.6, 4.2), layout="constrained")
        left, right = figure.subplots(1, 2)
        for index, curve in enumerate(grouped(points)):
            trains = [point.trains for point in curve]
            devices = curve[0].trackside_devices
            beside = f", {devices} trackside devices" if devices else ""
            limit = carried(curve)
            name = f"{curve[0].system.title}{beside}: {limit} trains"
            own = {"color": colour(index), "linewidth": 1.3, "marker": ".", "markersize": 4.0}
            left.plot(trains, [100.0 * point.utilisation for point in curve], label=name, **own)
            right.plot(trains, [100.0 * point.late for point in curve], **own)
            right.axvline(limit + 0.5, color=colour(index), linewidth=0.7, linestyle=(0, (2, 2)))
        left.set_ylabel("antenna to train, utilisation [%]")
        left.set_ylim(0.0, 104.0)
        left.legend(fontsize=7.5, loc="lower right")
        right.set_ylabel(f"commands later than {plan.late_s:g} s, or never sent [%]")
        right.set_ylim(bottom=-1.0)
        for axes in (left, right):
            plain_frame(axes)
            axes.set_xlim(left=0.0)
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
            axes.set_xlabel("trains in one cell")
        left.set_title(title, loc="left", fontsize=11.0)
    return figure
