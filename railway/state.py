"""What crosses the rooms each step: what is, what is allowed, what is advised."""

from enum import IntEnum
from typing import NamedTuple

from railway.arrays import BoolArray, FloatArray, IntArray
from railway.faults import UnitState
from railway.obstructions import WaysideState
from railway.radio import RadioState


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
    CONTROL_MAP = 10
    EMERGENCY = 11


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
    signalled: tuple[int, ...] = ()
    """What is in the way of the train beside the track has changed."""

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
    """The way is clear up to here: leader's tail or what is not granted. [m]"""
    granted_m: FloatArray
    """Where the first points that are not granted, or the first obstruction, begin. [m]"""
    next_call: IntArray
    """The call ahead, or the present one while standing at it."""
    stop_m: FloatArray
    """Stop position of that call. [m]"""
    arrival_s: FloatArray
    """When the last call began. [s]"""
    events: Events
    wayside: WaysideState
    radio: RadioState | None = None
    """What has arrived by radio; None under a controller without."""
    units: UnitState | None = None
    """What units measure, where they may be wrong; None where all of them are exact."""


class Link(NamedTuple):
    """What trains know that take their commands by radio; arrays of shape (n_trains,)."""

    emergency: BoolArray
    """The train brakes in emergency, whatever its limit."""
    commanded_mps: FloatArray
    """Speed that the centre has planned for the end of the step, inf where none. [m/s]"""
    covered_m: FloatArray
    """The furthest limit that the train may still go by, as far as the centre knows. [m]"""


class Authority(NamedTuple):
    """What protection permits; arrays of shape (n_trains,)."""

    limit_m: FloatArray
    """The front must be able to stop before this with the service brake. [m]"""
    ceiling_mps: FloatArray
    """Speed not to be exceeded at the end of the step. [m/s]"""
    delay_s: FloatArray
    """The front counts as this much time of running further ahead of its limit. [s]"""
    link: Link | None = None
    """None for a protection whose permissions reach the trains at once."""


class Advice(NamedTuple):
    """What operation asks of the drive; it can only lower. Arrays of shape (n_trains,)."""

    ceiling_mps: FloatArray
    reason: IntArray
    """Why the ceiling is what it is, as a :class:`Reason`."""
