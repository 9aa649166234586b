"""
No kill loses a run: ``make kills``.

Runs a small study again and again and kills the command, or one of its workers, with a signal
at a random moment, the first second included. The same command then goes on. Counted are runs
that were finished and are not any more or are run again, processes and folders that stay, and
studies whose tables are not those of one that nobody disturbed; any of them fails.
"""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer

PROJECT = Path(__file__).parents[1]
SCENARIO = PROJECT / "scenarios" / "control_map"
OPTIONS = ("--controller", "close_up", "--controller", "control_map", "--step", "0.5")
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
SOON_S = 1.0
"""Every other kill of a command comes so early. [s]"""
GRACE_S = 10.0
"""Workers whose parent was killed have so long to notice and to end. [s]"""
PATIENCE_S = 300.0
"""A command that takes longer hangs. [s]"""
NOT_YET = "init_import_site"
"""What Python tells of a signal that comes while it is still beginning."""
NOTES_OF_TIME = frozenset({"run.json", "provenance.json"})


@dataclass
class Figures:
    """What is counted."""

    parents: int = 0
    workers: int = 0
    studies: int = 0
    lost: int = 0
    processes: int = 0
    folders: int = 0
    until_next: int = 0
    """Folders that were left for the next command to remove. [-]"""
    unlike: int = 0
    hung: int = 0
    odd: int = 0
    told: list[str] = field(default_factory=list)

    def complain(self, what: str) -> None:
        """Keep a sentence about what went wrong."""
        self.told.append(what)

    @property
    def is_good(self) -> bool:
        """Nothing was lost, and nothing was left."""
        return not any((self.lost, self.processes, self.folders, self.unlike, self.hung, self.odd))


@dataclass(frozen=True)
class KillPlace:
    """Where the studies of a test go."""

    root: Path
    seeds: int

    @property
    def out(self) -> Path:
        """Where results go."""
        return self.root / "out"

    @property
    def temporary(self) -> Path:
        """The place for temporary files of the system."""
        return self.root / "temporary"

    @property
    def results(self) -> Path:
        """The results folder."""
        return self.out / SCENARIO.name

    @property
    def screen(self) -> Path:
        """What the last command told."""
        return self.root / "screen.txt"

    def clear(self) -> None:
        """Begin anew."""
        for folder in (self.out, self.temporary):
            shutil.rmtree(folder, ignore_errors=True)
        self.temporary.mkdir(parents=True)

    def finished(self) -> dict[str, str]:
        """Return when each finished run was finished."""
        files = [*self.results.glob("*/run.json"), *self.results.glob("*/*/run.json")]
        return {
            file.relative_to(self.results).as_posix(): json.loads(file.read_text("utf-8"))[
                "finished"
            ]
            for file in files
        }

    def tables(self) -> dict[str, bytes]:
        """Return the bytes of all results but notes of time."""
        return {
            file.relative_to(self.results).as_posix(): file.read_bytes()
            for file in sorted(self.results.rglob("*"))
            if file.is_file() and file.name not in NOTES_OF_TIME
        }

    def left_over(self) -> list[Path]:
        """Return what should have been removed."""
        return [*self.temporary.iterdir(), *self.out.rglob(".*")]

    @contextmanager
    def command(self) -> Iterator[subprocess.Popen[str]]:
        """Run the study as a user would, in a process group of its own."""
        arguments = [sys.executable, PROJECT / "run.py", SCENARIO, *OPTIONS]
        arguments += ["--seeds", str(self.seeds), "--jobs", "2", "--out", self.out]
        with self.screen.open("w", encoding="utf-8") as told:
            process = subprocess.Popen(  # noqa: S603
                list(map(str, arguments)),
                env={**os.environ, "TMPDIR": str(self.temporary)},
                stdout=told,
                stderr=subprocess.STDOUT,
                text=True,
                start_new_session=True,
            )
            try:
                yield process
            finally:
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()


def is_gone(group: int) -> bool:
    """Return whether no process of a group is left after a while."""
    until_s = time.monotonic() + GRACE_S
    while time.monotonic() < until_s:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False


def workers_of(parent: int) -> list[int]:
    """Return the processes that a command does its runs in."""
    done = subprocess.run(
        ["ps", "-A", "-o", "pid=,ppid=,command="],  # noqa: S607 - wherever it lies
        capture_output=True,
        text=True,
        check=True,
    )
    rows = [line.split(maxsplit=2) for line in done.stdout.splitlines()]
    return [int(row[0]) for row in rows if int(row[1]) == parent and "spawn_main" in row[2]]


def wait_for_end(process: subprocess.Popen[str], figures: Figures) -> bool:
    """Return whether a command ends in time."""
    try:
        process.wait(PATIENCE_S)
    except subprocess.TimeoutExpired:
        figures.hung += 1
        figures.complain("a command hung")
        return False
    return True


def check_after(
    place: KillPlace,
    group: int,
    before: dict[str, str],
    what: str,
    figures: Figures,
    earlier: Collection[Path] = (),
) -> None:
    """Count what a kill has lost and left; what was there before the command may stay."""
    if not is_gone(group):
        figures.processes += 1
        figures.complain(f"{what}: a process stays")
    after = place.finished()
    lost = [run for run, finished in before.items() if after.get(run) != finished]
    figures.lost += len(lost)
    figures.complain(f"{what}: lost {', '.join(lost)}") if lost else None
    left = [item for item in place.left_over() if item not in earlier]
    if what.startswith("SIGKILL to a command"):
        # Without workers nobody is left to tidy its folder of temporary files up but the next
        # command; in the places of others nothing may stay.
        own = place.results / ".unfinished"
        figures.until_next += own in left
        left = [item for item in left if own not in (item, *item.parents)]
    figures.folders += len(left)
    figures.complain(f"{what}: {', '.join(map(str, left))} stays") if left else None


