"""Cross-checks of the timetable against line and fleet."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

from kankaku.scenarios.checks.check_dwells import dwell_station_mistakes, unheld_mistakes
from kankaku.scenarios.checks.line_tables import LineTables, same
from kankaku.scenarios.checks.ways import ends_on_the_way, route_of
from kankaku.scenarios.reading.dwell_rows import DwellRows
from kankaku.scenarios.reading.files import Table
from kankaku.scenarios.reading.mistakes import Mistake, meant
from kankaku.scenarios.reading.row_formats import CallRow, DwellStationRow, PlatformRow, ServiceRow
from kankaku.scenarios.reading.schema import RollingStockFile, TrainEntry
from kankaku.scenarios.reading.units import next_day, whole_seconds


@dataclass(frozen=True)
class TimetableTables:
    """The files that describe the trains, their calls and their dwell times."""

    services: Table[ServiceRow]
    calls: Table[CallRow]
    dwell_stations: Table[DwellStationRow]

    @cached_property
    def by_train(self) -> dict[str, list[CallRow]]:
        """Calls in file order by train, trains in the order of ``services.csv``."""
        calls: dict[str, list[CallRow]] = {service.train: [] for service in self.services}
        for call in self.calls:
            if call.train in calls:
                calls[call.train].append(call)
        return calls

    @cached_property
    def type_of_train(self) -> dict[str, str]:
        """Train type by train."""
        return {service.train: service.train_type for service in self.services}

    @cached_property
    def dwells(self) -> DwellRows:
        """The rows of ``dwell_stations.csv`` by what they hold for."""
        return DwellRows(self.dwell_stations)


seconds = whole_seconds


def calls_by_train(timetable: TimetableTables) -> dict[str, list[CallRow]]:
    """
    Return the calls of every train.

    Parameters
    ----------
    timetable
        The files.

    Returns
    -------
    dict[str, list[CallRow]]
        Calls in file order by train, trains in the order of ``services.csv``.
    """
    return timetable.by_train


def timetable_mistakes(
    timetable: TimetableTables, line: LineTables, stock: RollingStockFile | None
) -> list[Mistake]:
    """
    Return everything that is wrong between timetable, line and fleet.

    Parameters
    ----------
    timetable
        The files of the timetable.
    line
        The files of the line.
    stock
        Train types; nothing if they have mistakes of their own.

    Returns
    -------
    list[Mistake]
        The mistakes.
    """
    mistakes = service_mistakes(timetable, stock) + dwell_row_mistakes(timetable, line, stock)
    mistakes += reference_mistakes(timetable, line)
    for train, calls in calls_by_train(timetable).items():
        kind = stock.train.get(timetable.type_of_train[train]) if stock else None
        mistakes += _sequence_mistakes(timetable, line, calls)
        mistakes += _stop_mistakes(timetable, line, calls, kind)
        mistakes += _route_mistakes(timetable, line, calls)
        mistakes += _points_mistakes(timetable, line, calls, kind)
    return mistakes + _order_mistakes(timetable, line) + _start_mistakes(timetable, line)


def service_mistakes(timetable: TimetableTables, stock: RollingStockFile | None) -> list[Mistake]:
    """Return what is wrong with the trains themselves: their names, types and calls."""
    table = timetable.services
    mistakes = []
    calls = calls_by_train(timetable)
    first: dict[str, int] = {}
    for row in table:
        if row.train in first:
            problem = f"train {row.train!r} stands in row {first[row.train]} already"
            mistakes.append(table.mistake(row, "train", problem, "every train once"))
        first.setdefault(row.train, row.row)
        if stock and row.train_type not in stock.train:
            problem = f"unknown train type {row.train_type!r}"
            mistakes.append(
                table.mistake(row, "train_type", problem, meant(row.train_type, stock.train))
            )
        if not calls[row.train] and timetable.calls.complete:
            problem = f"train {row.train!r} has no call"
            mistakes.append(table.mistake(row, "train", problem, "one row or more in calls.csv"))
    return mistakes


def dwell_row_mistakes(
    timetable: TimetableTables, line: LineTables, stock: RollingStockFile | None
) -> list[Mistake]:
    """Return what is wrong with the dwell times of stations themselves."""
    train_types = list(stock.train) if stock else None
    return dwell_station_mistakes(timetable.dwell_stations, line, train_types)


def reference_mistakes(timetable: TimetableTables, line: LineTables) -> list[Mistake]:
    """Return calls that name something that is not there."""
    table = timetable.calls
    mistakes = []
    known = (
        ("train", timetable.services.complete, {row.train: row for row in timetable.services}),
        ("station", line.stations.complete, {row.id: row for row in line.stations}),
        ("track", line.tracks.complete, {row.id: row for row in line.tracks}),
    )
    referred = []
    for row in table:
        good = True
        for column, complete, names in known:
            name = getattr(row, column)
            if name not in names:
                good = False
                if complete:
                    allowed = meant(name, names)
                    mistakes.append(
                        table.mistake(row, column, f"unknown {column} {name!r}", allowed)
                    )
        if good and (row.station, row.track) not in line.platform_at and line.platforms.complete:
            problem = f"station {row.station!r} has no platform at track {row.track!r}"
            here = [track for station, track in line.platform_at if station == row.station]
            mistakes.append(table.mistake(row, "track", problem, meant(row.track, sorted(here))))
        if good:
            asked = (row.station, timetable.type_of_train[row.train], row.departure)
            referred.append((asked, float(seconds(row.departure))))
    return mistakes + unheld_mistakes(timetable.dwell_stations, timetable.dwells, referred)


def _sequence_mistakes(
    timetable: TimetableTables, line: LineTables, calls: Sequence[CallRow]
) -> list[Mistake]:
    table = timetable.calls
    where = {station.id: station.chainage_km for station in line.stations}
    mistakes = []
    for before, after in pairwise(calls):
        if where.get(after.station, 1e9) <= where.get(before.station, -1e9):
            problem = f"{after.station!r} does not lie after {before.station!r} of row {before.row}"
            mistakes.append(
                table.mistake(after, "station", problem, "calls in the running direction")
            )
        stops = [line.platform_at.get((call.station, call.track)) for call in (before, after)]
        if stops[0] and stops[1] and stops[1].stop_km <= stops[0].stop_km:
            problem = f"stops at {stops[1].stop_km:g}, not after the stop of row {before.row}"
            allowed = f"a platform track whose stop lies after {stops[0].stop_km:g}"
            mistakes.append(table.mistake(after, "track", problem, allowed))
        mistakes += time_mistakes(timetable, (before, after))
    return mistakes


def time_mistakes(timetable: TimetableTables, calls: Sequence[CallRow]) -> list[Mistake]:
    """Return arrivals before the departure from the call before."""
    table = timetable.calls
    mistakes = []
    for before, after in pairwise(calls):
        if after.arrival < before.departure:
            problem = f"{after.arrival} is earlier than the departure of row {before.row}"
            allowed = f"from {before.departure}{next_day(before.departure, after.arrival)}"
            mistakes.append(table.mistake(after, "arrival", problem, allowed))
    return mistakes


def _stop_mistakes(
    timetable: TimetableTables,
    line: LineTables,
    calls: Sequence[CallRow],
    kind: TrainEntry | None,
) -> list[Mistake]:
    mistakes = []
    for call in calls:
        mistakes += dwell_mistakes(timetable, (call,))
        platform = line.platform_at.get((call.station, call.track))
        if kind and platform and _overhang_m(platform, kind) > 1e-3:
            problem = f"a train of {kind.length_m:g} m does not fit at {call.station!r}"
            room_m = 1000.0 * (platform.stop_km - platform.start_km)
            allowed = f"up to {room_m:g} m from the start of the platform to the stop position"
            mistakes.append(timetable.calls.mistake(call, "track", problem, allowed))
    return mistakes


def dwell_mistakes(timetable: TimetableTables, calls: Sequence[CallRow]) -> list[Mistake]:
    """Return booked dwells that are shorter than the station's least."""
    mistakes = []
    for call in calls:
        departure_s = seconds(call.departure)
        dwell_s = departure_s - seconds(call.arrival)
        train_type = timetable.type_of_train[call.train]
        row = timetable.dwells.find(call.station, train_type, departure_s)
        least_s = row.minimum_dwell_s if row else 0.0
        if dwell_s < least_s:
            problem = f"a dwell of {dwell_s} s at {call.station!r} is too short"
            hint = next_day(call.arrival, call.departure)
            allowed = f"{least_s:g} s or more after {call.arrival}{hint}"
            mistakes.append(timetable.calls.mistake(call, "departure", problem, allowed))
    return mistakes


