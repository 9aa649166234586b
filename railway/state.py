"""What crosses the rooms each step: what is, what is allowed, what is advised."""

from enum import IntEnum
from typing import NamedTuple

from railway.arrays import BoolArray, FloatArray, IntArray


class Reason(IntEnum):
    """What bound a train's speed in a step."""

    TRACTION = 0
    LINE_CEILING = 1
    AUTHORITY = 2
    STATION_STOP = 3
    TWO_STAGE = 4
    PRE_DECELERATION = 5
    OPTIMAL_STOP = 6
    APPROACH = 7
    ECO = 8
    PEER = 9


class Events(NamedTuple):
    """Rows of the trains to which something happened since the last step."""

    entered: tuple[int, ...] = ()
    arrived: tuple[int, ...] = ()
    released: tuple[int, ...] = ()
    """The stop is over: doors closed, not necessarily moving yet."""
    departed: tuple[int, ...] = ()
    cleared: tuple[int, ...] = ()
    """The tail left a section."""
    left: tuple[int, ...] = ()

    def __bool__(self) -> bool:
        return any(self)


class LineState(NamedTuple):
    """
    The line at one moment; arrays have shape (n_trains,), first train first.

    Rows stay the same for a whole run, so that leaders, plans and records never need
    re-indexing. A row whose train is not ``present`` holds a valid but meaningless place.
    """

    time_s: float
    front_m: FloatArray
    tail_m: FloatArray
    speed_mps: FloatArray
    present: BoolArray
    """The train is on the line."""
    running: BoolArray
    """The train is on the line and not held by a stop: it takes commands."""
    leader: IntArray
    """Row of the next train ahead that shares the route; -1 where there is none."""
    follows: BoolArray
    """The leader goes or stands on this train's own way, not on another track before points."""
    clear_to_m: FloatArray
    """The way is physically clear up to here: leader's tail or fouling point. [m]"""
    granted_m: FloatArray
    """Fouling point of the first points ahead that are not granted, or far ahead. [m]"""
    next_call: IntArray
    """The call ahead, or the present one while standing at it."""
    stop_m: FloatArray
    """Stop position of that call. [m]"""
    arrival_s: FloatArray
    """When the last call began. [s]"""
    events: Events


class Authority(NamedTuple):
    """What protection permits; arrays of shape (n_trains,)."""

    limit_m: FloatArray
    """The front must be able to stop before this with the service brake. [m]"""
    ceiling_mps: FloatArray
    """Speed not to be exceeded at the end of the step. [m/s]"""
    delay_s: FloatArray
    """The front counts as this much time of running further ahead of its limit. [s]"""


class Advice(NamedTuple):
    """What operation asks of the drive; it can only lower. Arrays of shape (n_trains,)."""

    ceiling_mps: FloatArray
    reason: IntArray
    """Why the ceiling is what it is, as a :class:`Reason`."""
