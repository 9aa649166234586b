"""
Blocks of a multi-step ATC that never show a code as high as the line permits.

A block shows a code only if a train at that speed can brake in the next block to what that one
shows. Where all blocks ahead are free and that still fails, no train ever runs as fast there as
line and codes would let it: the layout and the codes do not fit each other.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kankaku.controllers.protection.code_table import Braking, entry_speeds_mps
from kankaku.railway.arrays import FloatArray
from kankaku.railway.plan.world import World
from kankaku.railway.wayside.detection import Detection

KMH_PER_MPS = 3.6
HARDLY_MPS = 0.01
NAMED = 3
"""Blocks that a sentence names. [-]"""


class Doubt(NamedTuple):
    """Why a block never shows more than some code: what the next one would have to do."""

    block: str
    most_mps: float
    next_block: str
    next_m: float
    """Length of the next block. [m]"""
    from_mps: float
    """The next higher speed, at which a train would enter it. [m/s]"""
    to_mps: float
    """What it would have to brake to there. [m/s]"""
    needs_m: float
    """Way from the boundary until it has, idle time and overlap included. [m]"""


def never_shown(
    world: World,
    detection: Detection,
    codes_mps: FloatArray,
    braking: Braking,
    table_mps: FloatArray,
) -> tuple[str, ...]:
    """
    Return sentences about blocks that never show what line and codes would permit.

    Parameters
    ----------
    world
        Line and trains.
    detection
        Its blocks.
    codes_mps
        The codes, falling to 0. [m/s], shape (n_codes,)
    braking
        How trains brake.
    table_mps
        What blocks show, as :func:`kankaku.controllers.protection.code_table.code_table` returns
        it. [m/s], shape (n_types, n_places, n_counted + 1)

    Returns
    -------
    tuple[str, ...]
        One by code and train type, with the block where a train has least room for the next
        higher code.
    """
    sentences = []
    for kind, train in enumerate(world.train_types):
        reasons = _reasons(world, kind, detection, codes_mps, braking, table_mps[kind])
        of_type = f" for trains {train.id}" if len(world.train_types) > 1 else ""
        for most_mps in sorted({reason.most_mps for reason in reasons}, reverse=True):
            alike = [reason for reason in reasons if reason.most_mps == most_mps]
            sentences.append(_sentence(alike, of_type))
    return tuple(sentences)


def _reasons(
    world: World,
    kind: int,
    detection: Detection,
    codes_mps: FloatArray,
    braking: Braking,
    table_mps: FloatArray,
) -> list[Doubt]:
    blocks, pieces = detection.blocks, detection.line.blocks
    possible_mps = entry_speeds_mps(world.profile, kind, blocks, codes_mps)
    grid_m, potential = world.profile.grid_m, world.profile.potential_m2ps2[kind]
    # With all blocks free that are counted; of the next one's there is one less then.
    shown_mps, next_mps = table_mps[:, -1], table_mps[:, -2]
    found: dict[str, Doubt] = {}
    last = set((blocks.first[1:] - 1).tolist())
    for place in np.flatnonzero(shown_mps < possible_mps[:, 0] - HARDLY_MPS).tolist():
        name = pieces[blocks.piece[place]].id
        if place in last or name in found:
            continue
        ahead, most_mps, to_mps = place + 1, float(shown_mps[place]), float(next_mps[place + 1])
        higher_mps = np.minimum(codes_mps[codes_mps > most_mps].min(), possible_mps[ahead, 0])
        start_m = float(blocks.start_m[ahead])
        brakes_m = start_m + float(higher_mps) * braking.unbraked_s
        kept_m2ps2 = np.interp(brakes_m, grid_m, potential)
        spent_m2ps2 = 0.5 * (float(higher_mps) ** 2 - to_mps**2)
        braked_m = float(np.interp(kept_m2ps2 + spent_m2ps2, potential, grid_m))
        overlap_m = 0.0 if to_mps > 0.0 else braking.overlap_m
        found[name] = Doubt(
            name,
            most_mps,
            pieces[blocks.piece[ahead]].id,
            float(blocks.end_m[ahead]) - start_m,
            float(higher_mps),
            to_mps,
            braked_m - start_m + overlap_m,
        )
    return list(found.values())


def _sentence(alike: Sequence[Doubt], of_type: str) -> str:
    names = ", ".join(reason.block for reason in alike[:NAMED])
    more = f" and {len(alike) - NAMED} more" if len(alike) > NAMED else ""
    blocks, verb = ("block", "shows") if len(alike) == 1 else ("blocks", "show")
    # To the millimetre, so that of equals the first one is told.
    worst = min(alike, key=lambda reason: round(reason.next_m - reason.needs_m, 3))
    most, fro, to = (
        f"{KMH_PER_MPS * speed_mps:.4g} km/h"
        for speed_mps in (worst.most_mps, worst.from_mps, worst.to_mps)
    )
    end = f"to brake to {to}" if worst.to_mps > 0.0 else "to stop"
    return (
        f"{blocks} {names}{more} never {verb} more than {most}{of_type}: from {fro} a train needs "
        f"{worst.needs_m:.1f} m {end} in block {worst.next_block}, which has {worst.next_m:.1f} m"
    )
