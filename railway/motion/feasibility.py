"""Whether trains can start, climb, hold and stop wherever their services take them."""

from collections.abc import Mapping, Sequence
from enum import StrEnum
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import GRAVITY_MPS2, FloatArray
from kankaku.railway.motion.driving import Driving, trace
from kankaku.railway.motion.run_curve import fastest
from kankaku.railway.motion.way import Way, way_on
from kankaku.railway.plan.line import Direction, Line
from kankaku.railway.plan.met import lines_met
from kankaku.railway.plan.profile import Profile, build_profile
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.timetable import Call, Service, Timetable
from kankaku.railway.plan.world import leaves_at_stop

RESERVE_MPS2 = 0.05
"""A brake takes at least this much more than gravity does, or its curve has no end. [m/s2]"""
HURRIED_S = 1.0
"""Timetables cut fractions of a second off: a booking may be this much too fast. [s]"""


class Lack(StrEnum):
    """What a train is too weak for."""

    STARTING = "starting"
    CLIMBING = "climbing"
    SERVICE_BRAKE = "service_brake"
    EMERGENCY_BRAKE = "emergency_brake"


class Leg(NamedTuple):
    """The way of a type of train from one stop to the next one, or out of the line."""

    train_type: str
    origin: str
    destination: str
    """Station that it runs to; empty on the way out of the line."""
    start_m: float
    end_m: float

    def __str__(self) -> str:
        to = f"to {self.destination!r}" if self.destination else "out of the line"
        return f"from {self.origin!r} {to}"


class Shortfall(NamedTuple):
    """A type of train is too weak for a place."""

    lack: Lack
    leg: Leg
    place_m: float
    """Chainage of the front. [m]"""
    gradient: float
    """Mean over the train there; rising is positive. [-]"""
    available: float
    """Starting tractive force [N], or what a brake takes on the level. [m/s2]"""
    needed: float
    """It must be above this; not a number where only a run tells. [N] or [m/s2]"""

    def __str__(self) -> str:
        at = f"{self._place}, {1000.0 * self.gradient:.3g} permil"
        if self.lack is Lack.STARTING:
            force = f"{self.available / 1000.0:.4g} kN do not start the train"
            return f"{force} at {at}: it takes {self.needed / 1000.0:.4g} kN"
        if self.lack is Lack.CLIMBING:
            force = f"{self.available / 1000.0:.4g} kN do not bring the train {self.leg}"
            return f"{force}: it stalls at {at}"
        brake = f"{3.6 * self.available:.3g} km/h/s do not hold the train {self.leg}"
        pull = 3.6 * (self.needed - RESERVE_MPS2)
        return f"{brake} at {at}: gravity pulls with {pull:.3g} km/h/s"

    @property
    def _place(self) -> str:
        where = f"km {self.place_m / 1000.0:.3f}"
        return f"{self.leg.origin!r}, {where}" if self.place_m == self.leg.start_m else where


class Hurry(NamedTuple):
    """A leg that is booked faster than its train can run."""

    leg: Leg
    booked_s: float
    """The shortest of its bookings. [s]"""
    least_s: float
    trains: int

    def __str__(self) -> str:
        trains = f"{self.trains} train{'s' if self.trains > 1 else ''}"
        # Rounded down, because no run is faster.
        least_s = np.floor(10.0 * self.least_s) / 10.0
        booked = f"booked {self.booked_s:g} s, at least {least_s:.1f} s; {trains}"
        return f"{self.leg.train_type} {self.leg}: {booked}"


class Feasibility(NamedTuple):
    """What is found out about the trains of a timetable."""

    shortfalls: tuple[Shortfall, ...]
    hurries: tuple[Hurry, ...]


