"""
A run along the way ahead: the drive's own formulas on the grid of the control map.

A run keeps its ends of authority as the train will, with the service brake; so the band of a run
that this module returns lies before them by construction.
"""

from typing import NamedTuple

import numpy as np

from kankaku.controllers.ceiling import (
    CeilingFigures,
    ceiling_ahead_mps,
    ceiling_figures,
    figures_of,
)
from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, compiled, formula
from kankaku.railway.motion.kinematics import next_speed_mps
from kankaku.railway.motion.traction_table import pulled_mps
from kankaku.railway.plan.brake_table import BrakeTable, braking_loss_mps, braking_v2_at
from kankaku.railway.plan.world import World

ARRIVED_M = 0.5
"""A run that comes this near to its stop has arrived. [m]"""
ARRIVED_MPS = 1.0


class PlannedTrains(NamedTuple):
    """What the runs of all trains need to know; it stays for a whole run of the simulator."""

    step_s: float
    """Time between the moments of the map. [s]"""
    gentle_mps: float
    """Speed taken in a step where nothing asks for more than a lower plan. [m/s]"""
    early_s: float
    """How much earlier than booked a train is to arrive. [s]"""
    margin_m: float
    """Between an end of authority and the rear that it keeps clear of. [m]"""
    far_m: float
    end_m: float
    """Where trains leave the line. [m]"""
    braking: BrakeTable
    ceiling: CeilingFigures
    """As the trains are driven, traction included."""
    gentler_mps2: FloatArray
    """By how much the brake for stops is weaker than the service brake. [m/s2], (n_trains,)"""
    length_m: FloatArray
    origin_m: FloatArray
    """Where each train is before it has entered, whatever it believes since. [m], (n_trains,)"""
    stop_m: FloatArray
    """shape (n_trains, n_calls + 1)"""
    call_count: IntArray
    booked_arrival_s: FloatArray
    booked_departure_s: FloatArray
    minimum_dwell_s: FloatArray
    departure_lag_s: FloatArray
    """From when a train may depart until it moves. [s], shape (n_trains,)"""
    leaves_at_stop: BoolArray
    """The train leaves the line at its last stop: nobody counts on that before it has."""


class Pace(NamedTuple):
    """How runs are made; see :class:`PlannedTrains`."""

    step_s: float
    gentle_mps2: float
    """Deceleration where nothing asks for more than a lower plan. [m/s2]"""
    early_s: float
    margin_m: float


