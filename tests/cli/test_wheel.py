"""Installed beside a stranger's files: one name, all scenarios, and an operation of one's own."""

import os
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

from kankaku.commands.controller_package import package_files
from tests.cli.command import PATIENCE_S, PROJECT

LEFT_OUT = shutil.ignore_patterns(
    ".venv", ".git", "out", "build", "__pycache__", "*.egg-info", ".*"
)
SCENARIOS = tuple(file.parent.name for file in (PROJECT / "scenarios").glob("*/scenario.toml"))
OWN = ("kankaku_steady", "kankaku_hurry")
BUILD = "import sys; from setuptools import build_meta; build_meta.build_sdist(sys.argv[1])"


def python(*arguments: str | Path, tools: Path, cwd: Path | None = None) -> None:
    """Run Python with the tools that build packages."""
    subprocess.run(  # noqa: S603 - our own arguments
        [sys.executable, *map(str, arguments)],
        env={**os.environ, "PYTHONPATH": str(tools)},
        cwd=cwd,
        check=True,
        capture_output=True,
        timeout=PATIENCE_S,
    )


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a copy of the sources, what builds them, and the archive of them."""
    place = tmp_path_factory.mktemp("built")
    source, tools = place / "source", place / "tools"
    shutil.copytree(PROJECT, source, symlinks=True, ignore=LEFT_OUT)
    python("-m", "pip", "install", "-q", "--target", tools, "setuptools>=77", tools=tools)
    python("-c", BUILD, place / "archive", tools=tools, cwd=source)
    return place


@pytest.fixture(scope="session")
def installed(built: Path) -> Path:
    """Return a folder with the program and the example package, as pip installs them."""
    example = built / "source" / "docs" / "examples" / "own_operation"
    own = built / "hurry"
    for file, text in package_files("hurry").items():
        own.mkdir(exist_ok=True)
        (own / file).write_text(text, "utf-8")
    (archive,) = (built / "archive").iterdir()
    install = ("-m", "pip", "install", "-q", "--no-deps", "--no-build-isolation", "--target")
    python(*install, built / "site", archive, example, own, tools=built / "tools")
    return built / "site"


@pytest.fixture(scope="session")
def stranger(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with files that have the names of rooms and break who imports them."""
    folder = tmp_path_factory.mktemp("stranger")
    for name in ("analysis", "controllers", "railway", "run", "study"):
        (folder / f"{name}.py").write_text("raise RuntimeError('not yours')\n", "utf-8")
    return folder


def told(installed: Path, stranger: Path, *arguments: str) -> str:
    """Run the command as its script does, in the stranger's folder."""
    libraries = [path for path in sys.path if path.endswith("site-packages")]
    done = subprocess.run(  # noqa: S603 - our own arguments
        [sys._base_executable, "-m", "kankaku", *arguments],  # type: ignore[attr-defined]  # noqa: SLF001
        env={
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(installed), *libraries]),
            "COLUMNS": "200",
        },
        cwd=stranger,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    answers: str = done.stdout
    return answers


def test_the_archive_of_the_sources_has_files_and_no_links(built: Path) -> None:
    """The rooms are links in the house, which no archive of another system needs to know."""
    (archive,) = (built / "archive").iterdir()
    with tarfile.open(archive) as packed:
        members = packed.getmembers()
    assert all(member.isfile() or member.isdir() for member in members)
    names = {member.name.partition("/")[2] for member in members}
    assert {"pyproject.toml", "README.md", "LICENSE", "kankaku/railway/plan/line.py"} <= names


def test_the_wheel_has_one_name_types_scenarios_and_a_command(installed: Path) -> None:
    names = {item.name for item in installed.iterdir() if not item.name.startswith(OWN)}
    others = {name for name in names if not name.endswith(".dist-info")} - {"bin", "__pycache__"}
    assert others == {"kankaku"}
    assert (installed / "bin" / "kankaku").exists()
    assert (installed / "kankaku" / "py.typed").exists()
    assert not any(item.is_symlink() for item in (installed / "kankaku").iterdir())
    for name in SCENARIOS:
        written = {file.name for file in (PROJECT / "scenarios" / name).iterdir()}
        assert {file.name for file in (installed / "kankaku" / "scenarios" / name).iterdir()} == (
            written
        )


def test_it_runs_beside_a_strangers_files_with_an_operation_of_a_package(
    installed: Path, stranger: Path
) -> None:
    """What runs is the shipped scenario by its name, from the folder where it is installed."""
    answers = told(installed, stranger, "run", "eco_driving", "--controller", "moving_block+steady")
    assert "energy, net [kWh]" in answers
    assert (stranger / "out" / "eco_driving" / "summary.csv").exists()


def test_the_operation_of_a_package_is_listed_and_judged(installed: Path, stranger: Path) -> None:
    assert "(package kankaku-steady)" in told(installed, stranger, "--list-controllers")
    for name in ("steady", "hurry"):
        assert "It keeps the contract." in told(installed, stranger, "check-controller", name)
