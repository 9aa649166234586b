"""The commands that ask a results folder; each imports what it needs itself."""
# ruff: noqa: PLC0415 - nobody waits for what another command needs

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from kankaku.asking import SEED_MAX
from kankaku.commands.shared_options import Format, Formatted, end_with

Folder: TypeAlias = Annotated[
    Path,
    typer.Argument(
        metavar="RESULTS",
        show_default=False,
        help="Results folder, or the name of one in out/, e.g. rush_hour.",
    ),
]
OfSeed: TypeAlias = Annotated[
    int | None,
    typer.Option(min=0, max=SEED_MAX, help="Of which seed.", show_default="the first one"),
]
Of: TypeAlias = Annotated[
    list[str] | None,
    typer.Option("--controller", help="Controller of the results; repeat for several."),
]


def explain(  # noqa: PLR0917 - one argument per option of the command line
    results: Folder,
    train: Annotated[str, typer.Option(help="Train number.")],
    at: Annotated[
        str,
        typer.Option(
            metavar="HH:MM[:SS]",
            help="Time of day; without seconds, when it was slowest in that minute.",
        ),
    ],
    controller: Of = None,
    seed: OfSeed = None,
    figure: Annotated[
        Path | None,
        typer.Option(
            help="Where to draw the moment: .png, .svg or .pdf.",
            show_default="explained/ in the results folder",
        ),
    ] = None,
    form: Formatted = Format.TABLE,
) -> None:
    """Tell why a train was slow: what bound it, who was ahead and why, and what it cost."""
    from kankaku.commands.explain_shown import tell_why

    end_with(tell_why(results, train, at, controller or (), seed, figure, form=form))


def draw(  # noqa: PLR0913, PLR0917 - one argument per option of the command line
    results: Folder,
    figure: Annotated[
        str,
        typer.Option(help="Which: time_distance, zoom, pareto, speed or delays."),
    ] = "time_distance",
    controller: Of = None,
    train: Annotated[
        list[str] | None, typer.Option(help="Train to show; repeat for several.")
    ] = None,
    station: Annotated[
        list[str] | None,
        typer.Option(help="Show the line from the first to the last of these stations."),
    ] = None,
    begin: Annotated[
        str | None, typer.Option("--from", metavar="HH:MM[:SS]", help="Show it from then on.")
    ] = None,
    end: Annotated[
        str | None, typer.Option("--to", metavar="HH:MM[:SS]", help="Show it until then.")
    ] = None,
    seed: OfSeed = None,
    title: Annotated[str, typer.Option(help="Title, in any language.")] = "",
    out: Annotated[
        list[Path] | None,
        typer.Option(
            help="File: .png, .svg or .pdf; repeat for several.",
            show_default="all three in figures/ in the results folder",
        ),
    ] = None,
) -> None:
    """Draw a figure of saved results for chosen controllers, trains, stations and times."""
    from kankaku.commands.draw_shown import draw_figure

    chosen = {
        "controllers": controller or (),
        "trains": train or (),
        "stations": station or (),
    }
    window = (begin, end)
    end_with(draw_figure(results, figure, out or (), chosen, seed, window=window, title=title))


def show(
    results: Folder,
    table: Annotated[
        str,
        typer.Option(
            help="Which: comparison, summary, by_station, by_train, calls, remaining_stops, ..."
        ),
    ] = "comparison",
    controller: Of = None,
    train: Annotated[list[str] | None, typer.Option(help="Train; repeat for several.")] = None,
    seed: OfSeed = None,
    form: Formatted = Format.TABLE,
) -> None:
    """Show the comparison of saved results, or any of their tables."""
    from kankaku.commands.show_shown import show_results

    chosen = {"controllers": controller or (), "trains": train or ()}
    end_with(show_results(results, table, chosen, seed, form))


def export(  # noqa: PLR0913, PLR0917 - one argument per option of the command line
    results: Annotated[
        Path,
        typer.Argument(
            metavar="RESULTS|SCENARIO",
            show_default=False,
            help="Results folder, or the name of one in out/; or a scenario folder, or the name of "
            "a shipped one that has no results there.",
        ),
    ],
    to: Annotated[
        str,
        typer.Option(
            help="railsim: time-distance columns; fcd: for a replay in sumo-gui; gtfs: actual "
            "times; parquet: tidy tables. Of a scenario gtfs: booked times; railjson: line."
        ),
    ],
    controller: Of = None,
    seed: OfSeed = None,
    scenario: Annotated[
        Path | None,
        typer.Option(
            help="Scenario of the results, for coordinates.", show_default="what they name"
        ),
    ] = None,
    timezone: Annotated[str, typer.Option(help="Of the times in GTFS.")] = "Etc/UTC",
    day: Annotated[
        str, typer.Option(metavar="YYYYMMDD", help="Day of the service in GTFS.")
    ] = "20260101",
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for the files.", show_default="exported/ in the folder, or in out/"
        ),
    ] = None,
) -> None:
    """Write saved results, or a scenario, in the format of another program."""
    from kankaku.commands import export_scenario, export_shown
    from kankaku.commands.shipped_names import is_scenario

    asked = export_shown.ExportWish(scenario, timezone, day)
    of_scenarios = to in export_scenario.SCENARIO_FORMATS
    only = of_scenarios and to not in export_shown.FORMATS_OF_OTHERS
    if is_scenario(results, only=only) and (of_scenarios or results.exists()):
        end_with(export_scenario.export_scenario(results, to, out, asked))
    else:
        end_with(export_shown.export(results, to, out, controller or (), seed, asked))


def add_commands(app: typer.Typer) -> None:
    """
    Add the commands to the command line.

    Parameters
    ----------
    app
        The command line.
    """
    for command in (show, explain, draw, export):
        app.command(command.__name__)(command)
