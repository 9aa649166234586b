"""Stops, delay and energy of every controller against the baseline: who gives up what."""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from kankaku.analysis.figures.style import INK, colour, marker, plain_frame, style
from kankaku.analysis.tables.across_tables import BOUND, CRAWL, DELAY, ENERGY, STOPS, cell_of
from kankaku.analysis.tables.columns import rows_of
from kankaku.analysis.tables.indicators import INDICATOR_OF
from kankaku.analysis.tables.pareto import best_controllers, non_dominated
from kankaku.analysis.words import label_of, told_of
from kankaku.railway.arrays import BoolArray, FloatArray

ROWS = (DELAY, ENERGY, CRAWL)
"""What stop time is drawn against."""
WIDTH_IN, ROW_IN = 3.3, 1.55
"""Of a scenario, to be read at a width of 80 mm, and of a panel. [in]"""
MANY, NARROW_IN = 3, 2.5
"""Of more scenarios than this each has less. [-], [in]"""
LINE_IN = 0.15
"""Height of a line of the legend. [in]"""
SMALL = 6.5
"""Size of numbers and names. [pt]"""
LETTERS, SPARE_LETTERS = 66, 8
"""Letters that fit beside each other in the legend of one scenario, and what a column takes. [-]"""
ROOM = np.array([0.07, 0.14])
"""Room beside what is shown, for the numbers; of its width and height. [-]"""
LIMIT = "#777777"
NO_STOP = (0, (1, 2))
"""Dashes of the line where no train stands between stations."""
NEAR_PT = 1.5
"""A number that is further away by 1 pt counts like one that covers so much. [pt2/pt]"""
AWAY_PT = (8.0, 12.0, 17.0, 23.0)
"""Numbers stand this far from their point: the nearest that is free. [pt]"""
AROUND_DEG = (45.0, 135.0, 90.0, 0.0, 180.0, 225.0, 315.0, 270.0, *np.arange(22.5, 360.0, 45.0))
"""Where around it, first choice first. [degrees]"""
CHARACTER_PT, TALL_PT = 4.8, 9.6
"""Room that numbers need. [pt]"""


class Point(NamedTuple):
    """A controller in a panel."""

    number: int
    """Its place in the table, from 0 on."""
    change: tuple[float, float]
    """Stop time, and what it is drawn against; changes against the baseline."""
    half: tuple[float, float]
    """Half of their 95 % intervals; nan for none."""
    knows_future: bool


