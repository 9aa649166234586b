"""Small records of runs that never happened, for tests of what is made of records."""

from collections.abc import Sequence

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.timetable import Call, Service
from kankaku.railway.plan.world import World
from kankaku.railway.step.obstructions import Obstruction
from kankaku.railway.step.records import (
    EnergyAccount,
    RunRecord,
    Standstills,
    Trajectory,
    Violation,
)
from kankaku.railway.step.state import NO_REASON, NOTHING, Reason
from kankaku.testing.example_lines import make_scenario, straight_line, world_of

READY_S = 25_200.0
STOPS_M = {"west": 300.0, "mid": 1300.0, "east": 2800.0}
Stand = tuple[int, float, float, float, int]
"""Train, start [s], duration [s], front [m] and next call of a standstill."""


def three_station_world(trains: int = 2, headway_s: float = 120.0) -> World:
    """
    Return a line of three stations on one track.

    Parameters
    ----------
    trains
        Number of trains, named ``T1`` onwards. [-]
    headway_s
        Booked interval. [s]

    Returns
    -------
    World
        ``T1`` stands ready at ``west`` at 07:00:00. It is booked to dwell 30 s everywhere, 10 s
        more than the minimum, and to run 100 s to ``mid`` and 120 s to ``east``.
    """
    line = straight_line(STOPS_M, 3300.0)
    booked_s = {"west": 0.0, "mid": 130.0, "east": 280.0}
    services = []
    for index in range(trains):
        ready_s = READY_S + index * headway_s
        calls = tuple(
            Call(name, "main", STOPS_M[name], ready_s + at_s, ready_s + at_s + 30.0, 20.0)
            for name, at_s in booked_s.items()
        )
        services.append(Service(f"T{index + 1}", "west", "commuter", ("main",), calls))
    return world_of(make_scenario(line, services))


def run_times_s(world: World, *times_s: float) -> FloatArray:
    """
    Return the same shortest run times for every train.

    Parameters
    ----------
    world
        Whose trains.
    times_s
        From each call to the next. [s]

    Returns
    -------
    FloatArray
        Nan at the origin. [s], shape (n_trains, n_calls_max)
    """
    return np.tile([np.nan, *times_s], (world.size, 1))


def punctual(world: World) -> tuple[FloatArray, FloatArray]:
    """
    Return arrivals and departures exactly as booked.

    Parameters
    ----------
    world
        Whose timetable.

    Returns
    -------
    tuple[FloatArray, FloatArray]
        Nan past a train's last call. [s], shape (n_trains, n_calls_max) each
    """
    booked = world.booked_arrival_s[:, :-1], world.booked_departure_s[:, :-1]
    arrival_s, departure_s = (np.where(np.isfinite(times), times, np.nan) for times in booked)
    return arrival_s, departure_s


def make_record(
    world: World,
    arrival_s: FloatArray,
    departure_s: FloatArray,
    *,
    dwell_delay_s: FloatArray | None = None,
    stands: Sequence[Stand] = (),
    violations: tuple[Violation, ...] = (),
    obstructions: tuple[Obstruction, ...] = (),
    controller: str = "close_up",
    seed: int = 1,
    energy_j: float = 3.6e8,
) -> RunRecord:
    """
    Return a record of given arrivals and departures.

    Parameters
    ----------
    world
        Line, fleet and timetable.
    arrival_s, departure_s
        What happened. [s], shape (n_trains, n_calls_max)
    dwell_delay_s
        What was injected; nothing where None. [s], shape (n_trains, n_calls_max)
    stands
        Standstills between stations.
    violations
        Safety invariants that did not hold.
    obstructions
        What was in the way beside the track.
    controller, seed
        What was run.
    energy_j
        Traction work of each train; half of it becomes braking work. [J]

    Returns
    -------
    RunRecord
        With a trajectory that passes through the calls and the standstills.
    """
    columns = list(zip(*stands, strict=True)) or [(), (), (), (), ()]
    return RunRecord(
        controller=controller,
        seed=seed,
        world=world,
        dwell_delay_s=np.zeros(arrival_s.shape) if dwell_delay_s is None else dwell_delay_s,
        arrival_s=arrival_s,
        departure_s=departure_s,
        stop_error_m=np.where(np.isnan(arrival_s), np.nan, 0.0),
        trajectory=_trajectory(world, arrival_s, departure_s, stands),
        standstills=Standstills(
            np.array(columns[0], dtype=np.intp),
            np.array(columns[1], dtype=np.float64),
            np.array(columns[2], dtype=np.float64),
            np.array(columns[3], dtype=np.float64),
            np.array(columns[4], dtype=np.intp),
        ),
        crawl_s=np.array(
            [sum(stand[2] for stand in stands if stand[0] == row) for row in range(world.size)],
            dtype=np.float64,
        ),
        energy=_energy(world, energy_j),
        violations=violations,
        obstructions=obstructions,
        completed=np.isfinite(arrival_s[np.arange(world.size), world.call_count - 1]),
        train_steps=0,
    )


