"""Kankaku on the command line: ``python run.py scenarios/rush_hour``."""

import os
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import typer
from rich.markup import escape
from rich.table import Table
from typer.core import TyperCommand, TyperGroup

from kankaku import interrupts
from kankaku.analysis.publish.capacity_publishing import CapacityTables
from kankaku.analysis.publish.dependability_publishing import DependabilityTables
from kankaku.analysis.publish.radio_publishing import RadioTables
from kankaku.analysis.texts.campaign_texts import fault_texts
from kankaku.analysis.texts.capacity_texts import capacity_texts, headway_texts, pattern_text
from kankaku.analysis.texts.dependability_texts import availability_texts, fault_tree_texts
from kankaku.analysis.texts.radio_texts import radio_load_texts, radio_sentences
from kankaku.commands.listing import Listing, controllers_of, known_controllers, versions
from kankaku.commands.screen import (
    EXIT_BAD_INPUT,
    EXIT_FAILED,
    EXIT_VIOLATION,
    SIDE_BY_SIDE,
    answers,
    complain,
    console,
    counted,
    counted_text,
    exit_status,
    refusals,
    show_group,
    show_side_by_side,
    show_table,
    show_warnings,
)
from kankaku.commands.study_screen import report, run_shown
from kankaku.controllers import registry
from kankaku.interrupts import EXIT_INTERRUPTED, end_as_by_ctrl_c
from kankaku.railway.plan.scenario import Scenario
from kankaku.scenarios.loading.load import load
from kankaku.studies import availability_study, campaign, capacity_study, radio_study, study
from kankaku.studies.study import MOST_SEEDS, SEED_MAX, STEP_RANGE_S

__all__ = [
    "EXIT_BAD_INPUT",
    "EXIT_FAILED",
    "EXIT_INTERRUPTED",
    "EXIT_VIOLATION",
    "app",
    "end_as_by_ctrl_c",
]

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

    def invoke(self, ctx: Any) -> Any:  # noqa: ANN401 - private type
        """Run the command; whoever interrupts it, at any moment, reads one sentence."""
        interrupts.under_way()
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            console.print("Interrupted: what was finished is kept.")
            raise typer.Exit(EXIT_INTERRUPTED) from None
        finally:
            interrupts.over()


class Unnamed(TyperCommand):
    """A command that need not be named."""

    def make_context(self, info_name: str | None, *rest: Any, **extra: Any) -> Any:  # noqa: ANN401
        """Leave the name out of what the user reads about its usage."""
        parent = extra.pop("parent", None)
        return super().make_context(parent.info_name if parent else info_name, *rest, **extra)


app = typer.Typer(cls=Commands, add_completion=False, pretty_exceptions_enable=False)


def _show_versions(value: bool) -> None:
    if value:
        answers.print(versions(), highlight=False)
        raise typer.Exit


def _list_controllers(scenario: Path | None) -> None:
    """Show the controllers of a scenario; without one, all that a scenario can name."""
    if scenario is None:
        for listing in known_controllers():
            _show_listing(listing)
        answers.print(
            "A scenario names controllers as pairs of protection and operation, or as a peer: "
            "see its scenario.toml. Any other pair is --controller protection+operation."
        )
        return
    with refusals(scenario, OUT):
        chosen = load(scenario)
        listing = controllers_of(chosen.title, chosen.controllers)
    _show_listing(listing)


def _show_listing(listing: Listing) -> None:
    table = Table(*listing.header, title=escape(listing.title), title_justify="left")
    for row in listing.rows:
        table.add_row(*map(escape, row))
    answers.print(table)


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
    typer.Option(
        help="Controller of the scenario, or protection+operation; repeat for several, baseline "
        "first."
    ),
]
Settings: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME.OPTION=VALUE",
        help="Another value of an option, e.g. two_stage.slowest_kmh=20; repeat for several.",
    ),
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
Fresh: TypeAlias = Annotated[
    bool, typer.Option("--fresh", help="Start anew instead of continuing earlier runs.")
]
PROCESSORS = os.cpu_count() or 1
OUT = Path("out")


@app.command(COMPARE, cls=Unnamed, epilog=OTHERS)
def compare(  # noqa: PLR0913, PLR0917 - one argument per option of the command line
    scenario: Annotated[
        Path | None,
        typer.Argument(
            metavar="SCENARIO",
            show_default=False,
            help="Scenario folder, e.g. scenarios/rush_hour.",
        ),
    ] = None,
    controller: Names = None,
    settings: Settings = None,
    seed: Annotated[
        int | None, typer.Option(min=0, max=SEED_MAX, help="Seed of the dwell delays.")
    ] = None,
    seeds: Annotated[
        int, typer.Option(min=1, max=MOST_SEEDS, help="Run this many seeds, counting up.")
    ] = 1,
    step: Step = None,
    jobs: Jobs = PROCESSORS,
    out: Out = OUT,
    fresh: Fresh = False,
    gui: Annotated[bool, typer.Option("--gui", help="Show the runs in sumo-gui.")] = False,
    list_controllers: Annotated[
        bool,
        typer.Option(
            "--list-controllers",
            help="Show the controllers of the scenario; without one, all that there are.",
        ),
    ] = False,
    version: Annotated[  # noqa: ARG001 - handled by its callback
        bool,
        typer.Option(
            "--version", callback=_show_versions, is_eager=True, help="Show what runs here."
        ),
    ] = False,
) -> None:
    """Run the controllers of a scenario on the same trains and delays, and compare them."""
    if list_controllers:
        _list_controllers(scenario)
        return
    if scenario is None:
        complain("Nothing to run", ["SCENARIO: missing; allowed: a scenario folder"])
    with refusals(scenario, out):
        chosen = _chosen(
            scenario,
            names=controller or (),
            settings=settings or (),
            seed=seed,
            seeds=seeds,
            step_s=step,
            jobs=jobs,
            gui=gui,
            fresh=fresh,
        )
        _show_doubts(chosen)
        result = run_shown(chosen, out)
    _end(report(result, chosen))


