"""Ctrl-C in a terminal: finished runs are kept, and nothing else is left behind."""

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from kankaku.analysis.results import read_results
from tests.cli import layers
from tests.cli.command import (
    PATIENCE_S,
    is_group_gone,
    kankaku,
    press_ctrl_c,
    start,
    two_controllers,
)

INTERRUPTED = 130
SCRIPT = Path(layers.__file__)
SETTLED_S = 1.0
"""After a folder stands there, the study takes note of it. [s]"""
ACCEPTED = "out/small/plain/run.json"
"""A run that is finished, in its place."""


@pytest.fixture
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Put temporary folders under the test's own, to see what is left of them."""
    (tmp_path / "temporary").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    return tmp_path


@contextmanager
def started(places: Path, folder: Path, jobs: str) -> Iterator[subprocess.Popen[str]]:
    """Start a study that will not end by itself, and leave no process behind."""
    process = start(SCRIPT, folder, "--out", places / "out", "--jobs", jobs)
    try:
        yield process
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def wait_for(process: subprocess.Popen[str], places: Path, pattern: str) -> None:
    until = time.monotonic() + PATIENCE_S
    while not list(places.glob(pattern)):
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < until
        time.sleep(0.05)
    time.sleep(SETTLED_S)


def left_over(places: Path) -> Iterator[Path]:
    yield from (places / "temporary").iterdir()
    yield from (item for item in (places / "out").rglob(".*"))


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_finished_runs_are_published(places: Path, jobs: str) -> None:
    folder = two_controllers(places / "small", protection="stuck")
    with started(places, folder, jobs) as process:
        wait_for(process, places, ACCEPTED)
        screen = press_ctrl_c(process)
        assert screen.status == INTERRUPTED, screen.complaints
        assert "Interrupted" in screen.complaints
        assert "Traceback" not in screen.complaints
        assert is_group_gone(process.pid)
    read = read_results(places / "out" / "small")
    assert read.controllers == ("plain",)
    assert read.provenance["interrupted"] is True
    assert not list(left_over(places))


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_before_the_first_run_is_finished_nothing_is_written(places: Path, jobs: str) -> None:
    folder = two_controllers(places / "small", protection="stuck")
    settings = folder / "scenario.toml"
    settings.write_text(settings.read_text("utf-8").replace("moving_block", "stuck"), "utf-8")
    with started(places, folder, jobs) as process:
        wait_for(process, places, "**/trains.rou.xml")
        screen = press_ctrl_c(process)
        assert screen.status == INTERRUPTED, screen.complaints
        assert "Traceback" not in screen.complaints
        assert is_group_gone(process.pid)
    assert not list((places / "out").rglob("*.csv"))
    assert not list(left_over(places))


def test_a_closed_terminal_leaves_no_process_and_no_folder(places: Path) -> None:
    folder = two_controllers(places / "small", protection="stuck")
    with started(places, folder, "2") as process:
        wait_for(process, places, ACCEPTED)
        process.send_signal(signal.SIGHUP)
        process.communicate(timeout=PATIENCE_S)
        assert process.returncode == INTERRUPTED
        assert is_group_gone(process.pid)
    assert read_results(places / "out" / "small").controllers == ("plain",)
    assert not list(left_over(places))


def test_a_killed_command_leaves_no_process_and_no_folder_and_is_continued(places: Path) -> None:
    folder = two_controllers(places / "small", protection="stuck")
    with started(places, folder, "2") as process:
        wait_for(process, places, ACCEPTED)
        process.kill()
        process.communicate()
        assert is_group_gone(process.pid)
    assert not list(left_over(places))
    assert {item.name for item in (places / "out" / "small").iterdir()} == {"plain"}
    screen = kankaku(folder, "--out", places / "out", "--controller", "plain")
    assert screen.status == 0, screen.complaints
    assert "nothing had to be run" in screen.complaints
    assert read_results(places / "out" / "small").controllers == ("plain",)
