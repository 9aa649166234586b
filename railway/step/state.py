"""What crosses the rooms each step: what is, what is allowed, what is advised."""

from enum import IntEnum
from typing import NamedTuple, TypeVar

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain
from kankaku.railway.step.obstructions import WaysideState


class Reason(IntEnum):
    """What bound a train's speed in a step; the same words for every controller."""

    TRACTION = 0
    LINE_LIMIT = 1
    TRAIN_AHEAD = 2
    OBSTRUCTION_AHEAD = 3
    """Points, a level crossing or a closure that is not granted."""
    STATION_STOP = 4
    PLAN = 5
    """The operation asks for it, in a word of its own."""
    EMERGENCY = 6
    PEER = 7
    DWELLING = 8
    """The stop itself holds the train."""
    HELD = 9
    """The stop is over, and supervision keeps the train at its platform, doors closed."""


NOTHING = -1
"""What stands behind a bound is the row of a train, a place beside the track, or this."""


Column = TypeVar("Column", int, IntArray)


def beside(column: Column) -> Column:
    """
    Return the number of a place beside the track, as what stands behind a bound.

    Parameters
    ----------
    column
        Its column in :class:`~kankaku.railway.step.obstructions.WaysideState`: turnouts, then level
        crossings, then closures; -1 for none.

    Returns
    -------
    Column
        Below ``NOTHING``, as rows of trains are above it; ``NOTHING`` for none.
    """
    return NOTHING - 1 - column


NO_VERSION = -1
"""Of nothing that ever was: whoever has made nothing yet remembers this."""


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


class RadioState(NamedTuple):
    """
    What has arrived by now; arrays of shape (n_trains,).

    Messages go by the numbers of their cycles, which are never rounded; ``NEVER`` where nothing has
    arrived. The times are the same in seconds, -inf for never.
    """

    reported: IntArray
    """Cycle of the last report that the centre has."""
    heard: IntArray
    """Cycle of the last commands that the train has."""
    acknowledged: IntArray
    """The centre knows that the train has commands of this cycle or a later one."""
    reported_s: FloatArray
    """When that report was made. [s]"""
    heard_s: FloatArray
    """When those commands were sent. [s]"""
    acknowledged_s: FloatArray
    """When these commands were sent. [s]"""
    reports_version: int
    """Another one when what the centre has is another."""
    telegrams_version: int
    """Another one when what trains have is another."""


class UnitState(NamedTuple):
    """What units measure; arrays of shape (n_trains,)."""

    odometer_m: FloatArray
    """Distance that each train's wheels have counted, from its origin's chainage on. [m]"""
    wheels_mps: FloatArray
    """Speed by the wheels. [m/s]"""
    balise_m: FloatArray
    """The balise that was passed last, or the origin. [m]"""
    counted_m: FloatArray
    """What the odometer said there. [m]"""
    clock_error_s: FloatArray
    """By how much the clock of each train is ahead. [s]"""
    centre_clock_error_s: float
    """By how much the centre's clock is ahead. [s]"""


class Whereabouts(NamedTuple):
    """What compiled functions read of the trains in every step; see :class:`LineState`."""

    front_m: FloatArray
    tail_m: FloatArray
    speed_mps: FloatArray
    present: BoolArray
    running: BoolArray
    rows: IntArray
    """Rows of the trains that are present: what steps loop over. shape (n_present,)"""


class Orders(NamedTuple):
    """
    What supervision decides at platforms; arrays of shape (n_trains,).

    Orders stay in force until they are replaced. Those for a train that runs are empty words: only
    where a train stands it can be held.
    """

    hold_open_until_s: FloatArray
    """The stop is extended up to here, doors open; ``NO_HOLD_S`` for none. [s]"""
    hold_closed_until_s: FloatArray
    """
    Up to here a train stays at its platform, doors closed, once its stop is over. [s]

    ``NO_HOLD_S`` for none.
    """
    arrive_by_s: FloatArray
    """Aimed arrival at the next call, for operations that aim at any; nan: as booked. [s]"""
    again_s: float
    """Supervision is asked again at this time, whatever happens before; inf: at events only. [s]"""


NO_HOLD_S = -np.inf
"""Supervision holds no train. [s]"""


def no_orders(trains: int) -> Orders:
    """
    Return that supervision decides nothing.

    Parameters
    ----------
    trains
        Number of trains. [-]

    Returns
    -------
    Orders
        Nobody is held, arrivals are aimed at as booked, and nobody need ask again.
    """
    held_s = np.full(trains, NO_HOLD_S)
    return Orders(held_s, held_s, np.full(trains, np.nan), np.inf)


