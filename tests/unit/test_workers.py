"""Tasks in processes of their own: one that fails or dies is one, and nothing is left of it."""

import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from kankaku.analysis import results
from kankaku.workers import UNFINISHED, Done, performed
from tests.cli.command import PATIENCE_S, PROJECT, heard_signals
from tests.unit.worker_tasks import dying, failing_on_two

READY = (
    "from kankaku import interrupts; interrupts.end_at_once(); print('ready', flush=True); input()"
)


def by_task(answers: list[Done[int, int]]) -> dict[int, Done[int, int]]:
    return {done.task: done for done in answers}


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_task_that_fails_is_named_with_its_reason_and_the_others_go_on(jobs: int) -> None:
    done = by_task(list(performed(failing_on_two, [1, 2, 3], jobs)))
    assert (done[1].result, done[2].result, done[3].result) == (1, None, 9)
    failure = done[2].failure
    assert failure is not None
    assert failure.sentence == "ValueError: two is too much"
    assert failure.progress == 20.0
    assert "failing_on_two" in failure.traceback


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_there_is_more_to_do_is_asked_once_everything_else_is_done(jobs: int) -> None:
    further = iter([[4, 5], [6], []])
    known: list[int] = []
    asked: list[list[int]] = []

    def more() -> list[int]:
        asked.append(sorted(known))
        return next(further)

    for done in performed(failing_on_two, [1, 3], jobs, more=more):
        assert done.failure is None
        known.append(done.task)
    assert asked == [[1, 3], [1, 3, 4, 5], [1, 3, 4, 5, 6]]


@pytest.mark.parametrize(("lives", "ends_well"), [(1, True), (2, False)])
def test_a_killed_process_costs_its_task_one_more_try(
    tmp_path: Path, lives: int, ends_well: bool
) -> None:
    marks, scratch = tmp_path / "marks", tmp_path / "scratch"
    marks.mkdir()
    scratch.mkdir()
    tasks = [1, 2, 3, 4]
    done = by_task(list(performed(partial(dying, marks, lives), tasks, 2, folder=scratch)))
    assert [done[task].result for task in (1, 3, 4)] == [1, 9, 16]
    assert done[2].killed == "its process was ended by SIGKILL"
    assert done[2].result == (4 if ends_well else None)
    failure = done[2].failure
    assert (failure is None) == ends_well
    assert failure is None or failure.sentence == "its process was ended by SIGKILL, twice"
    assert not list(scratch.iterdir())


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_while_everything_is_still_being_read_ends_in_one_sentence(number: int) -> None:
    with heard_signals():
        process = subprocess.Popen(  # noqa: S603
            [sys.executable, "-c", READY],
            cwd=PROJECT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
    with process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        process.send_signal(number)
        _, complaints = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert complaints == "Interrupted: nothing was written.\n"


def test_both_call_the_place_for_temporary_files_alike() -> None:
    assert results.UNFINISHED == UNFINISHED
