"""What the command ``benchmark`` shows: the gate, the scores, and whether a result is true."""

import secrets
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.table import Table

from kankaku.commands.screen import (
    EXIT_FAILED,
    EXIT_VIOLATION,
    answers,
    complain,
    counted,
    refusals,
)
from kankaku.controllers.choosing import by_layers
from kankaku.interrupts import EXIT_INTERRUPTED
from kankaku.railway.errors import KankakuError, suggesting
from kankaku.studies.benchmark import repeat, run_benchmark
from kankaku.studies.benchmark_file import read_result
from kankaku.studies.benchmark_score import WEIGHTS
from kankaku.studies.benchmark_suites import REFERENCE, SEEDS, SUITES, WORLDS, BenchmarkPlan
from kankaku.studies.outcomes import StudyError
from kankaku.testing.contract import check_controller, failures

WHAT = "The benchmark"
NAME_WIDTH, SHORT = 20, 6
"""Characters of names and of parts in the table of scores: it fits on 80 columns. [-]"""
SHOWN = 3
"""Reasons that are shown of a controller without a score; the file has all."""


def plan_of_options(suites: Sequence[str], worlds: Sequence[str], seeds: int) -> BenchmarkPlan:
    """
    Return what to run.

    Parameters
    ----------
    suites, worlds
        Those that were named; all if empty.
    seeds
        How many, the first ones.

    Returns
    -------
    BenchmarkPlan
        In the order of the benchmark.

    Raises
    ------
    StudyError
        If there is no such suite or world.
    """
    for option, asked, known in (("--suite", suites, SUITES), ("--world", worlds, WORLDS)):
        for name in asked:
            if name not in known:
                allowed = suggesting(name, list(known), ", ".join(known))
                raise StudyError(option, f"there is no {name!r}", allowed)
    return BenchmarkPlan(
        tuple(name for name in SUITES if name in suites or not suites),
        tuple(name for name in WORLDS if name in worlds or not worlds),
        SEEDS[:seeds],
    )


def measure(
    asked: Sequence[str],
    suites: Sequence[str],
    worlds: Sequence[str],
    seeds: int,
    out: Path,
    jobs: int,
) -> int:
    """
    Run the benchmark, and show its scores.

    Parameters
    ----------
    asked
        Names of controllers.
    suites, worlds, seeds
        What to run of it.
    out
        Results folder.
    jobs
        Processes to use.

    Returns
    -------
    int
        How the command ends.
    """
    with refusals(WHAT, out):
        if not asked:
            msg = "CONTROLLER: is missing; allowed: names of layers, or --verify FILE"
            raise StudyError(msg)
        plan = plan_of_options(suites, worlds, seeds)
        named = [by_layers(REFERENCE), *map(by_layers, asked)]
        names = list(dict.fromkeys(spec.name for spec in named))
        contract = _judged(names)
        with counted("runs") as told:
            result = run_benchmark(names, contract, plan, out, jobs, told)
    if result.file is None:
        answers.print("Interrupted: what was finished is kept; the same command goes on.")
        return EXIT_INTERRUPTED
    show_scores(result.told)
    answers.print(f"Result: {escape(str(result.file))}", soft_wrap=True, highlight=False)
    runs = result.told["runs"]
    if any(run["violations"] for run in runs):
        return EXIT_VIOLATION
    refused = any(score["score"] is None for score in result.told["scores"].values())
    return EXIT_FAILED if refused else 0


def _judged(names: Sequence[str]) -> Mapping[str, list[str]]:
    """Ask the contract first: what it does not keep is not worth comparing."""
    contract = {}
    with counted("contract") as told:
        for number, name in enumerate(names, start=1):
            contract[name] = failures(check_controller(name))
            told(number, len(names))
    return contract


def show_scores(told: Mapping[str, Any]) -> None:
    """
    Show the scores of a result file.

    Parameters
    ----------
    told
        What it holds.
    """
    table = Table(box=None, pad_edge=False)
    table.add_column("controller", overflow="fold", min_width=NAME_WIDTH)
    for header in ("score", "95 %", *(part[:SHORT] for part in WEIGHTS)):
        table.add_column(header, no_wrap=True, justify="right")
    for name, score in told["scores"].items():
        if score["score"] is None:
            table.add_row(escape(name), "none", "", *[""] * len(WEIGHTS))
            continue
        between = "" if score["low"] is None else f"{score['low']:.0f} to {score['high']:.0f}"
        parts = [score["parts"].get(part) for part in WEIGHTS]
        shown = ["" if part is None else f"{part:.1f}" for part in parts]
        table.add_row(escape(name), f"{score['score']:.1f}", between, *shown)
    answers.print(table)
    for name, score in told["scores"].items():
        for sentence in score["refused"][:SHOWN]:
            answers.print(f"{name}: {sentence}", soft_wrap=True, markup=False, highlight=False)
        if len(score["refused"]) > SHOWN:
            more = len(score["refused"]) - SHOWN
            answers.print(f"{name}: and {more} more", markup=False, highlight=False)
    if not told["plan"]["whole"]:
        answers.print("Only part of the benchmark: not to be compared with its table.")


def verify(file: Path, size: int, drawn_by: int | None, jobs: int) -> int:
    """
    Tell whether a result file hangs together, and whether its runs can be repeated.

    Parameters
    ----------
    file
        The file.
    size
        How many runs to repeat.
    drawn_by
        Seed of the draw; one that nobody could know if None.
    jobs
        Processes to use.

    Returns
    -------
    int
        How the command ends.
    """
    drawn = secrets.randbelow(2**31) if drawn_by is None else drawn_by
    try:
        told = read_result(file)
        with counted("repeated runs") as shown:
            repeated = repeat(told, size, drawn, jobs, shown)
    except KankakuError as error:
        complain(f"{file} is not verified", error.sentences)
    for sentence in (*repeated.doubts, *repeated.wrong):
        answers.print(sentence, soft_wrap=True, markup=False, highlight=False)
    total = len(told["runs"])
    drawing = f"{repeated.runs} of {total} runs repeated (--draw {drawn})"
    if repeated.wrong:
        answers.print(f"{drawing}: the file does not tell what they give.", soft_wrap=True)
        return EXIT_FAILED
    answers.print(f"{drawing}: all figures are as the file tells them.", soft_wrap=True)
    return 0
