"""What the command ``show`` shows: the comparison, or any table, of saved results."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from kankaku.analysis.asked_results import ResultsError, known_name, read_asked, train_of
from kankaku.analysis.results import STATIONS, Results
from kankaku.analysis.tables.places_and_trains import (
    BY_STATION,
    BY_TRAIN,
    by_station,
    by_train_frame,
)
from kankaku.analysis.tables.summary import SUMMARY
from kankaku.commands.comparison_shown import show_comparison
from kankaku.commands.screen import refusals, show_warnings
from kankaku.commands.shared_options import Format
from kankaku.commands.told_tables import tell_frame
from kankaku.controllers.registry import OPERATIONS
from kankaku.railway.step.records import RAW_TABLES, Column

COMPARISON_TABLE = "comparison"
_OWN: Mapping[str, tuple[Column, ...]] = {
    "summary": SUMMARY,
    "stations": STATIONS,
    "by_station": BY_STATION,
    "by_train": BY_TRAIN,
}
_CONTROLLER = Column("controller", "str", "", "name of the controller")
NAMES = ("controller", "train", "station")
"""What a row is about stands first."""
LAST = ("seed", "initial_delay_s")
FIRST: Mapping[str, Sequence[str]] = {
    "calls": ("arrival_s", "departure_s", "arrival_delay_s", "secondary_delay_s", "dwell_delay_s"),
    "by_station": ("mean_arrival_delay_s", "interstation_stops", "mean_headway_s"),
    "by_train": ("arrival_s", "final_arrival_delay_s", "final_secondary_delay_s"),
    "remaining_stops": ("start_s", "duration_s", "cause", "first_cause", "overstay_s"),
    "trajectory": ("time_s", "front_m", "speed_mps", "reason", "cause"),
}
"""Columns that stand next, where not all of them fit on a screen."""
TABLES = (COMPARISON_TABLE, *_OWN, *RAW_TABLES)
"""What can be shown."""


def show_results(
    folder: Path, table: str, chosen: Mapping[str, Sequence[str]], seed: int | None, form: Format
) -> int:
    """
    Show a table of saved results.

    Parameters
    ----------
    folder
        Results folder.
    table
        One of ``TABLES``.
    chosen
        Names of ``controllers`` and ``trains``; everything where none is named.
    seed
        Of which seed; the first one if None. The comparison is of all.
    form
        How the table is written.

    Returns
    -------
    int
        How the command ends.
    """
    with refusals(folder, folder):
        known_name("table", table, TABLES)
        asked = read_asked(
            folder,
            controllers=chosen["controllers"],
            seed=seed,
            trajectories=table == "trajectory",
        )
        show_warnings(asked.notes)
        results = asked.results
        if table == COMPARISON_TABLE:
            names = chosen["controllers"] or results.controllers
            summary = results.summary[results.summary["controller"].isin(names)]
            told = _foretold(results), _peers(results)
            show_comparison(summary, *told, form, results.folder)
            return 0
        frame, columns = _table(results, table)
        if "train" in frame and chosen["trains"]:
            trains = [train_of(results.runs, train) for train in chosen["trains"]]
            frame = frame[frame["train"].isin(trains)]
        names = [column.name for column in columns]
        first = [name for name in NAMES if name in names]
        first += [name for name in FIRST.get(table, ()) if name in names]
        later = [name for name in names if name not in {*first, *LAST}]
        texts = sum(name in names for name in NAMES)
        tell_frame(frame, columns, form, important=[*first, *later], texts=texts)
    return 0


def _layers(results: Results) -> dict[str, dict[str, object]]:
    """Return what controllers are made of, as far as the results say what they ran."""
    known = results.provenance.get("controllers", {})
    named = known.items() if isinstance(known, dict) else ()
    return {str(name): one for name, one in named if isinstance(one, dict)}


def _foretold(results: Results) -> list[str]:
    """Return who is told the drawn dwell delays."""
    operations = {name: one.get("operation") for name, one in _layers(results).items()}
    return [
        name
        for name, operation in operations.items()
        if isinstance(operation, str)
        and operation in OPERATIONS
        and OPERATIONS[operation].knows_future
    ]


def _peers(results: Results) -> list[str]:
    """Return under whom another program drives the trains."""
    return [name for name, one in _layers(results).items() if "peer" in one]


def _table(results: Results, table: str) -> tuple[pd.DataFrame, tuple[Column, ...]]:
    if table == "by_station":
        return by_station(results.runs), BY_STATION
    if table == "by_train":
        return by_train_frame(results.runs), BY_TRAIN
    if table == "summary":
        return results.summary, SUMMARY
    if table == "stations":
        return results.stations, STATIONS
    frames = [
        run.frames[table].assign(controller=run.controller)
        for run in results.runs
        if len(run.frames[table])
    ]
    columns = (_CONTROLLER, *RAW_TABLES[table])
    if not frames:
        raise ResultsError(str(results.folder), f"the table {table} has no row", "another table")
    return pd.concat(frames, ignore_index=True)[[column.name for column in columns]], columns
