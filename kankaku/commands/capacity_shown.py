"""What the command ``capacity`` shows: headways, occupation and the pattern."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.markup import escape

from kankaku.analysis.publish.capacity_publishing import CapacityTables
from kankaku.analysis.texts.capacity_texts import capacity_texts, headway_texts, pattern_text
from kankaku.asking import Check
from kankaku.commands.screen import (
    SIDE_BY_SIDE,
    answers,
    chosen_of,
    counted,
    end_with,
    refusals,
    show_doubts,
    show_side_by_side,
)
from kankaku.railway.plan.scenario import Scenario
from kankaku.studies.capacity_study import run_capacity


def assess(scenario: Path, out: Path, choices: Mapping[str, Any], simulate: Check) -> int:
    """
    Tell how close trains can follow each other.

    Parameters
    ----------
    scenario
        Folder or name of a scenario.
    out
        Folder that will hold the results folder.
    choices
        As of :func:`kankaku.studies.study.choose`.
    simulate
        Which headways two simulated trains check.

    Returns
    -------
    int
        How the command ends.
    """
    with refusals(scenario, out):
        chosen = chosen_of(scenario, choices)
        show_doubts(chosen)
        with counted("capacity") as progress:
            found = run_capacity(chosen, out, simulate, progress)
    if found.tables is not None:
        _show(found.tables, chosen.scenario)
    return end_with(found.failures)


def _show(tables: CapacityTables, scenario: Scenario) -> None:
    names = {station.id: station.name for station in scenario.line.stations}
    answers.print("Headways in seconds by blocking times; in brackets: of two simulated trains")
    header, rows, notes = headway_texts(tables.headways, names)
    show_side_by_side(header, rows, kept=2, shown=SIDE_BY_SIDE - 1)
    for note in notes:
        answers.print(escape(note))
    answers.print(escape(pattern_text(tables.capacity)), soft_wrap=True)
    header, rows = capacity_texts(tables.capacity, names)
    show_side_by_side(header, rows, kept=1, shown=SIDE_BY_SIDE)
    answers.print(f"Results: {tables.folder}", soft_wrap=True, markup=False)
