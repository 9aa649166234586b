"""
No kill changes a study of very many seeds: the second half of ``make kills``.

A study of many short runs is killed again and again: the command, a worker process, a worker of
Dask. The same command goes on each time. In the end its results have to be, byte for byte, those of
one that nobody disturbed, and no process and no temporary file may be left.
"""

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from enum import Enum
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from tools.kills import PATIENCE_S, PROJECT, is_gone, workers_of

SCENARIO = PROJECT / "scenarios" / "eco_driving"
CONTROLLERS = 2
STEP_S = 0.5
POLL_S = 0.05
GOES_ON = 3
"""Runs that have to be finished after a worker was killed, before the command is ended. [-]"""


class Victim(Enum):
    """Who is killed."""

    COMMAND = "command"
    WORKER = "worker process"
    DASK = "worker of Dask"


@dataclass(frozen=True)
class ManyRuns:
    """Where the studies of a test go."""

    root: Path
    seeds: int
    controllers: str

    @property
    def out(self) -> Path:
        """The results folder that is written again and again."""
        return self.root / "out"

    def finished(self) -> int:
        """Return how many runs are finished."""
        return len(list(self.out.glob("runs*/table=summary/*/*/*/run.parquet")))

    def content(self) -> dict[str, bytes]:
        """Return all that the results folder holds."""
        return {
            file.relative_to(self.out).as_posix(): file.read_bytes()
            for file in sorted(self.out.rglob("*"))
            if file.is_file()
        }

    @contextmanager
    def command(self, *, dask: bool = False) -> Iterator[subprocess.Popen[bytes]]:
        """Run the study as a user would, in a process group of its own."""
        arguments = [sys.executable, PROJECT / "run.py", "study", SCENARIO, "--jobs", "2"]
        arguments += ["--controllers", self.controllers, "--step", STEP_S, "--seed", "1"]
        arguments += ["--seeds", self.seeds, "--figures", "svg", "--out", self.out]
        temporary = self.root / "temporary"
        temporary.mkdir(exist_ok=True)
        process = subprocess.Popen(  # noqa: S603
            [*map(str, arguments), *(["--scheduler", "local"] if dask else [])],
            env={**os.environ, "TMPDIR": str(temporary)},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        try:
            yield process
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()

    def wait_for(self, process: subprocess.Popen[bytes], runs: int) -> bool:
        """Return whether so many runs are finished before the command ends."""
        until_s = time.monotonic() + PATIENCE_S
        while self.finished() < runs and process.poll() is None:
            if time.monotonic() > until_s:
                msg = f"no run was finished in {PATIENCE_S:.0f} s"
                raise RuntimeError(msg)
            time.sleep(POLL_S)
        return process.poll() is None

    def complete(self) -> float:
        """Run what is missing and return how long that took. [s]"""
        begun_s = time.monotonic()
        with self.command() as process:
            status = process.wait(10.0 * PATIENCE_S)
        if status:
            msg = f"a study that nobody disturbed ended with status {status}"
            raise RuntimeError(msg)
        return time.monotonic() - begun_s


def kill(place: ManyRuns, victim: Victim, wanted: int, rng: random.Random) -> list[str]:
    """Kill somebody once so many runs are finished, and return what went wrong."""
    told = []
    with place.command(dask=victim is Victim.DASK) as process:
        if not place.wait_for(process, wanted):
            return [f"{victim.value}: the study ended before"]
        time.sleep(rng.uniform(0.0, 1.0))
        before = place.finished()
        if victim is Victim.COMMAND:
            os.kill(process.pid, signal.SIGKILL)
        else:
            with suppress(ProcessLookupError):
                os.kill(rng.choice(workers_of(process.pid)), signal.SIGKILL)
            if not place.wait_for(process, before + GOES_ON):
                told.append(f"{victim.value}: the study did not go on")
            with suppress(ProcessLookupError):
                os.kill(process.pid, signal.SIGINT)
        process.wait(PATIENCE_S)
        if not is_gone(process.pid):
            told.append(f"{victim.value}: a process stays")
        if place.finished() < before:
            told.append(f"{victim.value}: {before - place.finished()} finished runs are lost")
    return told


def main(
    kills: Annotated[int, typer.Option(min=0, help="How often somebody is killed.")] = 10,
    runs: Annotated[int, typer.Option(min=20, help="Runs of the study.")] = 200,
    controllers: Annotated[str, typer.Option(help="Two of the scenario.")] = "close_up,eco",
    seed: Annotated[int, typer.Option(help="Of the moments.")] = 1,
) -> None:
    """Kill a study of many runs, and fail if its bytes are not those of one never killed."""
    rng = random.Random(seed)  # noqa: S311 - no secrets
    victims = [one for one in Victim if one is not Victim.DASK or find_spec("distributed")]
    told: list[str] = []
    with tempfile.TemporaryDirectory(prefix="kills-") as root:
        place = ManyRuns(Path(root), runs // CONTROLLERS, controllers)
        taken_s = place.complete()
        wanted = place.content()
        shutil.rmtree(place.out)
        for number in range(kills):
            least = place.finished() + max((runs - place.finished()) // (kills - number + 2), 1)
            told += kill(place, victims[number % len(victims)], least, rng)
        before = place.finished()
        place.complete()
        found = place.content()
        unlike = [name for name in wanted | found if wanted.get(name) != found.get(name)]
        told += [f"other bytes: {name}" for name in unlike]
        left = [*(place.root / "temporary").iterdir(), *place.out.rglob(".*")]
    told += [f"left: {item}" for item in left]
    sys.stdout.write(
        f"a study of {runs} runs ({taken_s:.0f} s), killed {kills} times "
        f"({', '.join(victim.value for victim in victims)}), {before} runs kept; "
        f"{len(wanted)} files, {len(unlike)} with other bytes\n"
    )
    sys.stdout.writelines(f"  {sentence}\n" for sentence in told[:20])
    if told:
        raise typer.Exit(1)


if __name__ == "__main__":
    typer.run(main)
