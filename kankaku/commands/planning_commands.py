"""The commands for who plans a line on a sheet of paper; each imports what it needs itself."""
# ruff: noqa: PLC0415 - nobody waits for what another command needs

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from kankaku.commands.shared_options import Named, end_with

Typed: TypeAlias = str
"""Numbers come as texts, so that everything that is wrong with them is told at once."""
NewLine: TypeAlias = Annotated[
    Path,
    typer.Argument(metavar="DIR", show_default=False, help="Folder to write; made if missing."),
]
Existing: TypeAlias = Annotated[
    Path, typer.Argument(metavar="DIR", show_default=False, help="Folder of a scenario.")
]
Headway: TypeAlias = Annotated[
    Typed, typer.Option(metavar="SECONDS", help="Between trains.", show_default="300")
]
Begin: TypeAlias = Annotated[
    Typed, typer.Option("--from", metavar="HH:MM", help="First trains.", show_default="07:00")
]
End: TypeAlias = Annotated[
    Typed, typer.Option("--until", metavar="HH:MM", help="Last trains.", show_default="08:00")
]
Pattern: TypeAlias = Annotated[
    Typed,
    typer.Option(
        metavar="WORKINGS",
        help='Which trains run where, to and fro: "full, City to Zoo"; several take turns.',
        show_default="full",
    ),
]
TurnBack: TypeAlias = Annotated[
    Typed,
    typer.Option(
        metavar="SECONDS", help="Least time from arrival to departure.", show_default="120"
    ),
]
Dwell: TypeAlias = Annotated[
    Typed, typer.Option(metavar="SECONDS", help="Booked stop.", show_default="30")
]
Supplement: TypeAlias = Annotated[
    Typed,
    typer.Option(metavar="PERCENT", help="Booked over least run times.", show_default="5"),
]
Stations: TypeAlias = Annotated[
    str,
    typer.Option(
        metavar="TEXT|CSV",
        help='Names and km: "Airport 0, Park 1.1", or a CSV file of them; else you are asked.',
    ),
]
TerminalTracks: TypeAlias = Annotated[
    Typed,
    typer.Option(metavar="N", help="At most so many at a terminal.", show_default="as needed"),
]
LibraryName: TypeAlias = Annotated[
    str, typer.Option(help="Of the library: kankaku trains.", show_default="metro")
]
Figures: TypeAlias = Annotated[
    str,
    typer.Option(
        metavar="FIGURES",
        help="length_m=120,mass_t=240,speed_kmh=80,acceleration_mps2=1,brake_mps2=1",
    ),
]
Side: TypeAlias = Annotated[
    str, typer.Option(metavar="SIDE", help="left or right.", show_default="left")
]
Title: TypeAlias = Annotated[
    str, typer.Option(help="What results call it.", show_default="the folder's name")
]
Replaces: TypeAlias = Annotated[
    bool, typer.Option("--force", help="Replace files that are there already.")
]


def new(  # noqa: PLR0913, PLR0917 - one argument per option of the command line
    folder: NewLine,
    stations: Stations = "",
    headway: Headway = "",
    begin: Begin = "",
    end: End = "",
    pattern: Pattern = "",
    turn_back: TurnBack = "",
    dwell: Dwell = "",
    supplement: Supplement = "",
    terminal_tracks: TerminalTracks = "",
    train: LibraryName = "",
    train_figures: Figures = "",
    single_track: Annotated[
        bool, typer.Option("--single-track", help="One track, loops where trains meet.")
    ] = False,
    driving: Side = "",
    title: Title = "",
    force: Replaces = False,
) -> None:
    """Make a line of your own from a list of stations; it runs at once."""
    from kankaku.commands.new_shown import make_line
    from kankaku.scenarios.drafts.line_answers import LineAnswers

    said = LineAnswers(
        stations,
        title,
        headway,
        begin,
        end,
        pattern,
        turn_back,
        dwell,
        supplement,
        terminal_tracks,
        train,
        train_figures,
        driving,
        single_track,
    )
    end_with(make_line(folder, said, force=force))


def trains(
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="Tell all of this one.", show_default=False)
    ] = "",
) -> None:
    """List the trains that a new line can begin with."""
    from kankaku.commands.trains_shown import list_trains

    end_with(list_trains(name))


def blocks(
    folder: Existing,
    for_: Annotated[
        str,
        typer.Option(
            "--for", metavar="NAME", help="A controller of the scenario, or any protection."
        ),
    ] = "atc",
    headway: Annotated[
        Typed, typer.Option(metavar="SECONDS", help="Design headway.", show_default="120")
    ] = "120",
    force: Replaces = False,
) -> None:
    """Lay blocks, and track circuits, for a headway; say what each station reaches."""
    from kankaku.commands.blocks_shown import lay_blocks

    end_with(lay_blocks(folder, for_, headway, force=force))


def timetable(  # noqa: PLR0913, PLR0917 - one argument per option of the command line
    folder: Existing,
    headway: Headway = "",
    begin: Begin = "",
    end: End = "",
    pattern: Pattern = "",
    turn_back: TurnBack = "",
    dwell: Annotated[
        Typed,
        typer.Option(
            metavar="SECONDS", help="Booked stop.", show_default="as in dwell_stations.csv"
        ),
    ] = "",
    supplement: Supplement = "",
    train_type: Annotated[
        str, typer.Option(help="Of rolling_stock.toml.", show_default="its first one")
    ] = "",
    seconds: Annotated[
        bool,
        typer.Option("--seconds", help="Calls to the second from public_timetable.csv instead."),
    ] = False,
    force: Replaces = False,
) -> None:
    """Make services.csv and calls.csv anew from a headway, or seconds from whole minutes."""
    from kankaku.commands.timetable_shown import make_timetable, seconds_from_minutes
    from kankaku.scenarios.drafts.new_timetable import TimetableAnswers

    if seconds:
        end_with(seconds_from_minutes(folder, force=force))
        return
    said = TimetableAnswers(headway, begin, end, pattern, turn_back, dwell, supplement, train_type)
    end_with(make_timetable(folder, said, force=force))


def check(
    scenario: Named,
    figure: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw the line into a .png, .svg or .pdf file."),
    ] = None,
) -> None:
    """Tell all mistakes of a scenario, then what is doubtful."""
    from kankaku.commands.doubts_shown import check_scenario

    end_with(check_scenario(scenario, figure))


def add_commands(app: typer.Typer) -> None:
    """
    Add these commands to a command line.

    Parameters
    ----------
    app
        The command line.
    """
    app.command("new")(new)
    app.command("trains")(trains)
    app.command("timetable")(timetable)
    app.command("blocks")(blocks)
    app.command("check")(check)
