"""
What stands in the way beside trains: points, level crossings, work zones, failed equipment.

All of them are the same kind of thing, an *obstruction*: a stretch of track that a train may
not enter until it is proven to be out of the way (Sugiyama 2018, section 2.2.3).
"""

from dataclasses import dataclass
from enum import Enum


class Cause(Enum):
    """Why a stretch of track is obstructed."""

    POINTS = "points"
    OBSTACLE = "obstacle"
    WORK = "work"
    FAILURE = "fault"


SUDDEN = frozenset({Cause.OBSTACLE, Cause.FAILURE})
"""What comes unannounced, however near a train is. The others wait for the trains."""


@dataclass(frozen=True, slots=True)
class Closure:
    """
    A stretch of track that is closed for a time: a work zone or failed equipment.

    A work zone is announced and waits for the trains that could not stop short of it any more;
    a failure is there at once, and nobody knows when it will be repaired.
    """

    id: str
    cause: Cause
    tracks: tuple[str, ...]
    start_m: float
    end_m: float
    from_s: float
    until_s: float
    """Announced end; inf where nobody knows. [s]"""
    released_s: float
    """When it is really released. [s]"""


@dataclass(frozen=True, slots=True)
class PointsFailure:
    """Points that do not throw in a time window."""

    turnout: str
    from_s: float
    until_s: float


@dataclass(frozen=True, slots=True)
class Obstacle:
    """Something that stands on a level crossing in a time window."""

    crossing: str
    from_s: float
    until_s: float


@dataclass(frozen=True, slots=True)
class Disruptions:
    """What goes wrong beside the track, in windows and at random."""

    closures: tuple[Closure, ...] = ()
    points_failures: tuple[PointsFailure, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()
    points_failure_ratio: float = 0.0
    """Share of all throws that fail at random. [-]"""
    points_repair_s: float = 300.0
    """How long it takes to repair points that failed at random. [s]"""
    obstacle_ratio: float = 0.0
    """Share of all closings of a level crossing that catch somebody on it. [-]"""
    obstacle_s: float = 60.0
    """How long it then stays obstructed. [s]"""


UNDISTURBED = Disruptions()
