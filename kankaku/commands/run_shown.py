"""What the command ``run`` shows: the choice, how it comes along, and the comparison."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.progress import ProgressColumn, Task, TaskID
from rich.text import Text

from kankaku.analysis.tables.sweep import SWEEP
from kankaku.analysis.texts.report import unfinished_heading
from kankaku.analysis.texts.sweep_texts import sweep_texts
from kankaku.commands.comparison_shown import show_comparison
from kankaku.commands.page_shown import open_page
from kankaku.commands.screen import (
    Log,
    answers,
    bars,
    chosen_of,
    complain,
    console,
    counted_text,
    exit_status,
    refusals,
    show_doubts,
    show_group,
    show_table,
)
from kankaku.commands.shared_options import Format
from kankaku.commands.told_tables import tell_frame
from kankaku.controllers.choosing import foretold
from kankaku.studies import study
from kankaku.studies.outcomes import Go, Hearers


def compare(
    scenario: Path | None,
    out: Path,
    choices: Mapping[str, Any],
    form: Format = Format.TABLE,
    opened: bool | None = None,
) -> int:
    """
    Run controllers of a scenario and compare them.

    Parameters
    ----------
    scenario
        Its folder or name.
    out
        Folder that will hold the results folder.
    choices
        As of :func:`kankaku.studies.study.choose`.
    form
        How the comparison is written.
    opened
        Open the page; if None, where there is a desktop.

    Returns
    -------
    int
        How the command ends.
    """
    if scenario is None:
        complain("Nothing to run", ["SCENARIO: missing; allowed: a scenario folder"])
    with refusals(scenario, out):
        chosen = chosen_of(scenario, choices)
        show_doubts(chosen)
        with study.ready(chosen, out) as go:
            result = run_shown(chosen, go)
    status = report(result, chosen, form)
    open_page(result.folder, wanted=opened)
    return status


class Clock(ProgressColumn):
    """Simulated time and speed-up."""

    def render(self, task: Task) -> Text:
        """Return both as text."""
        elapsed_s = task.finished_time if task.finished else task.elapsed
        speed_up = task.completed / elapsed_s if elapsed_s else 0.0
        minutes = int(task.completed // 60)
        return Text(f"{minutes // 60:d} h {minutes % 60:02d} min, {speed_up:,.0f} x", no_wrap=True)


def run_shown(chosen: study.Study, go: Go) -> study.StudyResult:
    """
    Run a study and show how it comes along: bars on a terminal, lines in a log file.

    Parameters
    ----------
    chosen
        What is run.
    go
        Runs it.

    Returns
    -------
    study.StudyResult
        What is finished.
    """
    if not console.is_terminal:
        return _run_with_log(go)
    with bars(Clock()) as shown:
        # Of each controller.
        runs = len(chosen.tasks) // len(chosen.specs)
        many = f", {runs} {'delays' if chosen.scenario.sweep else 'seeds'}" if runs > 1 else ""
        # A bar per controller: one per run would not fit on a screen.
        bar_of: dict[str, TaskID] = {}
        done: dict[study.Task, float] = {}

        def show(task: study.Task, done_s: float, expected_s: float) -> None:
            name, done[task] = task.controller, done_s
            if name not in bar_of:
                bar_of[name] = shown.add_task(f"{name}{many}")
            together_s = sum(s for other, s in done.items() if other.controller == name)
            total_s = max(together_s, runs * expected_s)
            shown.update(bar_of[name], completed=together_s, total=total_s)

        return go(Hearers(show, _say))


def _run_with_log(go: Go) -> study.StudyResult:
    log = Log()

    def show(task: study.Task, done_s: float, expected_s: float) -> None:
        share = 100.0 * min(done_s / expected_s, 1.0) if expected_s > 0.0 else 100.0
        log.tell(f"{task}: {share:.0f} %")

    def tell(task: study.Task, end: str, done: int, total: int) -> None:
        log.tell(f"{task}: {end}, {done} of {total}", always=True)

    return go(Hearers(show, _say, tell))


def _say(sentence: str) -> None:
    console.print(escape(sentence), soft_wrap=True, highlight=False)


def report(result: study.StudyResult, chosen: study.Study, form: Format = Format.TABLE) -> int:
    """
    Show what a study found: the comparison, and each kind of trouble under its own heading.

    Parameters
    ----------
    result
        What is finished.
    chosen
        What was to be run.
    form
        How the comparison is written.

    Returns
    -------
    int
        How the command ends.
    """
    if result.summary is not None:
        if result.sweep:
            swept = result.sweep.indicators
            if form is Format.TABLE:
                header, rows = sweep_texts(swept)
                show_table(header, *rows)
            else:
                tell_frame(swept, SWEEP, form)
            if result.sweep.published and form is Format.TABLE:
                source = escape(result.sweep.published.source)
                answers.print(f"Published: {source}", soft_wrap=True)
        else:
            peers = [spec.name for spec in chosen.specs if spec.peer]
            show_comparison(result.summary, foretold(chosen.specs), peers, form, result.folder)
        if form is Format.TABLE:
            answers.print(f"Results: {result.folder}", soft_wrap=True, markup=False)
    show_troubles(result, chosen)
    if result.interrupted:
        tell_interrupted(kept=bool(result.outcomes), fresh=chosen.fresh)
    return exit_status(
        violations=bool(result.violations),
        failures=bool(result.failures),
        interrupted=result.interrupted,
    )


def show_troubles(result: study.StudyResult, chosen: study.Study, where: str = "") -> None:
    """
    Show what went wrong in a study, each kind of trouble under its own heading.

    Parameters
    ----------
    result
        What is finished.
    chosen
        What was to be run.
    where
        What stands before each heading.
    """
    violations = counted_text(len(result.violations), "safety violation", "safety violations")
    show_group(f"{where}{violations}", result.violations)
    failures = counted_text(len(result.failures), "failure", "failures")
    show_group(f"{where}{failures}", result.failures)
    left = result.unfinished
    heading = unfinished_heading(len(left), chosen.scenario.patience_s)
    show_group(f"{where}{heading}", left, style="yellow")


def tell_interrupted(*, kept: bool, fresh: bool) -> None:
    """
    Tell what an interrupt has left.

    Parameters
    ----------
    kept
        A run was finished.
    fresh
        The user wanted everything anew.
    """
    told = "what was finished is kept" if kept else "no run was finished"
    again = " without --fresh" if fresh else ""
    more = f"; the same command{again} goes on from there" if kept else ""
    console.print(f"Interrupted: {told}{more}.", soft_wrap=True)
