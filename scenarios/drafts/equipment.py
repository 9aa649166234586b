"""Blocks and controllers for a drafted line."""

from collections.abc import Sequence
from math import ceil

from kankaku.scenarios.drafts.tables import Draft
from kankaku.scenarios.reading.row_formats import BlockRow, LinkRow, NodeRow

LONGEST_BLOCK_M = 250.0
"""Blocks of a drafted line are no longer. [m]"""
CODE_STEP_KMH = 15
"""Between the speed codes of a drafted ATC. [km/h]"""


def equip(draft: Draft) -> None:
    """
    Give a drafted network blocks and four controllers, and note what that assumes.

    Parameters
    ----------
    draft
        A network without blocks and controllers; they are added.
    """
    nodes = [row for row in draft.rows["nodes.csv"] if isinstance(row, NodeRow)]
    links = [row for row in draft.rows["tracks.csv"] if isinstance(row, LinkRow)]
    draft.rows["blocks.csv"] = [*even_blocks(nodes, links)]
    draft.notes.assume(
        "blocks",
        f"of equal length on every track, {LONGEST_BLOCK_M:g} m or less",
        "signals are not in the source; only controllers with fixed blocks use them",
    )
    fastest_kmh = max(entry["maximum_speed_kmh"] for entry in draft.stock["train"].values())
    codes = speed_codes_kmh(fastest_kmh)
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


def even_blocks(nodes: Sequence[NodeRow], links: Sequence[LinkRow]) -> list[BlockRow]:
    """
    Divide every track into blocks of equal length.

    Parameters
    ----------
    nodes
        Where tracks begin and end.
    links
        The tracks.

    Returns
    -------
    list[BlockRow]
        By track, rising.
    """
    at_km = {node.id: node.km for node in nodes}
    rows = []
    for link in links:
        low_km, high_km = at_km[link.from_node], at_km[link.to_node]
        count = ceil((high_km - low_km) * 1000.0 / LONGEST_BLOCK_M)
        edges = [round(low_km + (high_km - low_km) * at / count, 3) for at in range(count + 1)]
        edges[0], edges[-1] = low_km, high_km
        rows += [
            BlockRow(0, edges[at], edges[at + 1], f"{link.id}.{at + 1:02d}", link.id)
            for at in range(count)
        ]
    return rows


def speed_codes_kmh(fastest_kmh: float) -> list[int]:
    """
    Return speed codes for a line.

    Parameters
    ----------
    fastest_kmh
        Greatest speed of its trains. [km/h]

    Returns
    -------
    list[int]
        Falling, down to 0. [km/h]
    """
    top = int(5 * ceil(fastest_kmh / 5.0))
    return [*range(top, 10, -CODE_STEP_KMH), 0]