def _points_mistakes(
    timetable: TimetableTables,
    line: LineTables,
    calls: Sequence[CallRow],
    kind: TrainEntry | None,
) -> list[Mistake]:
    """Return what is wrong if a train stands ready in points: nobody would lock them for it."""
    first = calls[0] if calls else None
    platform = line.platform_at.get((first.station, first.track)) if first else None
    track = next((row for row in line.tracks if first and row.id == first.track), None)
    if first is None or platform is None or kind is None or track is None:
        return []
    front_km = platform.stop_km
    tail_km = front_km - 0.001 * kind.length_m
    mistakes = []
    for points in line.turnouts:
        before = same(points.position_km, track.end_km) and front_km > points.fouling_start_km
        behind = same(points.position_km, track.start_km) and tail_km < points.fouling_end_km
        if before or behind:
            problem = f"train {first.train!r} starts in the fouling section of {points.id!r}"
            ends = f"up to {points.fouling_start_km:g} or from {points.fouling_end_km:g}"
            mistakes.append(timetable.calls.mistake(first, "track", problem, f"a place {ends}"))
    return mistakes + _end_mistakes(timetable, line, calls)


def _end_mistakes(
    timetable: TimetableTables, line: LineTables, calls: Sequence[CallRow]
) -> list[Mistake]:
    """Return what is wrong if a train leaves the line before points, but not clear of them."""
    last = calls[-1]
    platform = line.platform_at.get((last.station, last.track))
    track = next((row for row in line.tracks if row.id == last.track), None)
    if platform is None or track is None or not ends_on_the_way(line, calls):
        return []
    return [
        timetable.calls.mistake(
            last,
            "track",
            f"train {last.train!r} ends in the fouling section of {points.id!r}",
            f"a place up to {points.fouling_start_km:g}",
        )
        for points in line.turnouts
        if same(points.position_km, track.end_km) and platform.stop_km > points.fouling_start_km
    ]


