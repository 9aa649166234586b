"""Capacity in words: headways, occupation and the pattern, for a terminal."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from kankaku.analysis.tables.columns import rows_of
from kankaku.analysis.words import label_of
from kankaku.railway.plan.pattern import BUSIEST_S


def headway_texts(
    headways: pd.DataFrame, names: Mapping[str, str]
) -> tuple[list[str], list[list[str]], list[str]]:
    """
    Return the headways as a reader likes to see them.

    Parameters
    ----------
    headways
        The table ``headways``.
    names
        Names of the stations.

    Returns
    -------
    tuple[list[str], list[list[str]], list[str]]
        Header and rows: stations down, controllers across, in brackets as simulated; and
        sentences about controllers that have the same headways as one before.
    """
    by_controller = {
        str(name): rows_of(rows) for name, rows in headways.groupby("controller", sort=False)
    }
    alike: dict[tuple[float, ...], list[str]] = {}
    for name, rows in by_controller.items():
        alike.setdefault(tuple(row["blocking_time_headway_s"] for row in rows), []).append(name)
    firsts = [group[0] for group in alike.values()]
    table = [
        [names[row["station"]], f"{row['dwell_s']:.0f}"]
        + [_with_simulated(by_controller[name][place]) for name in firsts]
        for place, row in enumerate(by_controller[firsts[0]])
    ]
    notes = [
        f"As {label_of(first)}: {', '.join(map(label_of, others))}"
        for first, *others in alike.values()
        if others
    ]
    return ["station", "dwell [s]", *firsts], table, notes


def _with_simulated(row: Mapping[str, Any]) -> str:
    simulated_s = row["simulated_headway_s"]
    told = "" if np.isnan(simulated_s) else f" ({simulated_s:.1f})"
    return f"{row['blocking_time_headway_s']:.1f}{told}"


def capacity_texts(
    capacity: pd.DataFrame, names: Mapping[str, str]
) -> tuple[list[str], list[list[str]]]:
    """
    Return the capacity as a reader likes to see it.

    Parameters
    ----------
    capacity
        The table ``capacity``.
    names
        Names of the stations.

    Returns
    -------
    tuple[list[str], list[list[str]]]
        Header and rows: indicators down, controllers across.
    """
    rows = rows_of(capacity)
    told = {
        "headway of the line [s]": [f"{row['headway_s']:.1f}" for row in rows],
        "by blocking times [s]": [f"{row['blocking_time_headway_s']:.1f}" for row in rows],
        "critical station": [names[row["critical_station"]] for row in rows],
        "dwell there [s]": [f"{row['critical_dwell_s']:.0f}" for row in rows],
        "trains per hour": [f"{row['trains_per_hour']:.1f}" for row in rows],
        "scheduled speed [km/h]": [f"{row['scheduled_speed_kmh']:.1f}" for row in rows],
        "transport capacity": [f"{row['transport_capacity']:,.0f}" for row in rows],
        "level": [row["level"] or "-" for row in rows],
        "occupation [%]": [_percent(row["occupation_percent"]) for row in rows],
        "busiest hour [%]": [_percent(row["busiest_occupation_percent"]) for row in rows],
    }
    header = ["indicator", *capacity["controller"].tolist()]
    return header, [[name, *cells] for name, cells in told.items()]


def pattern_text(capacity: pd.DataFrame) -> str:
    """
    Return whose pattern the headways are of, and why.

    Parameters
    ----------
    capacity
        The table ``capacity``.

    Returns
    -------
    str
        A sentence.
    """
    row = rows_of(capacity)[0]
    begin_s = row["busiest_begin_s"]
    return (
        f"Pattern: train {row['train']}, for {row['pattern_trains']} of "
        f"{row['busiest_trains']} trains of the busiest hour ({_clock(begin_s)} to "
        f"{_clock(begin_s + BUSIEST_S)} at their last stations), with the median of their booked "
        f"dwells, {row['pattern_dwell_s']:.0f} s behind the first station"
    )


def _clock(time_s: float) -> str:
    minutes = int(time_s // 60.0)
    return f"{minutes // 60:02d}:{minutes % 60:02d}"


def _percent(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.1f}"
