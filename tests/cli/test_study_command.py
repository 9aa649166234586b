"""The commands ``study`` and ``merge``, on SUMO: killed, gone on with, cut into parts."""

import os
import signal
import time
from pathlib import Path

import pytest

from tests.cli.command import (
    PATIENCE_S,
    PROJECT,
    contents,
    is_group_gone,
    kankaku,
    refused,
    start,
    two_controllers,
)

CHOSEN = ("--controllers", "plain,second", "--seeds", "2", "--figures", "svg")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return two_controllers(tmp_path / "small")


def test_a_study_that_was_killed_or_cut_into_parts_gives_the_same_bytes(
    folder: Path, tmp_path: Path
) -> None:
    killed, merged = tmp_path / "killed", tmp_path / "merged"
    process = start(PROJECT / "run.py", "study", folder, *CHOSEN, "--jobs", "2", "--out", killed)
    until_s = time.monotonic() + PATIENCE_S
    while not list(killed.glob("runs*/table=summary/*/*/*/*.parquet")):
        assert process.poll() is None
        assert time.monotonic() < until_s
        time.sleep(0.05)
    os.kill(process.pid, signal.SIGKILL)
    process.communicate(timeout=PATIENCE_S)
    assert is_group_gone(process.pid)
    again = kankaku("study", folder, *CHOSEN, "--jobs", "1", "--out", killed)
    assert again.status == 0
    assert " of 6 runs were finished before." in again.complaints
    assert "2 seeds of each scenario and controller." in again.answers
    assert "Largest relative difference to every_step: " in again.answers
    parts = [tmp_path / number for number in ("1", "2")]
    for part in parts:
        shard = ("--shard", f"{part.name}/2", "--jobs", "1", "--out", part)
        done = kankaku("study", folder, *CHOSEN, *shard)
        assert (done.status, done.answers) == (0, "")
    assert kankaku("merge", merged, *parts, "--figures", "svg").status == 0
    assert contents(merged) == contents(killed)


def test_what_cannot_be_run_is_refused_on_one_screen(folder: Path, tmp_path: Path) -> None:
    study = ("study", folder, "--out", tmp_path / "out")
    assert "allowed: 3/20 for the third" in refused(*study, "--shard", "3")
    assert "is no indicator; allowed: " in refused(*study, "--until", "lateness ±2 %")
    assert "allowed: png, svg, pdf" in refused(*study, "--figures", "gif")
    assert "antithetic, latin_hypercube" in refused(*study, "--draws", "sobol")
    halved = refused(*study, "--draws", "antithetic", "--seeds", "3")
    assert "allowed: a multiple of 2" in halved
    assert "allowed: plain, second" in refused(*study, "--controllers", "plain,fast")
    assert "plan.json of a study" in refused("merge", tmp_path / "out", folder)
    assert not (tmp_path / "out").exists()
