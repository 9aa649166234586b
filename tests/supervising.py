"""Supervisions for tests: they hold every train at every stop."""

from dataclasses import dataclass, field, replace

import numpy as np

from kankaku.controllers.registry import build
from kankaku.controllers.supervision.outlook import Outlook
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.scenario import ControllerSpec
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Controller
from kankaku.railway.step.state import NO_HOLD_S, Authority, LineState, Orders, no_orders


@dataclass
class HoldEverybody:
    """Holds each train open for a time beyond its minimum dwell and booking, and then closed."""

    world: World
    open_s: float = 0.0
    closed_s: float = 0.0
    asked: list[LineState] = field(default_factory=list)

    def initial(self) -> None:
        return None

    def supervise(
        self, state: LineState, authority: Authority, memory: None
    ) -> tuple[Orders, None]:
        del authority
        self.asked.append(state)
        outlook = Outlook(self.world)
        orders = no_orders(self.world.size)
        open_s, closed_s = orders.hold_open_until_s.copy(), orders.hold_closed_until_s.copy()
        for row in np.flatnonzero(state.present & (state.speed_mps == 0.0)).tolist():
            call = int(state.next_call[row]) - int(state.running[row])
            if outlook.stands_at(state, row, call) and call < self.world.call_count[row]:
                over_s = outlook.over_s(state, row, call)
                open_s[row] = over_s + self.open_s if self.open_s else NO_HOLD_S
                closed_s[row] = over_s + self.open_s + self.closed_s if self.closed_s else NO_HOLD_S
        return orders._replace(hold_open_until_s=open_s, hold_closed_until_s=closed_s), memory


def supervised(
    world: World, supervision: HoldEverybody, protection: str = "moving_block"
) -> Controller:
    """Return close-up running under a supervision."""
    spec = ControllerSpec("supervised", protection, "close_up", {}, {})
    return replace(build(spec, world), supervision=supervision)


def dwell_delays_s(world: World, row: int, call: int, delay_s: float) -> FloatArray:
    """Return one train's overstay."""
    delays_s = np.zeros_like(world.minimum_dwell_s[:, :-1])
    delays_s[row, call] = delay_s
    return delays_s