def trains_of(world: World, pace: Pace) -> PlannedTrains:
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
    PlannedTrains
        It stays for a whole run of the simulator.
    """
    step_s = pace.step_s
    return PlannedTrains(
        step_s,
        step_s * pace.gentle_mps2,
        pace.early_s,
        pace.margin_m,
        world.far_m,
        world.line.end_m,
        world.braking,
        ceiling_figures(world, world.driven_profile, step_s, world.driven_types),
        world.gentler_mps2,
        world.length_m,
        world.stop_m[:, 0].copy(),
        world.stop_m,
        world.call_count,
        world.booked_arrival_s,
        world.booked_departure_s,
        world.minimum_dwell_s,
        world.departure_lag_s,
        world.leaves_at_stop,
    )


@compiled
def trains_with(fields: Plain) -> PlannedTrains:
    """
    Return what runs need to know with its names.

    Parameters
    ----------
    fields
        Of :class:`PlannedTrains`, plain.

    Returns
    -------
    PlannedTrains
        The same.
    """
    named = (BrakeTable(*fields[6]), figures_of(fields[7]))
    return PlannedTrains(*(fields[:6] + named + fields[8:]))


class RunPlace(NamedTuple):
    """Where a run is."""

    front_m: float
    speed_mps: float
    call: int
    """The call ahead, or the present one while standing at it."""
    leaves_s: float
    """When the stop is over; infinite while running. [s]"""


class RunTask(NamedTuple):
    """What a run is to keep to, and where it is written."""

    now_s: float
    """The first moment. [s]"""
    cap_mps: FloatArray
    """Speed that the plan allows at the end of each step. [m/s], shape (n_moments - 1,)"""
    end_v2_m2ps2: FloatArray
    """Twice the brake potential at the end of authority of each moment. [m2/s2], (n_moments,)"""
    front_m: FloatArray
    """Written: the run. [m], shape (n_moments,)"""
    speed_mps: FloatArray
    """Written. [m/s], shape (n_moments,)"""


@formula
def run(
    trains: PlannedTrains, row: int, place: RunPlace, task: RunTask
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
    task
        What it keeps to.

    Returns
    -------
    tuple[RunPlace, float, int]
        Where it is at the last moment, when it first arrived at a stop (infinite if it did not),
        and the last moment at which an end of authority made it slower; 0 for none.
    """
    step_s, count = trains.step_s, trains.call_count[row]
    front, speed, call, leaves_s = place.front_m, place.speed_mps, place.call, place.leaves_s
    stop_v2 = _stop_v2_m2ps2(trains, row, call)
    arrival_s, hindered = np.inf, 0
    task.front_m[0], task.speed_mps[0] = front, speed
    for moment in range(1, task.front_m.size):
        time_s = task.now_s + step_s * moment
        if leaves_s < np.inf:
            stays = call + 1 == count and trains.leaves_at_stop[row]
            moves_s = leaves_s + trains.departure_lag_s[row]
            if time_s - step_s >= moves_s - 1e-6 and not stays:
                leaves_s = np.inf
                call += 1
                stop_v2 = _stop_v2_m2ps2(trains, row, call)
            else:
                task.front_m[moment], task.speed_mps[moment] = front, 0.0
                continue
        gentle_v2 = 2.0 * trains.gentler_mps2[row] * (trains.stop_m[row, call] - front)
        ends = stop_v2 - gentle_v2, task.end_v2_m2ps2[moment], task.cap_mps[moment - 1]
        after, held = _next_mps(trains, row, front, speed, ends)
        if held:
            hindered = moment
        front = min(front + 0.5 * (speed + after) * step_s, trains.far_m)
        speed = after
        near = abs(trains.stop_m[row, call] - front) < ARRIVED_M and speed < ARRIVED_MPS
        if call < count and near and stop_v2 <= task.end_v2_m2ps2[moment]:
            front, speed = trains.stop_m[row, call], 0.0
            ready_s = time_s + trains.minimum_dwell_s[row, call]
            leaves_s = max(trains.booked_departure_s[row, call], ready_s)
            arrival_s = min(arrival_s, time_s)
        task.front_m[moment], task.speed_mps[moment] = front, speed
    return RunPlace(front, speed, call, leaves_s), arrival_s, hindered


@formula
def _stop_v2_m2ps2(trains: PlannedTrains, row: int, call: int) -> float:
    """Return twice the brake potential at the stop of a call."""
    stop_m = min(trains.stop_m[row, call], trains.far_m)
    return float(braking_v2_at(trains.braking, row, stop_m))


@formula
def _next_mps(
    trains: PlannedTrains, row: int, front: float, speed: float, ends: tuple[float, float, float]
) -> tuple[float, bool]:
    """Return the speed after a step, and whether the end of authority makes it lower."""
    stop_v2, end_v2, cap_mps = ends
    here = braking_v2_at(trains.braking, row, front)
    loss = braking_loss_mps(trains.braking, row, front, speed, trains.step_s)
    wish = pulled_mps(trains.ceiling.traction, row, front, speed)
    wish = min(wish, ceiling_ahead_mps(trains.ceiling, row, front, speed))
    wish = min(wish, max(cap_mps, speed - trains.gentle_mps))
    gentle_loss = loss - trains.gentler_mps2[row] * trains.step_s
    wish = min(wish, float(next_speed_mps(speed, stop_v2 - here, gentle_loss, 0.0)))
    kept = float(next_speed_mps(speed, end_v2 - here, loss, 0.0))
    return max(min(wish, kept), speed - loss, 0.0), kept < wish - 1e-6
