"""Tasks for worker processes, which import next to nothing."""

import os
import signal
import tempfile
from collections.abc import Callable
from pathlib import Path


def failing_on_two(task: int, report: Callable[[float], None]) -> int:
    report(10.0 * task)
    if task == 2:
        msg = "two is\ntoo much"
        raise ValueError(msg)
    return task * task


def dying(marks: Path, lives: int, task: int, _: Callable[[float], None]) -> int:
    """Perform task 2 only after so many processes have died of it."""
    (Path(tempfile.mkdtemp()) / "litter").touch()
    if task == 2:
        died = len(list(marks.iterdir()))
        if died < lives:
            (marks / str(died)).touch()
            os.kill(os.getpid(), signal.SIGKILL)
    return task * task
