"""Cross-checks of the line's files: everything must lie where it can lie."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

from kankaku.scenarios.reading.files import Table
from kankaku.scenarios.reading.mistakes import Mistake, meant, row_place
from kankaku.scenarios.reading.schema import (
    BaliseRow,
    BlockRow,
    CircuitRow,
    CrossingRow,
    CurveRow,
    GeometryRow,
    GradientRow,
    LimitRow,
    PlatformRow,
    StationRow,
    StretchRow,
    TrackRow,
    TurnoutRow,
)

TOLERANCE_KM = 1e-7
FAR_KM = 0.5
"""A platform further than this from the chainage of its station is another station's. [km]"""


@dataclass(frozen=True)
class LineTables:
    """The files that describe a line."""

    stations: Table[StationRow]
    tracks: Table[TrackRow]
    platforms: Table[PlatformRow]
    turnouts: Table[TurnoutRow]
    crossings: Table[CrossingRow]
    limits: Table[LimitRow]
    gradients: Table[GradientRow]
    curves: Table[CurveRow]
    balises: Table[BaliseRow]
    blocks: Table[BlockRow]
    circuits: Table[CircuitRow]
    geometry: Table[GeometryRow]

    @cached_property
    def sections(self) -> list[list[TrackRow]]:
        """Parallel tracks grouped by section, along the line."""
        groups: dict[str, list[TrackRow]] = {}
        for track in self.tracks:
            groups.setdefault(track.section, []).append(track)
        return sorted(groups.values(), key=lambda tracks: tracks[0].start_km)

    @cached_property
    def platform_at(self) -> dict[tuple[str, str], PlatformRow]:
        """Platforms by station and track."""
        return {(row.station, row.track): row for row in self.platforms}

    @property
    def extent_km(self) -> tuple[float, float] | None:
        """Where the line starts and ends; nothing as long as its tracks have mistakes."""
        if not (self.tracks.complete and self.tracks.rows):
            return None
        starts, ends = zip(*((track.start_km, track.end_km) for track in self.tracks), strict=True)
        return min(starts), max(ends)


def line_mistakes(line: LineTables) -> list[Mistake]:
    """
    Return everything that is wrong between the files of a line.

    Parameters
    ----------
    line
        The files.

    Returns
    -------
    list[Mistake]
        The mistakes.
    """
    mistakes = _track_mistakes(line) + _station_mistakes(line) + _platform_mistakes(line)
    mistakes += _turnout_mistakes(line) + _block_mistakes(line) + _circuit_mistakes(line)
    mistakes += _point_mistakes(line)
    for stretches in (line.limits, line.gradients, line.curves):
        mistakes += _stretch_mistakes(stretches, line.extent_km)
    return mistakes


def duplicates(
    table: Table[StationRow]
    | Table[TrackRow]
    | Table[CrossingRow]
    | Table[BlockRow]
    | Table[CircuitRow],
) -> list[Mistake]:
    """
    Return a mistake for every identifier that occurs a second time.

    Parameters
    ----------
    table
        The file.

    Returns
    -------
    list[Mistake]
        The mistakes.
    """
    first: dict[str, int] = {}
    mistakes = []
    for row in table.rows:
        if row.id in first:
            problem = f"{row.id!r} stands in row {first[row.id]} already"
            mistakes.append(
                Mistake(table.file, f"row {row.row}, column id", problem, "every id once")
            )
        first.setdefault(row.id, row.row)
    return mistakes


def same(one_km: float, other_km: float) -> bool:
    """
    Return whether two chainages are the same but for rounding.

    Parameters
    ----------
    one_km, other_km
        The chainages. [km]

    Returns
    -------
    bool
        Whether they are.
    """
    return abs(one_km - other_km) < TOLERANCE_KM


def _length_mistakes(table: Table[StretchRow]) -> list[Mistake]:
    return [
        table.mistake(
            row, "end_km", f"{row.end_km:g} does not lie after start_km", f"above {row.start_km:g}"
        )
        for row in table
        if row.end_km - row.start_km < TOLERANCE_KM
    ]


def _tiling_mistakes(
    table: Table[StretchRow], rows: Iterable[StretchRow], what: str, *, gaps: bool
) -> list[Mistake]:
    mistakes = []
    for before, after in pairwise(sorted(rows, key=lambda row: (row.start_km, row.row))):
        gap_km = after.start_km - before.end_km
        if gap_km < -TOLERANCE_KM or (gaps and gap_km > TOLERANCE_KM):
            kind = "leaves a gap behind" if gap_km > 0.0 else "overlaps"
            problem = f"{what} at {after.start_km:g} {kind} the one of row {before.row}"
            sign = "" if gaps else "not below "
            mistakes.append(table.mistake(after, "start_km", problem, f"{sign}{before.end_km:g}"))
    return mistakes


