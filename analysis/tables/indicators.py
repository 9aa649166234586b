"""
The indicators of a run, each declared once: name, unit, meaning, label, and what works it out.

Summary, comparison, report and documentation follow from what stands here: another indicator is
one more entry of :data:`INDICATORS`.
"""

from collections.abc import Callable, Mapping
from enum import IntEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pandas as pd

from kankaku.analysis.tables.delay import Propagation, propagation
from kankaku.analysis.tables.energy import EnergyTotals, energy_totals
from kankaku.analysis.tables.interstation import StopTotals, stop_totals
from kankaku.analysis.tables.intervals import departure_arrival_intervals
from kankaku.analysis.tables.run_tables import RunTables
from kankaku.railway.step.records import Column


class MeasuredRun:
    """A run, and what several indicators need of it."""

    def __init__(self, run: RunTables) -> None:
        self.run = run

    @cached_property
    def stops(self) -> StopTotals:
        """Stops between stations."""
        return stop_totals(self.run.interstation_stops)

    @cached_property
    def spread(self) -> Propagation:
        """How delay spreads."""
        return propagation(self.run.calls)

    @cached_property
    def energy(self) -> EnergyTotals:
        """Energy of all trains."""
        return energy_totals(self.run.energy)

    @cached_property
    def arrivals(self) -> pd.DataFrame:
        """All calls but origins."""
        return self.run.calls[self.run.calls["sequence"] > 0]

    @cached_property
    def bounds_s(self) -> pd.Series:
        """Bounds of the delays of all arrivals; of unreached ones late until the run's end, too."""
        arrivals = self.arrivals
        bounds_s = arrivals["arrival_bound_s"] - arrivals["booked_arrival_s"]
        never = arrivals["arrival_s"].isna()
        least_s = bounds_s.where(~never, np.minimum(bounds_s, arrivals["arrival_delay_s"]))
        return least_s.where(arrivals["arrival_delay_s"].notna())

    @cached_property
    def last_arrivals(self) -> pd.DataFrame:
        """Calls at the last station; of a line with both directions every train's last one."""
        if (self.run.calls.groupby("train", sort=False)["stop_m"].diff() < 0.0).any():
            return self.arrivals.groupby("train", sort=False).tail(1)
        at_end = self.arrivals[self.arrivals["stop_m"] == self.arrivals["stop_m"].max()]
        return self.arrivals[self.arrivals["station"].isin(at_end["station"])]


class Topic(IntEnum):
    """What an indicator is about; controllers are compared topic by topic."""

    TRAINS = 0
    STOPS = 1
    DELAY = 2
    ENERGY = 3
    RIDE = 4
    SAFETY = 5


class Indicator(NamedTuple):
    """One number of a run."""

    topic: Topic
    column: Column
    of: Callable[[MeasuredRun], object]
    label: str = ""
    """What a reader calls it; empty for one that is not compared."""
    per_cent_above: float = 0.0
    """Changes are told in per cent of a baseline above this. In the indicator's unit"""
    rare: bool = False
    """Left out of comparisons in which it is 0 in every run."""
    sense: int = -1
    """Below 0 less is better, above 0 more; 0 where it tells nothing of a control. [-]"""


def _scheduled_speed_kmh(measured: MeasuredRun) -> float:
    by_train = measured.run.calls.groupby("train", sort=False)
    first = by_train[["stop_m", "departure_s"]].nth(0).to_numpy()
    last = by_train[["stop_m", "arrival_s"]].nth(-1).to_numpy()
    distance_m, time_s = (last - first).T
    distance_m = np.abs(distance_m)
    arrived = np.isfinite(time_s) & (time_s > 0.0)
    if not arrived.any():
        return np.nan
    return 3.6 * float(distance_m[arrived].sum() / time_s[arrived].sum())


