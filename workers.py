"""Tasks in processes of their own: SUMO allows one simulation per process."""

import multiprocessing
import multiprocessing.queues
import signal
import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from contextlib import suppress
from functools import partial
from pathlib import Path
from queue import Empty
from typing import Any, TypeAlias, TypeVar

TaskT = TypeVar("TaskT")
Result = TypeVar("Result")
Perform: TypeAlias = Callable[[TaskT, Callable[[float], None]], Result]
Reports: TypeAlias = "multiprocessing.queues.Queue[tuple[Any, float]]"

_reports: list[Reports] = []
"""The queue of a worker process; empty in the parent."""


def performed(
    perform: Perform[TaskT, Result],
    tasks: Sequence[TaskT],
    jobs: int,
    tell: Callable[[TaskT, float], None] = lambda *_: None,
    folder: Path | None = None,
) -> Iterator[Result]:
    """
    Perform tasks and yield results as they come.

    Parameters
    ----------
    perform
        Called with a task and a function that takes reports of progress.
    tasks
        What to do; tasks, ``perform`` and results cross processes.
    jobs
        Processes to use; with one, or for one task, everything is done in this process.
    tell
        Called here with a task and what it reported.
    folder
        Where workers keep temporary files; they are removed. The system's place if None.

    Yields
    ------
    Result
        Results in order of completion. If the caller gives up, the workers are ended.
    """
    if jobs == 1 or len(tasks) <= 1:
        for task in tasks:
            yield perform(task, partial(tell, task))
    else:
        with tempfile.TemporaryDirectory(prefix="kankaku-", dir=folder) as scratch:
            yield from _in_processes(perform, tasks, jobs, tell, Path(scratch))


def _in_processes(
    perform: Perform[TaskT, Result],
    tasks: Sequence[TaskT],
    jobs: int,
    tell: Callable[[TaskT, float], None],
    scratch: Path,
) -> Iterator[Result]:
    # Forking a process in which SUMO has run is not safe.
    context = multiprocessing.get_context("spawn")
    reports: Reports = context.Queue()
    arguments = (reports, scratch)
    with ProcessPoolExecutor(min(jobs, len(tasks)), context, _begin, arguments) as pool:
        waiting = {pool.submit(_work, perform, task) for task in tasks}
        try:
            while waiting:
                done, waiting = wait(waiting, timeout=0.1, return_when=FIRST_COMPLETED)
                for task, progress in _drain(reports):
                    tell(task, progress)
                for future in done:
                    yield future.result()
        finally:
            if waiting:
                pool.shutdown(wait=False, cancel_futures=True)
                for process in multiprocessing.active_children():
                    process.terminate()


def _drain(reports: Reports) -> Iterator[tuple[Any, float]]:
    with suppress(Empty):
        while True:
            yield reports.get_nowait()


def _begin(reports: Reports, scratch: Path) -> None:
    # The parent decides what Ctrl-C means, and removes what an ended process leaves behind.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    tempfile.tempdir = str(scratch)
    _reports.append(reports)


def _work(perform: Perform[TaskT, Result], task: TaskT) -> Result:
    return perform(task, lambda progress: _reports[0].put((task, progress)))
