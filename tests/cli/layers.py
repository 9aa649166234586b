"""Protections that do what no real one may, and a command line that knows them."""

import time
from typing import TYPE_CHECKING, cast

from kankaku import interrupts
from kankaku.commands import app
from kankaku.controllers import registry
from kankaku.controllers.protection.moving_block import Ahead, MovingBlock, MovingBlockOptions
from kankaku.controllers.registry import Layer
from kankaku.railway.step.state import Authority, LineState

if TYPE_CHECKING:
    from collections.abc import MutableMapping

FREE_WAY_M = 2000.0
HELD_S = 600.0


class Blind(MovingBlock):
    """Sees no other train."""

    def authorise(self, state: LineState, memory: Ahead) -> tuple[Authority, Ahead]:
        authority, memory = super().authorise(state, memory)
        return authority._replace(eoa_m=state.front_m + FREE_WAY_M), memory


class Stuck(MovingBlock):
    """Takes longer for its first answer than any test waits."""

    def authorise(self, state: LineState, memory: Ahead) -> tuple[Authority, Ahead]:
        time.sleep(HELD_S)
        return super().authorise(state, memory)


BLIND = Layer(Blind, MovingBlockOptions, "sees no other train")
STUCK = Layer(Stuck, MovingBlockOptions, "never answers")

if __name__ in {"__main__", "__mp_main__"}:
    # Worker processes import this module, too, under the second name.
    known = cast("MutableMapping[str, Layer]", registry.PROTECTIONS)
    known.update(blind=BLIND, stuck=STUCK)

if __name__ == "__main__":
    interrupts.end_as_by_ctrl_c()
    app.app()
