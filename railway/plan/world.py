"""What every controller knows beforehand: line, fleet and timetable as arrays; no delays."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.plan.brake_table import BrakeTable
from kankaku.railway.plan.buffers import Buffers
from kankaku.railway.plan.driving_style import FASTEST, DrivingStyle
from kankaku.railway.plan.dwell import NO_DELAYS, DwellDelays
from kankaku.railway.plan.line import Direction, Line
from kankaku.railway.plan.met import lines_met
from kankaku.railway.plan.passing import Passage, Precursors, Predecessor, passages
from kankaku.railway.plan.profile import NO_BUFFERS, Profile, build_profile
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.timetable import Service, Timetable
from kankaku.railway.plan.turns import orders

BUFFER_STOP_M = 1.0
"""A train whose last stop is nearer to the end of the line than this runs on no more. [m]"""
STEP_ROUNDING = 1e-6
"""So little of a step is none. [-]"""


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
    """One for each row of the profile: in a network a type occurs once by what it meets."""
    lines: tuple[Line, ...]
    """The line as each of them meets it."""
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
    driving: DrivingStyle = FASTEST
    """How the trains are driven."""
    expected_delays: DwellDelays = NO_DELAYS
    """How long trains overstay, as far as it is known beforehand: measured, not drawn."""
    foretold_delay_s: FloatArray | None = None
    """The drawn dwell delays, for controllers that know the future; None for all others."""

    @property
    def size(self) -> int:
        """Number of trains."""
        return self.type_index.size

    def tabulated(self, buffers: Buffers = NO_BUFFERS) -> Profile:
        """
        Tabulate the line for the trains.

        Parameters
        ----------
        buffers
            By how much trains count as longer than they are where limits start and end.

        Returns
        -------
        Profile
            A row for each of the train types.
        """
        return build_profile(self.lines, self.train_types, buffers)

    def driven_as(self, driving: DrivingStyle | None) -> "World":
        """
        Return the same world with its trains driven in another style.

        Parameters
        ----------
        driving
            The style; None for the present one.

        Returns
        -------
        World
            The same where it is the present one.
        """
        if driving is None or driving == self.driving:
            return self
        return replace(self, driving=driving)

    @cached_property
    def driven_types(self) -> tuple[TrainType, ...]:
        """The train types as their drivers use them."""
        if not self.driving.lowers:
            return self.train_types
        return tuple(map(self.driving.train, self.train_types))

    @cached_property
    def driven_profile(self) -> Profile:
        """The line as trains are driven on it when they are late, if that makes any difference."""
        return self.driven() if self.driving.lowers else self.profile

    def driven(self, buffers: Buffers = NO_BUFFERS) -> Profile:
        """
        Tabulate the line as late trains are driven on it.

        Parameters
        ----------
        buffers
            By how much trains count as longer than they are where limits start and end.

        Returns
        -------
        Profile
            A row for each of the train types.
        """
        if not self.driving.lowers:
            return self.tabulated(buffers)
        return self._driven_as(self.driving.hurried, buffers)

    @cached_property
    def unhurried_profile(self) -> Profile:
        """The line as trains are driven on it when they are not late, nobody in their way."""
        if not self.driving.hurries:
            return self.driven_profile
        return self._driven_as(self.driving, NO_BUFFERS)

    def _driven_as(self, style: DrivingStyle, buffers: Buffers) -> Profile:
        profile = build_profile(list(map(style.line, self.lines)), self.driven_types, buffers)
        return replace(profile, coasting_band_mps=style.coasting_band_mps)

    @cached_property
    def gentler_mps2(self) -> FloatArray:
        """By how much drivers brake more gently for stops than they could. [m/s2], (n_trains,)"""
        driven_mps2 = np.array([kind.service_brake_mps2 for kind in self.driven_types])
        gentler: FloatArray = self.of_type("service_brake_mps2") - driven_mps2[self.type_index]
        return gentler

    @property
    def reaction_s(self) -> float:
        """From when a train may depart until it moves, in whole steps. [s]"""
        steps = math.ceil(self.driving.departure_reaction_s / self.step_s - STEP_ROUNDING)
        return steps * self.step_s

    @cached_property
    def departure_lag_s(self) -> FloatArray:
        """From when each train may depart until full traction would have set it off. (n_trains,)"""
        late_s = self.reaction_s - self.driving.departure_reaction_s
        lag_s = np.array([self.driving.lag_s(kind) for kind in self.train_types])
        return late_s + lag_s[self.type_index]

    def line_of(self, row: int) -> Line:
        """
        Return the line as a train meets it.

        Parameters
        ----------
        row
            The train.

        Returns
        -------
        Line
            In the coordinate of its route.
        """
        return self.lines[int(self.type_index[row])]

    @cached_property
    def passages(self) -> tuple[tuple[Passage, ...], ...]:
        """The tracks of every train's route, as it passes them."""
        ways = {service.route: passages(self.line, service.route) for service in self._services}
        return tuple(ways[service.route] for service in self._services)

    @cached_property
    def orders(self) -> tuple[Precursors, ...]:
        """Who goes before each train."""
        return orders(self.line, self._services)

    @property
    def _services(self) -> tuple[Service, ...]:
        return self.timetable.services

    @cached_property
    def falling(self) -> BoolArray:
        """Trains towards lower chainage. shape (n_trains,)"""
        track = self.line.track_by_id
        ways = [track[service.route[0]].direction for service in self._services]
        return np.array([way is Direction.FALLING for way in ways], dtype=np.bool_)

    @cached_property
    def stock_from(self) -> IntArray:
        """The train whose stock each train takes over where that ends; -1 for none. (n_trains,)"""
        row_of = {train: row for row, train in enumerate(self.timetable.trains)}
        found = np.full(self.size, -1, dtype=np.intp)
        for row, service in enumerate(self._services):
            if service.next_train:
                found[row_of[service.next_train]] = row
        return found

    @cached_property
    def enters_after(self) -> tuple[tuple[Predecessor, ...], ...]:
        """
        The trains that must have passed the origin of each train before it enters.

        Of a chain none: a train enters as soon as its platform is free.
        """
        if not self.line.network:
            return ((),) * self.size
        found, origin_m = [], self.stop_m[:, 0] - self.length_m
        for row, order in enumerate(self.orders):
            ahead = order.ahead[0]
            # Who begins further on is not in the way, but who was before it may be.
            while (
                ahead.row >= 0 and ahead.passage == 0 and origin_m[ahead.row] >= self.stop_m[row, 0]
            ):
                ahead = self.orders[ahead.row].ahead[0]
            before = {one for one in (ahead, *order.waits[0]) if one.row >= 0}
            stock = int(self.stock_from[row])
            if stock >= 0:
                before = {one for one in before if one.row != stock}
                before.add(Predecessor(stock, len(self._services[stock].route)))
            found.append(tuple(sorted(before)))
        return tuple(found)

    def chainage_m(self, row: IntArray | int, place_m: FloatArray) -> FloatArray:
        """
        Return the chainage of places on trains' routes.

        Parameters
        ----------
        row
            The trains. shape broadcastable with the places
        place_m
            In the coordinates of their routes. [m], any shape

        Returns
        -------
        FloatArray
            As people tell it. [m], same shape
        """
        if not self.line.network:
            return place_m
        mirrored_m = self.line.start_m + self.line.end_m - place_m
        return np.where(self.falling[row], mirrored_m, place_m)

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
    line: Line,
    train_types: Mapping[str, TrainType],
    timetable: Timetable,
    step_s: float,
    driving: DrivingStyle = FASTEST,
    expected_delays: DwellDelays = NO_DELAYS,
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
    driving
        How the trains are driven.
    expected_delays
        How long trains overstay. Overstays that are named are left out: nobody expects them.

    Returns
    -------
    World
        The arrays.
    """
    services = timetable.services
    kinds, lines, type_index = _kinds(line, train_types, services)
    profile = build_profile(lines, kinds)
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
        lines=lines,
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
        driving=driving,
        expected_delays=replace(expected_delays, overstays=()),
    )


def _kinds(
    line: Line, train_types: Mapping[str, TrainType], services: Sequence[Service]
) -> tuple[tuple[TrainType, ...], tuple[Line, ...], IntArray]:
    """Return train types and the line as each of them meets it, and which is each train's."""
    if not line.network:
        row_of = {name: row for row, name in enumerate(train_types)}
        kinds = tuple(train_types.values())
        lines = (line,) * len(kinds)
        return kinds, lines, np.array([row_of[s.train_type] for s in services], dtype=np.intp)
    met_on = lines_met(line, [service.route for service in services])
    pairs = [(service.train_type, met_on[service.route]) for service in services]
    numbers: dict[tuple[str, int], int] = {}
    for name, met in pairs:
        numbers.setdefault((name, id(met)), len(numbers))
    type_index = np.array([numbers[name, id(met)] for name, met in pairs], dtype=np.intp)
    first = [int(np.argmax(type_index == number)) for number in range(len(numbers))]
    return (
        tuple(train_types[pairs[row][0]] for row in first),
        tuple(pairs[row][1] for row in first),
        type_index,
    )
