"""
Block joints for a headway: long blocks on the way, shorter ones where trains stop.

On the way a train that is not hindered at speed ``v`` is at least the reaction time, its braking
distance, one block, the margin before a taken block and its own length behind the train ahead
[1]_, so that blocks may be as long as ``v (h - t) - b - m - l`` for a headway ``h``. At platforms
trains are slow and stand; what blocks are needed there only the whole blocking time tells, so that
their length is found by trial.

References
----------
.. [1] Pachl, *Railway Operation and Control*, 4th edition, 2018: blocking-time theory.
"""

from collections.abc import Sequence
from itertools import pairwise
from math import ceil
from typing import NamedTuple

from kankaku.railway.plan.rolling_stock import TrainType
from kankaku.scenarios.checks.line_tables import LineTables
from kankaku.scenarios.reading.row_formats import BlockRow, CircuitRow, PlatformRow

LONGEST_M, SHORTEST_M = 500.0, 25.0
EVEN_M = (500.0, 400.0, 320.0, 270.0, 240.0, 220.0, 200.0, 180.0, 160.0, 140.0, 120.0, 100.0, 80.0)
NEAR_M = (300.0, 200.0, 150.0, 110.0, 80.0, 60.0)
CIRCUITS_M = (300.0, 200.0, 150.0, 110.0, 80.0, 60.0, 45.0, 35.0, 25.0)
"""Lengths that are tried: of all blocks, of those by platforms, of track circuits there. [m]"""
REACTION_S, MARGIN_M = 3.0, 25.0
"""Idle time and release of a block; kept free before it, where nothing else is known."""


class Piece(NamedTuple):
    """A track that is divided."""

    track: str
    start_km: float
    end_km: float
    signals_km: tuple[float, ...] = ()
    """Where points at its ends begin to be fouled: trains wait there."""


class BlockTrial(NamedTuple):
    """A layout that is tried."""

    far_m: float
    """No block is longer."""
    near_m: float
    """No block by platforms is longer; or no track circuit."""
    at_platforms: bool
    """Joints stand at the ends of platforms, too."""


class Zone(NamedTuple):
    """Around the platforms of a station."""

    station: str
    start_km: float
    end_km: float


