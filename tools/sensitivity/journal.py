"""What has been run already: a line of JSON per finished task, so that a kill loses nothing."""

import json
import os
from pathlib import Path
from typing import TypeAlias

Measured: TypeAlias = dict[str, dict[str, float]]
"""Values by controller and column of the table ``summary``."""


class Journal:
    """
    Finished tasks by their keys, in a file that only grows.

    Parameters
    ----------
    file
        The file; it need not exist.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        self._known: dict[str, Measured] = {}
        content = file.read_bytes() if file.exists() else b""
        *whole, torn = content.split(b"\n")
        for line in whole:
            entry = json.loads(line)
            self._known[entry["key"]] = entry["measured"]
        if torn:
            # Whoever wrote it was killed.
            with file.open("r+b") as half:
                half.truncate(len(content) - len(torn))

    def __contains__(self, key: str) -> bool:
        return key in self._known

    def __getitem__(self, key: str) -> Measured:
        return self._known[key]

    def note(self, key: str, measured: Measured) -> None:
        """
        Keep what a task has found; it is on the disk when this returns.

        Parameters
        ----------
        key
            What the task depends on.
        measured
            What it found.
        """
        line = json.dumps({"key": key, "measured": measured}, sort_keys=True) + "\n"
        with self._file.open("a", encoding="utf-8") as file:
            file.write(line)
            file.flush()
            os.fsync(file.fileno())
        self._known[key] = measured
