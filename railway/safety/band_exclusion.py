"""
The control map: bands in time and space, and the test that no two of them overlap.

A band is what a train may occupy at each moment: from the rear of its band to the place before
which it can stop, margin included (Sugiyama 2018, section 2.2.2). The line is a stack of
*layers*: every track is one, and so is every detector-locked section, in which there may be one
band at a time. Whoever plans bands uses nothing of this module; it is what plans are tested with:
it is the second channel of the centre, and works out again from reports, timetable order and what
is granted by wire how far each train's way is free.
"""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import compiled, formula
from kankaku.railway.plan.world import World

AT_START_M = 0.5
"""A front that stands at the start of points is before them, a stop error off. [m]"""


class Bands(NamedTuple):
    """Bands at the moments of a map; arrays of shape (n_bands, n_moments)."""

    rear_m: FloatArray
    """Behind this a train is no more, whatever it does. [m]"""
    front_m: FloatArray
    """Before this it can stop, margin included. [m]"""


class Layers(NamedTuple):
    """The layers of a line."""

    start_m: FloatArray
    """[m], shape (n_layers,)"""
    end_m: FloatArray
    """[m], shape (n_layers,)"""
    single: BoolArray
    """Only one band at a time may be in it. shape (n_layers,)"""
    used: BoolArray
    """The train's route passes it. shape (n_layers, n_trains)"""


def layers_of(world: World) -> Layers:
    """
    Return the layers of a line.

    Parameters
    ----------
    world
        Line and timetable.

    Returns
    -------
    Layers
        Tracks, then detector-locked sections.
    """
    line, services = world.line, world.timetable.services
    tracks = list(line.track_by_id.values())
    # Movements through the points of a network are kept apart by wire.
    turnouts = () if line.network else line.turnouts
    # Who leaves the line in the last section of its route never comes to the points at its end.
    ways_m = [
        (
            line.track_by_id[service.route[0]].start_m,
            line.track_by_id[service.route[-1]].end_m,
        )
        for service in services
    ]
    passed = [
        [start_m < points.position_m < end_m for start_m, end_m in ways_m] for points in turnouts
    ]
    routes = [frozenset(service.route) for service in services]
    used = [[track.id in route for route in routes] for track in tracks]
    starts = [track.start_m for track in tracks]
    ends = [track.end_m for track in tracks]
    return Layers(
        np.array(starts + [points.fouling_start_m for points in turnouts]),
        np.array(ends + [points.fouling_end_m for points in turnouts]),
        np.array([False] * len(tracks) + [True] * len(turnouts)),
        np.array(used + passed, dtype=np.bool_).reshape(-1, world.size),
    )


@compiled
def overlaps_m(bands: Bands, rows: IntArray, there_m: FloatArray, layers: Layers) -> FloatArray:
    """
    Return how far each train's band reaches into another one, at worst.

    Parameters
    ----------
    bands
        The bands.
    rows
        The trains that they are of. shape (n_bands,)
    there_m
        Up to this place a band counts as free, because no plan can make it shorter: the train
        cannot stop any sooner, where the train ahead has turned out to be further back; or it
        has entered the line behind one that has not reported since. [m], shape (n_bands,)
    layers
        The layers of the line.

    Returns
    -------
    FloatArray
        Depth of the deepest overlap with a band that is further on; 0 without any. In a layer for
        one band it is the depth in the layer. [m], shape (n_bands,)
    """
    size, moments = bands.rear_m.shape
    deepest_m, order = np.zeros(size), np.empty(size, dtype=np.intp)
    from_m, to_m = np.empty(size), np.empty(size)
    for band in range(size):
        from_m[band], to_m[band] = bands.rear_m[band].min(), bands.front_m[band].max()
    for layer in range(layers.start_m.size):
        start_m, end_m = layers.start_m[layer], layers.end_m[layer]
        users = 0
        for band in range(size):
            passes = layers.used[layer, rows[band]]
            if passes and from_m[band] < end_m and to_m[band] > start_m:
                order[users] = band
                users += 1
        if users < 2:
            continue
        within = start_m, end_m, bool(layers.single[layer])
        for moment in range(moments):
            _look_through(bands, order[:users], moment, within, there_m, deepest_m)
    return deepest_m


@formula
def _look_through(
    bands: Bands,
    order: IntArray,
    moment: int,
    within: tuple[float, float, bool],
    there_m: FloatArray,
    deepest_m: FloatArray,
) -> None:
    """Note how deep bands are in others in a layer at a moment, from the foremost band back."""
    _sort_by_rear(order, bands.rear_m, moment)
    start_m, end_m, single = within
    # Who reaches furthest back bounds the next one.
    bound_m = np.inf
    for place in range(order.size - 1, -1, -1):
        band = order[place]
        rear_m = max(bands.rear_m[band, moment], start_m)
        front_m = min(bands.front_m[band, moment], end_m)
        if front_m <= rear_m:
            continue
        depth_m = front_m - max(bound_m, there_m[band])
        deepest_m[band] = max(deepest_m[band], depth_m)
        bound_m = start_m if single else rear_m


class Ways(NamedTuple):
    """Where trains go one after the other; arrays of shape (n_tracks,), or (n_turnouts,)."""

    entry_m: FloatArray
    """A train that is not on the track yet waits here for it. [m]"""
    clear_m: FloatArray
    """A tail here has left it. [m]"""
    used: BoolArray
    """The train's route takes the track. shape (n_tracks, n_trains)"""
    locked_from_m: FloatArray
    """Detector-locked sections. [m]"""
    locked_to_m: FloatArray
    passed: BoolArray
    """The train's route passes the turnout. shape (n_turnouts, n_trains)"""