def assess(line: Line, train_types: Mapping[str, TrainType], timetable: Timetable) -> Feasibility:
    """
    Find out what trains are too weak for, and what is booked too fast.

    Every type runs every distinct leg of its services once, alone and as fast as it can; in a
    network, whatever its route meets. A train that has to stop behind another one on a ramp, and
    cannot start there, is not looked for.

    Parameters
    ----------
    line
        The line.
    train_types
        Train types by identifier.
    timetable
        Their services.

    Returns
    -------
    Feasibility
        At most one shortfall of starting and of each brake by train type and what it meets, the
        worst.
    """
    met_on = lines_met(line, [service.route for service in timetable.services])
    groups: dict[tuple[int, Direction], list[Service]] = {}
    for service in timetable.services:
        direction = line.track_by_id[service.route[0]].direction
        groups.setdefault((id(met_on[service.route]), direction), []).append(service)
    shortfalls: list[Shortfall] = []
    hurries: list[Hurry] = []
    for (_, direction), services in groups.items():
        weak, hurried = _assess(met_on[services[0].route], train_types, services)
        if direction is Direction.FALLING:
            weak = tuple(_told(line, shortfall) for shortfall in weak)
        shortfalls += weak
        hurries += hurried
    return Feasibility(tuple(shortfalls), tuple(hurries))


def _told(line: Line, met: Shortfall) -> Shortfall:
    """Return a shortfall of a falling train with places by chainage."""
    start_m, end_m = line.mirrored_m(met.leg.start_m), line.mirrored_m(met.leg.end_m)
    leg = met.leg._replace(start_m=start_m, end_m=end_m)
    return met._replace(leg=leg, place_m=line.mirrored_m(met.place_m))


def _assess(
    line: Line, train_types: Mapping[str, TrainType], services: Sequence[Service]
) -> Feasibility:
    """Assess trains that meet the same line."""
    bookings = _bookings(line, services)
    shortfalls: list[Shortfall] = []
    hurries: list[Hurry] = []
    for name, train_type in train_types.items():
        legs = [leg for leg in bookings if leg.train_type == name]
        if not legs:
            continue
        alone = _Alone(line, train_type, build_profile(line, [train_type]))
        weak = _starting(alone, legs) + _braking(alone, legs)
        # A run that cannot brake, or not even begin, tells nothing of what it can climb.
        weak = weak or _climbing(alone, legs)
        shortfalls += weak
        if not weak:
            hurries += _hurries(alone, {leg: bookings[leg] for leg in legs})
    return Feasibility(tuple(shortfalls), tuple(hurries))


def gradients(line: Line, train_type: TrainType, fronts_m: FloatArray) -> FloatArray:
    """
    Return the gradient averaged over a train.

    Parameters
    ----------
    line
        The line.
    train_type
        The train.
    fronts_m
        Where its front is. [m], shape (n_places,)

    Returns
    -------
    FloatArray
        Rising is positive. [-], shape (n_places,)
    """
    rise_m = line.height_m(fronts_m) - line.height_m(fronts_m - train_type.length_m)
    gradient: FloatArray = rise_m / train_type.length_m
    return gradient


def starting_needs_n(line: Line, train_type: TrainType, fronts_m: FloatArray) -> FloatArray:
    """
    Return the force that a train needs more than to start.

    Parameters
    ----------
    line
        The line.
    train_type
        The train.
    fronts_m
        Where its front stands. [m], shape (n_places,)

    Returns
    -------
    FloatArray
        Against gravity, curves and rolling resistance. [N], shape (n_places,)
    """
    length_m = train_type.length_m
    along_m = np.arange(0.5, max(np.floor(length_m), 1.0))
    places_m = fronts_m[:, np.newaxis] - along_m * length_m / along_m.size
    curves_mps2 = line.curve_resistance_mps2(
        places_m, curve_resistance_m=train_type.curve_resistance_m
    ).mean(axis=1)
    gravity_mps2 = GRAVITY_MPS2 * gradients(line, train_type, fronts_m)
    rolling_n = float(train_type.resistance.force_n(np.zeros(1))[0])
    needed_n: FloatArray = rolling_n + train_type.mass_kg * (gravity_mps2 + curves_mps2)
    return needed_n


def _bookings(line: Line, services: Sequence[Service]) -> dict[Leg, list[float]]:
    """Return the booked run times of every distinct leg; none on the way out of the line."""
    bookings: dict[Leg, list[float]] = {}
    for service in services:
        for call, after in pairwise(service.calls):
            leg = Leg(service.train_type, call.station, after.station, call.stop_m, after.stop_m)
            bookings.setdefault(leg, []).append(after.arrival_s - call.departure_s)
        last: Call = service.calls[-1]
        end_m = last.stop_m if leaves_at_stop(line, service) else line.end_m
        out = Leg(service.train_type, last.station, "", last.stop_m, end_m)
        bookings.setdefault(out, [])
    return bookings


