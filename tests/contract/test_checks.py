"""The contract tells what is wrong with controllers that break it, each for its own reason."""

import random
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from kankaku.controllers.operation.close_up import CloseUp, CloseUpOptions
from kankaku.controllers.protection.moving_block import Ahead, MovingBlock
from kankaku.controllers.registry import OPERATIONS, Layer, build
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Controller, Foresight
from kankaku.railway.step.state import Advice, Authority, LineState
from kankaku.testing import CHECKS, check_candidate, check_controller, failures
from kankaku.testing.contract import ABOUT_RUNS, findings_in
from kankaku.testing.trials import trial_on
from tests.cli.command import BAD_INPUT, FAILED, kankaku

SPEC = ControllerSpec("bad", "moving_block", "close_up", {}, {})


class Blind(MovingBlock):
    """Sees no other train."""

    def authorise(self, state: LineState, memory: Ahead) -> tuple[Authority, Ahead]:
        authority, memory = super().authorise(state, memory)
        return authority._replace(eoa_m=state.front_m + 2000.0), memory


class Incomplete(MovingBlock):
    """Does not say what ends the way of each train."""

    def authorise(self, state: LineState, memory: Ahead) -> tuple[Authority, Ahead]:
        authority, memory = super().authorise(state, memory)
        return authority._replace(eoa_by=authority.eoa_by[:1]), memory


class Scribbling(CloseUp):
    """Writes into what it is shown."""

    def advise(self, state: LineState, authority: Authority, memory: None) -> tuple[Advice, None]:
        state.arrival_s[0] += 1.0
        return super().advise(state, authority, memory)


class Wordless(CloseUp):
    """Gives a reason that it has not declared."""

    def advise(self, state: LineState, authority: Authority, memory: None) -> tuple[Advice, None]:
        advice, memory = super().advise(state, authority, memory)
        return advice._replace(reason=np.zeros_like(advice.reason)), memory


class Moody(CloseUp):
    """Remembers something where nobody can see it."""

    asked = 0

    def advise(self, state: LineState, authority: Authority, memory: None) -> tuple[Advice, None]:
        advice, memory = super().advise(state, authority, memory)
        self.asked += 1
        return advice._replace(ceiling_mps=advice.ceiling_mps - 0.001 * (self.asked % 2)), memory


class Secretive(CloseUp):
    """Answers alike when it is asked twice, yet goes by what it was asked before."""

    asked_s = 0.0
    times = 0

    def advise(self, state: LineState, authority: Authority, memory: None) -> tuple[Advice, None]:
        advice, memory = super().advise(state, authority, memory)
        if state.time_s != self.asked_s:
            self.asked_s, self.times = state.time_s, self.times + 1
        return advice._replace(ceiling_mps=advice.ceiling_mps - 1e-5 * self.times), memory


class Drawing(CloseUp):
    """Draws lots."""

    def advise(self, state: LineState, authority: Authority, memory: None) -> tuple[Advice, None]:
        advice, memory = super().advise(state, authority, memory)
        less_mps = 0.1 * random.random()  # noqa: S311 - nobody's secret
        return advice._replace(ceiling_mps=advice.ceiling_mps - less_mps), memory


