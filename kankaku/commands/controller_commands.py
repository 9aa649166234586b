"""The commands for who brings a controller; each imports what it needs itself."""
# ruff: noqa: PLC0415 - nobody waits for what another command needs

from pathlib import Path
from typing import Annotated

import typer

from kankaku.commands.shared_options import end_with


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
