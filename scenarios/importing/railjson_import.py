"""
Infrastructures in RailJSON: one way through them, as a line in one direction.

The way has its true slopes, curves, limits, operational points, and signals as block boundaries.
Tracks beside it are told as missing.
"""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

from kankaku.scenarios.drafts.draft import Draft
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.sketch import Stop
from kankaku.scenarios.importing.formats import Wish
from kankaku.scenarios.importing.one_way import LEAST_APART_M, MARGIN_M, OneWay, drafted
from kankaku.scenarios.importing.one_way_trips import kept_apart, spaced_trips
from kankaku.scenarios.importing.railjson_network import RailjsonTracks, read_infrastructure
from kankaku.scenarios.importing.railjson_schedules import (
    scheduled_trips,
    schedules_beside,
    stock_beside,
)
from kankaku.scenarios.importing.railjson_stock import railjson_stock
from kankaku.scenarios.importing.railjson_ways import RailjsonWay, asked_way, longest_way
from kankaku.scenarios.importing.source_keys import SafeIds, read_json, safe_text
from kankaku.scenarios.importing.wished_stock import library_stock
from kankaku.scenarios.reading.row_formats import CurveRow, GradientRow, LimitRow

HEADWAY_S = 300.0
R = TypeVar("R", LimitRow, GradientRow, CurveRow)


def read(source: Path, wish: Wish) -> Draft:
    """
    Read an infrastructure, and trains where they are given.

    Parameters
    ----------
    source
        JSON file of the infrastructure. Files ``train_schedules*.json`` beside it are read, too.
    wish
        Route, train, headway and number of trains. A route is a list of operational points or
        track sections, with commas between them.

    Returns
    -------
    Draft
        A chain in the direction of the way.

    Raises
    ------
    SourceError
        With everything that is wrong with the files.
    """
    tracks = read_infrastructure(read_json(source))
    names = [name.strip() for name in wish.route.split(",") if name.strip()]
    way = asked_way(tracks, names, source.name) if names else longest_way(tracks, source.name)
    title = safe_text(source.stem, "RailJSON")
    notes = SourceNotes(f"Infrastructure {source.name} in RailJSON {tracks.version}.")
    # Whoever asks for headway or number of trains does not want those of the schedules.
    evenly = wish.headway_s is not None or wish.trains is not None
    schedules = [] if evenly else schedules_beside(source)
    types, called = _types(source, schedules, wish, notes)
    stops, codes = _stops(tracks, way, names, _longest_m(types), notes)
    line = OneWay(
        title=title,
        notes=notes,
        stops=stops,
        train_types=types,
        extent_km=(0.0, _km(way.length_m)),
        limits=_least(LimitRow, way.stretches(tracks.limits)),
        gradients=_least(GradientRow, way.stretches(tracks.slopes, turns=True)),
        curves=_least(CurveRow, way.stretches(tracks.curves)),
        block_edges_km=_edges_km(tracks, way, notes),
        net_brake=wish.stock is not None or bool(called),
    )
    _note(tracks, way, line, asked=bool(names))
    trips = None
    for schedule in schedules:
        trips = trips or scheduled_trips(schedule, line, codes, way, called)
    if trips is None:
        return drafted(line, spaced_trips(line, wish, HEADWAY_S))
    return drafted(line, kept_apart(line, trips))


def _types(
    source: Path, schedules: Sequence[Path], wish: Wish, notes: SourceNotes
) -> tuple[dict[str, dict[str, Any]], dict[str, str]]:
    """Return train types, and those of them that schedules name by what they call them."""
    if wish.stock:
        return railjson_stock(wish.stock, notes), {}
    found = None if wish.train else stock_beside(source, schedules, notes)
    return (found.types, found.called) if found else (library_stock(wish.train, notes), {})


def _longest_m(types: dict[str, dict[str, Any]]) -> float:
    return max(float(entry["length_m"]) for entry in types.values())


def _stops(
    tracks: RailjsonTracks,
    way: RailjsonWay,
    names: Sequence[str],
    longest_m: float,
    notes: SourceNotes,
) -> tuple[tuple[Stop, ...], dict[str, str]]:
    """Return the stops of a way, and by what else trains may call them."""
    ids = SafeIds()
    placed = sorted(
        (at_m, number)
        for number, point in enumerate(tracks.points)
        if (at_m := way.point_m(point)) is not None
    )
    named = [at_m for at_m, number in placed if tracks.points[number].codes & set(names)]
    if len(named) > 1 and all(any(n in p.codes for p in tracks.points) for n in names):
        placed = [(at_m, number) for at_m, number in placed if named[0] <= at_m <= named[-1]]
    found: list[tuple[float, Stop]] = []
    codes: dict[str, str] = {}
    for at_m, number in placed:
        point = tracks.points[number]
        if found and at_m - found[-1][0] < LEAST_APART_M:
            what = f"operational point {point.name!r}"
            notes.miss(what, f"it lies less than {LEAST_APART_M:g} m behind another one")
            continue
        found.append((at_m, Stop(ids.of(point.id), point.name, _km(at_m))))
        codes |= dict.fromkeys(point.codes, found[-1][1].id)
    if found:
        notes.take(f"{len(found)} stations of the way", "operational_points")
    if len(found) < 2:
        found = _with_ends(found, way.length_m, longest_m, ids)
        notes.assume(
            "stations",
            ", ".join(f"{stop.id} at {stop.chainage_km:g} km" for _, stop in found),
            "the way has fewer than two operational points: trains call at its ends",
        )
    return tuple(stop for _, stop in found), codes