class Lasting(CloseUp):
    """Keeps for every class of its kind what it saw, and goes by how many there were before."""

    made = 0

    def __init__(self, world: World, options: CloseUpOptions, foresight: Foresight) -> None:
        super().__init__(world, options, foresight)
        # Of whole runs, so that within one it answers from what it is told.
        type(self).made += 1

    def advise(self, state: LineState, authority: Authority, memory: None) -> tuple[Advice, None]:
        advice, memory = super().advise(state, authority, memory)
        return advice._replace(ceiling_mps=advice.ceiling_mps - 0.01 * (self.made // 3)), memory


class Slow(CloseUp):
    """Thinks for longer than anybody waits."""

    def advise(self, state: LineState, authority: Authority, memory: None) -> tuple[Advice, None]:
        time.sleep(0.02)
        return super().advise(state, authority, memory)


class Meddling(CloseUp):
    """Books its trains anew."""

    def __init__(self, world: World, options: CloseUpOptions, foresight: Foresight) -> None:
        super().__init__(world, options, foresight)
        world.booked_departure_s[0, 0] += 1.0


class Peeping(CloseUp):
    """Looks through its callers for how long trains are going to overstay."""

    reasons: Any = ("peeps",)

    def advise(self, state: LineState, authority: Authority, memory: None) -> tuple[Advice, None]:
        advice, memory = super().advise(state, authority, memory)
        frame: Any = sys._getframe()  # noqa: SLF001 - that is the fault
        while frame is not None and "delay_s" not in frame.f_locals:
            frame = frame.f_back
        longest_s = 0.0 if frame is None else float(np.max(frame.f_locals["delay_s"]))
        ceiling_mps = np.full(len(advice.ceiling_mps), 25.0 if longest_s < 100.0 else 10.0)
        return advice._replace(ceiling_mps=ceiling_mps, reason=np.zeros_like(advice.reason)), memory


class Generous(CloseUp):
    """Moves the end of authority that it is given."""

    def advise(self, state: LineState, authority: Authority, memory: None) -> tuple[Advice, None]:
        authority.eoa_m[0] += 1.0
        return super().advise(state, authority, memory)


@dataclass(frozen=True)
class Diary:
    """What a train was told, by its row."""

    told_mps: FloatArray
    notes: dict[str, list[float]]


class Diarist(CloseUp):
    """Keeps a memory and hands the next one on, as it should."""

    def initial(self) -> Any:  # noqa: ANN401
        return Diary(np.full(1, np.nan), {"asked_s": []})

    def advise(self, state: LineState, authority: Authority, memory: Any) -> tuple[Advice, Any]:  # noqa: ANN401
        advice, _ = super().advise(state, authority, None)
        return advice, self.noted(memory, state.time_s)

    def noted(self, memory: Diary, time_s: float) -> Diary:
        return Diary(memory.told_mps, {"asked_s": [*memory.notes["asked_s"][-1:], time_s]})


class Overwriting(Diarist):
    """Writes into the memory that it is given."""

    def noted(self, memory: Diary, time_s: float) -> Diary:
        memory.notes["asked_s"].append(time_s)
        return memory


def under(protection: type[MovingBlock]) -> Callable[[World], Controller]:
    def make(world: World) -> Controller:
        honest = build(SPEC, world)
        made: Any = object.__new__(protection)
        made.__dict__.update(honest.protection.__dict__)
        return replace(honest, protection=made)

    return make


def over(operation: type[CloseUp]) -> Callable[[World], Controller]:
    def make(world: World) -> Controller:
        honest = build(SPEC, world)
        foresight: Any = honest.protection
        return replace(honest, operation=operation(world, CloseUpOptions(), foresight))

    return make


@pytest.mark.parametrize(
    ("candidate", "check", "told"),
    [
        (under(Blind), "trains are safe", "the margin behind the train ahead"),
        (under(Incomplete), "authority is complete", "eoa_by is no array of rows of trains"),
        (over(Scribbling), "state is left alone", "advise writes into the state"),
        (over(Wordless), "reasons are declared", "reason 0 is not one of the 0 in reasons"),
        (over(Moody), "same question, same answer", "advise answers differently"),
        (over(Secretive), "memory is what it returns", "advise depends on what was asked before"),
        (over(Generous), "authority is left alone", "advise writes into the authority"),
        (over(Overwriting), "memory is left alone", "advise writes into the memory"),
        (over(Drawing), "same question, same answer", "advise answers differently"),
        (over(Slow), "answers in time", "ms, more than 10 ms"),
        (over(Meddling), "world is left alone", "a layer writes into the world"),
    ],
)
def test_a_bad_controller_is_told_what_is_wrong_with_it(
    candidate: Callable[[World], Controller], check: str, told: str
) -> None:
    trial = trial_on("one track", candidate)
    problems = {found.check: found.problem for found in findings_in({"one track": trial})}
    assert told in problems[check]
    assert problems[check].endswith("(line 'one track')")


@pytest.mark.parametrize(
    ("candidate", "check", "told"),
    [
        (over(Peeping), "the future is not read", "run differently before the first one overstays"),
        (over(Drawing), "another run, same run", "goes another way from"),
        (over(Lasting), "another run, same run", "goes another way from"),
    ],
)
def test_what_only_another_run_shows_is_told_too(
    candidate: Callable[[World], Controller], check: str, told: str
) -> None:
    problems = {found.check: found.problem for found in check_candidate(candidate)}
    assert told in problems[check]


def test_a_memory_may_be_made_of_anything_that_holds_numbers() -> None:
    assert not failures(check_candidate(over(Diarist)))


def test_a_good_controller_is_told_that_it_is() -> None:
    assert not any(found.problem for found in check_controller("moving_block+close_up"))
    screen = kankaku("check-controller", "close_up")
    assert screen.status == 0
    assert "It keeps the contract." in screen.answers


def test_the_command_fails_for_a_bad_controller_and_tells_why(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(OPERATIONS.data, "wordless", Layer(Wordless, CloseUpOptions, "is silent"))
    screen = kankaku("check-controller", "moving_block+wordless")
    assert screen.status == FAILED
    assert "reason 0 is not one of the 0 in reasons" in screen.answers
    assert f"of {len(CHECKS) + len(ABOUT_RUNS)} checks failed" in screen.answers


def test_a_name_that_is_no_controller_is_answered_with_the_likeliest() -> None:
    screen = kankaku("check-controller", "moving_bloc")
    assert screen.status == BAD_INPUT
    assert "'moving_block' (did you mean that?)" in screen.complaints
