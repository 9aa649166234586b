"""What the command ``serve`` shows: where a peer may come to, and what became of the run."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kankaku.analysis.tables.run_tables import run_tables, write_run
from kankaku.commands.screen import EXIT_FAILED, EXIT_VIOLATION, answers, complain
from kankaku.live.peer_server import Offer, PeerServer, ServeError
from kankaku.live.simulation import Simulation
from kankaku.railway.errors import KankakuError


def serve_run(
    scenario: Path, controller: str, choices: Mapping[str, Any], offer: Offer, out: Path | None
) -> int:
    """
    Serve a run to one peer, and tell what became of it.

    Parameters
    ----------
    scenario
        Folder of a scenario, or the name of a shipped one.
    controller
        What advice goes on top of.
    choices
        As :class:`~kankaku.live.simulation.Simulation` takes them.
    offer
        Where a peer may come to.
    out
        Where tables are written; None for nowhere.

    Returns
    -------
    int
        How the command ends: 1 if the run ended before its end, 3 if it was not safe.
    """
    try:
        if out is not None and out.exists() and (not out.is_dir() or any(out.iterdir())):
            where, problem = "--out", f"{out} is there already"
            raise ServeError(where, problem, "a new or empty folder")
        simulation = Simulation(scenario, controller, **choices)
        with simulation, PeerServer(offer) as server:
            answers.print(f"Waiting for a peer at {offer.host}:{server.port}", soft_wrap=True)
            why = server.serve(simulation, _tell)
            record = simulation.record()
    except KankakuError as error:
        complain(f"{scenario} cannot be served", error.sentences)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        write_run(run_tables(record), out)
        answers.print(f"Tables are in {out}", soft_wrap=True)
    count = len(record.violations)
    ended = f"The run ended before its end: {why}" if why else "The run went to its end"
    answers.print(f"{ended}; {count} violations of safety", soft_wrap=True, markup=False)
    if count:
        return EXIT_VIOLATION
    return EXIT_FAILED if why else 0


def _tell(sentence: str) -> None:
    answers.print(sentence, soft_wrap=True, markup=False, highlight=False)
