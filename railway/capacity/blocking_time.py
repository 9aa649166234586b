"""
Technical headway and blocking times by blocking-time theory, from what a protection foresees.

A train that nobody hinders *needs*, at every moment of its journey, some least limit with which
protection still permits the speed that it runs. The train ahead *gives* limits that move on as it
goes. The technical headway is the shortest interval at which every limit is given before it is
needed; a block is taken from when it is first needed until the train's own rear has given it up.

References
----------
.. [1] UIC Code 406, *Capacity*, 2nd edition, 2013.
.. [2] Pachl, *Railway Operation and Control*, 4th edition, 2018: blocking-time theory.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray
from kankaku.railway.capacity.permitted import HARDLY_MPS
from kankaku.railway.motion.journey import Journey
from kankaku.railway.plan.world import World
from kankaku.railway.step.control import Foresight

EXACT_S, EXACT_M = 1e-3, 1e-3
"""How exactly moments and limits are found. [s], [m]"""


class Search(NamedTuple):
    """How the moment is searched that decides."""

    sample_s: float = 0.1
    """Moments that are looked at first lie so close. [s]"""
    exact_s: float = EXACT_S
    """How exactly the moment is found. [s]"""
    above_s: float = -np.inf
    """A lesser headway need not be exact. [s]"""


FINE = Search()
BLOCKING_SAMPLE_S = 0.05
"""How exactly the begins of blocking times are found. [s]"""


class SharedTrack(NamedTuple):
    """Where a train can be in the way of another; places are of its tail. [m]"""

    entered_m: float = -np.inf
    """Up to here the points before the common track are kept for it."""
    gate_m: float = -np.inf
    """Meanwhile the way of the other ends here."""
    cleared_m: float = np.inf
    """From here on it is out of the way."""
    parts_m: float = np.inf
    """Until then the way of the other ends here: the points behind the common track."""
    throws_s: tuple[float, float] = (0.0, 0.0)
    """Until those before and behind are thrown and proven, once they are cleared. [s]"""


WHOLE_LINE = (SharedTrack(),)
"""Two trains on the same tracks from end to end."""


class Headway(NamedTuple):
    """How long after the train ahead another one can come, and what decides."""

    headway_s: float
    """By so much its clock is behind, at least. [s]"""
    time_s: float
    """The moment that decides, on its own clock. [s]"""
    front_m: float
    """Where it is then. [m]"""
    speed_mps: float
    """How fast it is then. [m/s]"""


@dataclass(frozen=True, slots=True)
class Given:
    """The limits that a train ahead gives to another train on its way to a call."""

    world: World
    foresight: Foresight
    leader: Journey
    row: int
    call: int
    ways: Sequence[SharedTrack] = WHOLE_LINE

    def eoa_m(self, way: SharedTrack, time_s: FloatArray) -> FloatArray:
        """
        Return the limits that one common way gives.

        Parameters
        ----------
        way
            The way.
        time_s
            Moments on the clock of the train ahead. [s], shape (n_times,)

        Returns
        -------
        FloatArray
            Limits, the delay of their release not counted. [m], shape (n_times,)
        """
        front_m, speed_mps = self.leader.at(time_s)
        length_m = float(self.world.length_m[self.leader.row])
        kept_m, parting_m = (
            self.leader.at(time_s - late_s)[0] - length_m for late_s in way.throws_s
        )
        # Points that are not granted end a way like the rear of a train that stands there.
        kept = kept_m < way.entered_m
        place_m = np.where(kept, way.gate_m + length_m, front_m)
        speed_mps = np.where(kept, 0.0, speed_mps)
        eoa_m = self.foresight.eoa_behind_m(
            self.row, self.call, self.leader.row, place_m, speed_mps
        )
        if way.parts_m < np.inf:
            parts_m = np.full_like(front_m, way.parts_m + length_m)
            at_points_m = self.foresight.eoa_behind_m(
                self.row, self.call, self.leader.row, parts_m, np.zeros_like(front_m)
            )
            eoa_m = np.minimum(eoa_m, at_points_m)
        gone = (parting_m >= way.cleared_m) | (time_s >= self.leader.leaves_s)
        return np.where(gone, self.world.far_m, eoa_m)

    def since_s(self, needed_m: FloatArray) -> FloatArray:
        """
        Return from when on some limits are given; they never move back.

        Parameters
        ----------
        needed_m
            Limits; minus infinity for none. [m], shape (n,)

        Returns
        -------
        FloatArray
            Moments on the clock of the train ahead, the delay of the release included; minus
            infinity for what it has never had. [s], shape (n,)
        """
        wanted_m = np.minimum(needed_m, self.world.far_m) - EXACT_M
        since_s = [self._since_s(way, wanted_m) for way in self.ways]
        latest_s: FloatArray = np.max(since_s, axis=0, initial=-np.inf)
        return latest_s + self.foresight.release_delay_s

    def _since_s(self, way: SharedTrack, wanted_m: FloatArray) -> FloatArray:
        since_s = np.full(wanted_m.size, -np.inf)
        begin_s, end_s = self.leader.time_s[[0, -1]]
        later = np.flatnonzero(self.eoa_m(way, np.array([begin_s])) < wanted_m)
        wanted_m = wanted_m[later]
        since_s[later] = _first(
            lambda time_s: self.eoa_m(way, time_s) >= wanted_m,
            np.full(later.size, begin_s),
            np.full(later.size, end_s),
        )
        return since_s


def needed_eoa_m(
    world: World, foresight: Foresight, journey: Journey, time_s: FloatArray
) -> FloatArray:
    """
    Return the least limits with which protection does not hinder a train.

    It hinders a train that runs faster than it permits, unless the train brakes with its whole
    service brake anyway: then all it needs is room to come to a stand. Where protection never
    permits so much, what it permits at most counts. With lineside signals the same holds as far
    ahead as the driver acts on them.

    Parameters
    ----------
    world
        The line.
    foresight
        Protection.
    journey
        The train's.
    time_s
        Moments of it. [s], shape (n_times,)

    Returns
    -------
    FloatArray
        Limits; minus infinity for a train that stands. [m], shape (n_times,)
    """
    row = journey.row
    front_m, speed_mps = journey.at(time_s)
    wanted_mps, enough_m = _enough_m(world, foresight, row, front_m, speed_mps)
    if foresight.sighting_time_s:
        seen_m = np.minimum(front_m + speed_mps * foresight.sighting_time_s, world.far_m)
        enough_m = np.maximum(enough_m, _enough_m(world, foresight, row, seen_m, speed_mps)[1])
    profile = world.profile
    potential = profile.potential_m2ps2[world.type_index[row]]
    used_up = np.interp(front_m, profile.grid_m, potential) + 0.5 * np.square(speed_mps)
    stands_m = np.interp(used_up, potential, profile.grid_m)
    needed_m = np.where(journey.brakes_at(time_s), stands_m, enough_m)
    return np.where(wanted_mps > 0.0, needed_m, -np.inf)


def _enough_m(
    world: World,
    foresight: Foresight,
    row: int,
    place_m: FloatArray,
    speed_mps: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return what a train wants to be permitted at some places, and the least limits for it."""
    far_m = np.full(place_m.size, world.far_m)
    wanted_mps = np.minimum(speed_mps, foresight.permitted_mps(row, place_m, far_m)) - HARDLY_MPS

    def is_enough(eoa_m: FloatArray) -> BoolArray:
        return foresight.permitted_mps(row, place_m, eoa_m) >= wanted_mps

    return wanted_mps, _first(is_enough, place_m, far_m, EXACT_M / 8.0)


