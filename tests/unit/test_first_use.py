"""Who waits for compilation is told, once, and only if it takes long."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from kankaku.railway import first_use

SLOW = """
import sys
from kankaku.railway import first_use
first_use.LONG_S = {long_s}
first_use.hear(first_use.say_on_stderr)
from kankaku.railway.compiled import count_up_to
import numpy as np
print(count_up_to(np.arange(4.0), 1.5))
"""


@pytest.fixture
def heard() -> list[str]:
    sentences: list[str] = []
    first_use.hear(sentences.append)
    return sentences


class Clock:
    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def test_one_sentence_once_compilation_has_taken_long(heard: list[str]) -> None:
    clock = Clock()
    compilations = first_use.Compilations(clock)
    for _ in range(4):
        compilations.begin()
        clock.now_s += 0.3
        compilations.end()
        clock.now_s += 60.0
    assert heard == [], "1.2 s in all, but nothing is being compiled any more"
    compilations.begin()
    assert heard == [first_use.SENTENCE]
    clock.now_s += 5.0
    compilations.begin()
    assert heard == [first_use.SENTENCE]


def test_functions_within_a_function_count_once(heard: list[str]) -> None:
    clock = Clock()
    compilations = first_use.Compilations(clock)
    compilations.begin()
    for _ in range(3):
        compilations.begin()
        clock.now_s += 0.2
        compilations.end()
    compilations.end()
    compilations.begin()
    assert heard == [], "0.6 s"
    clock.now_s += 0.5
    compilations.begin()
    assert heard == [first_use.SENTENCE], "while the outer one is still under way"


def test_only_the_first_sentence_is_heard(heard: list[str]) -> None:
    first_use.tell("of a worker")
    first_use.tell("of another worker")
    assert heard == ["of a worker"]


@pytest.mark.parametrize(("long_s", "told"), [(-1.0, f"{first_use.SENTENCE}\n"), (1e9, "")])
def test_what_is_really_compiled_is_told_of_and_what_is_kept_is_not(
    tmp_path: Path, long_s: float, told: str
) -> None:
    command = [sys.executable, "-c", SLOW.format(long_s=long_s)]
    environment = {
        **os.environ,
        "NUMBA_CACHE_DIR": str(tmp_path),
        "PYTHONPATH": str(Path(__file__).parents[2]),
    }
    for expected in (told, ""):
        done = subprocess.run(  # noqa: S603
            command, env=environment, capture_output=True, text=True, check=False
        )
        assert (done.stdout, done.stderr) == ("2\n", expected)
