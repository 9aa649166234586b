"""A real browser that opens pages from files, and hears whatever goes wrong in it."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Dialog, Page, Request

WANTED = "KANKAKU_BROWSER"
"""With this in the environment a missing browser is a failure, not a reason to leave tests out."""
QUIET = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
"""Draws by software, and asks nothing of the network by itself."""
READY_MS = 120_000
"""Whoever takes longer hangs, also on a busy machine. [ms]"""


@dataclass
class Opened:
    """A page in the browser."""

    page: "Page"
    troubles: list[str] = field(default_factory=list)
    """What the console and the program complained of."""
    requests: list[str] = field(default_factory=list)
    """Whatever it asked for but itself."""

    def refuse(self, dialog: "Dialog") -> None:
        """Close a dialog that some program has opened."""
        self.troubles.append(dialog.message)
        dialog.dismiss()

    def hear(self, request: "Request") -> None:
        """Remember what the page asked for, but itself and what it made."""
        if not request.url.startswith("file:"):
            self.requests.append(request.url)

    def text(self, selector: str) -> str:
        """Return what an element shows."""
        return self.page.inner_text(selector)

    def ask(self, expression: str) -> Any:  # noqa: ANN401 - whatever it is worth
        """Return what a JavaScript expression is worth."""
        return self.page.evaluate(expression)


@contextmanager
def browser() -> Iterator["Browser"]:
    """Start Chromium; leave the test out where there is none and nobody insists."""
    chromium = shutil.which(os.environ.get(WANTED) or "chromium")
    if chromium is None:
        if WANTED in os.environ:
            pytest.fail(f"there is no browser {os.environ[WANTED]!r}")
        pytest.skip("there is no Chromium on this machine")
    from playwright.sync_api import sync_playwright  # noqa: PLC0415 - only where there is a browser

    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=chromium, args=list(QUIET))
        try:
            yield started
        finally:
            started.close()


@contextmanager
def opened(
    started: "Browser",
    file: Path,
    *,
    width: int = 1280,
    language: str = "en-GB",
    dark: bool = False,
) -> Iterator[Opened]:
    """Open a page and wait until it is ready."""
    context = started.new_context(
        viewport={"width": width, "height": 900},
        locale=language,
        color_scheme="dark" if dark else "light",
    )
    page = context.new_page()
    heard = Opened(page)
    page.on("console", lambda said: heard.troubles.append(said.text))
    page.on("pageerror", lambda error: heard.troubles.append(str(error)))
    page.on("dialog", heard.refuse)
    page.on("request", heard.hear)
    page.goto(file.resolve().as_uri())
    page.wait_for_selector("#page[data-ready]", timeout=READY_MS)
    try:
        yield heard
    finally:
        context.close()
