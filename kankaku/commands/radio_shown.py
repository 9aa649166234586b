"""What the command ``radio`` shows: utilisation, round trips, and what a cell carries."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.markup import escape

from kankaku.analysis.publish.radio_publishing import RadioTables
from kankaku.analysis.texts.radio_texts import radio_load_texts, radio_sentences
from kankaku.commands.screen import (
    answers,
    chosen_of,
    counted,
    end_with,
    refusals,
    show_table,
)
from kankaku.commands.shared_options import OUT
from kankaku.railway.plan.scenario import Scenario
from kankaku.scenarios.shipped import folder_of
from kankaku.studies.radio_study import run_radio


def tell_load(
    scenario: Path,
    out: Path,
    choices: Mapping[str, Any],
    results: Path | None,
    controller: str | None,
) -> int:
    """
    Tell what the trains of a saved run ask of the radio.

    Parameters
    ----------
    scenario
        Folder or name of a scenario.
    out
        Folder that will hold the results folder.
    choices
        As of :func:`kankaku.studies.study.choose`.
    results
        Results folder whose trains to take; that of the scenario if None.
    controller
        Whose trains to take; those of the first one if None.

    Returns
    -------
    int
        How the command ends.
    """
    with refusals(scenario, out):
        chosen = chosen_of(scenario, choices)
        place = OUT / chosen.scenario.name if results is None else results
        with counted("radio") as progress:
            found = run_radio(chosen, folder_of(scenario), place, out, controller, progress)
    if found.tables is not None:
        _show_radio(found.tables, chosen.scenario, place)
    return end_with(found.failures)


def _show_radio(tables: RadioTables, scenario: Scenario, place: Path) -> None:
    for system in tables.plan.systems:
        show_table(*_radio_table(tables, system.name))
    if tables.plan.source:
        answers.print(f"Published: {escape(tables.plan.source)}", soft_wrap=True)
    for sentence in radio_sentences(tables.cases, tables.points, tables.plan):
        answers.print(escape(sentence))
    if tables.run.scenario_digest != scenario.digest:
        told = f"{escape(str(place))}: of a scenario that has been changed since."
        answers.print(told, soft_wrap=True)
    answers.print(f"Results: {tables.folder}", soft_wrap=True, markup=False)


def _radio_table(found: RadioTables, system: str) -> list[list[str]]:
    cases = [case for case in found.cases if case.system.name == system]
    header, rows = radio_load_texts(cases, found.plan)
    return [header, *rows]
