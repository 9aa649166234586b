"""Kankaku on the command line: ``python run.py scenarios/rush_hour``."""

import os
import signal
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import typer
from rich.markup import escape
from rich.progress import ProgressColumn, Task, TaskID
from rich.table import Table
from rich.text import Text
from typer.core import TyperCommand, TyperGroup

import availability
import capacity
import controllers
import faults
import radio_load
import study
from analysis import (
    RadioTables,
    availability_texts,
    capacity_texts,
    comparison,
    comparison_texts,
    fault_texts,
    fault_tree_texts,
    headway_texts,
    radio_load_texts,
    radio_sentences,
    sweep_texts,
)
from screen import (
    EXIT_BAD_INPUT,
    EXIT_INTERRUPTED,
    SIDE_BY_SIDE,
    answers,
    bars,
    console,
    list_sentences,
    refusals,
    show_side_by_side,
    show_table,
    show_warnings,
)
from study import MOST_SEEDS, SEED_MAX, STEP_RANGE_S

__all__ = ["EXIT_BAD_INPUT", "EXIT_INTERRUPTED", "EXIT_VIOLATION", "app", "end_as_by_ctrl_c"]

EXIT_VIOLATION = 3
COMPARE = "compare"
"""The command that need not be named."""
OTHERS = """Other commands: python run.py capacity {scenario} tells how close trains can follow
each other, faults {scenario} what faults do to a control map, radio {scenario} what trains ask of
the radio, availability {scenario} how often devices stop the line; python run.py capacity --help
and so on."""


