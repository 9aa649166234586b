"""
The least interval from a leader's departure to its follower's arrival at one platform.

A follower may at no moment be faster than its service brake keeps the end of its authority, which
the leader moves on as it departs with full traction. From wherever that lets the follower be, it
cannot be at its stop sooner than full traction and its brake bring it there. So each moment of the
departure gives an interval that no control over the protection can fall below, and the longest of
them is the bound. It needs no assumption on how the follower comes near: to hold a speed, as eqs.
(14) and (15) of [1]_ do, is one way of it.

References
----------
.. [1] Sato et al. 2025, eqs. (14) and (15).
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import FloatArray
from kankaku.railway.compiled import compiled, formula
from kankaku.railway.motion.acceleration import accelerations, energy_gain
from kankaku.railway.motion.run_curve import RunCurve, fastest
from kankaku.railway.motion.way import Way, way_on
from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight

SPEED_CELL_MPS = 0.1
"""Speeds are tabulated so finely. [m/s]"""
LOOKED_BACK_M = 600.0
"""No follower further from its stop than this counts; one there may be as fast as it can. [m]"""
MOMENTS_S = 0.5
"""Moments of the departure that are looked at lie so close. [s]"""
LONGEST_S = 120.0
"""No departure is looked at for longer. [s]"""
MOST_KEPT = 64
"""Ways whose remaining times are kept, a megabyte each. [-]"""


class Pair(NamedTuple):
    """A train and the one before it at a platform."""

    leader: int
    """Row."""
    leaves: int
    """Its call there."""
    follower: int
    """Row."""
    arrives: int
    """Its call there, not its first one."""


class RemainingTimes(NamedTuple):
    """The least time to a stop from any place and speed, nobody in the way."""

    chainage_m: FloatArray
    """Places. [m], shape (n_points,)"""
    cap_mps: FloatArray
    """Greatest speed there, the brake curve into the stop included. [m/s], shape (n_points,)"""
    at_cap_s: FloatArray
    """Time from that speed. [s], shape (n_points,)"""
    time_s: FloatArray
    """By multiples of ``SPEED_CELL_MPS``, up to the greatest. [s], shape (n_points, n_speeds)"""

    def least_s(self, speed_mps: FloatArray) -> float:
        """
        Return the least time of a train that may be anywhere, no faster than some speeds.

        Parameters
        ----------
        speed_mps
            Greatest speed by place; below 0 where it cannot be. [m/s], shape (n_points,)

        Returns
        -------
        float
            Time to standstill at the stop; the faster at a place, the sooner. [s]
        """
        return float(_least_s(self, speed_mps))


def remaining_times(way: Way) -> RemainingTimes:
    """
    Tabulate the least time to the end of a way.

    Parameters
    ----------
    way
        The way, with a stop at its end.

    Returns
    -------
    RemainingTimes
        Full traction up to the ceiling and the brake curve into the stop.
    """
    along = way.chainage_m, way.cap_m2ps2, way.drag_mps2
    return _tabulated(way.train_type, *(values.tobytes() for values in along))


@lru_cache(maxsize=MOST_KEPT)
def _tabulated(train_type: TrainType, *along: bytes) -> RemainingTimes:
    """Tabulate it once for all runs of a study: no seed and no controller changes it."""
    chainage_m, cap_m2ps2, drag_mps2 = (np.frombuffer(values).copy() for values in along)
    pull, _ = accelerations(train_type)
    cap_mps = np.sqrt(2.0 * cap_m2ps2)
    speeds = int(np.ceil(float(cap_mps.max()) / SPEED_CELL_MPS)) + 1
    at_cap_s, time_s = _remaining(chainage_m, cap_mps, drag_mps2, pull, speeds)
    return RemainingTimes(chainage_m, cap_mps, at_cap_s, time_s)


@compiled
def _remaining(
    chainage_m: FloatArray, cap_mps: FloatArray, drag: FloatArray, pull: FloatArray, speeds: int
) -> tuple[FloatArray, FloatArray]:
    points = chainage_m.size
    at_cap_s, time_s = np.zeros(points), np.zeros((points, speeds))
    for place in range(points - 2, -1, -1):
        step_m = chainage_m[place + 1] - chainage_m[place]
        drags = drag[place], drag[place + 1]
        for index in range(-1, speeds):
            speed = cap_mps[place] if index < 0 else index * SPEED_CELL_MPS
            if index >= 0 and speed >= cap_mps[place]:
                time_s[place, index] = at_cap_s[place]
                continue
            energy = 0.5 * speed**2
            gained = max(energy + energy_gain(pull, energy, step_m, drags), 0.0)
            ahead = min(np.sqrt(2.0 * gained), cap_mps[place + 1])
            taken_s = np.inf
            if speed + ahead > 0.0:
                left_s = _looked_up(at_cap_s, time_s, place + 1, cap_mps[place + 1], ahead)
                taken_s = 2.0 * step_m / (speed + ahead) + left_s
            if index < 0:
                at_cap_s[place] = taken_s
            else:
                time_s[place, index] = taken_s
    return at_cap_s, time_s


@formula
def _looked_up(
    at_cap_s: FloatArray, time_s: FloatArray, place: int, cap_mps: float, speed_mps: float
) -> float:
    """Interpolate a remaining time by speed."""
    if speed_mps >= cap_mps:
        return float(at_cap_s[place])
    index = int(speed_mps / SPEED_CELL_MPS)
    below_mps, above_mps = index * SPEED_CELL_MPS, min((index + 1) * SPEED_CELL_MPS, cap_mps)
    above_s = at_cap_s[place] if above_mps == cap_mps else time_s[place, index + 1]
    part = (speed_mps - below_mps) / (above_mps - below_mps)
    return float(time_s[place, index] + part * (above_s - time_s[place, index]))


@formula
def _least_s(times: RemainingTimes, speed_mps: FloatArray) -> float:
    least_s = np.inf
    for place in range(speed_mps.size):
        if speed_mps[place] >= 0.0:
            cap_mps = times.cap_mps[place]
            left_s = _looked_up(times.at_cap_s, times.time_s, place, cap_mps, speed_mps[place])
            least_s = min(least_s, left_s)
    return least_s


class LeastIntervals:
    """The least intervals over one protection; pairs that meet the same are worked out once."""

    def __init__(self, world: World, foresight: Foresight) -> None:
        self._world, self._foresight = world, foresight
        self._known: dict[tuple[object, ...], float] = {}
        self._departures: dict[tuple[object, ...], RunCurve] = {}
        self._arrivals: dict[tuple[object, ...], RemainingTimes] = {}

    def of(self, pair: Pair) -> float:
        """
        Return the least interval of two trains at a platform.

        Parameters
        ----------
        pair
            The trains, and their calls there.

        Returns
        -------
        float
            From when the leader may depart to the follower's standstill; 0 where they meet head
            on, or stop at different places. [s]
        """
        world = self._world
        leader, leaves, follower, arrives = pair
        stop_m = float(world.stop_m[follower, arrives])
        alike = world.falling[leader] == world.falling[follower]
        if not alike or world.stop_m[leader, leaves] != stop_m:
            return 0.0
        gone_m = _shared_until_m(world, pair)
        key = (
            self._way_out(leader, leaves),
            self._way_in(follower, arrives),
            float(world.departure_lag_s[leader]),
            *world.platform_m[:, follower, arrives].tolist(),
            gone_m,
        )
        if key not in self._known:
            self._known[key] = self._interval_s(pair, gone_m)
        return self._known[key]

    def _way_out(self, row: int, call: int) -> tuple[int, float, float | None]:
        world = self._world
        start_m = float(world.stop_m[row, call])
        if call + 1 < world.call_count[row]:
            return int(world.type_index[row]), start_m, float(world.stop_m[row, call + 1])
        end_m = None if world.leaves_at_stop[row] else world.line.end_m
        return int(world.type_index[row]), start_m, end_m

    def _way_in(self, row: int, call: int) -> tuple[int, float, float]:
        start_m, stop_m = self._world.stop_m[row, call - 1 : call + 1].tolist()
        return int(self._world.type_index[row]), start_m, stop_m

    def _interval_s(self, pair: Pair, gone_m: float) -> float:
        world, row = self._world, pair.follower
        times = self._arrival(self._way_in(row, pair.arrives))
        after_s, front_m, speed_mps = self._departure(pair, gone_m)
        eoa_m = self._foresight.eoa_behind_m(row, pair.arrives, pair.leader, front_m, speed_mps)
        profile = world.profile
        potential = profile.potential_m2ps2[world.type_index[row]]
        here = np.interp(times.chainage_m, profile.grid_m, potential)
        stop_m, least_s = times.chainage_m[-1], 0.0
        for moment_s, end_m in zip(after_s.tolist(), eoa_m.tolist(), strict=True):
            if end_m >= stop_m:
                # It may have arrived by then.
                break
            room = np.interp(end_m, profile.grid_m, potential) - here
            speeds = np.where(times.chainage_m <= end_m, np.sqrt(np.maximum(2.0 * room, 0.0)), -1.0)
            speeds = np.minimum(speeds, times.cap_mps)
            # Whoever is further back comes by here, and no sooner.
            came_by = stop_m - times.chainage_m[0] >= LOOKED_BACK_M
            speeds[0] = times.cap_mps[0] if came_by else 0.0
            least_s = max(least_s, moment_s + times.least_s(speeds))
        return least_s

    def _arrival(self, way_in: tuple[int, float, float]) -> RemainingTimes:
        if way_in not in self._arrivals:
            kind, start_m, stop_m = way_in
            ends_m = max(start_m, stop_m - LOOKED_BACK_M), stop_m
            way = way_on(self._foresight.profile, kind, self._world.driven_types[kind], ends_m)
            self._arrivals[way_in] = remaining_times(way)
        return self._arrivals[way_in]

    def _departure(self, pair: Pair, gone_m: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return moments since it may depart, and the leader's places and speeds then."""
        world, way_out = self._world, self._way_out(pair.leader, pair.leaves)
        kind, start_m, end_m = way_out
        if end_m is None or end_m <= start_m:
            return np.zeros(1), np.array([start_m]), np.zeros(1)
        if way_out not in self._departures:
            train_type = world.driven_types[kind]
            speeds_mps = 0.0, train_type.maximum_speed_mps
            if pair.leaves + 1 < world.call_count[pair.leader]:
                speeds_mps = 0.0, 0.0
            way = way_on(self._foresight.profile, kind, train_type, (start_m, end_m), speeds_mps)
            self._departures[way_out] = fastest(way)
        run = self._departures[way_out]
        moments_s = np.arange(0.0, min(run.run_time_s, LONGEST_S), MOMENTS_S)
        front_m = np.interp(moments_s, run.time_s, run.chainage_m)
        speed_mps = np.interp(moments_s, run.time_s, run.speed_mps)
        there = front_m - world.length_m[pair.leader] < gone_m
        lag_s = float(world.departure_lag_s[pair.leader])
        return moments_s[there] + lag_s, front_m[there], speed_mps[there]


def _shared_until_m(world: World, pair: Pair) -> float:
    """Return where the leader's tail is out of the follower's way. [m]"""
    leader, leaves, follower, arrives = pair
    services = world.timetable.services
    platform = services[leader].calls[leaves].track, services[follower].calls[arrives].track
    ways = world.passages[leader], world.passages[follower]
    tracks = tuple([one.track for one in way] for way in ways)
    first = tuple(names.index(track) for names, track in zip(tracks, platform, strict=True))
    until_m = ways[0][first[0]].clear_m
    pairs = zip(ways[0][first[0] :], ways[1][first[1] :], strict=False)
    for own, other in pairs:
        if own.track != other.track:
            break
        until_m = own.clear_m
    return until_m
