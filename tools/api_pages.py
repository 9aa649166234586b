"""Write the pages of the programming interface: one for the public face, one for each wing."""

import pkgutil
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

FACE = ("kankaku", "kankaku.testing")
"""What scripts and plug-ins use."""
IN_FULL = ("kankaku.railway.", "kankaku.controllers", "kankaku.analysis.tables")
"""Wings in full: for who writes a controller or reads results. Others get a line per module."""


def wings() -> list[tuple[ModuleType, list[str]]]:
    """
    Return every package below the public face with its own modules.

    Returns
    -------
    list[tuple[ModuleType, list[str]]]
        Packages by name; modules of a package by name, packages within it left out.
    """
    face = import_module(FACE[0])
    found = {}
    for item in pkgutil.walk_packages(face.__path__, f"{FACE[0]}."):
        if item.ispkg:
            package = import_module(item.name)
            own = pkgutil.iter_modules(package.__path__, f"{item.name}.")
            found[item.name] = package, [one.name for one in own if not one.ispkg]
    return [found[name] for name in sorted(found)]


def face_page() -> str:
    """
    Return the page of the public face.

    Returns
    -------
    str
        MyST Markdown.
    """
    names = [name for name in FACE if find_spec(name)]
    return "\n".join(["# The public face", "", *(_module(name, imported=True) for name in names)])


def wing_page(package: ModuleType, modules: list[str]) -> str:
    """
    Return the page of a wing.

    Parameters
    ----------
    package
        The wing.
    modules
        Names of its own modules.

    Returns
    -------
    str
        MyST Markdown.
    """
    title = package.__name__.removeprefix(f"{FACE[0]}.")
    if not package.__name__.startswith(IN_FULL):
        rows = [f"| `{name}` | {_first_line(name)} |" for name in modules]
        about = ["```text", (package.__doc__ or "").strip(), "```", ""]
        return "\n".join([f"# {title}", "", *about, "| module | holds |", "|---|---|", *rows, ""])
    return "\n".join([f"# {title}", "", _module(package.__name__), *map(_titled, modules)])


def _first_line(name: str) -> str:
    text = (import_module(name).__doc__ or "").strip().split("\n\n", 1)[0]
    return " ".join(text.split()).replace("``", "`").replace("|", "\\|")


def _titled(name: str) -> str:
    return f"## {name.rsplit('.', 1)[1]}\n\n{_module(name)}"


def _module(name: str, *, imported: bool = False) -> str:
    more = "   :imported-members:\n   :no-index:\n" if imported else "   :ignore-module-all:\n"
    return f"```{{eval-rst}}\n.. automodule:: {name}\n   :members:\n{more}```\n"


def write_pages(folder: Path) -> None:
    """
    Write all pages; those that are as they were are left alone.

    Parameters
    ----------
    folder
        Where they go.
    """
    folder.mkdir(parents=True, exist_ok=True)
    pages = {"face": face_page()}
    for package, modules in wings():
        if modules:
            pages[package.__name__] = wing_page(package, modules)
    for old in folder.glob("*.md"):
        if old.stem not in pages:
            old.unlink()
    for name, text in pages.items():
        file = folder / f"{name}.md"
        if not file.is_file() or file.read_text("utf-8") != text:
            file.write_text(text, "utf-8")
