"""A controller from outside as an operation: the same that steps through a simulation."""

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np

from kankaku.controllers.operation.close_up import no_advice
from kankaku.live.line_advice import GENTLE_MPS2, LineAdvice, Outside, nothing_asked, taken
from kankaku.live.line_view import LineView, line_view
from kankaku.live.outside_layers import lower_to_asked
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import NO_HOLD_S, Advice, Authority, LineState

Policy: TypeAlias = Callable[[LineView], LineAdvice | None]
"""What is asked of the trains when the line is seen."""
ROUNDING_S = 1e-6


class PolicyMemory(NamedTuple):
    """What a policy has asked for last, and when it is asked again."""

    asked: Outside
    begin_s: float
    """When it was asked first. [s]"""
    decisions: int
    departed_late_s: FloatArray
    """How late each train departed last; nan if it has not moved since. [s]"""


class PolicyOperation:
    """
    Asks a policy at chosen intervals, and lowers speeds as it says.

    Parameters
    ----------
    world
        The trains.
    decide
        The policy; what it says must follow from what it sees. An operation holds nobody at
        platforms: that a policy does so is refused.
    interval_s
        From one decision to the next. [s]
    words
        Why it may slow trains.
    """

    def __init__(
        self, world: World, decide: Policy, interval_s: float, words: tuple[str, ...]
    ) -> None:
        self._world, self._decide, self.reasons = world, decide, words
        self._interval_s = interval_s
        self._gentle_mps = GENTLE_MPS2 * world.step_s
        self._free = no_advice(world.size)

    def initial(self) -> PolicyMemory:
        """Return the memory before the first step: nobody was asked yet."""
        size = self._world.size
        return PolicyMemory(nothing_asked(size), np.nan, 0, np.full(size, np.nan))

    def advise(
        self, state: LineState, authority: Authority, memory: PolicyMemory
    ) -> tuple[Advice, PolicyMemory]:
        """Return what the policy asked for last."""
        if state.events:
            memory = memory._replace(departed_late_s=self._noted(state, memory))
        if not memory.decisions:
            memory = memory._replace(begin_s=state.time_s)
        next_s = memory.begin_s + memory.decisions * self._interval_s - ROUNDING_S
        if state.time_s >= next_s:
            seen = line_view(self._world, state, authority, memory.departed_late_s)
            asked = taken(self._decide(seen), self._world, len(self.reasons))
            if (asked.hold_until_s > NO_HOLD_S).any():
                msg = "an operation holds no train at its platform; a supervision may"
                raise ValueError(msg)
            memory = memory._replace(asked=asked, decisions=memory.decisions + 1)
        asked, free = memory.asked, self._free
        told = free.ceiling_mps.copy(), free.reason.copy(), free.cause.copy()
        parts = asked.ceiling_mps, asked.target_mps, asked.reason, asked.cause
        lower_to_asked(state.speed_mps, state.whereabouts[5], parts, self._gentle_mps, told)
        return Advice(*told), memory

    def _noted(self, state: LineState, memory: PolicyMemory) -> FloatArray:
        """Return how late trains departed, after what has happened since the last step."""
        late_s, events = memory.departed_late_s.copy(), state.events
        late_s[list(events.released)] = np.nan
        began_s = state.time_s - (self._world.step_s + self._world.reaction_s)
        for row in events.departed:
            booked_s = self._world.booked_departure_s[row, state.next_call[row] - 1]
            late_s[row] = (state.time_s if row in events.left else began_s) - booked_s
        return late_s
