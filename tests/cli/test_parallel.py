"""Runs in several processes: the same results, byte for byte."""

from pathlib import Path

import pytest

from tests.cli.command import PATIENCE_S, PROJECT, contents, is_note_of_time, start, two_controllers


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return two_controllers(tmp_path / "small")


def test_more_processes_give_the_same_bytes(folder: Path, tmp_path: Path) -> None:
    for jobs in ("1", "2"):
        process = start(
            PROJECT / "run.py", folder, "--out", tmp_path / jobs, "--jobs", jobs, "--seeds", "2"
        )
        _, complaints = process.communicate(timeout=PATIENCE_S)
        assert process.returncode == 0, complaints
    alone, together = contents(tmp_path / "1"), contents(tmp_path / "2")
    assert alone.keys() == together.keys()
    differing = {name for name in alone if alone[name] != together[name]}
    assert all(map(is_note_of_time, differing))
