"""What happened around one moment: who was where, how fast the train was, and what bound it."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from kankaku.analysis.figures.style import (
    BOOKED,
    GRID,
    INK,
    clock_axis,
    colour,
    station_axis,
    style,
)
from kankaku.analysis.figures.train_numbers import name_lines
from kankaku.analysis.tables.causes import Seen
from kankaku.analysis.tables.explained import Explained
from kankaku.analysis.tables.run_tables import REASONS
from kankaku.analysis.words import KMH_PER_MPS, clock, label_of

BEFORE_S, AFTER_S = 240.0, 180.0
EDGE_M = 250.0
OTHERS = "#C4C4C4"
FIRST_REASON = 8
"""Colours of reasons come after those of trains, so that none means two things. [-]"""


def moment_figure(seen: Seen, found: Explained, stations: pd.DataFrame) -> Figure:
    """
    Draw what happened around the moment of an explanation.

    Parameters
    ----------
    seen
        The run.
    found
        What there is to tell.
    stations
        The table ``stations``.

    Returns
    -------
    Figure
        Above: time-distance diagram with train numbers, the train and its chain in colours, its end
        of authority dashed. Below: its speed, and what bound it as a ribbon.

    Raises
    ------
    ValueError
        If the train was not on the line then.
    """
    sample = found.sample
    if sample is None:
        msg = f"train {found.train} was not on the line"
        raise ValueError(msg)
    start_s = min([found.time_s, *_finite(found.since_s)]) - BEFORE_S
    end_s = found.time_s + AFTER_S
    own = _within(seen.samples(found.train), start_s, end_s)
    chained = [link.name for link in found.chain if link.name in seen.trains]
    with style():
        figure = Figure(figsize=(9.0, 7.2), layout="constrained")
        diagram, speeds, ribbon = figure.subplots(3, 1, sharex=True, height_ratios=[3.4, 1.3, 0.22])
        low_m, high_m = _range_m(seen, found, own, chained)
        diagram.set_ylim(low_m, high_m)
        clock_axis(diagram, start_s, end_s)
        _draw_trains(diagram, seen, found, (start_s, end_s), chained)
        shown = stations[stations["chainage_m"].between(low_m, high_m)]
        station_axis(diagram, shown, labels=True, gap_m=0.045 * (high_m - low_m))
        _draw_speed(speeds, own)
        _draw_ribbon(ribbon, own)
        for axes in (diagram, speeds, ribbon):
            axes.axvline(found.time_s, color=INK, linewidth=0.7, linestyle=(0, (2, 2)), zorder=1.0)
            axes.spines[["top", "right"]].set_visible(False)
        moment = clock(found.time_s, seconds=True)
        figure.suptitle(
            f"Train {found.train} at {moment} under {label_of(found.controller)}", fontsize=12.0
        )
        lines, _ = diagram.get_legend_handles_labels()
        handles = [*lines, *_ribbon_legend(own)]
        figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def _finite(value: float) -> list[float]:
    return [value] if np.isfinite(value) else []


def _within(samples: Mapping[str, Any], start_s: float, end_s: float) -> dict[str, Any]:
    times_s = samples["time_s"]
    part = slice(*np.searchsorted(times_s, (start_s, end_s)).tolist())
    return {name: values[part] for name, values in samples.items()}


def _range_m(
    seen: Seen, found: Explained, own: Mapping[str, Any], chained: Sequence[str]
) -> tuple[float, float]:
    places = [*own["front_m"].tolist()]
    for name in chained[:2]:
        sample = seen.sample(name, found.time_s)
        places += [sample.front_m] if sample else []
    if found.ahead is not None:
        places.append(found.ahead["stop_m"])
    return min(places) - EDGE_M, max(places) + EDGE_M


def _draw_trains(
    axes: Axes, seen: Seen, found: Explained, window_s: tuple[float, float], chained: Sequence[str]
) -> None:
    lines = {}
    for train in seen.trains:
        part = _within(seen.samples(train), *window_s)
        if not part["time_s"].size:
            continue
        special = train == found.train or train in chained
        number = 0 if train == found.train else 1 + list(chained).index(train) if special else 0
        (line,) = axes.plot(
            part["time_s"],
            part["front_m"],
            color=colour(number % FIRST_REASON) if special else OTHERS,
            linewidth=2.0 if special else 0.9,
            zorder=2.6 - 0.1 * number if special else 2.0,
            label=f"train {train}" if special else "_",
        )
        lines[train] = line
    own = _within(seen.samples(found.train), *window_s)
    calls = seen.calls(found.train)
    axes.plot(
        calls[["booked_arrival_s", "booked_departure_s"]].to_numpy().ravel(),
        np.repeat(calls["stop_m"].to_numpy(), 2),
        color=BOOKED,
        linewidth=0.8,
        linestyle=(0, (5, 2)),
        label=f"{found.train} as booked",
        zorder=1.6,
    )
    axes.plot(
        own["time_s"],
        own["limit_m"],
        color=colour(0),
        linewidth=0.9,
        linestyle=(0, (1, 1)),
        label="its end of authority",
        zorder=2.1,
    )
    if found.sample is not None:
        axes.plot(
            found.time_s, found.sample.front_m, "o", color=colour(0), markersize=6.0, zorder=3.0
        )
    name_lines(axes, lines)


def _draw_speed(axes: Axes, own: Mapping[str, Any]) -> None:
    axes.plot(own["time_s"], KMH_PER_MPS * own["speed_mps"], color=colour(0), linewidth=1.5)
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel("km/h")
    axes.grid(color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)


def _reasons(own: Mapping[str, Any]) -> list[str]:
    found = {str(reason) for reason in own["reason"]}
    return [reason for reason in REASONS if reason in found] + sorted(found - set(REASONS))


def _shade(reason: str) -> str:
    number = REASONS.index(reason) if reason in REASONS else len(REASONS)
    return colour(FIRST_REASON + number)


def _draw_ribbon(axes: Axes, own: Mapping[str, Any]) -> None:
    times_s, reasons = own["time_s"], own["reason"]
    first = [at for at in range(times_s.size) if at == 0 or reasons[at] != reasons[at - 1]]
    for start, end in zip(first, [*first[1:], times_s.size - 1], strict=False):
        axes.axvspan(times_s[start], times_s[end], color=_shade(str(reasons[start])), linewidth=0.0)
    axes.set_yticks([])
    axes.set_ylabel("bound by", rotation=0, ha="right", va="center")


def _ribbon_legend(own: Mapping[str, Any]) -> list[Patch]:
    return [
        Patch(facecolor=_shade(reason), label=f"bound by: {label_of(reason)}")
        for reason in _reasons(own)
    ]
