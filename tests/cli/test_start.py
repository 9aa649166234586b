"""Nobody waits for what a command does not need."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.command import PROJECT, kankaku, refused
from tests.unit.scenario_folder import write_scenario

LIBRARIES = {"numpy", "pandas", "numba", "libsumo", "simpy", "matplotlib"}
SLOW_PARTS = {"scipy.optimize", "scipy.special", "matplotlib"}
TOLD = "import atexit, sys; atexit.register(lambda: print('\\n', *sys.modules, file=sys.stderr)); "
COMMAND = "sys.argv[1:] = [{!r}]; from kankaku.__main__ import main; main()"


def imported_by(program: str) -> set[str]:
    done = subprocess.run(  # noqa: S603 - our own program
        [sys.executable, "-c", TOLD + program],
        cwd=PROJECT,
        capture_output=True,
        text=True,
        check=True,
    )
    return set(done.stderr.splitlines()[-1].split())


@pytest.mark.parametrize("option", ["--help", "--version"])
def test_what_needs_no_library_imports_none(option: str) -> None:
    assert not LIBRARIES & imported_by(COMMAND.format(option))


def test_controllers_are_listed_without_tables_and_files() -> None:
    listed = imported_by(COMMAND.format("--list-controllers"))
    assert not {"pandas", "libsumo", *SLOW_PARTS} & listed


def test_a_run_begins_without_what_only_some_of_its_parts_need() -> None:
    assert not SLOW_PARTS & imported_by("from kankaku.commands import run_shown")


def test_help_names_every_command_but_the_former_words_for_them() -> None:
    told = kankaku("--help").answers
    for command in ("run", "capacity", "campaign", "radio", "availability", "check-controller"):
        assert f" {command} " in told
    for former in ("faults", "compare"):
        assert f"│ {former} " not in told
        assert kankaku(former, "--help").status == 0


def test_a_slip_of_a_command_is_told_as_that_and_a_folder_is_none(tmp_path: Path) -> None:
    told = refused("capcity", "rush_hour")
    assert "No such command 'capcity'" in told
    assert "'capacity'" in told
    folder = write_scenario(tmp_path / "capcity")
    assert "Nothing to run" not in refused(folder, "--controller", "unheard_of")
    assert "no such folder" in refused("capacitor_bank")
