"""No supervision: trains leave as soon as their stops are over and their way is clear."""

from dataclasses import dataclass

from kankaku.railway.plan.world import World


@dataclass(frozen=True, slots=True)
class NoSupervisionOptions:
    """There is nothing to choose."""


def nobody(world: World, options: NoSupervisionOptions) -> None:
    """
    Return that nobody decides at platforms.

    Parameters
    ----------
    world
        Not used.
    options
        Not used.
    """
    del world, options