class _Alone(NamedTuple):
    """A train alone on the line."""

    line: Line
    train_type: TrainType
    profile: Profile

    def gradient(self, fronts_m: FloatArray) -> FloatArray:
        return gradients(self.line, self.train_type, fronts_m)

    def way(self, leg: Leg) -> Way:
        """Return the way of a leg, from a stand."""
        end_mps = 0.0 if leg.destination else self.train_type.maximum_speed_mps
        ends_m = leg.start_m, leg.end_m
        return way_on(self.profile, 0, self.train_type, ends_m, (0.0, end_mps))


def _starting(alone: _Alone, legs: Sequence[Leg]) -> list[Shortfall]:
    """Return where a train that should run on lacks most force to start."""
    starts = [leg for leg in legs if leg.end_m > leg.start_m]
    if not starts:
        return []
    available_n = alone.train_type.traction.starting_force_n
    starts_m = np.array([leg.start_m for leg in starts])
    needed_n = starting_needs_n(alone.line, alone.train_type, starts_m)
    worst = int(needed_n.argmax())
    if available_n > needed_n[worst]:
        return []
    place = starts[worst], starts[worst].start_m, float(alone.gradient(starts_m)[worst])
    return [Shortfall(Lack.STARTING, *place, available_n, float(needed_n[worst]))]


def _climbing(alone: _Alone, legs: Sequence[Leg]) -> list[Shortfall]:
    """Return the legs on which a train stalls although nobody is in its way."""
    found = []
    for leg in legs:
        if leg.end_m <= leg.start_m:
            continue
        way = alone.way(leg)
        energy = trace(way, Driving.fastest(way)).energy_m2ps2
        stands = np.flatnonzero(energy[1:-1] <= 0.0)
        if stands.size:
            place_m = float(way.chainage_m[stands[0] + 1])
            gradient = float(alone.gradient(np.array([place_m]))[0])
            force_n = alone.train_type.traction.starting_force_n
            found.append(Shortfall(Lack.CLIMBING, leg, place_m, gradient, force_n, np.nan))
    return found


def _braking(alone: _Alone, legs: Sequence[Leg]) -> list[Shortfall]:
    """Return where gravity is too strong for a brake: on descents, and at stops either way."""
    places = [_steepest(alone, leg) for leg in legs]
    slope, place_m, leg = max(places, key=lambda place: abs(place[0]))
    needed = GRAVITY_MPS2 * alone.train_type.brake_gravity_ratio * abs(slope) + RESERVE_MPS2
    brakes = {
        Lack.SERVICE_BRAKE: alone.train_type.service_brake_mps2,
        Lack.EMERGENCY_BRAKE: alone.train_type.emergency_brake_mps2,
    }
    return [
        Shortfall(lack, leg, place_m, slope, available, needed)
        for lack, available in brakes.items()
        if available <= needed
    ]


def _steepest(alone: _Alone, leg: Leg) -> tuple[float, float, Leg]:
    """Return the gradient of a leg that asks most of a brake, and where that is."""
    grid_m = alone.profile.grid_m
    inside_m = grid_m[(grid_m > leg.start_m) & (grid_m < leg.end_m)]
    places_m = np.concatenate([[leg.start_m], inside_m, [leg.end_m]])
    gradient = alone.gradient(places_m)
    pull = np.maximum(-gradient, 0.0)
    # A train that stands must not roll back either.
    pull[0] = abs(gradient[0])
    if leg.destination:
        pull[-1] = abs(gradient[-1])
    # The first of places that are equal but for rounding.
    worst = int(np.round(pull, 9).argmax())
    return float(gradient[worst]) if pull[worst] > 0.0 else 0.0, float(places_m[worst]), leg


def _hurries(alone: _Alone, bookings: Mapping[Leg, Sequence[float]]) -> list[Hurry]:
    found = []
    for leg, booked_s in bookings.items():
        if not booked_s:
            continue
        least_s = fastest(alone.way(leg)).run_time_s
        hurried_s = [run_s for run_s in booked_s if run_s < least_s - HURRIED_S]
        if hurried_s:
            found.append(Hurry(leg, min(hurried_s), least_s, len(hurried_s)))
    return found
