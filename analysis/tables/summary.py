"""One row of indicators per run, computed from the raw tables alone."""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from kankaku.analysis.tables.columns import rows_frame
from kankaku.analysis.tables.delay import propagation
from kankaku.analysis.tables.energy import energy_totals
from kankaku.analysis.tables.interstation import stop_totals
from kankaku.analysis.tables.intervals import departure_arrival_intervals
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.railway.step.records import Column

SUMMARY = (
    Column("controller", "str", "", "name of the controller"),
    Column("seed", "int64", "", "seed of the dwell delays"),
    Column("initial_delay_s", "float64", "s", "swept delay of one train; 0 without a sweep"),
    Column("trains", "int64", "", "trains of the timetable"),
    Column("trains_completed", "int64", "", "trains that left where their service ends"),
    Column("interstation_stop_time_s", "float64", "s", "running trains at a stand for 1 s or more"),
    Column("interstation_stops", "int64", "", "how often"),
    Column("interstation_stop_trains", "int64", "", "how many different trains"),
    Column(
        "interstation_crawl_time_s", "float64", "s", "below 10 km/h off its platforms, with stops"
    ),
    Column(
        "mean_arrival_delay_s",
        "float64",
        "s",
        "mean over all calls but origins; early < 0; unreached ones late until the run's end",
    ),
    Column(
        "final_arrival_delay_s",
        "float64",
        "s",
        "mean over trains at the last station; who never came is late until the run's end",
    ),
    Column("primary_delay_s", "float64", "s", "injected dwell beyond the booked slack, all calls"),
    Column(
        "secondary_delay_s", "float64", "s", "lateness owed to others at each train's last call"
    ),
    Column("propagation_ratio", "float64", "", "secondary over primary delay"),
    Column("trains_affected", "int64", "", "trains made more than 10 s late by others at a call"),
    Column("recovery_time_s", "float64", "s", "from first to last event more than 60 s late"),
    Column("shortest_interval_s", "float64", "s", "leader's departure to arrival, same platform"),
    Column("scheduled_speed_kmh", "float64", "km/h", "distance over time, dwells included"),
    Column("energy_gross_kwh", "float64", "kWh", "traction work / efficiency + auxiliaries"),
    Column("energy_recovered_kwh", "float64", "kWh", "recovered braking work x efficiency"),
    Column("energy_net_kwh", "float64", "kWh", "gross minus recovered"),
    Column("jerk_mps3", "float64", "m/s3", "change of acceleration, mean of the trains' r.m.s."),
    Column("violations", "int64", "", "safety invariants that did not hold, collisions included"),
    Column("collisions", "int64", "", "those of them that are collisions"),
)


def summary_frame(runs: Iterable[RunTables]) -> pd.DataFrame:
    """
    Return the table ``summary``.

    Parameters
    ----------
    runs
        Runs in the order in which they are to appear; the first controller is the baseline.

    Returns
    -------
    pd.DataFrame
        Columns ``SUMMARY``, one row per run.
    """
    return rows_frame((_summary_row(run) for run in runs), SUMMARY)


def _summary_row(run: RunTables) -> dict[str, object]:
    stops = stop_totals(run.interstation_stops)
    spread = propagation(run.calls)
    energy = energy_totals(run.energy)
    arrivals = run.calls[run.calls["sequence"] > 0]
    at_end = arrivals[arrivals["stop_m"] == arrivals["stop_m"].max()]
    end = arrivals[arrivals["station"].isin(at_end["station"])]
    intervals = departure_arrival_intervals(run.calls)
    return {
        "controller": run.controller,
        "seed": run.seed,
        "initial_delay_s": run.initial_delay_s,
        "trains": len(run.energy),
        "trains_completed": int(run.energy["completed"].sum()),
        "interstation_stop_time_s": stops.time_s,
        "interstation_stops": stops.stops,
        "interstation_stop_trains": stops.trains,
        "interstation_crawl_time_s": run.energy["interstation_crawl_time_s"].sum(),
        "mean_arrival_delay_s": arrivals["arrival_delay_s"].mean(),
        "final_arrival_delay_s": end["arrival_delay_s"].mean(),
        "primary_delay_s": spread.primary_delay_s,
        "secondary_delay_s": spread.secondary_delay_s,
        "propagation_ratio": spread.ratio,
        "trains_affected": spread.trains_affected,
        "recovery_time_s": spread.recovery_time_s,
        "shortest_interval_s": intervals["interval_s"].min(),
        "scheduled_speed_kmh": _scheduled_speed_kmh(run.calls),
        "energy_gross_kwh": energy.gross_kwh,
        "energy_recovered_kwh": energy.recovered_kwh,
        "energy_net_kwh": energy.net_kwh,
        "jerk_mps3": run.energy["jerk_mps3"].mean(),
        "violations": len(run.violations),
        "collisions": int((run.violations["kind"] == "collision").sum()),
    }


def _scheduled_speed_kmh(calls: pd.DataFrame) -> float:
    by_train = calls.groupby("train", sort=False)
    first = by_train[["stop_m", "departure_s"]].nth(0).to_numpy()
    last = by_train[["stop_m", "arrival_s"]].nth(-1).to_numpy()
    distance_m, time_s = (last - first).T
    arrived = np.isfinite(time_s) & (time_s > 0.0)
    if not arrived.any():
        return np.nan
    return 3.6 * float(distance_m[arrived].sum() / time_s[arrived].sum())
