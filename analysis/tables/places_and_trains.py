"""What happened at each station, and to each train: a row for each in every run."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import pandas as pd

from kankaku.analysis.tables.columns import rows_frame, typed_frame
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.railway.arrays import FloatArray
from kankaku.railway.step.records import Column

_RUN = (
    Column("controller", "str", "", "name of the controller"),
    Column("seed", "int64", "", "seed of the run"),
    Column("initial_delay_s", "float64", "s", "by how much the train of a sweep overstays"),
)
BY_STATION = (
    *_RUN,
    Column("station", "str", "", "station identifier"),
    Column("calls", "int64", "", "booked calls"),
    Column("arrivals", "int64", "", "calls that were reached"),
    Column("mean_arrival_delay_s", "float64", "s", "mean over its calls"),
    Column("largest_arrival_delay_s", "float64", "s", "the largest of them"),
    Column("mean_departure_delay_s", "float64", "s", "mean over its calls"),
    Column("primary_delay_s", "float64", "s", "injected dwell beyond the booked slack, sum"),
    Column("secondary_delay_s", "float64", "s", "what arriving trains owe to others, mean"),
    Column("mean_dwell_s", "float64", "s", "from arrival to departure"),
    Column("least_headway_s", "float64", "s", "between departures from one of its tracks"),
    Column("mean_headway_s", "float64", "s", "the same, mean"),
    Column("interstation_stops", "int64", "", "stops between stations of trains running to it"),
    Column("interstation_stop_time_s", "float64", "s", "how long they stood"),
)
BY_TRAIN = (
    *_RUN,
    Column("train", "str", "", "train number"),
    Column("origin", "str", "", "station of its first call"),
    Column("destination", "str", "", "station of its last call"),
    Column("booked_departure_s", "float64", "s", "from the origin", clock=True),
    Column("departure_s", "float64", "s", "actually; empty if never", clock=True),
    Column("booked_arrival_s", "float64", "s", "at the destination", clock=True),
    Column("arrival_s", "float64", "s", "actually; empty if never", clock=True),
    Column("final_arrival_delay_s", "float64", "s", "at the destination"),
    Column("largest_arrival_delay_s", "float64", "s", "at any call"),
    Column("primary_delay_s", "float64", "s", "injected dwell beyond the booked slack, sum"),
    Column("final_secondary_delay_s", "float64", "s", "what it owes to others at its last call"),
    Column("largest_secondary_delay_s", "float64", "s", "the most of that at any call"),
    Column("interstation_stops", "int64", "", "stops between stations"),
    Column("interstation_stop_time_s", "float64", "s", "how long it stood there"),
    Column("interstation_crawl_time_s", "float64", "s", "below 10 km/h off platforms, with stops"),
    Column("net_kwh", "float64", "kWh", "energy, gross minus recovered"),
    Column("completed", "bool", "", "left where its service ends"),
)
PLACES_AND_TRAINS: Mapping[str, tuple[Column, ...]] = {
    "by_station": BY_STATION,
    "by_train": BY_TRAIN,
}


def by_station(runs: Iterable[RunTables]) -> pd.DataFrame:
    """
    Return what happened at each station.

    Parameters
    ----------
    runs
        In the order in which they are to appear.

    Returns
    -------
    pd.DataFrame
        Columns ``BY_STATION``, stations of a run in the order in which trains first call there.
    """
    return rows_frame((row for run in runs for row in _stations(run)), BY_STATION)


def _stations(run: RunTables) -> Iterable[dict[str, object]]:
    stops = run.interstation_stops.groupby("next_station")["duration_s"].agg(["size", "sum"])
    for station, calls in run.calls.groupby("station", sort=False):
        headways_s = _headways_s(calls)
        own = stops.loc[stops.index == station]
        yield {
            "controller": run.controller,
            "seed": run.seed,
            "initial_delay_s": run.initial_delay_s,
            "station": station,
            "calls": len(calls),
            "arrivals": int(calls["arrival_s"].notna().sum()),
            "mean_arrival_delay_s": calls["arrival_delay_s"].mean(),
            "largest_arrival_delay_s": calls["arrival_delay_s"].max(),
            "mean_departure_delay_s": calls["departure_delay_s"].mean(),
            "primary_delay_s": calls["primary_delay_s"].sum(),
            "secondary_delay_s": calls["secondary_delay_s"].mean(),
            "mean_dwell_s": (calls["departure_s"] - calls["arrival_s"]).mean(),
            "least_headway_s": headways_s.min() if headways_s.size else np.nan,
            "mean_headway_s": headways_s.mean() if headways_s.size else np.nan,
            "interstation_stops": int(own["size"].sum()),
            "interstation_stop_time_s": own["sum"].sum(),
        }


def _headways_s(calls: pd.DataFrame) -> FloatArray:
    """Return the times between departures that follow each other from one track. [s]"""
    parts = [
        np.diff(np.sort(own["departure_s"].dropna().to_numpy()))
        for _, own in calls.groupby("track", sort=False)
    ]
    return np.concatenate(parts) if parts else np.zeros(0)


def by_train_frame(runs: Sequence[RunTables]) -> pd.DataFrame:
    """
    Return what happened to each train.

    Parameters
    ----------
    runs
        In the order in which they are to appear.

    Returns
    -------
    pd.DataFrame
        Columns ``BY_TRAIN``, trains of a run in the order of the table ``calls``.
    """
    parts = [_trains(run) for run in runs]
    if not parts:
        return rows_frame([], BY_TRAIN)
    return pd.concat(parts, ignore_index=True)


def _trains(run: RunTables) -> pd.DataFrame:
    calls = run.calls.sort_values("sequence", kind="stable").groupby("train", sort=False)
    first, last = calls.nth(0).set_index("train"), calls.nth(-1).set_index("train")
    trains = list(dict.fromkeys(run.calls["train"]))
    first, last = first.loc[trains], last.loc[trains]
    stops = run.interstation_stops.groupby("train")["duration_s"].agg(["size", "sum"])
    stops = stops.reindex(trains, fill_value=0)
    energy = run.energy.drop_duplicates("train").set_index("train").reindex(trains)
    return typed_frame(
        {
            "controller": [run.controller] * len(trains),
            "seed": [run.seed] * len(trains),
            "initial_delay_s": [run.initial_delay_s] * len(trains),
            "train": trains,
            "origin": first["station"].tolist(),
            "destination": last["station"].tolist(),
            "booked_departure_s": first["booked_departure_s"].to_numpy(),
            "departure_s": first["departure_s"].to_numpy(),
            "booked_arrival_s": last["booked_arrival_s"].to_numpy(),
            "arrival_s": last["arrival_s"].to_numpy(),
            "final_arrival_delay_s": last["arrival_delay_s"].to_numpy(),
            "largest_arrival_delay_s": calls["arrival_delay_s"].max().loc[trains].to_numpy(),
            "primary_delay_s": calls["primary_delay_s"].sum().loc[trains].to_numpy(),
            "final_secondary_delay_s": last["secondary_delay_s"].to_numpy(),
            "largest_secondary_delay_s": calls["secondary_delay_s"].max().loc[trains].to_numpy(),
            "interstation_stops": stops["size"].astype("int64").tolist(),
            "interstation_stop_time_s": stops["sum"].to_numpy(),
            "interstation_crawl_time_s": energy["interstation_crawl_time_s"].to_numpy(),
            "net_kwh": energy["net_kwh"].to_numpy(),
            "completed": [value is True or value == 1 for value in energy["completed"].tolist()],
        },
        BY_TRAIN,
    )
