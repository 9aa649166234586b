"""Cross-checks of the line's files: everything must lie where it can lie."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

from kankaku.scenarios.checks.check_blocks import (
    block_mistakes,
    circuit_mistakes,
    point_mistakes,
)
from kankaku.scenarios.checks.line_tables import (
    FAR_KM,
    TOLERANCE_KM,
    LineTables,
    duplicates,
    length_mistakes,
    same,
    tiling_mistakes,
)
from kankaku.scenarios.reading.files import Table
from kankaku.scenarios.reading.mistakes import Mistake, meant
from kankaku.scenarios.reading.row_formats import (
    CurveRow,
    DrivenSpeedRow,
    GradientRow,
    LimitRow,
    PlatformRow,
    StretchRow,
    TrackRow,
    TurnoutRow,
)

STOPS_APART_KM = 0.001
"""Two stops nearer to each other on one track are one place for SUMO. [km]"""


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
    mistakes = _track_mistakes(line) + station_mistakes(line) + platform_mistakes(line)
    mistakes += _turnout_mistakes(line) + block_mistakes(line) + circuit_mistakes(line)
    mistakes += point_mistakes(line)
    for stretches in (line.limits, line.driven_speeds, line.gradients, line.curves):
        mistakes += _stretch_mistakes(line, stretches)
    return mistakes


def _track_mistakes(line: LineTables) -> list[Mistake]:
    table: Table[StretchRow] = line.tracks
    mistakes = duplicates(line.tracks) + length_mistakes(table)
    for tracks in line.sections:
        first = tracks[0]
        for track in tracks[1:]:
            for column in ("start_km", "end_km"):
                wanted = getattr(first, column)
                if not same(getattr(track, column), wanted):
                    problem = f"differs from the parallel track {first.id!r}"
                    mistakes.append(table.mistake(track, column, problem, f"{wanted:g}"))
    leading = [tracks[0] for tracks in line.sections]
    return mistakes + tiling_mistakes(table, leading, "the section", gaps=line.tracks.complete)


def station_mistakes(line: LineTables) -> list[Mistake]:
    """Return stations out of order, or outside the line."""
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


def platform_mistakes(line: LineTables) -> list[Mistake]:
    """Return platforms that lie where they cannot lie."""
    table = line.platforms
    stretches: Table[StretchRow] = table
    mistakes = length_mistakes(stretches)
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
    return mistakes or _place_mistakes(line)


def _place_mistakes(line: LineTables) -> list[Mistake]:
    """Return platforms that lie far from their station, or whose stops are in another order."""
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
    mistakes += _order_mistakes(table, station_km, {row: row.stop_km for row in known})
    both = {link.id for link in line.links if link.direction == "both"}
    falling_km = {
        row: row.start_km + row.end_km - row.stop_km for row in known if row.track in both
    }
    return mistakes or _order_mistakes(table, station_km, falling_km)


def _order_mistakes(
    table: Table[PlatformRow],
    station_km: Mapping[str, float],
    stop_km: Mapping[PlatformRow, float],
) -> list[Mistake]:
    """Return platforms where trains would stop in another order than that of their stations."""
    mistakes = []
    along = sorted(stop_km, key=lambda row: (row.track, stop_km[row]))
    for before, after in pairwise(along):
        if before.track != after.track:
            continue
        if station_km[after.station] < station_km[before.station]:
            problem = f"{after.station!r} comes before {before.station!r} of row {before.row}"
            allowed = "platforms in the order of their stations on every track"
            mistakes.append(table.mistake(after, "station", f"station {problem}", allowed))
        elif stop_km[after] - stop_km[before] < STOPS_APART_KM - TOLERANCE_KM:
            problem = f"trains stop at {stop_km[after]:g}, where they do for row {before.row}"
            allowed = f"stops {STOPS_APART_KM:g} km apart or more on one track"
            mistakes.append(table.mistake(after, "stop_km", problem, allowed))
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


def _stretch_mistakes(
    line: LineTables,
    table: Table[LimitRow] | Table[DrivenSpeedRow] | Table[GradientRow] | Table[CurveRow],
) -> list[Mistake]:
    stretches: Table[StretchRow] = table
    extent_km, mistakes = line.extent_km, length_mistakes(stretches)
    by_type: dict[str, list[StretchRow]] = {}
    for stretch in table:
        # Of limits the lowest counts, and some may be those of one train type.
        train_type = stretch.train_type if isinstance(stretch, LimitRow) else ""
        by_type.setdefault(train_type, []).append(stretch)
    for rows in by_type.values():
        mistakes += tiling_mistakes(stretches, rows, "the stretch", gaps=False)
    if extent_km:
        for row in stretches:
            for column in ("start_km", "end_km"):
                value_km = getattr(row, column)
                if not extent_km[0] <= value_km <= extent_km[1]:
                    allowed = f"from {extent_km[0]:g} to {extent_km[1]:g}"
                    problem = f"{value_km:g} lies outside the line"
                    mistakes.append(stretches.mistake(row, column, problem, allowed))
    return mistakes