class Commands(TyperGroup):
    """Takes a first argument that names no command for the scenario to compare."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - private type
        """Name the command where the user did not."""
        named = bool(args) and args[0] in self.commands
        return super().parse_args(ctx, args if named else [COMPARE, *args])


class Unnamed(TyperCommand):
    """A command that need not be named."""

    def make_context(self, info_name: str | None, *rest: Any, **extra: Any) -> Any:  # noqa: ANN401
        """Leave the name out of what the user reads about its usage."""
        parent = extra.pop("parent", None)
        return super().make_context(parent.info_name if parent else info_name, *rest, **extra)


app = typer.Typer(cls=Commands, add_completion=False, pretty_exceptions_enable=False)


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
    title = "Peer (drives the trains itself)"
    peers = Table("name", "what it does", title=title, title_justify="left")
    for name, peer in controllers.PEERS.items():
        peers.add_row(name, peer.summary)
    answers.print(peers)
    answers.print(
        "A scenario names controllers as pairs of protection and operation, or as a peer: "
        "see its scenario.toml."
    )
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


ScenarioFolder: TypeAlias = Annotated[
    Path, typer.Argument(help="Scenario folder, e.g. scenarios/rush_hour.")
]
Names: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(help="Controller of the scenario; repeat for several, baseline first."),
]
Step: TypeAlias = Annotated[
    float | None,
    typer.Option(
        min=STEP_RANGE_S[0],
        max=STEP_RANGE_S[1],
        callback=_whole_milliseconds,
        help="Length of a step, whole milliseconds. [s]",
    ),
]
Jobs: TypeAlias = Annotated[
    int, typer.Option(min=1, help="Processes to use.", show_default="all processors")
]
Seed: TypeAlias = Annotated[
    int | None, typer.Option(min=0, max=SEED_MAX, help="Seed; the scenario's own if not given.")
]
Out: TypeAlias = Annotated[Path, typer.Option(help="Where results go.")]
PROCESSORS = os.cpu_count() or 1
OUT = Path("out")


@app.command(COMPARE, cls=Unnamed, epilog=OTHERS)
def compare(  # noqa: PLR0913, PLR0917 - one argument per option of the command line
    scenario: ScenarioFolder,
    controller: Names = None,
    seed: Annotated[
        int | None, typer.Option(min=0, max=SEED_MAX, help="Seed of the dwell delays.")
    ] = None,
    seeds: Annotated[
        int, typer.Option(min=1, max=MOST_SEEDS, help="Run this many seeds, counting up.")
    ] = 1,
    step: Step = None,
    jobs: Jobs = PROCESSORS,
    out: Out = OUT,
    gui: Annotated[bool, typer.Option("--gui", help="Show the runs in sumo-gui.")] = False,
    list_controllers: Annotated[  # noqa: ARG001 - handled by its callback
        bool,
        typer.Option(
            "--list-controllers",
            callback=_list_controllers,
            is_eager=True,
            help="Show what protections, operations and peers there are.",
        ),
    ] = False,
) -> None:
    """Run the controllers of a scenario on the same trains and delays, and compare them."""
    with refusals(scenario, out):
        chosen = _chosen(
            scenario,
            names=controller or (),
            seed=seed,
            seeds=seeds,
            step_s=step,
            jobs=jobs,
            gui=gui,
        )
        result = _run(chosen, out)
    _report(result)


@app.command("capacity")
def show_capacity(
    scenario: ScenarioFolder,
    controller: Names = None,
    simulate: Annotated[
        capacity.Check,
        typer.Option(help="Which headways two simulated trains check: those of the line, or all."),
    ] = capacity.Check.CRITICAL,
    step: Step = None,
    jobs: Jobs = PROCESSORS,
    out: Out = OUT,
) -> None:
    """Tell how close trains can follow each other under the controllers of a scenario."""
    with refusals(scenario, out):
        chosen = _chosen(scenario, names=controller or (), step_s=step, jobs=jobs, everything=True)
        with bars() as shown:
            bar = shown.add_task("capacity")
            found = capacity.run_capacity(
                chosen,
                out,
                simulate,
                lambda done, total: shown.update(bar, completed=done, total=total),
            )
    names = {station.id: station.name for station in chosen.scenario.line.stations}
    answers.print("Headways in seconds by blocking times; in brackets: of two simulated trains")
    header, rows, notes = headway_texts(found.headways, names)
    show_side_by_side(header, rows, kept=2, shown=SIDE_BY_SIDE - 1)
    for note in notes:
        answers.print(escape(note))
    header, rows = capacity_texts(found.capacity, names)
    show_side_by_side(header, rows, kept=1, shown=SIDE_BY_SIDE)
    answers.print(f"Results: {found.folder}", soft_wrap=True, markup=False)


@app.command("faults")
def show_faults(  # noqa: PLR0913, PLR0917 - one argument per option of the command line
    scenario: ScenarioFolder,
    controller: Annotated[
        str, typer.Option(help="Controller of the scenario with the protection control_map.")
    ] = faults.PROTECTION,
    runs: Annotated[int, typer.Option(min=1, help="Runs, with one fault each.")] = 1000,
    seed: Seed = None,
    step: Step = None,
    jobs: Jobs = PROCESSORS,
    out: Out = OUT,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Start anew instead of continuing earlier runs.")
    ] = False,
) -> None:
    """Let trains, equipment and the centre of a control map fail, one thing in each run."""
    with refusals(scenario, out):
        chosen = _chosen(scenario, names=(controller,), seed=seed, step_s=step, jobs=jobs)
        campaign = faults.Campaign(chosen, runs, fresh)
        with bars() as shown:
            bar = shown.add_task("faults")
            found = faults.run_campaign(
                campaign, out, lambda done, total: shown.update(bar, completed=done, total=total)
            )
    header, rows = fault_texts(found.tables.table)
    shown_table = Table(*map(escape, header))
    for column in shown_table.columns[-3:]:
        column.justify = "right"
    for row in rows:
        shown_table.add_row(*map(escape, row))
    answers.print(shown_table)
    answers.print(f"Results: {found.tables.folder}", soft_wrap=True, markup=False)
    if found.interrupted:
        again = "without --fresh " if fresh else ""
        told = f"Interrupted: what was finished is kept; the same command {again}continues."
        console.print(told)
    if found.unsafe:
        console.print(f"[bold red]{len(found.unsafe)} runs with unsafe events[/]")
        list_sentences(found.unsafe)
        raise typer.Exit(EXIT_VIOLATION)
    if found.interrupted:
        raise typer.Exit(EXIT_INTERRUPTED)


@app.command("radio")
def show_radio(
    scenario: ScenarioFolder,
    results: Annotated[
        Path | None,
        typer.Option(
            help="Results folder whose trains to take.", show_default="out/ and the scenario's name"
        ),
    ] = None,
    controller: Annotated[
        str | None,
        typer.Option(help="Whose trains to take.", show_default="the first of the results"),
    ] = None,
    seed: Seed = None,
    jobs: Jobs = PROCESSORS,
    out: Out = OUT,
) -> None:
    """Tell what the trains of a saved run ask of the radio, and how many a cell carries."""
    with refusals(scenario, out):
        chosen = _chosen(scenario, seed=seed, jobs=jobs)
        place = OUT / chosen.scenario.name if results is None else results
        with bars() as shown:
            bar = shown.add_task("radio")
            found = radio_load.run_radio(
                chosen,
                scenario,
                place,
                out,
                controller,
                lambda done, total: shown.update(bar, completed=done, total=total),
            )
    for system in found.plan.systems:
        show_table(*_radio_table(found, system.name))
    if found.plan.source:
        answers.print(f"Published: {escape(found.plan.source)}", soft_wrap=True)
    for sentence in radio_sentences(found.cases, found.points, found.plan):
        answers.print(escape(sentence))
    if found.run.scenario_digest != chosen.scenario.digest:
        told = f"{escape(str(place))}: of a scenario that has been changed since."
        answers.print(told, soft_wrap=True)
    answers.print(f"Results: {found.folder}", soft_wrap=True, markup=False)


def _radio_table(found: RadioTables, system: str) -> list[list[str]]:
    cases = [case for case in found.cases if case.system.name == system]
    header, rows = radio_load_texts(cases, found.plan)
    return [header, *rows]


@app.command("availability")
def show_availability(
    scenario: ScenarioFolder,
    years: Annotated[
        int, typer.Option(min=2, max=10_000_000, help="Years of failures to simulate.")
    ] = availability.YEARS,
    seed: Seed = None,
    out: Out = OUT,
) -> None:
    """Tell how often devices stop the line, and what would have to fail for an accident."""
    with refusals(scenario, out):
        chosen = _chosen(scenario, seed=seed)
        with bars() as shown:
            bar = shown.add_task("availability")
            found = availability.run_availability(
                chosen,
                scenario,
                out,
                years,
                lambda done, total: shown.update(bar, completed=done, total=total),
            )
    header, rows = availability_texts(found.systems)
    show_side_by_side(header, rows, kept=1, shown=SIDE_BY_SIDE - 1)
    if found.source:
        answers.print(f"In brackets: {escape(found.source)}", soft_wrap=True)
    answers.print(f"Simulated: {years:,} years, means with 99 % intervals")
    if found.tree:
        header, rows = fault_tree_texts(found.tree)
        show_table(header, *rows)
    answers.print(f"Results: {found.folder}", soft_wrap=True, markup=False)


def _chosen(scenario: Path, **choices: Any) -> study.Study:  # noqa: ANN401 - as of study.choose
    """Choose what to run, and tell what is doubtful in it."""
    chosen = study.choose(scenario, **choices)
    show_warnings(chosen.scenario.warnings)
    return chosen


def _run(chosen: study.Study, out: Path) -> study.StudyResult:
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

        return study.run_study(chosen, out, show)


def _report(result: study.StudyResult) -> None:
    if result.summary is not None:
        if result.sweep:
            header, rows = sweep_texts(result.sweep.indicators)
            show_table(header, *rows)
            if result.sweep.published:
                source = escape(result.sweep.published.source)
                answers.print(f"Published: {source}", soft_wrap=True)
        else:
            header, rows = comparison_texts(comparison(result.summary))
            if header[2:]:
                answers.print(f"In brackets: change against {escape(header[1])}")
            show_side_by_side(header, rows, kept=2, shown=SIDE_BY_SIDE - 1)
        answers.print(f"Results: {result.folder}", soft_wrap=True, markup=False)
    if result.violations:
        console.print(f"[bold red]{len(result.violations)} safety violations[/]")
        list_sentences(result.violations)
    if result.interrupted:
        told = "what was finished is kept" if result.outcomes else "no run was finished"
        console.print(f"Interrupted: {told}.")
    if result.violations:
        raise typer.Exit(EXIT_VIOLATION)
    if result.interrupted:
        raise typer.Exit(EXIT_INTERRUPTED)


def end_as_by_ctrl_c() -> None:
    """Let a closed terminal or a kill end the worker processes, too; nohup stays nohup."""
    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, signal.default_int_handler)


if __name__ == "__main__":
    end_as_by_ctrl_c()
    app()
