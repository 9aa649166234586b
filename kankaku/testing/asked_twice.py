"""Stands between the loop and a controller: asks everything twice, and looks at the answers."""

from collections.abc import Callable, Iterator
from statistics import median
from time import perf_counter
from typing import Any, NamedTuple, TypeVar

import numpy as np

from kankaku.railway.errors import KankakuError, sentence_of
from kankaku.railway.step.control import Controller, Operation, Protection, Supervision
from kankaku.railway.step.state import (
    NO_REASON,
    Advice,
    Authority,
    LineState,
    Orders,
    RadioPermission,
)
from kankaku.testing.alike import frozen, same

KEPT_EVERY = 97
"""Questions are kept so often, to be asked once more of a controller that has heard no other."""
ORDERS_KEPT_EVERY = 7
"""The same of supervision, which is asked at events only."""

TIMELY = "answers in time"
SLOW_S = 0.01
"""A layer that takes longer for its usual answer is slow: a morning of 90 minutes in steps of
half a second would take minutes by it alone. [s]"""
TIMED = 30
"""Answers that are timed together; their median counts, whatever is compiled in the first. [-]"""

Answer = TypeVar("Answer", Authority, Advice, Orders)


class TooSlowError(KankakuError):
    """A layer that nobody waits for."""


class Answered(NamedTuple):
    """What a controller made of one state."""

    state: LineState
    authority: Authority
    advice: Advice


class KeptQuestion(NamedTuple):
    """A question as it was asked, and what was answered."""

    what: str
    question: tuple[Any, ...]
    answer: Any

    def asked_of(self, controller: Controller) -> Any:  # noqa: ANN401 - whatever is answered
        """Return what another controller answers."""
        if self.what == "authorise":
            return controller.protection.authorise(*self.question)
        if self.what == "supervise" and controller.supervision:
            return controller.supervision.supervise(*self.question)
        return controller.operation.advise(*self.question)


class AskedTwice:
    """All layers that decide in one, which notes what is wrong with what they answer."""

    def __init__(self, controller: Controller, places: int) -> None:
        self._protection: Protection[Any] = controller.protection
        self._operation: Operation[Any] = controller.operation
        self._supervision: Supervision[Any] | None = controller.supervision
        self._places = places
        self.reasons = self._operation.reasons
        self.said: list[Answered] = []
        self.kept: list[KeptQuestion] = []
        self._supervised = 0
        self._took_s: dict[str, list[float]] = {}
        self.problems: dict[str, str] = {}
        """The first thing that is wrong, by the name of the check."""

    def initial(self) -> tuple[Any, Any, Any]:
        """Return all memories."""
        supervision = self._supervision.initial() if self._supervision else None
        return self._protection.initial(), self._operation.initial(), supervision

    def authorise(self, state: LineState, memory: Any) -> tuple[Authority, Any]:  # noqa: ANN401
        """Return what the protection answers."""
        answer = self._twice("authorise", self._protection.authorise, (state, memory[0]))
        self._look_at("authority is complete", state, authority_problems(answer[0], state))
        return answer[0], (answer[1], *memory[1:])

    def supervise(
        self,
        state: LineState,
        authority: Authority,
        memory: Any,  # noqa: ANN401
    ) -> tuple[Orders, Any]:
        """Return what the supervision answers."""
        ask: Any = getattr(self._supervision, "supervise", None)
        answer = self._twice("supervise", ask, (state, authority, memory[2]))
        self._look_at("orders are complete", state, orders_problems(answer[0], state))
        return answer[0], (*memory[:2], answer[1])

    def advise(
        self,
        state: LineState,
        authority: Authority,
        memory: Any,  # noqa: ANN401
    ) -> tuple[Advice, Any]:
        """Return what the operation answers."""
        answer = self._twice("advise", self._operation.advise, (state, authority, memory[1]))
        advice = answer[0]
        self._look_at("advice is complete", state, advice_problems(advice, state))
        declared = {NO_REASON, *range(len(self.reasons))}
        self._look_at("reasons are declared", state, _undeclared(advice, declared))
        causes = self._causes(authority, advice, len(state.present))
        self._look_at("causes are trains or places", state, causes)
        self.said.append(Answered(state, authority, advice))
        return advice, (memory[0], answer[1], memory[2])

    def _twice(
        self,
        what: str,
        ask: Callable[..., tuple[Answer, Any]],
        question: tuple[Any, ...],
    ) -> tuple[Answer, Any]:
        before, state = frozen(question), question[0]
        begun_s = perf_counter()
        first = ask(*question)
        first_s = perf_counter() - begun_s
        # A memory that is written to is the same object in both answers.
        answer = frozen(first)
        begun_s = perf_counter()
        second = ask(*question)
        # The shorter one: whatever else the machine has to do is none of its business.
        self._time(what, min(first_s, perf_counter() - begun_s), state)
        names = ("state", "memory") if what == "authorise" else ("state", "authority", "memory")
        for name, was, now in zip(names, before, question, strict=True):
            if not same(was, now):
                self.note(f"{name} is left alone", f"{what} writes into the {name}", state)
        if not same(answer, second):
            self.note("same question, same answer", f"{what} answers differently", state)
        kept = len(self.said) % KEPT_EVERY == 0
        if what == "supervise":
            self._supervised += 1
            kept = self._supervised % ORDERS_KEPT_EVERY == 0
        if kept:
            self.kept.append(KeptQuestion(what, before, answer))
        return first

    def _time(self, what: str, took_s: float, state: LineState) -> None:
        """Give up a layer that is slow; a run of it would take too long even here."""
        timed_s = self._took_s.setdefault(what, [])
        timed_s.append(took_s)
        if len(timed_s) < TIMED:
            return
        usual_s = median(timed_s)
        timed_s.clear()
        if usual_s > SLOW_S:
            told = f"{what} takes {1e3 * usual_s:.0f} ms, more than {1e3 * SLOW_S:.0f} ms"
            self.note(TIMELY, told, state)
            raise TooSlowError(told)

    def ask_again(self, fresh: Controller) -> None:
        """
        Ask another controller some of the questions once more, the last ones first.

        Parameters
        ----------
        fresh
            Made alike, and never asked before.
        """
        for kept in reversed(self.kept):
            try:
                alike = same(kept.answer, kept.asked_of(fresh))
                problem = "" if alike else "depends on what was asked before"
            except Exception as error:  # noqa: BLE001 - whatever a stranger's controller does
                problem = f"of one that was asked nothing before: {sentence_of(error)}"
            if problem:
                self.note("memory is what it returns", f"{kept.what} {problem}", kept.question[0])

    def _causes(self, authority: Authority, advice: Advice, trains: int) -> Iterator[str]:
        # Codes of places beside the track, nothing, rows of trains.
        known = range(-1 - self._places, trains)
        named = {"eoa_by": authority.eoa_by, "ceiling_by": authority.ceiling_by}
        named["cause"] = advice.cause
        for name, values in named.items():
            if isinstance(values, np.ndarray) and not set(values.tolist()) <= set(known):
                yield f"{name} is neither a train nor a place beside the track nor nothing"

    def _look_at(self, check: str, state: LineState, problems: Iterator[str]) -> None:
        for problem in problems:
            self.note(check, problem, state)

    def note(self, check: str, problem: str, state: LineState) -> None:
        """Keep what is wrong, the first of each kind."""
        minutes, seconds = divmod(state.time_s, 60.0)
        at = f"{int(minutes) // 60:02d}:{int(minutes) % 60:02d}:{seconds:04.1f}"
        self.problems.setdefault(check, f"{problem}, at {at}")


