"""What the command ``across`` shows: each scenario as it comes along, and one table of them all."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.markup import escape

from kankaku.analysis.texts.across_texts import across_lines, across_note
from kankaku.commands.run_shown import run_shown, show_troubles, tell_interrupted
from kankaku.commands.screen import (
    answers,
    console,
    counted_text,
    exit_status,
    refusals,
    show_doubts,
    show_group,
    show_warnings,
)
from kankaku.studies.across_study import AcrossResult, choose_across, run_across
from kankaku.studies.outcomes import Go, Study, StudyResult


def compare_across(scenarios: Sequence[Path], out: Path, choices: Mapping[str, Any]) -> int:
    """
    Run controllers in several scenarios and show them in one table.

    Parameters
    ----------
    scenarios
        Their folders or names.
    out
        Folder that will hold the results folders.
    choices
        As of :func:`kankaku.studies.study.choose`.

    Returns
    -------
    int
        How the command ends.
    """
    with refusals(", ".join(map(str, scenarios)), out):
        studies = choose_across(scenarios, choices)
        for study in studies:
            show_warnings(study.scenario.warnings)
            show_doubts(study)
        result = run_across(studies, out, _run_one)
    return _report(result)


def _run_one(study: Study, go: Go) -> StudyResult:
    console.print(f"[bold]{escape(study.scenario.name)}[/]", highlight=False)
    return run_shown(study, go)


def _report(result: AcrossResult) -> int:
    if result.table is not None:
        for line in (*across_lines(result.table), *across_note(result.table)):
            answers.print(line, soft_wrap=True, markup=False, highlight=False)
        answers.print(f"Results: {result.folder}", soft_wrap=True, markup=False)
    found = [
        (study, result.results[name])
        for study in result.studies
        if (name := study.scenario.name) in result.results
    ]
    for study, one in found:
        show_troubles(one, study, f"{study.scenario.name}: ")
    failed = counted_text(len(result.failures), "failure", "failures")
    show_group(f"Beside single runs {failed}", result.failures)
    if result.interrupted:
        tell_interrupted(kept=result.table is not None, fresh=result.studies[0].fresh)
    return exit_status(
        violations=any(one.violations for _, one in found),
        failures=bool(result.failures) or any(one.failures for _, one in found),
        interrupted=result.interrupted,
    )
