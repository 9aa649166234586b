"""What the documentation names is there: modules, files, commands and options."""

import re
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]
PAGES = sorted(
    page
    for place in (PROJECT, PROJECT / "docs", PROJECT / "docs" / "guide", PROJECT / "scenarios")
    for page in place.glob("*.md")
    if page.name != "CHANGELOG.md"
)
NAME = re.compile(r"`(kankaku(?:\.\w+)+)")
FILE = re.compile(
    r"`((?:kankaku|railway|controllers|analysis|scenarios|sumo_net|telecom|tests|tools|docs)"
    r"/[\w/.-]+\.\w+)`"
)
GROUPS = ("kankaku.protections", "kankaku.operations", "kankaku.supervisions")
"""Entry points, no modules."""
TEST = re.compile(r"`(test_\w+\.py)`")
LINK = re.compile(r"\]\((?!https?://|#)([^)#\s]+)")


def is_there(name: str) -> bool:
    """Return whether a dotted name is a module, or something in one."""
    module, _, last = name.rpartition(".")
    try:
        if find_spec(name) is not None:
            return True
    except ModuleNotFoundError:
        return "." in module and is_part(name)
    return hasattr(import_module(module), last)


def is_part(name: str) -> bool:
    """Return whether a dotted name is an attribute of a class of a module."""
    module, _, last = name.rpartition(".")
    home, _, kind = module.rpartition(".")
    try:
        return hasattr(getattr(import_module(home), kind), last)
    except (ModuleNotFoundError, AttributeError):
        return False


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(PROJECT)))
def test_names_files_and_links_of_a_page_lead_somewhere(page: Path) -> None:
    text = page.read_text("utf-8")
    names = [name for name in NAME.findall(text) if name not in GROUPS]
    lost = [name for name in names if not is_there(name)]
    lost += [file for file in FILE.findall(text) if not (PROJECT / file).exists()]
    lost += [name for name in TEST.findall(text) if not list(PROJECT.glob(f"tests/*/{name}"))]
    # Pages that the build of the documentation makes are there only after it.
    lost += [
        link
        for link in LINK.findall(text)
        if "_tutorials/" not in link
        and not link.endswith(".html")
        and not any((page.parent / f"{link}{end}").exists() for end in ("", ".md"))
    ]
    assert not lost
