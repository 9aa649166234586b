"""Stops between stations: how long, how many, how many trains, and where they crawl."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from kankaku.analysis.tables.columns import typed_frame
from kankaku.railway.arrays import IntArray
from kankaku.railway.step.records import INTERSTATION_STOPS, RunRecord, Standstills

SHORTEST_STOP_S = 1.0
"""A standstill shorter than this is not a stop. [s]"""
_CLOCK_NOISE_S = 1e-6


class StopTotals(NamedTuple):
    """Stops between stations in one run."""

    time_s: float
    stops: int
    trains: int


def long_stops(stands: Standstills) -> IntArray:
    """
    Return which standstills count as stops.

    Parameters
    ----------
    stands
        Of running trains.

    Returns
    -------
    IntArray
        Those of ``SHORTEST_STOP_S`` or more, in order of their start, then of the trains.
        shape (n_stops,)
    """
    # A duration is a number of steps times the step: never exactly a second.
    long = np.flatnonzero(stands.duration_s >= SHORTEST_STOP_S - _CLOCK_NOISE_S)
    return long[np.lexsort((stands.row[long], stands.start_s[long]))]


def stops_frame(record: RunRecord) -> pd.DataFrame:
    """
    Return the stops between stations.

    Parameters
    ----------
    record
        What the run left behind.

    Returns
    -------
    pd.DataFrame
        Table ``interstation_stops``, in the order of :func:`long_stops`.
    """
    stands = record.standstills
    kept = long_stops(stands)
    rows = stands.row[kept].tolist()
    services = record.world.timetable.services
    towards = [
        services[row].calls[call].station if call < len(services[row].calls) else ""
        for row, call in zip(rows, stands.next_call[kept].tolist(), strict=True)
    ]
    return typed_frame(
        {
            "train": [services[row].train for row in rows],
            "start_s": stands.start_s[kept],
            "duration_s": stands.duration_s[kept],
            "front_m": record.world.chainage_m(stands.row[kept], stands.front_m[kept]),
            "next_station": towards,
        },
        INTERSTATION_STOPS,
    )


def stop_totals(stops: pd.DataFrame) -> StopTotals:
    """
    Return time, count and trains of the stops.

    Parameters
    ----------
    stops
        The table ``interstation_stops`` of one run.

    Returns
    -------
    StopTotals
        Sums over the run.
    """
    return StopTotals(
        time_s=float(stops["duration_s"].sum()),
        stops=len(stops),
        trains=int(stops["train"].nunique()),
    )
