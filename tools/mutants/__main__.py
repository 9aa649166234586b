"""
Every mutant runs, and must be seen: ``make mutants``.

Each one is a text patch of a copy of the source, run on ``scenarios/binding``, or on
``scenarios/binding_network``, in a process of its own. A patch whose old text is gone is an error.
What nobody sees in a run, neither monitor nor SUMO, is a hole in the monitor; so is a sound run
that anybody accuses of anything.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

from tools.mutants.catalogue import MUTANTS, Mutant, Patch

PROJECT = Path(__file__).parents[2]
SCENARIOS = "scenarios"
ROOMS = (
    "analysis",
    "controllers",
    "railway",
    "scenarios",
    "sumo_net",
    "telecom",
    "tools",
    "kankaku",
)
TIMEOUT_S = 600.0


class PatchError(ValueError):
    """The old text of a patch is not there exactly once."""


class Verdict(NamedTuple):
    """What was seen of a mutant."""

    mutant: Mutant
    by: str
    """Kind of the first violation, or what ended the run; empty if nobody saw anything."""
    time_s: float | None
    """When, after the first train stood ready. [s]"""
    message: str


def patched(text: str, patch: Patch) -> str:
    """
    Return a text with the old part replaced.

    Parameters
    ----------
    text
        The text of the file.
    patch
        The patch.

    Returns
    -------
    str
        The new text.

    Raises
    ------
    PatchError
        If the old part is not there exactly once.
    """
    found = text.count(patch.old)
    if found != 1:
        msg = f"{patch.file}: found {found} times, not once: {patch.old!r}"
        raise PatchError(msg)
    return text.replace(patch.old, patch.new)


def copy_source(target: Path) -> None:
    """
    Copy the source, what is compiled of it included.

    Parameters
    ----------
    target
        Where to.
    """
    for room in ROOMS:
        # The links of kankaku/ lead to the copies.
        shutil.copytree(PROJECT / room, target / room, symlinks=True)
    for file in PROJECT.glob("*.py"):
        shutil.copy2(file, target)


def apply(mutant: Mutant, source: Path) -> None:
    """
    Put a mutant into a copy of the source.

    Parameters
    ----------
    mutant
        The mutant.
    source
        Where the copy is.
    """
    for patch in mutant.patches:
        file = source / patch.file
        file.write_text(patched(file.read_text(encoding="utf-8"), patch), encoding="utf-8")


def tried(mutant: Mutant) -> Verdict:
    """
    Run a mutant until it is seen under one of its controllers.

    Parameters
    ----------
    mutant
        The mutant.

    Returns
    -------
    Verdict
        What was seen first.
    """
    with tempfile.TemporaryDirectory(prefix="kankaku-mutant-") as place:
        source = Path(place)
        copy_source(source)
        apply(mutant, source)
        for controller in mutant.controllers:
            for seen in _run(source, mutant.scenario, controller):
                return Verdict(mutant, seen["by"], seen["time_s"], seen["message"])
    return Verdict(mutant, "", None, "")


def _run(source: Path, scenario: str, controller: str) -> list[dict[str, Any]]:
    command = [sys.executable, "-m", "tools.mutants.trial", f"{SCENARIOS}/{scenario}", controller]
    environment = {**os.environ, "PYTHONPATH": str(source)}
    try:
        ended = subprocess.run(  # noqa: S603 - our own interpreter and module
            command,
            cwd=source,
            env=environment,
            capture_output=True,
            text=True,
            timeout=TIMEOUT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        # Nobody has seen anything yet.
        return []
    if ended.returncode:
        # SUMO may take the whole process with it.
        last = (ended.stderr.strip().splitlines() or ["no message"])[-1]
        return [{"by": f"exit {ended.returncode}", "time_s": None, "message": last}]
    found: list[dict[str, Any]] = json.loads(ended.stdout.splitlines()[-1])
    return found


def _row(verdict: Verdict) -> str:
    when = "" if verdict.time_s is None else f"{verdict.time_s:.1f} s"
    seen = verdict.by or "NOT SEEN"
    return f"{verdict.mutant.name:55} {seen:12} {when:>8}  {verdict.message}\n"


def main(arguments: Sequence[str] | None = None) -> int:
    """
    Run all mutants, or those with a word in their names, and print what was seen.

    Parameters
    ----------
    arguments
        Of the command line.

    Returns
    -------
    int
        1 if anything was not seen, or seen where nothing is.
    """
    parser = argparse.ArgumentParser(prog="python -m tools.mutants", description=__doc__)
    parser.add_argument("--only", default="", help="parts of names, with commas between them")
    parser.add_argument("--jobs", type=int, default=2, help="how many at the same time")
    chosen = parser.parse_args(arguments)
    parts = chosen.only.split(",")
    mutants = [mutant for mutant in MUTANTS if any(part in mutant.name for part in parts)]
    sound = [
        Mutant(f"none, {name} on {scenario}", (name,), (), scenario)
        for scenario, name in dict.fromkeys(
            (mutant.scenario, name) for mutant in mutants for name in mutant.controllers
        )
    ]
    started = time.perf_counter()
    write = sys.stdout.write
    with ThreadPoolExecutor(chosen.jobs) as pool:
        accused = [v for v in pool.map(tried, sound) if v.by]
        verdicts = []
        for verdict in pool.map(tried, mutants):
            verdicts.append(verdict)
            write(_row(verdict))
            sys.stdout.flush()
    unseen = [verdict for verdict in verdicts if not verdict.by]
    for verdict in accused:
        write(f"accused without a mutant: {_row(verdict)}")
    write(f"{len(mutants) - len(unseen)} of {len(mutants)} mutants seen in a run, ")
    write(f"{len(sound) - len(accused)} of {len(sound)} sound runs without a violation, ")
    write(f"{time.perf_counter() - started:.0f} s\n")
    return 1 if unseen or accused else 0


if __name__ == "__main__":
    sys.exit(main())