def kill_parent(place: KillPlace, rng: random.Random, span_s: float, figures: Figures) -> bool:
    """Kill a command, and return whether it had ended before."""
    number = SIGNALS[figures.parents % len(SIGNALS)]
    early = figures.parents % 8 < len(SIGNALS)
    earlier = set(place.left_over())
    with place.command() as process:
        with suppress(subprocess.TimeoutExpired):
            process.wait(rng.uniform(0.0, SOON_S if early else span_s))
        before = place.finished()
        over = process.poll() is not None
        if not over:
            # A terminal tells everybody in it; whoever kills a process tells that one.
            kill = os.killpg if number == signal.SIGINT else os.kill
            kill(process.pid, number)
            figures.parents += 1
        if wait_for_end(process, figures):
            what = f"{number.name} to a command"
            check_after(place, process.pid, before, what, figures, earlier)
        usual = {0} if over else {0, 130, -number}
        told = place.screen.read_text("utf-8")
        # A signal may come before Python has begun to read the program.
        if process.returncode not in usual and NOT_YET not in told:
            figures.odd += 1
            last = told.strip().rpartition("\n")[2]
            figures.complain(f"{number.name} to a command: status {process.returncode}, {last}")
    return over


def kill_worker(place: KillPlace, rng: random.Random, span_s: float, figures: Figures) -> bool:
    """Kill a worker of a command, and return whether the study is whole."""
    number = SIGNALS[figures.workers % len(SIGNALS)]
    with place.command() as process:
        with suppress(subprocess.TimeoutExpired):
            process.wait(rng.uniform(0.0, span_s))
        while process.poll() is None and not (found := workers_of(process.pid)):
            time.sleep(0.01)
        before = place.finished()
        if process.poll() is None:
            with suppress(ProcessLookupError):
                os.kill(rng.choice(found), number)
                figures.workers += 1
        if wait_for_end(process, figures):
            check_after(place, process.pid, before, f"{number.name} to a worker", figures)
        if process.returncode:
            figures.odd += 1
            figures.complain(f"{number.name} to a worker: status {process.returncode}")
    return process.returncode == 0


def undisturbed(place: KillPlace) -> tuple[dict[str, bytes], float]:
    """Return the tables of a study that nobody disturbs, and how long it took. [s]"""
    place.clear()
    started_s = time.monotonic()
    with place.command() as process:
        process.wait(PATIENCE_S)
    if process.returncode:
        msg = f"a study that nobody disturbed ended with status {process.returncode}"
        raise RuntimeError(msg)
    return place.tables(), time.monotonic() - started_s


def compare(place: KillPlace, wanted: dict[str, bytes], figures: Figures) -> None:
    """Count a study whose tables are not those of one that nobody disturbed, and begin anew."""
    figures.studies += 1
    left = place.left_over()
    figures.folders += len(left)
    figures.complain(f"after a study: {', '.join(map(str, left))} stays") if left else None
    found = place.tables()
    unlike = [name for name in wanted | found if wanted.get(name) != found.get(name)]
    if unlike:
        figures.unlike += 1
        figures.complain(f"tables differ: {', '.join(sorted(unlike))}")
    place.clear()


def main(
    parents: Annotated[int, typer.Option(min=0, help="Kills of the command.")] = 20,
    workers: Annotated[int, typer.Option(min=0, help="Kills of workers.")] = 20,
    seed: Annotated[int, typer.Option(help="Of the moments.")] = 1,
    seeds: Annotated[int, typer.Option(min=1, help="Seeds of the study.")] = 4,
    minutes: Annotated[float, typer.Option(help="No kill after this long. [min]")] = 20.0,
) -> None:
    """Kill studies at random moments, and fail if anything is lost or left."""
    rng, figures = random.Random(seed), Figures()  # noqa: S311 - no secrets
    until_s = time.monotonic() + 60.0 * minutes
    with tempfile.TemporaryDirectory(prefix="kills-") as root:
        place = KillPlace(Path(root), seeds)
        wanted, span_s = undisturbed(place)
        place.clear()
        while figures.parents < parents and time.monotonic() < until_s:
            if kill_parent(place, rng, span_s, figures):
                compare(place, wanted, figures)
        with place.command() as process:
            wait_for_end(process, figures)
        compare(place, wanted, figures)
        while figures.workers < workers and time.monotonic() < until_s:
            if kill_worker(place, rng, 0.7 * span_s, figures):
                compare(place, wanted, figures)
    out = sys.stdout
    out.write(
        f"{figures.parents} commands and {figures.workers} workers killed, "
        f"{figures.studies} studies finished afterwards\n"
        f"finished runs lost: {figures.lost}\nprocesses left: {figures.processes}\n"
        f"folders left: {figures.folders} (for the next command: {figures.until_next})\n"
        f"studies with other tables: {figures.unlike}\n"
        f"commands that hung: {figures.hung}\nodd ends: {figures.odd}\n"
    )
    out.writelines(f"  {sentence}\n" for sentence in figures.told[:20])
    if not figures.is_good or not figures.studies:
        raise typer.Exit(1)


if __name__ == "__main__":
    typer.run(main)
