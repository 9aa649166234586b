"""The tables of a GTFS feed that a line needs, row by row checked."""

from collections.abc import Sequence
from typing import NamedTuple

from kankaku.railway.errors import suggesting
from kankaku.scenarios.importing.formats import SourceError
from kankaku.scenarios.importing.gtfs_files import CellReader, FeedFiles, FeedRow
from kankaku.scenarios.reading.cell_texts import text_trouble

RAIL_TYPES = frozenset((0, 1, 2, 5, 7, 12, *range(100, 118), *range(400, 406), *range(900, 907)))
"""Kinds of routes on rails, extended ones included. [-]"""
MOST_LISTED = 40
"""Routes that a refusal lists. [-]"""


class FeedStop(NamedTuple):
    """A platform, a station or another place of ``stops.txt``."""

    id: str
    name: str
    lat_deg: float | None
    lon_deg: float | None
    parent: str
    row: int


class FeedRoute(NamedTuple):
    """A row of ``routes.txt``."""

    id: str
    short_name: str
    long_name: str
    kind: int

    @property
    def told(self) -> str:
        """Identifier and names."""
        names = " ".join(filter(None, (self.short_name, self.long_name)))
        return f"{self.id} ({names})" if names else self.id

    @property
    def on_rails(self) -> bool:
        """Whether its vehicles run on rails."""
        return self.kind in RAIL_TYPES


class FeedTrip(NamedTuple):
    """A row of ``trips.txt``."""

    id: str
    service: str
    direction: int
    block: str
    shape: str
    row: int


class FeedCall(NamedTuple):
    """A row of ``stop_times.txt``."""

    stop: str
    sequence: int
    arrival_s: int | None
    departure_s: int | None
    distance: float | None
    """In the unit of the feed, whichever that is."""
    row: int


class FeedFrequency(NamedTuple):
    """A row of ``frequencies.txt``."""

    trip: str
    start_s: int
    end_s: int
    headway_s: int
    is_exact: bool
    row: int


class ShapePoint(NamedTuple):
    """A row of ``shapes.txt``."""

    sequence: int
    lat_deg: float
    lon_deg: float


def read_routes(files: FeedFiles) -> list[FeedRoute]:
    """
    Read ``routes.txt``.

    Parameters
    ----------
    files
        The feed; what is wrong is added to its mistakes.

    Returns
    -------
    list[FeedRoute]
        In file order.
    """
    cells = CellReader("routes.txt", files.mistakes)
    routes: dict[str, FeedRoute] = {}
    for row in files.rows("routes.txt", ("route_id", "route_type")):
        name = cells.name(row, "route_id")
        kind = cells.whole(row, "route_type", 0, 1702)
        cells.needed(row, "route_type", is_empty=kind is None)
        if name in routes:
            cells.wrong(row.row, "route_id", f"{name!r} stands there twice", "every route once")
        elif name and kind is not None:
            names = row.text("route_short_name"), row.text("route_long_name")
            for column, text in zip(("route_short_name", "route_long_name"), names, strict=True):
                trouble = text_trouble(text)
                if trouble:
                    cells.wrong(row.row, column, trouble, "a name of up to 200 characters")
            routes[name] = FeedRoute(name, *names, kind)
    return list(routes.values())


def chosen_route(routes: Sequence[FeedRoute], wish: str) -> FeedRoute:
    """
    Return the route that is asked for, or the only one on rails.

    Parameters
    ----------
    routes
        All routes.
    wish
        Identifier, short or long name; empty if nothing was asked for.

    Returns
    -------
    FeedRoute
        The route.

    Raises
    ------
    SourceError
        With a list of routes, if there is none or more than one.
    """
    rails = [route for route in routes if route.on_rails]
    if not wish:
        if len(rails) == 1:
            return rails[0]
        problem = f"the feed has {len(rails) or 'no'} routes on rails"
        told = _listed(rails or routes)
        raise SourceError((f"--route: {problem}, so one must be named; allowed: {told}",))
    found = [route for route in routes if route.id == wish]
    plain = wish.strip().casefold()
    found = found or [
        route
        for route in routes
        if plain in {route.short_name.casefold(), route.long_name.casefold()}
    ]
    if len(found) == 1:
        return found[0]
    if found:
        problem = f"{len(found)} routes have the name {wish!r}"
        raise SourceError((f"--route: {problem}; allowed: {_listed(found)}",))
    names = [name for route in routes for name in route[:3] if name]
    allowed = suggesting(wish, names, _listed(rails or routes))
    raise SourceError((f"--route: there is no route {wish!r}; allowed: {allowed}",))


