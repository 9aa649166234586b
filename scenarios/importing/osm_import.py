"""A route of OpenStreetMap to a drafted scenario, with trains at even intervals."""

from itertools import pairwise
from pathlib import Path

from kankaku.scenarios.drafts.circulation import LONGEST_STAY_S, linked
from kankaku.scenarios.drafts.completing import completed
from kankaku.scenarios.drafts.draft import Draft
from kankaku.scenarios.drafts.even_trips import DWELL_S, RUN_ALLOWANCE, every
from kankaku.scenarios.drafts.provenance_notes import SourceNotes
from kankaku.scenarios.drafts.runs import Runs
from kankaku.scenarios.drafts.sketch import Sketch, Stop
from kankaku.scenarios.drafts.stock_library import library_train
from kankaku.scenarios.importing.earth_places import identifiers
from kankaku.scenarios.importing.formats import SourceError, Wish
from kankaku.scenarios.importing.osm_files import OsmLine, read_route
from kankaku.scenarios.reading.row_formats import GeometryRow, LimitRow

DEFAULT_TRAIN, DEFAULT_HEADWAY_S, DEFAULT_TRAINS = "metro", 600.0, 6
FIRST_S = 7 * 3600
BEYOND_KM = 0.05
"""Limits and the drawn line reach so far beyond the first and the last stop. [km]"""
SHARED_WAYS = 0.8
"""Share of ways that both directions use, from which on the line counts as single. [-]"""
TERMS = (
    "(c) OpenStreetMap contributors, Open Database License 1.0 "
    "(opendatacommons.org/licenses/odbl/1-0); stations, geometry and limits of this folder are "
    "derived from that database and stay under this licence: keep them apart from data under "
    "other terms, name the contributors, and share what you make of them likewise"
)


def read(source: Path, wish: Wish) -> Draft:
    """
    Read a route.

    Parameters
    ----------
    source
        An extract, such as ``city.osm.pbf``.
    wish
        ``route``, name, ref or identifier of a route relation; ``train``; ``headway_s`` and
        ``trains`` of each direction; ``single_track``.

    Returns
    -------
    Draft
        The scenario.

    Raises
    ------
    SourceError
        With everything that is wrong with the extract.
    DraftError
        If no line can be laid out.
    """
    line = read_route(source, wish.route)
    tags = line.route.tags
    title = tags.get("name:en") or tags.get("name") or tags.get("ref") or str(line.route.id)
    notes = SourceNotes(
        f"OpenStreetMap, {source.name}: route relation {line.route.id}, {title}.", TERMS
    )
    entry = library_train(wish.train or DEFAULT_TRAIN)
    why = "asked for with the command" if wish.train else "a map has no trains"
    notes.assume("train", f"{wish.train or DEFAULT_TRAIN} of the library: {entry.title}", why)
    stops = _stops(line)
    _refuse_one_place(source, stops)
    sketch = Sketch(title, notes, stops, (), {"train": entry.entry})
    sketch.single_track = _is_single(notes, line, wish)
    _add_stretches(sketch, line)
    _add_trips(sketch, wish)
    _note_left(notes, line)
    return completed(sketch)


def _stops(line: OsmLine) -> tuple[Stop, ...]:
    """Return the stops; the first one is at km 0."""
    names = identifiers(stop.name for stop in line.stops)
    first_m = line.stops[0].along_m
    return tuple(
        Stop(
            *(name, stop.name, round((stop.along_m - first_m) / 1000.0, 3)),
            *(stop.name_local, round(stop.lon_deg, 6), round(stop.lat_deg, 6)),
        )
        for name, stop in zip(names, line.stops, strict=True)
    )


def _refuse_one_place(source: Path, stops: tuple[Stop, ...]) -> None:
    """Refuse stops between which no train runs a metre."""
    told = tuple(
        f"{source.name}: stops {one.name!r} and {other.name!r} lie at the same place of the "
        f"route, km {one.chainage_km:g}; allowed: one name for one place"
        for one, other in pairwise(stops)
        if other.chainage_km <= one.chainage_km
    )
    if told:
        raise SourceError(told)


