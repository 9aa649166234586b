"""
Merging: stay at the platform while another train goes first through points close ahead.

Points free the whole way at once, and when follows from the run of the train that goes first. So
nothing is lost by departing just so early that the train meets the points when they are granted.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from kankaku.controllers.drive import AT_STOP_M
from kankaku.controllers.forecast import Booked, Called, forecast_tables_of
from kankaku.railway.arrays import BoolArray, FloatArray
from kankaku.railway.compiled import Plain, compiled
from kankaku.railway.motion.run_up import covers_s
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import LineState, Whereabouts

NOWHERE_M = -np.inf


class Starting(NamedTuple):
    """How trains start, and how fast they go; arrays of shape (n_trains,)."""

    length_m: FloatArray
    lag_s: FloatArray
    """From when a train may depart until full traction would have set it off. [s]"""
    acceleration_mps2: FloatArray
    brake_mps2: FloatArray
    brake_rise_s: FloatArray
    top_mps: FloatArray
    granted_s: float
    """From when a tail has left points until they are granted, at most. [s]"""


def starting(world: World) -> Starting:
    """
    Return how the trains of a world start.

    Parameters
    ----------
    world
        The trains.

    Returns
    -------
    Starting
        It stays for a whole run.
    """
    kinds = [world.driven_types[kind] for kind in world.type_index.tolist()]
    throws_s = (points.throw_s + points.proof_s for points in world.line.turnouts)
    return Starting(
        world.length_m,
        world.departure_lag_s,
        np.array([kind.starting_acceleration_mps2 for kind in kinds]),
        world.of_type("service_brake_mps2"),
        world.of_type("brake_rise_s"),
        np.array([kind.maximum_speed_mps for kind in kinds]),
        world.line.release_delay_s + max(throws_s, default=0.0) + world.step_s,
    )


def points_left_m(world: World, state: LineState) -> FloatArray:
    """
    Return where those that go first have left the points that trains at their stops wait for.

    Parameters
    ----------
    world
        The trains. In a network, where a train that does not move up may be in the way of others,
        nobody waits.
    state
        The line.

    Returns
    -------
    FloatArray
        Place of the tail; minus infinity for trains that wait for no points. [m], (n_trains,)
    """
    left_m = np.full(world.size, NOWHERE_M)
    if world.line.network:
        return left_m
    waits = state.running & ~state.follows & (state.leader >= 0) & (state.next_call > 0)
    for row in np.flatnonzero(waits & (state.granted_to_m < state.stop_m)).tolist():
        way = world.passages[row]
        for before, passage in pairwise(way):
            if passage.entry_m == state.granted_to_m[row]:
                left_m[row] = before.clear_m
    return left_m


@compiled
def stays(
    whereabouts: Plain,
    known: tuple[Plain, tuple[Plain, Plain]],
    ends_m: tuple[FloatArray, FloatArray, FloatArray],
    starting_fields: Plain,
) -> BoolArray:
    """
    Return which trains stay at their platforms.

    Parameters
    ----------
    whereabouts
        See :class:`~kankaku.railway.step.state.Whereabouts`.
    known
        Of :class:`~kankaku.controllers.forecast.Called`, and what forecasts need.
    ends_m
        The stops that trains depart from, their ends of authority, and what
        :func:`points_left_m` returned. [m], shape (n_trains,) each
    starting_fields
        Of :class:`Starting`, plain.

    Returns
    -------
    BoolArray
        True for those who would meet the points too early. shape (n_trains,)
    """
    trains, called, starts = (
        Whereabouts(*whereabouts),
        Called(*known[0]),
        Starting(*starting_fields),
    )
    (from_m, eoa_m, left_m), tables = ends_m, forecast_tables_of(known[1][0])
    counts = Booked(*known[1][1]).call_count
    stay = np.zeros(from_m.size, dtype=np.bool_)
    for train in trains.rows:
        front_m = trains.front_m[train]
        at_stop = trains.speed_mps[train] == 0.0 and abs(front_m - from_m[train]) < AT_STOP_M
        if left_m[train] == NOWHERE_M or not trains.running[train] or not at_stop:
            continue
        first = called.leader[train]
        gone_m = left_m[train] + starts.length_m[first]
        stops_before = called.next_call[first] < counts[first] and called.stop_m[first] < gone_m
        if not trains.running[first] or stops_before:
            stay[train] = True
            continue
        speed = trains.speed_mps[first]
        run = max(gone_m - trains.front_m[first], 0.0), speed, starts.top_mps[first]
        clear_s = covers_s(tables.run_up, tables.type_index[first], run)
        if speed == 0.0:
            clear_s += starts.lag_s[first]
        acceleration, brake = starts.acceleration_mps2[train], starts.brake_mps2[train]
        # From rest to where the brake for the end of authority would begin to rise.
        both, rise_s = 1.0 / acceleration + 1.0 / brake, 0.5 * starts.brake_rise_s[train]
        room_m = max(eoa_m[train] - front_m, 0.0)
        peak = (np.sqrt(rise_s**2 + 2.0 * room_m * both) - rise_s) / both
        stay[train] = clear_s + starts.granted_s > starts.lag_s[train] + peak / acceleration
    return stay
