"""The contract tells what is wrong with controllers that break it, each for its own reason."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kankaku.controllers.operation.close_up import CloseUp, CloseUpOptions
from kankaku.controllers.protection.moving_block import Ahead, MovingBlock
from kankaku.controllers.registry import build
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Controller
from kankaku.railway.step.state import Advice, Authority, LineState
from kankaku.testing import check_candidate, check_controller
from tests.cli.command import BAD_INPUT, kankaku

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
    ],
)
def test_a_bad_controller_is_told_what_is_wrong_with_it(
    candidate: Callable[[World], Controller], check: str, told: str
) -> None:
    problems = {found.check: found.problem for found in check_candidate(candidate)}
    assert told in problems[check]
    assert problems[check].endswith("(line 'one track')")


def test_a_good_controller_is_told_that_it_is() -> None:
    assert not any(found.problem for found in check_controller("moving_block+close_up"))
    screen = kankaku("check-controller", "close_up")
    assert screen.status == 0
    assert "It keeps the contract." in screen.answers


def test_a_name_that_is_no_controller_is_answered_with_the_likeliest() -> None:
    screen = kankaku("check-controller", "moving_bloc")
    assert screen.status == BAD_INPUT
    assert "'moving_block' (did you mean that?)" in screen.complaints