def longest_m(train: TrainType, headway_s: float) -> float:
    """
    Return how long blocks on the way may be.

    Parameters
    ----------
    train
        The train; its greatest speed counts.
    headway_s
        The headway. [s]

    Returns
    -------
    float
        By the formula above, within sensible bounds. [m]
    """
    speed_mps = train.maximum_speed_mps
    room_m = speed_mps * (headway_s - REACTION_S) - braking_m(train) - MARGIN_M - train.length_m
    return max(min(10.0 * (room_m // 10.0), LONGEST_M), SHORTEST_M)


def braking_m(train: TrainType) -> float:
    """
    Return the braking distance from the greatest speed.

    Parameters
    ----------
    train
        The train.

    Returns
    -------
    float
        With the service brake, on the level. [m]
    """
    return float(train.maximum_speed_mps**2 / (2.0 * train.service_brake_mps2))


def pieces_of(line: LineTables) -> list[Piece]:
    """
    Return the physical tracks of a line.

    Parameters
    ----------
    line
        Its files, without mistakes.

    Returns
    -------
    list[Piece]
        Tracks of a chain, or links between nodes.
    """
    if line.nodes.present:
        nodes = {node.id: node for node in line.nodes}
        found = {}
        for link in line.links:
            low, high = nodes[link.from_node], nodes[link.to_node]
            signals_km = low.fouling_end_km, high.fouling_start_km
            found[link.resource or link.id] = Piece(link.id, low.km, high.km, signals_km)
        return list(found.values())
    signals = tuple(row.fouling_start_km for row in line.turnouts)
    return [Piece(track.id, track.start_km, track.end_km, signals) for track in line.tracks]


def trials(far_m: float) -> list[BlockTrial]:
    """
    Return layouts of blocks to try.

    Parameters
    ----------
    far_m
        What blocks on the way may be at most. [m]

    Returns
    -------
    list[BlockTrial]
        Even ones and those with shorter blocks by platforms, from long ones to short ones.
    """
    even = {BlockTrial(min(m, far_m), min(m, far_m), at_platforms=False) for m in EVEN_M}
    uneven = {BlockTrial(far_m, min(m, far_m), at_platforms=True) for m in NEAR_M}
    return sorted(even | uneven, key=lambda one: (-one.near_m, one.at_platforms))


def zones_of(line: LineTables, train: TrainType) -> list[Zone]:
    """
    Return where trains brake to platforms and leave them.

    Parameters
    ----------
    line
        Its files.
    train
        The train.

    Returns
    -------
    list[Zone]
        By station: from a braking distance before its platforms to one behind them, and at least
        two trains.
    """
    away_km = max(braking_m(train), 2.0 * train.length_m) / 1000.0
    found = {}
    for station in line.stations:
        own = [row for row in line.platforms if row.station == station.id]
        if own:
            low_km = min(row.start_km for row in own) - away_km
            found[station.id] = Zone(station.id, low_km, max(row.end_km for row in own) + away_km)
    return list(found.values())


def edges_km(
    piece: Piece,
    platforms: Sequence[PlatformRow],
    zones: Sequence[Zone],
    trial: BlockTrial,
) -> list[float]:
    """
    Divide a track.

    Parameters
    ----------
    piece
        The track.
    platforms
        Those along it; there are joints at their ends.
    zones
        Where blocks are shorter.
    trial
        Lengths.

    Returns
    -------
    list[float]
        Rising, both ends included. [km]
    """
    marks = {piece.start_km, piece.end_km, *piece.signals_km}
    marks |= {km for row in platforms for km in (row.start_km, row.end_km)}
    inside = sorted(km for km in marks if piece.start_km <= km <= piece.end_km)
    kept = [inside[0]]
    for km in inside[1:]:
        if km - kept[-1] >= SHORTEST_M / 1000.0:
            kept.append(km)
        elif km == piece.end_km and len(kept) > 1:
            kept[-1] = km
    kept[-1] = piece.end_km
    found = [kept[0]]
    for low_km, high_km in pairwise(kept):
        at_km = low_km
        while at_km < high_km - 1e-9:
            within = any(zone.start_km <= at_km < zone.end_km for zone in zones)
            here_m = trial.near_m if within else trial.far_m
            ahead_km = [z.start_km for z in zones if at_km < z.start_km < high_km and not within]
            next_km = min(ahead_km, default=high_km)
            stretch_km = min(next_km, high_km) - at_km
            count = max(ceil(1000.0 * stretch_km / here_m - 1e-9), 1)
            at_km = high_km if count == 1 and next_km >= high_km else at_km + stretch_km / count
            found.append(round(at_km, 3))
        found[-1] = high_km
    return found


def blocks_of(line: LineTables, zones: Sequence[Zone], trial: BlockTrial) -> list[BlockRow]:
    """
    Return the blocks of a line.

    Parameters
    ----------
    line
        Its files.
    zones
        Where blocks are shorter.
    trial
        Lengths.

    Returns
    -------
    list[BlockRow]
        By track, rising.
    """
    rows = []
    for piece in pieces_of(line):
        own = [r for r in line.platforms if r.track == piece.track and trial.at_platforms]
        edges = edges_km(piece, own, zones if trial.near_m < trial.far_m else (), trial)
        rows += [
            BlockRow(0, low_km, high_km, f"{piece.track}.{number:02d}", piece.track)
            for number, (low_km, high_km) in enumerate(pairwise(edges), 1)
        ]
    return rows


def circuits_of(
    blocks: Sequence[BlockRow], zones: Sequence[Zone], near_m: float
) -> list[CircuitRow]:
    """
    Divide blocks near platforms into track circuits.

    Parameters
    ----------
    blocks
        The blocks.
    zones
        Where they are divided.
    near_m
        No circuit is longer there. [m]

    Returns
    -------
    list[CircuitRow]
        Of divided blocks alone; a block without any is one circuit.
    """
    rows = []
    for block in blocks:
        met = any(z.start_km < block.end_km and block.start_km < z.end_km for z in zones)
        most_m = near_m if met else LONGEST_M
        length_km = block.end_km - block.start_km
        count = max(ceil(1000.0 * length_km / most_m - 1e-9), 1)
        if count > 1:
            edges = [round(block.start_km + length_km * at / count, 3) for at in range(count + 1)]
            edges[0], edges[-1] = block.start_km, block.end_km
            rows += [
                CircuitRow(0, low_km, high_km, f"{block.id}.{number:02d}", block.track)
                for number, (low_km, high_km) in enumerate(pairwise(edges), 1)
            ]
    return rows
