"""Bytes of files that may not be what their names promise."""

import os
import stat
from pathlib import Path

_KINDS = (
    (stat.S_ISDIR, "is a folder, not a file"),
    (stat.S_ISFIFO, "is a pipe, not a file"),
    (stat.S_ISCHR, "is a device, not a file"),
    (stat.S_ISBLK, "is a device, not a file"),
    (stat.S_ISSOCK, "is a socket, not a file"),
)
# A pipe that nobody writes into would hold an ordinary open for ever.
_FLAGS = os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | os.O_NOCTTY


class UnreadableError(Exception):
    """There is something of that name, and it cannot be read; says why and what is allowed."""

    def __init__(self, problem: str, allowed: str = "a readable file") -> None:
        super().__init__(problem)
        self.problem = problem
        self.allowed = allowed


def read_whole(path: Path, most_bytes: int) -> bytes | None:
    """
    Read a file, and nothing but a file.

    Parameters
    ----------
    path
        The file.
    most_bytes
        Longer ones are not read. [-]

    Returns
    -------
    bytes | None
        Its content; nothing if there is nothing of that name.

    Raises
    ------
    UnreadableError
        If it is a link to nothing, no ordinary file, too long or not to be read.
    """
    try:
        _refuse(os.stat(path), most_bytes)  # noqa: PTH116 - one call also for links
        with os.fdopen(os.open(path, _FLAGS), "rb") as file:
            _refuse(os.fstat(file.fileno()), most_bytes)
            content = file.read(most_bytes + 1)
    except FileNotFoundError:
        if path.is_symlink():
            msg = "is a link to nothing"
            raise UnreadableError(msg) from None
        return None
    except OSError as error:
        msg = f"cannot be read: {error.strerror}"
        raise UnreadableError(msg) from error
    if len(content) > most_bytes:
        raise _too_long(most_bytes)
    return content


def _refuse(found: os.stat_result, most_bytes: int) -> None:
    for is_kind, problem in _KINDS:
        if is_kind(found.st_mode):
            raise UnreadableError(problem)
    if found.st_size > most_bytes:
        raise _too_long(most_bytes)


def _too_long(most_bytes: int) -> UnreadableError:
    allowed = f"up to {most_bytes / 1e6:g} million bytes"
    return UnreadableError("is too long to be read", allowed)
