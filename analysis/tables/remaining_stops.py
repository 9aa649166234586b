"""
Why trains stood between stations: each stop, followed back to the first cause.

A train stands for the train ahead. That one may itself stand, or creep, for another, or may have
stood for another on its way to the platform where it now makes its stop and no more. The chain ends
at a train that nobody holds up, mostly one that overstays at a platform, or beside the track.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pandas as pd

from kankaku.analysis.tables.columns import rows_frame
from kankaku.analysis.tables.delay import primary_delay_s
from kankaku.analysis.tables.interstation import long_stops
from kankaku.railway.arrays import IntArray
from kankaku.railway.step.records import REMAINING_STOPS, RunRecord
from kankaku.railway.step.state import NOTHING

AT_PLATFORM, BETWEEN, RUNNING, BESIDE = "at_platform", "between_stations", "running", "beside_track"
"""Where a cause is: at a platform, standing between two, on its way, or beside the track."""
AFTER_S = 1.0
"""Samples lie this far apart: the first one of a standstill may be so late. [s]"""
NEAR_SAMPLES = 5
"""In so many samples before it has come to a stand a train is slow for what it stands for. [-]"""


class _Cause(NamedTuple):
    """What a train stands for."""

    name: str
    row: int
    """Row of the train; -1 beside the track."""
    state: str
    call: int
    """The call that a train is at, or made last; -1 for none."""


class _Samples:
    """The trajectory of each train, to be asked for moments."""

    def __init__(self, record: RunRecord) -> None:
        seen = record.trajectory
        self._order = np.argsort(seen.row, kind="stable")
        self._ends = np.searchsorted(seen.row[self._order], np.arange(record.world.size + 1))
        self._time_s, self._cause = seen.time_s, seen.cause

    def _own(self, row: int) -> IntArray:
        return self._order[self._ends[row] : self._ends[row + 1]]

    def cause_at(self, row: int, time_s: float) -> int:
        """Return what a train was slow for at a moment, or shortly before: none while it stands."""
        own = self._own(row)
        until = int(np.searchsorted(self._time_s[own], time_s + AFTER_S, side="right"))
        near = self._cause[own[max(until - NEAR_SAMPLES, 0) : until]]
        known = near[near != NOTHING]
        return int(known[-1]) if known.size else NOTHING

    def slowed_from_s(self, row: int, between_s: tuple[float, float]) -> float:
        """Return when a train was first slow for something ahead; nan for never. [s]"""
        own = self._own(row)
        times_s = self._time_s[own]
        first = np.searchsorted(times_s, between_s[0]) if np.isfinite(between_s[0]) else 0
        part = slice(int(first), int(np.searchsorted(times_s, between_s[1], side="right")))
        slow = np.flatnonzero(self._cause[own[part]] != NOTHING)
        return float(times_s[part][slow[0]]) if slow.size else np.nan


class _Explainer:
    """Follows stops back to their causes."""

    def __init__(self, record: RunRecord) -> None:
        self._record, self._samples = record, _Samples(record)

    def row(self, stand: int) -> dict[str, object]:
        """Return the row of the table for a standstill."""
        record, stands = self._record, self._record.standstills
        row, start_s = int(stands.row[stand]), float(stands.start_s[stand])
        call = int(stands.next_call[stand])
        service = record.world.timetable.services[row]
        chain = list(self._chain(row, start_s))
        last_s = float(record.departure_s[row, call - 1]) if call > 0 else np.nan
        slowed_s = self._samples.slowed_from_s(row, (last_s, start_s))
        overstay = self._overstay(chain[-1]) if chain else _overstay_row(np.nan, np.nan, np.nan)
        began_s = overstay["overstay_began_s"]
        return {
            "train": service.train,
            "start_s": start_s,
            "duration_s": stands.duration_s[stand],
            "front_m": float(record.world.chainage_m(row, stands.front_m[stand])),
            "next_station": service.calls[call].station if call < len(service.calls) else "",
            **self._told("cause", chain[0] if chain else None),
            "links": max(len(chain) - 1, 0),
            **self._told("first_cause", chain[-1] if chain else None),
            **overstay,
            "departed_s": last_s,
            "slowed_s": slowed_s,
            "overstayed_at_departure_s": last_s - began_s,
            "overstayed_when_slowed_s": slowed_s - began_s,
        }

    def _chain(self, row: int, time_s: float) -> Iterator[_Cause]:
        """Yield what a train stands for, what that one was held up by, and so on."""
        seen = {row}
        while True:
            cause = self._cause(self._samples.cause_at(row, time_s), time_s)
            if cause is None or cause.row in seen:
                return
            yield cause
            seen.add(cause.row)
            since_s = self._held_up_s(cause, time_s)
            if since_s is None:
                return
            row, time_s = cause.row, since_s

    def _cause(self, number: int, time_s: float) -> _Cause | None:
        record = self._record
        if number == NOTHING:
            return None
        if number < NOTHING:
            return _Cause(record.trajectory.places[NOTHING - 1 - number], -1, BESIDE, -1)
        train = record.world.timetable.trains[number]
        arrived = np.flatnonzero(record.arrival_s[number] <= time_s)
        call = int(arrived[-1]) if arrived.size else -1
        if call >= 0 and not record.departure_s[number, call] <= time_s:
            return _Cause(train, number, AT_PLATFORM, call)
        stands = record.standstills
        ends_s = stands.start_s + stands.duration_s
        own = (stands.row == number) & (stands.start_s <= time_s) & (time_s < ends_s)
        return _Cause(train, number, BETWEEN if own.any() else RUNNING, call)

    def _held_up_s(self, cause: _Cause, time_s: float) -> float | None:
        """Return when a cause was itself held up by something else; None if it was not. [s]"""
        if cause.row < 0:
            return None
        stands = self._record.standstills
        own = (stands.row == cause.row) & (stands.start_s <= time_s)
        if cause.state == BETWEEN:
            return float(stands.start_s[own].max())
        if cause.call >= 0 and self._overstay(cause)["overstay_beyond_booked_s"] > 0.0:
            return None
        # It makes its stop, or runs on, as it should: was it late because it had to stand before?
        before = stands.start_s[own & (stands.next_call == cause.call)]
        if before.size:
            return float(before.max())
        return time_s if cause.state == RUNNING else None

    def _told(self, prefix: str, cause: _Cause | None) -> dict[str, object]:
        if cause is None:
            return {prefix: "", f"{prefix}_state": "", f"{prefix}_station": ""}
        station = ""
        if cause.call >= 0:
            calls = self._record.world.timetable.services[cause.row].calls
            station = calls[cause.call].station
        return {
            prefix: cause.name,
            f"{prefix}_state": cause.state,
            f"{prefix}_station": station,
        }

    def _overstay(self, cause: _Cause) -> dict[str, float]:
        if cause.call < 0:
            return _overstay_row(np.nan, np.nan, np.nan)
        at = cause.row, cause.call
        world, drawn_s = self._record.world, self._record.dwell_delay_s[at]
        booked_s = world.booked_arrival_s[at], world.booked_departure_s[at]
        minimum_s = world.minimum_dwell_s[at]
        beyond_s = primary_delay_s(*booked_s, minimum_s, drawn_s)
        might_leave_s = max(booked_s[1], self._record.arrival_s[at] + minimum_s)
        return _overstay_row(float(drawn_s), float(beyond_s), float(might_leave_s))


def _overstay_row(overstay_s: float, beyond_booked_s: float, began_s: float) -> dict[str, float]:
    return {
        "overstay_s": overstay_s,
        "overstay_beyond_booked_s": beyond_booked_s,
        "overstay_began_s": began_s,
    }


def remaining_stops_frame(record: RunRecord) -> pd.DataFrame:
    """
    Return why trains stood between stations.

    Parameters
    ----------
    record
        What the run left behind.

    Returns
    -------
    pd.DataFrame
        Table ``remaining_stops``: the rows of ``interstation_stops``, each with its cause when it
        began, the first cause behind that one, and how long that one had overstayed by then.
    """
    explainer = _Explainer(record)
    rows = (explainer.row(stand) for stand in long_stops(record.standstills).tolist())
    return rows_frame(rows, REMAINING_STOPS)
