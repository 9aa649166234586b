"""The exclusion test of the control map, against every pair of bands one by one."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kankaku.railway.arrays import BoolArray
from kankaku.railway.safety.band_exclusion import (
    Bands,
    Layers,
    free_to_m,
    layers_of,
    overlaps_m,
    ways_of,
)
from kankaku.testing.example_lines import world_of
from kankaku.testing.loop_station import loop_station_scenario

LENGTH_M = 3000.0
MOMENTS = 3


@st.composite
def maps(draw: st.DrawFn) -> tuple[Bands, BoolArray, Layers]:
    """Return bands anywhere, on layers anywhere; no two rears are the same."""
    size, layers = draw(st.integers(2, 6)), draw(st.integers(1, 4))
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    rear_m = random.uniform(0.0, LENGTH_M, (size, MOMENTS))
    front_m = rear_m + random.uniform(50.0, 700.0, (size, MOMENTS))
    start_m = random.uniform(0.0, LENGTH_M, layers)
    end_m = start_m + random.uniform(100.0, 2000.0, layers)
    single = random.random(layers) < 0.5
    used = random.random((layers, size)) < 0.7
    return (
        Bands(rear_m, front_m),
        random.random(size) < 0.8,
        Layers(start_m, end_m, single, used),
    )


@given(maps())
def test_the_deepest_overlap_of_all_pairs_is_found(
    drawn: tuple[Bands, BoolArray, Layers],
) -> None:
    bands, on_map, layers = drawn
    expected_m = np.zeros(on_map.size)
    for layer, moment in np.ndindex(layers.start_m.size, MOMENTS):
        start_m, end_m = layers.start_m[layer], layers.end_m[layer]
        clipped = {
            int(train): (
                max(bands.rear_m[train, moment], start_m),
                min(bands.front_m[train, moment], end_m),
            )
            for train in np.flatnonzero(on_map & layers.used[layer])
        }
        inside = {train: ends for train, ends in clipped.items() if ends[1] > ends[0]}
        for pair in combinations(inside, 2):
            behind, ahead = sorted(pair, key=lambda train: bands.rear_m[train, moment])
            bound_m = start_m if layers.single[layer] else inside[ahead][0]
            expected_m[behind] = max(expected_m[behind], inside[behind][1] - bound_m)
    nowhere = np.full(on_map.size, -np.inf)
    rows = np.flatnonzero(on_map)
    on_it = Bands(bands.rear_m[rows], bands.front_m[rows])
    found_m = overlaps_m(on_it, rows, nowhere[rows], layers)
    assert found_m == pytest.approx(expected_m[rows], abs=1e-9)


def test_layers_are_tracks_and_points() -> None:
    scenario = loop_station_scenario(3, one_starts_inside=True)
    world = world_of(scenario)
    layers = layers_of(world)
    assert layers.start_m.tolist() == [0.0, 1000.0, 1000.0, 1800.0, 940.0, 1740.0]
    assert layers.end_m.tolist() == [1000.0, 1800.0, 1800.0, 3000.0, 1060.0, 1860.0]
    assert layers.single.tolist() == [False] * 4 + [True] * 2
    # T1 and T3 call on the north track, T2 and the one that starts inside on the south track.
    names = {name: row for row, name in enumerate(world.timetable.trains)}
    north, south, fan = layers.used[1], layers.used[2], layers.used[4]
    assert [name for name, row in names.items() if north[row]] == ["T1", "T3"]
    assert [name for name, row in names.items() if south[row]] == ["S1", "T2"]
    assert [name for name, row in names.items() if fan[row]] == ["T1", "T2", "T3"]


def test_two_trains_on_parallel_tracks_are_apart_but_not_in_the_points() -> None:
    world = world_of(replace(loop_station_scenario(2)))
    layers, on_map = layers_of(world), np.arange(2)
    nowhere = np.full(2, -np.inf)
    beside = Bands(np.array([[1300.0], [1200.0]]), np.array([[1650.0], [1640.0]]))
    assert overlaps_m(beside, on_map, nowhere, layers).tolist() == [0.0, 0.0]
    # The second one may still be in the points when the first one enters them.
    behind = Bands(np.array([[800.0], [1040.0]]), np.array([[955.0], [1400.0]]))
    assert overlaps_m(behind, on_map, nowhere, layers).tolist() == [15.0, 0.0]
    # Who stands there already may stay.
    there = np.array([955.0, 0.0])
    assert overlaps_m(behind, on_map, there, layers).tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("fronts_m", "gone", "free_m"),
    [
        # Behind each other on the track before the points, and nobody in them.
        ((800.0, 500.0), False, 600.0),
        # The first one is in the points: they admit one train, even with its tail out of the way.
        ((1255.0, 900.0), False, 940.0),
        # Its tail has cleared them; further on it goes another way, and comes back to the same one.
        ((1260.0, 900.0), False, 1740.0),
        ((2060.0, 1600.0), False, 1860.0),
        ((2500.0, 1600.0), False, 2300.0),
        ((3000.0, 1600.0), True, 2900.0),
    ],
)
def test_the_second_channel_works_out_what_is_free(
    fronts_m: tuple[float, float], gone: bool, free_m: float
) -> None:
    """Points lie from 940 m to 1060 m and from 1740 m to 1860 m; trains are 200 m long."""
    ways = ways_of(world_of(loop_station_scenario(2)))
    front_m = np.array(fronts_m)
    granted_to_m = np.array([5000.0, 2900.0])
    behind_m, left = front_m - 200.0, np.array([gone, False])
    found_m = free_to_m(np.arange(2), front_m, behind_m, left, granted_to_m, ways)
    assert found_m.tolist() == [5000.0, free_m]
