"""Folders, disks and numbers that are not as they should be, on the command line."""

import os
import tempfile
from pathlib import Path

import pytest

from tests.cli.command import kankaku, refused
from tests.unit.scenario_folder import replace, write_scenario


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_scenario(tmp_path / "small")


def test_a_pipe_in_place_of_the_scenario_is_named_and_not_waited_for(folder: Path) -> None:
    (folder / "scenario.toml").unlink()
    os.mkfifo(folder / "scenario.toml")
    assert "scenario.toml: is a pipe, not a file" in refused(folder, "--out", folder.parent / "out")


def test_seeds_beyond_the_last_one_are_refused_before_any_run(folder: Path) -> None:
    told = refused(folder, "--seed", str(2**63 - 1), "--seeds", "2", "--out", folder.parent / "out")
    assert "--seeds: 2 from seed 9223372036854775807 on; allowed: up to seed" in told
    assert not (folder.parent / "out").exists()


def test_a_step_that_is_no_number_is_refused(folder: Path) -> None:
    assert "Invalid value for '--step'" in refused(folder, "--step", "nan")


def test_a_name_with_an_escape_sequence_never_reaches_the_terminal(folder: Path) -> None:
    replace(folder, "scenario.toml", "[controllers.plain]", '"\\u001b[2J" = 1\n[controllers.plain]')
    told = refused(folder)
    assert "\x1b[2J" not in told
    assert "\\x1b[2J" in told


def test_a_name_between_brackets_is_told_as_it_is_written(folder: Path) -> None:
    replace(folder, "services.csv", "C3,unit", "C3,[red]unit[/]:train:")
    assert "'[red]unit[/]:train:'" in refused(folder)


def test_temporary_files_of_a_study_need_no_place_but_that_of_its_results(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", "/dev/null/nowhere")
    assert kankaku(folder, "--out", folder.parent / "out", "--jobs", "1").status == 0


def test_a_cache_that_cannot_be_written_is_told_by_its_name(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KANKAKU_CACHE", "/dev/null/nowhere")
    told = refused(folder, "--out", folder.parent / "out", "--jobs", "1")
    assert "/dev/null/nowhere (KANKAKU_CACHE): " in told
