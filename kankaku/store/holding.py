"""Who writes to a results folder: one command at a time, and nothing stays of one that died."""

import errno
import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from kankaku import interrupts
from kankaku.analysis.results import UNFINISHED
from kankaku.railway.errors import KankakuError

PARTS_HELD = ".parts"
"""Folder in a results folder for those who hold a part of it."""


class HeldError(KankakuError):
    """Somebody else writes to a results folder."""


@contextmanager
def held(folder: Path) -> Iterator[Path]:
    """
    Hold a results folder, and remove what commands left there that were killed.

    The lock lies on the folder itself and goes with the process, however that ends.

    Parameters
    ----------
    folder
        Results folder; made if missing, and removed again if it stays empty, with the places
        above it that were made for it.

    Yields
    ------
    Path
        Where temporary files may be kept, on the same disk; removed at the end.

    Raises
    ------
    HeldError
        If another command holds it.
    """
    made = [place for place in (folder, *folder.parents) if not place.exists()]
    lock = _locked(folder)
    try:
        yield _cleaned(folder)
    finally:
        with interrupts.undisturbed():
            shutil.rmtree(folder / UNFINISHED, ignore_errors=True)
            with suppress(OSError):
                for place in made or [folder]:
                    place.rmdir()
            os.close(lock)


@contextmanager
def held_part(folder: Path, part: str) -> Iterator[Path]:
    """
    Hold a part of a results folder, while others may hold other parts of it.

    Parameters
    ----------
    folder
        Results folder; made if missing, and removed again if it stays empty.
    part
        Name of the part.

    Yields
    ------
    Path
        As :func:`held`.

    Raises
    ------
    HeldError
        If another command holds the part, or the whole folder.
    """
    made = [place for place in (folder, *folder.parents) if not place.exists()]
    lock = _locked(folder, fcntl.LOCK_SH)
    try:
        with held(folder / PARTS_HELD / part) as work:
            yield work
    finally:
        for place in (folder / PARTS_HELD, *(made or [folder])):
            with suppress(OSError):
                place.rmdir()
        os.close(lock)


def _cleaned(folder: Path) -> Path:
    place = folder / UNFINISHED
    while True:
        # Workers of a command that was killed a moment ago may still remove the same files.
        shutil.rmtree(place, ignore_errors=True)
        with suppress(FileNotFoundError):
            place.mkdir(exist_ok=True)
            return Path(tempfile.mkdtemp(dir=place))


def _locked(folder: Path, how: int = fcntl.LOCK_EX) -> int:
    while True:
        with suppress(FileNotFoundError):
            folder.mkdir(parents=True, exist_ok=True)
            lock = os.open(folder, os.O_RDONLY)
            try:
                _lock(lock, folder, how)
                if os.path.samestat(os.fstat(lock), folder.stat()):
                    return lock
            except BaseException:
                os.close(lock)
                raise
            # Whoever held it has just removed it, empty.
            os.close(lock)


def _lock(lock: int, folder: Path, how: int) -> None:
    try:
        fcntl.flock(lock, how | fcntl.LOCK_NB)
    except BlockingIOError:
        msg = f"{folder}: another command is writing its results there; "
        msg += "allowed: wait until it has ended, or another --out"
        raise HeldError(msg) from None
    except OSError as error:
        # Some network disks know no locks, and must do without.
        if error.errno not in {errno.EBADF, errno.ENOLCK, errno.EOPNOTSUPP, errno.EINVAL}:
            raise
