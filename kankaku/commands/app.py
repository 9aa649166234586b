"""
The command line: ``kankaku run rush_hour``, or ``python run.py scenarios/rush_hour``.

What is imported here is read before any command; each command imports what it needs itself.
"""

from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import typer
from typer.core import TyperGroup

from kankaku import interrupts
from kankaku.asking import (
    CAMPAIGN_PROTECTION,
    CAMPAIGN_RUNS,
    MOST_SEEDS,
    MOST_YEARS,
    SEED_MAX,
    STUDY_SEEDS,
    YEARS,
    Check,
)
from kankaku.commands import (
    controller_commands,
    live_commands,
    planning_commands,
    results_commands,
    scenario_commands,
    study_options,
)
from kankaku.commands.shared_options import (
    OUT,
    PROCESSORS,
    Engine,
    Format,
    Formats,
    Formatted,
    Fresh,
    Jobs,
    MayBeNamed,
    Named,
    Names,
    Opened,
    Out,
    Seed,
    Settings,
    Several,
    Step,
    Version,
    end_with,
)
from kankaku.railway import first_use
from kankaku.railway.plan.design_names import INDEPENDENT
from kankaku.railway.step.engine_ways import EVERY_STEP

RUN = "run"
"""The command that need not be named."""
NEARLY = 0.75
"""How alike a word and a command are for it to be a slip, as ``difflib`` counts. [-]"""


FirstSeed: TypeAlias = Annotated[
    int | None, typer.Option(min=0, max=SEED_MAX, help="Seed of the dwell delays.")
]
Seeds: TypeAlias = Annotated[
    int, typer.Option(min=1, max=MOST_SEEDS, help="Run this many seeds, counting up.")
]