def pareto_figure(table: pd.DataFrame) -> Figure:
    """
    Draw what controllers gain and give up.

    Parameters
    ----------
    table
        The table ``across``, of one scenario or several.

    Returns
    -------
    Figure
        Mean arrival delay, net energy and crawl against stop time between stations, all as paired
        changes against the first controller with their 95 % intervals; a column for each
        scenario. Lines join the controllers that no other one beats in both respects of a panel;
        filled ones are beaten by no other in stops, delay and energy together. Bars below the
        points say how low any control could bring the delay.
    """
    scenarios = list(dict.fromkeys(table["scenario"]))
    names = list(dict.fromkeys(table["controller"]))
    with style():
        entries = list(_entries(table, names))
        longest = max(len(str(entry.get_label())) for entry in entries)
        columns = max(LETTERS * len(scenarios) // (longest + SPARE_LETTERS), 1)
        lines = -(-len(entries) // columns)
        height = ROW_IN * len(ROWS) + LINE_IN * lines + 0.45
        wide = WIDTH_IN if len(scenarios) <= MANY else NARROW_IN
        figure = Figure(figsize=(wide * len(scenarios), height), layout="constrained")
        panels = figure.subplots(len(ROWS), len(scenarios), sharex="col", squeeze=False)
        for column, scenario in enumerate(scenarios):
            own = table[table["scenario"] == scenario]
            _scenario(panels[:, column].tolist(), own, names)
            if len(scenarios) > 1:
                panels[0, column].set_title(label_of(scenario), loc="left", fontsize=8.0)
        figure.legend(
            handles=entries,
            loc="outside lower left",
            ncols=columns,
            fontsize=SMALL,
            handletextpad=0.3,
            columnspacing=1.2,
            labelspacing=0.25,
        )
        figure.suptitle(f"Change against {label_of(names[0])}", x=0.01, ha="left", fontsize=8.5)
        figure.align_ylabels()
        # Only now is it known where the points lie on the paper.
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
        for axes in panels.ravel():
            _number(axes)
    return figure


def _entries(table: pd.DataFrame, names: Sequence[str]) -> Iterator[Line2D]:
    """Yield the entries of the legend: controllers by number, and what lines and bars mean."""
    foretold = set(table["controller"][table["knows_future"]])
    for number, name in enumerate(names):
        told = told_of(label_of(name), knows_future=name in foretold)
        yield Line2D([], [], label=f"{number + 1}  {told}", **_look(number, name in foretold))
    yield Line2D([], [], color=LIMIT, linewidth=0.8, label="front of the panel")
    yield Line2D([], [], color=LIMIT, linewidth=0.6, linestyle=NO_STOP, label="no stop at all")
    if (table["pairs"] > 1).any():
        yield Line2D([], [], color=INK, linewidth=0.6, label="95 % interval, paired", marker="|")
    yield Line2D([], [], color=INK, marker="_", linestyle="none", label="least possible delay")
    yield Line2D(
        [],
        [],
        color=INK,
        marker="o",
        markerfacecolor="white",
        linestyle="none",
        markersize=4.0,
        label="hollow: beaten all round",
    )


def _look(number: int, knows_future: bool) -> dict[str, Any]:
    if knows_future:
        return {"color": INK, "marker": "*", "linestyle": "none", "markersize": 6.5}
    return {
        "color": colour(number),
        "marker": marker(number),
        "linestyle": "none",
        "markersize": 4.5,
    }


def _scenario(panels: Sequence[Axes], table: pd.DataFrame, names: Sequence[str]) -> None:
    """Draw the panels of a scenario."""
    rows = [row for row in rows_of(table) if row["violations"] == 0 and row["pairs"] > 0]
    best = best_controllers(table)
    x_unit = _unit(rows, STOPS)
    for axes, indicator in zip(panels, ROWS, strict=True):
        unit = _unit(rows, indicator)
        points = [
            _point(names.index(row["controller"]), row, indicator, (x_unit, unit)) for row in rows
        ]
        _front(axes, [point for point in points if not point.knows_future])
        for point in points:
            _draw(axes, point, filled=names[point.number] in best)
        also = _bounds(axes, points, rows) if indicator == DELAY else []
        if x_unit == "%":
            also.append((-100.0, 0.0))
            axes.axvline(-100.0, color=LIMIT, linewidth=0.6, linestyle=NO_STOP)
        axes.set_ylabel(f"{_short(indicator)} [{unit}]", fontsize=7.0)
        axes.tick_params(labelsize=SMALL, length=2.0)
        plain_frame(axes)
        _show(axes, points, also)
    panels[-1].set_xlabel(f"{_short(STOPS)} [{x_unit}]", fontsize=7.0)


def _short(indicator: str) -> str:
    return INDICATOR_OF[indicator].label.removesuffix(" between stations")


def _unit(rows: Sequence[dict[str, Any]], indicator: str) -> str:
    """Return the unit of a scenario's changes: per cent where all of them have one."""
    changes = [cell_of(row, indicator)["change_pct"] for row in rows]
    # A mean delay is near zero, or negative, in many a scenario.
    if indicator == DELAY or any(np.isnan(changes)):
        return INDICATOR_OF[indicator].column.unit
    return "%"


def _point(number: int, row: dict[str, Any], indicator: str, units: tuple[str, str]) -> Point:
    found = []
    for one, unit in zip((STOPS, indicator), units, strict=True):
        cell = cell_of(row, one, per_cent=unit == "%")
        keys = ("change_pct", "change_confidence_95_pct")
        value, half = keys if unit == "%" else ("difference", "confidence_95")
        found.append((float(cell[value]), float(cell[half])))
    (x, x_half), (y, y_half) = found
    return Point(number, (x, y), (x_half, y_half), bool(row["knows_future"]))


def _front(axes: Axes, points: Sequence[Point]) -> None:
    """Join the points that no other one beats in a panel."""
    if not points:
        return
    places = np.array([point.change for point in points])
    front = places[non_dominated(places)]
    front = front[np.argsort(front[:, 0])]
    axes.plot(*front.T, color=LIMIT, linewidth=0.8, zorder=1.8)


def _draw(axes: Axes, point: Point, *, filled: bool) -> None:
    look = _look(point.number, point.knows_future)
    if not filled or point.knows_future:
        look["markerfacecolor"] = "white"
    halves = np.nan_to_num(np.array(point.half))
    axes.errorbar(
        *point.change,
        xerr=halves[0] or None,
        yerr=halves[1] or None,
        elinewidth=0.6,
        capsize=1.2,
        capthick=0.6,
        markeredgewidth=0.9,
        zorder=2.5,
        label=str(point.number + 1),
        **look,
    )


def _bounds(
    axes: Axes, points: Sequence[Point], rows: Sequence[dict[str, Any]]
) -> list[tuple[float, float]]:
    """Draw how low any control could bring each controller's delay; return where that is."""
    found = []
    for point, row in zip(points, rows, strict=True):
        if np.isnan(row[BOUND]):
            continue
        x, y = point.change
        least = y - (row[DELAY] - row[BOUND])
        tone = _look(point.number, point.knows_future)["color"]
        axes.plot([x, x], [least, y], color=tone, linewidth=0.5, linestyle=NO_STOP, zorder=1.6)
        axes.plot(
            [x], [least], color=tone, marker="_", markersize=6.0, linestyle="none", zorder=2.0
        )
        found.append((x, least))
    return found


def _show(axes: Axes, points: Sequence[Point], also: Sequence[tuple[float, float]]) -> None:
    """Show all points and some other places, but of intervals not more than these lie apart."""
    if not points:
        return
    changes, halves = (np.array(part) for part in list(zip(*points, strict=True))[1:3])
    places = np.vstack([changes, *also])
    shown = np.minimum(np.nan_to_num(halves), np.ptp(places, axis=0))
    low = np.minimum((changes - shown).min(axis=0), places.min(axis=0))
    high = np.maximum((changes + shown).max(axis=0), places.max(axis=0))
    room = np.where(high > low, high - low, 1.0) * ROOM
    axes.set_xlim(low[0] - room[0], high[0] + room[0])
    axes.set_ylim(low[1] - room[1], high[1] + room[1])


def _number(axes: Axes) -> None:
    """Write every point's number beside it, where nothing else is."""
    named = [box for box in axes.containers if str(box.get_label()).isdigit()]
    places = np.array([np.ravel(box[0].get_xydata()) for box in named]).reshape(-1, 2)
    if not places.size:
        return
    figure = axes.get_figure()
    per_pt = figure.dpi / 72.0 if figure else 1.0
    at_pt = axes.transData.transform(places) / per_pt
    bars = [bar for box in named for bar in box[2]]
    ends = [axes.transData.transform(bar.get_segments()[0]) / per_pt for bar in bars]
    lines = [np.concatenate([end.min(axis=0) - 0.5, end.max(axis=0) + 0.5]) for end in ends]
    taken = np.vstack([np.column_stack([at_pt - 3.0, at_pt + 3.0]), *lines])
    frame = np.asarray(axes.bbox.extents) / per_pt
    for box, place, centre in zip(named, map(tuple, places.tolist()), at_pt, strict=True):
        text = str(box.get_label())
        offset = free_offset(centre, (CHARACTER_PT * len(text), TALL_PT), taken, frame)
        axes.annotate(
            text,
            place,
            xytext=offset,
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=SMALL,
            color=box[0].get_color(),
            zorder=4.0,
            path_effects=[withStroke(linewidth=1.5, foreground="white")],
        )
        room = np.array([CHARACTER_PT * len(text), TALL_PT]) / 2.0
        own = np.concatenate([centre + offset - room, centre + offset + room])
        taken = np.vstack([taken, own])


def free_offset(
    centre: FloatArray, size: tuple[float, float], taken: FloatArray, frame: FloatArray
) -> tuple[float, float]:
    """
    Return where beside a point a label is near it and covers little of what is there.

    Parameters
    ----------
    centre
        The point. [pt], shape (2,)
    size
        Width and height of the label. [pt]
    taken
        What is there: left, bottom, right, top. [pt], shape (n_boxes, 4)
    frame
        Where it must lie, alike. [pt], shape (4,)

    Returns
    -------
    tuple[float, float]
        From the point to the middle of the label. [pt]
    """
    angles = np.radians(AROUND_DEG)
    offsets = np.concatenate(
        [away * np.column_stack([np.cos(angles), np.sin(angles)]) for away in AWAY_PT]
    )
    half = np.array(size) / 2.0
    low, high = centre + offsets - half, centre + offsets + half
    shared = np.minimum(high[:, np.newaxis], taken[:, 2:]) - np.maximum(
        low[:, np.newaxis], taken[:, :2]
    )
    covered = np.prod(np.maximum(shared, 0.0), axis=2).sum(axis=1)
    outside: BoolArray = np.any((low < frame[:2]) | (high > frame[2:]), axis=1)
    away = np.repeat(AWAY_PT, len(AROUND_DEG))
    best = offsets[int(np.argmin(covered + NEAR_PT * away + 1e3 * outside))]
    return float(best[0]), float(best[1])
