"""Reading a results folder in one call, for notebooks and scripts."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from kankaku.analysis.tables.columns import read_csv, rows_frame, written_columns
from kankaku.analysis.tables.network_tables import NETWORK_TABLES
from kankaku.analysis.tables.places_and_trains import PLACES_AND_TRAINS
from kankaku.analysis.tables.run_tables import RunTables, read_run
from kankaku.analysis.tables.summary import SUMMARY
from kankaku.analysis.tables.sweep import SWEPT_TABLES, read_intervals, read_sweep
from kankaku.railway.places import name_problem
from kankaku.railway.plan.line import Line
from kankaku.railway.step.records import RAW_TABLES, Column

STATIONS = (
    Column("station", "str", "", "station identifier"),
    Column("name", "str", "", "name in Latin letters; ' stands before = + - @ at its beginning"),
    Column("name_local", "str", "", "name in local letters; ' stands before = + - @ likewise"),
    Column("chainage_m", "float64", "m", "official chainage"),
)
COLUMNS = (
    Column("table", "str", "", "table"),
    Column("column", "str", "", "column"),
    Column("dtype", "str", "", "type in memory"),
    Column("unit", "str", "", "unit; empty for texts and counts"),
    Column("meaning", "str", "", "meaning"),
)
RESULT_FILES = ("summary.csv", "columns.csv")
"""Every results folder of a run has them."""
RUN_RECORD = "run.json"
"""What a finished run was made from, beside its tables."""
UNFINISHED = ".unfinished"
"""Folder for temporary files in a results folder; the next command there removes it."""
FAILURES = "failures"
"""Folder with a text for each run that failed."""
RUN_PLACES = ("*", "*/seed_*", "*/delay_*")
"""Where runs may lie in a results folder."""
WRITTEN_TABLES: Mapping[str, tuple[Column, ...]] = {
    "summary": SUMMARY,
    "stations": STATIONS,
    **PLACES_AND_TRAINS,
    **RAW_TABLES,
}
"""Every table of a results folder; a sweep has ``SWEPT_TABLES``, a network ``NETWORK_TABLES``."""


@dataclass(frozen=True, slots=True, eq=False)
class Results:
    """A results folder in memory."""

    folder: Path
    summary: pd.DataFrame
    columns: pd.DataFrame
    stations: pd.DataFrame
    runs: tuple[RunTables, ...]
    """In the order of the summary: controllers as the scenario names them, then seeds, delays."""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    intervals: pd.DataFrame | None = None
    """The table ``intervals``; None without a sweep."""
    sweep: pd.DataFrame | None = None
    """The table ``sweep``; None without a sweep."""
    network: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    """The tables of ``NETWORK_TABLES`` by name; none of a chain."""

    @property
    def controllers(self) -> tuple[str, ...]:
        """Names of the controllers, baseline first."""
        return tuple(dict.fromkeys(run.controller for run in self.runs))

    def run(
        self, controller: str, seed: int | None = None, initial_delay_s: float | None = None
    ) -> RunTables:
        """
        Return one run.

        Parameters
        ----------
        controller
            Name of its controller.
        seed
            Its seed; by default the first. [-]
        initial_delay_s
            By how much the train of a sweep overstays; by default the first. [s]

        Returns
        -------
        RunTables
            Its raw tables.

        Raises
        ------
        KeyError
            If there is no such run.
        """
        for run in self.runs:
            wanted = seed in {None, run.seed} and initial_delay_s in {None, run.initial_delay_s}
            if run.controller == controller and wanted:
                return run
        known = dict.fromkeys(f"{run.controller} (seed {run.seed})" for run in self.runs)
        delays = dict.fromkeys(f"{run.initial_delay_s:g}" for run in self.runs)
        msg = (
            f"no run of {controller!r} with seed {seed} and initial delay {initial_delay_s} in "
            f"{self.folder}; there are: {', '.join(known)}; initial delays [s]: {', '.join(delays)}"
        )
        raise KeyError(msg)


def run_folder(
    folder: Path,
    controller: str,
    seed: int,
    initial_delay_s: float | None = None,
    *,
    seeds: int,
) -> Path:
    """
    Return where the raw tables of a run lie.

    Parameters
    ----------
    folder
        Results folder.
    controller
        Name of the controller.
    seed
        Seed of the run. [-]
    initial_delay_s
        By how much the train of a sweep overstays; None without a sweep. [s]
    seeds
        How many seeds each controller runs. [-]

    Returns
    -------
    Path
        ``<controller>`` for one seed, ``<controller>/seed_<seed>`` for several, and
        ``<controller>/delay_<seconds>s`` in a sweep, sorted as the delays.

    Raises
    ------
    ValueError
        If the name of the controller leads elsewhere.
    """
    if problem := name_problem(controller):
        msg = f"controller {controller!r} {problem}"
        raise ValueError(msg)
    own = folder / controller
    if initial_delay_s is not None:
        return own / f"delay_{initial_delay_s:05.1f}s"
    return own if seeds == 1 else own / f"seed_{seed}"


def stations_frame(line: Line) -> pd.DataFrame:
    """
    Return the stations of a line.

    Parameters
    ----------
    line
        The line.

    Returns
    -------
    pd.DataFrame
        Columns ``STATIONS``, in running direction.
    """
    rows = (
        {
            "station": station.id,
            "name": station.name,
            "name_local": station.name_local,
            "chainage_m": station.chainage_m,
        }
        for station in sorted(line.stations, key=lambda station: station.chainage_m)
    )
    return rows_frame(rows, STATIONS)


def columns_frame(tables: Mapping[str, tuple[Column, ...]] = WRITTEN_TABLES) -> pd.DataFrame:
    """
    Return what every column of every written table means.

    Parameters
    ----------
    tables
        Declared columns by table.

    Returns
    -------
    pd.DataFrame
        Columns ``COLUMNS``.
    """
    rows = (
        {
            "table": table,
            "column": column.name,
            "dtype": column.dtype,
            "unit": column.unit,
            "meaning": column.meaning,
        }
        for table, columns in tables.items()
        for column in written_columns(columns)
    )
    return rows_frame(rows, COLUMNS)


def refuse_foreign(folder: Path, files: Sequence[str]) -> None:
    """
    Raise an error if something else stands where results would go.

    Parameters
    ----------
    folder
        Any path.
    files
        What every results folder of the kind has.

    Raises
    ------
    FileExistsError
        If there is something, neither such results nor finished runs nor an empty folder, or if
        its place is no folder.
    """
    nearest = next(place for place in folder.absolute().parents if place.exists())
    if not nearest.is_dir():
        msg = f"{nearest}: is no folder; choose another one"
        raise FileExistsError(msg)
    # Who was killed, or failed, may have left no more than this.
    empty = folder.is_dir() and {item.name for item in folder.iterdir()} <= {UNFINISHED, FAILURES}
    ours = empty or _holds(folder, files) or any(places_of(folder, RUN_RECORD))
    if folder.exists() and not ours:
        msg = f"{folder}: exists and holds no results of this program; choose another folder"
        raise FileExistsError(msg)


def places_of(folder: Path, file: str) -> list[Path]:
    """
    Return where in a results folder runs lie.

    Parameters
    ----------
    folder
        Results folder.
    file
        A file that their folders hold.

    Returns
    -------
    list[Path]
        Folders of the runs, in order of their names.
    """
    return sorted(found.parent for place in RUN_PLACES for found in folder.glob(f"{place}/{file}"))


def _holds(folder: Path, files: Sequence[str]) -> bool:
    return all((folder / name).is_file() for name in files)


def read_results(folder: str | Path, *, trajectories: bool = True, runs: bool = True) -> Results:
    """
    Read a results folder.

    Parameters
    ----------
    folder
        What ``run.py`` left, for example ``out/rush_hour``.
    trajectories
        Read the trajectories too; without them many seeds fit into memory.
    runs
        Read the tables of the runs; without them only what the folder holds itself.

    Returns
    -------
    Results
        All tables, typed as they were when written.

    Raises
    ------
    FileNotFoundError
        If the folder or one of its tables is missing.
    ValueError
        If a table has other columns than declared.
    """
    place = Path(folder)
    if not place.is_dir():
        msg = f"{place}: no such results folder; run a scenario first"
        raise FileNotFoundError(msg)
    if not _holds(place, RESULT_FILES):
        msg = f"{place}: not a results folder, it has no {' and '.join(RESULT_FILES)}"
        raise FileNotFoundError(msg)
    summary = read_csv(place / "summary.csv", SUMMARY)
    provenance = place / "provenance.json"
    swept = _holds(place, [f"{table}.csv" for table in SWEPT_TABLES])
    for name in dict.fromkeys(summary["controller"]):
        if problem := name_problem(name):
            msg = f"{place / 'summary.csv'}: controller {name!r} {problem}"
            raise ValueError(msg)
    named = summary[["controller", "seed", "initial_delay_s"]] if runs else summary.iloc[:0, :3]
    return Results(
        folder=place,
        summary=summary,
        columns=read_csv(place / "columns.csv", COLUMNS),
        stations=read_csv(place / "stations.csv", STATIONS),
        runs=tuple(
            read_run(folder_of_run(place, *run), *run, trajectory=trajectories)
            for run in named.itertuples(index=False, name=None)
        ),
        provenance=read_provenance(provenance) if provenance.is_file() else {},
        intervals=read_intervals(place) if swept else None,
        sweep=read_sweep(place) if swept else None,
        network={
            table: read_csv(place / f"{table}.csv", columns)
            for table, columns in NETWORK_TABLES.items()
            if (place / f"{table}.csv").is_file()
        },
    )


def read_provenance(file: Path) -> Mapping[str, Any]:
    """
    Read how results were made.

    Parameters
    ----------
    file
        ``provenance.json``.

    Returns
    -------
    Mapping[str, Any]
        What it holds.

    Raises
    ------
    ValueError
        If it holds no table of keys.
    """
    try:
        found = json.loads(file.read_text("utf-8"))
    except RecursionError as error:
        msg = f"{file}: nested too deeply"
        raise ValueError(msg) from error
    except ValueError as error:
        msg = f"{file}: is no JSON in UTF-8: {' '.join(str(error).split())}"
        raise ValueError(msg) from error
    if not isinstance(found, dict):
        msg = f"{file}: holds no table of keys"
        raise ValueError(msg)  # noqa: TRY004 - a file is wrong, not an argument
    return found


def folder_of_run(place: Path, controller: str, seed: int, initial_delay_s: float) -> Path:
    """
    Return where in a results folder the raw tables of a run lie.

    Parameters
    ----------
    place
        Results folder.
    controller, seed, initial_delay_s
        Of the run, as its summary has them; the delay in seconds.

    Returns
    -------
    Path
        Its folder, of a sweep, of several seeds or of one run; nothing need be there.
    """
    # A study of several runs per controller that was interrupted may have left only one of them.
    swept = run_folder(place, controller, seed, initial_delay_s, seeds=1)
    own = run_folder(place, controller, seed, seeds=2)
    alone = run_folder(place, controller, seed, seeds=1)
    return next((folder for folder in (swept, own) if folder.is_dir()), alone)