def _is_single(notes: SourceNotes, line: OsmLine, wish: Wish) -> bool:
    if wish.single_track is not None:
        asked = "single" if wish.single_track else "double"
        notes.assume("track", asked, "asked for with the command")
        return wish.single_track
    own = set(line.route.ways)
    shared = max((len(own & set(one.ways)) / len(own) for one in line.others), default=0.0)
    single = shared >= SHARED_WAYS
    if single:
        why = f"{shared:.0%} of the ways belong to a route of the same name, too"
    elif line.others:
        why = "the routes of that name use ways of their own"
    else:
        why = "one route alone does not tell"
    notes.assume("track", "single, with loops" if single else "double", why)
    return single


def _add_stretches(sketch: Sketch, line: OsmLine) -> None:
    """Add limits and the drawn line, as far as the line that is laid out reaches."""
    first_m = line.stops[0].along_m
    low_km, high_km = -BEYOND_KM, sketch.stops[-1].chainage_km + BEYOND_KM
    for start_m, end_m, limit_kmh in line.limits:
        start_km = max(round((start_m - first_m) / 1000.0, 3), low_km)
        end_km = min(round((end_m - first_m) / 1000.0, 3), high_km)
        if end_km > start_km:
            sketch.limits.append(LimitRow(0, start_km, end_km, limit_kmh))
    for (lon_deg, lat_deg), along_m in zip(line.places, line.along_m, strict=True):
        km = round((along_m - first_m) / 1000.0, 3)
        rising = not sketch.geometry or km > sketch.geometry[-1].chainage_km
        if rising and low_km <= km <= high_km:
            sketch.geometry.append(GeometryRow(0, km, round(lon_deg, 6), round(lat_deg, 6)))
    where = f"ways of relation {line.route.id}"
    sketch.notes.take("chainage and drawn line", f"nodes of the {where}, great circles between")
    sketch.notes.take("names and places of stops", "members with role stop, or nodes of the ways")
    if sketch.limits:
        sketch.notes.take("speed limits", f"maxspeed of the {where}; the lower of two directions")


def _add_trips(sketch: Sketch, wish: Wish) -> None:
    headway_s = DEFAULT_HEADWAY_S if wish.headway_s is None else wish.headway_s
    count = DEFAULT_TRAINS if wish.trains is None else wish.trains
    trips = every(
        *(headway_s, count, sketch.stops, Runs(sketch)), train_type="train", first_s=FIRST_S
    )
    rises = {trip.id: sketch.rises(trip) for trip in trips}
    sketch.trips = linked(trips, sketch.minimum_turn_back_s, rises)
    asked = wish.headway_s is not None and wish.trains is not None
    sketch.notes.assume(
        "timetable",
        f"{count} trains in each direction, every {headway_s:g} s from 07:00 on, all stops, dwell "
        f"{DWELL_S} s, runs {RUN_ALLOWANCE - 1.0:.0%} longer than the fastest",
        "asked for with the command" if asked else "a map has none; see --headway and --trains",
    )
    joined = sum(1 for trip in sketch.trips if trip.next_trip)
    sketch.notes.assume(
        "circulation",
        f"{joined} trains go on with the stock of the one that came first, after "
        f"{sketch.minimum_turn_back_s:g} s or more and within {LONGEST_STAY_S:g} s; other stock "
        "leaves the line, or comes onto it",
        "a map has none",
    )


def _note_left(notes: SourceNotes, line: OsmLine) -> None:
    if line.unread_speeds:
        told = ", ".join(sorted(line.unread_speeds)[:6])
        notes.miss(f"limits that are no speeds from 3 to 400 km/h ({told})", "no limit holds there")
    if line.platforms_m:
        told = f"{min(line.platforms_m):.0f} to {max(line.platforms_m):.0f} m"
        notes.miss(
            f"lengths of {len(line.platforms_m)} mapped platforms ({told})",
            "platforms are as long as the train needs",
        )
    if line.others:
        told = ", ".join(str(one.id) for one in line.others)
        notes.miss(f"routes of the same name (relation {told})", "both directions run on this one")
    notes.miss("gradients, curves, points, signals, gauge, electrification", "the line is level")
