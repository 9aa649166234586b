"""What the command ``campaign`` shows: what became of each kind of failure."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.table import Table

from kankaku.analysis.publish.campaign_publishing import CampaignTables
from kankaku.analysis.texts.campaign_texts import campaign_texts
from kankaku.commands.screen import (
    answers,
    chosen_of,
    console,
    counted,
    counted_text,
    exit_status,
    refusals,
    show_group,
)
from kankaku.studies.campaign import run_campaign
from kankaku.studies.campaign_journal import Campaign


def let_fail(scenario: Path, out: Path, choices: Mapping[str, Any], runs: int) -> int:
    """
    Let trains, equipment and the centre of a control map fail.

    Parameters
    ----------
    scenario
        Folder or name of a scenario.
    out
        Folder that will hold the results folder.
    choices
        As of :func:`kankaku.studies.study.choose`.
    runs
        Runs, with one failure each.

    Returns
    -------
    int
        How the command ends.
    """
    with refusals(scenario, out):
        chosen = chosen_of(scenario, choices)
        with counted("campaign") as progress:
            found = run_campaign(Campaign(chosen, runs, chosen.fresh), out, progress)
    _show(found.tables)
    show_group(f"{counted_text(len(found.failures), 'run', 'runs')} failed", found.failures)
    if found.interrupted:
        again = "without --fresh " if chosen.fresh else ""
        told = f"Interrupted: what was finished is kept; the same command {again}continues."
        console.print(told, soft_wrap=True)
    show_group(f"{len(found.unsafe)} runs with unsafe events", found.unsafe)
    return exit_status(
        violations=bool(found.unsafe),
        failures=bool(found.failures),
        interrupted=found.interrupted,
    )


def _show(tables: CampaignTables) -> None:
    header, rows = campaign_texts(tables.table)
    shown = Table(*map(escape, header))
    for column in shown.columns[-3:]:
        column.justify = "right"
    for row in rows:
        shown.add_row(*map(escape, row))
    answers.print(shown)
    answers.print(f"Results: {tables.folder}", soft_wrap=True, markup=False)
