"""Close-up running: as fast as the authority allows, the baseline of all comparisons."""

from dataclasses import dataclass

import numpy as np

from kankaku.railway.compiled import Plain, formula
from kankaku.railway.plan.world import World
from kankaku.railway.step.bundles import LayerSteps
from kankaku.railway.step.control import Foresight
from kankaku.railway.step.state import NO_REASON, NOTHING, Advice, Authority, LineState

NO_CEILING_MPS = 1000.0


def no_advice(trains: int) -> Advice:
    """
    Return advice that lowers nothing.

    Parameters
    ----------
    trains
        Number of trains. [-]

    Returns
    -------
    Advice
        For all of them.
    """
    reason = np.full(trains, NO_REASON, dtype=np.intp)
    nothing = np.full(trains, NOTHING, dtype=np.intp)
    return Advice(np.full(trains, NO_CEILING_MPS), reason, nothing)


@dataclass(frozen=True, slots=True)
class CloseUpOptions:
    """Close-up running has no options."""


class CloseUp:
    """Asks for nothing."""

    reasons = ()

    def __init__(self, world: World, options: CloseUpOptions, foresight: Foresight) -> None:
        del options, foresight
        self._advice = no_advice(world.size)

    def initial(self) -> None:
        """Return the memory before the first step: none is needed."""

    def advise(self, state: LineState, authority: Authority, memory: None) -> tuple[Advice, None]:
        """Return advice that lowers nothing."""
        del state, authority
        return self._advice, memory

    def steps(self, state: LineState, memory: None) -> LayerSteps:
        """Return the compiled step."""
        del state, memory
        return LayerSteps(always, (), (), tuple(self._advice), np.inf)

    def resumed(self, memory: None, after: Plain) -> None:
        """Return the memory after a bundle of steps: none is needed."""


@formula
def always(
    _instant: Plain,
    _authority: Plain,
    _fields: Plain,
    _memory: Plain,
    _after: Plain,
    _told: Plain,
) -> bool:
    """
    Advise the same in every step.

    Parameters
    ----------
    instant, authority, fields, memory, after, told
        As :mod:`kankaku.railway.step.bundles` says; what is told is the advice already.

    Returns
    -------
    bool
        Python need not be asked.
    """
    return False