def _track_mistakes(line: LineTables) -> list[Mistake]:
    table: Table[StretchRow] = line.tracks
    mistakes = duplicates(line.tracks) + _length_mistakes(table)
    for tracks in line.sections:
        first = tracks[0]
        for track in tracks[1:]:
            for column in ("start_km", "end_km"):
                wanted = getattr(first, column)
                if not same(getattr(track, column), wanted):
                    problem = f"differs from the parallel track {first.id!r}"
                    mistakes.append(table.mistake(track, column, problem, f"{wanted:g}"))
    leading = [tracks[0] for tracks in line.sections]
    return mistakes + _tiling_mistakes(table, leading, "the section", gaps=line.tracks.complete)


def _station_mistakes(line: LineTables) -> list[Mistake]:
    table = line.stations
    mistakes = duplicates(table)
    for before, after in pairwise(table):
        if after.chainage_km <= before.chainage_km:
            problem = f"{after.chainage_km:g} does not lie after the station of row {before.row}"
            allowed = f"above {before.chainage_km:g}"
            mistakes.append(table.mistake(after, "chainage_km", problem, allowed))
    if line.extent_km:
        start_km, end_km = line.extent_km
        mistakes += [
            table.mistake(
                row, "chainage_km", "outside the line", f"from {start_km:g} to {end_km:g}"
            )
            for row in table
            if not start_km <= row.chainage_km <= end_km
        ]
    return mistakes


def _platform_mistakes(line: LineTables) -> list[Mistake]:
    table = line.platforms
    stretches: Table[StretchRow] = table
    mistakes = _length_mistakes(stretches)
    tracks = {track.id: track for track in line.tracks}
    stations = {station.id for station in line.stations}
    first: dict[tuple[str, str], int] = {}
    for row in table:
        track = tracks.get(row.track)
        if row.station not in stations and line.stations.complete:
            problem, allowed = f"unknown station {row.station!r}", meant(row.station, stations)
            mistakes.append(table.mistake(row, "station", problem, allowed))
        if track is None and line.tracks.complete:
            problem, allowed = f"unknown track {row.track!r}", meant(row.track, tracks)
            mistakes.append(table.mistake(row, "track", problem, allowed))
        if track and not track.start_km <= row.start_km <= row.end_km <= track.end_km:
            column = "start_km" if row.start_km < track.start_km else "end_km"
            allowed = f"from {track.start_km:g} to {track.end_km:g}"
            problem = f"the platform lies outside its track {row.track!r}"
            mistakes.append(table.mistake(row, column, problem, allowed))
        if not row.start_km <= row.stop_km <= row.end_km:
            allowed = f"from {row.start_km:g} to {row.end_km:g}"
            problem = f"the stop position {row.stop_km:g} lies outside the platform"
            mistakes.append(table.mistake(row, "stop_km", problem, allowed))
        if (row.station, row.track) in first:
            problem = f"the same platform as in row {first[row.station, row.track]}"
            mistakes.append(table.mistake(row, "", problem, "one platform per station and track"))
        first.setdefault((row.station, row.track), row.row)
    for track_id in tracks:
        mine = [row for row in table if row.track == track_id]
        mistakes += _tiling_mistakes(stretches, mine, "the platform", gaps=False)
    return mistakes or _place_mistakes(line)


def _place_mistakes(line: LineTables) -> list[Mistake]:
    """Return platforms that lie far from their station, or beyond the platform of another one."""
    table = line.platforms
    station_km = {station.id: station.chainage_km for station in line.stations}
    if list(station_km.values()) != sorted(station_km.values()):
        return []
    mistakes = []
    known = [row for row in table if row.station in station_km]
    for row in known:
        chainage_km = station_km[row.station]
        away_km = max(row.start_km - chainage_km, chainage_km - row.end_km)
        if away_km > FAR_KM:
            problem = f"the platform lies {away_km:.3g} km from its station {row.station!r}"
            allowed = f"a platform within {FAR_KM:g} km of {chainage_km:g}, that station's chainage"
            mistakes.append(table.mistake(row, "station", problem, allowed))
    along = sorted(known, key=lambda row: (row.track, row.stop_km))
    for before, after in pairwise(along):
        there_km, here_km = station_km[before.station], station_km[after.station]
        if before.track == after.track and here_km < there_km:
            problem = f"{after.station!r} comes before {before.station!r} of row {before.row}"
            allowed = "platforms in the order of their stations on every track"
            mistakes.append(table.mistake(after, "station", f"station {problem}", allowed))
    return mistakes


