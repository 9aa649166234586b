"""The layers of train control, as IEEE 1474.1 names them: protection, operation, drive."""

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, TypeVar

from railway.arrays import FloatArray, IntArray
from railway.profile import Profile
from railway.state import Advice, Authority, LineState

Memory = TypeVar("Memory")


class Command(NamedTuple):
    """What the drive makes of authority and advice; arrays over trains."""

    speed_mps: FloatArray
    """Speed at the end of the step. [m/s], shape (n_trains,)"""
    bounds_mps: FloatArray
    """The bounds that it is the least of; rows as the drive documents. (n_bounds, n_trains)"""


class Foresight(Protocol):
    """What a protection says beforehand, so that an operation can plan over any of them."""

    @property
    def profile(self) -> Profile:
        """The line with the ceilings that the protection enforces."""
        ...

    @property
    def delay_s(self) -> float:
        """The delay of every authority. [s]"""
        ...

    def limit_behind_m(
        self, row: int, call: int, leader: int, leader_front_m: FloatArray
    ) -> FloatArray:
        """
        Return the limits of a train on the way to a call, by places of its leader's front.

        The places are [m], shape (n_places,), and so are the limits.
        """
        ...


class Protection(Protocol[Memory]):
    """Says how far and how fast each train may go (ATP)."""

    def initial(self) -> Memory:
        """Return the memory before the first step."""
        ...

    def authorise(self, state: LineState, memory: Memory) -> tuple[Authority, Memory]:
        """Return the authority of every train, and the next memory."""
        ...


class Operation(Protocol[Memory]):
    """Says how each train uses its permission (ATO); it can only lower."""

    def initial(self) -> Memory:
        """Return the memory before the first step."""
        ...

    def advise(
        self, state: LineState, authority: Authority, memory: Memory
    ) -> tuple[Advice, Memory]:
        """Return the advice for every train, and the next memory."""
        ...


class Drive(Protocol):
    """Turns authority and advice into the next speed within traction and braking."""

    def command(self, state: LineState, authority: Authority, advice: Advice) -> Command:
        """Return the speed at the end of the step for every train."""
        ...

    def reason(self, command: Command, advice: Advice) -> IntArray:
        """Return what bound each train's speed, as a Reason. shape (n_trains,)"""
        ...


@dataclass(frozen=True, slots=True)
class Controller:
    """A named set of layers; any operation runs over any protection."""

    name: str
    protection: Protection[Any]
    operation: Operation[Any]
    drive: Drive
