"""Every package of docs/examples is found by its entry point, judged, and passes its own tests."""

import importlib
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from kankaku.controllers.registry import OPERATIONS, PROTECTIONS
from tests.cli.command import PROJECT, kankaku
from tests.cli.test_new_controller import on_the_path

FOLDERS = sorted(file.parent for file in (PROJECT / "docs" / "examples").glob("*/pyproject.toml"))
JUDGED_HERE = "test_it_keeps_the_contract"
"""Own tests of this name run what is run here anyway."""


def entry_of(folder: Path) -> str:
    project = tomllib.loads((folder / "pyproject.toml").read_text("utf-8"))["project"]
    (name,) = project["entry-points"]["kankaku.operations"]
    return str(name)


@pytest.fixture(params=FOLDERS, ids=lambda folder: folder.name)
def example(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Path]:
    """Do what an installation does, for as long as a test runs."""
    folder = Path(request.param)
    registered = set(PROTECTIONS.added())
    on_the_path(folder, tmp_path / "site", monkeypatch)
    yield folder
    OPERATIONS.__dict__.pop("offered", None)
    for name in set(PROTECTIONS.added()) - registered:
        del PROTECTIONS.data[name]
    for module in [name for name in sys.modules if name.startswith(("kankaku_", "test_"))]:
        if str(folder) in str(getattr(sys.modules[module], "__file__", "")):
            del sys.modules[module]


def test_an_example_is_found_and_keeps_the_contract(example: Path) -> None:
    name = entry_of(example)
    assert "It keeps the contract." in kankaku("check-controller", name).answers
    assert OPERATIONS[name].summary in kankaku("--list-controllers").answers


def test_an_example_passes_its_own_tests(example: Path) -> None:
    (file,) = example.glob("test_*.py")
    own = importlib.import_module(file.stem)
    tests = {name: test for name, test in vars(own).items() if name.startswith("test_")}
    assert any(name.startswith(JUDGED_HERE) for name in tests)
    for name, test in tests.items():
        if not name.startswith(JUDGED_HERE):
            test()


def test_the_readme_of_the_examples_names_every_one() -> None:
    told = (PROJECT / "docs" / "examples" / "README.md").read_text("utf-8")
    assert len(FOLDERS) >= 4
    for folder in FOLDERS:
        assert f"]({folder.name})" in told
