"""What there is to tell of a train at a moment: where it was, what bound it, why, and its cost."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from kankaku.analysis.tables.causes import NO_CALL, CauseLink, Sample, Seen, Stand
from kankaku.analysis.tables.columns import rows_frame, rows_of
from kankaku.analysis.tables.delay_tree import DelayTree
from kankaku.analysis.tables.remaining_stops import AT_PLATFORM, BETWEEN, RUNNING
from kankaku.analysis.words import KMH_PER_MPS
from kankaku.railway.step.records import Column

NOT_ON_LINE = "not_on_line"
RECENT_S = 120.0
"""What slowed a train longer ago than this is not why it is slow. [s]"""
BEHIND = " < "
"""Stands in the column ``chain`` between a train and who was ahead of it."""
EXPLANATIONS = (
    Column("controller", "str", "", "name of the controller"),
    Column("seed", "int64", "", "seed of the run"),
    Column("train", "str", "", "train number"),
    Column("time_s", "float64", "s", "the moment, seconds after midnight", clock=True),
    Column("state", "str", "", "at_platform, between_stations (at a stand), running, not_on_line"),
    Column("front_m", "float64", "m", "chainage of the front; empty if not on the line"),
    Column("speed_kmh", "float64", "km/h", "speed"),
    Column("station", "str", "", "where it is, or else runs to"),
    Column("reason", "str", "", "what bound its speed, as in the table trajectory"),
    Column("plan", "str", "", "the operation's own word for its plan; empty for other reasons"),
    Column("cause", "str", "", "train or place ahead for which it was so; empty for none"),
    Column("cause_state", "str", "", "where that one was, as in the table remaining_stops"),
    Column("cause_station", "str", "", "where it was, or had stopped last"),
    Column("next_train", "str", "", "train that was next ahead on its way, whatever bound it"),
    Column("next_train_m", "float64", "m", "from front to front"),
    Column("limit_m", "float64", "m", "end of authority, or far ahead"),
    Column(
        "since_s", "float64", "s", "since when it was slow for that; empty for nothing", clock=True
    ),
    Column("chain", "str", "", "who was ahead of whom, nearest first, after < the next one"),
    Column("origin_train", "str", "", "where most of its lateness there comes from"),
    Column("origin_station", "str", "", "where that one overstayed; empty for other origins"),
    Column("origin_s", "float64", "s", "how much of its lateness comes from there"),
    Column("stood_s", "float64", "s", "stood between stations on its way there"),
    Column("lost_s", "float64", "s", "by how much its secondary delay grew on the way there"),
    Column("arrival_delay_s", "float64", "s", "its delay there; empty if never reached"),
)


class Share(NamedTuple):
    """A part of a train's lateness at a call, and where it comes from."""

    train: str
    station: str
    kind: str
    share_s: float
    secondary: bool


class Explained(NamedTuple):
    """One train at one moment under one controller."""

    controller: str
    seed: int
    train: str
    time_s: float
    state: str
    """As in the table ``remaining_stops``, or ``not_on_line``."""
    sample: Sample | None
    """None if it is not on the line."""
    on_line_s: tuple[float, float]
    """From when to when it is; nan if it never is. [s]"""
    last: Mapping[str, Any] | None
    """The call that it is at, or made last; a row of ``calls``."""
    ahead: Mapping[str, Any] | None
    """The call that it runs to; at a platform the same as ``last``."""
    stand: Stand | None
    """The stop between stations that it is making."""
    since_s: float
    """Since when it is slow for its cause; nan for nothing. [s]"""
    before: Sample | None
    """When it was last slow for something ahead on this leg, if it is not now; None for never."""
    next_train: tuple[str, float] | None
    """Who was next ahead on its way, and how far from front to front [m]; None for nobody."""
    chain: tuple[CauseLink, ...]
    shares: tuple[Share, ...]
    """Of its lateness at ``ahead``, the largest first."""
    stood_s: float
    """Stops between stations on the leg to ``ahead``, together. [s]"""
    lost_s: float
    """Growth of its secondary delay on that leg; nan if it was not reached. [s]"""

    @property
    def row(self) -> dict[str, object]:
        """A row of ``EXPLANATIONS``."""
        sample, near = self.sample, self.chain[0] if self.chain else None
        first = self.shares[0] if self.shares else None
        ahead = self.ahead or {}
        return {
            "controller": self.controller,
            "seed": self.seed,
            "train": self.train,
            "time_s": self.time_s,
            "state": self.state,
            "front_m": sample.front_m if sample else np.nan,
            "speed_kmh": KMH_PER_MPS * sample.speed_mps if sample else np.nan,
            "station": ahead.get("station", ""),
            "reason": sample.reason if sample else "",
            "plan": sample.plan if sample else "",
            "cause": near.name if near else "",
            "cause_state": near.state if near else "",
            "cause_station": near.station if near else "",
            "next_train": self.next_train[0] if self.next_train else "",
            "next_train_m": self.next_train[1] if self.next_train else np.nan,
            "limit_m": sample.limit_m if sample else np.nan,
            "since_s": self.since_s,
            "chain": BEHIND.join(link.name for link in self.chain),
            "origin_train": first.train if first else "",
            "origin_station": first.station if first else "",
            "origin_s": first.share_s if first else np.nan,
            "stood_s": self.stood_s,
            "lost_s": self.lost_s,
            "arrival_delay_s": ahead.get("arrival_delay_s", np.nan),
        }