def _listed(routes: Sequence[FeedRoute]) -> str:
    told = ", ".join(route.told for route in routes[:MOST_LISTED])
    more = len(routes) - MOST_LISTED
    return f"{told} and {more} more" if more > 0 else told or "nothing, because there is none"


def read_trips(files: FeedFiles, route: FeedRoute) -> list[FeedTrip]:
    """
    Read the trips of a route.

    Parameters
    ----------
    files
        The feed.
    route
        Which one.

    Returns
    -------
    list[FeedTrip]
        In file order.
    """
    cells = CellReader("trips.txt", files.mistakes)
    trips: dict[str, FeedTrip] = {}
    needed = ("route_id", "service_id", "trip_id")
    for row in files.rows("trips.txt", needed, ("route_id", {route.id})):
        name, service = cells.name(row, "trip_id"), cells.name(row, "service_id")
        direction = cells.whole(row, "direction_id", 0, 1)
        if name in trips:
            problem = f"{name!r} stands in row {trips[name].row} already"
            cells.wrong(row.row, "trip_id", problem, "every trip of a route once")
        elif name and service:
            block, shape = row.text("block_id"), row.text("shape_id")
            trips[name] = FeedTrip(name, service, direction or 0, block, shape, row.row)
    return list(trips.values())


def read_calls(files: FeedFiles, trips: set[str]) -> dict[str, list[FeedCall]]:
    """
    Read the calls of trips.

    Parameters
    ----------
    files
        The feed.
    trips
        Identifiers of the trips that matter.

    Returns
    -------
    dict[str, list[FeedCall]]
        By trip, in the order of ``stop_sequence``.
    """
    cells = CellReader("stop_times.txt", files.mistakes)
    calls: dict[str, dict[int, FeedCall]] = {}
    needed = ("trip_id", "arrival_time", "departure_time", "stop_id", "stop_sequence")
    for row in files.rows("stop_times.txt", needed, ("trip_id", trips)):
        stop = cells.name(row, "stop_id")
        sequence = cells.whole(row, "stop_sequence", 0, 1_000_000)
        cells.needed(row, "stop_sequence", is_empty=sequence is None)
        times_s = cells.time_s(row, "arrival_time"), cells.time_s(row, "departure_time")
        distance = cells.number(row, "shape_dist_traveled", 0.0, 1e8)
        if sequence is None or not stop:
            continue
        own = calls.setdefault(row.text("trip_id"), {})
        if sequence in own:
            problem = f"{sequence} stands in row {own[sequence].row} of this trip already"
            cells.wrong(row.row, "stop_sequence", problem, "every number once in a trip")
        else:
            own[sequence] = FeedCall(stop, sequence, *times_s, distance, row.row)
    return {trip: [own[number] for number in sorted(own)] for trip, own in calls.items()}


def read_stops(files: FeedFiles, used: set[str]) -> dict[str, FeedStop]:
    """
    Read the stops that trips call at, and the stations that these belong to.

    Parameters
    ----------
    files
        The feed.
    used
        Identifiers that trips name.

    Returns
    -------
    dict[str, FeedStop]
        By identifier.
    """
    cells = CellReader("stops.txt", files.mistakes)
    rows: dict[str, FeedRow] = {}
    for row in files.rows("stops.txt", ("stop_id",)):
        name = cells.name(row, "stop_id")
        if name in rows and name in used:
            problem = f"{name!r} stands in row {rows[name].row} already"
            cells.wrong(row.row, "stop_id", problem, "every stop once")
        rows.setdefault(name, row)
    wanted = dict.fromkeys(name for name in rows if name in used)
    wanted |= dict.fromkeys(
        parent for name in wanted if (parent := rows[name].text("parent_station")) in rows
    )
    found = {}
    for name in wanted:
        row = rows[name]
        title = row.text("stop_name")
        trouble = text_trouble(title)
        if trouble:
            cells.wrong(row.row, "stop_name", trouble, "a name of up to 200 characters")
        if not title:
            why = "stops.txt has no stop_name for them"
            files.notes.assume("names of stops", "their identifiers", why)
        parent = row.text("parent_station")
        if parent and parent not in rows:
            problem = f"there is no stop {parent!r}"
            cells.wrong(row.row, "parent_station", problem, "a stop_id of the file, or nothing")
        lat_deg = cells.number(row, "stop_lat", -90.0, 90.0)
        lon_deg = cells.number(row, "stop_lon", -180.0, 180.0)
        if lat_deg is None or lon_deg is None:
            lat_deg = lon_deg = None
        found[name] = FeedStop(name, title or name, lat_deg, lon_deg, parent, row.row)
    return found


