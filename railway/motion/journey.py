"""The journey of one train through all its calls, nobody in its way: place and speed by time."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.motion.run_curve import RunCurve, driven_along
from kankaku.railway.motion.way import way_on
from kankaku.railway.plan.profile import Profile
from kankaku.railway.plan.world import World

WHOLE_BRAKE = 1e-3
"""Who misses the service brake by no more of it brakes with all of it. [-]"""


@dataclass(frozen=True, eq=False)
class Journey:
    """Place and speed of a train from when it stands ready until it leaves the line."""

    row: int
    """The train."""
    time_s: FloatArray
    """Times, never falling. [s], shape (n_points,)"""
    chainage_m: FloatArray
    """Its front then. [m], shape (n_points,)"""
    speed_mps: FloatArray
    """Its speed then; the acceleration is constant between two points. [m/s], (n_points,)"""
    arrival_s: FloatArray
    """When it arrives at its calls, at the first one when it stands ready. [s], (n_calls,)"""
    departure_s: FloatArray
    """When it departs from them. [s], shape (n_calls,)"""
    brakes: BoolArray
    """Whether it brakes with its whole service brake, point to point. shape (n_points - 1,)"""

    @property
    def leaves_s(self) -> float:
        """When its front passes the end of the line, or its last stop is over. [s]"""
        return float(self.time_s[-1])

    @cached_property
    def _steady_mps2(self) -> FloatArray:
        """Acceleration between two points. [m/s2], shape (n_points - 1,)"""
        steps_s, changes_mps = np.diff(self.time_s), np.diff(self.speed_mps)
        return np.divide(changes_mps, steps_s, out=np.zeros(steps_s.size), where=steps_s > 0.0)

    def at(self, time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """
        Return where the train is, and how fast.

        Parameters
        ----------
        time_s
            Times; before and after the journey its ends hold. [s], shape (n_times,)

        Returns
        -------
        tuple[FloatArray, FloatArray]
            Fronts and speeds. [m] and [m/s], shape (n_times,) each
        """
        cell = self._cell(time_s)
        start_s, end_s = self.time_s[cell], self.time_s[cell + 1]
        passed_s = np.clip(time_s, start_s, end_s) - start_s
        gained_mps = self._steady_mps2[cell] * passed_s
        start_mps = self.speed_mps[cell]
        front_m = self.chainage_m[cell] + passed_s * (start_mps + 0.5 * gained_mps)
        return front_m, start_mps + gained_mps

    def brakes_at(self, time_s: FloatArray) -> BoolArray:
        """
        Return whether the train brakes with its whole service brake.

        Parameters
        ----------
        time_s
            Times. [s], shape (n_times,)

        Returns
        -------
        BoolArray
            By time. shape (n_times,)
        """
        return self.brakes[self._cell(time_s)]

    def _cell(self, time_s: FloatArray) -> IntArray:
        cell = np.searchsorted(self.time_s, time_s, side="right") - 1
        return np.clip(cell, 0, self.time_s.size - 2)


@dataclass(slots=True)
class _Log:
    """Points of a journey, run by run."""

    time_s: list[FloatArray] = field(default_factory=list)
    chainage_m: list[FloatArray] = field(default_factory=list)
    speed_mps: list[FloatArray] = field(default_factory=list)

    def stand(self, time_s: float, place_m: float) -> None:
        """Note a train that stands."""
        self.time_s.append(np.array([time_s]))
        self.chainage_m.append(np.array([place_m]))
        self.speed_mps.append(np.zeros(1))

    def run(self, start_s: float, curve: RunCurve, run_time_s: float) -> None:
        """Note a run, slowed down evenly to a given time."""
        share = curve.run_time_s / run_time_s
        self.time_s.append(start_s + curve.time_s / share)
        self.chainage_m.append(curve.chainage_m)
        self.speed_mps.append(curve.speed_mps * share)


def technical_journey(world: World, profile: Profile, row: int) -> Journey:
    """
    Return the fastest journey of a train with its booked dwells.

    Parameters
    ----------
    world
        Line, fleet and timetable.
    profile
        The line with the ceilings that protection enforces.
    row
        The train.

    Returns
    -------
    Journey
        It departs from its first call as booked.
    """
    runs = _fastest_runs(world, profile, row)
    calls = int(world.call_count[row])
    booked_s = world.booked_arrival_s[row, :calls]
    dwell_s = world.booked_departure_s[row, :calls] - booked_s
    lag_s = float(world.departure_lag_s[row])
    steps_s = dwell_s[:-1] + [lag_s + run.run_time_s for run in runs[: calls - 1]]
    arrival_s = booked_s[0] + np.concatenate([[0.0], np.cumsum(steps_s)])
    return _journey(world, profile, runs, row, (arrival_s, arrival_s + dwell_s))


def booked_journey(world: World, profile: Profile, row: int) -> Journey:
    """
    Return the journey of a train as booked: its fastest runs, slowed down evenly.

    Parameters
    ----------
    world
        Line, fleet and timetable.
    profile
        The line with the ceilings that protection enforces.
    row
        The train.

    Returns
    -------
    Journey
        At its booked times; later where not even the fastest run keeps them.
    """
    runs = _fastest_runs(world, profile, row)
    calls = int(world.call_count[row])
    arrival_s = world.booked_arrival_s[row, :calls].copy()
    departure_s = world.booked_departure_s[row, :calls].copy()
    lag_s = float(world.departure_lag_s[row])
    for call in range(1, calls):
        soonest_s = departure_s[call - 1] + lag_s + runs[call - 1].run_time_s
        arrival_s[call] = max(arrival_s[call], soonest_s)
        ready_s = arrival_s[call] + world.minimum_dwell_s[row, call]
        departure_s[call] = max(departure_s[call], ready_s)
    return _journey(world, profile, runs, row, (arrival_s, departure_s))


def _fastest_runs(world: World, profile: Profile, row: int) -> list[RunCurve]:
    """Return the fastest run to each call, and the one out of the line if the train goes on."""
    kind = int(world.type_index[row])
    train_type, band_mps = world.driven_types[kind], profile.coasting_band_mps
    stops_m = world.stop_m[row, : world.call_count[row]].tolist()
    ways = [way_on(profile, kind, train_type, ends_m) for ends_m in pairwise(stops_m)]
    if not world.leaves_at_stop[row]:
        speeds_mps = 0.0, train_type.maximum_speed_mps
        ends_m = stops_m[-1], world.line.end_m
        ways.append(way_on(profile, kind, train_type, ends_m, speeds_mps))
    return [driven_along(way, band_mps) for way in ways]


def _journey(
    world: World,
    profile: Profile,
    runs: Sequence[RunCurve],
    row: int,
    calls_s: tuple[FloatArray, FloatArray],
) -> Journey:
    arrival_s, departure_s = calls_s
    log = _Log()
    log.stand(float(arrival_s[0]), float(world.stop_m[row, 0]))
    starts_s = departure_s + world.departure_lag_s[row]
    ends_s = [*arrival_s[1:].tolist(), starts_s[-1] + runs[-1].run_time_s]
    for run, start_s, end_s in zip(runs, starts_s.tolist(), ends_s, strict=False):
        log.run(start_s, run, end_s - start_s)
    if len(runs) < arrival_s.size:
        log.stand(float(departure_s[-1]), float(world.stop_m[row, arrival_s.size - 1]))
    chainage_m, speed_mps = np.concatenate(log.chainage_m), np.concatenate(log.speed_mps)
    potential = world.profile.potential_m2ps2[world.type_index[row]]
    rise = np.diff(np.interp(chainage_m, profile.grid_m, potential))
    excess = 0.5 * np.diff(np.square(speed_mps)) + rise
    return Journey(
        row=row,
        time_s=np.concatenate(log.time_s),
        chainage_m=chainage_m,
        speed_mps=speed_mps,
        arrival_s=arrival_s,
        departure_s=departure_s,
        brakes=(rise > 0.0) & (np.abs(excess) < WHOLE_BRAKE * rise),
    )