class Commands(TyperGroup):
    """Takes a first argument that names no command for the scenario to run."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - private type
        """Name the command where the user did not."""
        named = args and (args[0] in self.commands or args[0] == "--help")
        named = named or (args and self._is_misspelt(args[0]))
        return super().parse_args(ctx, args if named else [RUN, *args])

    def _is_misspelt(self, word: str) -> bool:
        """Return whether a word is nearly a command, and nothing that could be run."""
        shown = [name for name, command in self.commands.items() if not command.hidden]
        if not get_close_matches(word, shown, n=1, cutoff=NEARLY) or Path(word).exists():
            return False
        from kankaku.scenarios.shipped import shipped_scenarios

        return word not in shipped_scenarios()

    def invoke(self, ctx: Any) -> Any:  # noqa: ANN401 - private type
        """Run the command; whoever interrupts it, at any moment, reads one sentence."""
        interrupts.under_way()
        first_use.hear(first_use.say_on_stderr)
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            typer.echo("Interrupted: what was finished is kept.", err=True)
            raise typer.Exit(interrupts.EXIT_INTERRUPTED) from None
        finally:
            interrupts.over()


app = typer.Typer(
    cls=Commands,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Which way of train control keeps a delay from spreading? A first argument that is no "
    "command is a scenario to run.",
)


@app.command("compare", hidden=True)
@app.command(RUN)
def run(  # noqa: PLR0913, PLR0917 - one argument per option of the command line
    scenario: MayBeNamed = None,
    controller: Names = None,
    settings: Settings = None,
    seed: FirstSeed = None,
    seeds: Seeds = 1,
    step: Step = None,
    jobs: Jobs = PROCESSORS,
    out: Out = OUT,
    fresh: Fresh = False,
    engine: Engine = EVERY_STEP,
    image: Formats = None,
    form: Formatted = Format.TABLE,
    gui: Annotated[bool, typer.Option("--gui", help="Show the runs in sumo-gui.")] = False,
    opened: Opened = None,
    list_controllers: Annotated[
        bool,
        typer.Option(
            "--list-controllers",
            help="Show the controllers of the scenario; without one, all that there are.",
        ),
    ] = False,
    version: Version = False,  # noqa: ARG001 - handled by its callback
) -> None:
    """Run the controllers of a scenario on the same trains and delays, and compare them."""
    if list_controllers:
        from kankaku.commands import controllers_shown

        controllers_shown.list_controllers(scenario)
        return
    from kankaku.commands import run_shown

    choices = {
        "names": controller or (),
        "settings": settings or (),
        "seed": seed,
        "seeds": seeds,
        "step_s": step,
        "jobs": jobs,
        "gui": gui,
        "fresh": fresh,
        "engine": engine,
        "formats": image or (),
    }
    end_with(run_shown.compare(scenario, out, choices, form, opened))


@app.command("across")
def across(  # noqa: PLR0913, PLR0917 - one argument per option of the command line
    scenarios: Several,
    controller: Names = None,
    settings: Settings = None,
    seed: FirstSeed = None,
    seeds: Seeds = 1,
    step: Step = None,
    jobs: Jobs = PROCESSORS,
    out: Out = OUT,
    fresh: Fresh = False,
    engine: Engine = EVERY_STEP,
    image: Formats = None,
    opened: Opened = None,
) -> None:
    """Run the same controllers in several scenarios, and compare them in one table."""
    from kankaku.commands.across_shown import compare_across
    from kankaku.commands.page_shown import open_page
    from kankaku.studies.across_study import FOLDER

    choices = {
        "names": controller or (),
        "settings": settings or (),
        "seed": seed,
        "seeds": seeds,
        "step_s": step,
        "jobs": jobs,
        "fresh": fresh,
        "engine": engine,
        "formats": image or (),
    }
    status = compare_across(scenarios, out, choices)
    open_page(out / FOLDER, wanted=opened)
    end_with(status)


@app.command("study")
def study(  # noqa: PLR0913, PLR0917 - one argument per option of the command line
    scenarios: Several,
    controllers: study_options.Controllers = None,
    settings: Settings = None,
    seed: FirstSeed = None,
    seeds: Seeds = STUDY_SEEDS,
    step: Step = None,
    jobs: Jobs = PROCESSORS,
    out: study_options.StudyOut = study_options.STUDY_OUT,
    shard: study_options.ShardOf = None,
    until: study_options.Until = None,
    scheduler: study_options.Scheduler = None,
    engine: study_options.EngineOrNot = None,
    draws: study_options.Draws = INDEPENDENT,
    trajectories: study_options.Trajectories = False,
    indicator: study_options.Drawn = None,
    image: study_options.Images = None,
    fresh: Fresh = False,
    opened: Opened = None,
) -> None:
    """Run controllers on very many seeds, for means, intervals and distributions."""
    from kankaku.commands import ensemble_shown
    from kankaku.commands.page_shown import open_page

    choices = {
        "names": [name for part in controllers or () for name in part.split(",") if name],
        "settings": settings or (),
        "seed": seed,
        "seeds": seeds,
        "step_s": step,
        "jobs": jobs,
        "fresh": fresh,
    }
    wanted = {
        "engine": engine,
        "shard": shard,
        "until": until,
        "draws": draws,
        "trajectories": trajectories,
    }
    drawing = (indicator or (), image or ())
    status = ensemble_shown.run_many(scenarios, out, choices, wanted, scheduler, drawing)
    open_page(out, wanted=opened)
    end_with(status)


@app.command("merge")
def merge(
    out: study_options.Whole,
    parts: study_options.Parts = None,
    indicator: study_options.Drawn = None,
    image: study_options.Images = None,
) -> None:
    """Put parts of a study together that were run with --shard."""
    from kankaku.commands import ensemble_shown

    end_with(ensemble_shown.put_together(out, parts or (), (indicator or (), image or ())))


@app.command("report")
def report(
    results: Annotated[
        list[Path],
        typer.Argument(
            metavar="RESULTS...",
            show_default=False,
            help="Results folders of run, across or study; those of one line are compared.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="File of the page.", show_default="report.html in or beside RESULTS"),
    ] = None,
    opened: Opened = None,
) -> None:
    """Make the page of saved results, also old and partial ones, or of several to compare."""
    from kankaku.commands.page_shown import make_page

    end_with(make_page(results, out, wanted=opened))


@app.command("capacity")
def capacity(  # noqa: PLR0917 - one argument per option of the command line
    scenario: Named,
    controller: Names = None,
    settings: Settings = None,
    simulate: Annotated[
        Check,
        typer.Option(help="Which headways two simulated trains check: those of the line, or all."),
    ] = Check.CRITICAL,
    step: Step = None,
    jobs: Jobs = PROCESSORS,
    out: Out = OUT,
) -> None:
    """Tell how close trains can follow each other under the controllers of a scenario."""
    from kankaku.commands.capacity_shown import assess

    choices = {
        "names": controller or (),
        "settings": settings or (),
        "step_s": step,
        "jobs": jobs,
        "everything": True,
    }
    end_with(assess(scenario, out, choices, simulate))


@app.command("faults", hidden=True)
@app.command("campaign")
def campaign(  # noqa: PLR0913, PLR0917 - one argument per option of the command line
    scenario: Named,
    controller: Annotated[
        str, typer.Option(help="Controller with the protection control_map.")
    ] = CAMPAIGN_PROTECTION,
    settings: Settings = None,
    runs: Annotated[int, typer.Option(min=1, help="Runs, with one failure each.")] = CAMPAIGN_RUNS,
    seed: Seed = None,
    step: Step = None,
    jobs: Jobs = PROCESSORS,
    out: Out = OUT,
    fresh: Fresh = False,
) -> None:
    """Let trains, equipment and the centre of a control map fail, one thing in each run."""
    from kankaku.commands.campaign_shown import let_fail

    choices = {
        "names": (controller,),
        "settings": settings or (),
        "seed": seed,
        "step_s": step,
        "jobs": jobs,
        "fresh": fresh,
    }
    end_with(let_fail(scenario, out, choices, runs))


@app.command("radio")
def radio(
    scenario: Named,
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
    from kankaku.commands.radio_shown import tell_load

    end_with(tell_load(scenario, out, {"seed": seed, "jobs": jobs}, results, controller))


@app.command("availability")
def availability(
    scenario: Named,
    years: Annotated[
        int, typer.Option(min=2, max=MOST_YEARS, help="Years of failures to simulate.")
    ] = YEARS,
    seed: Seed = None,
    out: Out = OUT,
) -> None:
    """Tell how often devices stop the line, and what would have to fail for an accident."""
    from kankaku.commands.availability_shown import tell_availability

    end_with(tell_availability(scenario, out, seed, years))


controller_commands.add_commands(app)
results_commands.add_commands(app)
scenario_commands.add_commands(app)
planning_commands.add_commands(app)
live_commands.add_commands(app)