def _start_mistakes(timetable: TimetableTables, line: LineTables) -> list[Mistake]:
    """Return what is wrong where trains start in the way of trains that go before them."""
    by_train = calls_by_train(timetable)
    # Of the trains along a track only those count that start further back than all before them.
    earlier: dict[tuple[int, int], list[tuple[str, float]]] = {}
    mistakes = []
    for train, calls in by_train.items():
        route = route_of(line, calls)
        platform = line.platform_at.get((calls[0].station, calls[0].track)) if calls else None
        if not route or platform is None:
            continue
        for other, from_km in earlier.get(route[0], []):
            if from_km < platform.stop_km:
                problem = f"train {train!r} starts on a track that {other!r} has to pass before it"
                allowed = "a track that no train before it in services.csv comes along"
                mistakes.append(timetable.calls.mistake(calls[0], "track", problem, allowed))
                break
        for place in route:
            along = earlier.setdefault(place, [])
            if not along or platform.stop_km < along[-1][1]:
                along.append((train, platform.stop_km))
    return mistakes


def _overhang_m(platform: PlatformRow, kind: TrainEntry) -> float:
    return kind.length_m - 1000.0 * (platform.stop_km - platform.start_km)


def _route_mistakes(
    timetable: TimetableTables, line: LineTables, calls: Sequence[CallRow]
) -> list[Mistake]:
    if not (line.tracks.complete and line.turnouts.complete):
        return []
    table = timetable.calls
    sections = line.sections
    points = {round(row.position_km, 6) for row in line.turnouts}
    section_of = {track.id: number for number, group in enumerate(sections) for track in group}
    tracks: dict[int, str] = {}
    mistakes = []
    for call in calls:
        section = section_of.get(call.track)
        if section is not None and tracks.setdefault(section, call.track) != call.track:
            problem = f"the train calls at track {tracks[section]!r} of the same section before"
            mistakes.append(table.mistake(call, "track", problem, tracks[section]))
    for (_, before), (number, after) in pairwise(route_of(line, calls)):
        boundary_km = sections[number][0].start_km
        if before != after and round(boundary_km, 6) not in points:
            problem = f"the train changes track at {boundary_km:g} km, where no turnout stands"
            allowed = "calls at tracks of the same place in both sections"
            mistakes.append(table.mistake(calls[0], "track", problem, allowed))
    return mistakes


