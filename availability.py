"""
Availability and fault tree of a scenario's train control.

``run.py availability`` gives this a command line.
"""

import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

from analysis import (
    DEPENDABILITY_FILES,
    DependabilityTables,
    Endurance,
    publish_dependability,
    refuse_foreign,
)
from provenance import provenance_of
from railway.availability import availability, simulate_outages
from railway.fault_tree import FaultTreeError, minimal_cut_sets
from scenarios import load_configurations, load_fault_tree
from study import Study, StudyError, StudyResult

YEARS = 100_000
Progress: TypeAlias = Callable[[int, int], None]
"""Called with the number of finished systems, and of all."""


def run_availability(
    study: Study,
    scenario_folder: Path,
    out: Path,
    years: int = YEARS,
    progress: Progress = lambda *_: None,
) -> DependabilityTables:
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
    DependabilityTables
        What was found and written.

    Raises
    ------
    ScenarioError
        If a file cannot be used.
    StudyError
        If the fault tree has too many cut sets, or a system is stopped all the time.
    FileExistsError
        If something else stands where the results would go.
    """
    folder = out / f"{study.scenario.name}_availability"
    systems, source, digest = load_configurations(scenario_folder)
    tree = load_fault_tree(scenario_folder)
    refuse_foreign(folder, DEPENDABILITY_FILES)
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
    started = time.perf_counter()
    found = []
    progress(0, len(systems))
    for system in systems:
        found.append(Endurance(system, simulate_outages(system, years, study.seeds[0])))
        progress(len(found), len(systems))
    told = {
        **provenance_of(study, StudyResult(folder), time.perf_counter() - started),
        "years": years,
        "availability_sha256": digest,
        "fault_tree_sha256": tree.digest if tree else None,
    }
    return publish_dependability(folder, found, tree, source, told)
