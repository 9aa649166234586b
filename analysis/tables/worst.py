"""The moment of a run that is most worth looking at."""

from typing import NamedTuple

import numpy as np

from kankaku.analysis.tables.columns import rows_of
from kankaku.analysis.tables.run_tables import RunTables


class Worst(NamedTuple):
    """The worst moment of a run."""

    train: str
    station: str
    """The station that the train was running to."""
    start_s: float
    end_s: float
    what: str
    """What happened, in words."""


def worst_moment(run: RunTables) -> Worst | None:
    """
    Return the longest stop between stations, else the largest growth of secondary delay.

    Parameters
    ----------
    run
        A run, usually of the baseline.

    Returns
    -------
    Worst | None
        Train, place and time; None if no train arrived anywhere.
    """
    stops = run.interstation_stops
    if len(stops):
        stop = rows_of(stops)[int(stops["duration_s"].to_numpy().argmax())]
        start_s, duration_s = float(stop["start_s"]), float(stop["duration_s"])
        what = f"stands {duration_s:.0f} s between stations"
        return Worst(stop["train"], stop["next_station"], start_s, start_s + duration_s, what)
    calls = run.calls[run.calls["arrival_s"].notna()]
    growth_s = calls.groupby("train", sort=False)["secondary_delay_s"].diff()
    if not growth_s.notna().any():
        return None
    call = rows_of(calls)[int(np.nanargmax(growth_s))]
    arrival_s, grown_s = float(call["arrival_s"]), float(growth_s.max())
    what = f"loses {grown_s:.0f} s to trains ahead" if grown_s >= 0.5 else "is never hindered"
    return Worst(call["train"], call["station"], arrival_s - 60.0, arrival_s, what)
