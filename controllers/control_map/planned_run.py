"""
A run along the way ahead: the drive's own formulas on the grid of the control map.

A run keeps its limits as the train will, with the service brake; so the band of a run that
this module returns lies before the limits by construction.
"""

from typing import NamedTuple

import numpy as np

from kankaku.controllers.protection.ceiling import (
    CeilingFigures,
    ceiling_ahead_mps,
    ceiling_figures,
)
from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import compiled
from kankaku.railway.motion.kinematics import next_speed_mps
from kankaku.railway.motion.traction_table import Pull, pull_of, pulled_mps
from kankaku.railway.plan.profile import at, braking_loss_mps
from kankaku.railway.plan.world import World

ARRIVED_M = 0.5
"""A run that comes this near to its stop has arrived. [m]"""
ARRIVED_MPS = 1.0
ROUNDS = 4
"""Newton steps to a stopping place; the brake potential is nearly straight. [-]"""


class Trains(NamedTuple):
    """What the runs of all trains need to know; it stays for a whole run of the simulator."""

    step_s: float
    """Time between the moments of the map. [s]"""
    gentle_mps: float
    """Speed taken in a step where nothing asks for more than a lower plan. [m/s]"""
    early_s: float
    """How much earlier than booked a train is to arrive. [s]"""
    margin_m: float
    """Between a limit and the rear that it keeps clear of. [m]"""
    far_m: float
    end_m: float
    """Where trains leave the line. [m]"""
    square: FloatArray
    """Twice the brake potential. [m2/s2], shape (n_types * n_grid,)"""
    pull: Pull
    row_start: FloatArray
    ceiling: CeilingFigures
    brake_mps2: FloatArray
    length_m: FloatArray
    stop_m: FloatArray
    """shape (n_trains, n_calls + 1)"""
    call_count: IntArray
    booked_arrival_s: FloatArray
    booked_departure_s: FloatArray
    minimum_dwell_s: FloatArray
    leaves_at_stop: BoolArray
    """The train leaves the line at its last stop: nobody counts on that before it has."""


class Pace(NamedTuple):
    """How runs are made; see :class:`Trains`."""

    step_s: float
    gentle_mps2: float
    """Deceleration where nothing asks for more than a lower plan. [m/s2]"""
    early_s: float
    margin_m: float


def trains_of(world: World, pace: Pace) -> Trains:
    """
    Return what runs need to know.

    Parameters
    ----------
    world
        The trains.
    pace
        How runs are made.

    Returns
    -------
    Trains
        It stays for a whole run of the simulator.
    """
    step_s, profile = pace.step_s, world.profile
    return Trains(
        step_s,
        step_s * pace.gentle_mps2,
        pace.early_s,
        pace.margin_m,
        world.far_m,
        world.line.end_m,
        2.0 * profile.potential_m2ps2.ravel(),
        pull_of(world, profile, step_s),
        world.row_start,
        ceiling_figures(world, profile, step_s),
        world.of_type("service_brake_mps2"),
        world.length_m,
        world.stop_m,
        world.call_count,
        world.booked_arrival_s,
        world.booked_departure_s,
        world.minimum_dwell_s,
        world.leaves_at_stop,
    )


class RunPlace(NamedTuple):
    """Where a run is."""

    front_m: float
    speed_mps: float
    call: int
    """The call ahead, or the present one while standing at it."""
    leaves_s: float
    """When the stop is over; infinite while running. [s]"""


@compiled
def stopping_place_m(
    square: FloatArray, row_start: float, front_m: float, speed_mps: float, brake_mps2: float
) -> float:
    """
    Return where the service brake brings a train to a stand.

    Parameters
    ----------
    square
        Twice the brake potential. [m2/s2], shape (n_types * n_grid,)
    row_start
        From :meth:`kankaku.railway.plan.profile.Profile.row_starts`. [-]
    front_m
        Front. [m]
    speed_mps
        Speed. [m/s]
    brake_mps2
        Service brake on the level. [m/s2]

    Returns
    -------
    float
        The front at a stand. [m]
    """
    wanted = at(square, front_m + row_start) + speed_mps * speed_mps
    place = front_m + row_start + 0.5 * speed_mps * speed_mps / brake_mps2
    if speed_mps == 0.0:
        return place - row_start
    for _ in range(ROUNDS):
        cell = int(place)
        slope = square[cell + 1] - square[cell]
        place += (wanted - at(square, place)) / slope
    return place - row_start


@compiled
def run(  # noqa: PLR0913, PLR0917 - compiled functions take plain arrays
    trains: Trains,
    row: int,
    place: RunPlace,
    now_s: float,
    cap_mps: FloatArray,
    limit_square: FloatArray,
    front_m: FloatArray,
    speed_mps: FloatArray,
) -> tuple[RunPlace, float, int]:
    """
    Run a train from moment to moment.

    Parameters
    ----------
    trains
        What is known of all trains.
    row
        The train.
    place
        Where it is at the first moment.
    now_s
        The first moment. [s]
    cap_mps
        Speed that the plan allows at the end of each step. [m/s], shape (n_moments - 1,)
    limit_square
        Twice the brake potential at the limit at each moment. [m2/s2], shape (n_moments,)
    front_m, speed_mps
        Written: the run. [m] and [m/s], shape (n_moments,)

    Returns
    -------
    tuple[RunPlace, float, int]
        Where it is at the last moment, when it first arrived at a stop (infinite if it did not),
        and the last moment at which a limit made it slower; 0 for none.
    """
    step_s, far_m = trains.step_s, trains.far_m
    start, count = trains.row_start[row], trains.call_count[row]
    front, speed, call, leaves_s = place.front_m, place.speed_mps, place.call, place.leaves_s
    stop_square = at(trains.square, min(trains.stop_m[row, call], far_m) + start)
    arrival_s, hindered = np.inf, 0
    front_m[0], speed_mps[0] = front, speed
    for moment in range(1, front_m.size):
        time_s = now_s + step_s * moment
        if leaves_s < np.inf:
            stays = call + 1 == count and trains.leaves_at_stop[row]
            if time_s - step_s >= leaves_s - 1e-6 and not stays:
                leaves_s = np.inf
                call += 1
                stop_square = at(trains.square, min(trains.stop_m[row, call], far_m) + start)
            else:
                front_m[moment], speed_mps[moment] = front, 0.0
                continue
        here = at(trains.square, front + start)
        loss = braking_loss_mps(trains.square, front + start, speed, step_s)
        wish = pulled_mps(trains.pull, row, front + start, speed)
        wish = min(wish, ceiling_ahead_mps(trains.ceiling, row, front, speed))
        wish = min(wish, max(cap_mps[moment - 1], speed - trains.gentle_mps))
        wish = min(wish, next_speed_mps(speed, stop_square - here, loss, 0.0))
        kept = next_speed_mps(speed, limit_square[moment] - here, loss, 0.0)
        if kept < wish - 1e-6:
            hindered = moment
        after = max(min(wish, kept), speed - loss, 0.0)
        front = min(front + 0.5 * (speed + after) * step_s, far_m)
        speed = after
        near = abs(trains.stop_m[row, call] - front) < ARRIVED_M and speed < ARRIVED_MPS
        if call < count and near and stop_square <= limit_square[moment]:
            front, speed = trains.stop_m[row, call], 0.0
            ready_s = time_s + trains.minimum_dwell_s[row, call]
            leaves_s = max(trains.booked_departure_s[row, call], ready_s)
            arrival_s = min(arrival_s, time_s)
        front_m[moment], speed_mps[moment] = front, speed
    return RunPlace(front, speed, call, leaves_s), arrival_s, hindered
