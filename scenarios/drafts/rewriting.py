"""Files of a scenario that is there already, made anew: all of them fit, or none is touched."""

import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path

from kankaku.railway.plan.scenario import MAIN_FILE, Scenario
from kankaku.scenarios.drafts.draft import DraftError
from kankaku.scenarios.drafts.provenance_notes import SOURCES_FILE
from kankaku.scenarios.loading.load import load

ANEW = "--force, to make it anew"
"""How files of a scenario may be replaced."""


def refuse_borrowed(folder: Path, key: str) -> None:
    """
    Refuse to write into a scenario that borrows what is to be written.

    Parameters
    ----------
    folder
        Of the scenario.
    key
        ``line`` or ``timetable``.

    Raises
    ------
    DraftError
        If it borrows it; the folder that lends it is named.
    """
    try:
        main = tomllib.loads((folder / MAIN_FILE).read_text("utf-8"))
    except (OSError, ValueError):
        return  # whoever loads it says what is wrong
    named = main.get(key, ".")
    if isinstance(named, str) and named != "." and (folder / named).resolve() != folder.resolve():
        where = f"{folder / MAIN_FILE}: {key}"
        raise DraftError(where, f"is borrowed from {named!r}", f"{folder / named} itself")


def rewritten(
    folder: Path, files: Mapping[str, str], remove: Iterable[str] = (), note: str = ""
) -> Scenario:
    """
    Write files, and keep the old ones if the scenario cannot be loaded with the new ones.

    Parameters
    ----------
    folder
        Of the scenario.
    files
        Text by name.
    remove
        Files that are to be gone.
    note
        Section that ``SOURCES.md`` gets; one of the same heading is replaced.

    Returns
    -------
    Scenario
        With the new files.

    Raises
    ------
    ScenarioError
        With everything that is wrong then; nothing was changed.
    DraftError
        If the folder cannot be written.
    """
    names = {*files, *remove, *([SOURCES_FILE] if note else ())}
    old = {name: _bytes(folder / name) for name in names}
    try:
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8", newline="\n")
        for name in remove:
            (folder / name).unlink(missing_ok=True)
        scenario = load(folder)
        if note:
            told = (old[SOURCES_FILE] or b"").decode("utf-8", "replace")
            (folder / SOURCES_FILE).write_text(_noted(told, note), encoding="utf-8", newline="\n")
    except BaseException as error:
        _restore(folder, old)
        if isinstance(error, OSError):
            raise DraftError(str(folder), f"cannot be written: {error.strerror}") from error
        raise
    return scenario


def _bytes(path: Path) -> bytes | None:
    return path.read_bytes() if path.is_file() else None


def _restore(folder: Path, old: Mapping[str, bytes | None]) -> None:
    for name, content in old.items():
        if content is None:
            (folder / name).unlink(missing_ok=True)
        elif _bytes(folder / name) != content:
            (folder / name).write_bytes(content)


def _noted(told: str, note: str) -> str:
    heading = note.partition("\n")[0]
    before, found, after = told.partition(f"{heading}\n")
    if found:
        rest = after.partition("\n## ")
        told = before.rstrip() + (f"\n\n## {rest[2]}" if rest[1] else "\n")
    return f"{told.rstrip()}\n\n{note.rstrip()}\n".lstrip()
