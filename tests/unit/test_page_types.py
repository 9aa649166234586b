"""The page's program has types, and they fit: TypeScript reads them in its comments."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from kankaku.analysis.page.html import BROWSER
from tests.browser.browsing import WANTED

PROJECT = Path(__file__).parents[2]
INSTALLED = PROJECT / "out/browser/node_modules/.bin/tsc"
"""Where continuous integration puts it."""


def test_the_types_of_the_page_fit() -> None:
    compiler = str(INSTALLED) if INSTALLED.exists() else shutil.which("tsc")
    if compiler is None:
        if WANTED in os.environ:
            pytest.fail("there is no TypeScript compiler")
        pytest.skip("there is no TypeScript compiler on this machine")
    done = subprocess.run(  # noqa: S603 - the project's own files
        [compiler, "-p", str(BROWSER / "tsconfig.json")],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout == ""
    assert done.returncode == 0
