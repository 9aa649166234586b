"""Blocks and controllers for a drafted line."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import ceil
from typing import Any

from kankaku.scenarios.drafts.draft import Draft
from kankaku.scenarios.drafts.station_sizes import WAITING_BLOCK_M
from kankaku.scenarios.reading.row_formats import BlockRow, LinkRow, NodeRow, TrackRow

LONGEST_BLOCK_M = 250.0
"""Blocks of a drafted line are no longer, unless a train needs more to brake in. [m]"""
STAIRS = 6
"""In so many blocks trains can come to a stand, code by code; an ATC counts 8 free ones. [-]"""
IDLE_S = 2.0
"""From a lower code until the brake takes effect. [s]"""
LOW_CODE_KMH, WEAK_KMHPS = 10, 3.0
"""Trains with a weaker brake than that are shown this code, too. [km/h], [km/h/s]"""
CODE_STEP_KMH = 15
"""Between the speed codes of a drafted ATC. [km/h]"""


def equip(draft: Draft, longest_m: float | None = None) -> None:
    """
    Give a drafted line blocks, unless it has some, and four controllers; note what that assumes.

    Parameters
    ----------
    draft
        A chain or a network without controllers; what it lacks is added.
    longest_m
        No block is longer; :func:`longest_block_m` if None. [m]
    """
    if not draft.rows.get("blocks.csv"):
        longest_m = longest_m or longest_block_m(draft.stock["train"])
        draft.rows["blocks.csv"] = [*_even_blocks_of(draft, longest_m)]
        draft.notes.assume(
            "blocks",
            f"even, {longest_m:g} m or less, with a signal where points begin",
            "signals are not in the source; only controllers with fixed blocks use them",
        )
    fastest_kmh = max(entry["maximum_speed_kmh"] for entry in draft.stock["train"].values())
    weakest_kmhps = min(entry["service_brake_kmhps"] for entry in draft.stock["train"].values())
    codes = speed_codes_kmh(fastest_kmh, weakest_kmhps)
    draft.settings["controllers"] = {
        "close_up": {"protection": "moving_block", "operation": "close_up"},
        "two_stage": {"protection": "moving_block", "operation": "two_stage"},
        "atc": {
            "protection": "multi_step_atc",
            "operation": "close_up",
            "protection_options": {"codes_kmh": codes},
        },
        "atd": {"protection": "atd", "operation": "close_up"},
    }
    draft.notes.assume(
        "speed codes of ATC",
        ", ".join(map(str, codes)) + " km/h",
        f"the fastest train's speed, and steps of {CODE_STEP_KMH} km/h below it",
    )


def _even_blocks_of(draft: Draft, longest_m: float) -> list[BlockRow]:
    tracks = draft.rows["tracks.csv"]
    nodes = [row for row in draft.rows.get("nodes.csv", ()) if isinstance(row, NodeRow)]
    links = [row for row in tracks if isinstance(row, LinkRow)]
    chain = [row for row in tracks if isinstance(row, TrackRow)]
    train_m = max(entry["length_m"] for entry in draft.stock["train"].values())
    return even_blocks(nodes, links, longest_m, train_m) + [
        block
        for row in chain
        for block in blocks_between(row.id, (row.start_km, row.end_km), longest_m)
    ]


def longest_block_m(train_types: Mapping[str, Mapping[str, Any]]) -> float:
    """
    Return how long blocks may be, so that trains can brake by codes in a few of them.

    Parameters
    ----------
    train_types
        Tables ``[train.NAME]`` of ``rolling_stock.toml`` by name.

    Returns
    -------
    float
        250 m, or more for fast trains with weak brakes. [m]
    """
    longest_m = LONGEST_BLOCK_M
    for entry in train_types.values():
        top_mps = entry["maximum_speed_kmh"] / 3.6
        braking_m = top_mps**2 / (2.0 * entry["service_brake_kmhps"] / 3.6)
        steps = ceil(entry["maximum_speed_kmh"] / CODE_STEP_KMH)
        idle_m = steps * IDLE_S * top_mps / 2.0
        longest_m = max(longest_m, 50.0 * ceil((braking_m + idle_m) / STAIRS / 50.0))
    return longest_m


def even_blocks(
    nodes: Sequence[NodeRow],
    links: Sequence[LinkRow],
    longest_m: float = LONGEST_BLOCK_M,
    train_m: float = 0.0,
) -> list[BlockRow]:
    """
    Divide every track into even blocks, from where points are fouled to where the next ones are.

    A train that waits before points would else have to wait before the block that they lie in.
    Between two points blocks are so short that a train is clear of the first ones as soon as it is
    in the last block before the second ones, where there is room for that.

    Parameters
    ----------
    nodes
        Where tracks begin and end.
    links
        The tracks.
    longest_m
        No block is longer. [m]
    train_m
        Length of the longest train. [m]

    Returns
    -------
    list[BlockRow]
        By track, rising.
    """
    node_of = {node.id: node for node in nodes}
    rows = []
    for link in links:
        low, high = node_of[link.from_node], node_of[link.to_node]
        inside_km = {low.fouling_end_km, high.fouling_start_km}
        edges = sorted({low.km, *(km for km in inside_km if low.km < km < high.km), high.km})
        last_m = 1000.0 * (high.fouling_start_km - low.fouling_end_km) - train_m
        waits = low.kind == high.kind == "points" and last_m >= WAITING_BLOCK_M
        most_m = min(longest_m, last_m) if waits else longest_m
        parts = [_edges_km(ends_km, most_m) for ends_km in pairwise(edges)]
        rows += _blocks(link.id, [low.km, *(km for part in parts for km in part[1:])])
    return rows


def blocks_between(
    track: str, ends_km: tuple[float, float], longest_m: float = LONGEST_BLOCK_M
) -> list[BlockRow]:
    """
    Divide a track into blocks of equal length.

    Parameters
    ----------
    track
        Its identifier.
    ends_km
        Where it begins and ends. [km]
    longest_m
        Length that no block exceeds. [m]

    Returns
    -------
    list[BlockRow]
        Rising.
    """
    return _blocks(track, _edges_km(ends_km, longest_m))


def _edges_km(ends_km: tuple[float, float], longest_m: float) -> list[float]:
    low_km, high_km = ends_km
    count = ceil((high_km - low_km) * 1000.0 / longest_m)
    between = (round(low_km + (high_km - low_km) * at / count, 3) for at in range(1, count))
    return [low_km, *between, high_km]


def _blocks(track: str, edges_km: Sequence[float]) -> list[BlockRow]:
    return [
        BlockRow(0, *ends_km, f"{track}.{number:02d}", track)
        for number, ends_km in enumerate(pairwise(edges_km), 1)
    ]


def speed_codes_kmh(fastest_kmh: float, weakest_kmhps: float = WEAK_KMHPS) -> list[int]:
    """
    Return speed codes for a line.

    Parameters
    ----------
    fastest_kmh
        Greatest speed of its trains. [km/h]
    weakest_kmhps
        Least service brake of its trains; weak ones need a low code to stop in a short block.
        [km/h/s]

    Returns
    -------
    list[int]
        Falling, down to 0. [km/h]
    """
    top = int(5 * ceil(fastest_kmh / 5.0))
    slow = [LOW_CODE_KMH] if weakest_kmhps < WEAK_KMHPS else []
    return [*range(top, LOW_CODE_KMH, -CODE_STEP_KMH), *slow, 0]
