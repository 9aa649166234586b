"""
Which assumption decides what two-stage deceleration brings: ``make sensitivity``.

Moves the ten most doubtful assumptions of the rush hour through their ranges by the design of
Morris, runs ``close_up`` and ``two_stage`` at every point with the same seeds, and writes
``out/sensitivity/``. What was run before and depends on nothing that has changed is not run again.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from kankaku.analysis.figures.sensitivity_diagram import Moved, sensitivity_figure
from kankaku.analysis.figures.style import write_figure
from kankaku.analysis.tables.columns import write_whole
from kankaku.railway.arrays import FloatArray
from kankaku.workers import performed
from tools.sensitivity import texts
from tools.sensitivity.assumptions import ASSUMPTIONS
from tools.sensitivity.conclusion import BASE_STOPS, CHANGES, conclusions
from tools.sensitivity.design import effects, seed_noise, trajectories
from tools.sensitivity.journal import Journal
from tools.sensitivity.points import Task, centre, keys, perform

OUT = Path(__file__).parents[2] / "out" / "sensitivity"
NAMES = tuple(one.key for one in ASSUMPTIONS)
DESIGN_SEED = 1
RUNS_FILE = "runs.jsonl"


class Plan(NamedTuple):
    """What is to be run."""

    places: FloatArray
    """Points of the design. shape (n_points, n_assumptions)"""
    seeds: tuple[int, ...]
    """Seeds of every point."""
    other_seeds: tuple[tuple[int, ...], ...]
    """Seeds of every repeat of the centre."""

    @property
    def points(self) -> list[list[Task]]:
        """The tasks of every point of the design."""
        return [_tasks(places, self.seeds) for places in self.places.tolist()]

    @property
    def repeats(self) -> list[list[Task]]:
        """The tasks of the centre, with the seeds of the design first."""
        return [_tasks((), seeds) for seeds in (self.seeds, *self.other_seeds)]


def _tasks(places: Sequence[float], seeds: Sequence[int]) -> list[Task]:
    return [Task(tuple(places), seed) for seed in seeds]


def plan(trajectory_count: int, seed_count: int, repeat_count: int) -> Plan:
    """
    Return what is to be run.

    Parameters
    ----------
    trajectory_count
        Trajectories of the design. [-]
    seed_count
        Seeds of each point. [-]
    repeat_count
        How often the centre is run again with as many other seeds. [-]

    Returns
    -------
    Plan
        The design and the seeds, which no two repeats share.
    """
    first = centre().seed
    groups = [
        tuple(range(first + group * seed_count, first + (group + 1) * seed_count))
        for group in range(repeat_count + 1)
    ]
    places = trajectories(NAMES, trajectory_count, DESIGN_SEED)
    return Plan(places, groups[0], tuple(groups[1:]))


class Findings(NamedTuple):
    """What the runs say, as :func:`tools.sensitivity.conclusion.conclusions` tells it."""

    points: pd.DataFrame
    """Of the points of the design."""
    without_a_seed: list[pd.DataFrame]
    """The same without the first seed, without the second, and so on."""
    repeats: pd.DataFrame
    """Of the centre, the seeds of the design first."""


def run(planned: Plan, jobs: int, out: Path) -> Findings:
    """
    Run what the journal does not know yet.

    Parameters
    ----------
    planned
        The plan.
    jobs
        Processes to use.
    out
        Folder of the journal.

    Returns
    -------
    Findings
        What all runs say, those of the journal included.
    """
    journal = Journal(out / RUNS_FILE)
    tasks = [task for own in (*planned.repeats, *planned.points) for task in own]
    key_of = keys(tasks)
    left = [task for task in dict.fromkeys(tasks) if key_of[task] not in journal]
    sys.stderr.write(f"{len(left)} of {len(key_of)} pairs of runs to do\n")
    for number, done in enumerate(performed(perform, left, jobs), start=1):
        journal.note(key_of[done.task], done.value())
        if number % 10 == 0:
            sys.stderr.write(f"{number} of {len(left)} done\n")
    points, repeats = (
        [[journal[key_of[task]] for task in own] for own in groups]
        for groups in (planned.points, planned.repeats)
    )
    without_a_seed = [
        conclusions([[*runs[:seed], *runs[seed + 1 :]] for runs in points])
        for seed in range(len(planned.seeds))
    ]
    return Findings(conclusions(points), without_a_seed, conclusions(repeats))


def effects_by_change(planned: Plan, findings: Findings) -> dict[str, pd.DataFrame]:
    """
    Return what each assumption does to each number of the conclusion.

    Parameters
    ----------
    planned
        What was run.
    findings
        What it says.

    Returns
    -------
    dict[str, pd.DataFrame]
        By key of the change: the effects, with ``noise``.
    """
    told = {}
    for change in CHANGES:
        results = findings.points[change.key].to_numpy()
        less = np.array([own[change.key].to_numpy() for own in findings.without_a_seed])
        noise = seed_noise(NAMES, planned.places, less)
        told[change.key] = effects(NAMES, planned.places, results, DESIGN_SEED).assign(noise=noise)
    return told


def write(planned: Plan, findings: Findings, out: Path) -> str:
    """
    Write tables and figure.

    Parameters
    ----------
    planned
        What was run.
    findings
        What it says.
    out
        Folder for the files.

    Returns
    -------
    str
        What a terminal shows.
    """
    told = effects_by_change(planned, findings)
    points, repeats = findings.points, findings.repeats
    centre_row = {str(name): float(value) for name, value in repeats.iloc[0].items()}
    moved = [
        Moved(
            f"{one.title} [{one.unit}]",
            told[one.key],
            points[one.key].tolist(),
            repeats[one.key].tolist()[1:],
            centre_row[one.key],
        )
        for one in CHANGES
    ]
    titles = {one.key: one.title for one in ASSUMPTIONS}
    write_figure(sensitivity_figure(moved, titles), out / "sensitivity")
    values = {
        one.key: one.low + planned.places[:, column] * (one.high - one.low)
        for column, one in enumerate(ASSUMPTIONS)
    }
    _write_csv(pd.concat([pd.DataFrame(values), points], axis=1), out / "points.csv")
    _write_csv(repeats, out / "repeats.csv")
    by_change = [own.assign(change=key) for key, own in told.items()]
    _write_csv(pd.concat(by_change), out / "effects.csv")
    rows = texts.ranges(points, repeats.iloc[1:], centre_row)
    count = len(planned.places) // (len(NAMES) + 1)
    size = (
        f"{count} trajectories, {len(planned.places)} points, {len(planned.seeds)} seeds each, "
        f"{len(repeats) - 1} repeats of the centre.\n"
        f"Stop time under close_up: {points[BASE_STOPS].min():.0f} to "
        f"{points[BASE_STOPS].max():.0f} s; harmed runs: {int(points['harmed'].sum())}."
    )
    tables = {
        "assumptions": texts.assumptions_table(centre()),
        "effects": texts.effects_table(told),
        "conclusion": texts.ranges_table(rows) + "\n\n" + size,
    }
    for name, table in tables.items():
        write_whole(out / f"{name}.md", table + "\n")
    return "\n\n".join((texts.plain_effects(told), texts.plain_ranges(rows), size)) + "\n"


def _write_csv(table: pd.DataFrame, file: Path) -> None:
    write_whole(file, table.round(6).to_csv(index=False, lineterminator="\n"))


def main(arguments: Sequence[str] | None = None) -> int:
    """
    Run the study as the command line says.

    Parameters
    ----------
    arguments
        Those of the command line; of this process if None.

    Returns
    -------
    int
        Exit status.
    """
    parser = argparse.ArgumentParser(prog="python -m tools.sensitivity", description=__doc__)
    parser.add_argument("--trajectories", type=int, default=10, help="two or more")
    parser.add_argument("--seeds", type=int, default=3, help="of each point, two or more")
    parser.add_argument("--repeats", type=int, default=8, help="of the centre")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--out", type=Path, default=OUT, help="results folder")
    options = parser.parse_args(arguments)
    for name, least in (("trajectories", 2), ("seeds", 2), ("repeats", 1), ("jobs", 1)):
        if getattr(options, name) < least:
            parser.error(f"--{name} is {getattr(options, name)}; allowed: {least} or more")
    options.out.mkdir(parents=True, exist_ok=True)
    planned = plan(options.trajectories, options.seeds, options.repeats)
    findings = run(planned, options.jobs, options.out)
    sys.stdout.write(write(planned, findings, options.out))
    return 0


if __name__ == "__main__":
    sys.exit(main())
