"""
The results folder as a store: every finished run, with what it was made from.

A run counts as finished if its folder holds ``run.json`` and all the tables it tells of.
"""

import json
import shutil
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from kankaku.analysis.publish.study_publishing import STUDY_RESULTS
from kankaku.analysis.results import RUN_RECORD, places_of, run_folder
from kankaku.analysis.tables.columns import json_text, read_csv, write_whole
from kankaku.analysis.tables.run_tables import RunTables, table_file, write_run
from kankaku.controllers import registry
from kankaku.railway.plan.scenario import UNSUPERVISED, ControllerSpec, Scenario
from kankaku.railway.plan.seed_design import EACH_FOR_ITSELF
from kankaku.railway.step.engine_ways import EVERY_STEP
from kankaku.railway.step.records import RAW_TABLES, UNFINISHED, VIOLATIONS
from kankaku.store.disk import to_disk
from kankaku.store.fingerprint import content_sha256, foreign_sha256, sources_sha256

VERSIONED = ("kankaku", "eclipse-sumo", "libsumo", "numpy")
TABLE_FILES = tuple(map(table_file, RAW_TABLES))
MAPS = ("control_map.png", "control_map.svg")
"""Figures beside the tables of a run."""
Origin: TypeAlias = Mapping[str, Any]
"""What the runs of a controller are made from, as JSON holds it."""
COMPARED: Mapping[str, str] = {
    "scenario_sha256": "scenario",
    "content_sha256": "scenario as changed by a script",
    "step_s": "step",
    "engine": "engine",
    "draws": "draws",
    "draws_phase": "first seed of a replicate",
    "controller": "options of the controller",
    "versions": "versions",
    "sources_sha256": "sources of the program",
}
"""What must be the same, and what a reader calls it."""


class Task(NamedTuple):
    """One run: one controller meets one seed and one delay of a sweep."""

    controller: str
    seed: int
    initial_delay_s: float | None = None
    """None without a sweep. [s]"""

    def __str__(self) -> str:
        delay_s = self.initial_delay_s
        swept = "" if delay_s is None else f", initial delay {delay_s:.1f} s"
        return f"{self.controller} (seed {self.seed}{swept})"

    @property
    def file_name(self) -> str:
        """The same for a file, without an ending."""
        swept = f"_delay_{self.initial_delay_s:05.1f}s" if self.initial_delay_s is not None else ""
        return f"{self.controller}_seed_{self.seed}{swept}"


@dataclass(frozen=True, slots=True)
class Kept:
    """A finished run in a results folder."""

    task: Task
    place: Path
    told: Mapping[str, Any]
    """What its ``run.json`` holds."""

    def violations(self) -> tuple[str, ...]:
        """Return sentences about its violations."""
        if not self.told["violations"]:
            return ()
        return tuple(read_csv(self.place / table_file("violations"), VIOLATIONS)["message"])

    def unfinished(self) -> tuple[str, ...]:
        """Return sentences about the trains that had not finished."""
        return tuple(read_csv(self.place / table_file("unfinished"), UNFINISHED)["message"])

    def differences(self, origin: Origin, *, options: bool) -> list[str]:
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
        keys = [key for key in COMPARED if options or key != "controller"]
        if self.told.get("scenario_sha256") != origin["scenario_sha256"]:
            keys.remove("content_sha256")
        return [COMPARED[key] for key in keys if self.told.get(key) != origin.get(key)]


def origin_of(
    scenario: Scenario, spec: ControllerSpec, step_s: float, engine: str = EVERY_STEP
) -> Origin:
    """
    Return what the runs of a controller are made from.

    Parameters
    ----------
    scenario
        The scenario, perhaps changed since it was read.
    spec
        The controller.
    step_s
        Length of a step. [s]
    engine
        How SUMO takes part.

    Returns
    -------
    Origin
        Digests, options and versions.
    """
    design = scenario.dwell_delays.design
    delays = replace(scenario.dwell_delays, design=EACH_FOR_ITSELF)
    content = replace(scenario, controllers=(), warnings=(), dwell_delays=delays)
    origin = {
        "scenario": scenario.name,
        "scenario_sha256": scenario.digest,
        "content_sha256": content_sha256(content),
        "step_s": step_s,
        "engine": engine,
        **design.told(),
        "controller": controller_told(spec),
        "versions": {name: version(name) for name in VERSIONED},
        "sources_sha256": sources_sha256(),
    }
    told: Origin = json.loads(json.dumps(origin))
    return told