def _turnout_mistakes(line: LineTables) -> list[Mistake]:
    if not line.tracks.complete:
        return []
    table = line.turnouts
    mistakes = []
    boundaries = list(pairwise(line.sections))
    standing = []
    for row in table:
        here = [pair for pair in boundaries if same(pair[1][0].start_km, row.position_km)]
        if not here or len(here[0][0]) == len(here[0][1]) == 1:
            places = [f"{b[0].start_km:g}" for a, b in boundaries if max(len(a), len(b)) > 1]
            problem = f"no tracks join or part at {row.position_km:g}"
            allowed = f"one of {', '.join(places)}" if places else "no turnout on this line"
            mistakes.append(table.mistake(row, "position_km", problem, allowed))
            continue
        standing.append(row.position_km)
        mistakes += _fouling_mistakes(table, row, here[0])
    if table.complete:
        for before, after in boundaries:
            position_km = after[0].start_km
            count = sum(same(position_km, where) for where in standing)
            if len(before) != len(after) and count == 0:
                problem = (
                    f"no turnout at {position_km:g}, where {len(before)} tracks become {len(after)}"
                )
                allowed = f"a turnout with position_km {position_km:g}"
                mistakes.append(Mistake(table.file, "column position_km", problem, allowed))
            if count > 1:
                problem = f"{count} turnouts at {position_km:g}"
                mistakes.append(
                    Mistake(table.file, "column position_km", problem, "one at each place")
                )
    return mistakes


def _fouling_mistakes(
    table: Table[TurnoutRow],
    row: TurnoutRow,
    neighbours: tuple[Sequence[TrackRow], Sequence[TrackRow]],
) -> list[Mistake]:
    lowest_km, highest_km = neighbours[0][0].start_km, neighbours[1][0].end_km
    mistakes = []
    if not lowest_km <= row.fouling_start_km <= row.position_km:
        problem = f"{row.fouling_start_km:g} lies outside the section before the points"
        allowed = f"from {lowest_km:g} to {row.position_km:g}"
        mistakes.append(table.mistake(row, "fouling_start_km", problem, allowed))
    if not row.position_km <= row.fouling_end_km <= highest_km:
        problem = f"{row.fouling_end_km:g} lies outside the section behind the points"
        allowed = f"from {row.position_km:g} to {highest_km:g}"
        mistakes.append(table.mistake(row, "fouling_end_km", problem, allowed))
    return mistakes


def _block_mistakes(line: LineTables) -> list[Mistake]:
    table = line.blocks
    stretches: Table[StretchRow] = table
    mistakes = duplicates(table) + _length_mistakes(stretches)
    if not (line.tracks.complete and table.present):
        return mistakes
    tracks = {track.id: track for track in line.tracks}
    for row in table:
        if row.track not in tracks:
            problem, allowed = f"unknown track {row.track!r}", meant(row.track, tracks)
            mistakes.append(table.mistake(row, "track", problem, allowed))
    for track in tracks.values():
        mine = sorted((row for row in table if row.track == track.id), key=lambda row: row.start_km)
        mistakes += _tiling_mistakes(stretches, mine, "the block", gaps=table.complete)
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


def _circuit_mistakes(line: LineTables) -> list[Mistake]:
    table = line.circuits
    stretches: Table[StretchRow] = table
    mistakes = duplicates(table) + _length_mistakes(stretches)
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
        mistakes += _tiling_mistakes(stretches, mine, "the circuit", gaps=table.complete)
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


def _point_mistakes(line: LineTables) -> list[Mistake]:
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


def _stretch_mistakes(
    table: Table[LimitRow] | Table[GradientRow] | Table[CurveRow],
    extent_km: tuple[float, float] | None,
) -> list[Mistake]:
    stretches: Table[StretchRow] = table
    mistakes = _length_mistakes(stretches) + _tiling_mistakes(
        stretches, stretches, "the stretch", gaps=False
    )
    if extent_km:
        for row in stretches:
            for column in ("start_km", "end_km"):
                value_km = getattr(row, column)
                if not extent_km[0] <= value_km <= extent_km[1]:
                    allowed = f"from {extent_km[0]:g} to {extent_km[1]:g}"
                    problem = f"{value_km:g} lies outside the line"
                    mistakes.append(stretches.mistake(row, column, problem, allowed))
    return mistakes
