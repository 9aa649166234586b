"""What the command ``report`` does, and how a page is opened where there is a desktop."""

import os
import sys
import webbrowser
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from kankaku.analysis.page.html import PAGE
from kankaku.commands.screen import answers, refusals
from kankaku.railway.errors import KankakuError
from kankaku.studies.page_sources import sources_of, write_page


def make_page(folders: Sequence[Path], out: Path | None, *, wanted: bool | None) -> int:
    """
    Make the page of saved results, and open it.

    Parameters
    ----------
    folders
        Results folders.
    out
        File of the page; in the results folder if None and there is one folder, else in the
        folder above the first one.
    wanted
        Open it; if None, where there is a desktop.

    Returns
    -------
    int
        How the command ends.
    """
    first = folders[0]
    file = out or (first if len(folders) == 1 else first.resolve().parent) / PAGE
    with refusals(", ".join(map(str, folders)), file.parent):
        sources = [source for folder in folders for source in sources_of(folder)]
        if not file.parent.is_dir():
            raise KankakuError(str(file.parent), "is no folder", "a folder that exists")
        write_page(file, sources)
    answers.print(f"Page: {file}", soft_wrap=True, markup=False)
    open_page(file, wanted=wanted)
    return 0


def open_page(place: Path, *, wanted: bool | None) -> None:
    """
    Open a page in the user's browser.

    Parameters
    ----------
    place
        The page, or the results folder that it is in; nothing happens if there is none.
    wanted
        Whether to; if None, where there is a desktop and somebody looks.
    """
    file = place / PAGE if place.is_dir() else place
    if not file.is_file() or not (has_desktop() if wanted is None else wanted):
        return
    # A page that cannot be opened is still there.
    with suppress(webbrowser.Error, OSError):
        webbrowser.open(file.resolve().as_uri())


def has_desktop() -> bool:
    """
    Return whether a browser could show something to somebody.

    Returns
    -------
    bool
        False in continuous integration, into a pipe, and without a screen.
    """
    if os.environ.get("CI") or not sys.stdout.isatty():
        return False
    screen = any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
    return screen or sys.platform in {"darwin", "win32"}
