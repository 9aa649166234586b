"""What the command ``availability`` shows: stopped time of systems, and the fault tree."""

from pathlib import Path

from rich.markup import escape

from kankaku.analysis.publish.dependability_publishing import DependabilityTables
from kankaku.analysis.texts.dependability_texts import availability_texts, fault_tree_texts
from kankaku.commands.screen import (
    SIDE_BY_SIDE,
    answers,
    chosen_of,
    counted,
    end_with,
    refusals,
    show_side_by_side,
    show_table,
)
from kankaku.scenarios.shipped import folder_of
from kankaku.studies.availability_study import run_availability


def tell_availability(scenario: Path, out: Path, seed: int | None, years: int) -> int:
    """
    Tell how often devices stop the line.

    Parameters
    ----------
    scenario
        Folder or name of a scenario.
    out
        Folder that will hold the results folder.
    seed
        Seed of the failures; the scenario's own if None.
    years
        Years to simulate. [-]

    Returns
    -------
    int
        How the command ends.
    """
    with refusals(scenario, out):
        chosen = chosen_of(scenario, {"seed": seed})
        with counted("availability") as progress:
            found = run_availability(chosen, folder_of(scenario), out, years, progress)
    if found.tables is not None:
        _show(found.tables, years)
    return end_with(found.failures)


def _show(tables: DependabilityTables, years: int) -> None:
    header, rows = availability_texts(tables.systems)
    show_side_by_side(header, rows, kept=1, shown=SIDE_BY_SIDE - 1)
    if tables.source:
        answers.print(f"In brackets: {escape(tables.source)}", soft_wrap=True)
    answers.print(f"Simulated: {years:,} years, means with 99 % intervals")
    if tables.tree:
        header, rows = fault_tree_texts(tables.tree)
        show_table(header, *rows)
    answers.print(f"Results: {tables.folder}", soft_wrap=True, markup=False)
