"""Tasks in processes of their own: SUMO allows one simulation per process."""

import multiprocessing
import os
import shutil
import signal
import sys
import tempfile
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from itertools import count
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from pathlib import Path
from types import FrameType
from typing import Any, Generic, NoReturn, TypeAlias, TypeVar

from kankaku import interrupts
from kankaku.railway import first_use
from kankaku.railway.errors import sentence_of

TaskT = TypeVar("TaskT")
Result = TypeVar("Result")
Perform: TypeAlias = Callable[[TaskT, Callable[[float], None]], Result]

PATIENCE_S = 3.0
"""Workers that do not end by themselves so long after they were asked to are killed. [s]"""
GRACE_S = 1.0
"""So long a worker without a parent has for ending by itself. [s]"""
UNFINISHED = ".unfinished"
"""Folder for temporary files in a results folder, as ``analysis`` calls it, which takes long to
import."""
POLL_S = 0.5
"""How often to look whether a signal has come that Python could not raise. [s]"""


@dataclass(frozen=True, slots=True)
class Failure:
    """Why a task has no result."""

    sentence: str
    traceback: str = ""
    progress: float | None = None
    """What the task reported last; None if nothing."""
    errno: int | None = None
    """Of an error of the system."""


@dataclass(frozen=True, slots=True)
class Done(Generic[TaskT, Result]):
    """A task with its result or its failure."""

    task: TaskT
    result: Result | None
    failure: Failure | None = None
    killed: str = ""
    """How the process of an earlier try ended; empty if there was none."""

    def value(self) -> Result:
        """
        Return the result.

        Returns
        -------
        Result
            What ``perform`` returned.

        Raises
        ------
        RuntimeError
            If there is none.
        """
        if self.result is None:
            failure = self.failure or Failure("no result")
            msg = f"{self.task}: {failure.sentence}\n{failure.traceback}"
            raise RuntimeError(msg)
        return self.result


def attempt(action: Callable[[], Result]) -> tuple[Result | None, Failure | None]:
    """
    Do something that may fail in any way.

    Parameters
    ----------
    action
        What to do.

    Returns
    -------
    tuple[Result | None, Failure | None]
        What it returned, or why it did not; an interrupt is no failure.
    """
    try:
        return action(), None
    except Exception as error:  # noqa: BLE001 - one failure must not take anything else with it
        errno = error.errno if isinstance(error, OSError) else None
        told = "".join(traceback.format_exception(error))
        return None, Failure(sentence_of(error), told, errno=errno)


def performed(
    perform: Perform[TaskT, Result],
    tasks: Sequence[TaskT],
    jobs: int,
    tell: Callable[[TaskT, float], None] = lambda *_: None,
    folder: Path | None = None,
    more: Callable[[], Sequence[TaskT]] | None = None,
) -> Generator[Done[TaskT, Result]]:
    """
    Perform tasks and yield what became of them as they come.

    A task that fails, or whose process is killed, is one task that failed: the others go on. A
    task whose process is killed is begun once more.

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
        Where temporary files are kept; they are removed. The system's place if None.
    more
        Called once everything is done that there was to do; returns what else there is, until
        there is nothing.

    Yields
    ------
    Done
        In order of completion. If the caller gives up, the workers are ended.
    """
    with _scratch(folder) as scratch:
        if jobs == 1 or (len(tasks) <= 1 and more is None):
            waiting = deque(tasks)
            while waiting or (more and (waiting := deque(more()))):
                yield _in_this_process(perform, waiting.popleft(), tell, scratch)
        else:
            yield from _in_processes(perform, tasks, jobs, tell, (scratch, more or tuple))


@contextmanager
def _scratch(folder: Path | None) -> Iterator[Path]:
    scratch = Path(tempfile.mkdtemp(prefix="kankaku-", dir=folder))
    try:
        yield scratch
    finally:
        with interrupts.undisturbed():
            shutil.rmtree(scratch, ignore_errors=True)


