"""
A sweep: the interval behind one train against its initial delay, controller by controller.

The swept train overstays at one station by each of the delays in turn. What is measured is the
departure-to-arrival interval there: from its departure to the arrival of the next train at the
same platform track.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from kankaku.analysis.tables.columns import read_csv, rows_frame, rows_of
from kankaku.analysis.tables.intervals import departure_arrival_intervals
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.scenario import Published, Sweep
from kankaku.railway.step.records import Column

SWEPT_INTERVALS = (
    Column("controller", "str", "", "name of the controller"),
    Column("initial_delay_s", "float64", "s", "by how much the swept train overstays"),
    Column("interval_s", "float64", "s", "its departure to the next train's arrival; empty: never"),
)
MEASURED = (
    *SWEPT_INTERVALS,
    Column("arrival_s", "float64", "s", "that arrival, seconds after midnight; empty if never"),
)
SWEEP = (
    Column("controller", "str", "", "name of the controller"),
    Column("indicator", "str", "", "what the sweep shows"),
    Column("unit", "str", "", "unit of the indicator"),
    Column("value", "float64", "as unit", "as simulated; empty if the sweep does not show it"),
    Column("published", "float64", "as unit", "published value to compare with, if there is one"),
)
SWEPT_TABLES: Mapping[str, tuple[Column, ...]] = {"intervals": SWEPT_INTERVALS, "sweep": SWEEP}
"""The tables that only a sweep leaves."""
SWEEP_INDICATORS: Mapping[str, tuple[str, str]] = {
    "shortest_interval_s": (
        "shortest interval",
        "least departure-to-arrival interval over the initial delays",
    ),
    "greatest_shortening_s": (
        "greatest shortening",
        "greatest difference to the baseline's interval with the same initial delay",
    ),
    "headway_margin_s": (
        "headway margin",
        "initial delay up to which the next train arrives as with the smallest, within 0.1 s",
    ),
}
"""Indicators of a sweep: what a reader calls them, and what they mean."""
UNCHANGED_S = 0.1
"""An arrival this much later is still the same. [s]"""
_SHOWN = 5
"""So many initial delays are drawn."""


@dataclass(frozen=True, slots=True, eq=False)
class SweepTables:
    """What a sweep shows."""

    sweep: Sweep
    published: Published | None
    intervals: pd.DataFrame
    indicators: pd.DataFrame

    @property
    def frames(self) -> Mapping[str, pd.DataFrame]:
        """Frames by table name."""
        return {"intervals": self.intervals, "sweep": self.indicators}


def sweep_tables(
    sweep: Sweep, published: Published | None, runs: Iterable[RunTables]
) -> SweepTables:
    """
    Return everything that a sweep shows.

    Parameters
    ----------
    sweep
        Which train overstays where.
    published
        Published results to compare with.
    runs
        Finished runs, baseline first; their trajectories are not used.

    Returns
    -------
    SweepTables
        Tables ``intervals`` and ``sweep``.
    """
    measured = measured_frame(runs, sweep)
    intervals = measured[[column.name for column in SWEPT_INTERVALS]]
    values = published.values if published else {}  # noqa: PD011 - a mapping, no frame
    return SweepTables(sweep, published, intervals, sweep_frame(measured, values))


def following_arrival(calls: pd.DataFrame, sweep: Sweep) -> Mapping[str, Any] | None:
    """
    Return the arrival of the next train at the swept train's platform track.

    Parameters
    ----------
    calls
        The table ``calls`` of one run.
    sweep
        Which train overstays where.

    Returns
    -------
    Mapping[str, Any] | None
        Columns :data:`kankaku.analysis.tables.intervals.INTERVALS`; None if no train arrived there.
    """
    intervals = departure_arrival_intervals(calls)
    behind = (intervals["station"] == sweep.station) & (intervals["leader"] == sweep.train)
    return next(iter(rows_of(intervals[behind])), None)


def measured_frame(runs: Iterable[RunTables], sweep: Sweep) -> pd.DataFrame:
    """
    Return the interval behind the swept train in every run.

    Parameters
    ----------
    runs
        Runs in the order in which they are to appear.
    sweep
        Which train overstays where.

    Returns
    -------
    pd.DataFrame
        Columns ``MEASURED``, one row per run; nan where no train arrived.
    """
    nothing = {"interval_s": np.nan, "arrival_s": np.nan}
    rows = []
    for run in runs:
        found = following_arrival(run.calls, sweep) or nothing
        rows.append(
            {
                "controller": run.controller,
                "initial_delay_s": run.initial_delay_s,
                "interval_s": found["interval_s"],
                "arrival_s": found["arrival_s"],
            }
        )
    return rows_frame(rows, MEASURED)


def sweep_frame(measured: pd.DataFrame, published: Mapping[str, float]) -> pd.DataFrame:
    """
    Return the indicators of a sweep.

    Parameters
    ----------
    measured
        What :func:`measured_frame` returned; its first controller is the baseline.
    published
        Published values by indicator. Intervals and shortenings are those of the methods
        that are compared with the baseline; a margin does not depend on the method.

    Returns
    -------
    pd.DataFrame
        Table ``sweep``, one row per controller and indicator.
    """
    controllers = list(dict.fromkeys(measured["controller"]))
    baseline = measured[measured["controller"] == controllers[0]]
    rows = []
    for controller in controllers:
        own = measured[measured["controller"] == controller]
        values = {
            "shortest_interval_s": own["interval_s"].min(),
            "greatest_shortening_s": shortenings_s(baseline, own).max(),
            "headway_margin_s": headway_margin_s(
                own["initial_delay_s"].to_numpy(dtype=np.float64),
                own["arrival_s"].to_numpy(dtype=np.float64),
            ),
        }
        for indicator, value in values.items():
            compared = controller != controllers[0] or indicator == "headway_margin_s"
            rows.append(
                {
                    "controller": controller,
                    "indicator": indicator,
                    "unit": "s",
                    "value": value,
                    "published": published.get(indicator, np.nan) if compared else np.nan,
                }
            )
    return rows_frame(rows, SWEEP)


def shortenings_s(baseline: pd.DataFrame, own: pd.DataFrame) -> pd.Series:
    """
    Return how much shorter a controller's intervals are than the baseline's.

    Parameters
    ----------
    baseline, own
        Rows of one controller each, with initial delay and interval.

    Returns
    -------
    pd.Series
        Baseline minus own, by the initial delays that both ran; nan where no train arrived. [s]
    """
    own_s = own.set_index("initial_delay_s")["interval_s"]
    baseline_s = baseline.set_index("initial_delay_s")["interval_s"]
    shared = baseline_s.index.intersection(own_s.index)
    # Both are whole milliseconds, which their difference in binary is not.
    return (baseline_s.loc[shared] - own_s.loc[shared]).round(3)


def headway_margin_s(initial_delay_s: FloatArray, arrival_s: FloatArray) -> float:
    """
    Return the initial delay up to which the next train arrives as with the smallest one.

    Parameters
    ----------
    initial_delay_s
        Initial delays of the swept train. [s], shape (n_runs,)
    arrival_s
        Arrival of the next train; nan, if never, is left out. [s], shape (n_runs,)

    Returns
    -------
    float
        Where the arrival, linear between the delays, is ``UNCHANGED_S`` later than with the
        smallest delay; the greatest delay if it never is. nan for fewer than two delays, and
        if the second delay is already too great: then the smallest may be, too. [s]
    """
    order = np.argsort(initial_delay_s, kind="stable")
    arrived = order[np.isfinite(arrival_s[order])]
    if arrived.size < 2:
        return np.nan
    delay_s = initial_delay_s[arrived]
    # Arrivals are whole milliseconds, which their difference in binary is not.
    later_s = np.round(arrival_s[arrived] - arrival_s[arrived[0]], 3)
    exceeding = np.flatnonzero(later_s > UNCHANGED_S)
    if not exceeding.size:
        return float(delay_s[-1])
    first = int(exceeding[0])
    if first == 1:
        return np.nan
    pair = slice(first - 1, first + 1)
    return float(np.interp(UNCHANGED_S, later_s[pair], delay_s[pair]))


def shown_delays_s(ran: Iterable[tuple[str, float]]) -> tuple[float, ...]:
    """
    Return the initial delays whose runs are drawn.

    Parameters
    ----------
    ran
        Controller and initial delay of every finished run, baseline first. [s]

    Returns
    -------
    tuple[float, ...]
        The smallest, the greatest and up to three evenly between them, of those that every
        controller ran, or of the baseline's if there are none, as after an interrupt. [s]
    """
    by_controller: dict[str, set[float]] = {}
    for controller, delay_s in ran:
        by_controller.setdefault(controller, set()).add(delay_s)
    sets = list(by_controller.values())
    if not sets:
        return ()
    delays_s = sorted(set.intersection(*sets) or sets[0])
    count = min(_SHOWN, len(delays_s))
    places = [index * (len(delays_s) - 1) // max(count - 1, 1) for index in range(count)]
    return tuple(delays_s[place] for place in places)


def read_intervals(folder: str | Path) -> pd.DataFrame:
    """
    Read the table ``intervals`` of the results of a sweep.

    Parameters
    ----------
    folder
        Results folder.

    Returns
    -------
    pd.DataFrame
        Columns ``SWEPT_INTERVALS``.
    """
    return read_csv(Path(folder) / "intervals.csv", SWEPT_INTERVALS)


def read_sweep(folder: str | Path) -> pd.DataFrame:
    """
    Read the table ``sweep`` of the results of a sweep.

    Parameters
    ----------
    folder
        Results folder.

    Returns
    -------
    pd.DataFrame
        Columns ``SWEEP``.
    """
    return read_csv(Path(folder) / "sweep.csv", SWEEP)