def ways_of(world: World) -> Ways:
    """
    Return where trains go one after the other.

    Parameters
    ----------
    world
        Line and timetable.

    Returns
    -------
    Ways
        Of a whole run.
    """
    layers, line = layers_of(world), world.line
    tracks = len(line.track_by_id)
    entry_m, clear_m = layers.start_m[:tracks].copy(), layers.end_m[:tracks].copy()
    for points in line.turnouts:
        entry_m[layers.start_m[:tracks] == points.position_m] = points.fouling_start_m
        clear_m[layers.end_m[:tracks] == points.position_m] = points.fouling_end_m
    return Ways(
        entry_m,
        clear_m,
        layers.used[:tracks],
        layers.start_m[tracks:],
        layers.end_m[tracks:],
        layers.used[tracks:],
    )


@compiled
def free_to_m(
    rows: IntArray,
    front_m: FloatArray,
    tail_m: FloatArray,
    gone: BoolArray,
    granted_to_m: FloatArray,
    ways: Ways,
) -> FloatArray:
    """
    Return how far the ways of some trains are free, as far as a centre knows.

    Parameters
    ----------
    rows
        The trains. shape (n_rows,)
    front_m, tail_m
        Where trains are at the latest report, at the furthest and the least; a train that has
        never reported counts as at its origin. [m], shape (n_trains,)
    gone
        Trains that have left the line. shape (n_trains,)
    granted_to_m
        Where the first thing begins that is not granted to the train. [m], shape (n_trains,)
    ways
        Where they go one after the other, in the order of the timetable.

    Returns
    -------
    FloatArray
        What is granted for all others. [m], shape (n_trains,)
    """
    free_m = granted_to_m.copy()
    for train in rows:
        for ahead in range(train):
            if gone[ahead]:
                continue
            for track in range(ways.entry_m.size):
                both = ways.used[track, train] and ways.used[track, ahead]
                if both and tail_m[ahead] < ways.clear_m[track]:
                    bound_m = max(tail_m[ahead], ways.entry_m[track])
                    free_m[train] = min(free_m[train], bound_m)
            for turnout in range(ways.locked_from_m.size):
                both = ways.passed[turnout, train] and ways.passed[turnout, ahead]
                outside = front_m[train] <= ways.locked_from_m[turnout] + AT_START_M
                if both and outside and tail_m[ahead] < ways.locked_to_m[turnout]:
                    free_m[train] = min(free_m[train], ways.locked_from_m[turnout])
    return free_m


class NetworkWays(NamedTuple):
    """Where trains of a network go one after the other; arrays of shape (n_trains, n_tracks)."""

    entry_m: FloatArray
    """A train that is not on a track of its route yet waits here for it; inf past the last. [m]"""
    clear_m: FloatArray
    """A tail here has left it. [m]"""
    ahead: IntArray
    """The train before on the track; -1 for none."""
    ahead_at: IntArray
    """Which track of that train's route it is."""


def network_ways_of(world: World) -> NetworkWays:
    """
    Return where the trains of a network go one after the other.

    Parameters
    ----------
    world
        Network and timetable.

    Returns
    -------
    NetworkWays
        Of a whole run.
    """
    ways, shape = world.passages, (world.size, max(map(len, world.passages)))
    entry_m, clear_m = np.full((2, *shape), np.inf)
    ahead, ahead_at = np.full((2, *shape), -1, dtype=np.intp)
    for row, (way, order) in enumerate(zip(ways, world.orders, strict=True)):
        for number, passage in enumerate(way):
            entry_m[row, number], clear_m[row, number] = passage.entry_m, passage.clear_m
            ahead[row, number], ahead_at[row, number] = order.ahead[number]
    return NetworkWays(entry_m, clear_m, ahead, ahead_at)


@compiled
def free_in_network_m(
    rows: IntArray,
    tail_m: FloatArray,
    gone: BoolArray,
    granted_to_m: FloatArray,
    ways: NetworkWays,
) -> FloatArray:
    """
    Return how far the ways of some trains through a network are free, as far as a centre knows.

    Parameters
    ----------
    rows
        The trains; none of them has left the line. shape (n_rows,)
    tail_m
        Where tails are at the latest report, at the least. [m], shape (n_trains,)
    gone
        Trains that have left the line. shape (n_trains,)
    granted_to_m
        Where the first thing begins that is not granted to the train. [m], shape (n_trains,)
    ways
        Where they go one after the other.

    Returns
    -------
    FloatArray
        What is granted for all others. [m], shape (n_trains,)
    """
    free_m = granted_to_m.copy()
    for train in rows:
        for number in range(ways.ahead.shape[1]):
            ahead, at = ways.ahead[train, number], ways.ahead_at[train, number]
            # Nobody passes another on a track: behind who is gone comes who was before it, and
            # maybe also behind who begins on the track and has not come yet.
            while ahead >= 0:
                if not gone[ahead] and tail_m[ahead] < ways.clear_m[ahead, at]:
                    bound_m = max(tail_m[ahead], ways.entry_m[train, number])
                    free_m[train] = min(free_m[train], bound_m)
                if not gone[ahead] and at > 0:
                    break
                ahead, at = ways.ahead[ahead, at], ways.ahead_at[ahead, at]
    return free_m


@formula
def _sort_by_rear(order: IntArray, rear_m: FloatArray, moment: int) -> None:
    """Sort bands by their rears; from moment to moment hardly any changes its place."""
    for unsorted in range(1, order.size):
        band, place = order[unsorted], unsorted
        while place > 0 and rear_m[order[place - 1], moment] > rear_m[band, moment]:
            order[place] = order[place - 1]
            place -= 1
        order[place] = band