def _order_mistakes(timetable: TimetableTables, line: LineTables) -> list[Mistake]:
    mistakes = []
    told: set[str] = set()
    # Whose own times run back is told elsewhere, and compares with nobody.
    by_train = {
        train: calls for train, calls in calls_by_train(timetable).items() if not _runs_back(calls)
    }
    at = {
        train: {call.station: call for call in reversed(calls)} for train, calls in by_train.items()
    }
    routes = {train: dict(route_of(line, calls)) for train, calls in by_train.items()}
    section_of = {track.id: number for number, group in enumerate(line.sections) for track in group}
    for station in line.stations:
        last: dict[tuple[str, object], CallRow] = {}
        for train in by_train:
            here = at[train].get(station.id)
            section = section_of.get(here.track) if here else None
            if here is None or section is None or not routes[train]:
                continue
            route = routes[train]
            places: dict[str, object] = {"platform": here.track}
            if section + 1 in route:
                places["departure"] = route[section + 1]
            elif section + 1 == len(line.sections):
                places["departure"] = here.track
            if section - 1 in route:
                places["arrival"] = route[section - 1]
            for kind, place in places.items():
                leader = last.get((kind, place))
                found = _order_fault(timetable, kind, leader, here) if leader else []
                if found and train not in told:
                    mistakes += found
                    told |= {train for mistake in found if "midnight" in mistake.allowed}
                last[kind, place] = here
    return mistakes


def _runs_back(calls: Sequence[CallRow]) -> bool:
    """Return whether a train is somewhere earlier than it was before."""
    times = [clock for call in calls for clock in (call.arrival, call.departure)]
    return any(later < earlier for earlier, later in pairwise(times))


def _order_fault(
    timetable: TimetableTables, kind: str, leader: CallRow, follower: CallRow
) -> list[Mistake]:
    table = timetable.calls
    if kind == "platform":
        # Times of one form sort as they follow each other.
        if follower.arrival >= leader.departure:
            return []
        problem = f"track {follower.track!r} is taken by train {leader.train!r} of row {leader.row}"
        allowed = f"from {leader.departure}{next_day(leader.departure, follower.arrival)}"
        return [table.mistake(follower, "arrival", problem, allowed)]
    before, after = getattr(leader, kind), getattr(follower, kind)
    if after > before:
        return []
    problem = f"overtakes train {leader.train!r} of row {leader.row} on one track"
    allowed = f"after {before}, the order of {timetable.services.file} on every shared track"
    allowed += next_day(before, after)
    return [table.mistake(follower, kind, problem, allowed)]
