"""What only networks show: both directions, hours, delay through turn-backs, use of nodes."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from kankaku.analysis.tables.columns import rows_frame, typed_frame
from kankaku.analysis.tables.node_use import NODE_USE, node_use_frame
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.railway.plan.line import Direction
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.step.records import Column

HOUR_S = 3600.0
RISING = Direction.RISING.name.lower()
_RUN = (
    Column("controller", "str", "", "name of the controller"),
    Column("seed", "int64", "", "seed of the dwell delays"),
    Column("initial_delay_s", "float64", "s", "swept delay of one train; 0 without a sweep"),
)
_MEASURED = (
    Column("trains", "int64", "", "trains with a booked arrival then"),
    Column("mean_arrival_delay_s", "float64", "s", "mean over all calls but origins"),
    Column("secondary_delay_s", "float64", "s", "lateness owed to others, mean over the same"),
    Column("interstation_stop_time_s", "float64", "s", "running trains at a stand for 1 s or more"),
    Column("interstation_stops", "int64", "", "how often"),
    Column("passed_on_s", "float64", "s", "delay that came with their stock, sum over its trains"),
)
_WAY = Column("direction", "str", "", "rising or falling chainage")
_HOUR = Column(
    "hour",
    "int64",
    "h",
    "of booked arrivals, of stops' begins and of booked departures of taken-over stock; "
    "after midnight from 24",
)
BY_DIRECTION = (*_RUN, _WAY, *_MEASURED)
BY_HOUR = (*_RUN, _WAY, _HOUR, *_MEASURED)
TURN_BACKS = (
    *_RUN,
    Column("train", "str", "", "train that ends"),
    Column("next_train", "str", "", "train that goes on with its stock"),
    Column("station", "str", "", "where"),
    Column(
        "booked_arrival_s",
        "float64",
        "s",
        "of the train that ends, seconds after midnight",
        clock=True,
    ),
    Column("arrival_s", "float64", "s", "its actual arrival; empty if never", clock=True),
    Column("booked_departure_s", "float64", "s", "of the next train", clock=True),
    Column("departure_s", "float64", "s", "its actual departure; empty if never", clock=True),
    Column("arrival_delay_s", "float64", "s", "of the train that ends; early is negative"),
    Column("departure_delay_s", "float64", "s", "of the next train"),
    Column("reserve_s", "float64", "s", "booked from arrival to departure beyond the least time"),
    Column("taken_up_s", "float64", "s", "part of a late arrival that the reserve takes up"),
    Column("passed_on_s", "float64", "s", "the rest: the next train departs later by it at least"),
)
NETWORK_TABLES: Mapping[str, tuple[Column, ...]] = {
    "by_direction": BY_DIRECTION,
    "by_hour": BY_HOUR,
    "turn_backs": TURN_BACKS,
    "node_use": NODE_USE,
}


def network_tables(
    scenario: Scenario, runs: Sequence[RunTables], shown: Sequence[RunTables]
) -> dict[str, pd.DataFrame]:
    """
    Return the tables that only networks have.

    Parameters
    ----------
    scenario
        A network and its trains.
    runs
        All runs.
    shown
        Those of them that have a trajectory, for the use of nodes.

    Returns
    -------
    dict[str, pd.DataFrame]
        By name, as declared in ``NETWORK_TABLES``.
    """
    way_of = _directions(scenario)
    next_of = {s.train: s.next_train for s in scenario.timetable.services if s.next_train}
    turned = [turn_backs_frame(run, next_of) for run in runs]
    return {
        "by_direction": _measured_frame(runs, turned, way_of, BY_DIRECTION),
        "by_hour": _measured_frame(runs, turned, way_of, BY_HOUR),
        "turn_backs": pd.concat(turned, ignore_index=True),
        "node_use": node_use_frame(scenario, shown),
    }


def _directions(scenario: Scenario) -> dict[str, str]:
    track_of = scenario.line.track_by_id
    return {
        service.train: track_of[service.route[0]].direction.name.lower()
        for service in scenario.timetable.services
    }


def _measured_frame(
    runs: Sequence[RunTables],
    turned: Sequence[pd.DataFrame],
    way_of: Mapping[str, str],
    columns: Sequence[Column],
) -> pd.DataFrame:
    """Return the indicators of all runs by direction, and by hour where the columns have it."""
    keys = [column.name for column in (_WAY, _HOUR) if column in columns]
    rows: list[dict[str, object]] = []
    for run, turn_backs in zip(runs, turned, strict=True):
        arrivals = _keyed(run.calls[run.calls["sequence"] > 0], way_of, "train", "booked_arrival_s")
        stops = _keyed(run.interstation_stops, way_of, "train", "start_s")
        passed = _keyed(turn_backs, way_of, "next_train", "booked_departure_s")
        parts: list[dict[Any, pd.DataFrame]] = [
            dict(iter(frame.groupby(keys))) for frame in (arrivals, stops, passed)
        ]
        for key in sorted({key for part in parts for key in part}, key=_rising_first):
            arrived, stood, taken = (
                part.get(key, frame.iloc[:0])
                for part, frame in zip(parts, (arrivals, stops, passed), strict=True)
            )
            rows.append(
                {
                    **_named(run),
                    **dict(zip(keys, key, strict=True)),
                    "trains": int(arrived["train"].nunique()),
                    "mean_arrival_delay_s": float(arrived["arrival_delay_s"].mean()),
                    "secondary_delay_s": float(arrived["secondary_delay_s"].mean()),
                    "interstation_stop_time_s": float(stood["duration_s"].sum()),
                    "interstation_stops": len(stood),
                    "passed_on_s": float(taken["passed_on_s"].sum()),
                }
            )
    return rows_frame(rows, columns)


def _named(run: RunTables) -> dict[str, object]:
    return {
        "controller": run.controller,
        "seed": run.seed,
        "initial_delay_s": run.initial_delay_s,
    }


def _keyed(frame: pd.DataFrame, way_of: Mapping[str, str], train: str, time_s: str) -> pd.DataFrame:
    """Return a table with the direction of a train, and the hour of a time."""
    hours = (frame[time_s] // HOUR_S).astype("int64")
    return frame.assign(direction=frame[train].map(way_of), hour=hours)


def _rising_first(key: tuple[Any, ...]) -> tuple[bool, tuple[Any, ...]]:
    return key[0] != RISING, key


def turn_backs_frame(run: RunTables, next_of: Mapping[str, str]) -> pd.DataFrame:
    """
    Return how much delay passes on with stock.

    Parameters
    ----------
    run
        A run.
    next_of
        The train that goes on with the stock of another one.

    Returns
    -------
    pd.DataFrame
        Columns ``TURN_BACKS``: a row for each train that is followed by another one.
    """
    by_name = run.calls.groupby("train", sort=False)
    ends = by_name.tail(1).set_index("train").reindex(list(next_of))
    begins = by_name.head(1).set_index("train").reindex(list(next_of.values()))
    late_s = ends["arrival_delay_s"].to_numpy()
    least_s = ends["minimum_dwell_s"].to_numpy() + begins["minimum_dwell_s"].to_numpy()
    booked_s = begins["booked_departure_s"].to_numpy() - ends["booked_arrival_s"].to_numpy()
    reserve_s = booked_s - least_s
    passed_on_s = np.maximum(late_s - np.maximum(reserve_s, 0.0), 0.0)
    return typed_frame(
        {
            **{name: [value] * len(next_of) for name, value in _named(run).items()},
            "train": list(next_of),
            "next_train": list(next_of.values()),
            "station": ends["station"].to_numpy(),
            **{name: ends[name].to_numpy() for name in ("booked_arrival_s", "arrival_s")},
            **{name: begins[name].to_numpy() for name in ("booked_departure_s", "departure_s")},
            "arrival_delay_s": late_s,
            "departure_delay_s": begins["departure_delay_s"].to_numpy(),
            "reserve_s": reserve_s,
            "taken_up_s": np.maximum(late_s, 0.0) - passed_on_s,
            "passed_on_s": passed_on_s,
        },
        TURN_BACKS,
    )
