"""Radio load: utilisation, round trips and the trains that a cell carries, as tables."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from kankaku.analysis.tables.columns import rows_frame, typed_frame
from kankaku.railway.arrays import FloatArray
from kankaku.railway.radio.cells import Link, PublishedLoad, RadioPlan, RadioSystem
from kankaku.railway.radio.traffic import Traffic
from kankaku.railway.step.records import Column

RADIO_LOAD = (
    Column("system", "str", "", "radio system"),
    Column("case", "str", "", "how many trains, or the saved run by its controller"),
    Column("trains", "float64", "", "trains on the line, mean over time"),
    Column("indicator", "str", "", "what is measured"),
    Column("unit", "str", "", "unit of the value"),
    Column("value", "float64", "", "ours"),
    Column("published", "float64", "", "published value; empty if none"),
)
UTILISATION = (
    Column("system", "str", "", "radio system"),
    Column("link", "str", "", "kind of link"),
    Column("cell", "int64", "", "number of the cell from 0; -1 for a link without one"),
    Column("time_s", "float64", "s", "beginning of the second, seconds after midnight", clock=True),
    Column("utilisation_percent", "float64", "%", "share of that second in which it is busy"),
)
ROUND_TRIPS = (
    Column("system", "str", "", "radio system"),
    Column("case", "str", "", "how many trains, or the saved run by its controller"),
    Column("round_trip_s", "float64", "s", "least of a class of 10 ms"),
    Column("share_percent", "float64", "%", "share of the trains' commands that are answered so"),
)
CELL_CAPACITY = (
    Column("system", "str", "", "radio system"),
    Column("trackside_devices", "int64", "", "trackside devices in the cell"),
    Column("trains", "int64", "", "trains in the cell"),
    Column("antenna_train_percent", "float64", "%", "utilisation from antenna to trains"),
    Column("late_percent", "float64", "%", "commands to trains that come late or are never sent"),
    Column("longest_delay_s", "float64", "s", "longest of a command that arrives; empty if none"),
)
RADIO_TABLES: Mapping[str, tuple[Column, ...]] = {
    "radio_load": RADIO_LOAD,
    "utilisation": UTILISATION,
    "round_trips": ROUND_TRIPS,
    "cell_capacity": CELL_CAPACITY,
}
LINK_LABELS: Mapping[Link, str] = {
    Link.CONTROLLER_SWITCH: "controller to switch",
    Link.SWITCH_CONTROLLER: "switch to controller",
    Link.SWITCH_UNIT: "switch to radio unit",
    Link.UNIT_SWITCH: "radio unit to switch",
    Link.ANTENNA_TRAIN: "antenna to train",
    Link.TRAIN_ANTENNA: "train to antenna",
}
LABELS: Mapping[str, str] = {
    **{f"{link.value}_percent": f"{label} [%]" for link, label in LINK_LABELS.items()},
    "busiest_minute_percent": "antenna to train, busiest cell and minute [%]",
    "round_trip_mean_s": "round trip, mean [s]",
    "round_trip_p99_s": "round trip, 99 % [s]",
    "round_trip_max_s": "round trip, longest [s]",
    "command_delay_max_s": "longest way to a train [s]",
    "late_percent": "late or never sent [%]",
    "lost_percent": "lost on the air [%]",
}
"""What a reader sees for an indicator, in order."""
CLASS_S = 0.01
TOLERATED = 0.01
"""A cell still carries trains while no more than this share of commands is late. [-]"""
MINUTE_S = 60


@dataclass(frozen=True, slots=True, eq=False)
class LoadCase:
    """One simulation of the whole line."""

    system: RadioSystem
    name: str
    trains: float
    """Mean over time. [-]"""
    units_per_train: float
    """Radio units that serve a train, mean over trains and time. [-]"""
    traffic: Traffic
    published: PublishedLoad | None = None
    start_s: float | None = None
    """Of the saved run, seconds after midnight; None for evenly spaced trains. [s]"""


@dataclass(frozen=True, slots=True)
class CellPoint:
    """A cell full of trains."""

    system: RadioSystem
    trackside_devices: int
    trains: int
    utilisation: float
    late: float
    """Share of commands that come late, or are never sent. [-]"""
    longest_delay_s: float


def late_share(traffic: Traffic, late_s: float) -> float:
    """
    Return how many commands to trains come late or are never sent.

    Parameters
    ----------
    traffic
        What was simulated.
    late_s
        From the making of a command to its arrival. [s]

    Returns
    -------
    float
        Share; 0 without commands. What is lost on the air is no matter of load. [-]
    """
    delays_s = traffic.delays_s
    late = np.isfinite(delays_s) & (delays_s > late_s)
    return float((late | ~traffic.sent).mean()) if delays_s.size else 0.0


def lost_share(traffic: Traffic) -> float:
    """
    Return how many commands to trains are sent and never arrive.

    Parameters
    ----------
    traffic
        What was simulated.

    Returns
    -------
    float
        Share; 0 without commands. [-]
    """
    lost = np.isinf(traffic.delays_s) & traffic.sent
    return float(lost.mean()) if lost.size else 0.0


def busiest_minute(traffic: Traffic) -> tuple[float, int, int]:
    """
    Return the greatest utilisation from antenna to trains of any cell, over whole minutes.

    Parameters
    ----------
    traffic
        What was simulated, a minute or more.

    Returns
    -------
    tuple[float, int, int]
        Share [-], cell, and number of the minute.
    """
    minutes = cell_minutes(traffic, Link.ANTENNA_TRAIN)
    cell, minute = np.unravel_index(int(minutes.argmax()), minutes.shape)
    return float(minutes[cell, minute]), int(cell), int(minute)


def cell_minutes(traffic: Traffic, kind: Link) -> FloatArray:
    """
    Return the utilisation of a link of each cell, minute by minute.

    Parameters
    ----------
    traffic
        What was simulated.
    kind
        A kind of link of which every cell has one.

    Returns
    -------
    FloatArray
        Shares; a last minute that is not whole counts for what there is of it. [-], shape
        (n_cells, n_minutes)
    """
    rows = [row for row, link in enumerate(traffic.links) if link.kind is kind]
    starts = np.arange(0, traffic.busy.shape[1], MINUTE_S)
    sums = np.add.reduceat(traffic.busy[rows], starts, axis=1)
    shares: FloatArray = sums / np.diff(np.append(starts, traffic.busy.shape[1]))
    return shares


def indicators(case: LoadCase, late_s: float) -> Iterator[tuple[str, str, float, float]]:
    """
    Yield what a case shows.

    Parameters
    ----------
    case
        One simulation.
    late_s
        From when on a command is late. [s]

    Yields
    ------
    tuple[str, str, float, float]
        Indicator, unit, our value and the published one; not a number if there is none.
    """
    told = case.published
    for kind in Link:
        share = case.traffic.utilisation(kind)
        if not np.isnan(share):
            published = told.utilisation.get(kind, np.nan) if told else np.nan
            yield f"{kind.value}_percent", "%", 100.0 * share, 100.0 * published
    yield "busiest_minute_percent", "%", 100.0 * busiest_minute(case.traffic)[0], np.nan
    trips_s, delays_s = case.traffic.round_trips_s, case.traffic.delays_s
    arrived_s = delays_s[np.isfinite(delays_s)]
    mean_s = told.round_trip_mean_s if told else None
    max_s = told.round_trip_max_s if told else None
    if trips_s.size:
        yield "round_trip_mean_s", "s", float(trips_s.mean()), _or_nan(mean_s)
        yield "round_trip_p99_s", "s", float(np.quantile(trips_s, 0.99)), np.nan
        yield "round_trip_max_s", "s", float(trips_s.max()), _or_nan(max_s)
    if arrived_s.size:
        yield "command_delay_max_s", "s", float(arrived_s.max()), np.nan
    yield "late_percent", "%", 100.0 * late_share(case.traffic, late_s), np.nan
    yield "lost_percent", "%", 100.0 * lost_share(case.traffic), np.nan


def _or_nan(value: float | None) -> float:
    return np.nan if value is None else value


def radio_load_frame(cases: Iterable[LoadCase], plan: RadioPlan) -> pd.DataFrame:
    """
    Return the load of all links and the round trips, ours beside the published.

    Parameters
    ----------
    cases
        All simulations.
    plan
        What was asked.

    Returns
    -------
    pd.DataFrame
        Columns ``RADIO_LOAD``.
    """
    rows = (
        {
            "system": case.system.name,
            "case": case.name,
            "trains": case.trains,
            "indicator": indicator,
            "unit": unit,
            "value": value,
            "published": published,
        }
        for case in cases
        for indicator, unit, value, published in indicators(case, plan.late_s)
    )
    return rows_frame(rows, RADIO_LOAD)


def utilisation_frame(cases: Iterable[LoadCase]) -> pd.DataFrame:
    """
    Return the utilisation of every link in every second of the saved run.

    Parameters
    ----------
    cases
        All simulations.

    Returns
    -------
    pd.DataFrame
        Columns ``UTILISATION``.
    """
    parts = []
    for case in cases:
        if case.start_s is None:
            continue
        links, seconds = case.traffic.links, case.traffic.busy.shape[1]
        cells = [-1 if link.cell is None else link.cell for link in links]
        parts.append(
            typed_frame(
                {
                    "system": [case.system.name] * (len(links) * seconds),
                    "link": np.repeat([link.kind.value for link in links], seconds),
                    "cell": np.repeat(np.array(cells, dtype=np.int64), seconds),
                    "time_s": np.tile(case.start_s + np.arange(seconds), len(links)),
                    "utilisation_percent": 100.0 * case.traffic.busy.ravel(),
                },
                UTILISATION,
            )
        )
    return pd.concat(parts, ignore_index=True)


def round_trips_frame(cases: Iterable[LoadCase]) -> pd.DataFrame:
    """
    Return how round trips are distributed.

    Parameters
    ----------
    cases
        All simulations.

    Returns
    -------
    pd.DataFrame
        Columns ``ROUND_TRIPS``; classes without a round trip are left out.
    """
    rows = []
    for case in cases:
        # A hair is added so that whole hundredths do not fall into the class below.
        classes = np.floor(case.traffic.round_trips_s / CLASS_S + 1e-6).astype(int)
        numbers, counts = np.unique(classes, return_counts=True)
        for number, count in zip(numbers.tolist(), counts.tolist(), strict=True):
            rows.append(
                {
                    "system": case.system.name,
                    "case": case.name,
                    "round_trip_s": number * CLASS_S,
                    "share_percent": 100.0 * count / classes.size,
                }
            )
    return rows_frame(rows, ROUND_TRIPS)


def cell_capacity_frame(points: Iterable[CellPoint]) -> pd.DataFrame:
    """
    Return how full a cell is with so many trains.

    Parameters
    ----------
    points
        In the order of systems, trackside devices and trains.

    Returns
    -------
    pd.DataFrame
        Columns ``CELL_CAPACITY``.
    """
    rows = (
        {
            "system": point.system.name,
            "trackside_devices": point.trackside_devices,
            "trains": point.trains,
            "antenna_train_percent": 100.0 * point.utilisation,
            "late_percent": 100.0 * point.late,
            "longest_delay_s": point.longest_delay_s,
        }
        for point in points
    )
    return rows_frame(rows, CELL_CAPACITY)


def carried(points: Sequence[CellPoint]) -> int:
    """
    Return how many trains a cell carries before commands run late.

    Parameters
    ----------
    points
        Of one system and number of trackside devices, trains rising from 1.

    Returns
    -------
    int
        Trains; 0 if not even one. [-]
    """
    late = [point.trains for point in points if point.late > TOLERATED]
    return min(late) - 1 if late else points[-1].trains


def grouped(points: Iterable[CellPoint]) -> list[list[CellPoint]]:
    """
    Return the points of each curve.

    Parameters
    ----------
    points
        Of all systems.

    Returns
    -------
    list[list[CellPoint]]
        One list per system and number of trackside devices.
    """
    curves: dict[tuple[str, int], list[CellPoint]] = {}
    for point in points:
        curves.setdefault((point.system.name, point.trackside_devices), []).append(point)
    return list(curves.values())
