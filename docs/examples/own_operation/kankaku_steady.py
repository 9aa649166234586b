"""An operation of one's own: whoever comes near another train keeps to a steady speed."""

from dataclasses import dataclass

import numpy as np

from kankaku import Layer
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight
from kankaku.railway.step.state import NO_REASON, Advice, Authority, LineState

NO_CEILING_MPS = 1e3


@dataclass(frozen=True)
class SteadyOptions:
    """What a scenario may set; the unit is in the name."""

    steady_kmh: float = 60.0
    near_m: float = 800.0


class Steady:
    """Keeps trains that come near the end of their authority to one speed."""

    reasons = ("steady",)

    def __init__(self, world: World, options: SteadyOptions, foresight: Foresight) -> None:
        self._steady_mps = options.steady_kmh / 3.6
        self._near_m = options.near_m

    def initial(self) -> None:
        """Return the memory before the first step: none is needed."""

    def advise(self, state: LineState, authority: Authority, memory: None) -> tuple[Advice, None]:
        """Return a lower ceiling for whoever is near; what the way ends at is the cause."""
        near = state.running & (authority.eoa_m - state.front_m < self._near_m)
        ceiling_mps = np.where(near, self._steady_mps, NO_CEILING_MPS)
        return Advice(ceiling_mps, np.where(near, 0, NO_REASON), authority.eoa_by), None


LAYER = Layer(Steady, SteadyOptions, "trains that come near another one keep to a steady speed")