def _in_this_process(
    perform: Perform[TaskT, Result],
    task: TaskT,
    tell: Callable[[TaskT, float], None],
    scratch: Path,
) -> Done[TaskT, Result]:
    reported: list[float] = []

    def report(progress: float) -> None:
        interrupts.check()
        reported[:] = [progress]
        tell(task, progress)

    usual, tempfile.tempdir = tempfile.tempdir, str(scratch)
    try:
        result, failure = attempt(lambda: perform(task, report))
    finally:
        tempfile.tempdir = usual
    if failure is not None:
        # C code may have made another error of an interrupt.
        interrupts.check()
    return _done(task, result, failure, reported[-1] if reported else None)


def _done(
    task: TaskT,
    result: Result | None,
    failure: Failure | None,
    progress: float | None,
    killed: str = "",
) -> Done[TaskT, Result]:
    if failure is not None:
        failure = Failure(failure.sentence, failure.traceback, progress, failure.errno)
    return Done(task, result, failure, killed)


_NUMBERS = count(1)


class _Worker:
    """A process, what it does, and where it keeps its files."""

    def __init__(self, perform: Perform[Any, Any], scratch: Path) -> None:
        # Forking a process in which SUMO has run is not safe.
        context = multiprocessing.get_context("spawn")
        # Made by the process once it looks after itself: who is ended before leaves nothing.
        self.folder = scratch / f"worker-{next(_NUMBERS)}"
        self.connection, self._theirs = context.Pipe()
        self._process = context.Process(
            target=_work, args=(self._theirs, perform, self.folder), daemon=True
        )
        self.task: Any = None
        """What it does; None while it does nothing."""
        self.progress: float | None = None

    def start(self) -> None:
        """Start the process."""
        self._process.start()
        self._theirs.close()

    def begin(self, task: object) -> None:
        """Give it something to do; if it is dead, that is seen when it is listened to."""
        self.task, self.progress = task, None
        with suppress(OSError):
            self.connection.send(task)

    def listen(self) -> tuple[bool, Any]:
        """Return whether it is still there, and what it says: a report, a word, or a pair."""
        try:
            return True, self.connection.recv()
        except (EOFError, OSError):
            return False, None

    def end_of(self) -> str:
        """Return how the process ended."""
        self._process.join(PATIENCE_S)
        status = self._process.exitcode
        if status is not None and status < 0:
            with suppress(ValueError):
                return f"its process was ended by {signal.Signals(-status).name}"
        return f"its process ended by itself with status {status}"

    def ask_to_end(self) -> None:
        """Let it end by itself."""
        if self.task is not None:
            self._process.terminate()
            return
        with suppress(OSError):
            self.connection.send(None)

    def remove(self, patience_s: float = 0.0) -> None:
        """End the process if it does not end by itself in time, and remove its files."""
        self._process.join(patience_s)
        if self._process.is_alive():
            self._process.kill()
        self._process.join()
        self.connection.close()
        shutil.rmtree(self.folder, ignore_errors=True)


def _in_processes(
    perform: Perform[TaskT, Result],
    tasks: Sequence[TaskT],
    jobs: int,
    tell: Callable[[TaskT, float], None],
    place: tuple[Path, Callable[[], Sequence[TaskT]]],
) -> Generator[Done[TaskT, Result]]:
    scratch, more = place
    waiting = deque(tasks)
    killed: dict[TaskT, str] = {}
    workers: list[_Worker] = []
    resource_tracker.ensure_running()
    try:
        while (
            waiting
            or any(worker.task is not None for worker in workers)
            or (waiting := deque(more()))
        ):
            interrupts.check()
            _occupy(workers, waiting, jobs, partial(_Worker, perform, scratch))
            busy = [worker for worker in workers if worker.task is not None]
            heard = wait([worker.connection for worker in busy], POLL_S)
            for worker in [worker for worker in busy if worker.connection in heard]:
                task, (alive, told) = worker.task, worker.listen()
                if alive and isinstance(told, float):
                    worker.progress = told
                    tell(task, told)
                elif alive and isinstance(told, str):
                    first_use.tell(told)
                elif alive:
                    worker.task = None
                    result, failure = told
                    yield _done(task, result, failure, worker.progress, killed.get(task, ""))
                else:
                    end = worker.end_of()
                    worker.remove()
                    workers.remove(worker)
                    if task in killed:
                        failure = Failure(f"{end}, twice")
                        yield _done(task, None, failure, worker.progress, killed[task])
                    else:
                        killed[task] = end
                        waiting.appendleft(task)
    finally:
        with interrupts.undisturbed():
            _end(workers)