def explained(seen: Seen, tree: DelayTree, train: str, time_s: float) -> Explained:
    """
    Return what there is to tell of a train at a moment.

    Parameters
    ----------
    seen
        The run.
    tree
        Whence its delays come.
    train
        Train number.
    time_s
        The moment. [s]

    Returns
    -------
    Explained
        Everything by the tables of the run.
    """
    sample, at = seen.sample(train, time_s), seen.call_at(train, time_s)
    times_s = seen.samples(train)["time_s"]
    on_line_s = (float(times_s[0]), float(times_s[-1])) if times_s.size else (np.nan, np.nan)
    calls = rows_of(seen.calls(train))
    last = calls[at] if at != NO_CALL else None
    stand = seen.stand(train, time_s)
    stays = last is not None and not last["departure_s"] <= time_s
    number = at if stays else at + 1
    ahead = calls[number] if number < len(calls) else None
    if sample is None:
        state, ahead = NOT_ON_LINE, None
    else:
        state = AT_PLATFORM if stays else (BETWEEN if stand else RUNNING)
    # Who runs freely again may have been slow a moment ago; who stands has reasons of before.
    since_s = time_s
    if sample is not None and state == BETWEEN and stand and not sample.cause:
        since_s = stand.start_s
    bound = sample is not None and (state == BETWEEN or sample.cause != "")
    before = calls[number - 1] if 0 < number <= len(calls) else None
    return Explained(
        controller=seen.run.controller,
        seed=seen.run.seed,
        train=train,
        time_s=time_s,
        state=state,
        sample=sample,
        on_line_s=on_line_s,
        last=last,
        ahead=ahead,
        stand=stand if sample else None,
        since_s=seen.bound_since_s(train, time_s) if sample else np.nan,
        before=_before(seen, train, time_s, last) if sample and not bound and not stays else None,
        next_train=seen.next_ahead(train, time_s),
        chain=tuple(seen.chain(train, since_s)) if bound else (),
        shares=_shares(tree, train, ahead),
        stood_s=_stood_s(seen, train, number - 1) if ahead else np.nan,
        lost_s=_lost_s(before, ahead),
    )


def explanations_frame(found: Iterable[Explained]) -> pd.DataFrame:
    """
    Return explanations as a table.

    Parameters
    ----------
    found
        One for each controller.

    Returns
    -------
    pd.DataFrame
        Columns ``EXPLANATIONS``.
    """
    return rows_frame((one.row for one in found), EXPLANATIONS)


def _shares(tree: DelayTree, train: str, ahead: Mapping[str, Any] | None) -> tuple[Share, ...]:
    if ahead is None:
        return ()
    own = tree.shares[
        (tree.shares["train"] == train) & (tree.shares["sequence"] == ahead["sequence"])
    ]
    found = [
        Share(
            row["origin_train"],
            row["origin_station"],
            row["origin_kind"],
            row["share_s"],
            row["secondary"],
        )
        for row in rows_of(own)
    ]
    return tuple(sorted(found, key=lambda share: -share.share_s))


def _before(seen: Seen, train: str, time_s: float, last: Mapping[str, Any] | None) -> Sample | None:
    departed_s = last["departure_s"] if last else -np.inf
    return seen.slowed_before(train, time_s, max(departed_s, time_s - RECENT_S))


def _stood_s(seen: Seen, train: str, call: int) -> float:
    """Return how long a train stood after a call and before the next one. [s]"""
    stands = seen.stands(train)
    return sum(one.duration_s for one in stands if seen.call_at(train, one.start_s) == call)


def _lost_s(before: Mapping[str, Any] | None, ahead: Mapping[str, Any] | None) -> float:
    if ahead is None:
        return np.nan
    owed_s = max(ahead["secondary_delay_s"], 0.0)
    return float(owed_s - max(before["secondary_delay_s"], 0.0)) if before else float(owed_s)
