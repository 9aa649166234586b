"""What the command ``new-controller`` shows: a package of one's own, and what to do with it."""

import re
import shlex
from pathlib import Path

from rich.markup import escape

from kankaku.commands.controller_package import module_of, package_files
from kankaku.commands.screen import answers, complain
from kankaku.railway.errors import KankakuError
from kankaku.scenarios.drafts.draft import write_files


def make_package(folder: Path, name: str, *, force: bool) -> int:
    """
    Write a package with one operation.

    Parameters
    ----------
    folder
        Where it is written; made if missing.
    name
        Of the operation; empty for that of the folder.
    force
        Whether files may be replaced.

    Returns
    -------
    int
        How the command ends.
    """
    chosen = name or name_of(folder)
    try:
        files = package_files(chosen)
        write_files(files, folder, force=force)
    except KankakuError as error:
        complain(f"{folder} cannot be made", error.sentences)
    place = escape(str(folder))
    written = f"Operation {chosen!r}: {', '.join(files)} in {place}."
    following = (
        f"Write your own into {escape(str(folder / module_of(chosen)))}.py. It runs as it is, too:",
        f"  pip install --no-deps --editable {escape(shlex.quote(str(folder)))}",
        f"  kankaku check-controller {chosen}",
        f"  kankaku run rush_hour --controller close_up --controller moving_block+{chosen}",
        f"  kankaku benchmark {chosen}",
    )
    for sentence in (written, *following):
        answers.print(sentence, soft_wrap=True, highlight=False)
    return 0


def name_of(folder: Path) -> str:
    """
    Return what an operation in a folder is called if nobody says it.

    Parameters
    ----------
    folder
        Where its package is written.

    Returns
    -------
    str
        The folder's name in small letters, with _ for what no name has.
    """
    told = re.sub(r"[^a-z0-9]+", "_", folder.resolve().name.lower()).strip("_")
    return told.removeprefix("kankaku_")
