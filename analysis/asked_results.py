"""
Results folders that somebody asks: strict where they are broken, patient where a part is missing.

Whoever asks a folder may have cut it, edited it or got it from a stranger. What is broken is
told with file, row and column; runs that are missing are left out and named.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np
import pandas as pd

from kankaku.analysis.results import RESULT_FILES, Results, folder_of_run, read_results
from kankaku.analysis.tables.columns import read_csv
from kankaku.analysis.tables.run_tables import RunTables, read_run, table_file
from kankaku.analysis.tables.summary import SUMMARY
from kankaku.railway.errors import KankakuError, suggesting
from kankaku.railway.step.records import TRAJECTORY

MOST_NAMED = 8
"""So many names of what there is a refusal shows. [-]"""
_NUMBERS = tuple(column.name for column in TRAJECTORY if column.dtype == "float64")
_TEXTS = tuple(column.name for column in TRAJECTORY if column.dtype == "str")
_KNOWN_S = ("booked_arrival_s", "booked_departure_s", "stop_m", "minimum_dwell_s")
"""Columns of ``calls`` in which no number is missing."""
Name = TypeVar("Name", str, int)


class ResultsError(KankakuError):
    """What of a results folder cannot be used: file, row or key, what is wrong, what is allowed."""

    verdict = "cannot be read"


class NotInResultsError(ResultsError):
    """What results were asked for and do not hold."""

    verdict = "does not hold that"


@dataclass(frozen=True, slots=True, eq=False)
class AskedResults:
    """Results, and what of them is missing."""

    results: Results
    notes: tuple[str, ...]
    """A sentence for each run that is named in the summary and is not there."""


def results_place(folder: Path, out: Path = Path("out")) -> Path:
    """
    Return where results lie.

    Parameters
    ----------
    folder
        Their folder, or the name of one in ``out``.
    out
        Where commands write results.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    ResultsError
        If there is no such folder, or it holds no results.
    """
    place = folder
    if not folder.exists() and len(folder.parts) == 1:
        place = out / folder
    allowed = "a results folder, for example out/rush_hour"
    if not place.is_dir():
        raise ResultsError(str(folder), "there is no such folder", allowed)
    missing = [name for name in RESULT_FILES if not (place / name).is_file()]
    if missing:
        told = f"is no results folder, it has no {' and no '.join(missing)}"
        raise ResultsError(str(folder), told, allowed)
    return place


def read_asked(
    folder: Path,
    *,
    controllers: Collection[str] = (),
    seed: int | None = None,
    trajectories: bool = True,
    every_seed: bool = False,
) -> AskedResults:
    """
    Read what of a results folder is asked for.

    Parameters
    ----------
    folder
        Results folder, or the name of one in ``out``.
    controllers
        Whose runs; all if empty.
    seed
        Of which seed; the first one if None.
    trajectories
        Read the trajectories too.
    every_seed
        Read the runs of all seeds and initial delays; otherwise of each controller the first one.

    Returns
    -------
    AskedResults
        With the runs that are there.

    Raises
    ------
    ResultsError
        With everything that is broken in one file, or if no run is left.
    """
    place = results_place(folder)
    whole = _head(place)
    runs = list(
        whole.summary[["controller", "seed", "initial_delay_s"]].itertuples(index=False, name=None)
    )
    known = list(dict.fromkeys(str(run[0]) for run in runs))
    for name in controllers:
        known_name(f"{place}: controller", name, known)
    if seed is not None:
        known_name(f"{place}: seed", seed, list(dict.fromkeys(int(run[1]) for run in runs)))
    seed_of = {run[0]: run[1] for run in reversed(runs)} if seed is None else {}
    wanted = [
        run
        for run in runs
        if (not controllers or run[0] in controllers)
        and (every_seed or run[1] == seed_of.get(run[0], seed))
    ]
    if not every_seed:
        # Of a sweep the first delay.
        wanted = list({run[0]: run for run in reversed(wanted)}.values())[::-1]
    found, notes = _runs(place, wanted, trajectories=trajectories)
    if not found:
        told = f"holds no run any more: {notes[0]}" if notes else "holds no run"
        raise ResultsError(str(place), told, "the folders of the runs beside summary.csv")
    return AskedResults(replace(whole, runs=tuple(found)), tuple(notes))


def train_of(runs: Sequence[RunTables], train: str) -> str:
    """
    Return a train number as the results write it.

    Parameters
    ----------
    runs
        Runs of the same timetable.
    train
        As a user writes it.

    Returns
    -------
    str
        The same; in capital letters where only that is known.

    Raises
    ------
    ResultsError
        If there is no such train.
    """
    known = list(dict.fromkeys(str(name) for run in runs for name in run.calls["train"]))
    alike = [name for name in known if name.casefold() == train.strip().casefold()]
    if train not in known and len(alike) == 1:
        return alike[0]
    return known_name("train", train, known)


def known_name(where: str, name: Name, known: Sequence[Name]) -> Name:
    """
    Return a name that there is.

    Parameters
    ----------
    where
        What it was said for.
    name
        What was said.
    known
        What there is.

    Returns
    -------
    Name
        The same.

    Raises
    ------
    ResultsError
        If there is no such thing, with the likeliest one.
    """
    if name not in known:
        texts = [str(one) for one in known]
        told = ", ".join(texts[:MOST_NAMED])
        if len(texts) > MOST_NAMED:
            told += f" and {len(texts) - MOST_NAMED} more"
        problem = f"there is no {str(name)[:60]!r}"
        raise NotInResultsError(where, problem, suggesting(str(name), texts, told))
    return name


def _head(place: Path) -> Results:
    """Read everything but the runs."""
    try:
        summary = read_csv(place / "summary.csv", SUMMARY)
        if summary.empty:
            raise ResultsError(str(place / "summary.csv"), "has no row", "a row for each run")
        return read_results(place, runs=False)
    except (OSError, ValueError, OverflowError) as error:
        raise _refusal(place, error) from error


def _runs(
    place: Path, wanted: Sequence[tuple[str, int, float]], *, trajectories: bool
) -> tuple[list[RunTables], list[str]]:
    found, notes = [], []
    for controller, seed, delay_s in wanted:
        own = folder_of_run(place, controller, seed, delay_s)
        if not own.is_dir():
            notes.append(f"{controller}, seed {seed}: its folder {own.name} is missing")
            continue
        if trajectories and not (own / table_file("trajectory")).exists():
            notes.append(f"{controller}, seed {seed}: it was saved without its trajectory")
            continue
        try:
            run = read_run(own, controller, seed, delay_s, trajectory=trajectories)
        except (OSError, ValueError, OverflowError, TypeError) as error:
            raise _refusal(own, error) from error
        _refuse_calls(own / table_file("calls"), run.calls)
        samples = _checked(own / table_file("trajectory"), run.trajectory)
        found.append(replace(run, trajectory=samples))
    return found, notes


def _refusal(place: Path, error: Exception) -> ResultsError:
    if isinstance(error, ResultsError):
        return error
    if isinstance(error, OSError):
        where = error.filename or place
        told = error.strerror or " ".join(str(error).split())[:200]
        return ResultsError(str(where), told, "what `kankaku run` wrote")
    # The readers name the file first, wherever they know it.
    told = " ".join(str(error).split())
    where = "" if told.startswith(str(place)) else str(place)
    return ResultsError(where, told, "what `kankaku run` wrote")


def _refuse_calls(file: Path, calls: pd.DataFrame) -> None:
    if calls.empty:
        raise ResultsError(str(file), "has no row", "a row for each call of each train")
    for name in _KNOWN_S:
        _refuse_missing(file, name, calls[name].to_numpy(), first_line=2)
    if (calls["train"] == "").any():
        row = int(np.flatnonzero(calls["train"] == "")[0])
        where = f"{file}: row {row + 2}, column train"
        raise ResultsError(where, "is empty", "a train number")


def _checked(file: Path, samples: pd.DataFrame) -> pd.DataFrame:
    """Return a trajectory of declared types; other columns than the declared ones are left out."""
    missing = [column.name for column in TRAJECTORY if column.name not in samples]
    if missing:
        allowed = ", ".join(column.name for column in TRAJECTORY)
        raise ResultsError(str(file), f"has no column {', '.join(missing)}", allowed)
    kept: dict[str, pd.Series] = {}
    for name in (column.name for column in TRAJECTORY):
        if name in _TEXTS:
            kept[name] = samples[name].astype("str")
            continue
        try:
            kept[name] = samples[name].astype("float64")
        except (TypeError, ValueError) as error:
            where = f"{file}: column {name}"
            raise ResultsError(where, "holds no numbers", "numbers") from error
    checked = pd.DataFrame(kept)
    for name in _NUMBERS:
        _refuse_missing(file, name, checked[name].to_numpy(), first_line=1)
    return checked


def _refuse_missing(file: Path, name: str, values: np.ndarray, *, first_line: int) -> None:
    # The end of authority may be as far ahead as numbers go; nothing else may.
    wrong = np.isnan(values) if name == "limit_m" else ~np.isfinite(values)
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0]) + first_line
        told = f"{values[row - first_line]} is no number"
        where = f"{file}: row {row}, column {name}"
        raise ResultsError(where, told, "a finite number")
