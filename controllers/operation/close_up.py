"""Close-up running: as fast as the authority allows, the baseline of all comparisons."""

from dataclasses import dataclass

import numpy as np

from railway.state import Advice, Authority, LineState, Reason
from railway.world import World

NO_CEILING_MPS = 1000.0


@dataclass(frozen=True, slots=True)
class CloseUpOptions:
    """Close-up running has no options."""


class CloseUp:
    """Asks for nothing."""

    def __init__(self, world: World, options: CloseUpOptions) -> None:
        del options
        self._advice = Advice(
            ceiling_mps=np.full(world.size, NO_CEILING_MPS),
            reason=np.full(world.size, Reason.TRACTION, dtype=np.intp),
        )

    def initial(self) -> None:
        """Return the memory before the first step: none is needed."""

    def advise(self, state: LineState, authority: Authority, memory: None) -> tuple[Advice, None]:
        """
        Return advice that lowers nothing.

        Parameters
        ----------
        state
            The line.
        authority
            What protection permits.
        memory
            None.

        Returns
        -------
        tuple[Advice, None]
            The same advice every step.
        """
        del state, authority
        return self._advice, memory
