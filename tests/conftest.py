"""
What all tests share.

No example is judged by a clock, which a busy machine would decide. What takes long and is not
looked at is left out, unless ``--deep`` asks for it: most of the examples of properties, and the
figures of results folders, which took nine tenths of the tests that publish any.
"""

import gc
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest
from hypothesis import settings

from kankaku.analysis.publish import results_folder
from kankaku.analysis.publish.results_folder import Draw
from kankaku.analysis.tables.columns import write_whole
from tests.examples import ask_for_all

settings.register_profile(
    "kankaku", settings.get_profile(settings.get_current_profile_name()), deadline=None
)
settings.load_profile("kankaku")

# What is imported stays, and is much: to look through it for cycles costs more than it frees.
gc.set_threshold(50_000, *gc.get_threshold()[1:])


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--deep", action="store_true", help="all examples of properties, and all figures"
    )


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "figures: figures of results folders are drawn")
    if config.getoption("--deep"):
        ask_for_all()


def _sketch(folder: Path, figures: Mapping[str, Draw], formats: Sequence[str]) -> None:
    """Write the files of figures without what is on them."""
    for name in figures:
        (folder / name).parent.mkdir(exist_ok=True)
        for kind in formats:
            write_whole((folder / name).with_suffix(f".{kind}"), b"a figure")


@pytest.fixture(autouse=True)
def sketched(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """
    Leave out what is on figures, but in tests marked ``figures``.

    Fixtures of a module draw them: they come before.
    """
    drawn = request.node.get_closest_marker("figures") or request.config.getoption("--deep")
    if not drawn:
        monkeypatch.setattr(results_folder, "_draw", _sketch)
