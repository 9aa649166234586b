"""A part of a run: two hours of a whole day, or a few minutes."""

from dataclasses import replace

import numpy as np
import pandas as pd

from kankaku.analysis.tables.run_tables import RunTables

LONGEST_S = 6.0 * 3600.0
"""A day that is longer than this is too crowded to be drawn. [s]"""
WINDOW_S = 2.0 * 3600.0
STEP_S = 600.0
"""Windows begin at multiples of this. [s]"""


def busiest_window_s(calls: pd.DataFrame) -> tuple[float, float] | None:
    """
    Return the two hours with most booked calls.

    Parameters
    ----------
    calls
        The table ``calls`` of any run.

    Returns
    -------
    tuple[float, float] | None
        The first ones if there are several; None if the whole day is not longer than six hours.
        [s]
    """
    booked_s = np.sort(calls["booked_arrival_s"].to_numpy())
    first_s, last_s = float(booked_s[0]), float(booked_s[-1])
    if last_s - first_s <= LONGEST_S:
        return None
    starts_s = np.unique(STEP_S * np.floor(booked_s / STEP_S))
    before, until = (np.searchsorted(booked_s, starts_s + at_s) for at_s in (0.0, WINDOW_S))
    start_s = float(starts_s[int(np.argmax(until - before))])
    return start_s, start_s + WINDOW_S


def within(run: RunTables, window_s: tuple[float, float]) -> RunTables:
    """
    Return what a figure of a part of a run needs.

    Parameters
    ----------
    run
        A run.
    window_s
        From when to when. [s]

    Returns
    -------
    RunTables
        All calls of the trains that are booked or under way then, samples and stops of that time.
    """
    start_s, end_s = window_s
    times_s = ["booked_arrival_s", "booked_departure_s", "arrival_s", "departure_s"]
    by_train = run.calls[times_s].agg(["min", "max"], axis=1).groupby(run.calls["train"])
    first_s, last_s = by_train["min"].min(), by_train["max"].max()
    seen = first_s.index[(first_s <= end_s) & (last_s >= start_s)]
    samples, stops = run.trajectory, run.interstation_stops
    ends_s = stops["start_s"] + stops["duration_s"]
    return replace(
        run,
        calls=run.calls[run.calls["train"].isin(seen)],
        trajectory=samples[samples["time_s"].between(start_s, end_s)],
        interstation_stops=stops[(stops["start_s"] <= end_s) & (ends_s >= start_s)],
    )