INDICATORS = (
    Indicator(
        Topic.TRAINS,
        Column("trains", "int64", "", "trains of the timetable"),
        lambda measured: len(measured.run.energy),
    ),
    Indicator(
        Topic.TRAINS,
        Column("trains_completed", "int64", "", "trains that left where their service ends"),
        lambda measured: int(measured.run.energy["completed"].sum()),
    ),
    Indicator(
        Topic.STOPS,
        Column(
            "interstation_stop_time_s", "float64", "s", "running trains at a stand for 1 s or more"
        ),
        lambda measured: measured.stops.time_s,
        "stop time between stations",
        10.0,
    ),
    Indicator(
        Topic.STOPS,
        Column("interstation_stops", "int64", "", "how often"),
        lambda measured: measured.stops.stops,
        "stops between stations",
        1.0,
    ),
    Indicator(
        Topic.STOPS,
        Column("interstation_stop_trains", "int64", "", "how many different trains"),
        lambda measured: measured.stops.trains,
    ),
    Indicator(
        Topic.STOPS,
        Column(
            "interstation_crawl_time_s",
            "float64",
            "s",
            "below 10 km/h off its platforms, with stops",
        ),
        lambda measured: measured.run.energy["interstation_crawl_time_s"].sum(),
        "crawl between stations",
        10.0,
    ),
    Indicator(
        Topic.STOPS,
        Column("held_open_time_s", "float64", "s", "held at platforms by supervision, doors open"),
        lambda measured: measured.run.calls["held_open_s"].sum(),
        "held at platforms, doors open",
        10.0,
        rare=True,
    ),
    Indicator(
        Topic.STOPS,
        Column(
            "held_closed_time_s", "float64", "s", "held at platforms by supervision, doors closed"
        ),
        lambda measured: measured.run.calls["held_closed_s"].sum(),
        "held at platforms, doors closed",
        10.0,
        rare=True,
    ),
    Indicator(
        Topic.STOPS,
        Column(
            "closed_doors_time_s",
            "float64",
            "s",
            "standing at platforms after the stop is over",
        ),
        lambda measured: measured.run.calls["closed_doors_s"].sum(),
        "standing at platforms, doors closed",
        10.0,
    ),
    Indicator(
        Topic.DELAY,
        Column(
            "mean_arrival_delay_s",
            "float64",
            "s",
            "mean over all calls but origins; early < 0; unreached ones late until the run's end",
        ),
        lambda measured: measured.arrivals["arrival_delay_s"].mean(),
        "mean arrival delay",
        5.0,
    ),
    Indicator(
        Topic.DELAY,
        Column(
            "mean_delay_bound_s",
            "float64",
            "s",
            "least mean arrival delay of any control over this protection; trains in their order, "
            "and as hurried, as they were",
        ),
        lambda measured: measured.bounds_s.mean(),
        "bound of the mean arrival delay",
        5.0,
        sense=0,
    ),
    Indicator(
        Topic.DELAY,
        Column(
            "delay_above_bound_s",
            "float64",
            "s",
            "mean arrival delay less that bound: what is left for a better control",
        ),
        lambda measured: (measured.arrivals["arrival_delay_s"] - measured.bounds_s).mean(),
        "mean arrival delay above the bound",
        5.0,
    ),
    Indicator(
        Topic.DELAY,
        Column(
            "mean_arrival_lateness_s", "float64", "s", "mean over the same calls; early ones are 0"
        ),
        lambda measured: measured.arrivals["arrival_delay_s"].clip(lower=0.0).mean(),
        per_cent_above=5.0,
    ),
    Indicator(
        Topic.DELAY,
        Column(
            "final_arrival_delay_s",
            "float64",
            "s",
            "mean over trains at the last station; who never came is late until the run's end",
        ),
        lambda measured: measured.last_arrivals["arrival_delay_s"].mean(),
        "delay at the last station",
        5.0,
    ),
    Indicator(
        Topic.DELAY,
        Column(
            "primary_delay_s", "float64", "s", "injected dwell beyond the booked slack, all calls"
        ),
        lambda measured: measured.spread.primary_delay_s,
    ),
    Indicator(
        Topic.DELAY,
        Column(
            "secondary_delay_s", "float64", "s", "lateness owed to others at each train's last call"
        ),
        lambda measured: measured.spread.secondary_delay_s,
        "secondary delay",
        30.0,
    ),
    Indicator(
        Topic.DELAY,
        Column("propagation_ratio", "float64", "", "secondary over primary delay"),
        lambda measured: measured.spread.ratio,
    ),
    Indicator(
        Topic.DELAY,
        Column(
            "trains_affected", "int64", "", "trains made more than 10 s late by others at a call"
        ),
        lambda measured: measured.spread.trains_affected,
    ),
    Indicator(
        Topic.DELAY,
        Column("recovery_time_s", "float64", "s", "from first to last event more than 60 s late"),
        lambda measured: measured.spread.recovery_time_s,
    ),
    Indicator(
        Topic.DELAY,
        Column(
            "shortest_interval_s", "float64", "s", "leader's departure to arrival, same platform"
        ),
        lambda measured: departure_arrival_intervals(measured.run.calls)["interval_s"].min(),
    ),
    Indicator(
        Topic.RIDE,
        Column("scheduled_speed_kmh", "float64", "km/h", "distance over time, dwells included"),
        _scheduled_speed_kmh,
        "scheduled speed",
        1.0,
        sense=1,
    ),
    Indicator(
        Topic.ENERGY,
        Column("energy_gross_kwh", "float64", "kWh", "traction work / efficiency + auxiliaries"),
        lambda measured: measured.energy.gross_kwh,
        "energy, gross",
        1.0,
    ),
    Indicator(
        Topic.ENERGY,
        Column("energy_recovered_kwh", "float64", "kWh", "recovered braking work x efficiency"),
        lambda measured: measured.energy.recovered_kwh,
    ),
    Indicator(
        Topic.ENERGY,
        Column("energy_net_kwh", "float64", "kWh", "gross minus recovered"),
        lambda measured: measured.energy.net_kwh,
        "energy, net",
        1.0,
    ),
    Indicator(
        Topic.RIDE,
        Column(
            "jerk_mps3", "float64", "m/s3", "change of acceleration, mean of the trains' r.m.s."
        ),
        lambda measured: measured.run.energy["jerk_mps3"].mean(),
        "jerk, r.m.s.",
        0.01,
    ),
    Indicator(
        Topic.SAFETY,
        Column(
            "violations", "int64", "", "safety invariants that did not hold, collisions included"
        ),
        lambda measured: len(measured.run.violations),
    ),
    Indicator(
        Topic.SAFETY,
        Column("collisions", "int64", "", "those of them that are collisions"),
        lambda measured: int((measured.run.violations["kind"] == "collision").sum()),
    ),
)
"""All indicators of a run, in the order of the summary."""
INDICATOR_OF: Mapping[str, Indicator] = {item.column.name: item for item in INDICATORS}
COMPARED: Mapping[str, Indicator] = {
    item.column.name: item for item in sorted(INDICATORS, key=lambda item: item.topic) if item.label
}
"""Those that controllers are compared by, topic by topic."""
