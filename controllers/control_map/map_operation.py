"""Control map: the train goes as its commands say."""

from dataclasses import dataclass

import numpy as np

from kankaku.controllers.operation.close_up import NO_CEILING_MPS
from kankaku.railway.plan.world import World
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
