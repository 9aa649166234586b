"""The commands for who brings a controller; each imports what it needs itself."""
# ruff: noqa: PLC0415 - nobody waits for what another command needs

from pathlib import Path
from typing import Annotated

import typer

from kankaku.commands.shared_options import OUT, PROCESSORS, Jobs, end_with

BENCHMARK_OUT = OUT / "benchmark"
REPEATED = 10
"""Runs that are repeated unless something else is said. [-]"""
BENCHMARK_SEEDS = 5


def check_controller(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            show_default=False,
            help="A protection, an operation, or protection+operation; those of own packages, too.",
        ),
    ],
) -> None:
    """Tell whether a controller keeps the contract, and where it does not."""
    from kankaku.commands.check_shown import judge

    end_with(judge(name))


def new_controller(
    folder: Annotated[
        Path,
        typer.Argument(metavar="DIR", show_default=False, help="Folder to write; made if missing."),
    ],
    name: Annotated[
        str, typer.Option(help="Of the operation.", show_default="that of the folder")
    ] = "",
    force: Annotated[
        bool, typer.Option("--force", help="Replace files that are there already.")
    ] = False,
) -> None:
    """Make a package with an operation of your own, its test and its README."""
    from kankaku.commands.new_controller_shown import make_package

    end_with(make_package(folder, name, force=force))


def benchmark(  # noqa: PLR0913, PLR0917 - one argument per option of the command line
    controllers: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="CONTROLLER...",
            show_default=False,
            help="Protections, operations or supervisions, or some joined by +; own ones, too.",
        ),
    ] = None,
    suite: Annotated[
        list[str] | None,
        typer.Option(help="Only this suite; repeat for several.", show_default="all"),
    ] = None,
    world: Annotated[
        list[str] | None,
        typer.Option(help="Only this world of delays; repeat.", show_default="all"),
    ] = None,
    seeds: Annotated[
        int, typer.Option(min=1, max=BENCHMARK_SEEDS, help="Only so many of the seeds.")
    ] = BENCHMARK_SEEDS,
    out: Annotated[Path, typer.Option(help="Results folder.")] = BENCHMARK_OUT,
    jobs: Jobs = PROCESSORS,
    verify: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Repeat some runs of a result file, and compare.",
            show_default=False,
        ),
    ] = None,
    sample: Annotated[int, typer.Option(min=1, help="Runs that --verify repeats.")] = REPEATED,
    draw: Annotated[
        int | None,
        typer.Option(min=0, help="What --verify draws them by.", show_default="by chance"),
    ] = None,
) -> None:
    """Score controllers on fixed suites, seeds and delays; or verify a result."""
    from kankaku.commands import benchmark_shown

    if verify is not None:
        end_with(benchmark_shown.verify(verify, sample, draw, jobs))
        return
    end_with(benchmark_shown.measure(controllers or (), suite or (), world or (), seeds, out, jobs))


def add_commands(app: typer.Typer) -> None:
    """
    Add these commands to a command line.

    Parameters
    ----------
    app
        The command line.
    """
    app.command("check-controller")(check_controller)
    app.command("new-controller")(new_controller)
    app.command("benchmark")(benchmark)
