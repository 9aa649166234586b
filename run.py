"""Kankaku on the command line: ``python run.py scenarios/rush_hour``."""

import os
import signal
from dataclasses import fields
from pathlib import Path
from typing import Annotated, NoReturn

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
)
from rich.table import Table
from rich.text import Text

import controllers
import study
from analysis import comparison, comparison_texts, sweep_texts
from scenarios import ScenarioError

EXIT_BAD_INPUT = 2
EXIT_VIOLATION = 3
EXIT_INTERRUPTED = 130
SIDE_BY_SIDE = 4
"""Controllers in one table, the baseline first; more do not fit on a screen."""
SHOWN_SENTENCES = 10
"""So that the first ones stay on the screen."""
STEP_RANGE_S = (0.01, 0.5)
SEED_MAX = 2**63 - 1
MAIN_FILE = "scenario.toml"

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
console = Console(stderr=True)
answers = Console()


class Clock(ProgressColumn):
    """Simulated time and speed-up."""

    def render(self, task: Task) -> Text:
        """Return both as text."""
        elapsed_s = task.finished_time if task.finished else task.elapsed
        speed_up = task.completed / elapsed_s if elapsed_s else 0.0
        minutes = int(task.completed // 60)
        return Text(f"{minutes // 60:d} h {minutes % 60:02d} min, {speed_up:,.0f} x", no_wrap=True)


def _list_controllers(value: bool) -> None:
    if not value:
        return
    for title, registry in (
        ("Protection (how far and how fast a train may go)", controllers.PROTECTIONS),
        ("Operation (how it uses that permission)", controllers.OPERATIONS),
    ):
        table = Table("name", "what it does", "options", title=title, title_justify="left")
        for name, layer in registry.items():
            options = (f"{field.name} = {_toml(field.default)}" for field in fields(layer.options))
            table.add_row(name, layer.summary, "\n".join(options))
        answers.print(table)
    answers.print("A scenario names controllers as pairs of both: see its scenario.toml.")
    raise typer.Exit


def _toml(value: object) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(_toml, value))}]"
    return str(value).lower() if isinstance(value, bool) else str(value)


def _whole_milliseconds(step_s: float | None) -> float | None:
    # SUMO counts whole milliseconds; with any other step the two clocks drift apart.
    if step_s is not None and abs(1000.0 * step_s - round(1000.0 * step_s)) > 1e-9:
        msg = f"{step_s:g} s is not a whole number of milliseconds; allowed: 0.01, 0.125, 0.5, ..."
        raise typer.BadParameter(msg)
    return step_s


@app.command()
def main(  # noqa: PLR0913, PLR0917 - one argument per option of the command line
    scenario: Annotated[Path, typer.Argument(help="Scenario folder, e.g. scenarios/rush_hour.")],
    controller: Annotated[
        list[str] | None,
        typer.Option(help="Controller of the scenario; repeat for several, baseline first."),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, max=SEED_MAX, help="Seed of the dwell delays.")
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Run this many seeds, counting up.")] = 1,
    step: Annotated[
        float | None,
        typer.Option(
            min=STEP_RANGE_S[0],
            max=STEP_RANGE_S[1],
            callback=_whole_milliseconds,
            help="Length of a step, whole milliseconds. [s]",
        ),
    ] = None,
    jobs: Annotated[
        int, typer.Option(min=1, help="Processes to use.", show_default="all processors")
    ] = os.cpu_count() or 1,
    out: Annotated[Path, typer.Option(help="Where results go.")] = Path("out"),
    gui: Annotated[bool, typer.Option("--gui", help="Show the runs in sumo-gui.")] = False,
    list_controllers: Annotated[  # noqa: ARG001 - handled by its callback
        bool,
        typer.Option(
            "--list-controllers",
            callback=_list_controllers,
            is_eager=True,
            help="Show what protections and operations there are.",
        ),
    ] = False,
) -> None:
    """Run the controllers of a scenario on the same trains and delays, and compare them."""
    if not (scenario / MAIN_FILE).is_file():
        problem = f"no such folder with a {MAIN_FILE}; allowed: a scenario folder"
        _complain(f"{scenario} cannot be used", [f"{scenario}: {problem}"])
    try:
        chosen = study.choose(
            scenario,
            names=controller or (),
            seed=seed,
            seeds=seeds,
            step_s=step,
            jobs=jobs,
            gui=gui,
        )
        result = _run(chosen, out)
    except ScenarioError as error:
        _complain(f"{scenario} cannot be used", [str(fault) for fault in error.faults])
    except controllers.ControllerError as error:
        place = "" if error.where.startswith("--") else f"{MAIN_FILE}: "
        _complain(f"{scenario} cannot be run", [f"{place}{error}"])
    except study.StudyError as error:
        _complain(f"{scenario} cannot be run", [str(error)])
    except OSError as error:
        told = f"{error.filename or out}: {error.strerror}" if error.strerror else str(error)
        _complain(f"{scenario} cannot be run", [told])
    except KeyboardInterrupt:
        console.print("Interrupted: nothing was written.")
        raise typer.Exit(EXIT_INTERRUPTED) from None
    else:
        _report(result)


