"""
Peers: other programs that drive the trains themselves, to be compared with.

What stands in for the layers of a peer only records that nobody here decided anything.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from kankaku.controllers.operation.close_up import NO_CEILING_MPS, no_advice
from kankaku.controllers.options import OptionError
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Bound, Command, Controller
from kankaku.railway.step.state import NOTHING, Advice, AtOnce, Authority, LineState


class Peer(NamedTuple):
    """A way in which SUMO drives the trains."""

    moving_block: bool
    """Trains are kept apart by their distance; else by the blocks of the line."""
    summary: str


PEERS: Mapping[str, Peer] = {
    "sumo_native_fixed": Peer(
        moving_block=False, summary="SUMO's rail model, one train at a time between two signals"
    ),
    "sumo_native_moving": Peer(
        moving_block=True, summary="SUMO's rail model over its own moving block"
    ),
}


class Unbounded:
    """Stands in for the protection: permits everything, because the peer protects itself."""

    def __init__(self, world: World) -> None:
        trains, nothing = np.ones(world.size), np.full(world.size, NOTHING, dtype=np.intp)
        eoa_m = world.far_m * trains
        permission = AtOnce(world.size).permission(eoa_m)
        bounds = eoa_m, NO_CEILING_MPS * trains, 0.0 * trains
        self._authority = Authority(*bounds, nothing, nothing, permission)

    def initial(self) -> None:
        """Return the memory before the first step: none is needed."""

    def authorise(self, state: LineState, memory: None) -> tuple[Authority, None]:
        """Return authority without bounds."""
        del state
        return self._authority, memory


class Unadvised:
    """Stands in for the operation: asks for nothing."""

    reasons = ()

    def __init__(self, world: World) -> None:
        self._advice = no_advice(world.size)

    def initial(self) -> None:
        """Return the memory before the first step: none is needed."""

    def advise(self, state: LineState, authority: Authority, memory: None) -> tuple[Advice, None]:
        """Return advice that lowers nothing."""
        del state, authority
        return self._advice, memory


class Onlooker:
    """Stands in for the drive: commands nothing that the engine would follow."""

    def command(self, state: LineState, authority: Authority, advice: Advice) -> Command:
        """Return the present speeds."""
        del authority, advice
        bound = np.full(state.speed_mps.size, Bound.PEER, dtype=np.intp)
        return Command(state.speed_mps, state.speed_mps[np.newaxis], bound)


def build_peer(name: str, peer: str, world: World) -> Controller:
    """
    Build what stands in for the layers of a peer.

    Parameters
    ----------
    name
        Name of the controller.
    peer
        One of ``PEERS``.
    world
        The line and its trains.

    Returns
    -------
    Controller
        Layers that decide nothing.

    Raises
    ------
    OptionError
        If the peer is unknown, or the line has not what it needs.
    """
    if peer not in PEERS:
        problem = f"{peer!r} is not known"
        raise OptionError(problem, ", ".join(PEERS))
    if world.line.network:
        problem = f"{peer!r} runs on chains only, and the line is a network"
        raise OptionError(problem, "a protection and an operation")
    if not (PEERS[peer].moving_block or world.line.blocks):
        problem = f"{peer!r} needs blocks, and the line has none"
        raise OptionError(problem, "a line with blocks.csv, or sumo_native_moving")
    return Controller(name, Unbounded(world), Unadvised(world), Onlooker(), peer=True)
