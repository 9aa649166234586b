"""Figures of availability and of fault trees."""

import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from kankaku.analysis.figures.style import INK, colour, plain_frame, style
from kankaku.analysis.tables.dependability import HOUR_S, Endurance
from kankaku.analysis.words import label_of
from kankaku.railway.failures.availability import YEAR_S
from kankaku.railway.failures.fault_tree import FaultTree, top_probability

COLUMN_IN = 2.35
ROW_IN = 0.36
BOX_IN = 1.85
LETTERS = 36
MOST_ROWS = 160
"""A higher tree is drawn only so deep that it fits. [-]"""


def availability_figure(found: Sequence[Endurance], *, source: str) -> Figure:
    """
    Draw the availability of some systems, and what stops the line.

    Parameters
    ----------
    found
        One per system.
    source
        Of what was published.

    Returns
    -------
    Figure
        Left: availability, ours and published. Right: stopped hours by kind of device.

    References
    ----------
    .. [1] Sugiyama et al. 2018, fig. 11.
    """
    titles = [textwrap.fill(system.configuration.title, 18) for system in found]
    places = np.arange(len(found))
    with style():
        figure = Figure(figsize=(9.0, 1.6 + 0.5 * len(found)), layout="constrained")
        left, right = figure.subplots(1, 2, sharey=True)
        ours = [system.told["availability_percent"] for system in found]
        left.plot(ours, places, "o", color=colour(0), markersize=6.0, label="ours")
        told = [
            (system.configuration.published["availability_percent"], place)
            for place, system in enumerate(found)
            if "availability_percent" in system.configuration.published
        ]
        if told:
            name = f"published ({source})" if source else "published"
            left.plot(*zip(*told, strict=True), "|", color=INK, markersize=15.0, label=name)
        for value, place in zip(ours, places.tolist(), strict=True):
            left.annotate(
                f"{value:.4f}",
                (value, place),
                xytext=(0.0, 8.0),
                textcoords="offset points",
                ha="center",
                fontsize=7.0,
            )
        left.margins(x=0.15)
        left.set_ylim(len(found) - 0.4, -0.6)
        left.set_yticks(places, titles)
        left.set_xlabel("availability [%]")
        left.ticklabel_format(axis="x", useOffset=False)
        left.xaxis.set_major_locator(MaxNLocator(4))
        left.legend(fontsize=7.0, loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=2)
        _draw_hours(right, found)
        for axes in (left, right):
            plain_frame(axes)
        left.set_title("Availability", loc="left", fontsize=11.0)
        right.set_title("What stops the line", loc="left", fontsize=11.0)
    return figure


def _draw_hours(axes: Axes, found: Sequence[Endurance]) -> None:
    devices = list(
        dict.fromkeys(group.device for system in found for group in system.configuration.groups)
    )
    from_h = np.zeros(len(found))
    for index, device in enumerate(devices):
        hours = np.array(
            [
                sum(
                    group.count * group.failure_rate_per_s * YEAR_S * group.repair_s * group.effect
                    for group in system.configuration.groups
                    if group.device == device
                )
                / HOUR_S
                for system in found
            ]
        )
        axes.barh(
            np.arange(len(found)), hours, 0.55, from_h, color=colour(index), label=label_of(device)
        )
        from_h += hours
    axes.set_xlabel("stopped hours per year")
    axes.legend(fontsize=7.0, loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=3)