@app.command("capacity")
def show_capacity(  # noqa: PLR0917 - one argument per option of the command line
    scenario: ScenarioFolder,
    controller: Names = None,
    settings: Settings = None,
    simulate: Annotated[
        capacity_study.Check,
        typer.Option(help="Which headways two simulated trains check: those of the line, or all."),
    ] = capacity_study.Check.CRITICAL,
    step: Step = None,
    jobs: Jobs = PROCESSORS,
    out: Out = OUT,
) -> None:
    """Tell how close trains can follow each other under the controllers of a scenario."""
    with refusals(scenario, out):
        chosen = _chosen(
            scenario,
            names=controller or (),
            settings=settings or (),
            step_s=step,
            jobs=jobs,
            everything=True,
        )
        _show_doubts(chosen)
        with counted("capacity") as progress:
            found = capacity_study.run_capacity(chosen, out, simulate, progress)
    if found.tables is not None:
        _show_capacity(found.tables, chosen.scenario)
    _end_with(found.failures)


def _show_capacity(tables: CapacityTables, scenario: Scenario) -> None:
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


def _end_with(failures: list[str]) -> None:
    show_group(counted_text(len(failures), "failure", "failures"), failures)
    _end(exit_status(violations=False, failures=bool(failures), interrupted=False))


@app.command("faults")
def show_faults(  # noqa: PLR0913, PLR0917 - one argument per option of the command line
    scenario: ScenarioFolder,
    controller: Annotated[
        str, typer.Option(help="Controller with the protection control_map.")
    ] = campaign.PROTECTION,
    settings: Settings = None,
    runs: Annotated[int, typer.Option(min=1, help="Runs, with one fault each.")] = 1000,
    seed: Seed = None,
    step: Step = None,
    jobs: Jobs = PROCESSORS,
    out: Out = OUT,
    fresh: Fresh = False,
) -> None:
    """Let trains, equipment and the centre of a control map fail, one thing in each run."""
    with refusals(scenario, out):
        chosen = _chosen(
            scenario,
            names=(controller,),
            settings=settings or (),
            seed=seed,
            step_s=step,
            jobs=jobs,
        )
        asked = campaign.Campaign(chosen, runs, fresh)
        with counted("faults") as progress:
            found = campaign.run_campaign(asked, out, progress)
    header, rows = fault_texts(found.tables.table)
    shown_table = Table(*map(escape, header))
    for column in shown_table.columns[-3:]:
        column.justify = "right"
    for row in rows:
        shown_table.add_row(*map(escape, row))
    answers.print(shown_table)
    answers.print(f"Results: {found.tables.folder}", soft_wrap=True, markup=False)
    show_group(f"{counted_text(len(found.failures), 'run', 'runs')} failed", found.failures)
    if found.interrupted:
        again = "without --fresh " if fresh else ""
        told = f"Interrupted: what was finished is kept; the same command {again}continues."
        console.print(told, soft_wrap=True)
    show_group(f"{len(found.unsafe)} runs with unsafe events", found.unsafe)
    _end(
        exit_status(
            violations=bool(found.unsafe),
            failures=bool(found.failures),
            interrupted=found.interrupted,
        )
    )


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
        with counted("radio") as progress:
            found = radio_study.run_radio(chosen, scenario, place, out, controller, progress)
    if found.tables is not None:
        _show_radio(found.tables, chosen.scenario, place)
    _end_with(found.failures)


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


@app.command("availability")
def show_availability(
    scenario: ScenarioFolder,
    years: Annotated[
        int, typer.Option(min=2, max=10_000_000, help="Years of failures to simulate.")
    ] = availability_study.YEARS,
    seed: Seed = None,
    out: Out = OUT,
) -> None:
    """Tell how often devices stop the line, and what would have to fail for an accident."""
    with refusals(scenario, out):
        chosen = _chosen(scenario, seed=seed)
        with counted("availability") as progress:
            found = availability_study.run_availability(chosen, scenario, out, years, progress)
    if found.tables is not None:
        _show_availability(found.tables, years)
    _end_with(found.failures)


def _show_availability(tables: DependabilityTables, years: int) -> None:
    header, rows = availability_texts(tables.systems)
    show_side_by_side(header, rows, kept=1, shown=SIDE_BY_SIDE - 1)
    if tables.source:
        answers.print(f"In brackets: {escape(tables.source)}", soft_wrap=True)
    answers.print(f"Simulated: {years:,} years, means with 99 % intervals")
    if tables.tree:
        header, rows = fault_tree_texts(tables.tree)
        show_table(header, *rows)
    answers.print(f"Results: {tables.folder}", soft_wrap=True, markup=False)


def _chosen(scenario: Path, **choices: Any) -> study.Study:  # noqa: ANN401 - as of study.choose
    """Choose what to run, and tell what is doubtful in it."""
    chosen = study.choose(scenario, **choices)
    show_warnings(chosen.scenario.warnings)
    return chosen


def _show_doubts(chosen: study.Study) -> None:
    """Tell what is doubtful in how controllers fit the line."""
    world = study.world_of(chosen.scenario, chosen.step_s)
    show_warnings(registry.warnings(chosen.specs, world, chosen.scenario.radio))


def _end(status: int) -> None:
    if status:
        raise typer.Exit(status)
