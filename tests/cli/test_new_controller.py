"""A package of one's own from nothing: written, found, judged, run, and shown in pages."""

import sys
import tomllib
from pathlib import Path

import pytest

from kankaku.commands.controller_package import package_files
from kankaku.controllers.registry import OPERATIONS
from tests.cli.command import PROJECT, kankaku, refused
from tests.unit.scenario_folder import write_scenario

NAME = "calm_down"
CONTROLLER = f"moving_block+{NAME}"
EXAMPLE = PROJECT / "docs" / "examples" / "own_operation"


def on_the_path(folder: Path, site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Do what ``pip install --editable`` does: note the entry points, and name the folder."""
    project = tomllib.loads((folder / "pyproject.toml").read_text("utf-8"))["project"]
    noted = site / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    noted.mkdir(parents=True)
    told = f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    (noted / "METADATA").write_text(told, "utf-8")
    groups = project["entry-points"].items()
    lines = [
        f"[{group}]\n" + "".join(f"{k} = {v}\n" for k, v in it.items()) for group, it in groups
    ]
    (noted / "entry_points.txt").write_text("\n".join(lines), "utf-8")
    monkeypatch.syspath_prepend(str(site))
    monkeypatch.syspath_prepend(str(folder))
    OPERATIONS.__dict__.pop("offered", None)


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> object:
    """Write a package by the command, and put it where Python finds it."""
    folder = tmp_path / "calm down"
    screen = kankaku("new-controller", folder)
    assert screen.status == 0
    told = screen.answers.splitlines()
    assert f"  kankaku check-controller {NAME}" in told
    assert f"  pip install --no-deps --editable '{folder}'" in told
    assert f"Write your own into {folder / f'kankaku_{NAME}.py'}. It runs as it is, too:" in told
    on_the_path(folder, tmp_path / "site", monkeypatch)
    yield folder
    OPERATIONS.__dict__.pop("offered", None)
    sys.modules.pop(f"kankaku_{NAME}", None)


def test_what_is_written_keeps_the_contract(package: Path) -> None:
    assert {file.name for file in package.iterdir()} >= {
        "pyproject.toml",
        "README.md",
        f"kankaku_{NAME}.py",
        f"test_{NAME}.py",
    }
    assert len((package / f"kankaku_{NAME}.py").read_text("utf-8").splitlines()) <= 45
    screen = kankaku("check-controller", NAME)
    assert "It keeps the contract." in screen.answers
    assert "(package kankaku-calm-down)" in kankaku("--list-controllers").answers


def test_its_own_test_is_passed(package: Path) -> None:
    """In this process, which has found it already."""
    found: dict[str, object] = {}
    source = (package / f"test_{NAME}.py").read_text("utf-8")
    exec(compile(source, f"test_{NAME}.py", "exec"), found)  # noqa: S102 - what the command wrote
    tests = [it for name, it in found.items() if name.startswith("test_") and callable(it)]
    assert len(tests) == 2
    for test in tests:
        test()


def test_every_command_runs_it_and_its_page_shows_it(package: Path, tmp_path: Path) -> None:
    line, out = write_scenario(tmp_path / "line"), tmp_path / "out"
    two = ("--controller", "moving_block+close_up", "--controller", CONTROLLER)
    here = ("--jobs", "1", "--out", out)
    assert kankaku("run", line, *two, *here, "--no-open", "--figures", "none").status == 0
    results = out / "line"
    assert CONTROLLER in (results / "summary.csv").read_text("utf-8")
    assert kankaku("report", results, "--no-open").status == 0
    assert CONTROLLER in (results / "report.html").read_text("utf-8")
    assert kankaku("capacity", line, *two, *here).status == 0
    across = ("across", line, *two, "--jobs", "1", "--out", tmp_path / "more")
    assert kankaku(*across, "--no-open", "--figures", "none").status == 0
    study = ("study", line, *two, "--seeds", "2", "--jobs", "1", "--out", tmp_path / "study")
    assert kankaku(*study, "--no-open", "--figures", "svg").status == 0
    assert package.is_dir()


def test_the_example_of_the_documentation_is_what_the_command_writes() -> None:
    for name, text in package_files("steady").items():
        assert (EXAMPLE / name).read_text("utf-8") == text


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("eco", "Kankaku has the operation 'eco' already"),
        ("moving_block", "Kankaku has the protection 'moving_block' already"),
        ("class", "'class' is a word of Python"),
        ("Grün", "is no name of an operation; allowed: small letters"),
        ("a__b", "is no name of an operation"),
        ("x" * 60, "is no name of an operation"),
    ],
)
def test_names_that_cannot_be_are_refused_and_nothing_is_written(
    name: str, told: str, tmp_path: Path
) -> None:
    assert told in refused("new-controller", tmp_path / "own", "--name", name)
    assert not (tmp_path / "own").exists()


def test_files_that_are_there_stay_unless_told_otherwise(tmp_path: Path) -> None:
    (tmp_path / "README.md").write_text("mine", "utf-8")
    assert "is there already" in refused("new-controller", tmp_path, "--name", "mine")
    assert [file.name for file in tmp_path.iterdir()] == ["README.md"]
    assert kankaku("new-controller", tmp_path, "--name", "mine", "--force").status == 0
    assert "mine" in (tmp_path / "README.md").read_text("utf-8")


@pytest.mark.parametrize("name", ["layer", "advice", "world"])
def test_a_class_has_no_name_that_its_module_imports(name: str) -> None:
    source = package_files(name)[f"kankaku_{name}.py"]
    assert f"class Own{name.capitalize()}:" in source
