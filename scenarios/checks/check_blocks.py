"""Cross-checks of blocks, track circuits and balises."""

from itertools import pairwise
from typing import TYPE_CHECKING

from kankaku.scenarios.checks.line_tables import (
    TOLERANCE_KM,
    LineTables,
    duplicates,
    length_mistakes,
    same,
    tiling_mistakes,
)
from kankaku.scenarios.reading.mistakes import Mistake, meant, row_place
from kankaku.scenarios.reading.row_formats import BlockRow, CircuitRow, StretchRow

if TYPE_CHECKING:
    from kankaku.scenarios.reading.files import Table


def block_mistakes(line: LineTables) -> list[Mistake]:
    """Return mistakes of blocks: each one lies on its track, and they leave no gap."""
    table = line.blocks
    stretches: Table[StretchRow] = table
    mistakes = duplicates(table) + length_mistakes(stretches)
    if not (line.tracks.complete and table.present):
        return mistakes
    tracks = {track.id: track for track in line.tracks}
    for row in table:
        if row.track not in tracks:
            problem, allowed = f"unknown track {row.track!r}", meant(row.track, tracks)
            mistakes.append(table.mistake(row, "track", problem, allowed))
    for track in tracks.values():
        mine = sorted((row for row in table if row.track == track.id), key=lambda row: row.start_km)
        mistakes += tiling_mistakes(stretches, mine, "the block", gaps=table.complete)
        if not table.complete:
            continue
        if not mine:
            problem = f"track {track.id!r} has no block"
            allowed = f"blocks from {track.start_km:g} to {track.end_km:g}"
            mistakes.append(Mistake(table.file, "column track", problem, allowed))
            continue
        for row, column in ((mine[0], "start_km"), (mine[-1], "end_km")):
            wanted = getattr(track, column)
            if not same(getattr(row, column), wanted):
                problem = f"the blocks do not reach from end to end of track {track.id!r}"
                mistakes.append(table.mistake(row, column, problem, f"{wanted:g}"))
    return mistakes


def circuit_mistakes(line: LineTables) -> list[Mistake]:
    """Return mistakes of track circuits: each one lies in one block, and they leave no gap."""
    table = line.circuits
    stretches: Table[StretchRow] = table
    mistakes = duplicates(table) + length_mistakes(stretches)
    if not (line.tracks.complete and line.blocks.complete and table.present):
        return mistakes
    if not line.blocks.present:
        return [
            *mistakes,
            Mistake(table.file, "", "there are no blocks to divide", "with blocks.csv"),
        ]
    divided: dict[str, list[CircuitRow]] = {}
    for row in table:
        block = _block_at(line, row)
        if isinstance(block, Mistake):
            mistakes.append(block)
        else:
            divided.setdefault(block.id, []).append(row)
    for block in line.blocks:
        mine = sorted(divided.pop(block.id, []), key=lambda row: row.start_km)
        mistakes += tiling_mistakes(stretches, mine, "the circuit", gaps=table.complete)
        if not (mine and table.complete):
            continue
        for row, column in ((mine[0], "start_km"), (mine[-1], "end_km")):
            wanted = getattr(block, column)
            if not same(getattr(row, column), wanted):
                problem = f"the circuits do not reach from end to end of block {block.id!r}"
                mistakes.append(table.mistake(row, column, problem, f"{wanted:g}"))
    return mistakes


def _block_at(line: LineTables, row: CircuitRow) -> BlockRow | Mistake:
    """Return the block in which a circuit begins, or why there is none."""
    tracks = {track.id: track for track in line.tracks}
    if row.track not in tracks:
        problem, allowed = f"unknown track {row.track!r}", meant(row.track, tracks)
        return line.circuits.mistake(row, "track", problem, allowed)
    for block in line.blocks:
        from_km, to_km = block.start_km - TOLERANCE_KM, block.end_km - TOLERANCE_KM
        if block.track == row.track and from_km <= row.start_km < to_km:
            return block
    problem = f"no block of track {row.track!r} holds {row.start_km:g}"
    track = tracks[row.track]
    allowed = f"from {track.start_km:g} to below {track.end_km:g}"
    return line.circuits.mistake(row, "start_km", problem, allowed)


def point_mistakes(line: LineTables) -> list[Mistake]:
    """Return mistakes of balises and geometry: points lie in order, and on the line."""
    mistakes = []
    for file, points in (
        (line.balises.file, [(row.row, row.chainage_km) for row in line.balises]),
        (line.geometry.file, [(row.row, row.chainage_km) for row in line.geometry]),
    ):
        for (row_before, before_km), (row, here_km) in pairwise(points):
            if here_km <= before_km:
                problem = f"{here_km:g} does not lie after row {row_before}"
                where = row_place(row, "chainage_km")
                mistakes.append(Mistake(file, where, problem, f"above {before_km:g}"))
    if line.extent_km:
        start_km, end_km = line.extent_km
        mistakes += [
            line.balises.mistake(
                row, "chainage_km", "outside the line", f"from {start_km:g} to {end_km:g}"
            )
            for row in line.balises
            if not start_km <= row.chainage_km <= end_km
        ]
    return mistakes
