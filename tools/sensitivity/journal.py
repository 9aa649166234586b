"""What has been run already: a line of JSON per finished task, so that a kill loses nothing."""

import json
from pathlib import Path
from typing import TypeAlias

from kankaku.analysis.tables.columns import write_whole
from kankaku.store.json_lines import append_line, whole_lines

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
        whole = whole_lines(file)
        for line in whole:
            entry = json.loads(line)
            self._known[entry["key"]] = entry["measured"]
        if file.exists():
            # Without the half line of who was killed.
            write_whole(file, b"".join(whole))

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
        append_line(self._file, {"key": key, "measured": measured})
        self._known[key] = measured
