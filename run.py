"""Kankaku on the command line: ``python run.py scenarios/rush_hour``."""

import os
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
    TextColumn,
    TimeElapsedColumn,
)
from rich.table import Table
from rich.text import Text

import controllers
import study
from analysis import comparison, comparison_texts
from scenarios import ScenarioError

EXIT_BAD_INPUT = 2
EXIT_VIOLATION = 3
EXIT_INTERRUPTED = 130
SHOWN_VIOLATIONS = 10
STEP_RANGE_S = (0.01, 0.5)

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
        return Text(f"{minutes // 60:d} h {minutes % 60:02d} min simulated, {speed_up:,.0f} x")


def _list_controllers(value: bool) -> None:
    if not value:
        return
    for title, registry in (
        ("Protection (how far and how fast a train may go)", controllers.PROTECTIONS),
        ("Operation (how it uses that permission)", controllers.OPERATIONS),
    ):
        table = Table("name", "what it does", title=title, title_justify="left")
        for name, layer in registry.items():
            table.add_row(name, layer.summary)
        answers.print(table)
    answers.print("A scenario names controllers as pairs of both: see its scenario.toml.")
    raise typer.Exit


@app.command()
def main(  # noqa: PLR0913, PLR0917 - one argument per option of the command line
    scenario: Annotated[Path, typer.Argument(help="Scenario folder, e.g. scenarios/rush_hour.")],
    controller: Annotated[
        list[str] | None,
        typer.Option(help="Controller of the scenario; repeat for several, baseline first."),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the dwell delays.")] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Run this many seeds, counting up.")] = 1,
    step: Annotated[
        float | None,
        typer.Option(min=STEP_RANGE_S[0], max=STEP_RANGE_S[1], help="Length of a step. [s]"),
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
    except (controllers.ControllerError, FileExistsError) as error:
        _complain(f"{scenario} cannot be run", [str(error)])
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
        several = len(chosen.seeds) > 1
        bar_of = {}

        def show(task: study.Task, done_s: float, expected_s: float) -> None:
            if task not in bar_of:
                name = f"{task.controller} (seed {task.seed})" if several else task.controller
                bar_of[task] = bars.add_task(name, total=expected_s)
            bars.update(bar_of[task], completed=done_s, total=max(done_s, expected_s))

        return study.run_study(chosen, out, show)


def _complain(title: str, sentences: list[str]) -> NoReturn:
    console.print(f"[bold red]{escape(title)}[/]")
    for sentence in sentences:
        console.print(f"  {escape(sentence)}", soft_wrap=True)
    raise typer.Exit(EXIT_BAD_INPUT)


def _report(result: study.StudyResult) -> None:
    if result.summary is not None:
        header, rows = comparison_texts(comparison(result.summary))
        table = Table(*map(escape, header), title="Comparison (first controller is the baseline)")
        for column in table.columns[1:]:
            column.justify = "right"
        for row in rows:
            table.add_row(*map(escape, row))
        answers.print(table)
        answers.print(f"Results: {result.folder}", soft_wrap=True)
    if result.violations:
        console.print(f"[bold red]{len(result.violations)} safety violations[/]")
        for sentence in result.violations[:SHOWN_VIOLATIONS]:
            console.print(f"  {escape(sentence)}", soft_wrap=True)
        raise typer.Exit(EXIT_VIOLATION)
    if result.interrupted:
        console.print("Interrupted: what was finished is kept.")
        raise typer.Exit(EXIT_INTERRUPTED)


if __name__ == "__main__":
    app()
