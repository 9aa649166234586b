"""
The layers of train control, as IEEE 1474.1 names them: protection, operation, drive.

Above them stands supervision (ATS) where a controller has one: it decides at platforms.
"""

from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import Any, NamedTuple, Protocol, TypeVar

from kankaku.railway.arrays import FloatArray, IntArray
from kankaku.railway.plan.line import Block, Line
from kankaku.railway.plan.profile import Profile
from kankaku.railway.step.promises import Promises
from kankaku.railway.step.state import Advice, Authority, LineState, Orders

Memory = TypeVar("Memory")


class Separation(Enum):
    """What keeps a train apart from the one ahead, and what the monitor holds it to."""

    STANDING = "stops before the train ahead, taken as standing"
    BLOCKS = "and never enters an occupied block"
    CIRCUITS = "and never enters an occupied track circuit"
    BRAKING = "stops before where the train ahead comes to a stand with its emergency brake"


def exclusive_pieces(line: Line, separation: Separation) -> tuple[Block, ...]:
    """
    Return the pieces of track that only one train at a time may be in.

    Parameters
    ----------
    line
        The line.
    separation
        What keeps its trains apart.

    Returns
    -------
    tuple[Block, ...]
        Blocks or track circuits; none without fixed blocks.
    """
    pieces = {Separation.BLOCKS: line.blocks, Separation.CIRCUITS: line.track_circuits}
    return pieces.get(separation, ())


class Bound(IntEnum):
    """What a drive may be bound by."""

    TRACTION = 0
    CEILING = 1
    """Protection's ceiling."""
    ADVICE = 2
    """The ceiling that operation asks for."""
    LIMIT = 3
    """The brake curve to the end of authority."""
    STOP = 4
    """The brake curve to the next stop."""
    EMERGENCY = 5
    """The emergency brake of a train whose permission says so."""
    PEER = 6
    """Whatever the peer follows that drives the train."""
    HELD = 7
    """Supervision keeps the train at its platform; the loop puts it in place of the advice."""


class Command(NamedTuple):
    """What the drive makes of authority and advice; arrays over trains."""

    speed_mps: FloatArray
    """Speed at the end of the step. [m/s], shape (n_trains,)"""
    bounds_mps: FloatArray
    """The bounds that it is the least of; rows as the drive documents. (n_bounds, n_trains)

    One that nobody can reach may be higher than it is.
    """
    bound: IntArray
    """The one that counts for each train, as a :class:`Bound`. shape (n_trains,)"""


class Foresight(Protocol):
    """What a protection says beforehand, so that an operation can plan over any of them."""

    @property
    def profile(self) -> Profile:
        """The line as trains are driven on it, within the ceilings that the protection enforces."""
        ...

    @property
    def delay_s(self) -> float:
        """The delay of every authority. [s]"""
        ...

    @property
    def release_delay_s(self) -> float:
        """How old the leader's place is that an authority counts on, at most. [s]"""
        ...

    @property
    def idle_time_s(self) -> float:
        """Who is permitted less than it runs for no longer need not brake. [s]"""
        ...

    @property
    def sighting_time_s(self) -> float:
        """So long before a lineside signal its driver acts on it; 0 with cab signals. [s]"""
        ...

    def eoa_behind_m(
        self,
        row: int,
        call: int,
        leader: int,
        leader_front_m: FloatArray,
        leader_speed_mps: FloatArray,
    ) -> FloatArray:
        """
        Return how far a train on the way to a call may go, by places and speeds of its leader.

        A protection that plans the train's run may permit less, as far as it is planned.

        Parameters
        ----------
        row
            The train, not yet at the platform of the call.
        call
            Its next call.
        leader
            Row of its leader, which goes or stands on its way.
        leader_front_m
            Where the leader's front may be. [m], shape (n_places,)
        leader_speed_mps
            Its speed there. [m/s], shape (n_places,)

        Returns
        -------
        FloatArray
            The front must be able to stop before this. [m], shape (n_places,)
        """
        ...

    def permitted_mps(self, row: int, front_m: FloatArray, eoa_m: FloatArray) -> FloatArray:
        """
        Return the speed that is permitted to a front before an end of authority that stays.

        Parameters
        ----------
        row
            The train.
        front_m
            Places of its front. [m], shape (n_places,)
        eoa_m
            Its ends of authority. [m], shape (n_places,)

        Returns
        -------
        FloatArray
            The speed, or the line ceiling where that is lower. [m/s], shape (n_places,)
        """
        ...


class Protection(Protocol[Memory]):
    """Says how far and how fast each train may go (ATP)."""

    def initial(self) -> Memory:
        """Return the memory before the first step."""
        ...

    def authorise(self, state: LineState, memory: Memory) -> tuple[Authority, Memory]:
        """
        Return the authority of every train.

        Parameters
        ----------
        state
            The line, which is only shown.
        memory
            What the step before returned, or :meth:`initial`.

        Returns
        -------
        tuple[Authority, Memory]
            What is permitted, and the next memory.
        """
        ...


class Operation(Protocol[Memory]):
    """Says how each train uses its permission (ATO); it can only lower."""

    @property
    def reasons(self) -> tuple[str, ...]:
        """Its own words for why it lowers a speed; :attr:`Advice.reason` counts through them."""
        ...

    def initial(self) -> Memory:
        """Return the memory before the first step."""
        ...

    def advise(
        self, state: LineState, authority: Authority, memory: Memory
    ) -> tuple[Advice, Memory]:
        """
        Return the advice for every train.

        Parameters
        ----------
        state
            The line, which is only shown.
        authority
            What protection permits.
        memory
            What the step before returned, or :meth:`initial`.

        Returns
        -------
        tuple[Advice, Memory]
            What is asked for, and the next memory.
        """
        ...


class Supervision(Protocol[Memory]):
    """
    Decides at platforms (ATS): who is held there, and when trains are to arrive.

    It knows what any controller does, never how long a train will really overstay. It is asked at
    events and at the times that it names itself, not in every step.
    """

    def initial(self) -> Memory:
        """Return the memory before the first step."""
        ...

    def supervise(
        self, state: LineState, authority: Authority, memory: Memory
    ) -> tuple[Orders, Memory]:
        """
        Return the orders for every train.

        Parameters
        ----------
        state
            The line, which is only shown, with the orders that were in force so far.
        authority
            What protection permits.
        memory
            What it returned when it was asked last, or :meth:`initial`.

        Returns
        -------
        tuple[Orders, Memory]
            All orders from now on, and the next memory.
        """
        ...


class Drive(Protocol):
    """Turns authority and advice into the next speed within traction and braking."""

    def command(self, state: LineState, authority: Authority, advice: Advice) -> Command:
        """
        Return the speed at the end of the step for every train.

        Parameters
        ----------
        state
            The line.
        authority
            What protection permits.
        advice
            What operation asks for.

        Returns
        -------
        Command
            The speeds, and what bound each of them.
        """
        ...


@dataclass(frozen=True, slots=True)
class Controller:
    """A named set of layers; any operation runs over any protection."""

    name: str
    protection: Protection[Any]
    operation: Operation[Any]
    drive: Drive
    separation: Separation = Separation.STANDING
    by_radio: bool = False
    """Trains take their commands by radio."""
    peer: bool = False
    """The engine drives the trains itself: only what it reports is judged, not our rules."""
    promises: Promises | None = None
    """What the protection promises beyond bare safety."""
    supervision: Supervision[Any] | None = None
    """What decides at platforms; None: trains leave when their stops are over."""