def controller_told(spec: ControllerSpec) -> dict[str, Any]:
    """
    Return what a controller is.

    Parameters
    ----------
    spec
        One that can be built.

    Returns
    -------
    dict[str, Any]
        Its layers with all their options, or the peer.
    """
    if spec.peer is not None:
        return {"peer": spec.peer}
    layers = (
        registry.PROTECTIONS[spec.protection],
        registry.OPERATIONS[spec.operation],
        registry.SUPERVISIONS[spec.supervision],
    )
    foreign = foreign_sha256(*(layer.build for layer in layers))
    return {
        "protection": spec.protection,
        "operation": spec.operation,
        "radio": spec.radio,
        "options": registry.options_of(spec),
        **({} if spec.supervision == UNSUPERVISED else {"supervision": spec.supervision}),
        **({"sources_sha256": foreign} if foreign else {}),
    }


def write_finished(
    tables: RunTables, place: Path, origin: Origin, task: Task, told: Mapping[str, Any]
) -> None:
    """
    Write a finished run where nobody looks yet, so that a power cut takes none of it.

    Parameters
    ----------
    tables
        Its raw tables.
    place
        Its folder; made.
    origin
        What it was made from.
    task
        Which run it is.
    told
        What else there is to tell of it, its violations included.
    """
    write_run(tables, place)
    files = {name: (place / name).stat().st_size for name in TABLE_FILES}
    finished = datetime.now(UTC).isoformat(timespec="seconds")
    record = {**origin, "seed": task.seed, "initial_delay_s": task.initial_delay_s}
    record |= {"finished": finished, **told, "files": files}
    record["name"] = task.controller
    write_whole(place / RUN_RECORD, json_text(record))
    for name in (*TABLE_FILES, RUN_RECORD, "."):
        to_disk(place / name)


def kept_runs(folder: Path) -> list[Kept]:
    """
    Return the finished runs of a results folder.

    Parameters
    ----------
    folder
        Results folder.

    Returns
    -------
    list[Kept]
        Those whose tables are all there, as long as they were.
    """
    found: dict[Task, Kept] = {}
    for place in places_of(folder, RUN_RECORD):
        kept = kept_run(folder, place)
        if kept is not None:
            found[kept.task] = kept
    return list(found.values())


def kept_run(folder: Path, place: Path) -> Kept | None:
    """
    Return a finished run.

    Parameters
    ----------
    folder
        Results folder.
    place
        Folder of the run.

    Returns
    -------
    Kept | None
        None if it is not finished, or damaged.
    """
    with suppress(OSError, ValueError, KeyError, TypeError, AttributeError):
        told = json.loads((place / RUN_RECORD).read_text("utf-8"))
        delay_s = told["initial_delay_s"]
        task = Task(
            str(told["name"]), int(told["seed"]), None if delay_s is None else float(delay_s)
        )
        whole = {name: (place / name).stat().st_size for name in TABLE_FILES} == told["files"]
        own = place.relative_to(folder).parts[0] == task.controller
        _ = told["finished"], float(told["wall_s"]), int(told["train_steps"])
        if whole and own and isinstance(told["violations"], int):
            return Kept(task, place, told)
    return None


def unrecorded(folder: Path) -> list[Path]:
    """
    Return the places of runs that do not say what they were made from.

    Parameters
    ----------
    folder
        Results folder.

    Returns
    -------
    list[Path]
        Folders of runs.
    """
    places = places_of(folder, table_file("calls"))
    return [place for place in places if not (place / RUN_RECORD).is_file()]


