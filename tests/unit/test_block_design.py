"""Blocks for a headway: they tile every track, and are no longer than was asked."""

from itertools import pairwise

import pytest

from kankaku.scenarios.drafts.block_design import (
    SHORTEST_M,
    BlockTrial,
    Piece,
    Zone,
    circuits_of,
    edges_km,
    trials,
)
from kankaku.scenarios.drafts.equipment import even_blocks
from kankaku.scenarios.reading.row_formats import BlockRow, LinkRow, NodeRow, PlatformRow

PIECE = Piece("t", -0.2, 4.0, (-0.14, 3.94))
PLATFORM = PlatformRow(0, 1.935, 2.065, "s", "t", 2.06)
ZONE = Zone("s", 1.6, 2.4)


@pytest.mark.parametrize("trial", trials(500.0))
def test_blocks_tile_a_track_and_keep_their_lengths(trial: BlockTrial) -> None:
    platforms = [PLATFORM] if trial.at_platforms else []
    edges = edges_km(PIECE, platforms, [ZONE], trial)
    assert edges[0] == PIECE.start_km
    assert edges[-1] == PIECE.end_km
    assert {-0.14, 3.94} <= set(edges)
    if trial.at_platforms:
        assert {1.935, 2.065} <= set(edges)
    for low_km, high_km in pairwise(edges):
        length_m = 1000.0 * (high_km - low_km)
        assert SHORTEST_M / 2.0 < length_m <= trial.far_m + 1.0
        if ZONE.start_km <= low_km < ZONE.end_km:
            assert length_m <= trial.near_m + 1.0


def test_circuits_divide_the_blocks_by_platforms_alone() -> None:
    blocks = [BlockRow(0, 0.0, 0.5, "a", "t"), BlockRow(0, 1.5, 2.0, "b", "t")]
    rows = circuits_of(blocks, [ZONE], 60.0)
    assert [row.track for row in rows] == ["t"] * 9
    assert (rows[0].start_km, rows[-1].end_km) == (1.5, 2.0)
    assert all(one.end_km == other.start_km for one, other in pairwise(rows))


def test_a_signal_stands_where_points_begin_to_be_fouled() -> None:
    nodes = [
        NodeRow(0, "low", 0.0, "points", -0.06, 0.06),
        NodeRow(0, "high", 1.0, "points", 0.94, 1.06),
    ]
    rows = even_blocks(nodes, [LinkRow(0, "l", "low", "high", "both", 1.0)], 250.0)
    edges = [rows[0].start_km, *(row.end_km for row in rows)]
    assert edges == [0.0, 0.06, 0.28, 0.5, 0.72, 0.94, 1.0]
