"""An operation that does not belong to the program; workers import it from here."""

from dataclasses import dataclass

from kankaku.controllers.operation.close_up import CloseUp, CloseUpOptions
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight


@dataclass(frozen=True, slots=True)
class OwnOptions:
    """One number that a scenario may set."""

    slowest_kmh: float = 10.0


class Own(CloseUp):
    """Goes close up."""

    def __init__(self, world: World, options: OwnOptions, foresight: Foresight) -> None:
        super().__init__(world, CloseUpOptions(), foresight)
        self.slowest_mps = options.slowest_kmh / 3.6
