"""Results folders for a page, also old and partial ones: what is missing is told, not refused."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from kankaku.analysis.page.page_data import Note, PageSource
from kankaku.analysis.results import (
    RESULT_FILES,
    STATIONS,
    Results,
    columns_frame,
    read_provenance,
    run_folder,
)
from kankaku.analysis.tables.columns import read_csv, typed_frame
from kankaku.analysis.tables.line_told import LINE_FILE
from kankaku.analysis.tables.network_tables import NETWORK_TABLES
from kankaku.analysis.tables.run_tables import RunTables, table_file
from kankaku.analysis.tables.summary import SUMMARY
from kankaku.analysis.tables.sweep import SWEPT_TABLES, shown_delays_s
from kankaku.railway.errors import KankakuError
from kankaku.railway.places import name_problem
from kankaku.railway.step.records import RAW_TABLES, TRAJECTORY, Column

_LINE_LISTS = (
    "stations",
    "geometry_m_lon_lat_deg",
    "tracks",
    "joints",
    "platforms",
    "turnouts",
    "limits",
    "gradients",
    "curves",
    "blocks",
    "crossings",
    "knows_future",
)
_ABSENT: Mapping[str, object] = {"float64": np.nan, "int64": 0, "bool": False, "str": ""}
_LINE_MAPPINGS = ("train_types", "type_of", "published", "sweep")


class PageError(KankakuError):
    """Results of which no page can be made."""

    verdict = "cannot be shown"

    def __init__(self, place: Path, problem: str) -> None:
        super().__init__(str(place), problem, "what `kankaku run` wrote")


class _Patience:
    """Reads what there is, and notes what is not."""

    def __init__(self) -> None:
        self.notes: dict[str, Note] = {}

    def note(self, english: str, japanese: str) -> None:
        self.notes[english] = Note(english, japanese)

    def csv(self, file: Path, columns: Sequence[Column]) -> pd.DataFrame:
        """Return a table; columns that it lacks hold nothing."""
        if not file.is_file():
            self.note(f"{file.name} is missing in some run.", f"{file.name} のない回がある。")
            return _nothing(columns)
        try:
            return read_csv(file, columns)
        except (ValueError, OverflowError, pd.errors.ParserError, OSError):
            return self._other_csv(file, columns)

    def _other_csv(self, file: Path, columns: Sequence[Column]) -> pd.DataFrame:
        try:
            texts = pd.read_csv(file, dtype="str", keep_default_na=False)
            frame = typed_frame({c.name: _column(texts, c) for c in columns}, columns)
        except (ValueError, OverflowError, pd.errors.ParserError, OSError):
            self.note(f"{file.name} cannot be read.", f"{file.name} は読めない。")
            return _nothing(columns)
        lacks = [column.name for column in columns if column.name not in texts]
        told = ", ".join(lacks)
        if lacks:
            self.note(f"{file.name} has no column {told}.", f"{file.name} に列 {told} がない。")
        else:
            self.note(
                f"{file.name} has other columns or values than this version writes.",
                f"{file.name} の列または値がこの版と異なる。",
            )
        return frame

    def trajectory(self, file: Path, run: str) -> pd.DataFrame:
        """Return the samples of a run; none where they are not all there."""
        try:
            samples = pd.read_parquet(file, engine="pyarrow")
            numbers = [c.name for c in TRAJECTORY if c.dtype == "float64"]
            frame = samples.astype(dict.fromkeys(numbers, "float64"))
            good = bool(np.isfinite(frame[["time_s", "front_m", "speed_mps"]].to_numpy()).all())
            # What is endless is far ahead, which is all that can be drawn of it.
            frame["limit_m"] = frame["limit_m"].replace([np.inf, -np.inf], np.nan)
            if good and {c.name for c in TRAJECTORY} <= set(frame):
                return frame[[c.name for c in TRAJECTORY]]
        except (OSError, ValueError, TypeError, KeyError):
            pass
        self.note(f"{run}: no trajectory that can be read.", f"{run}:読める走行記録がない。")
        return _nothing(TRAJECTORY)


def read_source(folder: Path, *, name: str = "") -> PageSource:
    """
    Read results for a page.

    Parameters
    ----------
    folder
        Results folder of a scenario.
    name
        What they are called; the folder's name if empty.

    Returns
    -------
    PageSource
        With notes about whatever is missing. Trajectories are those of the first seed.

    Raises
    ------
    PageError
        If it is no results folder, or holds no run.
    """
    place = folder.resolve()
    lacks = [file for file in RESULT_FILES if not (place / file).is_file()]
    if lacks:
        raise PageError(folder, f"no results folder, it has no {' and no '.join(lacks)}")
    patience = _Patience()
    summary = patience.csv(place / "summary.csv", SUMMARY)
    for controller in dict.fromkeys(summary["controller"]):
        if problem := name_problem(controller):
            raise PageError(folder / "summary.csv", f"controller {controller!r} {problem}")
    runs = _runs(place, summary, patience)
    if summary.empty or not runs:
        raise PageError(folder, "holds no run")
    line = _line(place / LINE_FILE, patience)
    if missing := _unrun(place, summary):
        told = ", ".join(missing)
        patience.note(f"Runs that are not here: {told}.", f"ここにない回:{told}。")
    results = Results(
        folder=place,
        summary=summary,
        columns=columns_frame(),
        stations=patience.csv(place / "stations.csv", STATIONS),
        runs=tuple(runs),
        provenance=_provenance(place / "provenance.json", patience),
        **_swept(place),
        network={
            table: patience.csv(place / f"{table}.csv", columns)
            for table, columns in NETWORK_TABLES.items()
            if (place / f"{table}.csv").is_file()
        },
    )
    called = name or str(results.provenance.get("scenario") or place.name)
    return PageSource(called, results, line, tuple(patience.notes.values()))


def _runs(place: Path, summary: pd.DataFrame, patience: _Patience) -> list[RunTables]:
    found = []
    first = summary["seed"].iloc[0] if len(summary) else 0
    told = list(
        summary[["controller", "seed", "initial_delay_s"]].itertuples(index=False, name=None)
    )
    last_s = shown_delays_s([(controller, delay_s) for controller, _, delay_s in told])[-1:]
    for controller, seed, delay_s in told:
        own = _place_of(place, controller, seed, delay_s)
        if own is None:
            continue
        frames = {
            table: patience.csv(own / table_file(table), columns)
            for table, columns in RAW_TABLES.items()
            if table != "trajectory"
        }
        shown = seed == first and delay_s in last_s
        samples = _nothing(TRAJECTORY)
        if shown:
            samples = patience.trajectory(own / table_file("trajectory"), controller)
        found.append(
            RunTables(controller, seed, trajectory=samples, initial_delay_s=delay_s, **frames)
        )
    return found


def _place_of(place: Path, controller: str, seed: int, delay_s: float) -> Path | None:
    places = (
        run_folder(place, controller, seed, delay_s, seeds=1),
        run_folder(place, controller, seed, seeds=2),
        run_folder(place, controller, seed, seeds=1),
    )
    return next((own for own in places if (own / table_file("calls")).is_file()), None)


def _unrun(place: Path, summary: pd.DataFrame) -> list[str]:
    told = summary[["controller", "seed", "initial_delay_s"]].itertuples(index=False, name=None)
    return [f"{run[0]} (seed {run[1]})" for run in told if _place_of(place, *run) is None]


def _swept(place: Path) -> dict[str, pd.DataFrame | None]:
    files = {table: place / f"{table}.csv" for table in SWEPT_TABLES}
    if not all(file.is_file() for file in files.values()):
        return {"intervals": None, "sweep": None}
    patience = _Patience()
    return {table: patience.csv(files[table], columns) for table, columns in SWEPT_TABLES.items()}


def _provenance(file: Path, patience: _Patience) -> Mapping[str, Any]:
    try:
        return read_provenance(file)
    except (OSError, ValueError):
        patience.note(
            "provenance.json is missing or cannot be read: nobody knows what was run.",
            "provenance.json がないか読めないため、実行条件は不明である。",
        )
        return {}


def _line(file: Path, patience: _Patience) -> Mapping[str, Any]:
    try:
        told = json.loads(file.read_text("utf-8"))
    except (OSError, ValueError, RecursionError):
        told = None
    if not isinstance(told, Mapping):
        patience.note(
            f"{LINE_FILE} is missing or cannot be read, as in results of an earlier version: no "
            "limits, signals, map or power are shown, and nobody knows who knows the future.",
            f"{LINE_FILE} がないか読めない(旧版の結果など)。制限速度、信号、地図、電力は表示せず、"
            "将来を知る制御方式も不明である。",
        )
        return {}
    return line_of(told)


def line_of(told: Mapping[str, Any]) -> dict[str, Any]:
    """
    Return what can be used of what somebody says of a line.

    Parameters
    ----------
    told
        The content of ``line.json``, or what pretends to be.

    Returns
    -------
    dict[str, Any]
        Only what :func:`kankaku.analysis.tables.line_told.line_told` may write.
    """
    kept: dict[str, Any] = {"title": str(told.get("title", ""))}
    for name in _LINE_LISTS:
        value = told.get(name)
        kind = str if name == "knows_future" else (Mapping, list)
        if isinstance(value, list):
            kept[name] = [item for item in value if isinstance(item, kind)]
    for name in _LINE_MAPPINGS:
        if isinstance(told.get(name), Mapping):
            kept[name] = told[name]
    return kept


def _nothing(columns: Sequence[Column]) -> pd.DataFrame:
    return typed_frame({column.name: [] for column in columns}, columns)


def _column(texts: pd.DataFrame, column: Column) -> Sequence[object]:
    rows = len(texts)
    if column.name not in texts:
        return [_ABSENT[column.dtype]] * rows
    if column.dtype == "float64":
        return list(pd.to_numeric(texts[column.name], errors="coerce").replace(np.inf, np.nan))
    if column.dtype == "int64":
        numbers = pd.to_numeric(texts[column.name], errors="coerce").fillna(0.0)
        return list(numbers.clip(-(2.0**52), 2.0**52).astype("int64"))
    if column.dtype == "bool":
        return list(texts[column.name] == "True")
    return list(texts[column.name].str.removeprefix("'"))