def accept(written: Path, place: Path) -> None:
    """
    Put a finished run in its place, whole or not at all.

    Parameters
    ----------
    written
        Where :func:`write_finished` wrote it, on the same disk.
    place
        Where it belongs; an earlier run there is replaced.
    """
    place.parent.mkdir(parents=True, exist_ok=True)
    remove_run(place)
    if place.exists():
        # Something else lies there, and stays. The run counts once all files are there.
        for name in (RUN_RECORD, *TABLE_FILES):
            (written / name).replace(place / name)
    else:
        written.replace(place)
    to_disk(place.parent)


def remove_run(place: Path) -> None:
    """
    Remove a run, but nothing that somebody has laid beside it.

    Parameters
    ----------
    place
        Its folder.
    """
    # The record is the last to go, so that who is killed leaves no tables of unknown origin.
    for name in (*TABLE_FILES, *MAPS, RUN_RECORD):
        (place / name).unlink(missing_ok=True)
    with suppress(OSError):
        place.rmdir()


def make_room(kept: Kept, folder: Path, work: Path) -> Kept:
    """
    Move the only run of a controller to where there is room for others beside it.

    Parameters
    ----------
    kept
        The run.
    folder
        Results folder.
    work
        A place for temporary files, on the same disk.

    Returns
    -------
    Kept
        The same at its new place.
    """
    place = run_folder(folder, kept.task.controller, kept.task.seed, seeds=2)
    if place != kept.place:
        # Copied, so that at any moment there is a whole one.
        copy = Path(tempfile.mkdtemp(dir=work)) / place.name
        copy.mkdir()
        for name in (*TABLE_FILES, RUN_RECORD):
            shutil.copy2(kept.place / name, copy / name)
            to_disk(copy / name)
        accept(copy, place)
    remove_run(place.parent)
    return replace(kept, place=place)


def clear(folder: Path, places: Iterable[Path]) -> None:
    """
    Remove results that are replaced by others.

    Parameters
    ----------
    folder
        Results folder; what is not of this program stays.
    places
        Folders of the runs that go.
    """
    for place in places:
        remove_run(place)
        if place.parent != folder:
            remove_run(place.parent)
    for name in STUDY_RESULTS.files:
        (folder / name).unlink(missing_ok=True)


def move_published(work: Path, folder: Path) -> None:
    """
    Put summary, figures and report in place of earlier ones; the summary is the last.

    Parameters
    ----------
    work
        Where they were written, on the same disk.
    folder
        Results folder.
    """
    made = sorted(file.relative_to(work) for file in work.rglob("*") if file.is_file())
    maps = (file for name in MAPS for file in folder.glob(f"*/{name}"))
    old = [*(folder / name for name in STUDY_RESULTS.files), *maps]
    for file in old:
        if file.relative_to(folder) not in made:
            file.unlink(missing_ok=True)
    for name in sorted(made, key=lambda name: name.name == "summary.csv"):
        (folder / name).parent.mkdir(exist_ok=True)
        (work / name).replace(folder / name)


def in_order(runs: Sequence[Kept], named: Sequence[str], known: Sequence[str]) -> list[Kept]:
    """
    Return runs as tables and figures show them.

    Parameters
    ----------
    runs
        Finished runs.
    named
        Controllers that were asked for.
    known
        All controllers in the order of the scenario, which holds unless those that were asked
        for come in another one; then these come first.

    Returns
    -------
    list[Kept]
        By controller, then seed, then initial delay.
    """
    as_known = [name for name in known if name in named] == list(named)
    others = sorted(kept.task.controller for kept in runs)
    names = list(dict.fromkeys([*(() if as_known else named), *known, *named, *others]))

    def key(kept: Kept) -> tuple[int, int, float]:
        task = kept.task
        return names.index(task.controller), task.seed, task.initial_delay_s or 0.0

    return sorted(runs, key=key)
