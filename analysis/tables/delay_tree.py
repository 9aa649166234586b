"""
Who delayed whom: the delay of every train, followed back to the primary delays that it comes from.

Each train has an account of its lateness by origin. At a departure its own overstay enters it, as
far as the booked dwell did not absorb it. At an arrival the account is set to what the table
``calls`` tells: the part of the train's own unhindered run and the secondary delay. Where the
latter has grown on a leg, the trains for which the train was slow there share in what it has lost,
each by the seconds of it, and hand on their own lateness by its origins; where a part has shrunk,
all its origins shrink alike. So the shares of every call sum up to the figures of the table.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import NamedTuple, TypeAlias

import numpy as np
import pandas as pd

from kankaku.analysis.tables.causes import NO_CALL, Seen
from kankaku.analysis.tables.columns import rows_frame, rows_of
from kankaku.railway.step.records import Column

OVERSTAY, OWN_RUN, IN_THE_WAY, UNKNOWN = "overstay", "own_run", "in_the_way", "unknown"
"""Kinds of origins: see the column ``origin_kind``."""
LEAST_S = 0.5
"""Who is less late than this hands no lateness on: it was in the way by being there. [s]"""
_ORIGIN = (
    Column("origin_train", "str", "", "train or place that the delay comes from; empty: unknown"),
    Column("origin_station", "str", "", "where it overstayed; empty for other origins"),
    Column(
        "origin_kind",
        "str",
        "",
        "overstay; own_run: late by its own timetable, driving or stock; in_the_way: in time "
        "itself, or beside the track; unknown",
    ),
)
DELAY_SHARES = (
    Column("train", "str", "", "train number"),
    Column("sequence", "int64", "", "number of the call along the trip, from 0"),
    Column("station", "str", "", "station identifier"),
    *_ORIGIN,
    Column("secondary", "bool", "", "a part of the secondary delay; else of the unhindered run's"),
    Column("share_s", "float64", "s", "part of the lateness on arrival that comes from there"),
)
DELAY_EDGES = (
    *_ORIGIN,
    Column("by", "str", "", "train or place that was ahead and handed it on"),
    Column("train", "str", "", "train that lost time"),
    Column("station", "str", "", "where it arrived after it had lost it"),
    Column("time_s", "float64", "s", "when, seconds after midnight", clock=True),
    Column("lost_s", "float64", "s", "growth of its secondary delay"),
)


class Origin(NamedTuple):
    """What a delay comes from."""

    train: str
    call: int
    kind: str


_Part: TypeAlias = dict[Origin, float]
"""Seconds of lateness by origin."""


class _Account:
    """Lateness of one train by origin: of its unhindered run, and owed to others."""

    def __init__(self) -> None:
        self.own: _Part = {}
        self.others: _Part = {}

    def told(self) -> dict[Origin, float]:
        """Return both parts together; empty where the train is hardly late."""
        both = dict(self.own)
        for origin, share_s in self.others.items():
            _add(both, origin, share_s)
        return both if sum(both.values()) >= LEAST_S else {}


def _add(part: _Part, origin: Origin, share_s: float) -> None:
    part[origin] = part.get(origin, 0.0) + share_s


def _shrink(part: _Part, total_s: float) -> float:
    """Let a part shrink to a total; return what it lacks instead. [s]"""
    held_s = sum(part.values())
    if held_s <= total_s:
        return total_s - held_s
    for origin in part:
        part[origin] *= total_s / held_s
    return 0.0


class _Book:
    """The accounts of all trains of a run, and what was handed on."""

    def __init__(self, seen: Seen) -> None:
        self._seen = seen
        self._account = {train: _Account() for train in seen.trains}
        self._calls = {train: rows_of(seen.calls(train)) for train in seen.trains}
        self.shares: list[dict[str, object]] = []
        self.edges: list[dict[str, object]] = []

    def keep(self) -> None:
        """Go through all arrivals and departures by time."""
        for _, arrives, train, call in sorted(self._events()):
            (self._arrive if arrives else self._depart)(train, call)

    def _events(self) -> Iterator[tuple[float, bool, str, int]]:
        for train, calls in self._calls.items():
            for number, call in enumerate(calls):
                if np.isfinite(call["departure_s"]):
                    yield call["departure_s"], False, train, number
                if np.isfinite(call["arrival_s"]):
                    yield call["arrival_s"], True, train, number
                elif np.isfinite(call["secondary_delay_s"]):
                    # Never reached: what was known when the run ended, after everything else.
                    yield np.inf, True, train, number

    def _depart(self, train: str, number: int) -> None:
        call = self._calls[train][number]
        if call["primary_delay_s"] > 0.0:
            _add(
                self._account[train].own,
                Origin(train, number, OVERSTAY),
                call["primary_delay_s"],
            )

    def _arrive(self, train: str, number: int) -> None:
        call, account = self._calls[train][number], self._account[train]
        late_s = max(call["unhindered_arrival_s"] - call["booked_arrival_s"], 0.0)
        lacks_s = _shrink(account.own, late_s)
        if lacks_s > 0.0:
            _add(account.own, Origin(train, NO_CALL, OWN_RUN), lacks_s)
        lost_s = _shrink(account.others, max(call["secondary_delay_s"], 0.0))
        if lost_s > 0.0:
            self._lose(train, number, lost_s)
        for secondary, part in ((False, account.own), (True, account.others)):
            for origin, share_s in part.items():
                if share_s > 0.0:
                    self.shares.append(
                        {
                            "train": train,
                            "sequence": call["sequence"],
                            "station": call["station"],
                            **self._told(origin),
                            "secondary": secondary,
                            "share_s": share_s,
                        }
                    )

    def _lose(self, train: str, number: int, lost_s: float) -> None:
        call, account = self._calls[train][number], self._account[train]
        slow_s = self._slow_for(train, number)
        total_s = sum(slow_s.values())
        for name, seconds_s in slow_s.items():
            part_s = lost_s * seconds_s / total_s
            for origin, share in self._origins(name, part_s):
                _add(account.others, origin, share)
                self.edges.append(
                    {
                        **self._told(origin),
                        "by": name,
                        "train": train,
                        "station": call["station"],
                        "time_s": call["arrival_s"],
                        "lost_s": share,
                    }
                )

    def _slow_for(self, train: str, number: int) -> Mapping[str, float]:
        """Return for whom a train was slow since the call before, and for how long. [s]"""
        calls, own = self._calls[train], self._seen.samples(train)
        until_s = calls[number]["arrival_s"]
        since_s = calls[number - 1]["arrival_s"] if number else -np.inf
        until_s = until_s if np.isfinite(until_s) else np.inf
        part = slice(*np.searchsorted(own["time_s"], (since_s, until_s)).tolist())
        names = Counter(str(name) for name in own["cause"][part] if name)
        return {name: float(many) for name, many in names.items()} or {"": 1.0}

    def _origins(self, name: str, part_s: float) -> Iterator[tuple[Origin, float]]:
        held = self._account[name].told() if name in self._account else {}
        total_s = sum(held.values())
        for origin, share_s in held.items():
            if share_s > 0.0:
                yield origin, part_s * share_s / total_s
        if not held:
            yield Origin(name, NO_CALL, IN_THE_WAY if name else UNKNOWN), part_s

    def _told(self, origin: Origin) -> dict[str, object]:
        known = origin.call != NO_CALL
        return {
            "origin_train": origin.train,
            "origin_station": self._calls[origin.train][origin.call]["station"] if known else "",
            "origin_kind": origin.kind,
        }


class DelayTree(NamedTuple):
    """Whence delays come and how they went from train to train."""

    shares: pd.DataFrame
    """Columns ``DELAY_SHARES``: at every call the origins of a train's lateness."""
    edges: pd.DataFrame
    """Columns ``DELAY_EDGES``: by time, who handed what on to whom."""