class LineState(NamedTuple):
    """
    The line at one moment; arrays have shape (n_trains,), first train first.

    Rows stay the same for a whole run, so that leaders, plans and records never need
    re-indexing. A row whose train is not ``present`` holds a valid but meaningless place.

    What changes with events only has a version: as long as that is the same number, so are the
    arrays, and who remembers what it made of them need not make it anew.
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
    granted_to_m: FloatArray
    """Where the first points that are not granted, or the first obstruction, begin. [m]"""
    granted_by: IntArray
    """Which points or obstruction, by :func:`beside`; ``NOTHING`` where all is granted."""
    next_call: IntArray
    """The call ahead, or the present one while standing at it."""
    stop_m: FloatArray
    """Stop position of that call. [m]"""
    arrival_s: FloatArray
    """When the last call began. [s]"""
    events: Events
    wayside: WaysideState
    calls_version: int
    """Of ``present``, ``running``, ``next_call``, ``stop_m`` and ``arrival_s``."""
    wayside_version: int
    """Of ``wayside``, ``granted_to_m`` and ``granted_by``."""
    radio: RadioState | None = None
    """What has arrived by radio; None under a controller without."""
    units: UnitState | None = None
    """What units measure, where they may be wrong; None where all of them are exact."""
    orders: Orders | None = None
    """
    What supervision decides, or has decided last when it is asked anew.

    Protection never sees it. None under a controller without supervision.
    """

    @property
    def whereabouts(self) -> Plain:
        """The fields of :class:`Whereabouts`."""
        rows = np.flatnonzero(self.present)
        return self.front_m, self.tail_m, self.speed_mps, self.present, self.running, rows

    @property
    def lasting(self) -> Plain:
        """The fields of :class:`~kankaku.railway.step.bundles.Lasting`."""
        granted = self.granted_to_m, self.granted_by
        calls = self.next_call, self.stop_m, self.arrival_s
        return (self.leader, self.follows, *granted, *calls)

    @property
    def instant(self) -> Plain:
        """What compiled steps of layers read; see :mod:`kankaku.railway.step.bundles`."""
        return self.time_s, self.whereabouts, self.clear_to_m, self.lasting


class RadioPermission(NamedTuple):
    """What trains know that take their commands by radio; arrays of shape (n_trains,)."""

    emergency: BoolArray
    """The train brakes in emergency, whatever its authority."""
    commanded_mps: FloatArray
    """Speed that the centre has planned for the end of the step, inf where none. [m/s]"""
    covered_m: FloatArray
    """The furthest end that the train may still go by, as far as the centre knows. [m]"""


class AtOnce:
    """What there is to know of a radio where permissions reach the trains at once."""

    def __init__(self, trains: int) -> None:
        self._nobody = np.zeros(trains, dtype=np.bool_)
        self._uncommanded_mps = np.full(trains, np.inf)

    def permission(self, eoa_m: FloatArray) -> RadioPermission:
        """
        Return that nobody brakes in emergency, or is commanded any speed.

        Parameters
        ----------
        eoa_m
            Ends of authority, by which trains go at once. [m], shape (n_trains,)

        Returns
        -------
        RadioPermission
            Nothing else is covered.
        """
        return RadioPermission(self._nobody, self._uncommanded_mps, eoa_m)


class Authority(NamedTuple):
    """What protection permits; arrays of shape (n_trains,)."""

    eoa_m: FloatArray
    """The front must be able to stop before this with the service brake. [m]"""
    ceiling_mps: FloatArray
    """Speed not to be exceeded at the end of the step. [m/s]"""
    delay_s: FloatArray
    """The front counts as this much time of running further ahead. [s]"""
    eoa_by: IntArray
    """
    What ends the way: row of the train ahead, a place as from :func:`beside`, or ``NOTHING``.

    Nothing ends it at the end of the line.
    """
    ceiling_by: IntArray
    """What is ahead that makes the ceiling low; ``NOTHING`` where it is the line's own."""
    permission: RadioPermission
    """What came by radio; from :class:`AtOnce` for a protection that needs none."""


def authority_of(told: Plain, permission: RadioPermission) -> Authority:
    """
    Return the authority of what a compiled step tells.

    Parameters
    ----------
    told
        All fields of :class:`Authority` but the last.
    permission
        The last one.

    Returns
    -------
    Authority
        With its names.
    """
    eoa_m, ceiling_mps, delay_s, eoa_by, ceiling_by = told
    return Authority(eoa_m, ceiling_mps, delay_s, eoa_by, ceiling_by, permission)


class Advice(NamedTuple):
    """What operation asks of the drive; it can only lower. Arrays of shape (n_trains,)."""

    ceiling_mps: FloatArray
    reason: IntArray
    """Which of the operation's own ``reasons`` lowers it; ``NO_REASON`` where none does."""
    cause: IntArray
    """What the operation does it for: train, place beside the track, or ``NOTHING``."""


NO_REASON = -1
"""The operation asks for nothing."""
