"""Cross-checks of level crossings, and of what goes wrong beside the track."""

from collections.abc import Iterator, Sequence

from kankaku.scenarios.checks.check_timetable import TimetableTables, calls_by_train, seconds
from kankaku.scenarios.checks.line_tables import LineTables, duplicates, same
from kankaku.scenarios.reading.mistakes import Mistake, meant
from kankaku.scenarios.reading.row_formats import CrossingRow
from kankaku.scenarios.reading.schema import ClosureEntry, ScenarioFile, WindowEntry, WorkZoneEntry
from kankaku.scenarios.reading.units import next_day

HELD_BEFORE_KM = 0.1
"""Trains stop no further before the crossing that they are kept out of, without blocks. [km]"""


def crossing_mistakes(line: LineTables) -> list[Mistake]:
    """
    Return everything that is wrong with the level crossings of a line.

    Parameters
    ----------
    line
        The files of the line.

    Returns
    -------
    list[Mistake]
        The mistakes.
    """
    mistakes = duplicates(line.crossings)
    turnouts = {turnout.id for turnout in line.turnouts}
    for row in line.crossings:
        if row.id in turnouts:
            problem = f"{row.id!r} is a turnout already"
            mistakes.append(line.crossings.mistake(row, "id", problem, "every id once"))
        mistakes += _place_mistakes(line, row) if row.end_km > row.start_km else []
        if row.end_km <= row.start_km:
            problem = f"{row.end_km:g} does not lie after start_km"
            mistakes.append(
                line.crossings.mistake(row, "end_km", problem, f"above {row.start_km:g}")
            )
        latest_km = _latest_strike_in_km(line, row)
        if row.strike_in_km > latest_km:
            problem = f"a train kept out might stop before it comes to {row.strike_in_km:g}"
            allowed = f"up to {latest_km:g}"
            mistakes.append(line.crossings.mistake(row, "strike_in_km", problem, allowed))
        if line.extent_km and row.strike_in_km < line.extent_km[0]:
            problem, allowed = "outside the line", f"from {line.extent_km[0]:g}"
            mistakes.append(line.crossings.mistake(row, "strike_in_km", problem, allowed))
    return mistakes


def _latest_strike_in_km(line: LineTables, row: CrossingRow) -> float:
    """Return a place that every train comes to that is kept out of the crossing."""
    own_km = [b.start_km for b in line.blocks if b.start_km <= row.start_km < b.end_km]
    # Step by step braking may stop a train anywhere in the block before the crossing's own.
    before_km = [b.start_km for b in line.blocks if own_km and same(b.end_km, min(own_km))]
    return min((*own_km, *before_km, row.start_km - HELD_BEFORE_KM))


def _place_mistakes(line: LineTables, row: CrossingRow) -> list[Mistake]:
    if not line.extent_km:
        return []
    table = line.crossings
    inside = any(
        tracks[0].start_km <= row.start_km and row.end_km <= tracks[0].end_km
        for tracks in line.sections
    )
    if not inside:
        problem = "the crossing does not lie within one section"
        spans = ", ".join(f"{t[0].start_km:g} to {t[0].end_km:g}" for t in line.sections)
        return [table.mistake(row, "start_km", problem, f"within one of {spans}")]
    return [
        table.mistake(
            row,
            "start_km",
            f"the crossing lies in the fouling section of turnout {turnout.id!r}",
            f"from {turnout.fouling_end_km:g} or ending by {turnout.fouling_start_km:g}",
        )
        for turnout in line.turnouts
        if turnout.fouling_start_km < row.end_km and row.start_km < turnout.fouling_end_km
    ]