def fault_tree_figure(tree: FaultTree) -> Figure:
    """
    Draw a fault tree from left to right, one panel per top event.

    Parameters
    ----------
    tree
        The fault tree.

    Returns
    -------
    Figure
        Gates and events with their probabilities; what leads to several gates is drawn at each.
        A tree that would be too high is drawn down to a depth that fits.
    """
    depth = _fitting_depth(tree)
    sizes = [_size(tree, top, depth) for top in tree.tops]
    width_in = COLUMN_IN * max(columns for _, columns in sizes) - (COLUMN_IN - BOX_IN) + 0.3
    heights_in = [ROW_IN * rows + 0.3 for rows, _ in sizes]
    with style():
        figure = Figure(figsize=(width_in, sum(heights_in) + 0.3))
        for number, (top, height_in) in enumerate(zip(tree.tops, heights_in, strict=True)):
            below_in = 0.3 + sum(heights_in[number + 1 :])
            whole_in = figure.get_figheight()
            axes = figure.add_axes((0.0, below_in / whole_in, 1.0, height_in / whole_in))
            axes.set_axis_off()
            axes.set_xlim(-0.15, width_in - 0.15)
            axes.set_ylim(height_in / ROW_IN - 0.5, -0.5)
            _draw(axes, tree, top, 0.0, (0, depth))
        told = f"& all of them, ≥1 any of them; probabilities within {tree.period_s / HOUR_S:g} h"
        figure.text(0.15 / width_in, 0.12 / figure.get_figheight(), told, fontsize=7.0)
    return figure


def _fitting_depth(tree: FaultTree) -> int:
    depth = 1
    while sum(_size(tree, top, depth + 1)[0] for top in tree.tops) <= MOST_ROWS and depth < len(
        tree.gates
    ):
        depth += 1
    return depth


def _size(tree: FaultTree, name: str, depth: int) -> tuple[int, int]:
    """Return how many rows and columns a tree takes, drawn down to a depth."""
    if name in tree.events or depth == 0:
        return 1, 1
    inner = [_size(tree, part, depth - 1) for part in tree.gates[name].inputs]
    return sum(rows for rows, _ in inner), 1 + max(columns for _, columns in inner)


def _draw(axes: Axes, tree: FaultTree, name: str, row: float, place: tuple[int, int]) -> float:
    """Draw what lies below and right of a row, at a column and down to a depth; return its row."""
    column, depth = place
    left_in = COLUMN_IN * column
    if name in tree.events or depth == 0:
        _draw_box(axes, tree, name, (left_in, row), "#F4F4F4")
        return row
    gate, rows, next_row = tree.gates[name], [], row
    for part in gate.inputs:
        rows.append(_draw(axes, tree, part, next_row, (column + 1, depth - 1)))
        next_row += _size(tree, part, depth - 1)[0]
    own = 0.5 * (rows[0] + rows[-1])
    trunk_in = left_in + 0.5 * (BOX_IN + COLUMN_IN)
    ways = [([left_in + BOX_IN, trunk_in], [own, own]), ([trunk_in] * 2, [rows[0], rows[-1]])]
    ways += [([trunk_in, left_in + COLUMN_IN], [height, height]) for height in rows]
    for across_in, heights in ways:
        axes.plot(across_in, heights, color="#999999", linewidth=0.7, zorder=1.0)
    axes.text(
        trunk_in,
        own,
        "&" if gate.needs_all else "≥1",
        ha="center",
        va="center",
        fontsize=7.5,
        bbox={"boxstyle": "round,pad=0.25", "facecolor": "white", "edgecolor": INK},
    )
    _draw_box(axes, tree, name, (left_in, own), "#DCE9F3" if column else "#F6D5C3")
    return own


def _draw_box(
    axes: Axes, tree: FaultTree, name: str, place: tuple[float, float], shade: str
) -> None:
    left_in, row = place
    title = (tree.events.get(name) or tree.gates[name]).title
    axes.add_patch(
        Rectangle(
            (left_in, row - 0.43),
            BOX_IN,
            0.86,
            facecolor=shade,
            edgecolor="#999999",
            linewidth=0.6,
            zorder=2.0,
        )
    )
    axes.text(
        left_in + 0.5 * BOX_IN,
        row,
        f"{textwrap.fill(title, LETTERS)}\n{top_probability(tree, name):.3g}",
        ha="center",
        va="center",
        fontsize=6.5,
        linespacing=1.15,
        zorder=3.0,
    )
