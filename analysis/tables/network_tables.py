"""What only networks show: both directions, hours, delay through turn-backs, use of nodes."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import pandas as pd

from kankaku.analysis.tables.columns import by_train, rows_frame, typed_frame
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.line import Direction
from kankaku.railway.plan.passing import passages
from kankaku.railway.plan.scenario import Scenario
from kankaku.railway.plan.timetable import Service
from kankaku.railway.step.records import Column

HOUR_S = 3600.0
_RUN = (
    Column("controller", "str", "", "name of the controller"),
    Column("seed", "int64", "", "seed of the dwell delays"),
)
_MEASURED = (
    Column("trains", "int64", "", "trains with an arrival then"),
    Column("mean_arrival_delay_s", "float64", "s", "mean over all calls but origins"),
    Column("secondary_delay_s", "float64", "s", "lateness owed to others, mean over the same"),
    Column("interstation_stop_time_s", "float64", "s", "running trains at a stand for 1 s or more"),
    Column("interstation_stops", "int64", "", "how often"),
)
_WAY = Column("direction", "str", "", "rising or falling chainage")
BY_DIRECTION = (*_RUN, _WAY, *_MEASURED)
BY_HOUR = (
    *_RUN,
    _WAY,
    Column("hour", "int64", "h", "of the arrival, or of the stop's begin; after midnight from 24"),
    *_MEASURED,
)
TURN_BACKS = (
    *_RUN,
    Column("train", "str", "", "train that ends"),
    Column("next_train", "str", "", "train that goes on with its stock"),
    Column("station", "str", "", "where"),
    Column("arrival_delay_s", "float64", "s", "actual minus booked arrival of the train that ends"),
    Column("departure_delay_s", "float64", "s", "actual minus booked departure of the next one"),
    Column("booked_s", "float64", "s", "booked from that arrival to that departure"),
    Column("taken_s", "float64", "s", "how long it took"),
    Column("passed_on_s", "float64", "s", "late departure that the late arrival accounts for"),
)
NODE_USE = (
    *_RUN,
    Column("place", "str", "", "points, or station and platform track"),
    Column("kind", "str", "", "points or platform"),
    Column("passings", "int64", "", "trains that came through, or stood there"),
    Column("busiest_from_s", "float64", "s", "when its busiest hour begins, after midnight"),
    Column(
        "busiest_percent",
        "float64",
        "%",
        "share of that hour in which a train was there, by samples of a second (UIC 406)",
    ),
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
    return {
        "by_direction": rows_frame(
            (row for run in runs for row in _measured_rows(run, way_of, hourly=False)),
            BY_DIRECTION,
        ),
        "by_hour": rows_frame(
            (row for run in runs for row in _measured_rows(run, way_of, hourly=True)), BY_HOUR
        ),
        "turn_backs": turn_backs_frame(scenario, runs),
        "node_use": node_use_frame(scenario, shown),
    }


def _directions(scenario: Scenario) -> dict[str, str]:
    track_of = scenario.line.track_by_id
    return {
        service.train: track_of[service.route[0]].direction.name.lower()
        for service in scenario.timetable.services
    }


def _measured_rows(
    run: RunTables, way_of: Mapping[str, str], *, hourly: bool
) -> Iterable[dict[str, object]]:
    arrivals = run.calls[run.calls["sequence"] > 0]
    arrivals = arrivals.assign(
        direction=arrivals["train"].map(way_of),
        hour=(arrivals["booked_arrival_s"] // HOUR_S).astype("int64"),
    )
    stops = run.interstation_stops
    stops = stops.assign(
        direction=stops["train"].map(way_of), hour=(stops["start_s"] // HOUR_S).astype("int64")
    )
    keys = ["direction", "hour"] if hourly else ["direction"]
    stood = dict(iter(stops.groupby(keys)))
    for key, own in arrivals.groupby(keys):
        standing = stood.get(key, stops.iloc[:0])
        yield {
            "controller": run.controller,
            "seed": run.seed,
            **dict(zip(keys, key, strict=True)),
            "trains": int(own["train"].nunique()),
            "mean_arrival_delay_s": float(own["arrival_delay_s"].mean()),
            "secondary_delay_s": float(own["secondary_delay_s"].mean()),
            "interstation_stop_time_s": float(standing["duration_s"].sum()),
            "interstation_stops": len(standing),
        }


def turn_backs_frame(scenario: Scenario, runs: Sequence[RunTables]) -> pd.DataFrame:
    """
    Return how much delay passes on with stock.

    Parameters
    ----------
    scenario
        A network and its trains.
    runs
        The runs.

    Returns
    -------
    pd.DataFrame
        Columns ``TURN_BACKS``: a row for each train that takes over stock, and run.
    """
    next_of = {s.train: s.next_train for s in scenario.timetable.services if s.next_train}
    frames = []
    for run in runs:
        by_name = run.calls.groupby("train", sort=False)
        ends = by_name.tail(1).set_index("train").reindex(list(next_of))
        begins = by_name.head(1).set_index("train").reindex(list(next_of.values()))
        late_s = ends["arrival_delay_s"].to_numpy()
        leaves_late_s = begins["departure_delay_s"].to_numpy()
        booked_s = begins["booked_departure_s"].to_numpy() - ends["booked_arrival_s"].to_numpy()
        frames.append(
            typed_frame(
                {
                    "controller": [run.controller] * len(next_of),
                    "seed": [run.seed] * len(next_of),
                    "train": list(next_of),
                    "next_train": list(next_of.values()),
                    "station": ends["station"].to_numpy(),
                    "arrival_delay_s": late_s,
                    "departure_delay_s": leaves_late_s,
                    "booked_s": booked_s,
                    "taken_s": booked_s + leaves_late_s - late_s,
                    "passed_on_s": np.maximum(np.minimum(late_s, leaves_late_s), 0.0),
                },
                TURN_BACKS,
            )
        )
    return pd.concat(frames, ignore_index=True) if frames else rows_frame([], TURN_BACKS)


def node_use_frame(scenario: Scenario, runs: Sequence[RunTables]) -> pd.DataFrame:
    """
    Return how much points and platform tracks are used in their busiest hours.

    Parameters
    ----------
    scenario
        A network and its trains.
    runs
        Runs with their trajectories.

    Returns
    -------
    pd.DataFrame
        Columns ``NODE_USE``.
    """
    rows = []
    for run in runs:
        samples = {str(train): own for train, own in by_train(run.trajectory)}
        used: dict[tuple[str, str], list[tuple[float, float]]] = {}
        for service in scenario.timetable.services:
            own = samples.get(service.train)
            if own is not None and len(own):
                _note_uses(scenario, service, own, used)
        for (kind, place), spans in sorted(used.items()):
            from_s, share = _busiest(spans)
            rows.append(
                {
                    "controller": run.controller,
                    "seed": run.seed,
                    "place": place,
                    "kind": kind,
                    "passings": len(spans),
                    "busiest_from_s": from_s,
                    "busiest_percent": 100.0 * share,
                }
            )
    return rows_frame(rows, NODE_USE)


def _note_uses(
    scenario: Scenario,
    service: Service,
    own: pd.DataFrame,
    used: dict[tuple[str, str], list[tuple[float, float]]],
) -> None:
    """Note from when to when a train is in each points zone and at each platform track."""
    line, length_m = scenario.line, scenario.train_types[service.train_type].length_m
    time_s, place_m = own["time_s"].to_numpy(), own["front_m"].to_numpy()
    direction = line.track_by_id[service.route[0]].direction
    front_m = place_m
    if direction is Direction.FALLING:
        front_m = line.start_m + line.end_m - place_m
    zones = [
        (
            ("points", line.turnouts[passage.turnout].id),
            line.fouling_m(passage.turnout, direction),
        )
        for passage in passages(line, service.route)
        if passage.turnout >= 0
    ]
    for call in service.calls:
        platform = line.platform_at[call.station, call.track]
        place = f"{call.station} {line.track_by_id[call.track].physical}"
        zones.append((("platform", place), (platform.start_m, platform.end_m)))
    for key, zone_m in zones:
        used.setdefault(key, []).append(_span_s(time_s, front_m, zone_m, length_m))


def _span_s(
    time_s: FloatArray, front_m: FloatArray, zone_m: tuple[float, float], length_m: float
) -> tuple[float, float]:
    """Return from when to when a train has a part in a zone; to its last sample at most. [s]"""
    first = min(int(np.searchsorted(front_m, zone_m[0])), time_s.size - 1)
    last = min(int(np.searchsorted(front_m, zone_m[1] + length_m)), time_s.size - 1)
    return float(time_s[first]), float(time_s[last])


def _busiest(spans: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Return when the hour begins in which most is occupied, and its share; overlaps count once."""
    merged: list[tuple[float, float]] = []
    for start_s, end_s in sorted(spans):
        if merged and start_s <= merged[-1][1]:
            merged[-1] = merged[-1][0], max(merged[-1][1], end_s)
        else:
            merged.append((start_s, end_s))
    starts_s, ends_s = np.array(merged).T
    best = (float(starts_s[0]), 0.0)
    for from_s in starts_s.tolist():
        within = np.minimum(ends_s, from_s + HOUR_S) - np.maximum(starts_s, from_s)
        share = float(np.maximum(within, 0.0).sum()) / HOUR_S
        if share > best[1] + 1e-9:
            best = from_s, share
    return best
