"""The options that several commands share."""

import os
import platform
from enum import StrEnum
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from kankaku.asking import SEED_MAX, STEP_RANGE_S

PROCESSORS = os.cpu_count() or 1
OUT = Path("out")


def _whole_milliseconds(step_s: float | None) -> float | None:
    # SUMO counts whole milliseconds; with any other step the two clocks drift apart.
    if step_s is not None and abs(1000.0 * step_s - round(1000.0 * step_s)) > 1e-9:
        msg = f"{step_s:g} s is not a whole number of milliseconds; allowed: 0.01, 0.125, 0.5, ..."
        raise typer.BadParameter(msg)
    return step_s


_SCENARIO = typer.Argument(
    metavar="SCENARIO",
    show_default=False,
    help="Scenario folder, or the name of a shipped one, e.g. rush_hour.",
)
Named: TypeAlias = Annotated[Path, _SCENARIO]
MayBeNamed: TypeAlias = Annotated[Path | None, _SCENARIO]
Several: TypeAlias = Annotated[
    list[Path],
    typer.Argument(
        metavar="SCENARIO...",
        show_default=False,
        help="Scenario folders, or names of shipped ones; two of one name are refused.",
    ),
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
ENGINE_HELP = (
    "every_step: SUMO moves the trains, told in every step; witness: SUMO looks at places and "
    "collisions once a second, which is faster."
)
Engine: TypeAlias = Annotated[
    str,
    typer.Option(help=ENGINE_HELP),
]
Formats: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--figures",
        help="Format of figures, or none; repeat for several.",
        show_default="png and svg",
    ),
]
Seed: TypeAlias = Annotated[
    int | None, typer.Option(min=0, max=SEED_MAX, help="Seed; the scenario's own if not given.")
]
Out: TypeAlias = Annotated[Path, typer.Option(help="Where results go.")]
Opened: TypeAlias = Annotated[
    bool | None,
    typer.Option(
        "--open/--no-open",
        help="Open the page of the results, report.html.",
        show_default="where there is a desktop",
    ),
]
Fresh: TypeAlias = Annotated[
    bool, typer.Option("--fresh", help="Start anew instead of continuing earlier runs.")
]


class Format(StrEnum):
    """How a command writes its tables."""

    TABLE = "table"
    CSV = "csv"
    JSON = "json"


Formatted: TypeAlias = Annotated[
    Format, typer.Option("--format", help="Tables for people, or for other programs.")
]


def versions() -> str:
    """
    Return what runs here.

    Returns
    -------
    str
        Versions of this program, SUMO and Python.
    """
    python = platform.python_version()
    return f"kankaku {version('kankaku')}, SUMO {version('eclipse-sumo')}, Python {python}"


def _show_versions(value: bool) -> None:
    if value:
        typer.echo(versions())
        raise typer.Exit


Version: TypeAlias = Annotated[
    bool,
    typer.Option("--version", callback=_show_versions, is_eager=True, help="Show what runs here."),
]


def end_with(status: int) -> None:
    """
    End a command.

    Parameters
    ----------
    status
        What the process is to end with; with 0 it goes on.

    Raises
    ------
    typer.Exit
        With any other one.
    """
    if status:
        raise typer.Exit(status)
