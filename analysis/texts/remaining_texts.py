"""Why trains still stood between stations, controller by controller."""

from collections.abc import Collection, Sequence

import numpy as np
import pandas as pd

from kankaku.analysis.tables.remaining_stops import BESIDE
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.analysis.words import told_of

LONG_S = 90.0
"""Overstays from here on are long. [s]"""


def remaining_texts(runs: Sequence[RunTables], knows_future: Collection[str] = ()) -> list[str]:
    """
    Return what the stops that remain were for.

    Parameters
    ----------
    runs
        All runs that are compared.
    knows_future
        Names of the controllers that are told the drawn dwell delays.

    Returns
    -------
    list[str]
        A sentence or two for each controller, over all its runs.
    """
    frames: dict[str, list[pd.DataFrame]] = {}
    for run in runs:
        frames.setdefault(run.controller, []).append(run.remaining_stops)
    told = {name: stops_text(pd.concat(parts, ignore_index=True)) for name, parts in frames.items()}
    return [
        f"{told_of(f'`{name}`', knows_future=name in knows_future)}: {text}"
        for name, text in told.items()
    ]


def stops_text(stops: pd.DataFrame) -> str:
    """
    Return what some stops were for.

    Parameters
    ----------
    stops
        The table ``remaining_stops`` of one or more runs.

    Returns
    -------
    str
        How many there are behind long and shorter overstays and behind none, and how many of the
        overstays had begun by when.
    """
    if stops.empty:
        return "no train stood between stations."
    overstay_s = stops["overstay_s"].to_numpy()
    long, short = overstay_s >= LONG_S, (overstay_s > 0.0) & (overstay_s < LONG_S)
    beside = (stops["first_cause_state"] == BESIDE).to_numpy()
    counts = {
        f"behind overstays of {LONG_S:g} s or more": long.sum(),
        "behind shorter ones": short.sum(),
        "before something beside the track": beside.sum(),
        "behind trains that did not overstay": (~(long | short | beside)).sum(),
    }
    parts = ", ".join(f"{count} {where}" for where, count in counts.items() if count)
    count = f"{len(stops)} stops between stations remain"
    if len(stops) == 1:
        count = "1 stop between stations remains"
    told = f"{count}: {parts}."
    known = stops[np.isfinite(overstay_s) & (overstay_s > 0.0)]
    if known.empty:
        return told
    at_departure, when_slowed = (
        int((known[f"overstayed_{moment}_s"] >= 0.0).sum())
        for moment in ("at_departure", "when_slowed")
    )
    return (
        f"{told} Of the overstays {at_departure} had begun when the train behind left its last "
        f"stop, {when_slowed} when it was first slowed."
    )
