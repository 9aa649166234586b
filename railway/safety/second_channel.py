"""
The second channel of a centre that plans bands: may a map be sent?

It works out again from reports, timetable order and what is granted by wire how far each train's
way is free, and uses nothing of whoever plans.
"""

from typing import NamedTuple

import numpy as np

from kankaku.railway.arrays import BoolArray, FloatArray, IntArray
from kankaku.railway.compiled import Plain, compiled
from kankaku.railway.plan.brake_table import BrakeTable, braked_stop_m
from kankaku.railway.plan.world import World
from kankaku.railway.safety.band_exclusion import (
    Bands,
    Layers,
    NetworkWays,
    Ways,
    free_in_network_m,
    free_to_m,
    layers_of,
    network_ways_of,
    overlaps_m,
    ways_of,
)


class TestedWith(NamedTuple):
    """What a map is tested with; arrays of shape (n_trains,)."""

    braking: BrakeTable
    margin_m: float
    """Between the place before which a train can stop and the rear of the band ahead. [m]"""
    rounding_m: float
    """Runs are stepped, so bands may pass their ends by this much. [m]"""
    valid_s: float
    """For how long a telegram commands. [s]"""
    length_m: FloatArray
    origin_m: FloatArray
    """Where each train is before it has entered. [m]"""
    layers: Layers
    chain: Ways
    """Of no train in a network."""
    network: NetworkWays
    """Of no train on a chain."""


def checked(world: World, margin_m: float, rounding_m: float, valid_s: float) -> TestedWith:
    """
    Return what maps are tested with.

    Parameters
    ----------
    world
        Line and timetable.
    margin_m
        See :class:`TestedWith`, as the rest. [m]
    rounding_m
        [m]
    valid_s
        [s]

    Returns
    -------
    TestedWith
        Of a whole run.
    """
    nowhere_m, nobody = np.zeros((0, 0)), np.zeros((0, 0), dtype=np.intp)
    chain, network = ways_of(world), NetworkWays(nowhere_m, nowhere_m, nobody, nobody)
    if world.line.network:
        network = network_ways_of(world)
    return TestedWith(
        world.braking,
        margin_m,
        rounding_m,
        valid_s,
        world.length_m,
        world.stop_m[:, 0].copy(),
        layers_of(world),
        chain,
        network,
    )


@compiled
def excludes(
    told: tuple[float, FloatArray, FloatArray, FloatArray, FloatArray],
    line: tuple[FloatArray, BoolArray, FloatArray],
    mapped: tuple[IntArray, BoolArray, FloatArray, FloatArray, FloatArray],
    fields: Plain,
) -> bool:
    """
    Return whether no band of a map overlaps another one, and no end lies beyond what is free.

    Parameters
    ----------
    told
        Now [s]; when each train has reported last [s], its front [m] and speed [m/s] then, and by
        how much longer it may be because it does not know where it is [m]. shape (n_trains,) each
    line
        By wire: fronts [m], who is on the line, and where the first thing begins that is not
        granted to each train [m]. shape (n_trains,) each
    mapped
        Rows of the bands, shape (n_bands,), and which trains are planned for, shape (n_trains,);
        rears and fronts of the bands [m], shape (n_bands, n_moments); and the furthest end that
        each train is commanded, -inf for none [m], shape (n_trains,)
    fields
        Of :class:`TestedWith`, plain.

    Returns
    -------
    bool
        Whether it may be sent.
    """
    (now_s, known_s, reported_m, speed_mps, longer_m), (seen_m, present, granted_to_m) = told, line
    rows, planned, rears_m, fronts_m, furthest_m = mapped
    braking, (margin_m, rounding_m, valid_s) = BrakeTable(*fields[0]), fields[1:4]
    length_m, origin_m, layers = fields[4], fields[5], Layers(*fields[6])
    size = present.size
    tail_m, gone = np.empty(size), np.empty(size, dtype=np.bool_)
    for train in range(size):
        tail_m[train] = reported_m[train] - length_m[train] - longer_m[train]
        # Detection at both ends of the line is by wire.
        gone[train] = not present[train] and seen_m[train] > origin_m[train]
    there, network = np.flatnonzero(present), NetworkWays(*fields[8])
    if network.ahead.size:
        free_m = free_in_network_m(there, tail_m, gone, granted_to_m, network)
    else:
        free_m = free_to_m(there, reported_m, tail_m, gone, granted_to_m, Ways(*fields[7]))
    for row in there:
        if furthest_m[row] + margin_m - free_m[row] > rounding_m:
            return False
    there_m, less_m = np.empty(rows.size), np.empty_like(fronts_m)
    for band in range(rows.size):
        train = rows[band]
        # Trains have run on since their reports.
        age_s = min(max(now_s - known_s[train], 0.0), valid_s)
        on_m = reported_m[train] + age_s * speed_mps[train]
        there_m[band] = braked_stop_m(braking, train, on_m, speed_mps[train]) + margin_m
        for moment in range(fronts_m.shape[1]):
            less_m[band, moment] = fronts_m[band, moment] - rounding_m
    inside_m = overlaps_m(Bands(rears_m, less_m), rows, there_m, layers)
    apart = True
    for band in range(rows.size):
        # Who has not been planned for is sent nothing, and stays or stops by what it has.
        apart = apart and not (planned[rows[band]] and inside_m[band] > 0.0)
    return apart