def authority_problems(authority: object, state: LineState) -> Iterator[str]:
    """
    Yield what is wrong with the form of an authority.

    Parameters
    ----------
    authority
        Any answer of a protection.
    state
        What it answers to.

    Yields
    ------
    str
        A sentence.
    """
    if not isinstance(authority, Authority):
        yield f"authorise returns a {type(authority).__name__}, no Authority"
        return
    numbers = {name: getattr(authority, name) for name in ("eoa_m", "ceiling_mps", "delay_s")}
    rows = {name: getattr(authority, name) for name in ("eoa_by", "ceiling_by")}
    yield from _malformed(numbers, "f", state)
    yield from _malformed(rows, "iu", state)
    permission: object = authority.permission
    if not isinstance(permission, RadioPermission):
        yield "permission is no RadioPermission: AtOnce makes one where there is no radio"
    if not all(_is_array(values, "f", state) for values in numbers.values()):
        return
    for name, values in numbers.items():
        if np.isnan(values).any():
            yield f"{name} is not a number for a train"
    if not np.isfinite(numbers["eoa_m"]).all():
        yield "eoa_m is not finite for a train"
    if (numbers["ceiling_mps"][state.present] < 0.0).any():
        yield "ceiling_mps is negative for a train on the line"


def advice_problems(advice: object, state: LineState) -> Iterator[str]:
    """
    Yield what is wrong with the form of an advice.

    Parameters
    ----------
    advice
        Any answer of an operation.
    state
        What it answers to.

    Yields
    ------
    str
        A sentence.
    """
    if not isinstance(advice, Advice):
        yield f"advise returns a {type(advice).__name__}, no Advice"
        return
    yield from _malformed({"ceiling_mps": advice.ceiling_mps}, "f", state)
    yield from _malformed({"reason": advice.reason, "cause": advice.cause}, "iu", state)
    if _is_array(advice.ceiling_mps, "f", state):
        ceiling = advice.ceiling_mps
        if not np.isfinite(ceiling).all() or (ceiling < 0.0).any():
            yield "ceiling_mps is negative or not finite"


def orders_problems(orders: object, state: LineState) -> Iterator[str]:
    """
    Yield what is wrong with the form of orders.

    Parameters
    ----------
    orders
        Any answer of a supervision.
    state
        What it answers to.

    Yields
    ------
    str
        A sentence.
    """
    if not isinstance(orders, Orders):
        yield f"supervise returns a {type(orders).__name__}, no Orders"
        return
    held = {name: getattr(orders, name) for name in ("hold_open_until_s", "hold_closed_until_s")}
    yield from _malformed({**held, "arrive_by_s": orders.arrive_by_s}, "f", state)
    for name, values in held.items():
        if _is_array(values, "f", state) and np.isnan(values).any():
            yield f"{name} is not a number for a train"


def _undeclared(advice: Advice, declared: set[int]) -> Iterator[str]:
    if isinstance(advice, Advice) and isinstance(advice.reason, np.ndarray):
        others = set(advice.reason.tolist()) - declared
        if others:
            yield f"reason {min(others)} is not one of the {len(declared) - 1} in reasons"


def _malformed(fields: dict[str, Any], kinds: str, state: LineState) -> Iterator[str]:
    wanted = "numbers" if kinds == "f" else "rows of trains or places"
    for name, values in fields.items():
        if not _is_array(values, kinds, state):
            yield f"{name} is no array of {wanted}, one for each train"


def _is_array(values: Any, kinds: str, state: LineState) -> bool:  # noqa: ANN401
    fits = isinstance(values, np.ndarray) and values.shape == state.front_m.shape
    return bool(fits and values.dtype.kind in kinds)
