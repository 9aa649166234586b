"""
The runs of an ensemble on workers of Dask, here or on a cluster; imports an optional package.

A worker is one process with one thread, because SUMO holds one simulation in each process. Results
come back as files in memory, so that nobody needs a disk in common. The run of a worker that dies
is done again by another one.
"""

import importlib.util
import signal
import tempfile
from collections.abc import Generator, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

import dask.config
from distributed import Client, LocalCluster, WorkerPlugin, as_completed, get_worker

from kankaku import interrupts
from kankaku.store.dataset_store import EnsembleTask, RunFiles
from kankaku.store.ensemble_plan import EnsembleError
from kankaku.studies.ensemble_running import More, RunDone, Workers
from kankaku.workers import Done, Failure, attempt

LOCAL = "local"
PLUGIN = "kankaku"
CONNECT_S = 20.0
"""So long a scheduler has for answering. [s]"""
HOW = "dask worker ADDRESS --nworkers N --nthreads 1"


class Carrier(WorkerPlugin):  # type: ignore[misc] # ships no types
    """Brings what performs the runs to every worker, also to those that come later."""

    def __init__(self, perform: Any, *, own: bool) -> None:  # noqa: ANN401 - crosses processes
        self.perform = perform
        self._own = own

    def setup(self, worker: Any) -> None:  # noqa: ANN401 - ships no types
        """Keep temporary files where they go with the worker, whatever ends it."""
        tempfile.tempdir = worker.local_directory
        if self._own:
            # The parent decides what Ctrl-C means.
            signal.signal(signal.SIGINT, signal.SIG_IGN)


def _perform(task: EnsembleTask) -> tuple[RunFiles | None, Failure | None]:
    perform = get_worker().plugins[PLUGIN].perform
    return attempt(partial(perform, task, lambda _: None))


def on_dask(where: str, workers: Workers, more: More) -> Generator[RunDone]:
    """
    Perform runs on workers of Dask.

    Parameters
    ----------
    where
        Address of a scheduler, or ``local`` for workers of this machine.
    workers
        What performs the runs, and how many workers there are if they are started here.
    more
        What there is to do.

    Yields
    ------
    RunDone
        In order of completion.

    Raises
    ------
    EnsembleError
        If there is no such scheduler, its workers have several threads, or it is gone.
    """
    with _connected(where, workers) as client:
        _refuse_threads(client)
        client.register_plugin(Carrier(workers.perform, own=where == LOCAL), name=PLUGIN)
        while tasks := more():
            futures = {client.submit(_perform, task, pure=False): task for task in tasks}
            try:
                for future in as_completed(list(futures), loop=client.loop):
                    interrupts.check()
                    yield _done(futures.pop(future), future)
            finally:
                client.cancel(list(futures))


def _done(task: EnsembleTask, future: Any) -> RunDone:  # noqa: ANN401 - ships no types
    if future.status in {"cancelled", "lost"}:
        where = "--scheduler"
        problem = "the scheduler is gone"
        raise EnsembleError(where, problem, "the same command again; what was finished is kept")
    answer, failure = attempt(future.result)
    result, own = answer if answer is not None else (None, None)
    return Done(task, result, failure or own)


@contextmanager
def _connected(where: str, workers: Workers) -> Iterator[Any]:
    with _cluster(where, workers) as address:
        try:
            client = Client(address, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError) as error:
            option = "--scheduler"
            problem = f"nobody answers at {where}"
            allowed = "tcp://HOST:PORT of a running dask scheduler, or local"
            raise EnsembleError(option, problem, allowed) from error
        try:
            if importlib.util.find_spec("bokeh") and client.dashboard_link:
                workers.say(f"Dashboard: {client.dashboard_link}")
            if not client.scheduler_info()["workers"]:
                workers.say(f"The scheduler has no workers yet; start some: {HOW}")
            yield client
        finally:
            with suppress(Exception):
                client.close()


@contextmanager
def _cluster(where: str, workers: Workers) -> Iterator[Any]:
    if where != LOCAL:
        yield where
        return
    # Somebody of Dask keeps something in the place of the system, whatever it is told.
    own = dask.config.set({"temporary-directory": str(workers.work)})
    with (
        own,
        LocalCluster(
            n_workers=workers.jobs,
            threads_per_worker=1,
            processes=True,
            memory_limit=0,
            local_directory=str(workers.work),
            dashboard_address=":0",
            silence_logs="CRITICAL",
        ) as cluster,
    ):
        yield cluster


def _refuse_threads(client: Any) -> None:  # noqa: ANN401 - ships no types
    found = client.scheduler_info()["workers"].values()
    many = [worker for worker in found if worker["nthreads"] != 1]
    if many:
        where, problem = "--scheduler", f"{len(many)} workers have more than one thread"
        raise EnsembleError(where, problem, f"SUMO needs one each: {HOW}")
