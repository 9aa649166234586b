"""Parts of an ensemble that were run apart become one: ``kankaku merge``."""

from collections.abc import Sequence
from pathlib import Path

from kankaku.analysis.tables.columns import json_text, write_whole
from kankaku.store import dataset_store
from kankaku.store.dataset_store import EnsembleTask, RunFiles, Saved, place_of
from kankaku.store.ensemble_plan import PLAN, EnsembleError, Plan, read_plan
from kankaku.store.holding import held
from kankaku.studies.ensemble_findings import (
    Drawing,
    EnsembleFindings,
    all_saved,
    findings_of,
    publish_findings,
    root_of,
)
from kankaku.studies.ensemble_running import refuse_other
from kankaku.studies.page_sources import LINES, page_of_folder


def merge(folder: Path, parts: Sequence[Path], drawing: Drawing | None = None) -> EnsembleFindings:
    """
    Put parts of a study together, and write what all of its runs show.

    Parameters
    ----------
    folder
        Results folder of the whole; it may hold parts already.
    parts
        Results folders of parts; none if all of them were run into ``folder``.
    drawing
        What is drawn.

    Returns
    -------
    EnsembleFindings
        What the runs show, and which are missing.

    Raises
    ------
    EnsembleError
        If the parts are not of one study, or there is no run.
    FileExistsError
        If something else stands there.
    HeldError
        If another command writes there.
    """
    refuse_other(folder)
    plan = _plan_of_all(folder, parts)
    with held(folder) as work:
        for part in parts:
            _copy(plan, part, folder, work)
        found = all_saved(folder)
        for root, runs in found.items():
            dataset_store.tidy(root, runs)
        there = _of_plan(folder, plan, found)
        if not there:
            raise EnsembleError(str(folder), "holds no run of the study", "folders of its parts")
        write_whole(folder / PLAN, json_text(plan.told()))
        findings = findings_of(folder, plan, there)
        drawn = drawing or Drawing()
        publish_findings(folder, findings, drawn)
        lines = next((part / LINES for part in (folder, *parts) if (part / LINES).is_file()), None)
        if lines is not None:
            write_whole(folder / LINES, lines.read_bytes())
        if drawn.formats:
            page_of_folder(folder)
    return findings


def _plan_of_all(folder: Path, parts: Sequence[Path]) -> Plan:
    """Return the plan that all parts have in common."""
    places = [*([folder] if (folder / PLAN).is_file() or not parts else []), *parts]
    plans = [read_plan(place) for place in places]
    for place, plan in zip(places[1:], plans[1:], strict=True):
        if words := plans[0].differences(plan):
            problem = f"is no part of the study in {places[0]} ({', '.join(words)})"
            raise EnsembleError(str(place), problem, "parts of one study")
    return plans[0]


def _of_plan(
    folder: Path, plan: Plan, found: dict[Path, dict[EnsembleTask, Saved]]
) -> dict[EnsembleTask, Saved]:
    """Return the runs of the plan; refuse those that were made from something else."""
    planned = plan.tasks(range(plan.seeds))
    there = {
        task: runs[task] for task in planned if task in (runs := found[root_of(folder, plan, task)])
    }
    for task, saved in there.items():
        if words := saved.differences(plan.origin_of(task)):
            problem = f"{task} was made from something else ({', '.join(words)})"
            raise EnsembleError(str(folder), problem, "parts of one study")
    return there


def _copy(plan: Plan, part: Path, folder: Path, work: Path) -> None:
    """Copy the runs of a part that are not there yet."""
    have = _of_plan(folder, plan, all_saved(folder))
    for task, saved in _of_plan(part, plan, all_saved(part)).items():
        here, there = root_of(folder, plan, task), root_of(part, plan, task)
        files = {
            table: place_of(there, table, task).read_bytes()
            for table in (*saved.note["files"], dataset_store.MAIN)
        }
        if task not in have:
            dataset_store.put(here, task, RunFiles(files, 0.0, 0), work)
        elif any(place_of(here, name, task).read_bytes() != files[name] for name in files):
            raise EnsembleError(str(part), f"{task} has another result", "parts of one study")