def disruption_mistakes(
    settings: ScenarioFile | None, line: LineTables, timetable: TimetableTables, file: str
) -> list[Mistake]:
    """
    Return everything that is wrong with what goes wrong beside the track.

    Parameters
    ----------
    settings
        The main file; nothing if it has mistakes of its own.
    line
        The files of the line.
    timetable
        The files of the timetable.
    file
        Name of the main file.

    Returns
    -------
    list[Mistake]
        The mistakes.
    """
    if settings is None:
        return []
    mistakes = []
    turnouts = [row.id for row in line.turnouts]
    crossings = [row.id for row in line.crossings]
    taken = {*turnouts, *crossings}
    for key in ("work_zones", "equipment_faults"):
        entries: Sequence[ClosureEntry] = getattr(settings, key)
        for index, entry in enumerate(entries):
            place = f"{key}.{index}"
            if entry.id in taken:
                problem, allowed = f"{entry.id!r} is taken already", "every id once"
                mistakes.append(Mistake(file, f"{place}.id", problem, allowed))
            taken.add(entry.id)
            found = (
                *_window_problems(entry),
                *_stretch_problems(entry, line),
                *_start_problems(entry, line, timetable),
            )
            mistakes += [Mistake(file, f"{place}.{column}", *what) for column, *what in found]
    named = (
        ("points_failures", "turnout", turnouts, line.turnouts.complete),
        ("crossing_obstacles", "crossing", crossings, line.crossings.complete),
    )
    for key, column, known, complete in named:
        windows: Sequence[WindowEntry] = getattr(settings, key)
        for index, window in enumerate(windows):
            name = getattr(window, column)
            if complete and name not in known:
                problem, allowed = f"unknown {column} {name!r}", meant(name, known) or "none"
                mistakes.append(Mistake(file, f"{key}.{index}.{column}", problem, allowed))
            mistakes += [
                Mistake(file, f"{key}.{index}.{at}", problem, allowed)
                for at, problem, allowed in _window_problems(window)
            ]
    return mistakes


def _start_problems(
    entry: ClosureEntry, line: LineTables, timetable: TimetableTables
) -> Iterator[tuple[str, str, str]]:
    """Yield the key, what is wrong and what is allowed, for the first train that starts there."""
    from_s, until_s = seconds(entry.from_), max(map(seconds, _ends(entry).values()))
    for calls in calls_by_train(timetable).values():
        call = calls[0] if calls else None
        platform = line.platform_at.get((call.station, call.track)) if call else None
        if call is None or platform is None:
            continue
        within = platform.start_km < entry.end_km and entry.start_km < platform.end_km
        within &= not entry.tracks or call.track in entry.tracks
        if within and seconds(call.arrival) < until_s and seconds(call.departure) > from_s:
            problem = f"train {call.train!r} starts in it at {call.departure}"
            ends = f"{platform.start_km:g} to {platform.end_km:g}"
            yield "start_km", problem, f"no part of {ends} while trains start there"
            return


def _ends(entry: WindowEntry) -> dict[str, str]:
    ends = {"to": entry.to}
    if isinstance(entry, WorkZoneEntry) and entry.released is not None:
        ends["released"] = entry.released
    return ends


def _window_problems(entry: WindowEntry) -> Iterator[tuple[str, str, str]]:
    """Yield the key, what is wrong and what is allowed."""
    for key, clock in _ends(entry).items():
        if seconds(clock) <= seconds(entry.from_):
            allowed = f"after {entry.from_}{next_day(entry.from_, clock)}"
            yield key, f"{clock} does not lie after from", allowed


def _stretch_problems(entry: ClosureEntry, line: LineTables) -> Iterator[tuple[str, str, str]]:
    """Yield the key, what is wrong and what is allowed."""
    if entry.end_km <= entry.start_km:
        yield "end_km", f"{entry.end_km:g} does not lie after start_km", f"above {entry.start_km:g}"
    if not line.extent_km:
        return
    from_km, to_km = line.extent_km
    for key in ("start_km", "end_km"):
        value_km = getattr(entry, key)
        if not from_km <= value_km <= to_km:
            yield key, f"{value_km:g} lies outside the line", f"from {from_km:g} to {to_km:g}"
    tracks = {track.id: track for track in line.tracks}
    for name in entry.tracks:
        track = tracks.get(name)
        if track is None:
            yield "tracks", f"unknown track {name!r}", meant(name, tracks)
            return
        if not (track.start_km < entry.end_km and entry.start_km < track.end_km):
            problem = f"track {name!r} does not lie between start_km and end_km"
            yield "tracks", problem, f"tracks between {entry.start_km:g} and {entry.end_km:g}"
            return
    first_km = min((tracks[name].start_km for name in entry.tracks), default=from_km)
    last_km = max((tracks[name].end_km for name in entry.tracks), default=to_km)
    if from_km <= entry.start_km < first_km:
        problem = f"{entry.start_km:g} lies before the tracks named"
        yield "start_km", problem, f"from {first_km:g}"
    if last_km < entry.end_km <= to_km:
        problem = f"{entry.end_km:g} lies behind the tracks named"
        yield "end_km", problem, f"up to {last_km:g}"
