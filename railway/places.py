"""Names that are fit for a folder, and where a program may keep what it can work out again."""

import os
import stat
import tempfile
from pathlib import Path

CACHE = "KANKAKU_CACHE"
"""Environment variable that chooses the place."""
_LONGEST_NAME = 60
_TRIED_BYTES = 1 << 16
_FILE_ENDINGS = (".csv", ".json", ".lock", ".md", ".parquet", ".partial", ".png", ".svg", ".txt")
_TAKEN = frozenset({"failures", "earlier", "unfinished"})
_DEVICES = frozenset(
    {"aux", "con", "nul", "prn", *(f"{port}{n}" for port in ("com", "lpt") for n in range(1, 10))}
)


def name_problem(name: str) -> str:
    """
    Return why a name is not fit for a folder among results.

    Parameters
    ----------
    name
        Any text.

    Returns
    -------
    str
        Why not; empty if it is fit.
    """
    plain = name.casefold()
    if not name or not name.isprintable():
        return "is no name"
    if name.strip(".") == "" or "/" in name or "\\" in name:
        return "is a path, not a name"
    if name != name.strip(". "):
        return "begins or ends with a point or a space"
    if plain.endswith(_FILE_ENDINGS) or plain in _TAKEN:
        return "is the name of a file or folder of the results"
    if plain.partition(".")[0] in _DEVICES:
        return "is the name of a device on some systems"
    return f"has {len(name)} characters" if len(name) > _LONGEST_NAME else ""


def chosen_cache() -> Path | None:
    """Return the folder that the user has chosen; nothing if none was."""
    chosen = os.environ.get(CACHE)
    return Path(chosen) if chosen else None


def cache_folder() -> Path | None:
    """
    Return where things are kept that can be worked out again.

    Returns
    -------
    Path | None
        ``KANKAKU_CACHE``, else ``~/.cache/kankaku``, else a folder of the user's own beside other
        temporary files; nothing if none of them can be written.
    """
    chosen = chosen_cache()
    if chosen:
        return chosen
    try:
        own = Path.home() / ".cache" / "kankaku"
    except RuntimeError:
        own = None
    if own and is_writable(own):
        return own
    return _temporary()


def refuse_unwritable(folder: Path, what: str) -> None:
    """
    Raise an error that names a folder in which nothing can be written.

    Parameters
    ----------
    folder
        Any path; the folder is made if it is missing.
    what
        What it is for, as a user calls it.

    Raises
    ------
    OSError
        With the folder and what it is for as its file name.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(bytes(_TRIED_BYTES))
    except OSError as error:
        raise OSError(error.errno, error.strerror, f"{folder} ({what})") from error


def temporary_folder() -> Path:
    """
    Return where temporary files go.

    Raises
    ------
    OSError
        If they cannot be written anywhere.
    """
    try:
        return Path(tempfile.gettempdir())
    except FileNotFoundError as error:
        raise OSError(error.errno, error.strerror, "temporary files (TMPDIR)") from error


def is_writable(folder: Path) -> bool:
    """
    Return whether files can be written in a folder; it is made if it is missing.

    Parameters
    ----------
    folder
        Any path.

    Returns
    -------
    bool
        Whether they can.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"kankaku")
    except OSError:
        return False
    return True


def _temporary() -> Path | None:
    """Return a folder that nobody else can have put anything into."""
    try:
        folder = Path(tempfile.gettempdir()) / f"kankaku-cache-{os.getuid()}"
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except OSError:
        return None
    is_own = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid()
    is_closed = not found.st_mode & 0o077
    return folder if is_own and is_closed and is_writable(folder) else None


def plotting_folder() -> str:
    """Return where matplotlib may keep what it knows of fonts."""
    chosen = os.environ.get("MPLCONFIGDIR")
    if chosen:
        return chosen
    config = os.environ.get("XDG_CONFIG_HOME")
    try:
        own = (Path(config) if config else Path.home() / ".config") / "matplotlib"
    except RuntimeError:
        own = None
    cache = None if own and is_writable(own) else cache_folder()
    return str(cache / "matplotlib" if cache else own or "")
