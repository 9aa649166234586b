"""
What is used for the first time is compiled, which takes a while: whoever waits is told.

Nothing is imported here, so that a command may ask to be told before it needs anything compiled.
"""

import sys
import time
from collections.abc import Callable
from typing import TypeAlias

Say: TypeAlias = Callable[[str], None]

LONG_S = 1.0
"""Compilation that takes no longer in all is not worth a word. [s]"""
SENTENCE = "Compiling what this computer has not run before: some seconds, and only this once."

_hearers: list[Say] = []


def hear(say: Say) -> None:
    """
    Ask to be told, once, that something is being compiled.

    Parameters
    ----------
    say
        Called with a sentence; whoever asked before is told no more.
    """
    _hearers[:] = [say]


def say_on_stderr(sentence: str) -> None:
    """
    Write a sentence where progress is shown.

    Parameters
    ----------
    sentence
        The sentence.
    """
    sys.stderr.write(f"{sentence}\n")
    sys.stderr.flush()


def tell(sentence: str = SENTENCE) -> None:
    """
    Tell who has asked, unless that was done before.

    Parameters
    ----------
    sentence
        What to tell.
    """
    if _hearers:
        _hearers.pop()(sentence)


class Compilations:
    """
    Adds up how long is compiled, and tells of it once that is long.

    Parameters
    ----------
    clock
        The time. [s]
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._under_way: list[float] = []
        """When each compilation began that waits for another one, and that one. [s]"""
        self._spent_s = 0.0

    def begin(self) -> None:
        """Take note that a function begins to be compiled."""
        now_s = self._clock()
        self._under_way.append(now_s)
        if self._spent_s + now_s - self._under_way[0] > LONG_S:
            tell()

    def end(self) -> None:
        """Take note that it has been."""
        begun_s = self._under_way.pop()
        if not self._under_way:
            self._spent_s += self._clock() - begun_s