def _with_ends(
    found: Sequence[tuple[float, Stop]], length_m: float, longest_m: float, ids: SafeIds
) -> list[tuple[float, Stop]]:
    """Return stops with one at either end: within the way where a train has room there."""
    room = length_m > 4.0 * longest_m
    ends = (
        (longest_m + 2.0 * MARGIN_M if room else 0.0, "begin", "Begin"),
        (length_m - 2.0 * MARGIN_M if room else length_m, "end", "End"),
    )
    made = list(found)
    for at_m, name, title in ends:
        if all(abs(at_m - there_m) >= LEAST_APART_M for there_m, _ in found):
            made.append((at_m, Stop(ids.of(name), title, _km(at_m))))
    return sorted(made, key=lambda item: item[0])


def _least(kind: type[R], stretches: Iterable[tuple[float, float, float]]) -> list[R]:
    """Return rows of stretches that overlap no more: the least value counts."""
    told = list(stretches)
    edges_m = sorted(
        {round(edge_m, 3) for start_m, end_m, _ in told for edge_m in (start_m, end_m)}
    )
    rows: list[R] = []
    for low_m, high_m in pairwise(edges_m):
        middle_m = (low_m + high_m) / 2.0
        values = [value for start_m, end_m, value in told if start_m < middle_m < end_m]
        if not values:
            continue
        value, start_km = min(values), _km(low_m)
        last = rows[-1] if rows else None
        if last is not None and last.end_km == start_km and _value(last) == value:
            rows.pop()
            start_km = last.start_km
        rows.append(kind(0, start_km, _km(high_m), value))
    return rows


def _value(row: LimitRow | GradientRow | CurveRow) -> float:
    if isinstance(row, LimitRow):
        return row.limit_kmh
    return row.gradient_permil if isinstance(row, GradientRow) else row.radius_m


def _edges_km(tracks: RailjsonTracks, way: RailjsonWay, notes: SourceNotes) -> tuple[float, ...]:
    for things, key in ((tracks.signals, "signals"), (tracks.detectors, "detectors")):
        inner_m = [at_m for at_m in way.beside_m(things) if 1.0 < at_m < way.length_m - 1.0]
        if inner_m:
            notes.take(f"blocks, from one to the next of {len(inner_m)} {key}", key)
            return tuple(map(_km, inner_m))
    return ()


def _note(tracks: RailjsonTracks, way: RailjsonWay, line: OneWay, *, asked: bool) -> None:
    notes = line.notes
    through = [laid.piece.track for laid in way.laid]
    told = ", ".join(through[:20]) + (" and so on" if len(through) > 20 else "")
    notes.take(f"{len(through)} track sections, {way.length_m:g} m: {told}", "track_sections")
    if not asked:
        why = "no route was asked for: the longest of the shortest ways between ends of track"
        notes.assume("way through the infrastructure", f"{through[0]} to {through[-1]}", why)
    for count, what, where in (
        (len(line.limits), "speed limits", "speed_sections"),
        (len(line.gradients), "gradients", "track_sections, slopes"),
        (len(line.curves), "curves", "track_sections, curves"),
    ):
        if count:
            notes.take(f"{count} {what} of the way", where)
    _note_missing(tracks, way, notes)


def _note_missing(tracks: RailjsonTracks, way: RailjsonWay, notes: SourceNotes) -> None:
    through = {laid.piece.track for laid in way.laid}
    beside = [name for name in tracks.lengths_m if name not in through]
    if beside:
        told = ", ".join(beside[:10]) + (" and so on" if len(beside) > 10 else "")
        what = f"{len(beside)} track sections beside the way: {told}"
        notes.miss(what, "no train overtakes, meets or joins another one there")
    off = [point.name for point in tracks.points if way.point_m(point) is None]
    if off:
        notes.miss(f"operational points beside the way: {', '.join(off)}", "no train calls there")
    if tracks.switches:
        notes.miss(f"{tracks.switches} switches", "the way is one track; nothing is thrown on it")
    if tracks.routes:
        effect = "controllers lock by block, not by route"
        notes.miss(f"{tracks.routes} routes", effect)
    if tracks.signals:
        notes.miss("aspects and signalling systems of signals", "controllers of the scenario act")
    notes.miss("the other running direction", "trains run one way only")
    for what, effect in dict.fromkeys(tracks.left_out):
        notes.miss(what, effect)
    for what, value, why in dict.fromkeys(tracks.assumed):
        notes.assume(what, value, why)


def _km(value_m: float) -> float:
    return round(value_m / 1000.0, 6)