def read_frequencies(files: FeedFiles, trips: set[str]) -> list[FeedFrequency]:
    """
    Read how often trips are repeated.

    Parameters
    ----------
    files
        The feed.
    trips
        Identifiers of the trips that matter.

    Returns
    -------
    list[FeedFrequency]
        In file order.
    """
    cells = CellReader("frequencies.txt", files.mistakes)
    found = []
    needed = ("trip_id", "start_time", "end_time", "headway_secs")
    for row in files.rows("frequencies.txt", needed, ("trip_id", trips)):
        start_s, end_s = cells.time_s(row, "start_time"), cells.time_s(row, "end_time")
        headway_s = cells.whole(row, "headway_secs", 10, 86_400)
        exact = cells.whole(row, "exact_times", 0, 1)
        for column, value in zip(needed[1:], (start_s, end_s, headway_s), strict=True):
            cells.needed(row, column, is_empty=value is None)
        if start_s is None or end_s is None or headway_s is None:
            continue
        if end_s <= start_s:
            allowed = f"a time after {row.text('start_time')}; after midnight from 24 on"
            cells.wrong(row.row, "end_time", f"{row.text('end_time')} is not later", allowed)
            continue
        trip = row.text("trip_id")
        found.append(FeedFrequency(trip, start_s, end_s, headway_s, bool(exact), row.row))
    return found


def read_shapes(files: FeedFiles, shapes: set[str]) -> dict[str, list[ShapePoint]]:
    """
    Read the ways that trips take.

    Parameters
    ----------
    files
        The feed.
    shapes
        Identifiers of those that matter; all of them if there are none.

    Returns
    -------
    dict[str, list[ShapePoint]]
        By identifier, in order; one with fewer than two points is left out.
    """
    cells = CellReader("shapes.txt", files.mistakes)
    found: dict[str, list[ShapePoint]] = {}
    needed = ("shape_id", "shape_pt_lat", "shape_pt_lon", "shape_pt_sequence")
    for row in files.rows("shapes.txt", needed, ("shape_id", shapes) if shapes else None):
        lat_deg = cells.number(row, "shape_pt_lat", -90.0, 90.0)
        lon_deg = cells.number(row, "shape_pt_lon", -180.0, 180.0)
        sequence = cells.whole(row, "shape_pt_sequence", 0, 10_000_000)
        for column, value in zip(needed[1:], (lat_deg, lon_deg, sequence), strict=True):
            cells.needed(row, column, is_empty=value is None)
        if lat_deg is not None and lon_deg is not None and sequence is not None:
            point = ShapePoint(sequence, lat_deg, lon_deg)
            found.setdefault(row.text("shape_id"), []).append(point)
    return {name: sorted(points) for name, points in found.items() if len(points) > 1}


def origin_of(files: FeedFiles) -> tuple[str, str]:
    """
    Return where a feed comes from.

    Parameters
    ----------
    files
        The feed.

    Returns
    -------
    tuple[str, str]
        Publisher, version and agencies in a few words; whom ``attributions.txt`` names.
    """
    parts = []
    for row in files.rows("feed_info.txt", ()):
        told = [
            (word, row.text(column))
            for word, column in (
                ("published by", "feed_publisher_name"),
                ("at", "feed_publisher_url"),
                ("version", "feed_version"),
                ("for days from", "feed_start_date"),
                ("to", "feed_end_date"),
            )
        ]
        parts.append(" ".join(f"{word} {text}" for word, text in told if text))
    agencies = [row.text("agency_name") for row in files.rows("agency.txt", ())]
    agencies = list(dict.fromkeys(filter(None, agencies)))
    if agencies:
        parts.append(f"agency {', '.join(agencies[:5])}")
    named = []
    for row in files.rows("attributions.txt", ()):
        name, page = row.text("organization_name"), row.text("attribution_url")
        named.append(" ".join(filter(None, (name, page))))
    return "; ".join(filter(None, parts)), ", ".join(dict.fromkeys(filter(None, named)))
