"""How much of their busiest hour points and platform tracks of a network are occupied."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from kankaku.analysis.tables.columns import by_train, rows_frame
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.line import Direction, Line
from kankaku.railway.plan.passing import passages
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.timetable import Service
from kankaku.railway.step.records import Column

HOUR_S = 3600.0
NODE_USE = (
    Column("controller", "str", "", "name of the controller"),
    Column("seed", "int64", "", "seed of the dwell delays"),
    Column("kind", "str", "", "points or platform"),
    Column("place", "str", "", "points, or name of a station and physical track"),
    Column("passings", "int64", "", "how often stock came there; who turns back came once"),
    Column(
        "occupied_s", "float64", "s", "from fronts that enter to tails that have cleared, all day"
    ),
    Column("busiest_from_s", "float64", "s", "when its busiest hour begins, after midnight"),
    Column(
        "busiest_percent",
        "float64",
        "%",
        "share of that hour in which a train is there; places between samples of a second are "
        "interpolated, and a train begins and ends with its first and last sample",
    ),
)


class Place(NamedTuple):
    """Points, or the part of a track beside a platform."""

    kind: str
    name: str


class Trail(NamedTuple):
    """Samples of a train in the coordinate of its route; arrays of shape (n_samples,)."""

    time_s: FloatArray
    front_m: FloatArray
    """Never falling. [m]"""

    def reaches_s(self, place_m: float) -> float:
        """
        Return when the front comes to a place.

        Parameters
        ----------
        place_m
            Where. [m]

        Returns
        -------
        float
            The first sample if it begins beyond; nan if it never comes there. [s]
        """
        after = int(np.searchsorted(self.front_m, place_m))
        if after == self.front_m.size:
            return np.nan
        if after == 0:
            return float(self.time_s[0])
        cell = slice(after - 1, after + 1)
        return float(np.interp(place_m, self.front_m[cell], self.time_s[cell]))


def node_use_frame(scenario: Scenario, runs: Sequence[RunTables]) -> pd.DataFrame:
    """
    Return how much points and platform tracks are used, as UIC 406 counts it.

    What counts is that a train is in the fouling section of points, or beside a platform. The
    time for which a route is kept before that, which depends on the protection, is not in it.

    Parameters
    ----------
    scenario
        A network and its trains.
    runs
        Runs with their trajectories.

    Returns
    -------
    pd.DataFrame
        Columns ``NODE_USE``, one row for each place that a train used.
    """
    rows = []
    for run in runs:
        for place, stays in sorted(_stays(scenario, run).items()):
            from_s, busiest_s, occupied_s = busiest_hour_s(np.array([stay[:2] for stay in stays]))
            rows.append(
                {
                    "controller": run.controller,
                    "seed": run.seed,
                    "kind": place.kind,
                    "place": place.name,
                    "passings": sum(stay.comes for stay in stays),
                    "occupied_s": occupied_s,
                    "busiest_from_s": from_s,
                    "busiest_percent": 100.0 * busiest_s / HOUR_S,
                }
            )
    return rows_frame(rows, NODE_USE)


class _Stay(NamedTuple):
    """A train at a place."""

    start_s: float
    end_s: float
    comes: bool
    """Its stock was not there before, as another train."""


def _stays(scenario: Scenario, run: RunTables) -> Mapping[Place, list[_Stay]]:
    traces = {
        str(train): (own["time_s"].to_numpy(), own["front_m"].to_numpy())
        for train, own in by_train(run.trajectory)
    }
    services = scenario.timetable.services
    stock_of = {service.next_train: service.train for service in services if service.next_train}
    found: dict[Place, list[_Stay]] = defaultdict(list)
    for service in services:
        if service.train not in traces:
            continue
        time_s, front_m = traces[service.train]
        if _falls(scenario, service):
            front_m = scenario.line.start_m + scenario.line.end_m - front_m
        trace = Trail(time_s, np.maximum.accumulate(front_m))
        before = stock_of.get(service.train)
        stock_s = float(traces[before][0][-1]) if before in traces else np.nan
        _note_stays(scenario, service, trace, stock_s, found)
    return found


def _falls(scenario: Scenario, service: Service) -> bool:
    return scenario.line.track_by_id[service.route[0]].direction is Direction.FALLING


def _note_stays(
    scenario: Scenario,
    service: Service,
    trace: Trail,
    stock_s: float,
    found: dict[Place, list[_Stay]],
) -> None:
    """Note the stays of a train; its stock was where it begins until ``stock_s``, or is new."""
    length_m = scenario.train_types[service.train_type].length_m
    first = service.calls[0]
    begins_at = _platform(scenario.line, first.station, first.track)
    last_s = float(trace.time_s[-1])
    for place, (start_m, end_m) in _zones(scenario.line, service):
        takes_over = place == begins_at and np.isfinite(stock_s) and start_m < first.stop_m <= end_m
        start_s = stock_s if takes_over else trace.reaches_s(start_m)
        if np.isnan(start_s):
            continue
        cleared_s = trace.reaches_s(end_m + length_m)
        end_s = last_s if np.isnan(cleared_s) else cleared_s
        found[place].append(_Stay(start_s, end_s, comes=not takes_over))


def _zones(line: Line, service: Service) -> Iterator[tuple[Place, tuple[float, float]]]:
    """Yield the points and platforms on the way of a train, and from where to where they lie."""
    for passage in passages(line, service.route):
        if passage.turnout >= 0:
            direction = line.track_by_id[passage.track].direction
            points = Place("points", line.turnouts[passage.turnout].id)
            yield points, line.fouling_m(passage.turnout, direction)
        for platform in line.platforms:
            if platform.track == passage.track:
                place = _platform(line, platform.station, platform.track)
                yield place, (platform.start_m, platform.end_m)


def _platform(line: Line, station: str, track: str) -> Place:
    """Return a platform track; of a ring that is cut there, the same at both ends."""
    name = f"{line.station_by_id[station].name} {line.track_by_id[track].place}"
    return Place("platform", name)


def busiest_hour_s(spans_s: FloatArray) -> tuple[float, float, float]:
    """
    Return the hour in which a place is occupied longest.

    Parameters
    ----------
    spans_s
        From when to when something is there; where they overlap, it counts once.
        [s], shape (n_spans, 2)

    Returns
    -------
    tuple[float, float, float]
        When the hour begins, for how long the place is occupied in it, and for how long in all.
        [s]
    """
    starts_s, ends_s = spans_s[np.argsort(spans_s[:, 0], kind="stable")].T
    reached_s = np.maximum.accumulate(ends_s)
    # Whoever comes while another one is still there adds only what goes beyond that.
    starts_s = np.maximum(starts_s, np.concatenate([[-np.inf], reached_s[:-1]]))
    edges_s = np.column_stack([starts_s, np.maximum(starts_s, ends_s)]).ravel()
    passed_s = np.cumsum(np.diff(edges_s, prepend=edges_s[0]) * (np.arange(edges_s.size) % 2))
    # Where most is occupied, an hour can begin with a train.
    until_s, from_s = (np.interp(starts_s + at_s, edges_s, passed_s) for at_s in (HOUR_S, 0.0))
    within_s = np.round(until_s - from_s, 6)
    best = int(np.argmax(within_s))
    return float(starts_s[best]), float(within_s[best]), float(passed_s[-1])
