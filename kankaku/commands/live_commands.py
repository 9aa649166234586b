"""The commands for who takes part in runs from outside; each imports what it needs itself."""
# ruff: noqa: PLC0415 - nobody waits for what another command needs

from pathlib import Path
from typing import Annotated

import typer

from kankaku.asking import SEED_MAX
from kankaku.commands.shared_options import Named, Step, end_with

LOOPBACK = "127.0.0.1"


def serve(  # noqa: PLR0913, PLR0917 - one argument per option of the command line
    scenario: Named,
    controller: Annotated[
        str, typer.Option(help="What advice goes on top of; protection+operation.")
    ] = "moving_block+close_up",
    seed: Annotated[
        int | None,
        typer.Option(min=0, max=SEED_MAX, help="Seed.", show_default="the scenario's"),
    ] = None,
    interval: Annotated[float, typer.Option(help="From one decision to the next. [s]")] = 10.0,
    step: Step = None,
    engine: Annotated[
        str, typer.Option(help="witness, every_step, or none for runs without SUMO.")
    ] = "witness",
    host: Annotated[str, typer.Option(help="Any other one takes a token.")] = LOOPBACK,
    port: Annotated[
        int, typer.Option(min=0, max=65_535, help="0 for any that is free; it is told.")
    ] = 0,
    token: Annotated[
        str, typer.Option(help="What a peer has to say first.", envvar="KANKAKU_TOKEN")
    ] = "",
    timeout: Annotated[float, typer.Option(help="For each answer. [s]")] = 5.0,
    wait: Annotated[float, typer.Option(help="For a peer to come. [s]")] = 60.0,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Write the tables of the run; a new or empty folder."),
    ] = None,
) -> None:
    """Let a program in any language take part in a run, by lines of JSON over a local socket."""
    from kankaku.commands.serve_shown import serve_run
    from kankaku.live.peer_server import Offer

    offer = Offer(host, port, token, timeout, wait)
    choices = {"seed": seed, "interval_s": interval, "step_s": step, "engine": engine}
    end_with(serve_run(scenario, controller, choices, offer, out))


def add_commands(app: typer.Typer) -> None:
    """
    Add these commands to a command line.

    Parameters
    ----------
    app
        The command line.
    """
    app.command("serve")(serve)
