"""What is written down about runs that failed, in the results folder."""

from contextlib import suppress
from functools import partial
from pathlib import Path

from kankaku.analysis.results import FAILURES
from kankaku.analysis.tables.columns import write_whole
from kankaku.workers import Failure, attempt

TROUBLE = "publishing"
"""What went wrong after all runs; files of runs have longer names."""


def note(folder: Path, name: str, sentence: str, traceback: str) -> Path:
    """
    Write down why something failed.

    Parameters
    ----------
    folder
        Results folder.
    name
        Of the file, without its ending: which run.
    sentence
        Why, for the first line.
    traceback
        How, for those who mend it.

    Returns
    -------
    Path
        The file.
    """
    file = folder / FAILURES / f"{name}.txt"
    file.parent.mkdir(exist_ok=True)
    write_whole(file, f"{sentence}\n\n{traceback}")
    return file


def noted_sentence(folder: Path, name: str, sentence: str, failure: Failure) -> str:
    """
    Write down why something failed, if that is possible.

    Parameters
    ----------
    folder
        Results folder.
    name
        Of the file, without its ending.
    sentence
        Why.
    failure
        What happened.

    Returns
    -------
    str
        The sentence, and where the traceback is.
    """
    file, _ = attempt(partial(note, folder, name, sentence, failure.traceback))
    return f"{sentence} ({file})" if file else sentence


def forget(folder: Path, name: str) -> None:
    """
    Remove the note of a run that has succeeded since.

    Parameters
    ----------
    folder
        Results folder.
    name
        Of its file, without the ending.
    """
    file = folder / FAILURES / f"{name}.txt"
    file.unlink(missing_ok=True)
    with suppress(OSError):
        file.parent.rmdir()


def noted(folder: Path) -> list[str]:
    """
    Return what is written down about runs that failed.

    Parameters
    ----------
    folder
        Results folder.

    Returns
    -------
    list[str]
        A sentence each.
    """
    files = [file for file in sorted((folder / FAILURES).glob("*.txt")) if file.stem != TROUBLE]
    return [file.read_text("utf-8").partition("\n")[0] for file in files]


def clear(folder: Path) -> None:
    """
    Remove everything that is written down.

    Parameters
    ----------
    folder
        Results folder.
    """
    for file in (folder / FAILURES).glob("*.txt"):
        file.unlink(missing_ok=True)
    with suppress(OSError):
        (folder / FAILURES).rmdir()