def _run(chosen: study.Study, out: Path) -> study.StudyResult:
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        Clock(),
        TimeElapsedColumn(),
        console=console,
    ) as bars:
        # Of each controller.
        runs = len(chosen.tasks) // len(chosen.specs)
        many = f", {runs} {'delays' if chosen.scenario.sweep else 'seeds'}" if runs > 1 else ""
        # A bar per controller: one per run would not fit on a screen.
        bar_of: dict[str, TaskID] = {}
        done: dict[study.Task, float] = {}

        def show(task: study.Task, done_s: float, expected_s: float) -> None:
            name, done[task] = task.controller, done_s
            if name not in bar_of:
                bar_of[name] = bars.add_task(f"{name}{many}")
            together_s = sum(s for other, s in done.items() if other.controller == name)
            total_s = max(together_s, runs * expected_s)
            bars.update(bar_of[name], completed=together_s, total=total_s)

        return study.run_study(chosen, out, show)


def _complain(title: str, sentences: list[str]) -> NoReturn:
    console.print(f"[bold red]{escape(title)}[/]", soft_wrap=True)
    _list(sentences)
    raise typer.Exit(EXIT_BAD_INPUT)


def _list(sentences: list[str]) -> None:
    for sentence in sentences[:SHOWN_SENTENCES]:
        console.print(f"  {escape(sentence)}", soft_wrap=True)
    if len(sentences) > SHOWN_SENTENCES:
        console.print(f"  and {len(sentences) - SHOWN_SENTENCES} more")


def _report(result: study.StudyResult) -> None:
    if result.summary is not None:
        if result.sweep:
            header, rows = sweep_texts(result.sweep.indicators)
            _show_table(header, *rows)
            if result.sweep.published:
                source = escape(result.sweep.published.source)
                answers.print(f"Published: {source}", soft_wrap=True)
        else:
            header, rows = comparison_texts(comparison(result.summary))
            if header[2:]:
                answers.print(f"In brackets: change against {escape(header[1])}")
            for first in range(2, max(len(header), 3), SIDE_BY_SIDE - 1):
                kept = [0, 1, *range(first, min(first + SIDE_BY_SIDE - 1, len(header)))]
                _show_table(*([line[column] for column in kept] for line in (header, *rows)))
        answers.print(f"Results: {result.folder}", soft_wrap=True)
    if result.violations:
        console.print(f"[bold red]{len(result.violations)} safety violations[/]")
        _list(result.violations)
    if result.interrupted:
        told = "what was finished is kept" if result.outcomes else "no run was finished"
        console.print(f"Interrupted: {told}.")
    if result.violations:
        raise typer.Exit(EXIT_VIOLATION)
    if result.interrupted:
        raise typer.Exit(EXIT_INTERRUPTED)


def _show_table(header: list[str], *rows: list[str]) -> None:
    # Names with spaces wrap where a reader expects it.
    table = Table(*(escape(name.replace("_", " ")) for name in header))
    for column in table.columns[1:]:
        column.justify, column.overflow = "right", "fold"
    for row in rows:
        table.add_row(*map(escape, row))
    answers.print(table)


def end_as_by_ctrl_c() -> None:
    """Let a closed terminal or a kill end the worker processes, too; nohup stays nohup."""
    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, signal.default_int_handler)


if __name__ == "__main__":
    end_as_by_ctrl_c()
    app()
