"""Which controller is better in what: marks of every comparison, and the verdict of a study."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from kankaku.analysis.tables.across_tables import DELAY, ENERGY, STOPS
from kankaku.analysis.tables.columns import rows_of
from kankaku.analysis.tables.compare import comparison
from kankaku.analysis.tables.indicators import INDICATOR_OF

NOTICED = 0.01
"""A change counts from this share of the baseline's mean on. [-]"""


class Mark(StrEnum):
    """How a controller does beside the baseline."""

    BETTER = "better"
    WORSE = "worse"
    ALIKE = "alike"
    """The change is too small to count, or its interval holds 0."""
    NONE = ""
    """The baseline itself, what has no value, and what is neither good nor bad."""


class Change(NamedTuple):
    """One indicator of a controller beside the baseline's."""

    indicator: str
    mean: float
    """In the indicator's unit"""
    difference: float
    """Same unit; not a number without a baseline."""
    confidence_95: float
    """Half width of its interval; not a number for a single pair. Same unit"""
    change_pct: float
    """Not a number where per cents mislead. [%]"""
    mark: Mark


class Leader(NamedTuple):
    """A controller that does best in something, and what it does to the rest."""

    controller: str
    changes: Mapping[str, Change]
    """By indicator: stop time, delay and energy."""


class Verdict(NamedTuple):
    """What a study comes to."""

    baseline: str
    controllers: int
    competing: tuple[str, ...]
    """Safe, finished, and without knowledge of the future."""
    stops: Leader | None
    """Stands least between stations; None where nobody competes."""
    delay: Leader | None
    energy: Leader | None
    most_stops: Leader | None
    """Stands most of those who compete."""
    unsafe: tuple[str, ...]
    """Violated a safety rule."""
    unfinished: tuple[str, ...]
    """Left trains under way, yet safe."""


def mark_of(cell: Mapping[str, Any]) -> Mark:
    """
    Return how a controller does in one indicator beside the baseline.

    Parameters
    ----------
    cell
        A row of the table of :func:`kankaku.analysis.tables.compare.comparison`.

    Returns
    -------
    Mark
        Of a change below ``NOTICED`` of the baseline's mean, or of the least mean that per cents
        are told of, if that is more, it is alike; so it is if the interval of the change holds 0.
    """
    indicator = INDICATOR_OF.get(cell["indicator"])
    difference = cell["difference"]
    if indicator is None or not indicator.sense or np.isnan(difference):
        return Mark.NONE
    reference = abs(cell["mean"] - difference)
    half = 0.0 if np.isnan(cell["confidence_95"]) else cell["confidence_95"]
    if abs(difference) <= max(half, NOTICED * max(reference, indicator.per_cent_above)):
        return Mark.ALIKE
    return Mark.BETTER if difference * indicator.sense > 0.0 else Mark.WORSE


def marked(compared: pd.DataFrame, competing: Collection[str]) -> list[dict[str, Any]]:
    """
    Return a comparison with marks.

    Parameters
    ----------
    compared
        What :func:`kankaku.analysis.tables.compare.comparison` returned.
    competing
        Controllers that may be best, as :func:`competing_controllers` returned.

    Returns
    -------
    list[dict[str, Any]]
        Its rows with ``mark``, a :class:`Mark`, and ``best``: no competing controller does better
        in that indicator. The baseline has no mark.
    """
    rows = rows_of(compared)
    if not rows:
        return []
    best: dict[str, float] = {}
    for row in rows:
        sense = INDICATOR_OF[row["indicator"]].sense if row["indicator"] in INDICATOR_OF else 0
        if sense and row["controller"] in competing and np.isfinite(row["mean"]):
            known = best.get(row["indicator"], -np.inf)
            best[row["indicator"]] = max(known, sense * row["mean"])
    baseline = rows[0]["controller"]
    for row in rows:
        row["mark"] = Mark.NONE if row["controller"] == baseline else mark_of(row)
        sense = INDICATOR_OF[row["indicator"]].sense if row["indicator"] in INDICATOR_OF else 0
        reached = best.get(row["indicator"], np.nan)
        row["best"] = bool(row["controller"] in competing and sense * row["mean"] == reached)
    return rows


def competing_controllers(summary: pd.DataFrame, knows_future: Collection[str]) -> list[str]:
    """
    Return the controllers that can be recommended.

    Parameters
    ----------
    summary
        The table ``summary``.
    knows_future
        Those that are told the drawn dwell delays.

    Returns
    -------
    list[str]
        In the order of the summary: no safety rule was violated, every train finished, and nobody
        told them the future.
    """
    runs = summary.groupby("controller", sort=False)
    sums = runs[["violations", "trains", "trains_completed"]].sum()
    good = (sums["violations"] == 0) & (sums["trains"] == sums["trains_completed"])
    return [str(name) for name in sums.index[good] if name not in knows_future]


def verdict(summary: pd.DataFrame, knows_future: Collection[str] = ()) -> Verdict:
    """
    Return what a study comes to: who is best in stops, delay and energy, and what it costs.

    Parameters
    ----------
    summary
        The table ``summary``, baseline first.
    knows_future
        Controllers that are told the drawn dwell delays; they are compared with nobody.

    Returns
    -------
    Verdict
        The best by the means over runs; of equal ones the first.

    Raises
    ------
    ValueError
        If the summary has no row.
    """
    if summary.empty:
        msg = "no verdict: the summary has no run"
        raise ValueError(msg)
    names = list(dict.fromkeys(summary["controller"].astype(str)))
    competing = competing_controllers(summary, knows_future)
    of = _changes(comparison(summary, [STOPS, DELAY, ENERGY]), names[0])
    return Verdict(
        baseline=names[0],
        controllers=len(names),
        competing=tuple(competing),
        stops=_least(of, competing, STOPS),
        delay=_least(of, competing, DELAY),
        energy=_least(of, competing, ENERGY),
        most_stops=_least(of, competing, STOPS, sign=-1.0),
        unsafe=tuple(_with(summary, summary["violations"] > 0)),
        unfinished=tuple(
            _with(
                summary,
                (summary["violations"] == 0) & (summary["trains_completed"] < summary["trains"]),
            )
        ),
    )


def _with(summary: pd.DataFrame, rows: "pd.Series[bool]") -> Iterable[str]:
    return dict.fromkeys(summary["controller"][rows].astype(str))


def _changes(compared: pd.DataFrame, baseline: str) -> dict[str, dict[str, Change]]:
    found: dict[str, dict[str, Change]] = {}
    for row in rows_of(compared):
        own = found.setdefault(row["controller"], {})
        own[row["indicator"]] = Change(
            row["indicator"],
            row["mean"],
            row["difference"],
            row["confidence_95"],
            row["change_pct"],
            Mark.NONE if row["controller"] == baseline else mark_of(row),
        )
    return found


def _least(
    of: Mapping[str, Mapping[str, Change]],
    competing: Sequence[str],
    indicator: str,
    *,
    sign: float = 1.0,
) -> Leader | None:
    known = [name for name in competing if np.isfinite(of[name][indicator].mean)]
    if not known:
        return None
    name = min(known, key=lambda one: sign * of[one][indicator].mean)
    return Leader(name, of[name])
