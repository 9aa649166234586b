"""Control map: the train goes as its commands say."""

from dataclasses import dataclass

import numpy as np

from kankaku.controllers.control_map.map_protection import ControlMap
from kankaku.controllers.operation.close_up import NO_CEILING_MPS
from kankaku.railway.compiled import Plain, formula
from kankaku.railway.plan.world import World
from kankaku.railway.step.bundles import LayerSteps
from kankaku.railway.step.control import Foresight
from kankaku.railway.step.state import NO_REASON, Advice, Authority, LineState

CONTROL_MAP = 0


@dataclass(frozen=True, slots=True)
class FollowPlanOptions:
    """It has none: the plan is the protection's."""


class FollowPlan:
    """
    Goes as the centre has planned.

    Over a protection that commands no speeds it closes up.
    """

    reasons = ("control_map",)

    def __init__(
        self,
        world: World,
        options: FollowPlanOptions,
        foresight: Foresight,
    ) -> None:
        """Need nothing: the plan is the protection's."""
        del options
        self._size = world.size
        self._step = _follow if isinstance(foresight, ControlMap) else _close_up

    def initial(self) -> None:
        """Return the memory before the first step: there is none."""

    def advise(
        self,
        state: LineState,  # noqa: ARG002 - commands are made from it
        authority: Authority,
        memory: None,  # noqa: ARG002
    ) -> tuple[Advice, None]:
        """Return the commanded speeds."""
        commanded_mps = authority.permission.commanded_mps
        reason = np.where(np.isfinite(commanded_mps), CONTROL_MAP, NO_REASON)
        ceiling_mps = np.minimum(commanded_mps, NO_CEILING_MPS)
        return Advice(ceiling_mps, reason, authority.eoa_by), None

    def steps(self, state: LineState, memory: None) -> LayerSteps:
        """Return the compiled step."""
        del state, memory
        reason, cause = np.full((2, self._size), NO_REASON, dtype=np.intp)
        return LayerSteps(
            self._step, (), (), (np.full(self._size, NO_CEILING_MPS), reason, cause), np.inf
        )

    def resumed(self, memory: None, after: Plain) -> None:
        """Return the memory after a bundle of steps: there is none."""


@formula
def _follow(
    instant: Plain,
    authority: Plain,
    _fields: Plain,
    _memory: Plain,
    _after: Plain,
    told: Plain,
) -> bool:
    (ceiling_mps, reason, cause), commanded_mps = told, authority[5]
    for train in instant[1][5]:
        commanded = np.isfinite(commanded_mps[train])
        ceiling_mps[train] = min(commanded_mps[train], NO_CEILING_MPS)
        reason[train], cause[train] = CONTROL_MAP if commanded else NO_REASON, authority[3][train]
    return False


@formula
def _close_up(
    instant: Plain,
    authority: Plain,
    _fields: Plain,
    _memory: Plain,
    _after: Plain,
    told: Plain,
) -> bool:
    ceiling_mps, reason, cause = told
    for train in instant[1][5]:
        ceiling_mps[train], reason[train] = NO_CEILING_MPS, NO_REASON
        cause[train] = authority[3][train]
    return False