def _first(
    holds: Callable[[FloatArray], BoolArray],
    low: FloatArray,
    high: FloatArray,
    exact: float = EXACT_S / 8.0,
) -> FloatArray:
    """Return where something begins to hold that holds from there on, at the far end at last."""
    while high.size and float((high - low).max()) > exact:
        middle = 0.5 * (low + high)
        held = holds(middle)
        low, high = np.where(held, low, middle), np.where(held, middle, high)
    return high


def leg_headway(given: Given, follower: Journey, search: Search = FINE) -> Headway:
    """
    Return how far a train must be behind another to reach a call without any hindrance.

    Parameters
    ----------
    given
        What the train ahead gives to it on the way from its call before; with call 0 during
        its stay at its origin.
    follower
        The train behind, each train on its own clock; the journey of the train ahead for two
        trains of one pattern.
    search
        How closely to look.

    Returns
    -------
    Headway
        Minus infinity if the follower needs nothing that the leader has.
    """
    call = given.call

    def needed_m(time_s: FloatArray) -> FloatArray:
        if call == 0:
            return follower.at(time_s)[0]
        return needed_eoa_m(given.world, given.foresight, follower, time_s)

    def behind_s(time_s: FloatArray) -> FloatArray:
        return given.since_s(needed_m(time_s)) - time_s

    begin_s = float(follower.departure_s[call - 1] if call else follower.arrival_s[0])
    end_s = float(follower.arrival_s[call] if call else follower.departure_s[0])
    samples_s = _samples_s(begin_s, end_s, search.sample_s)
    headway_s, decides_s = _greatest(behind_s, samples_s, given.foresight.idle_time_s, search)
    moment = np.array([decides_s])
    front_m, speed_mps = follower.at(moment)
    return Headway(headway_s, decides_s, float(front_m[0]), float(speed_mps[0]))


def _samples_s(begin_s: float, end_s: float, sample_s: float) -> FloatArray:
    return np.linspace(begin_s, end_s, max(int(np.ceil((end_s - begin_s) / sample_s)), 1) + 1)