def _occupy(
    workers: list[_Worker], waiting: deque[TaskT], jobs: int, make: Callable[[], _Worker]
) -> None:
    """Give everybody something to do, and start whom that takes."""
    idle = [worker for worker in workers if worker.task is None]
    while waiting and (idle or len(workers) < jobs):
        if not idle:
            # A process that is still being started must not answer Ctrl-C with a traceback: it
            # inherits that signals are held back, and says itself what it wants of them.
            with interrupts.undisturbed():
                worker = make()
                worker.start()
                workers.append(worker)
            idle = [workers[-1]]
        idle.pop().begin(waiting.popleft())


def _end(workers: Sequence[_Worker]) -> None:
    for worker in workers:
        worker.ask_to_end()
    until_s = time.monotonic() + PATIENCE_S
    for worker in workers:
        worker.remove(max(until_s - time.monotonic(), 0.0))


def _work(connection: Connection, perform: Perform[Any, Any], folder: Path) -> None:
    """Do what comes through a pipe until there is no more, or nobody who wants it."""
    interrupts.at_work()
    try:
        folder.mkdir()
    except FileNotFoundError:
        # The command was killed, and everybody else has left already.
        return
    threading.Thread(target=_watch, args=(folder,), daemon=True).start()
    # The parent decides what Ctrl-C and a closed terminal mean.
    for number in interrupts.ENDING:
        signal.signal(number, _leave if number == signal.SIGTERM else signal.SIG_IGN)
    tempfile.tempdir = str(folder)
    first_use.hear(connection.send)
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, interrupts.ENDING)
        try:
            while (task := connection.recv()) is not None:
                told = attempt(partial(perform, task, partial(_report, connection)))
                if _left:
                    # C code may have made another error of it.
                    break
                _, failure = attempt(partial(connection.send, told))
                if failure is not None:
                    connection.send((None, failure))
        except (EOFError, OSError):
            # The pipes of a parent close before it is gone.
            parent = multiprocessing.parent_process()
            if parent is not None:
                parent.join(GRACE_S)
    finally:
        # Told twice to end, it would leave half of its files.
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        _tidy(folder)


def _report(connection: Connection, progress: float) -> None:
    connection.send(float(progress))


_left: list[int] = []
"""The signal that this worker has been told to end by."""


def _leave(number: int, _: FrameType | None) -> NoReturn:
    _left.append(number)
    # Ends a run wherever it is; what it keeps in folders of its own is removed on the way.
    sys.exit(128 + signal.SIGTERM)


def _watch(folder: Path) -> None:
    """End this process when its parent has ended, however that came."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os.kill(os.getpid(), signal.SIGTERM)
        # A run that is deep in SUMO does not hear the signal soon.
        time.sleep(GRACE_S)
        _tidy(folder)
        os._exit(1)


_tidying = threading.Lock()
"""Whoever ends this process waits for whoever tidies up after it."""


def _tidy(folder: Path) -> None:
    """Remove what a parent that is gone cannot remove any more."""
    parent = multiprocessing.parent_process()
    if parent is None or parent.is_alive():
        return
    with _tidying:
        shutil.rmtree(folder, ignore_errors=True)
        # Whoever is the last one finds the places above empty; those of others are left alone.
        above = [place.name for place in folder.parents]
        emptied = 2 + above.index(UNFINISHED) if UNFINISHED in above else 1
        with suppress(OSError):
            for place in list(folder.parents)[:emptied]:
                place.rmdir()
