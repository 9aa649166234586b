"""The contract of whatever moves the trains."""

from typing import NamedTuple, Protocol

from kankaku.railway.arrays import FloatArray


class Observation(NamedTuple):
    """What an engine reports at the start of a step; rows as in the timetable."""

    time_s: float
    front_m: FloatArray
    """Chainage of each front: its origin until it enters, the line's end once it left. [m]"""
    speed_mps: FloatArray
    """Speed, 0 for a train not on the line. [m/s], shape (n_trains,)"""
    entered: tuple[int, ...] = ()
    """Trains that appeared at their origin since the last observation."""
    stopped: tuple[int, ...] = ()
    """Trains whose booked stop began."""
    released: tuple[int, ...] = ()
    """Trains whose booked stop is over."""
    left: tuple[int, ...] = ()
    """Trains that passed the end of the line, or whose service ended at their last stop."""
    collided: tuple[int, ...] = ()
    """Trains that the engine itself saw colliding."""


class Engine(Protocol):
    """
    Moves trains exactly as commanded and runs their stops.

    The first observation is before the first train's booked arrival at its origin. A train
    enters at its origin's stop position, standing, once its platform is free, and its stop
    begins at once, in the same observation. A stop begins when a train moves at 0.1 m/s or
    less within half a metre of the stop position of its next call, and lasts until both the
    booked departure and arrival + minimum dwell + dwell delay have passed. What a train
    does that runs past its stop is not defined. A train leaves when its front passes the
    end of the line; one that ``World.leaves_at_stop`` names leaves when its last stop is over,
    released and left in the same observation.

    :meth:`hold` extends stops: one that is held lasts until that time has passed, too.
    """

    def observe(self) -> Observation:
        """Return what is, once per step."""
        ...

    def apply(self, speed_mps: FloatArray) -> None:
        """
        Command the speed at the end of the next step for every train not held by a stop.

        Parameters
        ----------
        speed_mps
            Next speeds; entries of other trains are ignored. [m/s], shape (n_trains,)
        """
        ...

    def hold(self, until_s: FloatArray) -> None:
        """
        Let no stop that lasts now end before a time; earlier such words do not count any more.

        A stop that would be over but for them ends in the next step at the earliest.

        Parameters
        ----------
        until_s
            Seconds after midnight, minus infinity where a stop is not extended; entries of trains
            not held by a stop are ignored. [s], shape (n_trains,)
        """
        ...

    def advance(self) -> None:
        """Move on by one step of constant acceleration."""
        ...