def _greatest(
    value_s: Callable[[FloatArray], FloatArray],
    time_s: FloatArray,
    idle_time_s: float,
    search: Search,
) -> tuple[float, float]:
    """
    Return the greatest value that lasts for the idle time, and the moment when it has lasted.

    What a train needs moves on, so that between two moments no value exceeds the later one by
    more than the time between them; only where that could be a new maximum is looked closer.
    """
    values_s = value_s(time_s)
    while True:
        lasting_s = _least_within(time_s, values_s, idle_time_s)
        best_s = float(lasting_s.max())
        gaps_s = np.diff(time_s)
        could_be = np.flatnonzero(lasting_s[1:] + gaps_s > max(best_s, search.above_s))
        until = np.searchsorted(time_s, time_s[could_be + 1] + idle_time_s)
        marks = np.zeros(time_s.size + 1)
        np.add.at(marks, could_be, 1.0)
        np.add.at(marks, until, -1.0)
        looked_at = np.cumsum(marks)[: gaps_s.size] > 0.0
        open_gaps = np.flatnonzero(looked_at & (gaps_s > search.exact_s))
        if not open_gaps.size:
            decides_s = float(time_s[lasting_s.argmax()]) + idle_time_s
            return best_s, min(decides_s, float(time_s[-1]))
        middle_s = time_s[open_gaps] + 0.5 * gaps_s[open_gaps]
        time_s = np.insert(time_s, open_gaps + 1, middle_s)
        values_s = np.insert(values_s, open_gaps + 1, value_s(middle_s))


def _least_within(time_s: FloatArray, values: FloatArray, within_s: float) -> FloatArray:
    """Return the least value from each moment until some time later."""
    begins = np.arange(time_s.size)
    ends = np.searchsorted(time_s, time_s + within_s + EXACT_S / 2.0, side="right")
    pairs = np.column_stack([begins, ends]).ravel()
    least: FloatArray = np.minimum.reduceat(np.append(values, np.inf), pairs)[::2]
    return least


def technical_headways(world: World, foresight: Foresight, journey: Journey) -> tuple[Headway, ...]:
    """
    Return the technical headway into every station of a journey.

    That is the shortest interval between two trains of the same pattern on the same tracks at
    which the second one is not hindered at all on its way from the call before.

    Parameters
    ----------
    world
        Line and trains.
    foresight
        Protection.
    journey
        The pattern.

    Returns
    -------
    tuple[Headway, ...]
        One for each call but the first.
    """
    return tuple(
        leg_headway(Given(world, foresight, journey, journey.row, call), journey)
        for call in range(1, journey.arrival_s.size)
    )


def blocking_times_s(
    world: World,
    foresight: Foresight,
    journey: Journey,
    edges_m: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """
    Return from when until when a train keeps stretches of its way from any other train.

    Parameters
    ----------
    world
        Line and trains.
    foresight
        Protection.
    journey
        The train's.
    edges_m
        Where one stretch ends and the next one begins, rising: block joints, or any places
        with a moving block. [m], shape (n_edges,)

    Returns
    -------
    tuple[FloatArray, FloatArray]
        Begins and ends; the delay of the release is part of it. Not a number for a stretch
        that the train never needs. [s], shape (n_edges - 1,) each
    """
    row, idle_time_s = journey.row, foresight.idle_time_s
    ready_s = float(journey.time_s[0])
    time_s = _samples_s(ready_s, journey.leaves_s, BLOCKING_SAMPLE_S)
    needed_m = needed_eoa_m(world, foresight, journey, time_s)
    lasting_m = _least_within(time_s, needed_m, idle_time_s)
    # Even a train that stands needs its own place.
    reached_m = np.maximum.accumulate(np.maximum(lasting_m, journey.at(time_s)[0]))
    last_call = world.call_count[row] - 1
    calls = np.minimum(np.searchsorted(world.stop_m[row, : last_call + 1], edges_m[:-1]), last_call)
    begin_s, end_s = np.full(calls.size, np.nan), np.full(calls.size, np.nan)
    for call in np.unique(calls).tolist():
        # The limit that a train gives whose tail has just passed an edge.
        fronts_m = edges_m + EXACT_M / 2.0 + float(world.length_m[row])
        eoas_m = foresight.eoa_behind_m(row, call, row, fronts_m, np.zeros(edges_m.size))
        given_s = Given(world, foresight, journey, row, call).since_s(eoas_m[1:])
        first = np.searchsorted(reached_m, eoas_m[:-1] + EXACT_M, side="right")
        own = np.flatnonzero((calls == call) & (first < time_s.size) & (given_s > ready_s))
        standing = first[own] == 0
        begin_s[own] = time_s[first[own]] + np.where(standing, 0.0, idle_time_s)
        end_s[own] = given_s[own]
    return begin_s, end_s
