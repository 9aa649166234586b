"""Failures, stopped time, availability and fault trees as tables."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from kankaku.analysis.tables.columns import rows_frame
from kankaku.railway.failures.availability import (
    Configuration,
    Estimate,
    Outages,
    availability,
    estimate,
)
from kankaku.railway.failures.fault_tree import (
    FaultTree,
    joint_probability,
    minimal_cut_sets,
    top_probability,
)
from kankaku.railway.step.records import Column

HOUR_S = 3600.0
GIGAHOURS = 1e9
AVAILABILITY = (
    Column("system", "str", "", "system"),
    Column("devices", "float64", "", "devices in all; not whole if one counts as a fraction"),
    Column("failures_per_year", "float64", "1/a", "failures of any device"),
    Column("published_failures_per_year", "float64", "1/a", "the same as published; may be empty"),
    Column("stopped_h_per_year", "float64", "h/a", "hours of repair times share of line stopped"),
    Column("published_stopped_h_per_year", "float64", "h/a", "the same as published"),
    Column("mean_repair_h", "float64", "h", "stopped hours per failure"),
    Column("published_mean_repair_h", "float64", "h", "the same as published"),
    Column("availability_percent", "float64", "%", "share of the year not stopped"),
    Column("published_availability_percent", "float64", "%", "the same as published"),
)
OUTAGES = (
    Column("system", "str", "", "system"),
    Column("indicator", "str", "", "what is counted"),
    Column("unit", "str", "", "its unit"),
    Column("years", "int64", "", "simulated years"),
    Column("mean", "float64", "", "mean of these years"),
    Column("half_width", "float64", "", "half width of the 99 % interval of the mean"),
    Column("closed_form", "float64", "", "the same by multiplication; empty where there is none"),
)
TOP_EVENTS = (
    Column("top", "str", "", "top event"),
    Column("title", "str", "", "what it is"),
    Column("rate_per_1e9_h", "float64", "1e-9/h", "probability per hour, times a thousand million"),
    Column("cut_sets", "int64", "", "minimal cut sets"),
)
CUT_SETS = (
    Column("top", "str", "", "top event"),
    Column("events", "str", "", "events that bring it about together, joined by +"),
    Column("order", "int64", "", "how many they are"),
    Column("rate_per_1e9_h", "float64", "1e-9/h", "their joint probability per hour, times 1e9"),
    Column("share_percent", "float64", "%", "joint probability over that of the top event"),
)
DEPENDABILITY_TABLES: Mapping[str, tuple[Column, ...]] = {
    "availability": AVAILABILITY,
    "outages": OUTAGES,
    "top_events": TOP_EVENTS,
    "cut_sets": CUT_SETS,
}
ROWS: Mapping[str, tuple[str, int]] = {
    "failures_per_year": ("failures per year", 2),
    "stopped_h_per_year": ("stopped hours per year", 2),
    "mean_repair_h": ("mean time to repair [h]", 2),
    "availability_percent": ("availability [%]", 3),
}
"""Label and printed decimals of the published figures (Sugiyama et al. 2018, table 6)."""


@dataclass(frozen=True, slots=True, eq=False)
class Endurance:
    """A system by multiplication and by simulated years."""

    configuration: Configuration
    outages: Outages

    @property
    def told(self) -> Mapping[str, float]:
        """What the published table shows, in its units."""
        found = availability(self.configuration)
        return {
            "failures_per_year": found.failures_per_year,
            "stopped_h_per_year": found.stopped_s_per_year / HOUR_S,
            "mean_repair_h": found.mean_repair_s / HOUR_S,
            "availability_percent": 100.0 * found.availability,
        }

    @property
    def estimates(self) -> Mapping[str, tuple[str, Estimate]]:
        """Unit and estimate by indicator."""
        years = self.outages
        return {
            "failures_per_year": ("1/a", estimate(years.failures)),
            "stopped_h_per_year": ("h/a", estimate(years.stopped_s / HOUR_S)),
            "whole_stops_per_year": ("1/a", estimate(years.whole_stops)),
            "whole_stopped_h_per_year": ("h/a", estimate(years.whole_stopped_s / HOUR_S)),
        }


def availability_frame(found: Iterable[Endurance]) -> pd.DataFrame:
    """
    Return failures, stopped hours, repair time and availability, ours beside the published.

    Parameters
    ----------
    found
        One per system.

    Returns
    -------
    pd.DataFrame
        Columns ``AVAILABILITY``.
    """
    rows = []
    for system in found:
        groups, published = system.configuration.groups, system.configuration.published
        row: dict[str, object] = {
            "system": system.configuration.name,
            "devices": sum(group.count for group in groups),
            **system.told,
        }
        row |= {f"published_{name}": published.get(name, np.nan) for name in ROWS}
        rows.append(row)
    return rows_frame(rows, AVAILABILITY)


def outages_frame(found: Iterable[Endurance]) -> pd.DataFrame:
    """
    Return what the simulated years show, with confidence.

    Parameters
    ----------
    found
        One per system.

    Returns
    -------
    pd.DataFrame
        Columns ``OUTAGES``.
    """
    rows = [
        {
            "system": system.configuration.name,
            "indicator": indicator,
            "unit": unit,
            "years": system.outages.failures.size,
            "mean": estimated.mean,
            "half_width": estimated.half_width,
            "closed_form": system.told.get(indicator, np.nan),
        }
        for system in found
        for indicator, (unit, estimated) in system.estimates.items()
    ]
    return rows_frame(rows, OUTAGES)


def per_gigahour(tree: FaultTree, probability: float) -> float:
    """Return how often an event of the tree comes. [1/Gh]"""
    return probability / (tree.period_s / HOUR_S) * GIGAHOURS


def top_events_frame(tree: FaultTree) -> pd.DataFrame:
    """
    Return how likely the top events are.

    Parameters
    ----------
    tree
        The fault tree.

    Returns
    -------
    pd.DataFrame
        Columns ``TOP_EVENTS``.
    """
    rows = (
        {
            "top": top,
            "title": tree.gates[top].title,
            "rate_per_1e9_h": per_gigahour(tree, top_probability(tree, top)),
            "cut_sets": len(minimal_cut_sets(tree, top)),
        }
        for top in tree.tops
    )
    return rows_frame(rows, TOP_EVENTS)


def cut_sets_frame(tree: FaultTree) -> pd.DataFrame:
    """
    Return the minimal cut sets, likeliest first.

    Parameters
    ----------
    tree
        The fault tree.

    Returns
    -------
    pd.DataFrame
        Columns ``CUT_SETS``.
    """
    rows = []
    for top in tree.tops:
        whole = top_probability(tree, top)
        for events in minimal_cut_sets(tree, top):
            joint = joint_probability(tree, events)
            rows.append(
                {
                    "top": top,
                    "events": " + ".join(in_order(tree, events)),
                    "order": len(events),
                    "rate_per_1e9_h": per_gigahour(tree, joint),
                    "share_percent": 100.0 * joint / whole if whole else 0.0,
                }
            )
    return rows_frame(rows, CUT_SETS)


def in_order(tree: FaultTree, events: frozenset[str]) -> list[str]:
    """Return events in the order of the tree's file."""
    return [name for name in tree.events if name in events]
