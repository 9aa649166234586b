"""Operations as strangers write them: one that works, and others that nobody can use."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from kankaku.controllers.layers import Layer
from kankaku.controllers.operation.close_up import CloseUp, CloseUpOptions

if TYPE_CHECKING:
    from kankaku.railway.plan.world import World
    from kankaku.railway.step.control import Foresight


@dataclass(frozen=True)
class Postponed:
    """Its annotations are texts until somebody asks."""

    slowest_kmh: float = 10.0
    steps_kmh: tuple[float, ...] = (45.0, 25.0)
    early: bool = False


@dataclass(frozen=True)
class Whole:
    """A file that says 3 means 3.0."""

    blocks: int = 3


@dataclass(frozen=True)
class Required:
    """Nobody can say what it is by default."""

    slowest_kmh: float


@dataclass(frozen=True)
class Unheard:
    """Its type is nowhere."""

    slowest: Kilometres = 3.0  # type: ignore[name-defined]  # noqa: F821 - nowhere on purpose


def goes_close_up(world: World, _: object, foresight: Foresight) -> CloseUp:
    return CloseUp(world, CloseUpOptions(), foresight)


def falls(*_: object) -> CloseUp:
    msg = "speeds"
    raise KeyError(msg)


class Silent:
    """Advises nobody."""

    def __init__(self, *_: object) -> None:
        self.reasons = ()

    def initial(self) -> None:
        """Return nothing."""


build: Any = goes_close_up
silent: Any = Silent
nothing: Any = None
GOOD = Layer(build, Postponed, "goes close up")
WHOLE = Layer(build, Whole, "has a whole number")
REQUIRED = Layer(build, Required, "has no default")
UNHEARD = Layer(build, Unheard, "has an unknown type")
NO_OPTIONS = Layer(build, nothing, "has no options")
NO_BUILD = Layer(nothing, Postponed, "cannot be built")
FALLS = Layer(falls, Postponed, "falls")
SILENT = Layer(silent, Postponed, "advises nobody")
NO_SUMMARY = Layer(build, Postponed, nothing)
