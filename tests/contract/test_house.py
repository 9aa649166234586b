"""The house keeps its own rules: one name for one thing, no cycles, nothing grows too long."""

import ast
from collections import defaultdict
from collections.abc import Container, Iterator, Mapping
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]
ROOMS = ("analysis", "controllers", "railway", "scenarios", "sumo_net", "telecom")
FACE = PROJECT / "kankaku"
LONGEST_FILE = 420
LONGEST_FUNCTION = 50
"""Lines, its docstring not counted."""


def sources() -> list[Path]:
    """Every file of the program, each one once although rooms are linked to."""
    own = [file for file in FACE.rglob("*.py") if not any(up.is_symlink() for up in file.parents)]
    rooms = [file for room in ROOMS for file in (PROJECT / room).rglob("*.py")]
    return sorted(own + rooms)


def module_of(file: Path) -> str:
    """Return the name by which a file is imported."""
    parts = list(file.relative_to(PROJECT).with_suffix("").parts)
    parts = parts if parts[0] == "kankaku" else ["kankaku", *parts]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@pytest.fixture(scope="module")
def trees() -> Mapping[Path, ast.Module]:
    """Return what the files say; not kept for the tests of other modules, nor made before them."""
    return {file: ast.parse(file.read_text("utf-8")) for file in sources()}


@pytest.fixture(scope="module")
def modules(trees: Mapping[Path, ast.Module]) -> Mapping[str, ast.Module]:
    return {module_of(file): tree for file, tree in trees.items()}


def test_the_rooms_are_reached_by_links_that_hold_in_any_checkout() -> None:
    for room in ROOMS:
        link = FACE / room
        assert link.is_symlink()
        assert link.readlink() == Path("..") / room


def test_no_two_modules_have_one_name(modules: Mapping[str, ast.Module]) -> None:
    named = defaultdict(list)
    for module in modules:
        name = module.rpartition(".")[2]
        if name != "__main__":
            named[name].append(module)
    assert not {name: found for name, found in named.items() if len(found) > 1}


def test_no_two_test_modules_have_one_name() -> None:
    """They would be one to Python, which refuses the second."""
    names = [file.name for file in (PROJECT / "tests").rglob("test_*.py")]
    assert names
    assert sorted(names) == sorted(set(names))


def test_no_two_classes_have_one_name(modules: Mapping[str, ast.Module]) -> None:
    named = defaultdict(list)
    for module, tree in modules.items():
        for node in tree.body:
            if isinstance(node, ast.ClassDef):
                named[node.name].append(module)
    assert not {name: found for name, found in named.items() if len(found) > 1}


def imported(tree: ast.Module, modules: Container[str]) -> Iterator[str]:
    """Yield what a module imports when it is imported itself."""
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.module:
            for item in node.names:
                whole = f"{node.module}.{item.name}"
                yield whole if whole in modules else node.module


def test_no_module_imports_itself_in_the_end(modules: Mapping[str, ast.Module]) -> None:
    waits_for = {
        module: {name for name in imported(tree, modules) if name in modules and name != module}
        for module, tree in modules.items()
    }
    while ready := [module for module, names in waits_for.items() if not names]:
        for module in ready:
            del waits_for[module]
        for names in waits_for.values():
            names.difference_update(ready)
    assert not waits_for


@pytest.mark.parametrize("folder", ["tests", "tools", "kankaku", *ROOMS])
def test_everybody_says_kankaku_first(folder: str) -> None:
    """A room that is imported by its bare name would exist twice."""
    bare = [
        f"{file}: {node.module}"
        for file in (PROJECT / folder).rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text("utf-8")))
        if isinstance(node, ast.ImportFrom)
        and node.module
        and node.module.partition(".")[0] in ROOMS
    ]
    assert not bare


def _lines(node: ast.stmt) -> int:
    return (node.end_lineno or node.lineno) - node.lineno + 1


def test_no_file_and_no_function_grows_too_long(trees: Mapping[Path, ast.Module]) -> None:
    long = [
        f"{file}: {lines} lines"
        for file in trees
        if (lines := len(file.read_text("utf-8").splitlines())) > LONGEST_FILE
    ]
    for file, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                told = node.body[0]
                skipped = _lines(told) if ast.get_docstring(node) else 0
                lines = _lines(node) - skipped
                if lines > LONGEST_FUNCTION:
                    long.append(f"{file}: {node.name} has {lines} lines")
    assert not long


def test_every_package_says_what_it_is_for(trees: Mapping[Path, ast.Module]) -> None:
    for file, tree in trees.items():
        told = ast.get_docstring(tree) or ""
        assert len(told) > 20, f"{file} says nothing about itself"
