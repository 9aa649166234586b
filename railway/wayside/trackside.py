"""
The machines beside the track: points, level crossings, closed stretches.

Each one is a column of :class:`~kankaku.railway.step.obstructions.WaysideState`. It knows the next
time, and the next place of every front and tail, at which it can change; in between nobody asks it.
"""

from collections.abc import Sequence

from kankaku.railway.plan.disruptions import Disruptions
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.world import World
from kankaku.railway.wayside.closed_stretch import ClosedStretch
from kankaku.railway.wayside.level_crossing import LevelCrossing
from kankaku.railway.wayside.machine import Machine
from kankaku.railway.wayside.point_machine import GrantedPoints, PointMachine


def machines(world: World, disruptions: Disruptions, seed: int) -> Sequence[Machine]:
    """
    Return everything beside a line.

    Parameters
    ----------
    world
        The line.
    disruptions
        What goes wrong.
    seed
        Seed of what goes wrong at random.

    Returns
    -------
    Sequence[Machine]
        Turnouts, level crossings, closures.
    """
    return (
        *_points(world, disruptions, seed),
        *(LevelCrossing(world, place, disruptions, seed) for place in world.line.crossings),
        *(ClosedStretch(world, closure) for closure in disruptions.closures),
    )


def _points(world: World, disruptions: Disruptions, seed: int) -> Sequence[Machine]:
    if world.line.network:
        return [GrantedPoints(world, place) for place in world.line.turnouts]
    return [PointMachine(world, place, disruptions, seed) for place in world.line.turnouts]


def places_beside(line: Line, disruptions: Disruptions) -> tuple[str, ...]:
    """
    Return what the machines beside a line are called, in their order.

    Parameters
    ----------
    line
        The line.
    disruptions
        What goes wrong.

    Returns
    -------
    tuple[str, ...]
        Identifiers of turnouts, level crossings, closures.
    """
    return (
        *(turnout.id for turnout in line.turnouts),
        *(crossing.id for crossing in line.crossings),
        *(closure.id for closure in disruptions.closures),
    )