class Branch(NamedTuple):
    """A train in the tree of one origin."""

    train: str
    by: str
    """Who handed the delay on to it first; empty for the origin itself."""
    depth: int
    """How many trains lie between it and the origin, itself included. [-]"""
    time_s: float
    """When that was; nan for the origin itself. [s]"""
    lost_s: float
    """What it has lost from this origin in all. [s]"""


def delay_tree(seen: Seen) -> DelayTree:
    """
    Return whence the delays of a run come.

    Parameters
    ----------
    seen
        The run.

    Returns
    -------
    DelayTree
        The shares of a call sum up to its lateness: to ``secondary_delay_s`` where they are
        secondary, to that of the unhindered run otherwise, each not below 0.
    """
    book = _Book(seen)
    book.keep()
    return DelayTree(rows_frame(book.shares, DELAY_SHARES), rows_frame(book.edges, DELAY_EDGES))


def branches(tree: DelayTree, origin_train: str, origin_station: str) -> list[Branch]:
    """
    Return which trains a primary delay reached, and by which way.

    Parameters
    ----------
    tree
        What :func:`delay_tree` returned.
    origin_train, origin_station
        Who overstayed, and where; or another origin, without a station.

    Returns
    -------
    list[Branch]
        The origin first, then the others in the order in which it reached them. Each hangs on the
        train that handed it on first.
    """
    own = tree.edges[
        (tree.edges["origin_train"] == origin_train)
        & (tree.edges["origin_station"] == origin_station)
    ]
    found = {origin_train: Branch(origin_train, "", 0, np.nan, 0.0)}
    for edge in rows_of(own):
        train, lost_s = edge["train"], edge["lost_s"]
        if train in found:
            before = found[train]
            found[train] = before._replace(lost_s=before.lost_s + lost_s)
        else:
            depth = found[edge["by"]].depth + 1 if edge["by"] in found else 1
            found[train] = Branch(train, edge["by"], depth, edge["time_s"], lost_s)
    return list(found.values())


def origins(tree: DelayTree) -> pd.DataFrame:
    """
    Return what every origin cost others.

    Parameters
    ----------
    tree
        What :func:`delay_tree` returned.

    Returns
    -------
    pd.DataFrame
        The three columns of an origin, ``trains`` that lost time by it, and ``lost_s``, the time
        that they lost in all [s]; the costliest first.
    """
    keys = [column.name for column in _ORIGIN]
    grouped = tree.edges.groupby(keys, sort=True)
    costs = grouped.agg(trains=("train", "nunique"), lost_s=("lost_s", "sum")).reset_index()
    return costs.sort_values("lost_s", ascending=False, kind="stable", ignore_index=True)
