"""The commands that make a scenario folder; each imports what it needs itself."""
# ruff: noqa: PLC0415 - nobody waits for what another command needs

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from kankaku.commands.shared_options import end_with

NewFolder: TypeAlias = Annotated[
    Path,
    typer.Argument(metavar="DIR", show_default=False, help="Folder to write; made if missing."),
]
Force: TypeAlias = Annotated[
    bool, typer.Option("--force", help="Replace files that are there already.")
]


def import_(  # noqa: PLR0913, PLR0917 - one argument per option of the command line
    format_: Annotated[
        str, typer.Argument(metavar="FORMAT", show_default=False, help="Of the source, e.g. gtfs.")
    ],
    source: Annotated[
        Path, typer.Argument(metavar="SOURCE", show_default=False, help="File or folder.")
    ],
    folder: NewFolder,
    route: Annotated[str, typer.Option(help="Which line of the source.")] = "",
    day: Annotated[str, typer.Option(metavar="YYYYMMDD", help="Which day.")] = "",
    begin: Annotated[
        str, typer.Option("--from", metavar="HH:MM:SS", help="Trains that begin from then on.")
    ] = "",
    end: Annotated[
        str, typer.Option("--until", metavar="HH:MM:SS", help="Trains that begin until then.")
    ] = "",
    train: Annotated[str, typer.Option(help="A train of the library.")] = "",
    stock: Annotated[
        Path | None, typer.Option(help="File of a train in the format of the source.")
    ] = None,
    headway: Annotated[
        float | None,
        typer.Option(min=10.0, max=86400.0, help="Seconds between trains without a timetable."),
    ] = None,
    trains: Annotated[
        int | None, typer.Option(min=1, max=1000, help="How many trains without a timetable.")
    ] = None,
    single_track: Annotated[
        bool | None,
        typer.Option(
            "--single-track/--double-track", show_default=False, help="If the source does not say."
        ),
    ] = None,
    force: Force = False,
) -> None:
    """Make a scenario of a file in another format, and tell what was assumed."""
    from kankaku.commands.import_shown import import_source
    from kankaku.scenarios.importing.formats import Wish

    wish = Wish(route, day, begin, end, train, stock, headway, trains, single_track)
    end_with(import_source(format_, source, folder, wish, force=force))


def dwells(  # noqa: PLR0917 - one argument per option of the command line
    events: Annotated[
        Path,
        typer.Argument(
            metavar="EVENTS",
            show_default=False,
            help="Observed arrivals and departures as CSV, or GTFS-realtime vehicle positions.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="Folder to write; made if missing.", show_default="nothing is written"),
    ] = None,
    scenario: Annotated[
        Path | None, typer.Option(help="Scenario folder whose dwells these become.")
    ] = None,
    line: Annotated[str, typer.Option(help="Which line of the events.")] = "",
    timezone: Annotated[
        str, typer.Option(metavar="ZONE", help="Of the line, e.g. Europe/Berlin.")
    ] = "",
    longest: Annotated[
        float,
        typer.Option(min=30.0, max=3600.0, help="What stands longer waits or turns round. [s]"),
    ] = 300.0,
    force: Force = False,
) -> None:
    """Work out dwell times and delays of observed trains, for a scenario to draw from."""
    from kankaku.commands.dwells_shown import work_out_dwells

    end_with(work_out_dwells(events, out, scenario, line, timezone, longest, force=force))


def describe(
    asked: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[FILE [KEY]]",
            show_default=False,
            help="A file, and a column or key of it: scenario.toml radio.cycle_s.",
        ),
    ] = None,
    json_schema: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Write JSON Schema of all files for editors; replaces older ones."
        ),
    ] = None,
) -> None:
    """Tell what the files of a scenario hold: every column and key, its unit and its range."""
    from kankaku.commands.describe_shown import describe_files, write_schemas

    if json_schema is not None:
        end_with(write_schemas(json_schema))
        return
    end_with(describe_files(" ".join(asked or ())))


def add_commands(app: typer.Typer) -> None:
    """
    Add these commands to a command line.

    Parameters
    ----------
    app
        The command line.
    """
    app.command("import")(import_)
    app.command("dwells")(dwells)
    app.command("describe")(describe)
