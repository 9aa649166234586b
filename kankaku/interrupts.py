"""
What Ctrl-C, a closed terminal and a kill do: they end a command once, whenever they come.

Imports next to nothing, because it must be there before everything else.
"""

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

EXIT_INTERRUPTED = 130
ENDING = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
WATCH_EVERY_S = 0.5
_at_work = threading.Event()
_come: list[int] = []
"""Signals that have come, in order."""


class _Swallowed:
    """Keeps quiet about interrupts that came where Python cannot raise them."""

    def __init__(self) -> None:
        self._usual = sys.unraisablehook

    def __call__(self, told: "sys.UnraisableHookArgs") -> None:
        """Tell of anything else; an interrupt is raised again at the next :func:`check`."""
        if not issubclass(told.exc_type, (KeyboardInterrupt, SystemExit)):
            self._usual(told)


def end_at_once() -> None:
    """Let every ending signal end the process with one sentence: nothing is under way yet."""
    _handle(_end)


def end_with_parent() -> None:
    """Let a worker that is still being read end when its parent does; see ``workers`` for later."""
    parent = os.getppid()

    def watch() -> None:
        while not _at_work.wait(WATCH_EVERY_S):
            if os.getppid() != parent:
                os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def at_work() -> None:
    """Let whoever knows more look after the parent, and a worker that is ended do so quietly."""
    _at_work.set()
    _keep_quiet()


def _keep_quiet() -> None:
    if not isinstance(sys.unraisablehook, _Swallowed):
        sys.unraisablehook = _Swallowed()


def end_as_by_ctrl_c() -> None:
    """Let a closed terminal or a kill interrupt like Ctrl-C; what is ignored stays ignored."""
    _keep_quiet()
    _handle(_interrupt)


def under_way() -> None:
    """From now on interrupt, where signals would have ended the process at once."""
    if any(signal.getsignal(number) is _end for number in ENDING):
        end_as_by_ctrl_c()


def over() -> None:
    """Let nothing interrupt any more: everything is done and told."""
    for number in ENDING:
        if signal.getsignal(number) is _interrupt:
            signal.signal(number, signal.SIG_IGN)


def check() -> None:
    """
    Raise an interrupt that was swallowed on its way.

    Raises
    ------
    KeyboardInterrupt
        If a signal has come that nobody has answered.
    """
    if _come:
        raise KeyboardInterrupt


def answered() -> None:
    """Forget the signals that have come: whoever calls has seen to them."""
    _come.clear()


@contextmanager
def undisturbed() -> Iterator[None]:
    """Hold signals back for a moment; they come when it is over."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _handle(handler: object) -> None:
    for number in ENDING:
        # nohup and many build machines ignore some of them, and mean it.
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, handler)  # type: ignore[arg-type]


def _end(_: int, __: FrameType | None) -> None:
    os.write(2, b"Interrupted: nothing was written.\n")
    os._exit(EXIT_INTERRUPTED)


def _interrupt(number: int, _: FrameType | None) -> None:
    _come.append(number)
    raise KeyboardInterrupt
