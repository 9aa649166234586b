"""
The dataset of an ensemble: Parquet files by table, scenario, controller and seed.

A run counts as finished once its file of the table ``summary`` is there, which is the last to be
put in place and tells how long the others are.
"""

import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote, unquote

from kankaku.analysis.tables.parquet_bytes import note_of
from kankaku.analysis.tables.summary import SUMMARY
from kankaku.railway.step.records import CALLS, INTERSTATION_STOPS, TRAJECTORY, Column
from kankaku.store.disk import to_disk
from kankaku.store.run_store import Kept, Origin, Task

FILE = "run.parquet"
MAIN, ON_DEMAND = "summary", "trajectory"
DATASET: Mapping[str, tuple[Column, ...]] = {
    # What the folders tell stands in no file.
    MAIN: tuple(column for column in SUMMARY if column.name not in {"controller", "seed"}),
    "calls": CALLS,
    "stops": INTERSTATION_STOPS,
    ON_DEMAND: TRAJECTORY,
}
"""Tables of the dataset."""
MAIN_FIRST = (MAIN, *(table for table in DATASET if table != MAIN))
PARTS = (
    Column("scenario", "str", "", "name of the scenario"),
    Column("controller", "str", "", "name of the controller"),
    Column("seed", "int64", "", "seed of the dwell delays"),
)
"""What the folders tell, and every table has when it is read."""


class EnsembleTask(NamedTuple):
    """One run of an ensemble."""

    scenario: str
    controller: str
    seed: int
    engine: str

    def __str__(self) -> str:
        return f"{self.scenario}, {self.controller} (seed {self.seed}, {self.engine})"

    @property
    def file_name(self) -> str:
        """The same for a file, without an ending."""
        return f"{self.scenario}_{self.controller}_seed_{self.seed}_{self.engine}"


class RunFiles(NamedTuple):
    """The tables of a run as files, wherever it was made."""

    files: Mapping[str, bytes]
    """By the name of the table."""
    wall_s: float
    """How long it took. [s]"""
    train_steps: int


@dataclass(frozen=True, slots=True)
class Saved:
    """A finished run in a dataset."""

    task: EnsembleTask
    note: Mapping[str, Any]
    """What its summary tells: origin, engine, violations, unfinished trains, files."""

    def differences(self, origin: Origin, *, options: bool = True) -> list[str]:
        """
        Return in what it is not made from the same.

        Parameters
        ----------
        origin
            What a run would be made from today.
        options
            Compare the controllers, too.

        Returns
        -------
        list[str]
            Words for a reader.
        """
        kept = Kept(Task(self.task.controller, self.task.seed), Path(), self.note)
        return kept.differences(origin, options=options)


def place_of(root: Path, table: str, task: EnsembleTask) -> Path:
    """
    Return where a table of a run lies.

    Parameters
    ----------
    root
        Folder of the dataset.
    table
        Name of the table.
    task
        The run.

    Returns
    -------
    Path
        The file.
    """
    scenario, controller = (quote(name, safe="+") for name in task[:2])
    above = root / f"table={table}" / f"scenario={scenario}" / f"controller={controller}"
    return above / f"seed={task.seed}" / FILE


def files_of(root: Path, table: str) -> list[Path]:
    """
    Return the files of a table.

    Parameters
    ----------
    root
        Folder of the dataset.
    table
        Name of the table.

    Returns
    -------
    list[Path]
        In order of their names.
    """
    return sorted(root.glob(f"table={table}/scenario=*/controller=*/seed=*/{FILE}"))


def parts_of(file: Path) -> tuple[str, str, int]:
    """
    Return whose file it is.

    Parameters
    ----------
    file
        A file of a dataset.

    Returns
    -------
    tuple[str, str, int]
        Scenario, controller and seed.

    Raises
    ------
    ValueError
        If its folders do not tell.
    """
    scenario, controller, seed = (unquote(name.partition("=")[2]) for name in file.parts[-4:-1])
    return scenario, controller, int(seed)


def saved_runs(root: Path) -> dict[EnsembleTask, Saved]:
    """
    Return the finished runs of a dataset.

    Parameters
    ----------
    root
        Its folder.

    Returns
    -------
    dict[EnsembleTask, Saved]
        Those whose files are all there, as long as they were.
    """
    found = (saved_run(root, file) for file in files_of(root, MAIN))
    return {saved.task: saved for saved in found if saved is not None}


def saved_run(root: Path, file: Path) -> Saved | None:
    """
    Return a finished run.

    Parameters
    ----------
    root
        Folder of the dataset.
    file
        Its file of the table ``summary``.

    Returns
    -------
    Saved | None
        None if it is not finished, or damaged.
    """
    with suppress(OSError, ValueError, KeyError, TypeError, AttributeError):
        note = note_of(file)
        task = EnsembleTask(*parts_of(file), str(note["engine"]))
        own = (note["scenario"], note["name"], note["seed"]) == task[:3]
        sizes = {table: place_of(root, table, task).stat().st_size for table in note["files"]}
        if own and sizes == note["files"] and "calls" in sizes:
            return Saved(task, note)
    return None


def put(root: Path, task: EnsembleTask, made: RunFiles, work: Path) -> None:
    """
    Put a run in its place, whole or not at all; it is on the disk when this returns.

    Parameters
    ----------
    root
        Folder of the dataset.
    task
        The run; an earlier one there is replaced.
    made
        Its tables.
    work
        A place for temporary files, on the same disk.
    """
    for table in MAIN_FIRST:
        place_of(root, table, task).unlink(missing_ok=True)
    for table in (table for table in reversed(MAIN_FIRST) if table in made.files):
        place = place_of(root, table, task)
        partial = work / f"{table}.partial"
        with partial.open("wb") as file:
            file.write(made.files[table])
            file.flush()
            os.fsync(file.fileno())
        fresh = [above for above in place.parents if not above.exists()]
        place.parent.mkdir(parents=True, exist_ok=True)
        partial.replace(place)
        for folder in (place.parent, *(above.parent for above in fresh)):
            to_disk(folder)


def remove(root: Path, task: EnsembleTask) -> None:
    """
    Remove a run.

    Parameters
    ----------
    root
        Folder of the dataset.
    task
        The run; it need not be there.
    """
    # Without its summary it does not count, and the rest is nobody's.
    for table in MAIN_FIRST:
        _unlink(root, place_of(root, table, task))


def tidy(root: Path, runs: Mapping[EnsembleTask, Saved]) -> None:
    """
    Remove files that belong to no finished run; nobody else may be writing.

    Parameters
    ----------
    root
        Folder of the dataset.
    runs
        What :func:`saved_runs` returned.
    """
    kept = {
        place_of(root, table, task)
        for task, saved in runs.items()
        for table in (MAIN, *saved.note["files"])
    }
    for table in DATASET:
        for file in files_of(root, table):
            if file not in kept:
                _unlink(root, file)


def _unlink(root: Path, file: Path) -> None:
    file.unlink(missing_ok=True)
    with suppress(OSError):
        for folder in file.parents[: len(file.relative_to(root).parts)]:
            folder.rmdir()
