"""
Availability and fault tree of a scenario's train control.

``run.py availability`` gives this a command line.
"""

import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeAlias

from kankaku.analysis.publish.dependability_publishing import (
    DEPENDABILITY_RESULTS,
    DependabilityTables,
    publish_dependability,
)
from kankaku.analysis.results import refuse_foreign
from kankaku.analysis.tables.dependability import Endurance
from kankaku.asking import YEARS
from kankaku.railway.failures.availability import Configuration, availability, simulate_outages
from kankaku.railway.failures.fault_tree import FaultTree, FaultTreeError, minimal_cut_sets
from kankaku.scenarios.reading.dependability_files import load_configurations, load_fault_tree
from kankaku.store import failed_runs
from kankaku.store.holding import held
from kankaku.studies.provenance import provenance_of
from kankaku.studies.study import Study, StudyError, StudyResult
from kankaku.workers import attempt

Progress: TypeAlias = Callable[[int, int], None]
"""Called with the number of finished systems, and of all."""


class AvailabilityResult(NamedTuple):
    """What is written."""

    folder: Path
    tables: DependabilityTables | None
    """None if every system failed."""
    failures: list[str]
    """A sentence each."""


def run_availability(
    study: Study,
    scenario_folder: Path,
    out: Path,
    years: int = YEARS,
    progress: Progress = lambda *_: None,
) -> AvailabilityResult:
    """
    Work out availability and fault tree of a scenario and write them.

    Parameters
    ----------
    study
        Scenario; its first seed is that of the simulated years.
    scenario_folder
        Folder of the scenario, with ``availability.toml`` and perhaps ``fault_tree.toml``.
    out
        Folder that will hold the results folder, named as the scenario with ``_availability``.
    years
        How many years of failures and repairs to simulate. [-]
    progress
        Called when a system is finished.

    Returns
    -------
    AvailabilityResult
        What was found and written; a system that fails takes no other with it.

    Raises
    ------
    ScenarioError
        If a file cannot be used.
    StudyError
        If the fault tree has too many cut sets, or a system is stopped all the time.
    FileExistsError
        If something else stands where the results would go.
    HeldError
        If another command writes there.
    """
    folder = out / f"{study.scenario.name}_availability"
    systems, source, digest = load_configurations(scenario_folder)
    tree = load_fault_tree(scenario_folder)
    refuse_foreign(folder, DEPENDABILITY_RESULTS.marks)
    for system in systems:
        if availability(system).availability < 0.0:
            msg = f"availability.toml: {system.name} is stopped for longer than a year has hours; "
            msg += "allowed: failures so rare that they hardly ever meet"
            raise StudyError(msg)
    try:
        if tree:
            for top in tree.tops:
                minimal_cut_sets(tree, top)
    except FaultTreeError as error:
        msg = f"fault_tree.toml: {error}"
        raise StudyError(msg) from error
    with held(folder):
        return _simulated(study, folder, (systems, source, digest), tree, years, progress)


def _simulated(
    study: Study,
    folder: Path,
    loaded: tuple[Sequence[Configuration], str, str],
    tree: FaultTree | None,
    years: int,
    progress: Progress,
) -> AvailabilityResult:
    systems, source, digest = loaded
    started = time.perf_counter()
    found, failed = [], {}
    progress(0, len(systems))
    for done, system in enumerate(systems, start=1):
        outages, failure = attempt(partial(simulate_outages, system, years, study.seeds[0]))
        if outages is not None:
            found.append(Endurance(system, outages))
        elif failure is not None:
            failed[system.name] = failure
        progress(done, len(systems))
    failed_runs.clear(folder)
    sentences = [
        failed_runs.noted_sentence(folder, name, f"{name}: {failure.sentence}", failure)
        for name, failure in failed.items()
    ]
    if not found:
        return AvailabilityResult(folder, None, sentences)
    told = {
        **provenance_of(study, StudyResult(folder), time.perf_counter() - started),
        "years": years,
        "availability_sha256": digest,
        "fault_tree_sha256": tree.digest if tree else None,
        "failed": sentences,
    }
    tables = publish_dependability(folder, found, tree, source, told)
    return AvailabilityResult(folder, tables, sentences)
