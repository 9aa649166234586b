"""What protections over fixed blocks share."""

from kankaku.controllers.options import OptionError
from kankaku.railway.plan.world import World
from kankaku.railway.wayside.detection import Detection


def detection_on(world: World) -> Detection:
    """
    Return the track circuits and blocks of a line.

    Parameters
    ----------
    world
        The line and its trains.

    Returns
    -------
    Detection
        The circuits.

    Raises
    ------
    OptionError
        If the line has no blocks.
    """
    if not world.line.blocks:
        problem, allowed = "the line has no blocks", "a line with blocks.csv"
        raise OptionError(problem, allowed)
    return Detection(world)
