"""Time-distance tables with the columns of railsim, the railway engine of MATSim."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from kankaku.analysis.tables.causes import Seen
from kankaku.analysis.tables.columns import rows_of
from kankaku.analysis.tables.run_tables import DWELLING, RunTables

RAILSIM_COLUMNS = (
    "vehicle_id",
    "line_id",
    "route_id",
    "departure_id",
    "time",
    "distance",
    "type",
    "link_id",
    "stop_id",
)
TARGET, SIMULATED = "target", "simulated"
DECIMALS = 3


def railsim_frame(run: RunTables, line: str) -> pd.DataFrame:
    """
    Return where trains were to be, and where they were, as railsim writes it.

    Parameters
    ----------
    run
        A run with its trajectory.
    line
        What its line is called.

    Returns
    -------
    pd.DataFrame
        Columns ``RAILSIM_COLUMNS``, texts and numbers: seconds after midnight, and metres from a
        train's first place. Train by train, first ``target``, a row for each booked arrival and
        departure, then ``simulated``, a row for each sample.

    References
    ----------
    .. [1] MATSim, contrib railsim, *Time-Distance Chart*: the file ``railsimTimeDistance.csv``.
    """
    seen = Seen(run)
    parts = [part for train in seen.trains for part in _parts(seen, train, line)]
    if not parts:
        return pd.DataFrame(columns=list(RAILSIM_COLUMNS))
    return pd.concat(parts, ignore_index=True)[list(RAILSIM_COLUMNS)]


def _parts(seen: Seen, train: str, line: str) -> Iterator[pd.DataFrame]:
    calls, own = seen.calls(train), seen.samples(train)
    route = f"{calls['station'].iloc[0]}-{calls['station'].iloc[-1]}"
    identity = {"vehicle_id": train, "line_id": line, "route_id": route, "departure_id": train}
    stops_m = calls["stop_m"].to_numpy()
    start_m = float(own["front_m"][0]) if own["front_m"].size else float(stops_m[0])
    booked_s = calls[["booked_arrival_s", "booked_departure_s"]].to_numpy().ravel()
    yield pd.DataFrame(
        {
            **identity,
            "time": np.round(booked_s, DECIMALS),
            "distance": np.round(np.abs(np.repeat(stops_m, 2) - start_m), DECIMALS),
            "type": TARGET,
            "link_id": np.repeat(calls["track"].to_numpy(), 2),
            "stop_id": np.repeat(calls["station"].to_numpy(), 2),
        }
    )
    if not own["time_s"].size:
        return
    yield pd.DataFrame(
        {
            **identity,
            "time": np.round(own["time_s"], DECIMALS),
            "distance": np.round(np.abs(own["front_m"] - start_m), DECIMALS),
            "type": SIMULATED,
            "link_id": own["track"],
            "stop_id": _stations(calls, own["time_s"], own["reason"] == DWELLING),
        }
    )


def _stations(calls: pd.DataFrame, times_s: np.ndarray, dwelling: np.ndarray) -> np.ndarray:
    """Return the station at which a train dwells at each sample; empty elsewhere."""
    found = np.full(times_s.size, "", dtype=object)
    for call in rows_of(calls):
        departure_s = call["departure_s"] if np.isfinite(call["departure_s"]) else np.inf
        there = (times_s >= call["arrival_s"]) & (times_s <= departure_s)
        found[there & dwelling] = call["station"]
    return found
