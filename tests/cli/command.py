"""The command line as a user types it, in this process or in its own."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from typer.testing import CliRunner

from kankaku import interrupts
from kankaku.commands import app, screen
from tests.unit.scenario_folder import write_scenario

PROJECT = Path(__file__).parents[2]
WIDE = {"COLUMNS": "200"}
FAILED = 1
BAD_INPUT = 2
SCREEN_LINES = 24
PATIENCE_S = 300.0
"""Whoever takes longer hangs, also on a busy machine that has compiled nothing yet. [s]"""
SECOND_CONTROLLER = """
[controllers.second]
protection = "{protection}"
operation = "two_stage"
"""


@dataclass(frozen=True)
class Screen:
    """What a command left on the screen."""

    status: int
    answers: str
    complaints: str


def kankaku(*arguments: str | Path, width: int = 200) -> Screen:
    """Run the command in this process."""
    # Said to the consoles, too: what stood in the environment when they were made counts as well.
    screen.answers.width = screen.console.width = width
    environment = {"COLUMNS": str(width), "TERM": "dumb", "NO_COLOR": "1"}
    done = CliRunner().invoke(app.app, [str(part) for part in arguments], env=environment)
    if done.exception and not isinstance(done.exception, SystemExit):
        raise done.exception
    return Screen(done.exit_code, done.stdout, done.stderr)


def refused(*arguments: str | Path) -> str:
    """Run a command that is refused on one screen, and return what it complains of."""
    screen = kankaku(*arguments)
    assert screen.status == BAD_INPUT
    assert not screen.answers
    assert "Traceback" not in screen.complaints
    assert len(screen.complaints.splitlines()) <= SCREEN_LINES
    return screen.complaints


def start(script: Path, *arguments: str | Path) -> subprocess.Popen[str]:
    """Start a script as a process of its own, like a terminal in a process group of its own."""
    with heard_signals():
        return subprocess.Popen(  # noqa: S603
            [sys.executable, str(script), *map(str, arguments)],
            env={**os.environ, **WIDE, "PYTHONPATH": str(PROJECT)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )


@contextmanager
def heard_signals() -> Iterator[None]:
    """
    Let what is started hear every signal that ends a command.

    Tests in the background ignore Ctrl-C, those under ``nohup`` a closed terminal, and what
    they start would do so, too; what is handled here is as usual there.
    """
    usual = {number: signal.getsignal(number) for number in interrupts.ENDING}
    for number in usual:
        signal.signal(number, signal.default_int_handler)
    try:
        yield
    finally:
        for number, handler in usual.items():
            signal.signal(number, handler)


def press_ctrl_c(process: subprocess.Popen[str]) -> Screen:
    """Send SIGINT to the whole process group, as a terminal does."""
    os.killpg(process.pid, signal.SIGINT)
    answers, complaints = process.communicate(timeout=PATIENCE_S)
    return Screen(process.returncode, answers, complaints)


def is_group_gone(group: int, patience_s: float = PATIENCE_S) -> bool:
    """Return whether no process of a group is left."""
    until = time.monotonic() + patience_s
    while time.monotonic() < until:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False


def two_controllers(folder: Path, protection: str = "moving_block") -> Path:
    """Write a small scenario of two controllers: ``plain``, then ``second``."""
    write_scenario(folder)
    with (folder / "scenario.toml").open("a", encoding="utf-8") as file:
        file.write(SECOND_CONTROLLER.format(protection=protection))
    return folder


def peer(folder: Path, name: str) -> None:
    """Add a peer to a scenario, under its own name."""
    with (folder / "scenario.toml").open("a", encoding="utf-8") as file:
        file.write(f'\n[controllers.{name}]\npeer = "{name}"\n')


def is_note_of_time(name: str) -> bool:
    """Return whether a file of a results folder says when something was done."""
    return name.rpartition("/")[2] in {"provenance.json", "run.json"}


def contents(folder: Path) -> dict[str, bytes]:
    """Return the bytes of every file below a folder, hidden ones included."""
    return {
        file.relative_to(folder).as_posix(): file.read_bytes()
        for file in sorted(folder.rglob("*"))
        if file.is_file()
    }
