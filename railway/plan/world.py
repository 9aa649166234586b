"""What every controller knows beforehand: line, fleet and timetable as arrays; no delays."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.plan.brake_table import BrakeTable
from kankaku.railway.plan.line import Line
from kankaku.railway.plan.profile import Profile, build_profile
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.timetable import Service, Timetable

BUFFER_STOP_M = 1.0
"""A train whose last stop is nearer to the end of the line than this runs on no more. [m]"""


@dataclass(frozen=True)
class World:
    """
    The timetable of a line in arrays, first train first.

    Call arrays have shape (n_trains, n_calls_max + 1). Past a train's last call the stop
    lies at the end of the tables and the times are infinite, so that an index one beyond
    the last call is valid.
    """

    line: Line
    timetable: Timetable
    train_types: tuple[TrainType, ...]
    profile: Profile
    step_s: float
    type_index: IntArray
    length_m: FloatArray
    call_count: IntArray
    stop_m: FloatArray
    call_track: IntArray
    """Number of the platform track of each call."""
    platform_m: FloatArray
    """Start and end of the platform of each call. [m], shape (2, n_trains, n_calls_max + 1)"""
    booked_arrival_s: FloatArray
    booked_departure_s: FloatArray
    minimum_dwell_s: FloatArray
    leaves_at_stop: BoolArray
    """The train leaves the line when its last stop is over. shape (n_trains,)"""

    @property
    def size(self) -> int:
        """Number of trains."""
        return self.type_index.size

    @cached_property
    def braking(self) -> BrakeTable:
        """Twice the brake potential, as every train meets it."""
        return self.profile.braking(self.type_index)

    @property
    def last_stop_m(self) -> FloatArray:
        """Stop position of each train's last call. [m], shape (n_trains,)"""
        stops_m: FloatArray = self.stop_m[np.arange(self.size), self.call_count - 1]
        return stops_m

    @property
    def far_m(self) -> float:
        """Chainage that stands for "nothing ahead". [m]"""
        return self.profile.end_m - 2.0

    @property
    def greatest_acceleration_mps2(self) -> FloatArray:
        """Of each train, on the steepest descent of the line. [m/s2], shape (n_trains,)"""
        steepest_mps2 = -np.minimum(self.profile.drag_mps2.min(axis=1), 0.0)
        downhill: FloatArray = steepest_mps2[self.type_index]
        return self.of_type("starting_acceleration_mps2") + downhill

    def of_type(self, name: str) -> FloatArray:
        """
        Return a property of each train's type.

        Parameters
        ----------
        name
            Attribute of :class:`~kankaku.railway.plan.rolling_stock.TrainType`.

        Returns
        -------
        FloatArray
            Its value by train. shape (n_trains,)
        """
        values = np.array([getattr(kind, name) for kind in self.train_types], dtype=np.float64)
        return values[self.type_index]


def leaves_at_stop(line: Line, service: Service) -> bool:
    """
    Return whether a train leaves the line when its last stop is over, and runs on no more.

    Parameters
    ----------
    line
        The line.
    service
        The train.

    Returns
    -------
    bool
        It is taken off there, or stands at the buffer stop.
    """
    to_end_m = line.end_m - service.calls[-1].stop_m
    return service.leaves_at_last_call or to_end_m < BUFFER_STOP_M


def build_world(
    line: Line, train_types: Mapping[str, TrainType], timetable: Timetable, step_s: float
) -> World:
    """
    Compile a timetable on a line into arrays.

    Parameters
    ----------
    line
        The line.
    train_types
        Train types by identifier.
    timetable
        Services in order, first train first.
    step_s
        Length of a simulation step. [s]

    Returns
    -------
    World
        The arrays.
    """
    kinds = tuple(train_types.values())
    row_of_kind = {kind.id: row for row, kind in enumerate(kinds)}
    services = timetable.services
    type_index = np.array([row_of_kind[service.train_type] for service in services], dtype=np.intp)
    profile = build_profile(line, kinds)
    shape = (len(services), max(len(service.calls) for service in services) + 1)
    stop_m = np.full(shape, profile.end_m - 2.0)
    number_of_track = {track: number for number, track in enumerate(line.track_by_id)}
    call_track = np.full(shape, -1, dtype=np.intp)
    platform_m = np.full((2, *shape), profile.end_m - 2.0)
    arrival_s, departure_s, dwell_s = (np.full(shape, np.inf) for _ in range(3))
    for row, service in enumerate(services):
        for column, call in enumerate(service.calls):
            stop_m[row, column] = call.stop_m
            call_track[row, column] = number_of_track[call.track]
            platform = line.platform_at[call.station, call.track]
            platform_m[:, row, column] = platform.start_m, platform.end_m
            arrival_s[row, column] = call.arrival_s
            departure_s[row, column] = call.departure_s
            dwell_s[row, column] = call.minimum_dwell_s
    return World(
        line=line,
        timetable=timetable,
        train_types=kinds,
        profile=profile,
        step_s=step_s,
        type_index=type_index,
        length_m=np.array([kinds[row].length_m for row in type_index]),
        call_count=np.array([len(service.calls) for service in services], dtype=np.intp),
        stop_m=stop_m,
        call_track=call_track,
        platform_m=platform_m,
        booked_arrival_s=arrival_s,
        booked_departure_s=departure_s,
        minimum_dwell_s=dwell_s,
        leaves_at_stop=np.array([leaves_at_stop(line, service) for service in services]),
    )