def _energy(world: World, work_j: float) -> EnergyAccount:
    work = np.full(world.size, work_j)
    return EnergyAccount(
        distance_m=np.full(world.size, world.line.end_m),
        traction_j=work,
        braking_j=0.5 * work,
        resistance_j=0.5 * work,
        potential_j=0.0 * work,
        kinetic_j=0.0 * work,
        regenerated_j=0.5 * work,
        auxiliary_j=0.1 * work,
        consumed_j=1.2 * work,
        recovered_j=0.4 * work,
    )


def _trajectory(
    world: World, arrival_s: FloatArray, departure_s: FloatArray, stands: Sequence[Stand]
) -> Trajectory:
    parts = [
        _samples(world, row, arrival_s[row], departure_s[row], stands) for row in range(world.size)
    ]
    time_s, rows, front_m, speed_mps, reason = (
        np.concatenate(part) for part in zip(*parts, strict=True)
    )
    limit_m = front_m + 100.0
    order = np.lexsort((rows, time_s))
    return Trajectory(
        time_s[order],
        rows[order],
        front_m[order],
        speed_mps[order],
        limit_m[order],
        reason[order],
        np.full(order.size, NO_REASON),
        np.full(order.size, NOTHING),
    )


def _samples(
    world: World,
    row: int,
    arrival_s: FloatArray,
    departure_s: FloatArray,
    stands: Sequence[Stand],
) -> tuple[FloatArray, ...]:
    knots = [
        (time_s, stop_m)
        for times in zip(arrival_s, departure_s, world.stop_m[row], strict=False)
        for time_s, stop_m in ((times[0], times[2]), (times[1], times[2]))
        if np.isfinite(time_s)
    ]
    for train, start_s, duration_s, front_m, _ in stands:
        if train == row:
            knots += [(start_s, front_m), (start_s + duration_s, front_m)]
    at_s, at_m = np.array(sorted(knots)).T
    time_s = np.arange(np.ceil(at_s[0]), np.floor(at_s[-1]) + 1.0)
    place = np.interp(time_s, at_s, np.arange(at_s.size, dtype=np.float64))
    before = np.clip(place.astype(np.intp), 0, at_s.size - 2)
    share = place - before
    # A smooth step starts and ends at rest, as trains do.
    front_m = at_m[before] + (3.0 - 2.0 * share) * share**2 * np.diff(at_m)[before]
    speed_mps = np.gradient(front_m) if time_s.size > 1 else np.zeros(1)
    standing = (time_s[:, np.newaxis] >= arrival_s) & (time_s[:, np.newaxis] < departure_s)
    reason = np.where(standing.any(axis=1), int(Reason.DWELLING), int(Reason.TRACTION))
    return time_s, np.full(time_s.size, row), front_m, np.maximum(speed_mps, 0.0), reason
