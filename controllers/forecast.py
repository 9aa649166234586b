"""
When trains can leave their next stop at the earliest.

Booked departures, minimum dwells and the trains' own abilities are known; dwell delays are
not. So this is a lower bound, and a follower loses nothing by counting on it.
"""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, compiled, formula, plain
from kankaku.railway.motion.run_up import RunUp, RunUpTable, shortest_s
from kankaku.railway.plan.world import World
from kankaku.railway.step.state import LineState, Whereabouts


class ForecastTables(NamedTuple):
    """What forecasts need of line and fleet; it stays for a whole run."""

    origin_m: float
    """Where the tables begin. [m]"""
    travel_s: FloatArray
    """Time at the ceiling from there on, by train type and metre. [s], shape (n_types, n_grid)"""
    run_up: RunUpTable
    type_index: IntArray
    interval_s: FloatArray
    """From the departure of each train to the arrival of the next one, at least. [s]"""
    brake_mps2: float


class Booked(NamedTuple):
    """The timetable; arrays of shape (n_trains, n_calls_max + 1) but the first."""

    call_count: IntArray
    minimum_dwell_s: FloatArray
    departure_s: FloatArray


class Called(NamedTuple):
    """How far the trains have come; see :class:`~kankaku.railway.step.state.LineState`."""

    leader: IntArray
    waits: BoolArray
    """From :func:`waits_for_leader`."""
    next_call: IntArray
    stop_m: FloatArray
    arrival_s: FloatArray


class DepartureForecast:
    """Forecasts departures along the queue of trains, first train first."""

    def __init__(self, world: World) -> None:
        self._world = world
        driven = world.driven_types
        self.acceleration_mps2 = min(kind.starting_acceleration_mps2 for kind in driven)
        """Of the slowest starter. [m/s2]"""
        self.brake_mps2 = min(kind.service_brake_mps2 for kind in world.train_types)
        """Of the weakest brake. [m/s2]"""
        self.run_up = [RunUp.of(kind) for kind in driven]
        """By train type."""
        # v/(2a) + L/v + v/b after the departure of a leader of length L, from Sato et al. 2025,
        # eqs. (14) and (15), least over the speed v that is held into the platform.
        pace_s2pm = 0.5 / self.acceleration_mps2 + 1.0 / self.brake_mps2
        self.interval_s: FloatArray = 2.0 * np.sqrt(world.length_m * pace_s2pm)
        """From the departure of each train to the arrival of the next one, at least. [s]"""
        self.tables = plain(
            ForecastTables(
                world.profile.origin_m,
                np.cumsum(1.0 / world.driven_profile.ceiling_mps, axis=1),
                RunUpTable.of(self.run_up),
                world.type_index,
                self.interval_s,
                self.brake_mps2,
            )
        )
        self.booked = plain(
            Booked(world.call_count, world.minimum_dwell_s, world.booked_departure_s)
        )

    def earliest_departures_s(self, state: LineState) -> FloatArray:
        """
        Return the earliest departure of every train from its next stop.

        Parameters
        ----------
        state
            The line.

        Returns
        -------
        FloatArray
            Seconds after midnight; minus infinity where there is no next stop or no train.
            [s], shape (n_trains,)
        """
        return self.ready_and_earliest_s(state)[1]

    def ready_and_earliest_s(self, state: LineState) -> tuple[FloatArray, FloatArray]:
        """
        Return when every train is ready at its next stop, and when it departs at the earliest.

        Parameters
        ----------
        state
            The line.

        Returns
        -------
        tuple[FloatArray, FloatArray]
            When its minimum dwell is over, and when it departs, in seconds after midnight; minus
            infinity where there is no next stop or no train. [s], shape (n_trains,) each
        """
        waits = waits_for_leader(self._world, state)
        called = state.leader, waits, state.next_call, state.stop_m, state.arrival_s
        known = self.tables, self.booked
        return departures_s(state.time_s, state.whereabouts, called, known)


@compiled
def departures_s(
    now_s: float,
    whereabouts: Plain,
    called_fields: Plain,
    known: tuple[Plain, Plain],
) -> tuple[FloatArray, FloatArray]:
    """
    Return when every train is ready at its next stop, and when it departs at the earliest.

    Parameters
    ----------
    now_s
        The time. [s]
    whereabouts
        See :class:`~kankaku.railway.step.state.Whereabouts`.
    called_fields
        Of :class:`Called`, plain.
    known
        Of :class:`ForecastTables` and :class:`Booked`, plain.

    Returns
    -------
    tuple[FloatArray, FloatArray]
        When its minimum dwell is over, and when it departs, in seconds after midnight; minus
        infinity where there is no next stop or no train. [s], shape (n_trains,) each
    """
    trains, called = Whereabouts(*whereabouts), Called(*called_fields)
    tables, booked = forecast_tables_of(known[0]), Booked(*known[1])
    earliest_s = np.full(trains.front_m.size, -np.inf)
    ready_s = np.full(trains.front_m.size, -np.inf)
    for row in trains.rows:
        call = called.next_call[row]
        if call >= booked.call_count[row]:
            continue
        arrival_s = called.arrival_s[row]
        if trains.running[row]:
            arrival_s = now_s + _free_run_s(trains, called, tables, row)
            if called.waits[row]:
                leader = called.leader[row]
                arrival_s = max(arrival_s, earliest_s[leader] + tables.interval_s[leader])
        ready_s[row] = arrival_s + booked.minimum_dwell_s[row, call]
        earliest_s[row] = max(ready_s[row], booked.departure_s[row, call], now_s)
    return ready_s, earliest_s


@compiled
def forecast_tables_of(fields: Plain) -> ForecastTables:
    """
    Return what forecasts need with its names.

    Parameters
    ----------
    fields
        Of :class:`ForecastTables`, plain.

    Returns
    -------
    ForecastTables
        The same.
    """
    origin_m, travel_s, run_up, type_index, interval_s, brake_mps2 = fields
    return ForecastTables(
        origin_m, travel_s, RunUpTable(*run_up), type_index, interval_s, brake_mps2
    )


@formula
def _free_run_s(trains: Whereabouts, called: Called, tables: ForecastTables, row: int) -> float:
    """Return the time to the next stop if nothing is in the way."""
    kind, front_m, stop_m = tables.type_index[row], trains.front_m[row], called.stop_m[row]
    start, stop = int(front_m - tables.origin_m), int(stop_m - tables.origin_m)
    if start >= stop:
        return 0.0
    mean_mps = (stop - start) / (tables.travel_s[kind, stop] - tables.travel_s[kind, start])
    run = stop_m - front_m, trains.speed_mps[row], mean_mps
    return shortest_s(tables.run_up, kind, run, tables.brake_mps2)


def waits_for_leader(world: World, state: LineState) -> BoolArray:
    """
    Return which trains need their leader to leave the platform that they run to.

    Parameters
    ----------
    world
        The trains and their calls.
    state
        The line.

    Returns
    -------
    BoolArray
        True where the next platform of a train is also its leader's. shape (n_trains,)
    """
    track = world.call_track[np.arange(world.size), state.next_call]
    same_track = (track == track[state.leader]) & (state.leader >= 0)
    waits: BoolArray = same_track & (state.stop_m[state.leader] == state.stop_m)
    return waits
