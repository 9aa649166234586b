"""Which part of a control map is worth drawing."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from kankaku.analysis.tables.columns import rows_of
from kankaku.analysis.tables.run_tables import DWELLING, RunTables
from kankaku.analysis.tables.worst import worst_moment
from kankaku.analysis.words import clock
from kankaku.railway.plan.scenario import Scenario

APPROACH_M = 1000.0
"""Who is nearer to an obstruction than this is on the way to it. [m]"""
LEAST_WAIT_S = 30.0
"""Shorter waits are those for points that throw as they should. [s]"""
BEFORE_S = 100.0
AFTER_S = 160.0
LONGEST_S = 600.0
"""Of an obstruction that lasts longer, only the beginning is shown. [s]"""
BEHIND_M = 1700.0
AHEAD_M = 1000.0
CAUSES: Mapping[str, str] = {
    "points": "points not proven",
    "work": "work zone",
    "fault": "faulty equipment",
    "obstacle": "obstacle on a level crossing",
}
"""Causes of obstructions, in words."""


class Window(NamedTuple):
    """The part of a map that is drawn."""

    start_s: float
    end_s: float
    low_m: float
    high_m: float
    what: str
    """What is seen there, in words."""


def window_of(run: RunTables, scenario: Scenario) -> Window | None:
    """
    Return the part of a map with the most to see.

    Parameters
    ----------
    run
        A run.
    scenario
        What was run.

    Returns
    -------
    Window | None
        Around the obstruction that a train was on the way to for the longest time while it
        lasted, else around the worst moment of the run; None if there is neither.
    """
    line = scenario.line
    found = max(_waits(run, scenario), key=lambda wait: wait[0], default=None)
    if found and found[0] >= LEAST_WAIT_S:
        _, train, item = found
        begin_s, lifted_s = item["requested_s"], item["lifted_s"]
        shown_s = min(begin_s + LONGEST_S, lifted_s if np.isfinite(lifted_s) else np.inf)
        until = clock(lifted_s, seconds=True) if np.isfinite(lifted_s) else "the end"
        name = CAUSES[item["cause"]]
        what = (
            f"{item['obstruction']} ({name}) from {clock(begin_s, seconds=True)} to {until}, "
            f"in the way of train {train}"
        )
        times_s = begin_s - BEFORE_S, shown_s + AFTER_S
        places_m = item["start_m"] - BEHIND_M, item["end_m"] + AHEAD_M
    else:
        worst = worst_moment(run)
        if worst is None:
            return None
        own = run.trajectory[run.trajectory["train"] == worst.train]
        place_m = float(np.interp(worst.start_s, own["time_s"], own["front_m"]))
        what = f"train {worst.train} {worst.what} ({clock(worst.start_s, seconds=True)})"
        times_s = worst.start_s - BEFORE_S, min(worst.end_s, worst.start_s + LONGEST_S) + AFTER_S
        places_m = place_m - BEHIND_M, place_m + AHEAD_M
    return Window(*times_s, max(places_m[0], line.start_m), min(places_m[1], line.end_m), what)


def _waits(run: RunTables, scenario: Scenario) -> Iterator[tuple[float, str, dict[str, Any]]]:
    """Yield how long which train was on the way to which obstruction while it lasted."""
    samples = run.trajectory[run.trajectory["reason"] != DWELLING]
    routes = {service.train: set(service.route) for service in scenario.timetable.services}
    for item in rows_of(run.obstructions):
        tracks = set(item["tracks"].split())
        concerned = [train for train, route in routes.items() if route & tracks]
        end_s = item["lifted_s"] if np.isfinite(item["lifted_s"]) else np.inf
        waiting = samples[
            samples["time_s"].between(item["requested_s"], end_s)
            & samples["front_m"].between(item["start_m"] - APPROACH_M, item["start_m"])
            & samples["train"].isin(concerned)
        ]
        times_s = waiting.groupby("train", sort=False)["time_s"]
        for train, duration_s in (times_s.max() - times_s.min()).items():
            yield float(duration_s), str(train), item
