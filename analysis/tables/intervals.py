"""Departure-to-arrival intervals (発着時隔) at platform tracks."""

import pandas as pd

from kankaku.analysis.tables.columns import typed_frame
from kankaku.railway.step.records import Column

INTERVALS = (
    Column("station", "str", "", "station identifier"),
    Column("track", "str", "", "platform track"),
    Column("leader", "str", "", "train that used the platform track before"),
    Column("follower", "str", "", "train that arrived next at the same platform track"),
    Column("arrival_s", "float64", "s", "the follower's arrival, seconds after midnight"),
    Column("interval_s", "float64", "s", "leader's departure to follower's arrival"),
    Column("booked_interval_s", "float64", "s", "the same by the timetable"),
)


def departure_arrival_intervals(calls: pd.DataFrame) -> pd.DataFrame:
    """
    Return the interval from each leader's departure to its follower's arrival.

    Parameters
    ----------
    calls
        The table ``calls`` of one run.

    Returns
    -------
    pd.DataFrame
        Columns ``INTERVALS``, one row per arrival on a platform track after another train.
        Trains that start at a station do not arrive there, so they only lead.
    """
    reached = calls.dropna(subset=["arrival_s"]).sort_values("arrival_s", kind="stable")
    platform = reached.groupby(["station", "track"], sort=False)
    before = platform[["train", "departure_s", "booked_departure_s"]].shift()
    follows = before["departure_s"].notna() & (reached["sequence"] > 0)
    after, before = reached[follows], before[follows]
    return typed_frame(
        {
            "station": after["station"].to_numpy(),
            "track": after["track"].to_numpy(),
            "leader": before["train"].to_numpy(),
            "follower": after["train"].to_numpy(),
            "arrival_s": after["arrival_s"].to_numpy(),
            "interval_s": (after["arrival_s"] - before["departure_s"]).to_numpy(),
            "booked_interval_s": (
                after["booked_arrival_s"] - before["booked_departure_s"]
            ).to_numpy(),
        },
        INTERVALS,
    )
